"""Soundness: checks of clocks, dead sensors, ratio and sign, reported as findings."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray
from lostmotion.errors import InputError
from lostmotion.recordings.astray import astray, unconnected
from lostmotion.recordings.campaign import Campaign, Log, Run
from lostmotion.recordings.dissipated import dissipated_work, sign_of
from lostmotion.recordings.encoders import (
    FOLLOWED_SLACK,
    OPEN_ACTION,
    PUT_BACK,
    TURN,
    UNDECIDED_ACTION,
    Counter,
    PutBack,
    count_rad,
    open_steps,
    put_back,
    unwrap,
    unwrap_known,
)
from lostmotion.recordings.findings import Finding
from lostmotion.recordings.frozen import frozen_rows
from lostmotion.recordings.quantities import QUANTITIES

ANGLES = ("input_angle", "output_angle")
"""Angles whose difference is the lost motion."""

STUCK_SAMPLES = 50
"""Shortest section of identical values that counts as stuck."""

STUCK_SWING = 0.25
"""Share of its own range by which the other channel must move meanwhile."""

STUCK_TURN_RAD = 0.2
"""Rotation of the output beyond any wind-up, which both encoders must show."""

FROZEN_MAX = 0.5
"""Largest share of a run with frozen readings; with more the run is not examined."""

FROZEN_ACTION = "constant reading while the drive moved; rows left out"

ASTRAY_ACTION = "outliers; rows left out"
UNCONNECTED_ACTION = "torque and angles all read 0, as without a connection; rows left out"

LOAD_JUMP = 0.25
"""Share of the torque range above which a step is a load jump."""

GAP_FACTOR = 10.0
"""A time step this many times the usual one is a gap in the recording, or in one of its columns."""

DUPLICATE_ACTION = "kept in file order"

COPIED_ACTION = "rows that repeat another one in every column; counted once"

REGULAR = (0.01, 0.1)
"""A clock is regular if at most the first share of its steps deviates from the usual step by more
than the second share: loggers that wait between readings jitter by some hundredths."""

EARLY_SHARE = 0.5
"""A step of a regular clock below this share of the usual step is a fault: it is nearer to zero
than to a full step."""

BACKWARD_ACTION = "kept in file order; if another recording begins there, mark it in a column run"
"""Action for decreasing time, and its usual cause."""

SCRAMBLED = (10, 0.05)
"""Least number of backward steps, and least share of all steps, of a run in another order than its
times: a clock that is set or begins anew goes back once. Chosen."""

AT_RANDOM = (1 / 2, 1 / 3)
"""Expected share of backward steps of rows in random order, and their mean distance from their
places in order of time as a share of the rows."""

SORTED_ACTION = "rows in another order than their times: sorted by time"

STEP_LEAST_S = 1e-9
"""Least usual time step of a recording."""


def check_steps(file: str, time_s: FloatArray) -> None:
    """Refuse a clock in a wrong unit: such short steps would overflow speeds."""
    step = np.diff(time_s)
    step = step[step > 0]
    if step.size and float(np.median(step)) < STEP_LEAST_S:
        found = f"steps of {float(np.median(step)):.3g} s"
        raise InputError(file, "time_s", found, f"{STEP_LEAST_S:g} s or more")


def sound_run(
    file: str,
    label: int | str,
    columns: dict[str, FloatArray],
    ratio: float | None,
    findings: list[Finding],
    counters: Mapping[str, Counter] | None = None,
    *,
    scrambled: bool = False,
) -> Run | None:
    """Check a run, report faults, and leave out only unusable rows.

    `scrambled` states that the rows of the file are in no order, as the labels of its runs show.
    """

    def note(kind: str, column: str, count: int, action: str) -> None:
        findings.append(Finding(kind, file, column, label, count, action))

    backward = steps_of_disorder(columns["time"], scrambled)
    if backward:
        order = np.argsort(columns["time"], kind="stable")
        columns = {quantity: values[order] for quantity, values in columns.items()}
        note("backward_time", "time_s", backward, SORTED_ACTION)
    needed: list[str] = [n for n in ("time", "torque", "lost_motion") if n in columns]
    if "lost_motion" not in columns:
        needed += [name for name in ANGLES if name in columns]
    usable = np.ones(columns["torque"].size, dtype=bool)
    for quantity, values in columns.items():
        bad = ~np.isfinite(values)
        count = int(np.count_nonzero(bad))
        if count == 0:
            continue
        column = QUANTITIES[quantity].column
        if quantity in needed:
            usable &= ~bad
            note("nan", column, count, "rows left out")
        else:
            note("nan", column, count, "kept; the column is interpolated between its readings")
    if not usable.any():
        return None
    misread = np.zeros(usable.size, dtype=bool)
    for quantity, rows, action in misreadings(columns, ratio, counters):
        seconds = tuple(float(t) for t in columns["time"][rows])
        column, count = QUANTITIES[quantity].column, int(np.count_nonzero(rows))
        findings.append(Finding("wild", file, column, label, count, action, seconds))
        misread |= rows
    usable &= ~misread
    copied = copied_rows(columns, usable)
    if copied.any():
        note("duplicate_time", "time_s", int(np.count_nonzero(copied)), COPIED_ACTION)
        usable &= ~copied
    # Over all other rows: if rows are left out, the remaining steps are longer than those of the
    # encoder.
    log = Log(columns, np.flatnonzero(usable))
    columns = dict(columns)
    complete_angles(columns, misread, ratio, note, counters)
    if not usable.all():
        columns = {quantity: values[usable] for quantity, values in columns.items()}

    check_steps(file, columns["time"])
    step = np.diff(columns["time"])
    if step.size:
        duplicates = int(np.count_nonzero(step == 0))
        backward = int(np.count_nonzero(step < 0))
        usual = float(np.median(step[step > 0])) if np.any(step > 0) else 0.0
        gaps = int(np.count_nonzero(step > GAP_FACTOR * usual)) if usual > 0 else 0
        early = early_steps(step, usual)
        if duplicates:
            note("duplicate_time", "time_s", duplicates, DUPLICATE_ACTION)
        if backward:
            note("backward_time", "time_s", backward, BACKWARD_ACTION)
        if gaps:
            note("gap", "time_s", gaps, f"steps above {GAP_FACTOR * usual:.3g} s, kept")
        if early:
            note(
                "clock",
                "time_s",
                early,
                f"steps below {EARLY_SHARE * usual:.3g} s where nearly all are {usual:.3g} s: "
                "the clock was set back, or a row came early; kept",
            )
    locked = [] if "lost_motion" in columns else [n for n in ANGLES if n not in columns]
    if "lost_motion" not in columns:
        # A locked side is at rest; it has no encoder that could lose turns or be dead.
        columns |= {name: np.zeros(columns["time"].size) for name in locked}
        turned = columns["input_angle"] if "input_angle" in locked else None
        if turned is None:
            assert ratio is not None
            turned = columns["input_angle"] / ratio
        columns["lost_motion"] = columns["output_angle"] - turned
    measured = {name: values for name, values in columns.items() if name not in locked}
    for quantity, count in stuck_sensors(measured, ratio).items():
        note("stuck", QUANTITIES[quantity].column, count, "kept; looks like a dead sensor")
    return Run(label, file, columns, log=log)


def steps_of_disorder(time_s: FloatArray, scrambled: bool) -> int:
    """Count the backward steps of a run whose rows are in another order than their times.

    As a database returns rows without an order, or a table sorted by another column, or two rows
    that were written in the wrong order. The file shows it, or the times themselves: each row that
    moves is then one step of the clock from its neighbours; or of many rows out of order, nearly
    all have the same step; or they are at least half as far from order as at random.
    """
    time_s = time_s[np.isfinite(time_s)]
    step = np.diff(time_s)
    count, (least, share) = int(np.count_nonzero(step < 0)), SCRAMBLED
    if count == 0 or not np.any(step > 0):
        return 0
    order = np.argsort(time_s, kind="stable")
    moved = order != np.arange(order.size)
    forward = np.diff(time_s[order])
    beside = forward[moved[1:] | moved[:-1]]
    step_s = float(np.median(step[step > 0]))
    if np.all(np.abs(beside - step_s) <= REGULAR[1] * step_s):
        return count
    if count < max(least, share * step.size):
        return 0
    usual = float(np.median(forward))
    irregular = np.count_nonzero(np.abs(forward - usual) > REGULAR[1] * usual)
    away = float(np.mean(np.abs(order - np.arange(order.size)))) / order.size
    backward, distance = AT_RANDOM
    random = usual > 0 and 2 * count >= backward * step.size and 2 * away >= distance
    return count if scrambled or random or irregular <= REGULAR[0] * forward.size else 0


def copied_rows(columns: Mapping[str, FloatArray], usable: BoolArray) -> BoolArray:
    """Mark the rows that repeat an earlier one in every column: one sample, written again.

    If different samples have the same stamp, the clock is coarse, and equal rows may be samples of
    a drive at rest.
    """
    time_s, copied = columns["time"], np.zeros(usable.size, dtype=bool)
    rows = np.flatnonzero(usable)
    order = rows[np.argsort(time_s[rows], kind="stable")]
    again = time_s[order[1:]] == time_s[order[:-1]]
    first, second = order[:-1][again], order[1:][again]
    if all(np.array_equal(v[first], v[second], equal_nan=True) for v in columns.values()):
        copied[second] = True
    return copied


def early_steps(step_s: FloatArray, usual_s: float) -> int:
    """Count the steps of a regular clock that are much shorter than the usual one."""
    forward = step_s[step_s > 0]
    share, within = REGULAR
    irregular = np.abs(forward - usual_s) > within * usual_s
    if np.count_nonzero(irregular) > share * forward.size:
        return 0
    return int(np.count_nonzero(forward < EARLY_SHARE * usual_s))


def misreadings(
    columns: Mapping[str, FloatArray],
    ratio: float | None,
    counters: Mapping[str, Counter] | None,
) -> Iterator[tuple[str, BoolArray, str]]:
    """Yield faults of raw readings: quantity, rows, report text."""
    zero = unconnected(columns)
    if zero.any():
        yield "torque", zero, UNCONNECTED_ACTION
        columns = {name: np.where(zero, np.nan, values) for name, values in columns.items()}
    if columns.keys() >= set(ANGLES) and ratio is not None and math.isfinite(ratio):
        known = np.isfinite(columns["input_angle"]) & np.isfinite(columns["output_angle"])
        for one, other, turns in ((*ANGLES, ratio), (*ANGLES[::-1], 1 / ratio)):
            rows = np.zeros(known.size, dtype=bool)
            if known.any():
                values = columns[one][known]
                stated = (counters or {}).get(one)
                count = count_rad(values) if stated is None else stated.count_rad
                rows[known] = astray(values, columns[other][known], turns, count)
            if rows.any():
                yield one, rows, ASTRAY_ACTION
    for quantity, rows in frozen_rows(columns, ratio).items():
        if np.count_nonzero(rows) <= FROZEN_MAX * rows.size:
            yield quantity, rows, FROZEN_ACTION


def complete_angles(
    columns: dict[str, FloatArray],
    misread: BoolArray,
    ratio: float | None,
    note: Callable[[str, str, int, str], None],
    counters: Mapping[str, Counter] | None,
) -> None:
    """Restore what the encoders of a run lost, and report it with undecided jumps."""
    angles = [name for name in ("input_angle", "output_angle") if name in columns]
    wraps: dict[str, tuple[int, str]] = {}
    opened = {name: open_steps(columns[name]) for name in angles}
    if ratio is not None and math.isfinite(ratio) and len(angles) == 2:
        known = np.isfinite(columns["input_angle"]) & np.isfinite(columns["output_angle"])
        known &= ~misread
        found = put_back(
            columns["input_angle"][known], columns["output_angle"][known], ratio, counters
        )
        for name, values in (("input_angle", found.input_rad), ("output_angle", found.output_rad)):
            if name in found.wraps:
                columns[name] = columns[name].copy()
                columns[name][known] = values
        wraps = found.wraps
        if not found.undecided.size:
            opened = {}
        count = count_undecided(found, columns["torque"][known], ratio)
        if count:
            note("jump", "lost_motion_rad", count, UNDECIDED_ACTION)
    else:
        for name in angles:
            columns[name], count = unwrap_known(columns[name])
            if count:
                wraps[name] = (count, PUT_BACK)
    for name in angles:
        column = QUANTITIES[name].column
        if name in wraps:
            note("wrap", column, *wraps[name])
        elif opened.get(name):
            note("wrap", column, opened[name], OPEN_ACTION)


def count_undecided(found: PutBack, torque_Nm: FloatArray, ratio: float) -> int:
    """Count the undecided jumps that are not caused by a jump of the load."""
    rows = found.undecided
    turns = (found.output_rad * ratio - found.input_rad) / TURN
    jump = np.diff(turns, prepend=turns[:1])[rows]
    load = np.abs(np.diff(torque_Nm, prepend=torque_Nm[:1]))[rows]
    calm = ~(load >= LOAD_JUMP * np.ptp(torque_Nm[np.isfinite(torque_Nm)]))
    return int(np.count_nonzero(calm | (np.abs(jump - np.rint(jump)) <= FOLLOWED_SLACK)))


def stuck_sensors(columns: Mapping[str, FloatArray], ratio: float | None) -> dict[str, int]:
    """List the sensors that were constant while their quantity moved, and for how many samples."""
    found = {}
    for quantity, other in (("torque", "lost_motion"), ("lost_motion", "torque")):
        count = longest_stuck(columns[quantity], columns[other])
        if count and quantity == "lost_motion" and "output_angle" in columns:
            stood = longest_stuck(columns["output_angle"], columns[other])
            quantity = "output_angle" if stood >= count else quantity
        if count:
            found[quantity] = count
    for quantity, count in dead_encoders(columns, ratio).items():
        found[quantity] = max(count, found.get(quantity, 0))
    return found


def dead_encoders(columns: Mapping[str, FloatArray], ratio: float | None) -> dict[str, int]:
    """List the encoders that were constant while the other turned more than a drive winds up."""
    if not {"input_angle", "output_angle"} <= columns.keys():
        return {}
    if ratio is None or not math.isfinite(ratio):
        return {}
    turns = {
        "input_angle": columns["input_angle"] / ratio,
        "output_angle": columns["output_angle"],
    }
    pairs = (("input_angle", "output_angle"), ("output_angle", "input_angle"))
    counts = {one: longest_stuck(turns[one], turns[other], STUCK_TURN_RAD) for one, other in pairs}
    return {quantity: count for quantity, count in counts.items() if count}


def longest_stuck(values: FloatArray, other: FloatArray, swing: float | None = None) -> int:
    """Length of the longest section of identical values while the other channel moved.

    Returns 0 if there is no section of at least `STUCK_SAMPLES` samples in which `other` covers
    `swing`, by default `STUCK_SWING` of its range.
    """
    if swing is None:
        swing = STUCK_SWING * float(np.ptp(other))
    change = np.flatnonzero(np.diff(values) != 0)
    edges = np.concatenate(([0], change + 1, [values.size]))
    lengths = np.diff(edges)
    if swing == 0:
        return 0
    longest = 0
    for i in np.flatnonzero(lengths >= STUCK_SAMPLES):
        if lengths[i] > longest and np.ptp(other[edges[i] : edges[i + 1]]) >= swing:
            longest = int(lengths[i])
    return longest


RATIO_DOUBT_RAD = 5e-3
"""Lost motion proportional to the rotation, 17 arcmin, above which the ratio is wrong."""


def check_ratio(campaign: Campaign, ratio: float | None) -> None:
    """Report a campaign whose angles turn in a ratio other than that stated."""
    if (
        ratio is None
        or math.isinf(ratio)
        or any(finding.kind == "stuck" for finding in campaign.findings)
    ):
        return
    measured, swing = [], []
    for run in campaign.runs:
        if not {"input_angle", "output_angle"} <= run.columns.keys():
            continue
        # With a wrong ratio the turns were not restored: each encoder is unwrapped separately.
        put_in, _ = unwrap(run.columns["input_angle"])
        out, _ = unwrap(run.columns["output_angle"])
        turned = float(np.ptp(out))
        if turned < STUCK_TURN_RAD or np.ptp(put_in) < STUCK_TURN_RAD or open_steps(put_in):
            continue
        centred = out - out.mean()
        measured.append(float(centred @ put_in) / float(centred @ centred))
        swing.append(turned)
    if not measured:
        return
    found = float(np.median(measured))
    if abs(found / ratio - 1) * float(np.median(swing)) > RATIO_DOUBT_RAD:
        action = (
            f"{found:.4g} input turns for one output turn by the angles, {ratio:.4g} by the ratio: "
            "check the ratio, its sign, and the units and signs of the two angles"
        )
        file = campaign.runs[0].file
        campaign.findings.append(
            Finding("ratio", file, "input_angle_rad", None, campaign.rows, action)
        )


def check_sign(campaign: Campaign) -> None:
    """Report a campaign whose lost motion falls with increasing torque: one sign is wrong.

    If a sensor is stuck, or the ratio wrong, the lost motion is not checked. An error of position
    may reverse the slope of an arm's recording, but not the work that it dissipates.
    """
    if any(finding.kind in ("stuck", "ratio") for finding in campaign.findings):
        return
    torque = campaign.column("torque")
    centred = np.concatenate(
        [run.lost_motion_rad - float(np.mean(run.lost_motion_rad)) for run in campaign.runs]
    )
    falls = float(np.dot(torque - torque.mean(), centred)) < 0
    if falls and sign_of(map(dissipated_work, campaign.runs)) <= 0:
        campaign.findings.append(
            Finding(
                "sign",
                campaign.runs[0].file,
                "lost_motion_rad",
                None,
                campaign.rows,
                "falls with increasing torque; reverse the sign of one column with --map "
                "COLUMN=-NAME_UNIT",
            )
        )
