"""Frozen readings: a sensor repeats one reading while the measured quantity changes.

A logger repeats the last reading if a bus, an amplifier or a driver hangs. The section is as long
as the fault, so it is not a burst, and each reading is plausible. Three signs together show it: the
channel repeats its readings only there; the other channel covers a large part of its range
meanwhile; and at the end only this reading jumps to the present state of the drive, or the other
channel covers half its range, nothing turns, and the drive has returned. A held load repeats as
well, but the drive is at rest or jumps with it; a coarse encoder repeats always. A single late
torque repeats the last one while the lost motion covers half of its change (`late_readings`); an
angle that repeats may be that of a drive that sticks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray
from lostmotion.recordings.bursts import DEVIATIONS, local_noise

FROZEN_LEAST = 8
"""Least number of readings of a frozen section; a shorter one is treated as a burst, or by
`late_readings`."""

REPEATED_MAX = 0.01
"""Largest share of repeated readings of a channel in which single late readings can be detected."""

HALFWAY = (0.25, 0.75)
"""Range of the share of a change over two steps that the other channel covers in the first step."""

LATE_DEVIATIONS = 12.0
"""Least size of these two steps relative to the noise of either channel: estimated torques of motor
drives have tails that reach 10."""

CHANCE = 1e-6
"""Probability, from the share of repeated readings elsewhere in the run, below which a section of
repeated readings is not due to chance.
"""

OTHER_SWING = 0.25
"""Share of its range by which the other channel must move meanwhile."""

NO_JUMP_SWING = 0.5
"""The same if the reading does not jump: more than a drive creeps under a constant load."""

RANGE = (0.01, 0.99)
"""Quantiles that define the range of a channel, robust against outliers."""

TURN_LEAST_RAD = 0.2
"""Rotation of the output beyond any wind-up, so that the input must turn with it."""

JUMP = 4.0
"""Least ratio of the step that ends a frozen section to the largest adjacent step."""

SATURATED_LEAST = 3
"""Least number of readings at an end of the range of a saturated channel."""

SATURATED_MOST = 1000
"""Most sections at an end of the range in one run: a channel with more has few values. Chosen."""

SATURATED_SWING = 0.02
"""Share of its range by which the other channel goes beyond and back meanwhile. Chosen."""

BESIDE = 10
"""Steps on either side of a section for comparison with the step at its end."""


def frozen_rows(columns: Mapping[str, FloatArray], ratio: float | None) -> dict[str, BoolArray]:
    """Mark the frozen readings of torque and angles.

    The first of each section is a sound reading, unless the channel leaps to it.

    Parameters
    ----------
    columns : mapping
        Quantities of one run before any repair; NaN if missing.
    ratio : float, optional
        Input turns for one output turn.
    """
    found: dict[str, BoolArray] = {}
    for name, other, swing in witnesses(columns, ratio):
        rows = np.flatnonzero(np.isfinite(columns[name]) & np.isfinite(other))
        if rows.size < 2 * FROZEN_LEAST:
            continue
        turned = columns.get("output_angle", np.zeros(other.size))[rows]
        marked = frozen(columns[name][rows], other[rows], swing, turned)
        if name == "torque":
            marked |= late_readings(columns[name][rows], other[rows])
            marked |= saturated(columns[name][rows], other[rows], turned)
        if marked.any():
            found.setdefault(name, np.zeros(other.size, dtype=bool))[rows[marked]] = True
    return found


def witnesses(
    columns: Mapping[str, FloatArray], ratio: float | None
) -> list[tuple[str, FloatArray, float | None]]:
    """List each channel with a related channel, and the required motion of the latter.

    None: a share of the range of the other channel.
    """
    pairs: list[tuple[str, FloatArray, float | None]] = []
    angle = next((name for name in ("lost_motion", "output_angle") if name in columns), None)
    if angle is not None:
        pairs += [("torque", columns[angle], None), (angle, columns["torque"], None)]
    if {"input_angle", "output_angle"} <= columns.keys():
        by = 1.0 if ratio is None or math.isinf(ratio) else abs(ratio)
        pairs += [
            ("input_angle", columns["output_angle"], TURN_LEAST_RAD),
            ("output_angle", columns["input_angle"] / by, TURN_LEAST_RAD),
        ]
    return pairs


def frozen(
    values: FloatArray, other: FloatArray, swing: float | None, turned_rad: FloatArray
) -> BoolArray:
    """Mark the frozen readings of a channel, and the first of a section if the channel leaps to it.

    Parameters
    ----------
    values, other : ndarray
        The channel, and a related channel ...
    swing : float, optional
        ... and its least motion; by default `OTHER_SWING` of its range.
    turned_rad : ndarray
        Angle of the output: under a held load the lost motion varies as the drive turns.
    """
    marked = np.zeros(values.size, dtype=bool)
    step = np.diff(values)
    edges = np.concatenate(([0], np.flatnonzero(step != 0) + 1, [values.size]))
    lengths = np.diff(edges)
    if not np.any(lengths >= FROZEN_LEAST):
        return marked
    low, high = np.quantile(other, RANGE)
    extent = float(high - low)
    swing = OTHER_SWING * extent if swing is None else swing
    if swing <= 0:
        return marked
    for i in np.flatnonzero(lengths >= FROZEN_LEAST):
        begin, end = int(edges[i]), int(edges[i + 1])
        elsewhere = values.size - (end - begin)
        repeats = int(np.count_nonzero(step == 0)) - (end - begin - 1)
        share = (repeats + 1.0) / (elsewhere + 1.0)
        if elsewhere < FROZEN_LEAST or share ** (end - begin - 1) * values.size > CHANCE:
            continue
        moved = float(np.ptp(other[begin:end]))
        jumped = end == values.size or jumps_behind(step, begin, end)
        alone = end == values.size or not jumps_behind(np.diff(other), begin, end)
        still = float(np.ptp(turned_rad[begin:end])) < TURN_LEAST_RAD
        if moved >= swing and alone and (jumped or (still and moved > NO_JUMP_SWING * extent)):
            # A marker of the device, such as zero, is none of the readings of the channel.
            leapt = leapt_to(values, begin)
            marked[begin + (not leapt) : end] = True
    return marked


def late_readings(values: FloatArray, other: FloatArray) -> BoolArray:
    """Mark single torques that repeat the last one while the other channel continues to move.

    Only in a channel that seldom repeats a reading: a channel with few values or a slower clock
    repeats readings all the time.
    """
    marked = np.zeros(values.size, dtype=bool)
    rows = np.flatnonzero(np.diff(values) == 0) + 1
    if rows.size > REPEATED_MAX * values.size:
        return marked
    for row in rows[rows + 1 < values.size]:
        way, other_way = (x[row + 1] - x[row - 1] for x in (values, other))
        noise, other_noise = local_noise(values, row), local_noise(other, row)
        if abs(way) > LATE_DEVIATIONS * noise and abs(other_way) > LATE_DEVIATIONS * other_noise:
            share = (other[row] - other[row - 1]) / other_way
            marked[row] = HALFWAY[0] <= share <= HALFWAY[1]
    return marked


def jumps_behind(step: FloatArray, begin: int, end: int) -> bool:
    """Whether the step after a section is far larger than its neighbours."""
    near = np.concatenate((step[max(begin - 1 - BESIDE, 0) : begin], step[end : end + BESIDE]))
    return bool(near.size > 0 and abs(step[end - 1]) > JUMP * np.max(np.abs(near)))


def leapt_to(values: FloatArray, begin: int) -> bool:
    """Whether a channel departs from its course to a value: by far more than it bent before."""
    before = values[max(begin - BESIDE, 0) : begin]
    if before.size < 3:
        return False
    bends = np.abs(np.diff(before, 2))
    off = abs(values[begin] - (2 * before[-1] - before[-2]))
    return bool(off > JUMP * max(float(bends.max()), float(np.abs(np.diff(before)).max()) / 2))


def saturated(values: FloatArray, other: FloatArray, turned_rad: FloatArray) -> BoolArray:
    """Mark the readings at an end of the range of the channel while the drive went beyond and back.

    An amplifier repeats its largest reading there, longer than it repeats others: a slower clock
    repeats all. Under a held load the drive creeps in one direction.
    """
    marked = np.zeros(values.size, dtype=bool)
    changes = np.flatnonzero(np.diff(values)) + 1
    lengths = np.diff(np.concatenate(([0], changes, [values.size])))
    inside = (values != values.max()) & (values != values.min())
    usual = int(np.max(np.repeat(lengths, lengths), where=inside, initial=1))
    for level in (values.max(), values.min()):
        same = values == level
        edges = np.flatnonzero(np.diff(np.concatenate(([False], same, [False])).astype(int)))
        if edges.size > 2 * SATURATED_MOST:
            continue
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            if end - begin < max(SATURATED_LEAST, usual + 1) or begin == 0 or end == values.size:
                continue
            within = other[begin:end]
            ends = within[[0, -1]]
            beyond = max(float(within.max() - ends.max()), float(ends.min() - within.min()))
            noise = local_noise(other, (begin + end) // 2)
            still = float(np.ptp(turned_rad[begin:end])) < TURN_LEAST_RAD
            if still and beyond > max(DEVIATIONS * noise, SATURATED_SWING * np.ptp(other)):
                marked[begin:end] = True
    return marked
