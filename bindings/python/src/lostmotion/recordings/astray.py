"""Impossible angle readings: 65535, -999, or a value of another column.

From one sample to the next they leave the range of the other readings of their run by more than
that range and a turn, the other shaft does not follow, and they return. They are found in the raw
readings, before whole turns are restored, because a correction for such a reading would affect the
following samples.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray
from lostmotion.recordings.bursts import BURST_AT_END
from lostmotion.recordings.encoders import COUNTER_BITS, TURN

SHARE_MAX = 0.25
"""Largest share of a run for which the quartiles, which define the range, are robust."""

RANGES = 2.0
"""Multiples of the interquartile range, on either side, that a shaft can reach: steady rotation
through the run reaches half of it.
"""

FOLLOWED = 0.5
"""Share of a motion that the other shaft must show for a real motion."""

MEASURED = ("torque", "input_angle", "output_angle")
"""Channels that all read zero without a connection; a thermometer may have its own."""

WHOLE = 0.02
"""Relative tolerance for a jump to equal an encoder modulus."""


def astray(
    angle_rad: FloatArray, other_rad: FloatArray, ratio: float, count_rad: float | None
) -> BoolArray:
    """Mark the impossible readings of one angle.

    Parameters
    ----------
    angle_rad, other_rad : ndarray
        Readings of both angles of one run, finite.
    ratio : float
        Turns of this shaft for one of the other, signed.
    count_rad : float or None
        Count of this encoder, where it is known.
    """
    marked = np.zeros(angle_rad.size, dtype=bool)
    low, middle, high = np.quantile(angle_rad, [0.25, 0.5, 0.75])
    reach = TURN + RANGES * (high - low)
    outside = (angle_rad < low - reach) | (angle_rad > high + reach)
    count = int(np.count_nonzero(outside))
    if count == 0 or count > SHARE_MAX * angle_rad.size:
        return marked
    rows = np.flatnonzero(outside)
    apart = angle_rad - ratio * other_rad
    for stretch in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
        first, last = stretch[0], stretch[-1]
        edges = [i for i in (first - 1, last) if i >= 0 and i + 1 < angle_rad.size]
        if len(edges) < 2 and stretch.size > BURST_AT_END:
            continue
        away = float(np.min(np.abs(angle_rad[stretch] - middle)))
        alone = [abs(apart[i + 1] - apart[i]) for i in edges]
        if min(alone) < FOLLOWED * away or is_lost(alone[0], abs(ratio) * TURN, count_rad):
            continue
        marked[stretch] = True
    return marked


def unconnected(columns: Mapping[str, FloatArray]) -> BoolArray:
    """Mark the rows in which torque and angles all read zero, as before a field bus is connected.

    Zero must be far outside of the other readings of an angle: a drive without load may be at the
    zeros of all its sensors.
    """
    if not columns.keys() >= set(MEASURED):
        return np.zeros(columns["torque"].size, dtype=bool)
    rows = np.logical_and.reduce([columns[name] == 0.0 for name in MEASURED])
    for name in MEASURED[1:]:
        others = columns[name][~rows & np.isfinite(columns[name])]
        if rows.any() and others.size and max(others.min(), -others.max()) > np.ptp(others):
            return np.asarray(rows)
    return np.zeros(rows.size, dtype=bool)


def is_lost(move_rad: float, other_turn_rad: float, count_rad: float | None) -> bool:
    """Whether a jump is an overflow of the counter or of the other encoder.

    A single-turn encoder has no range above one turn.
    """
    turns = round(move_rad / other_turn_rad)
    if turns and abs(move_rad - turns * other_turn_rad) < WHOLE * other_turn_rad:
        return True
    if count_rad is None:
        return False
    return any(abs(move_rad / (2.0**bits * count_rad) - 1) < WHOLE for bits in COUNTER_BITS)
