"""The thresholds that can change a verdict, with meaning and source.

Derived: it follows from other quantities. Conventional: it is usual in the field. Chosen: with the
stated basis. All other modules import them by name, so that a threshold can be varied everywhere at
once.
"""

# Gates: what every candidate must pass.

P_LIMIT = 0.01
"""Of the F test, over all candidates; the sign flips have their own level. It is shared evenly
among the kinds of candidates, and within a kind among its tests (Bonferroni): a hundred ripples,
each of which shows within every run, do not drown the few ways in which runs may differ.

Conventional: one false answer in a hundred campaigns.
"""

FLIP_LEVEL = 0.05
"""Level of the sign flips where many runs carry a candidate ...

Conventional: the usual 5 % of a permutation test, beside the F test.
"""

FLIP_ROOM = 2.0
"""... and its limit over what the flips could reach at best, where the plan lets few runs show it:
three runs that wear could be seen in have eight patterns of signs, whatever they say.

Chosen: on campaigns of tests/rig.
"""

GAIN_LEAST = 2.0
"""Least leave-one-run-out gain, nats.

Derived: a likelihood ratio of e^2; twice that is the 4 of Akaike for two values.
"""

P_SURE = 1e-3
"""A shape whose p over all candidates is larger must also lower the leave-one-run-out error.

Chosen: a tenth of `P_LIMIT`.
"""

# Sizes: what is large enough to count.

SIZE_LEAST = 0.1
"""Least size of what is called missing, rms over the noise: a model that is off by a tenth of the
noise is as good as recordings can tell in practice.

Derived: at a tenth of the noise the rms error of a model rises by half a per cent.
"""

TAKEN_UP = 1 / 3
"""An effect of this share of the least size may be larger than it looks where the runs' own
stiffness and gap have taken it up: it is refitted, and the error of all runs together tells.

Chosen: on campaigns of tests/rig.
"""

SHAPE_AFTER_NAMED = 0.25
"""Least size over the noise of a shape that is called missing beside a named effect: below it the
named effect explains the misfit, only not in every detail.

Chosen: on campaigns of tests/rig.
"""

LEFTOVER_SHARE = 0.12
"""Residual of a named effect because its form is not exactly right counts as missing from this
share of its size on.

Chosen: on campaigns of tests/rig.
"""

TWIN_SHARE = 0.3
"""The same share for an effect that is known to be confused with one in the model ...

Chosen: on campaigns of tests/rig.
"""

ALIKE_SHARE = 0.25
"""... and of which that one could do this share here: a plan may show well apart what others do
not, as orders 2 and 2.02 of a turn over a whole turn of the output.

Chosen: on campaigns of tests/rig.
"""

FORM_SHARE = 0.0025
"""Exactness of the baseline's form, over the rms of the lost motion.

A torsion curve of straight pieces and a few operators on the torque is not exact for any drive.
What depends on the load alone and is smaller is not distinguished from that.

Chosen: on campaigns of tests/rig.
"""

# Choice: which of those that count is the answer.

NAMED_SHARE = 0.75
"""A named effect that reaches this share of the best shape's gain is the answer: a real effect
never has exactly the form of the library.

Chosen: on campaigns of tests/rig.
"""

SIMPLER_SHARE = 0.97
"""An effect, or a shape, with fewer values that reaches this share of the best one's gain is the
answer.

Chosen: on campaigns of tests/rig.
"""

NESTED_DEG = 5.0
"""A shape within this angle of a named effect contains it.

Chosen: on campaigns of tests/rig.
"""

PAIRED_T = 2.0
"""Paired t over runs below which two effects are confounded ...

Conventional: two standard deviations, 5 % two-sided with many runs.
"""

SIGNED_RANK = 2.6
"""... nor by the signed ranks of the runs, in standard deviations: where one run says most, t is
about 1 whatever the others say ...

Conventional: 1 % two-sided of a normal deviate.
"""

RIVAL_SHARE = 0.5
"""... provided that the weaker one gains this share of the stronger one.

Chosen: on campaigns of tests/rig.
"""

FAR = 3.0
"""Times its tangent's gain from which on a refit tells more than the tangents of its rivals.

Chosen: on campaigns of tests/rig.
"""

TERMS_MAX = 4
"""Effects and shapes that are taken into the model, at most.

Chosen: on campaigns of tests/rig.
"""

RUNS_PER_TERM = 4
"""An effect for every so many runs, at most.

Chosen: on campaigns of tests/rig.
"""

# Refits: which candidates are fitted in truth.

REFITS_NAMED = 3
"""How many of the strongest are refitted.

Chosen: by the time of a diagnosis; where none of these stands, those behind them follow.
"""

REFITS_SHAPES = 2
"""How many of the strongest are refitted.

Chosen: as `REFITS_NAMED`.
"""

REFIT_SHARE = 0.25
"""Share of the best gain below which a candidate is not refitted.

Chosen: as `REFITS_NAMED`.
"""

CLEAR_SHARE = 0.6
"""A shape with less than this share of the leading named effect's gain is not refitted.

Chosen: as `REFITS_NAMED`.
"""

STRAYED = 0.1
"""A run whose friction deviates by more than this share may hide an effect in it: candidates are
then judged from the baseline model without deviations as well.

Chosen: on campaigns of tests/rig.
"""

WANDERING = 2.0
"""Noise whose spread is this many times its innovations wanders so slowly that it may be a
missing effect: the strongest candidates are then refitted before the noise is believed.

Chosen: on campaigns of tests/rig.
"""

CALMER = 0.9
"""Share of the spread below which the noise after such a refit is the one that is believed.

Chosen: on campaigns of tests/rig.
"""

