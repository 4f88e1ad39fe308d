"""Outliers: single samples far from their neighbours, replaced by interpolation."""

from __future__ import annotations

import numpy as np

from lostmotion import rules
from lostmotion.arrays import BoolArray, FloatArray
from lostmotion.fit.baseline import BaselineModel
from lostmotion.rms import robust_rms

JUMP = 6.0
"""Change of the torque from sample to sample, relative to the median of the run, that counts as a
jump."""

JUMP_REACH = 2
"""Samples on either side of a jump, or of the crossing of a gap, that belong to it."""

GAP_COMPLIANCE = 6.0
"""Compliance of a gap, relative to the mean one of the drive. The first slope of the data sheets in
tests/data is up to 2.4 times as compliant as the third, and 8 times where it is the clearance of a
printed reducer."""


def clean_outliers(base: BaselineModel) -> int:
    """Replace single outlying samples by their neighbours; returns their number.

    An outlier is off its neighbours relative to the model. This is also so where the model lacks an
    effect, so it must be a spike of what was measured as well, or lie where a gap is crossed: there
    the residual depends on the place of the crossing, which the least error of the hysteresis
    moves.

    Outliers are counted and reported. Rows are kept, because the noise within a run is coloured.
    """
    point = base.at()
    residual = base.residual(point)
    found, may_be = np.zeros((2, residual.size), dtype=bool)
    for at in base.conditions.slices():
        x = residual[at]
        if x.size < 5:
            continue
        neighbours = np.empty((4, x.size))
        for row, shift in enumerate((-2, -1, 1, 2)):
            neighbours[row] = np.roll(x, shift)
        off = x - np.median(neighbours, axis=0)
        # At the ends of a run, all neighbours are on one side.
        for i in (0, 1, -2, -1):
            five = x[:5] if i >= 0 else x[-5:]
            off[i] = x[i] - np.median(np.delete(five, i))
        scale = robust_rms(off) + 1e-12
        torque = base.conditions.torque[at]
        crossed = crossing(point.elastic[at], torque, base.curve.mean_slope, scale)
        may_be[at] = spiking(base.measured[at], rules.OUTLIER * scale) | crossed
        found[at] = (np.abs(off) > rules.OUTLIER * scale) & ~jumping(torque)
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
    found &= may_be
    if found.any():
        good = np.flatnonzero(~found)
        bad = np.flatnonzero(found)
        filled = np.interp(bad, good, residual[good])
        level = base.conditions.run_mean(base.measured - point.angle)[base.conditions.run_of]
        base.measured = base.measured.copy()
        base.measured[bad] = point.angle[bad] + level[bad] + filled
    base.outlier = base.outlier | found
    return int(np.count_nonzero(found))


def jumping(torque_Nm: FloatArray) -> BoolArray:
    """Samples at which the load changes much faster than usual in the run, or reverses.

    These samples carry most information on lag and creep, and no model without these effects fits
    them.
    """
    change = np.abs(np.diff(torque_Nm, prepend=torque_Nm[0]))
    bend = np.pad(np.abs(np.diff(torque_Nm, n=2)), 1)
    out = np.zeros(torque_Nm.size, dtype=bool)
    for size in (change, bend):
        out |= size > JUMP * (float(np.median(size)) + 1e-12)
    return np.convolve(out, np.ones(2 * JUMP_REACH + 1), mode="same") > 0


def spiking(measured: FloatArray, least: float) -> BoolArray:
    """Samples off the straight lines through the two before and the two after, to the same side.

    Neither a step nor a kink is. At the ends of a run, where one of the lines is missing, every
    sample may be one.
    """
    before, after = (
        measured - 2.0 * np.roll(measured, sense) + np.roll(measured, 2 * sense)
        for sense in (1, -1)
    )
    out = (before * after > 0.0) & (np.minimum(np.abs(before), np.abs(after)) > least)
    out[:2] = out[-2:] = True
    return np.asarray(out)


def crossing(elastic: FloatArray, torque_Nm: FloatArray, mean: float, noise: float) -> BoolArray:
    """Samples of a run about every crossing of a gap from one sample to the next.

    There the modelled elastic angle moves further than the change of the torque explains, by more
    than the noise.

    Parameters
    ----------
    elastic : ndarray
        Modelled angle, arc seconds.
    torque_Nm : ndarray
    mean : float
        Mean compliance of the drive, arc seconds per N m.
    noise : float
        Of a sample, arc seconds.
    """
    explained = GAP_COMPLIANCE * mean * np.abs(np.diff(torque_Nm))
    crossed = np.abs(np.diff(elastic)) - explained > noise
    beside = np.ones(2 * JUMP_REACH)
    return np.convolve(crossed, beside)[JUMP_REACH - 1 : elastic.size + JUMP_REACH - 1] > 0
