"""Bursts: a few samples by which a channel deviates and returns.

The deviation is far larger than the steps of the channel before and after. The bounds are the
adjacent steps of the channel and the scatter of its steps in the run. A permanent step is not a
burst, and the corner of a triangle deviates by no more than the adjacent steps.
"""

from __future__ import annotations

from math import comb

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray
from lostmotion.rms import NORMAL_MEDIAN, robust_rms

BURST = 5
"""Longest burst of outliers."""

BURST_AT_END = 3
"""The same at the first and last sample of a run, where only one side is known."""

BESIDE = 3
"""Steps on either side of a burst for comparison."""

TIMES_BESIDE = 4.0
"""Least size of a burst relative to the largest adjacent step. White noise reaches it once in 1e6
samples, and then it is below 6 standard deviations ...
"""

DEVIATIONS = 6.0
"""... so a burst must also exceed this number of standard deviations of the steps of its run."""

TIMES_AT_END = 1.0
"""At an end of a run it must also exceed this multiple of the range of the run."""

NOISE_REACH = 16
"""Samples on either side for the local noise."""

NOISE_ORDER = 8
"""Highest order of difference that is tried: with 8 samples per loop a hundredth remains."""

SHARE_MAX = 0.05
"""Larger shares of a run, above `COUNT_FREE` samples, are normal behaviour of the channel."""

COUNT_FREE = 3

ROUNDS = 6
"""Repeated searches of a run without the bursts found, because bursts hide each other."""

MARKED_SHARE = 0.25
"""Largest share of samples replaced by a marker."""

MARKERS_TRIED = 8
"""Number of candidate values, those that occur alone most often first."""

MARKERS_LEAST = 3
"""Least number of occurrences of a marker: two equal outliers may be a coincidence."""

REPEATED_LEAST = 5
"""Number of single occurrences from which a value is a marker, if it ..."""

REPEATED_TIMES = 5
"""... occurs this many times as often as any other value that occurs alone: a channel of few values
repeats many of them. Chosen."""

CONSTANT_SHARE = 0.1
"""Least deviation of a channel with a single value, relative to it: sensors with few steps."""


def bursts(
    values: FloatArray, noise: FloatArray | None = None, absolute: bool = False
) -> BoolArray:
    """Mark samples that deviate by far more than the usual steps and return.

    Parameters
    ----------
    values : ndarray
    noise : ndarray, optional
        Additional known scatter from sample to sample.
    absolute : bool, optional
        As of `resolution`.
    """
    if noise is None:
        noise = np.zeros(values.size)
    wild = np.zeros(values.size, dtype=bool)
    for _ in range(ROUNDS):
        rows = np.flatnonzero(~wild)
        found = bursts_once(values[rows], noise[rows], absolute)
        if not found.any():
            break
        wild[rows[found]] = True
    if np.count_nonzero(wild) > max(COUNT_FREE, SHARE_MAX * values.size):
        return np.zeros(values.size, dtype=bool)
    return wild


def wild_clock(time_s: FloatArray) -> BoolArray:
    """Mark time stamps that decrease for a burst, which is neither a gap nor jitter."""
    step = np.diff(time_s)
    wild = np.zeros(time_s.size, dtype=bool)
    if step.size < 2 or np.all(step >= 0):
        return wild
    wild |= bursts(time_s)
    usual = float(np.median(np.abs(step)))
    wild[0] |= step[0] < -TIMES_BESIDE * usual
    wild[-1] |= step[-1] < -TIMES_BESIDE * usual
    return wild


def bursts_once(x: FloatArray, noise: FloatArray, absolute: bool) -> BoolArray:
    """Mark the bursts of a channel, shorter ones first."""
    marked = np.zeros(x.size, dtype=bool)
    if x.size < 2 * BESIDE + 3:
        return marked
    step = np.abs(np.diff(x))
    floor = DEVIATIONS * max(scatter(step), resolution(x, step, absolute))
    if np.max(step) <= floor:
        return marked
    # Largest of the BESIDE steps that end, and that begin, at each sample.
    wide = np.pad(step, BESIDE, constant_values=0.0)
    window = np.lib.stride_tricks.sliding_window_view(wide, BESIDE).max(axis=1)
    ending, beginning = window[: x.size], window[BESIDE : BESIDE + x.size]
    for length in range(1, BURST + 1):
        first = np.arange(1, x.size - length)
        before, behind = x[first - 1], x[first + length]
        off = np.full(first.size, np.inf)
        for k in range(length):
            chord = before + (behind - before) * (k + 1) / (length + 1)
            off = np.minimum(off, np.abs(x[first + k] - chord))
        beside = np.maximum(ending[first - 1], beginning[first + length])
        beside = np.maximum(beside, np.abs(behind - before) / (length + 1))
        around = np.lib.stride_tricks.sliding_window_view(noise, length + 2).max(axis=1)
        least = np.maximum(floor, DEVIATIONS * around)
        for i in first[(off > TIMES_BESIDE * beside) & (off > least)]:
            marked[i : i + length] = True
        if marked.any():
            return marked
    swing = float(np.ptp(x[BURST_AT_END:-BURST_AT_END]))
    for turned in (x, x[::-1]):
        mark = marked if turned is x else marked[::-1]
        for length in range(1, BURST_AT_END + 1):
            rest = np.abs(np.diff(turned[length : length + 2 * BESIDE + 1]))
            least_off = float(np.min(np.abs(turned[:length] - turned[length])))
            bound = max(floor, TIMES_BESIDE * float(rest.max()), TIMES_AT_END * swing)
            if least_off > bound:
                mark[:length] = True
                break
    return marked


