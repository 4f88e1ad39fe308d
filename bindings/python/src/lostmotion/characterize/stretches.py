"""Sections of the steady loop, from one tip towards the other.

Friction is hysteretic: it depends on the load history. A section that starts at a tip of the loop
has a known history, whatever came before the tip, and lies on the loop. The first ramp of a
recording has not, unless the previous recording ended on the same branch. Only sections of the loop
are used.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray, IntArray
from lostmotion.branches import REVERSAL_SHARE, directions
from lostmotion.recordings import Campaign, Run
from lostmotion.rms import robust_rms

TIP_SHARE = 0.1
"""Largest distance from a tip, as a share of the amplitude, at which a section may start: chosen as
in `compare`, where runs within 5 % repeat each other.
"""

SAME_AMPLITUDE = 1.0 - TIP_SHARE
"""Runs that reach this share of the largest amplitude count as loops of the same size."""

ONE_DIRECTION = 0.1
"""Below this share of the torque in the other direction a campaign has one direction only."""

FEW_READINGS = 50
"""Below this number readings are treated as manual: independent, with a loop of constant width.
Above it `fit` can estimate the baseline model.
"""

NOISE_TURN = 4.0
"""A torque reverses if it goes back by this multiple of its noise: one normal sample in 16,000 does
so by chance.
"""

CELLS = 160
"""Torque bins in which the samples of a section are averaged, so that a dwell counts once and every
torque equally. A bin is less than 1 % of the amplitude.
"""


@dataclass(frozen=True, eq=False)
class Samples:
    """Means of the samples of loops in torque bins, one entry per section and bin.

    Attributes
    ----------
    torque_Nm, angle_rad : ndarray
    falling : ndarray
        1 on the branch of falling torque, -1 on that of rising torque.
    loop, stretch : ndarray of int
        Number of the loop and of the section, from 0, in the order of recording.
    low_Nm, high_Nm : float
        Tips of the loops.
    loops, runs : int
        Loops and runs that are used.
    left_out : int
        Samples in runs of other amplitudes, or in sections with unknown load history.
    rate_Nm_per_s : float or None
        Median rate of the torque; None without a clock.
    readings : int
        Number of samples in the means.
    cell_Nm : float
        Width of the cells.
    resolution_rad : float
        Resolution of the angle readings; 0 if it is not visible.
    rows : ndarray of int
        Rows of the campaign in these sections, in order.
    history_known : bool
        False if no section starts at a tip, so that ramps from rest are used.
    width_reach_Nm : float
        Torque beyond which only the branch towards a tip is present.
    """

    torque_Nm: FloatArray
    angle_rad: FloatArray
    falling: FloatArray
    loop: IntArray
    stretch: IntArray
    low_Nm: float
    high_Nm: float
    loops: int
    runs: int
    left_out: int
    rate_Nm_per_s: float | None
    readings: int
    cell_Nm: float
    resolution_rad: float
    rows: IntArray
    history_known: bool = True
    width_reach_Nm: float = np.inf

    def without_transitions(self, torque_Nm: float) -> Samples:
        """Return the samples without those between a tip and a torque on the way back."""
        leads_back = self.falling * self.torque_Nm > torque_Nm
        return replace(self._rows(~leads_back), width_reach_Nm=torque_Nm)

    def beyond(self, torque_Nm: float) -> Samples:
        """Return the samples above a torque, on either side."""
        return self._rows(np.abs(self.torque_Nm) >= torque_Nm)

    def _rows(self, kept: BoolArray) -> Samples:
        return replace(
            self,
            torque_Nm=self.torque_Nm[kept],
            angle_rad=self.angle_rad[kept],
            falling=self.falling[kept],
            loop=self.loop[kept],
            stretch=self.stretch[kept],
        )

    @property
    def two_directions(self) -> bool:
        """Whether the loops reach both sides of zero."""
        low, high = self.low_Nm, self.high_Nm
        return min(high, -low) > ONE_DIRECTION * max(high, -low)

    @property
    def both_branches(self) -> bool:
        """Whether the torque was recorded rising and falling."""
        return bool(np.any(self.falling > 0) and np.any(self.falling < 0))

    @property
    def amplitude_Nm(self) -> float:
        """Torque reached on every side of the loops."""
        if self.two_directions:
            return min(self.high_Nm, -self.low_Nm)
        return max(self.high_Nm, -self.low_Nm)


@dataclass(frozen=True)
class Stretch:
    """Rows of a run from one torque reversal to the next, with branch and loop."""

    run: int
    rows: slice
    falling: float
    loop: int


@dataclass(frozen=True)
class Loops:
    """The loops of the largest amplitude of a campaign: their tips and their sections.

    Attributes
    ----------
    low_Nm, high_Nm : float
    used : list of Stretch
    rate_Nm_per_s, history_known
        As of `Samples`.
    rows, stretch : ndarray of int
        Rows of the campaign in these sections, in order, and the section of each.
    """

    low_Nm: float
    high_Nm: float
    used: list[Stretch]
    rate_Nm_per_s: float | None
    history_known: bool
    rows: IntArray
    stretch: IntArray


def find_loops(campaign: Campaign) -> Loops:
    """Find the loops of the largest amplitude of a campaign."""
    low, high = tips(campaign.runs)
    moves = high > low  # constant torque: no loop
    used = loop_stretches(campaign, low, high) if moves else []
    known = bool(used)
    if moves and not known:
        used = loop_stretches(campaign, low, high, any_history=True)
    rates: list[float] = []
    if campaign.timed:
        for stretch in used:
            rates += loading_rate(campaign.runs[stretch.run], stretch.rows)
    sizes = np.array([one.rows.stop - one.rows.start for one in used], dtype=np.intp)
    run = np.array([one.run for one in used], dtype=np.intp)
    first = campaign.starts[run] + np.array([one.rows.start for one in used], dtype=np.intp)
    inside = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    return Loops(
        low,
        high,
        used,
        float(np.median(rates)) if rates else None,
        known,
        np.repeat(first, sizes) + inside,
        np.repeat(np.arange(sizes.size), sizes),
    )


def collect(
    campaign: Campaign,
    angle_rad: FloatArray | None = None,
    window_Nm: float | None = None,
    loops: Loops | None = None,
) -> Samples:
    """Collect the samples of the loops of the largest amplitude of a campaign.

    Parameters
    ----------
    campaign : Campaign
    angle_rad : ndarray, optional
        Angles of all rows in place of the lost motion: those of a model at these torques.
    window_Nm : float, optional
        Range of torque on either side of zero for the samples and bins.
    loops : Loops, optional
        Result of `find_loops`.
    """
    loops = find_loops(campaign) if loops is None else loops
    low, high, used, rows = loops.low_Nm, loops.high_Nm, loops.used, loops.rows
    width = ((high - low) if window_Nm is None else 2.0 * window_Nm) / CELLS
    lost = campaign.column("lost_motion") if angle_rad is None else angle_rad
    torque, angle, stretch = cell_means(
        campaign.column("torque")[rows], lost[rows], loops.stretch, width
    )
    if window_Nm is not None:
        inside = np.abs(torque) <= window_Nm
        torque, angle, stretch = torque[inside], angle[inside], stretch[inside]
    return Samples(
        torque,
        angle,
        np.array([one.falling for one in used])[stretch],
        np.array([one.loop for one in used], dtype=np.intp)[stretch],
        stretch,
        low,
        high,
        len({one.loop for one in used}),
        len({one.run for one in used}),
        campaign.rows - rows.size,
        loops.rate_Nm_per_s,
        rows.size,
        width,
        reading_step(angle),
        rows,
        loops.history_known,
    )


def loop_stretches(
    campaign: Campaign, low_Nm: float, high_Nm: float, *, any_history: bool = False
) -> list[Stretch]:
    """Find the sections of the loops between two tips.

    Parameters
    ----------
    campaign : Campaign
    low_Nm, high_Nm : float
        Tips, from `tips`.
    any_history : bool
        Include sections that start elsewhere.
    """
    slack = TIP_SHARE * 0.5 * (high_Nm - low_Nm)
    used: list[Stretch] = []
    loop = -1
    ended: tuple[float, float] | None = None
    for number, run in enumerate(campaign.runs):
        torque = run.torque_Nm
        before, ended = (None if run.begins else ended), None
        if np.max(torque) < high_Nm - slack or np.min(torque) > low_Nm + slack:
            continue
        begun = fell = False
        for order, (rows, falling) in enumerate(stretches(torque, max(high_Nm, -low_Nm))):
            # A reading at a tip belongs to the branch that led to it.
            first = float(torque[max(rows.start - 1, 0)])
            last = float(torque[rows.stop - 1])
            at_tip = first >= high_Nm - slack if falling > 0 else first <= low_Nm + slack
            goes_on = (
                order == 0
                and before is not None
                and before[0] == falling
                and abs(before[1] - first) <= slack
            )
            if not (at_tip or goes_on or any_history):
                reached = last <= low_Nm + slack if falling > 0 else last >= high_Nm - slack
                if not reached:
                    continue
                rows = slice(rows.stop - 1, rows.stop)  # only the tip itself
            # A loop begins when the torque begins to fall, except for the ramp up to the first tip.
            if not begun or (falling > 0 and fell):
                loop += 1
                fell = False
            begun, fell = True, fell or falling > 0
            ended = (falling, last)
            used.append(Stretch(number, rows, falling, loop))
    return used


def tips(runs: Sequence[Run]) -> tuple[float, float]:
    """Tips of the largest loops: medians over the runs of that amplitude."""
    lows = np.array([float(np.min(run.torque_Nm)) for run in runs])
    highs = np.array([float(np.max(run.torque_Nm)) for run in runs])
    both = np.minimum(highs, -lows)
    largest = max(float(highs.max()), float(-lows.min()))
    size = both if both.max() > ONE_DIRECTION * largest else highs - lows
    chosen = size >= SAME_AMPLITUDE * size.max()
    return float(np.median(lows[chosen])), float(np.median(highs[chosen]))


def stretches(torque_Nm: FloatArray, largest_Nm: float) -> list[tuple[slice, float]]:
    """Split a run at the torque reversals: rows from tip to tip, and 1 for falling torque."""
    smallest = max(REVERSAL_SHARE * largest_Nm, NOISE_TURN * torque_noise(torque_Nm))
    rising, _ = directions(torque_Nm, smallest / REVERSAL_SHARE)
    noticed = np.flatnonzero(np.diff(rising)) + 1
    edges = [0]
    for turn in noticed:
        # A reversal is detected after the tip at which it occurred.
        part = torque_Nm[edges[-1] : turn]
        backwards = part[::-1] if rising[turn - 1] else -part[::-1]
        # Readings that repeat a tip precede the reversal.
        edges.append(edges[-1] + part.size - int(np.argmax(backwards)))
    edges.append(torque_Nm.size)
    signs = [*rising[noticed - 1], rising[-1]]
    found: list[tuple[slice, float]] = []
    for a, b, up in zip(edges[:-1], edges[1:], signs, strict=True):
        sign = -1.0 if up else 1.0
        if found and found[-1][1] == sign:  # a reversal too small to have its own tip
            found[-1] = (slice(found[-1][0].start, b), sign)
        elif b > a:
            found.append((slice(a, b), sign))
    return found


def torque_noise(torque_Nm: FloatArray) -> float:
    """White noise of a torque from its second differences; 0 for few readings."""
    if torque_Nm.size < FEW_READINGS:
        return 0.0
    return robust_rms(np.diff(torque_Nm, 2)) / math.sqrt(6.0)


STEP_SLACK = 0.05
"""Tolerance of rounded readings, in steps."""


def reading_step(angle_rad: FloatArray) -> float:
    """Resolution of readings; 0 if their differences are not multiples of one step."""
    steps = np.diff(np.unique(angle_rad))
    if steps.size == 0:
        return 0.0
    least = float(steps.min())
    off = np.abs(steps / least - np.round(steps / least))
    return least if float(off.max()) < STEP_SLACK else 0.0


def cell_means(
    torque_Nm: FloatArray, angle_rad: FloatArray, stretch: IntArray, width_Nm: float
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Means of torque and angle in torque bins of each section, and the section of each mean.

    The samples of a section with few of them are unchanged.
    """
    count = np.bincount(stretch)
    place = np.arange(stretch.size) - (np.cumsum(count) - count)[stretch]
    cell = np.floor(torque_Nm / width_Nm).astype(np.intp)
    cell = np.where(count[stretch] > CELLS, cell - cell.min(initial=0), place)
    span = int(cell.max(initial=0)) + 1
    means, mean_of = np.unique(stretch * span + cell, return_inverse=True)
    count = np.bincount(mean_of)
    torque, angle = (np.bincount(mean_of, values) / count for values in (torque_Nm, angle_rad))
    return torque, angle, means // span


def loading_rate(run: Run, rows: slice) -> list[float]:
    """Mean torque rate over a section; none if the clock is constant."""
    time, torque = run.time_s[rows], run.torque_Nm[rows]
    span = float(time[-1] - time[0]) if time.size > 1 else 0.0
    return [abs(float(torque[-1] - torque[0])) / span] if span > 0 else []
