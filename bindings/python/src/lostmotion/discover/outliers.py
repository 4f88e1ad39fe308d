"""Outliers: single samples far from their neighbours, replaced by interpolation."""

from __future__ import annotations

import numpy as np

from lostmotion import rules
from lostmotion.arrays import FloatArray
from lostmotion.fit.baseline import BaselineModel
from lostmotion.rms import robust_rms


def clean_outliers(base: BaselineModel) -> int:
    """Replace single outlying samples by their neighbours; returns their number.

    An outlier is off the samples before it and off those after it, to the same side. So is what was
    measured there off the straight lines through these samples: where the measured angle passes
    from one level to another, the model alone makes a peak. Where the modelled angle is further off
    its neighbours, as at a reversal or a jump of the load, an error of the model explains that:
    such samples are kept.

    Outliers are counted and reported. Rows are kept, because the noise within a run is coloured.
    """
    residual, angle = base.residual(), base.angle()
    found = np.zeros(residual.size, dtype=bool)
    for at in base.conditions.slices():
        if residual[at].size < 5:
            continue
        before, after = off_both_sides(residual[at])
        scale = robust_rms(0.5 * (before + after)) + 1e-12
        sides = np.array((before, after, *off_both_sides(base.measured[at], lines=True)))
        off = np.where(np.ptp(np.sign(sides), axis=0) == 0.0, np.min(np.abs(sides), axis=0), 0.0)
        modelled = 0.5 * np.abs(sum(off_both_sides(angle[at])))
        found[at] = off > np.maximum(rules.OUTLIER * scale, modelled)
    # Many adjacent ones are not outliers but a feature of the signal.
    crowd = np.convolve(found, np.ones(7))[3:-3]
    found &= crowd <= 3
    counts = np.array([np.count_nonzero(found[at]) for at in base.conditions.slices()])
    rows = np.diff(base.conditions.starts)
    for r, at in enumerate(base.conditions.slices()):
        # Outliers occur in any run. Many more in one run are an effect that the model lacks.
        usual = float(np.median(np.delete(counts / rows, r))) if counts.size > 1 else 0.0
        expected = usual * float(rows[r])
        if counts[r] > rules.OUTLIERS_ALONE + expected + 3.0 * np.sqrt(expected):
            found[at] = False
    if np.mean(found) > rules.OUTLIERS_MOST:
        found[:] = False
    if found.any():
        point = base.at()
        good = np.flatnonzero(~found)
        bad = np.flatnonzero(found)
        filled = np.interp(bad, good, residual[good])
        level = base.conditions.run_mean(base.measured - point.angle)[base.conditions.run_of]
        base.measured = base.measured.copy()
        base.measured[bad] = point.angle[bad] + level[bad] + filled
    base.outlier = base.outlier | found
    return int(np.count_nonzero(found))


def off_both_sides(values: FloatArray, *, lines: bool = False) -> tuple[FloatArray, FloatArray]:
    """Difference of every sample from the mean of the two before it, and of the two after it.

    With `lines` from the straight line through them. Where they are not both in the run, from the
    nearest sample.
    """
    near, far = (2.0, -1.0) if lines else (0.5, 0.5)
    before, after = (
        values - near * np.roll(values, sense) - far * np.roll(values, 2 * sense)
        for sense in (1, -1)
    )
    before[:2] = values[:2] - values[[1, 0]]
    after[-2:] = values[-2:] - values[[-1, -2]]
    return before, after