def resolution(x: FloatArray, step: FloatArray, absolute: bool = False) -> float:
    """Smallest step of a channel with few values; a share of the value if there is only one.

    `absolute` states that its zero has a meaning: a channel that rarely leaves its value then has
    one value.
    """
    level = float(np.median(np.abs(x)))
    moved = step[step > 1e-12 * (level + 1e-300)]
    constant = np.count_nonzero(x == np.median(x)) >= (1 - MARKED_SHARE) * x.size
    if moved.size <= 2 * BURST or (
        absolute and constant and level > 0
    ):  # constant except for outliers
        return CONSTANT_SHARE * level / DEVIATIONS
    return float(moved.min())


def local_noise(values: FloatArray, at: int) -> float:
    """Local standard deviation of the noise, independent of smooth motion of the channel.

    Differences of higher order suppress a smooth channel; for white noise they have binom(2k, k)
    times its variance.
    """
    near = values[max(at - NOISE_REACH, 0) : at + NOISE_REACH + 1]
    found = [
        robust_rms(np.diff(near, k)) / comb(2 * k, k) ** 0.5
        for k in range(1, min(NOISE_ORDER, near.size - 1) + 1)
    ]
    return min(found, default=0.0)


def scatter(step: FloatArray) -> float:
    """Robust standard deviation of the steps: from their median, or a third of their tenth largest.

    A channel with few values is at rest most of the time; its steps are not only noise.
    """
    size = np.abs(step)
    if size.size == 0:
        return 0.0
    middle, high = np.quantile(size, [0.5, 0.9])
    return float(max(NORMAL_MEDIAN * middle, high / 3.0))


def markers(values: FloatArray, absolute: bool = False) -> BoolArray:
    """Mark a value that a device writes repeatedly instead of a reading: 0 or full scale.

    It occurs alone or in bursts, always exactly the same, and the channel without it is continuous.
    """
    marked = np.zeros(values.size, dtype=bool)
    if values.size < 2 * BESIDE + 3:
        return marked
    alone = np.zeros(values.size, dtype=bool)
    alone[1:-1] = (values[1:-1] - values[:-2]) * (values[2:] - values[1:-1]) < 0
    levels, counts = np.unique(values[alone], return_counts=True)
    levels = levels[np.argsort(-counts, kind="stable")][:MARKERS_TRIED]
    number = np.count_nonzero(values == levels[:, None], axis=1)
    for level in levels[(number >= MARKERS_LEAST) & (number <= MARKED_SHARE * values.size)]:
        same = values == level
        rows, rest = np.flatnonzero(same), np.flatnonzero(~same)
        stretch = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
        if len(stretch) < MARKERS_LEAST or max(map(len, stretch)) > BURST:
            continue
        step = np.abs(np.diff(values[rest]))
        floor = DEVIATIONS * max(scatter(step), resolution(values[rest], step, absolute))
        wide = np.lib.stride_tricks.sliding_window_view(np.pad(step, BESIDE), 2 * BESIDE)
        beside = wide.max(axis=1)[np.minimum(np.searchsorted(rest, rows), rest.size - 1)]
        off = np.abs(level - np.interp(rows, rest, values[rest]))
        stands_out = off > np.maximum(TIMES_BESIDE * beside, floor)
        if 2 * np.count_nonzero(stands_out) >= rows.size and stands_out.sum() >= MARKERS_LEAST:
            marked[rows[stands_out]] = True
    return marked


def repeated_marker(values: FloatArray) -> BoolArray:
    """Mark a value that occurs alone far more often than any other, wherever it occurs.

    It need not stand out as `markers` must. Peaks of a periodic load repeat too, so another channel
    must show that it is no reading.
    """
    between = (values[1:-1] - values[:-2]) * (values[2:] - values[1:-1]) < 0
    levels, counts = np.unique(values[1:-1][between], return_counts=True)
    order = np.argsort(counts)[::-1]
    usual = int(counts[order[1]]) if counts.size > 1 else 1
    if counts.size == 0 or counts[order[0]] < max(REPEATED_LEAST, REPEATED_TIMES * usual):
        return np.zeros(values.size, dtype=bool)
    same = values == levels[order[0]]
    rows, rest = np.flatnonzero(same), np.flatnonzero(~same)
    if rest.size < 2 or rows.size > MARKED_SHARE * values.size:
        return np.zeros(values.size, dtype=bool)
    off = np.abs(values[rows] - np.interp(rows, rest, values[rest]))
    if np.median(off) <= np.median(np.abs(np.diff(values[rest]))):
        return np.zeros(values.size, dtype=bool)
    return np.asarray(same)
