"""Outliers: samples that are not measurements, set aside.

A dropped torque, a sensor's power-on value, a reading of zero or of full scale: the channel
deviates by far more than its usual steps, and returns. A permanent step (a slip, a shifted zero, a
load step) does not.

Torque and lost motion check each other. The lost motion minus the mean curve over the torque is
examined, so that a real load jump, which the lost motion follows, is not an outlier, and a torque
that drops in the middle of its swing, where its steps are as large, is found.

There are four kinds: bursts of a few samples (`bursts.bursts`), a value that the device writes
repeatedly (`bursts.markers`), a longer torque outlier far beyond all others (`torque_alone`), and a
longer angle outlier of many times the usual residual of the curve (`departures`).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray, IntArray
from lostmotion.recordings.astray import RANGES, SHARE_MAX
from lostmotion.recordings.bursts import (
    BESIDE,
    BURST,
    DEVIATIONS,
    TIMES_BESIDE,
    bursts,
    local_noise,
    markers,
    repeated_marker,
    resolution,
    scatter,
    wild_clock,
)
from lostmotion.recordings.campaign import Campaign, Run
from lostmotion.recordings.columns import counters_of
from lostmotion.recordings.encoders import count_rad
from lostmotion.recordings.findings import Finding
from lostmotion.recordings.frozen import FROZEN_LEAST, OTHER_SWING
from lostmotion.recordings.mean_curve import MeanCurve
from lostmotion.recordings.quantities import QUANTITIES

OWN_DEVIATIONS = 12.0
"""A burst in the lost motion over the torque must also exceed the noise of its own column by this
number of standard deviations: torques estimated by motor drives have tails up to 10.
"""

CATEGORIES = ("direction",)
"""Categorical columns, without distances between values."""

OWN_SHARE = 0.5
"""Share of a burst. If lost motion and torque deviate together and less than this share remains,
the burst is a load. A column has returned if it differs from its previous value by less than this
share.
"""

BEYOND_SHARE = 0.5
"""Share of a burst by which it exceeds the values on both sides."""

FOLLOWED_SHARE = 0.2
"""Share of the deviation of one quantity that the other must follow for a load, independently of
the curve.
"""

COUNTS = 2.0
"""Departures up to this number of encoder counts may be rounding."""

DEPARTURE = 10.0
"""A departure exceeds the 75 % quantile of the residual of the curve by this factor. Hysteresis,
temperature and a lag of one sample stay below a factor of three.
"""

DEPARTED_MAX = 0.4
"""Largest share of a run in departures: with half of it, the departed half is unknown."""

ERRATIC = 0.2
"""Usual step within a departure, relative to the departure, above which the readings are
erratic."""

GAP = 2
"""Largest number of successive readings within such a stretch that are plausible by chance."""

PLAUSIBLE = {"temperature": (-60.0, 200.0)}
"""Plausible range, in the unit of the quantity; a value outside it is a sensor fault. Greases are
usable from -60 C to 200 C; a sensor with an open wire reads -127 or 850.
"""

SLOW = ("temperature", "cycles")
"""Quantities that cannot jump and return from one sample to the next: a drive has a heat capacity,
and a counter increases. A force or a moment may be applied in pulses.
"""

DEAD_STEPS = 4.0
"""Least leap to a dead section, in units of the least size of a burst: 10 K for a temperature."""

PLAUSIBLE_SHARE = 0.01
"""Least size of a burst relative to that range: 2.6 K, more than one step of the coarsest
sensors."""

LEFT_OUT = "outliers; rows left out"
AT_END = "outliers, or a slip at an end of the run, which ends too early to tell; rows left out"
NOT_USED = "outliers; the column is not used for these rows"

CHECKED = ("torque", "input_angle", "output_angle", "lost_motion")
"""Columns that check each other; a row with an outlier in one of them is left out."""


def set_wild_aside(campaign: Campaign) -> None:
    """Leave out rows with outliers, and outliers of optional columns."""
    for run in campaign.runs:
        alone = torque_alone(run)
        if alone.any():
            note(campaign, run, "torque", alone, LEFT_OUT)
            run.leave_out(alone)
    curve = MeanCurve(campaign.runs)
    for run in campaign.runs:
        shifted = torque_shifted(run, curve)
        if shifted.any() and not shifted.all():
            note(campaign, run, "torque", shifted, LEFT_OUT)
            run.leave_out(shifted)
    jumping = any(finding.kind == "jump" for finding in campaign.findings)
    for run in campaign.runs:
        for name in sorted(run.columns.keys() - {"time", *CHECKED, *CATEGORIES}):
            values = run.columns[name]
            wild = wild_values(values, PLAUSIBLE.get(name), name in SLOW)
            if wild.any():
                run.columns[name] = np.where(wild, np.nan, values)
                note(campaign, run, name, wild, NOT_USED)
        found = wild_rows_of(run, curve, in_bursts_only=jumping)
        wild_rows = {"time": wild_clock(run.time_s), **found}
        aside = np.logical_or.reduce(list(wild_rows.values()))
        if not aside.any() or aside.all():
            continue
        for name, wild in wild_rows.items():
            if wild.any():
                at_end = name not in ("time", "torque") and (wild[0] or wild[-1])
                note(campaign, run, name, wild, AT_END if at_end else LEFT_OUT)
        run.leave_out(aside)


def note(campaign: Campaign, run: Run, name: str, wild: BoolArray, action: str) -> None:
    """Count outliers, and report them by run and time."""
    seconds = tuple(float(t) for t in run.time_s[wild])
    column = QUANTITIES[name].column
    count = int(np.count_nonzero(wild))
    campaign.findings.append(Finding("wild", run.file, column, run.label, count, action, seconds))


def torque_alone(run: Run) -> BoolArray:
    """Mark torques far outside all others of a run that the lost motion does not follow.

    Of any duration: such a load would wind the drive up farther than all others, from one sample to
    the next.
    """
    torque, lost = run.torque_Nm, run.lost_motion_rad
    marked = np.zeros(len(run), dtype=bool)
    low, high = np.quantile(torque, [0.25, 0.75])
    reach = max(RANGES * (high - low), OWN_DEVIATIONS * scatter(np.diff(torque)))
    outside = (torque < low - reach) | (torque > high + reach)
    for stretch in consecutive_rows(~outside):
        within = stretch[0] > 0 and stretch[-1] + 1 < len(run)
        if within and stretch.size <= GAP:
            outside[stretch] = True
    if not outside.any() or np.count_nonzero(outside) > SHARE_MAX * len(run):
        return marked
    least, most = np.quantile(lost[~outside], [0.01, 0.99])
    slack, usual = FOLLOWED_SHARE * (most - least), scatter(np.diff(lost))
    for stretch in consecutive_rows(outside):
        edges = [i for i in (stretch[0] - 1, stretch[-1]) if i >= 0 and i + 1 < len(run)]
        away = np.abs(torque[stretch] - np.clip(torque[stretch], low, high))
        steps = [abs(torque[i + 1] - torque[i]) for i in edges]
        wound = (lost[stretch] < least - slack) | (lost[stretch] > most + slack)
        followed = max(abs(lost[i + 1] - lost[i]) for i in edges) > TIMES_BESIDE * usual
        if min(steps) > OWN_SHARE * float(np.min(away[away > 0])) and not (wound.any() or followed):
            marked[stretch] = True
    return marked


def torque_shifted(run: Run, curve: MeanCurve) -> BoolArray:
    """Mark the torques between a leap and one back which the lost motion does not follow at all.

    The load of the curve would wind the drive up by far more than its lost motion changes.
    """
    torque, lost = run.torque_Nm, run.lost_motion_rad
    marked = np.zeros(len(run), dtype=bool)
    found = np.flatnonzero(leaps(torque))
    step, model = np.diff(torque), curve(torque)
    for first, last in pairwise(found):
        rows = np.arange(first + 1, last + 1)
        back = -step[last] / step[first]
        if not OWN_SHARE < back < 1 / OWN_SHARE or rows.size > DEPARTED_MAX * len(run):
            continue
        ends = np.array([first, last + 1])
        wound, load = (x[rows] - np.interp(rows, ends, x[ends]) for x in (lost, model))
        most = float(np.abs(np.median(load)))
        followed = float(np.max(np.abs(wound))) > FOLLOWED_SHARE * most
        marked[rows] |= most > DEVIATIONS * scatter(np.diff(lost)) and not followed
    return marked


def leaps(values: FloatArray) -> BoolArray:
    """Mark the steps that are far larger than those before and after them."""
    step = np.abs(np.diff(values))
    marked = np.zeros(step.size, dtype=bool)
    if step.size > 1:
        floor = DEVIATIONS * scatter(step)
        for at in np.flatnonzero(step > floor):
            beside = np.concatenate(
                (step[max(at - BESIDE, 0) : at], step[at + 1 : at + 1 + BESIDE])
            )
            marked[at] = beside.size > 0 and step[at] > TIMES_BESIDE * float(beside.max())
    return marked


def wild_rows_of(run: Run, curve: MeanCurve, in_bursts_only: bool) -> dict[str, BoolArray]:
    """Mark the outliers of the columns that check each other, by column.

    If the lost motion of a campaign has undecided jumps, its mean curve is a reference only for
    bursts.
    """
    wild = {name: np.zeros(len(run), dtype=bool) for name in CHECKED}
    rest, noise = curve.rest(run), curve.noise(run)
    if not in_bursts_only:
        there = [name for name in CHECKED if name in run.columns]
        again = {name: repeated_marker(run.columns[name]) for name in there}
        written = [*(markers(run.columns[name]) for name in there), *again.values()]
        name_culprits(run, curve, np.logical_or.reduce(written), wild)
        for name, rows in again.items():
            # The curve shows most of them; the others are by chance near the true reading.
            if 2 * np.count_nonzero(wild[name] & rows) > np.count_nonzero(rows):
                wild[name] |= rows
        found = np.logical_or.reduce(list(wild.values()))
        left = np.flatnonzero(~found)
        found[left] = departures(rest[left])
        name_culprits(run, curve, found, wild, lasting=True)
    found = np.logical_or.reduce(list(wild.values()))
    left = np.flatnonzero(~found)
    found[left] = bursts(rest[left], noise[left])
    name_culprits(run, curve, found, wild)
    return wild


def name_culprits(
    run: Run,
    curve: MeanCurve,
    found: BoolArray,
    wild: dict[str, BoolArray],
    lasting: bool = False,
) -> None:
    """Attribute outliers to columns, section by section, except those already attributed."""
    known = np.logical_or.reduce(list(wild.values()))
    for stretch in consecutive_rows(found & ~known):
        if lasting and stretch.size <= BURST:
            continue
        name = culprit(run, curve, stretch, found)
        if name is not None and (not lasting or may_last(run, name, stretch)):
            wild[name][stretch] = True


def consecutive_rows(found: BoolArray) -> Iterator[IntArray]:
    """Yield the rows of every section of marked samples."""
    rows = np.flatnonzero(found)
    if rows.size:
        yield from np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)


def departures(rest: FloatArray) -> BoolArray:
    """Mark the sections in which the residual departs and returns in one step each."""
    marked = np.zeros(rest.size, dtype=bool)
    if rest.size < 2 * BURST:
        return marked
    off = np.abs(rest - np.median(rest))
    bound = DEPARTURE * float(np.quantile(off, 0.75))
    beyond = off > bound
    if bound <= 0 or np.count_nonzero(beyond) > DEPARTED_MAX * rest.size:
        return marked
    for stretch in consecutive_rows(beyond):
        first, last = stretch[0], stretch[-1]
        steps = [abs(rest[first] - rest[first - 1])] if first > 0 else []
        steps += [abs(rest[last + 1] - rest[last])] if last + 1 < rest.size else []
        if min(steps) > OWN_SHARE * float(np.max(off[stretch])) or min(steps) > bound:
            marked[stretch] = True
    return marked


def may_last(run: Run, name: str, stretch: IntArray) -> bool:
    """Whether a departure longer than a burst is a sensor fault.

    A torque was examined before (`torque_alone`, `torque_shifted`). An angle that deviates for a
    while may be teeth that slipped and slipped back, unless it is constant while the torque moves,
    or erratic.
    """
    if name == "torque" or stretch[0] == 0 or stretch[-1] + 1 == len(run):
        return False
    reading = run.columns[name][stretch]
    step = np.abs(np.diff(reading))
    beside = abs(float(reading[0] - run.columns[name][stretch[0] - 1]))
    loaded = np.ptp(run.torque_Nm[stretch]) > OTHER_SWING * np.ptp(run.torque_Nm)
    return bool((loaded and not step.any()) or np.median(step) > ERRATIC * beside)


def culprit(run: Run, curve: MeanCurve, burst: IntArray, found: BoolArray) -> str | None:
    """Return the column that causes a burst, or none if it may be the drive.

    Torque and lost motion that deviate together are a load. A column that does not return is not
    the cause.
    """
    rest = off_neighbours(curve.rest(run), burst, found)
    at = int(np.argmax(np.abs(rest)))
    lost = float(off_neighbours(run.lost_motion_rad, burst, found)[at])
    load = float(off_neighbours(curve(run.torque_Nm), burst, found)[at])
    most = max(abs(lost), abs(load))
    if abs(rest[at]) < COUNTS * lost_motion_count(run):
        return None
    if abs(rest[at]) < OWN_SHARE * most or lost * load > FOLLOWED_SHARE * most**2:
        return None
    name = "lost_motion"
    angles = [name for name in ("input_angle", "output_angle") if name in run.columns]
    if abs(load) > abs(lost):
        name = "torque"
    elif len(angles) == 2:
        jerk = [standing_out(run.columns[name], burst, found) for name in angles]
        name = angles[int(np.argmax(jerk))]
    torque, angle = (leaves(run.columns[q], burst, found, at) for q in ("torque", "lost_motion"))
    if torque and angle and not curve.covers:
        return None
    return name if (torque if name == "torque" else angle) else None


def lost_motion_count(run: Run) -> float:
    """Resolution of the lost motion in rad from the encoder counts of a run."""
    if not {"input_angle", "output_angle"} <= run.columns.keys():
        return count_rad(run.lost_motion_rad) or 0.0
    stated = counters_of(run.sources)
    count = {
        name: stated[name].count_rad if name in stated else count_rad(run.columns[name]) or 0.0
        for name in ("input_angle", "output_angle")
    }
    turned = float(np.ptp(run.columns["input_angle"]))
    turned_out = float(np.ptp(run.columns["output_angle"] - run.lost_motion_rad))
    share = turned_out / turned if turned > 0 else 0.0
    return count["input_angle"] * share + count["output_angle"]


def sound_near(burst: IntArray, found: BoolArray) -> IntArray:
    """Rows near a burst that are not in a burst."""
    begin = max(int(burst[0]) - 2 * BURST, 0)
    near = np.flatnonzero(~found[begin : int(burst[-1]) + 2 * BURST + 1])
    return np.asarray(near + begin)


def off_neighbours(values: FloatArray, burst: IntArray, found: BoolArray) -> FloatArray:
    """Deviation of the samples of a burst from the line between its neighbours."""
    near = sound_near(burst, found)
    if near.size == 0:
        return np.zeros(burst.size)
    return np.asarray(values[burst] - np.interp(burst, near, values[near]))


def leaves(values: FloatArray, burst: IntArray, found: BoolArray, at: int) -> bool:
    """Whether a column exceeds its noise and steps in a burst, and returns."""
    off = abs(float(off_neighbours(values, burst, found)[at]))
    sound = np.flatnonzero(~found)
    least = max(
        OWN_DEVIATIONS * local_noise(values[sound], int(np.searchsorted(sound, burst[at]))),
        DEVIATIONS * resolution(values, np.abs(np.diff(values))),
    )
    return off > least and comes_back(values, burst, found, off)


def comes_back(values: FloatArray, burst: IntArray, found: BoolArray, off: float) -> bool:
    """Whether a column after a burst is near its value before it, or deviated from both.

    A reading between the two may be delayed. At an end of the run only one side is known; there the
    adjacent steps must be small.
    """
    near = sound_near(burst, found)
    before, behind = near[near < burst[0]], near[near > burst[-1]]
    if before.size and behind.size:
        low, high = sorted((float(values[before[-1]]), float(values[behind[0]])))
        beyond = np.abs(values[burst] - np.clip(values[burst], low, high))
        return bool(high - low < OWN_SHARE * off or np.min(beyond) > BEYOND_SHARE * off)
    steps = np.abs(np.diff(values[near]))
    return bool(steps.size > 0 and off > TIMES_BESIDE * float(steps.max()))


def standing_out(values: FloatArray, burst: IntArray, found: BoolArray) -> float:
    """Deviation of a burst from its neighbours, in usual steps of the channel."""
    usual = scatter(np.diff(values)) + 1e-12 * float(np.max(np.abs(values)) + 1.0)
    return float(np.max(np.abs(off_neighbours(values, burst, found)))) / usual


def wild_values(values: FloatArray, plausible: tuple[float, float] | None, slow: bool) -> BoolArray:
    """Mark the outliers of a column that no other column checks; `slow` is one of `SLOW`."""
    wild = np.zeros(values.size, dtype=bool)
    known = np.isfinite(values)
    if plausible is not None:
        beyond = known & ((values < plausible[0]) | (values > plausible[1]))
        # If most values are, the unit or the sensor is different, and no sample is an outlier.
        if np.count_nonzero(beyond) < 0.5 * np.count_nonzero(known):
            wild |= beyond
    rows = np.flatnonzero(known & ~wild)
    wild[rows[markers(values[rows], absolute=True)]] = True
    least = 0.0 if plausible is None else PLAUSIBLE_SHARE * (plausible[1] - plausible[0])
    if slow:
        rows = np.flatnonzero(known & ~wild)
        wild[rows[excursions(values[rows], least)]] = True
        if plausible is not None:
            rows = np.flatnonzero(known & ~wild)
            wild[rows[dead_section(values[rows], least)]] = True
    rows = np.flatnonzero(known & ~wild)
    wild[rows[bursts(values[rows], np.full(rows.size, least / DEVIATIONS), absolute=True)]] = True
    return wild


def excursions(values: FloatArray, least: float) -> BoolArray:
    """Mark the stretches within a run that are far outside of all others, in one step and back."""
    marked = np.zeros(values.size, dtype=bool)
    if values.size < 2 * BURST:
        return marked
    low, high = np.quantile(values, [0.25, 0.75])
    reach = max(RANGES * (high - low), least, OWN_DEVIATIONS * scatter(np.diff(values)))
    outside = (values < low - reach) | (values > high + reach)
    if np.count_nonzero(outside) > SHARE_MAX * values.size:
        return marked
    for stretch in consecutive_rows(outside):
        first, last = stretch[0], stretch[-1]
        if first == 0 or last + 1 == values.size:
            continue
        away = float(np.min(np.abs(values[stretch] - np.clip(values[stretch], low, high))))
        step = abs(values[first] - values[first - 1]), abs(values[last + 1] - values[last])
        marked[stretch] = min(step) > OWN_SHARE * away
    return marked


def dead_section(values: FloatArray, least: float) -> BoolArray:
    """Mark a constant part of a run behind or before a leap that no drive makes.

    A disconnected sensor reads zero; the other part of the run varies as a sensor does.
    """
    marked = np.zeros(values.size, dtype=bool)
    step = np.abs(np.diff(values))
    if step.size < 2 * FROZEN_LEAST:
        return marked
    at = int(np.argmax(step)) + 1
    rest = float(np.partition(step, -2)[-2])
    parts = slice(0, at), slice(at, values.size)
    constant = [float(np.ptp(values[part])) == 0.0 for part in parts]
    for part, dead in zip(parts, constant, strict=True):
        length = values[part].size
        if dead and sum(constant) == 1 and length >= FROZEN_LEAST:
            marked[part] = step[at - 1] > max(TIMES_BESIDE * rest, DEAD_STEPS * least)
    return marked
