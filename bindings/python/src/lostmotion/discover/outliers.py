"""Outliers: single samples far from their neighbours, replaced by interpolation."""

from __future__ import annotations

import numpy as np

from lostmotion import rules
from lostmotion.arrays import BoolArray, FloatArray
from lostmotion.fit.baseline import BaselineModel
from lostmotion.rms import robust_rms

JUMP = 6.0
"""Change of the torque, or of the modelled angle, from sample to sample, relative to the median of
the run, that counts as a jump."""

JUMP_REACH = 2
"""Samples on either side of a jump that belong to it."""


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
        least = rules.OUTLIER * (robust_rms(off) + 1e-12)
        found[at] = (np.abs(off) > least) & ~jumping(base.conditions.torque[at])
        may_be[at] = spiking(base.measured[at], least) | crossing(point.elastic[at])
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
    change = np.diff(torque_Nm, prepend=torque_Nm[0])
    return near_jumps(change, np.pad(np.diff(torque_Nm, n=2), 1))


def crossing(elastic: FloatArray) -> BoolArray:
    """Samples of a run about every crossing of a gap from one sample to the next."""
    return near_jumps(np.diff(elastic, prepend=elastic[0]))


def near_jumps(*changes: FloatArray) -> BoolArray:
    """Samples of a run about those at which one of the changes is much greater than usual."""
    jumped = np.zeros(changes[0].size, dtype=bool)
    for change in changes:
        size = np.abs(change)
        jumped |= size > JUMP * float(np.median(size)) + 1e-12
    return np.convolve(jumped, np.ones(2 * JUMP_REACH + 1), mode="same") > 0


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