PROMISE_KEPT = 0.5
"""Share of the gain in the contest below which a refit has gone astray.

Chosen: on campaigns of tests/rig.
"""

WORSE = 1.2
"""A step that lets the plain residual grow by more than this has left what is known.

Chosen: on campaigns of tests/rig.
"""

# Verdict: what is stated of the answer.

RUNS_LEAST = 6
"""With fewer runs the smallest p of sign flips is above 0.05: no names.

Derived: 2^-(n-1) < 0.05 for n = 6, of the signs of the runs.
"""

TWIN_DEG = 10.0
"""Effects within this angle are confounded with this plan.

Derived: 97 % of the one's square is the other's.
"""

WARN_DEG = 30.0
"""Effects within this angle are hard to separate.

Derived: three quarters of the one's square are the other's.
"""

POWER = 0.8
"""Chance with which the smallest detectable size would be found.

Conventional: the power of a planned test.
"""

IMPLAUSIBLE = 100.0
"""A value this many times the typical one is marked.

Chosen: two powers of ten.
"""

FORM_EXPLAINS = 0.5
"""Share of the error above the measurement noise that another form of the hysteresis must take to
be the baseline model: less may be an effect that is missing, whose form the operators resemble.

Chosen: half, on even seeds of tests/rig/laboratory.py and a few of the older rig; not judged on
others.
"""

HARM_MOST = 0.05
"""An effect that raises the error of runs of one setting, predicted from those of the others, by
more than this is not recommended.

Conventional: what is asked of a recommended effect, 5 % at an amplitude that was left out.
"""

# Runs that stand apart.

OUTLIER_RUNS_LEVEL = 0.002
"""Chance that a campaign of nothing but scatter has runs that are said to stand apart.

Chosen: a fifth of `P_LIMIT`.
"""

OUTLIER_RUNS_TESTED_LEAST = 15
"""With fewer runs the test does not keep its level (Rosner).

Conventional: Rosner, Technometrics 25 (1983) 165.
"""

OUTLIER_RUNS_SHARE_MOST = 0.2
"""More than this share of the runs does not stand apart from the others.

Conventional: as Rosner, for whom outliers are few.
"""

OUTLIER_RUNS_ALIKE_LEAST = 3
"""So many runs that stand apart and are just those of one load depend on the recorded load:
what the form of the baseline model does not meet there is no unknown cause.

Chosen: on campaigns of tests/rig.
"""

OUTLIER_RUNS_FAR_LOAD = 2.0
"""Runs whose load is so many times as large as any smaller one, and any larger one so many times
theirs, are alone in telling how the drive acts there: even two that all lean to one side do ...

Chosen: on campaigns of tests/rig.
"""

OUTLIER_RUNS_LEANS = 1.0
"""... by at least this of the spread, those beside the ones that stand apart.

Chosen: on campaigns of tests/rig.
"""

OUTLIER_RUNS_TOLD_LEAST = 0.1
"""Least share of a part's variance that a run's recordings must tell: a run that never reverses
says nothing of friction.

Chosen: on campaigns of tests/rig.
"""

# Sudden events.

EVENT_SCORE_LEAST = 10.0
"""Least score of a step, in standard deviations: Gaussian noise alone reaches 5 in 1e5 samples, and
the residual of an effect or baseline whose form is not exact, a little over 8 ...

Chosen: on campaigns of tests/rig.
"""

EVENT_TAIL_FACTOR = 1.5
"""... and over the largest score that the other runs reach, where the noise has long tails.

Chosen: on campaigns of tests/rig.
"""

EVENT_SIZE_LEAST = 0.5
"""Least size of a step over the noise within runs.

Chosen: on campaigns of tests/rig.
"""

EVENT_SEEN_SHARE = 0.5
"""Share of a step by which the medians before and behind it must differ: one wild sample, or a few
that steer the run's own curve, make a step in the fit, but none that can be seen ...

Chosen: on campaigns of tests/rig.
"""

EVENT_SEEN_ROWS = 100.0
"""... over so many samples times (noise / step)^2, so that noise does not hide it.

Derived: the median of so many samples is known within an eighth of the step.
"""

LOST_COUNTS_LEAST = 6.0
"""Least jump of the input's encoder that is examined, seen at the output, over the scatter of the
lost motion from sample to sample.

Chosen: on campaigns of tests/rig.
"""

# What is set aside, and how runs are parted.

OUTLIER = 7.0
"""A single sample that is this many deviations off its neighbours is an outlier.

Chosen: Gaussian noise reaches it in one of 4e11 samples.
"""

OUTLIERS_ALONE = 5
"""Outliers that a run may have when the others have none.

Chosen: on campaigns of tests/rig.
"""

OUTLIERS_MOST = 0.03
"""Share of all samples from which on none is an outlier: what is that common is how the drive acts.

Chosen: three times the wild samples of the worst logs of tests/rig, half of what the steps of
friction make in the logs of a printed reducer.
"""

WHOLE_TOOTH = 0.2
"""How far a jump may be from whole teeth, in teeth: the load moves the drive, too.

Chosen: a fifth of a tooth, far beyond any noise and short of the next whole one.
"""

SIDE_LEAST = 2
"""Runs on either side: what a single run does no other run can confirm.

Derived: one run confirms nothing.
"""

SAME_RATE = 1.25
"""Runs whose load changes as quickly within this factor are of one rate: the noise of the torque
makes each a little different, and no cause sets in between them.

Chosen: on campaigns of tests/rig.
"""

PERSISTENCE_MAX = 0.95
"""Largest sum of the coefficients: noise that lasts longer is a drift, and counts as something that
is missing from the model. It would also let the fit wander, because nothing slow would count.

Chosen: on campaigns of tests/rig.
"""
