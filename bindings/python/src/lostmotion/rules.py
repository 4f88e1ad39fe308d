"""The thresholds that can change a verdict, with meaning and source.

Derived: it follows from other quantities. Conventional: it is usual in the field. Chosen: with the
stated basis. All other modules import them by name, so that a threshold can be varied everywhere at
once.
"""

# Gates: what every candidate must pass.

P_LIMIT = 0.01
"""Level of the F test over all candidates; the sign-flip test has its own level. It is divided
evenly between the answers of a round (the name of each effect, and each unnamed kind of shape), and
the share of an answer between its tests (Bonferroni). So the many starts of one effect, or a
hundred ripples, do not suppress another answer.

Conventional: one false answer in a hundred campaigns.
"""

FLIP_LEVEL = 0.05
"""Level of the sign-flip test if many runs support a candidate ...

Conventional: the usual 5 % of a permutation test, beside the F test.
"""

FLIP_ROOM = 2.0
"""... and its limit relative to the smallest possible p if the plan limits the test to few runs:
three runs in which wear varies have only eight sign patterns.

Chosen: on campaigns of tests/rig.
"""

GAIN_LEAST = 2.0
"""Least leave-one-run-out gain, nats.

Derived: a likelihood ratio of e^2; twice that is the 4 of Akaike for two values.
"""

# Sizes: the least size that counts.

SIZE_LEAST = 0.1
"""Least size of a missing effect, rms relative to the noise: in practice recordings cannot
distinguish a model with an error of a tenth of the noise from an exact one.

Derived: at a tenth of the noise the rms error of a model rises by half a per cent.
"""

LEFTOVER_SHARE = 0.12
"""The residual of a named effect due to its inexact form counts as missing above this share of its
size.

Chosen: on campaigns of tests/rig. Without it one of 11 campaigns of tests/rig/laboratory.py with an
effect of two noises names another effect beside the right one, and one reports a form error.
"""

FORM_SHARE = 0.0025
"""Form error of the baseline model relative to the rms of the lost motion.

A piecewise linear torsion curve with a few operators is not exact for any drive. Smaller effects
that depend only on the load are not distinguished from this error.

Chosen: on campaigns of tests/rig.
"""

# Selection: which of the candidates that count is the answer.

PAIRED_T = 2.0
"""Paired t and signed ranks of the runs, in standard deviations, below which two effects are
confounded. If one run dominates, t is about 1 regardless of the others, but their ranks are not ...

Conventional: two standard deviations, 5 % two-sided with many runs.
"""

RIVAL_SHARE = 0.5
"""... provided that the weaker one gains this share of the stronger one. A candidate with less
cannot be a rival, and is not refitted. A refit that keeps less of the gain in the contest is not
the same optimum, and is repeated from another start.

Chosen: half.
"""

# Refits: which candidates are fitted with the full model.

REFITS_NAMED = 3
"""Number of the strongest that are refitted.

Chosen: by the time of a diagnosis; if none of these passes, the next ones follow.
"""

REFITS_SHAPES = 2
"""Number of the strongest that are refitted.

Chosen: as `REFITS_NAMED`.
"""

WORSE = 1.2
"""A step that increases the unwhitened residual by more than this is rejected.

Chosen: on tests/python/test_form_error.py, where the noise floor is 1.22 arcsec without it, and the
noise 1.06.
"""

# Verdict: what is stated about the answer.

RUNS_LEAST = 6
"""With fewer runs the smallest p of the sign-flip test is above 0.05: no effect can be identified.

Derived: 2^-(n-1) < 0.05 for n = 6, of the signs of the runs.
"""

TWIN_DEG = 10.0
"""Effects within this angle are confounded with this plan, and a shape contains such an effect. An
effect, or a shape, with fewer values that gains as much as one at this angle is selected.

Derived: each explains 97 % of the sum of squares of the other.
"""

WARN_DEG = 30.0
"""Effects within this angle are hard to separate. A named effect that gains as much as one at this
angle from the best shape is selected: a real effect never has exactly the form of the library.

Derived: each explains three quarters of the sum of squares of the other.
"""

FORM_EXPLAINS = 0.5
"""Share of the error above the measurement noise that another form of the hysteresis must explain
to be selected: less may be a missing effect that the operators imitate.

Chosen: half, on even seeds of tests/rig/laboratory.py and a few of the older rig; not judged on
others.
"""

HARM_MOST = 0.05
"""An effect that increases the error of runs of one setting, predicted from the others, by more
than this is not recommended.

Conventional: 5 % at an amplitude that was left out.
"""

# Outlier runs.

OUTLIER_RUNS_LEVEL = 0.002
"""Probability that a campaign with only scatter is reported to have outlier runs.

Chosen: a fifth of `P_LIMIT`.
"""

OUTLIER_RUNS_TESTED_LEAST = 15
"""With fewer runs the test does not keep its level (Rosner).

Conventional: Rosner, Technometrics 25 (1983) 165.
"""

OUTLIER_RUNS_SHARE_MOST = 0.2
"""Largest share of outlier runs.

Conventional: Rosner assumes that outliers are few.
"""

OUTLIER_RUNS_TOLD_LEAST = 0.1
"""Least share of the variance of a part that the recordings of a run must determine: a run without
reversal does not determine friction.

Chosen: on campaigns of tests/rig.
"""

# Sudden events.

EVENT_SCORE_LEAST = 10.0
"""Least score of a step, in standard deviations: Gaussian noise alone reaches 5 in 1e5 samples, and
the residual of an effect or baseline whose form is not exact, a little over 8. A jump of the
input's encoder is examined above the same multiple of the usual change from sample to sample.

Chosen: on campaigns of tests/rig.
"""

EVENT_SEEN_SHARE = 0.5
"""Share of a step by which the medians before and after it must differ: one outlier, or a few that
dominate the run's own curve, cause a step in the fit, but no visible one.

Chosen: on campaigns of tests/rig.
"""

# Rows that are set aside, and groups of runs.

OUTLIER = 7.0
"""A single sample that deviates from its neighbours by this many standard deviations is an outlier.

Chosen: Gaussian noise reaches it in one of 4e11 samples.
"""

OUTLIERS_ALONE = 5
"""Outliers that a run may have when the others have none.

Chosen: on campaigns of tests/rig.
"""

OUTLIERS_MOST = 0.03
"""If this share of all samples deviates, none is an outlier: it is the behaviour of the drive.

Chosen: three times the share of wild samples in the worst logs of tests/rig, half the share due to
steps of friction in the logs of a printed reducer. """

WHOLE_TOOTH = 0.2
"""Largest distance of a jump from a whole number of teeth, in teeth: the load moves the drive as
well.

Chosen: a fifth of a tooth, far above any noise and below half a tooth, where the next number
begins.
"""

SIDE_LEAST = 2
"""Least number of runs on either side of a step: a change in a single run cannot be confirmed.

Derived: one run confirms nothing.
"""

SAME_RATE = 1.25
"""Loading rates that differ by less than this factor count as equal: the noise of the torque makes
each slightly different, and no effect begins between them.

Chosen: on campaigns of tests/rig.
"""

PERSISTENCE_MAX = 0.95
"""Largest sum of the coefficients: noise that lasts longer is a drift, and counts as something that
is missing from the model. The fit could also drift, because slow deviations would have no weight.

Chosen: on campaigns of tests/rig.
"""
