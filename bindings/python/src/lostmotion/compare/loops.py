"""Loops of a recording: time under load, sections between reversals, width at zero torque."""

from __future__ import annotations

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.branches import directions
from lostmotion.effects.conditions import Conditions

BLOCKS_LEAST = 6
"""Least number of blocks: with fewer, nothing can be significant, because the smallest p is 2 /
2^blocks."""

LOADED_SHARE = 0.1
"""Share of the largest torque above which the drive counts as loaded."""

WIDTH_SHARE = 0.05
"""The width at zero torque is evaluated from samples within this share of a run's largest
torque."""

WIDTH_SAMPLES = 5
"""Least number of samples of a branch near zero for a width."""


def zero_widths(torque_Nm: FloatArray, angles: FloatArray) -> FloatArray | None:
    """Width of a loop where its torque is zero, for each column of angles.

    On each branch, a straight line through the samples near zero is evaluated at zero.

    Returns
    -------
    ndarray or None
        Falling branch minus rising branch; None if a branch does not pass through zero.
    """
    largest = float(np.max(np.abs(torque_Nm)))
    if largest == 0:
        return None
    rising, _ = directions(torque_Nm, largest)
    near = np.abs(torque_Nm) <= WIDTH_SHARE * largest
    at_zero = []
    for branch in (0, 1):
        chosen = near & (rising == branch)
        if np.count_nonzero(chosen) < WIDTH_SAMPLES or np.ptp(torque_Nm[chosen]) == 0:
            return None
        line = np.column_stack((np.ones(int(chosen.sum())), torque_Nm[chosen]))
        at_zero.append(np.linalg.lstsq(line, angles[chosen], rcond=None)[0][0])
    return np.asarray(at_zero[0] - at_zero[1], dtype=np.float64)


def time_under_load(c: Conditions) -> FloatArray:
    """Seconds since the drive was last unloaded or since the start of the run; 0 while unloaded."""
    loaded = np.abs(c.torque) > LOADED_SHARE * float(np.max(np.abs(c.torque)))
    rest = np.where(loaded, -np.inf, c.time_s)
    rest[c.starts[:-1]] = c.time_s[c.starts[:-1]]
    out = np.empty(c.rows)
    for at in c.slices():
        out[at] = c.time_s[at] - np.maximum.accumulate(rest[at])
    return np.maximum(out, 0.0)


def branch_blocks(starts: IntArray, direction: IntArray) -> IntArray:
    """Number the sections between reversals; long ones are split until there are enough."""
    change = np.diff(direction, prepend=direction[0]) != 0
    change[starts[1:-1]] = True
    blocks = np.cumsum(change)
    pieces = int(blocks[-1]) + 1
    if pieces < BLOCKS_LEAST:
        cut = -(-BLOCKS_LEAST // pieces)
        size = np.bincount(blocks)
        first = np.concatenate(([0], np.cumsum(size)[:-1]))
        inside = (np.arange(blocks.size) - first[blocks]) * cut // size[blocks]
        blocks = blocks * cut + inside
    return blocks.astype(np.intp)
