"""Wild values: single samples or short bursts that no drive and no sensor made, set aside.

A dropped torque, a sensor's power-on value, a reading of zero: the channel leaves where it is and
comes back within a few samples, by far more than it moves before and behind. The bounds are the
channel's own: its steps beside the burst, and the scatter of its steps in the run. A step that
stays (a slip, a moved zero, a load step) is no burst, and the corner of a triangle stands out by no
more than the steps beside it.

Torque and lost motion check each other. What is looked at is the lost motion less the mean curve
over the torque, so a load that really jumps, which the lost motion follows, is none; and a torque
that drops in the middle of its swing, where its own steps are as large, is found.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import comb

import numpy as np
import numpy.typing as npt

from lostmotion.recordings.campaign import Campaign, Run
from lostmotion.recordings.findings import Finding
from lostmotion.recordings.quantities import QUANTITIES

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.intp]

BURST = 5
"""Longest burst of wild samples."""

BURST_AT_END = 3
"""The same at the first and last sample of a run, where only one side shows it."""

BESIDE = 3
"""Steps on either side of a burst to which it is compared."""

TIMES_BESIDE = 4.0
"""A burst stands out by this many times the largest step beside it. White noise has one of seven
steps that large once in 1e6 samples, and then it is no more than 6 deviations ..."""

DEVIATIONS = 6.0
"""... so it also stands out by this many standard deviations of the steps of its run."""

TIMES_AT_END = 1.0
"""At an end it also exceeds the range of its run so many times."""

OWN_DEVIATIONS = 12.0
"""What stands out of the lost motion over the torque also stands out of its own column's noise, by
so many standard deviations: the estimated torques of motor drives have tails that reach 10."""

NOISE_REACH = 16
"""Samples on either side from which that noise is taken."""

NOISE_ORDER = 8
"""Highest difference that is tried: what is left of 8 samples a loop is a hundredth."""

SHARE_MAX = 0.05
"""More samples of a run than this share, and more than `COUNT_FREE`, are what the channel does."""

COUNT_FREE = 3

ROUNDS = 6
"""Times that a run is searched anew without what was found: bursts hide each other."""

CONSTANT_SHARE = 0.1
"""A channel that has one value leaves it by this share of it at least: sensors of few steps."""

CATEGORIES = ("direction",)
"""Columns whose values are names: no value of theirs is nearer to another than the rest."""

OWN_SHARE = 0.5
"""A burst in lost motion and torque alike is a load: less this share of it must be left. A column
that came back is nearer than this share of the burst to where it was."""

FOLLOWED_SHARE = 0.2
"""Share of one that the other must follow to be a load, whatever the curve makes of it."""

BINS = 24
"""Intervals of the torque, equally wide, in which the mean curve is the median."""

PULSES = 0.1
"""A torque that is nearly always within so small a part of its range is held, but for pulses that
are then part of the plan."""

BIN_SAMPLES = 5
"""Fewest samples of an interval: a median of two wild ones would be wild."""

PASSES = 3
"""Times that the curve and the zeros of the runs are taken in turn."""

PLAUSIBLE = {"temperature": (-60.0, 200.0)}
"""Range outside of which a value says that a sensor is off, in the unit of the quantity. Greases
end at -60 C and 200 C; sensors read -127 or 850 where a wire is open."""

PLAUSIBLE_SHARE = 0.01
"""Least burst in that range: 2.6 K, more than one step of the coarsest sensors."""

LEFT_OUT = "wild values; rows left out"
NOT_USED = "wild values; the column is not used for these rows"


def set_wild_aside(campaign: Campaign) -> None:
    """Leave out rows with wild values, and wild values of columns that a row can do without."""
    curve = MeanCurve(campaign.runs)
    for run in campaign.runs:
        for name in run.columns.keys() - {"time", "torque", "lost_motion"}:
            if name in ("input_angle", "output_angle", *CATEGORIES):
                continue
            values = run.columns[name]
            wild = wild_values(values, PLAUSIBLE.get(name))
            if wild.any():
                run.columns[name] = np.where(wild, np.nan, values)
                note(campaign, run, name, wild, NOT_USED)
        wild_rows: dict[str, BoolArray] = {"time": wild_clock(run.time_s)}
        for name in ("torque", "lost_motion", "input_angle", "output_angle"):
            wild_rows[name] = np.zeros(len(run), dtype=bool)
        found = bursts(curve.rest(run), curve.noise(run))
        for burst in np.split(rows := np.flatnonzero(found), np.flatnonzero(np.diff(rows) > 1) + 1):
            culprit = curve.culprit(run, burst, found) if burst.size else None
            if culprit is not None:
                wild_rows[culprit][burst] = True
        aside = np.logical_or.reduce(list(wild_rows.values()))
        if not aside.any() or aside.all():
            continue
        for name, wild in wild_rows.items():
            if wild.any():
                note(campaign, run, name, wild, LEFT_OUT)
        run.leave_out(aside)


def note(campaign: Campaign, run: Run, name: str, wild: BoolArray, action: str) -> None:
    """Count wild values, and name them by run and second."""
    seconds = tuple(float(t) for t in run.time_s[wild])
    column = QUANTITIES[name].column
    count = int(np.count_nonzero(wild))
    campaign.findings.append(Finding("wild", run.file, column, run.label, count, action, seconds))


class MeanCurve:
    """Lost motion over the torque, by medians, whatever a few samples are."""

    def __init__(self, runs: Iterable[Run]) -> None:
        runs = list(runs)
        torque = np.concatenate([run.torque_Nm for run in runs])
        lost = [run.lost_motion_rad for run in runs]
        size = [values.size for values in lost]
        low, high = np.quantile(torque, [0.005, 0.995])
        self.torque_Nm = np.zeros(1)
        self.lost_rad = np.zeros(1)
        self.covers = bool(high - low >= PULSES * np.ptp(torque))
        if torque.size < 2 * BIN_SAMPLES + 2 or not np.ptp(torque) > 0:
            return
        ends = np.partition(torque, [BIN_SAMPLES, -BIN_SAMPLES - 1])[
            [BIN_SAMPLES, -BIN_SAMPLES - 1]
        ]
        if high - low < PULSES * (ends[1] - ends[0]):
            low, high = ends
        edges = np.linspace(low, high, BINS + 1)
        place = np.clip(np.searchsorted(edges, torque, side="right") - 1, 0, BINS - 1)
        filled = np.flatnonzero(np.bincount(place, minlength=BINS) >= BIN_SAMPLES)
        if filled.size < 2:
            return
        order = np.argsort(place, kind="stable")
        cuts = np.searchsorted(place[order], np.arange(1, BINS))
        self.torque_Nm = (0.5 * (edges[:-1] + edges[1:]))[filled]
        self.lost_rad = np.zeros(filled.size)
        for _ in range(PASSES):
            curve = np.split(self(torque), np.cumsum(size)[:-1])
            zeros = [np.median(y - f) for y, f in zip(lost, curve, strict=True)]
            level = np.concatenate([y - zero for y, zero in zip(lost, zeros, strict=True)])
            parts = np.split(level[order], cuts)
            self.lost_rad = np.array([np.median(parts[k]) for k in filled])

    def __call__(self, torque_Nm: FloatArray) -> FloatArray:
        """Lost motion in rad at torques; beyond those that were measured, on a straight line."""
        x, y = self.torque_Nm, self.lost_rad
        if x.size == 1:
            return np.zeros(torque_Nm.size)
        slope = (y[-1] - y[0]) / (x[-1] - x[0])
        inside = np.clip(torque_Nm, x[0], x[-1])
        return np.asarray(np.interp(inside, x, y) + slope * (torque_Nm - inside))

    def slope(self, torque_Nm: FloatArray) -> FloatArray:
        """Compliance in rad/Nm at torques, or between those where it is larger."""
        x, y = self.torque_Nm, self.lost_rad
        if x.size == 1:
            return np.zeros(torque_Nm.size)
        return np.asarray(np.interp(torque_Nm, x, np.abs(np.gradient(y, x))))

    def noise(self, run: Run) -> FloatArray:
        """Scatter from sample to sample that the noise of the torque makes, by the slope there.

        Where the drive is soft, as in its backlash, a little torque is a large angle.
        """
        slope = self.slope(run.torque_Nm)
        beside = np.maximum(slope[1:], slope[:-1])
        step = np.diff(self.rest(run))
        steep = beside > 0
        return slope * scatter(step[steep] / beside[steep])

    def rest(self, run: Run) -> FloatArray:
        """Lost motion that the torque does not explain."""
        return run.lost_motion_rad - self(run.torque_Nm)

    def culprit(self, run: Run, burst: IntArray, found: BoolArray) -> str | None:
        """Name the column that makes a burst, or nothing where it may be the drive.

        Torque and lost motion that leave together are a load. A column that does not come back to
        where it was is none that left it.
        """
        rest = off_neighbours(self.rest(run), burst, found)
        at = int(np.argmax(np.abs(rest)))
        lost = float(off_neighbours(run.lost_motion_rad, burst, found)[at])
        load = float(off_neighbours(self(run.torque_Nm), burst, found)[at])
        most = max(abs(lost), abs(load))
        if abs(rest[at]) < OWN_SHARE * most or lost * load > FOLLOWED_SHARE * most**2:
            return None
        name = "lost_motion"
        angles = [name for name in ("input_angle", "output_angle") if name in run.columns]
        if abs(load) > abs(lost):
            name = "torque"
        elif len(angles) == 2:
            jerk = [standing_out(run.columns[name], burst, found) for name in angles]
            name = angles[int(np.argmax(jerk))]
        torque, angle = (
            leaves(run.columns[q], burst, found, at) for q in ("torque", "lost_motion")
        )
        if torque and angle and not self.covers:
            return None
        return name if (torque if name == "torque" else angle) else None


def sound_near(burst: IntArray, found: BoolArray) -> IntArray:
    """Rows about a burst that no burst holds."""
    begin = max(int(burst[0]) - 2 * BURST, 0)
    near = np.flatnonzero(~found[begin : int(burst[-1]) + 2 * BURST + 1])
    return np.asarray(near + begin)


def off_neighbours(values: FloatArray, burst: IntArray, found: BoolArray) -> FloatArray:
    """How far the samples of a burst are off the line between the ones beside it."""
    near = sound_near(burst, found)
    if near.size == 0:
        return np.zeros(burst.size)
    return np.asarray(values[burst] - np.interp(burst, near, values[near]))


def leaves(values: FloatArray, burst: IntArray, found: BoolArray, at: int) -> bool:
    """Whether a column itself leaves its noise and its steps in a burst, and comes back."""
    off = abs(float(off_neighbours(values, burst, found)[at]))
    least = max(
        OWN_DEVIATIONS * local_noise(values, int(burst[at])),
        DEVIATIONS * resolution(values, np.abs(np.diff(values))),
    )
    return off > least and comes_back(values, burst, found, off)


def comes_back(values: FloatArray, burst: IntArray, found: BoolArray, off: float) -> bool:
    """Whether a column lies behind a burst about where it lay before it.

    At an end of the run only one side shows; there the steps beside it must be small.
    """
    near = sound_near(burst, found)
    before, behind = near[near < burst[0]], near[near > burst[-1]]
    if before.size and behind.size:
        return bool(abs(values[behind[0]] - values[before[-1]]) < OWN_SHARE * off)
    steps = np.abs(np.diff(values[near]))
    return bool(steps.size > 0 and off > TIMES_BESIDE * float(steps.max()))


def standing_out(values: FloatArray, burst: IntArray, found: BoolArray) -> float:
    """How far a burst is off its neighbours, in usual steps of the channel."""
    usual = scatter(np.diff(values)) + 1e-12 * float(np.max(np.abs(values)) + 1.0)
    return float(np.max(np.abs(off_neighbours(values, burst, found)))) / usual


def local_noise(values: FloatArray, at: int) -> float:
    """Standard deviation of the noise about a sample, whatever the channel does smoothly.

    Differences of a higher order leave less of a smooth channel; those of white noise have the
    variance binom(2k, k) times its own.
    """
    near = values[max(at - NOISE_REACH, 0) : at + NOISE_REACH + 1]
    found = [
        1.4826 * float(np.median(np.abs(np.diff(near, k)))) / comb(2 * k, k) ** 0.5
        for k in range(1, min(NOISE_ORDER, near.size - 1) + 1)
    ]
    return min(found, default=0.0)


def scatter(step: FloatArray) -> float:
    """Standard deviation of most steps: by their middle, or a third of their tenth largest.

    A channel of few values stands still most of the time; what it does then is not noise alone.
    """
    size = np.abs(step)
    if size.size == 0:
        return 0.0
    middle, high = np.quantile(size, [0.5, 0.9])
    return float(max(1.4826 * middle, high / 3.0))


def wild_values(values: FloatArray, plausible: tuple[float, float] | None) -> BoolArray:
    """Mark the wild values of a column that nothing checks."""
    wild = np.zeros(values.size, dtype=bool)
    known = np.isfinite(values)
    if plausible is not None:
        beyond = known & ((values < plausible[0]) | (values > plausible[1]))
        # Where most are, it is another unit or another sensor, and no sample is wild.
        if np.count_nonzero(beyond) < 0.5 * np.count_nonzero(known):
            wild |= beyond
    rows = np.flatnonzero(known & ~wild)
    least = 0.0 if plausible is None else PLAUSIBLE_SHARE * (plausible[1] - plausible[0])
    wild[rows[bursts(values[rows], np.full(rows.size, least / DEVIATIONS))]] = True
    return wild


def wild_clock(time_s: FloatArray) -> BoolArray:
    """Mark time stamps that go back for a burst: only that can be no gap and no jitter."""
    step = np.diff(time_s)
    wild = np.zeros(time_s.size, dtype=bool)
    if step.size < 2 or np.all(step >= 0):
        return wild
    wild |= bursts(time_s)
    usual = float(np.median(np.abs(step)))
    wild[0] |= step[0] < -TIMES_BESIDE * usual
    wild[-1] |= step[-1] < -TIMES_BESIDE * usual
    return wild


def bursts(values: FloatArray, noise: FloatArray | None = None) -> BoolArray:
    """Mark samples that leave the others and come back, by far more than these move.

    Parameters
    ----------
    values : ndarray
    noise : ndarray, optional
        Scatter from sample to sample that is known besides that of the values themselves.
    """
    if noise is None:
        noise = np.zeros(values.size)
    wild = np.zeros(values.size, dtype=bool)
    for _ in range(ROUNDS):
        rows = np.flatnonzero(~wild)
        found = bursts_once(values[rows], noise[rows])
        if not found.any():
            break
        wild[rows[found]] = True
    if np.count_nonzero(wild) > max(COUNT_FREE, SHARE_MAX * values.size):
        return np.zeros(values.size, dtype=bool)
    return wild


def bursts_once(x: FloatArray, noise: FloatArray) -> BoolArray:
    """Mark the bursts that stand out of a channel as it is, shorter ones before longer ones."""
    marked = np.zeros(x.size, dtype=bool)
    if x.size < 2 * BESIDE + 3:
        return marked
    step = np.abs(np.diff(x))
    floor = DEVIATIONS * max(scatter(step), resolution(x, step))
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


def resolution(x: FloatArray, step: FloatArray) -> float:
    """Least step of a channel of few values; of one that has a single value, a share of it."""
    level = float(np.median(np.abs(x)))
    moved = step[step > 1e-12 * (level + 1e-300)]
    if moved.size <= 2 * BURST:  # a constant, but for what may be wild
        return CONSTANT_SHARE * max(level, 0.0) / DEVIATIONS if level else 0.0
    return float(moved.min())
