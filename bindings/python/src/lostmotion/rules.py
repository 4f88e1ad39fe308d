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
hundred ripples, do not suppress another answer. Outlier runs are tested at the level of an answer.

Conventional: one false answer in a hundred campaigns.
"""

RUN_LEVEL = 0.05
"""Level of the tests in which runs are the samples: the sign-flip test, and the two-sided
comparison of two effects by their gains in each run. If the plan limits the sign-flip test to few
patterns, the least p that it allows is sufficient: three runs in which wear varies have only eight
sign patterns. With fewer runs than `sign_flips.runs_least` no p is as small as the level.

Conventional: the usual 5 % of a permutation test, beside the F test.
"""

GAIN_LEAST = 2.0
"""Least leave-one-run-out gain, nats.

Conventional: a likelihood ratio of e^2; twice that is the 4 of Akaike's criterion for two values.
"""

# Sizes: the least size that counts.

SIZE_LEAST = 0.1
"""Least size of a missing effect, rms relative to the noise: in practice recordings cannot
distinguish a model with an error of a tenth of the noise from an exact one.

Chosen: a tenth; the rms error of a model rises by half a per cent with it.
"""

LEFTOVER_SHARE = 0.12
"""The residual of a named effect due to its inexact form counts as missing above this share of its
size.

Chosen: on campaigns of tests/rig. With 0.1, one of 40 campaigns names another effect beside the
right one.
"""

FORM_SHARE = 0.0025
"""Form error of the baseline model relative to the rms of the lost motion. A piecewise linear
torsion curve with a few operators is not exact for any drive: smaller effects that depend only on
the load are not distinguished from this error.

Chosen: on campaigns of tests/rig. Without it, one of 18 campaigns names the right effect in place
of a wrong one, and tests/python/test_merged_evidence.py has two right effects in another order.
"""

# Selection: which of the candidates that count is the answer.

RIVAL_SHARE = 0.5
"""Two effects can be confounded only if the weaker one gains this share of the stronger one. A
candidate with less is not refitted. A refit that keeps less of the gain in the contest is not the
same optimum, and is repeated from another start. An effect that keeps less beside a newer one
explained what that does.

Chosen: half.
"""

# Refits: which candidates are fitted with the full model.

REFITS_MOST = 3
"""Number of the strongest effects, and of the strongest shapes, that are refitted.

Chosen: by the time of a diagnosis; if none of these passes, the next ones follow. No verdict of the
screened campaigns changes between two and three shapes.
"""

WORSE = 1.2
"""A step that increases the unwhitened residual by more than this factor is rejected. The residual
is that without the form error: beside one, a part of the torsion curve may pass into it.

Chosen: on tests/python/test_form_error.py, where the estimated noise is 1.22 arcsec without it, and
the true one 1.06.
"""

# Verdict: what is stated about the answer.

TWIN_DEG = 10.0
"""Effects within this angle are confounded with this plan, and a shape contains such an effect. An
effect, or a shape, with fewer values that gains as much as one at this angle is selected.

Chosen: each explains 97 % of the sum of squares of the other.
"""

WARN_DEG = 30.0
"""Effects within this angle are hard to separate. A named effect that gains as much as one at this
angle from the best shape is selected: a real effect never has exactly the form of the library. An
effect that is confounded with the form error must explain as much of that.

Chosen: each explains three quarters of the sum of squares of the other.
"""

FORM_EXPLAINS = 0.5
"""Share of what functions of the torque's history can explain that another form of the hysteresis
must explain to be selected: less may be a missing effect that the operators imitate.

Chosen: half, on even seeds of tests/rig/laboratory.py and a few of the older rig.
"""

HARM_MOST = 0.05
"""An effect that increases the error of runs of one setting, predicted from the others, by more
than this is not recommended.

Conventional: 5 % at an amplitude that was left out.
"""

OUTLIER_RUNS_SHARE_MOST = 0.2
"""Largest share of outlier runs.

Conventional: Rosner assumes that outliers are few. With a fifth, the test keeps its level within
40 % from 5 runs on (tests/python/test_nulls_outlier_runs.py); with half it does not.
"""

# Recordings: sudden changes, outliers, and noise that is a drift.

SUDDEN_LEAST = 10.0
"""Least score of a step, in standard deviations: Gaussian noise alone reaches 5 in 1e5 samples, and
the residual of an effect or baseline whose form is not exact, a little over 8. A jump of the
input's encoder is examined above the same multiple of the usual change from sample to sample.

Chosen: on campaigns of tests/rig.
"""

OUTLIER = 7.0
"""A single sample that deviates from its neighbours by this many standard deviations is an outlier.

Chosen: Gaussian noise reaches it in one of 4e11 samples. With 10, the left-out runs of the preload
series in tests/data are predicted 0.5 % worse.
"""

OUTLIERS_ALONE = 5
"""Outliers that a run may have when the others have none: many more in one run are an effect that
the model lacks.

Chosen: on campaigns of tests/rig. Without this and the next one, a third effect is added to two
right ones in tests/python/test_merged_evidence.py.
"""

OUTLIERS_MOST = 0.03
"""If this share of all samples deviates, none is an outlier: it is the behaviour of the drive.

Chosen: three times the share of wild samples in the worst logs of tests/rig, half the share due to
steps of friction in the logs of a printed reducer.
"""

PERSISTENCE_MAX = 0.95
"""Largest sum of the coefficients: noise that lasts longer is a drift, and counts as something that
is missing from the model. The fit could also drift, because slow deviations would have no weight.

Chosen: on campaigns of tests/rig. Without it a random walk is taken for noise
(tests/python/test_discover_statistics.py).
"""
