"""Joining: columns recorded at different times become rows, on request.

The slowest column among torque and angles defines the times of the rows; the other columns are
resampled at these times. Times are integer nanoseconds; only differences become seconds.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from collections.abc import Set as AbstractSet
from pathlib import Path
from typing import Literal

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray, WholeArray
from lostmotion.errors import InputError
from lostmotion.recordings.bags import HEADER_STAMP, RECEIVE_TIME, Channel
from lostmotion.recordings.bursts import wild_clock
from lostmotion.recordings.clocks import NS
from lostmotion.recordings.findings import Finding
from lostmotion.recordings.soundness import GAP_FACTOR

Join = Literal["nearest", "linear"]

JOINS: tuple[Join, ...] = ("nearest", "linear")
"""Methods of joining columns."""


NANO = 1e-9

WRAP_SHARE = 0.5
"""A step of more than this share of the range of a column is not interpolated, because it is an
encoder that wraps: the nearest sample is used."""

JITTER = 1.0
"""Largest difference between two topics in the delay from stamp to receipt, in rows, that is not
reported."""


def join_channels(
    file: Path,
    channels: Sequence[Channel],
    leading: Collection[str],
    how: Join | None,
    clock: str | None,
    findings: list[Finding],
) -> dict[str, FloatArray]:
    """Make one table of the columns of a bag.

    Parameters
    ----------
    file : Path
    channels : sequence of Channel
    leading : collection of str
        Columns of which the slowest defines the rows: torque and angles.
    how : {"nearest", "linear"} or None
        None refuses columns of different clocks.
    clock : str or None
        `RECEIVE_TIME` or `HEADER_STAMP`; None uses the stamps of the headers if all have them.
    findings : list of Finding
        Receives what was joined, and the largest gaps.

    Returns
    -------
    dict
        Columns by name, including ``time_s`` from the first row.

    Raises
    ------
    InputError
        For different clocks without a request, and for columns without common time.
    """
    stamps = choose_clock(file, channels, leading, clock, findings)
    channels, stamps = in_order(file, channels, stamps, findings)
    groups = same_clock(stamps)
    if len(groups) == 1:
        time_ns = stamps[0]
        return {
            "time_s": (time_ns - time_ns[0]) / NS,
            **{channel.column: channel.values for channel in channels},
        }
    if how is None:
        rates = ", ".join(
            f"{channels[group[0]].topic} at {rate(stamps[group[0]])}" for group in groups
        )
        raise InputError(
            file, "", f"{len(groups)} clocks: {rates}", "--join linear, or --join nearest"
        )
    lead = [group for group in groups if any(channels[i].column in leading for i in group)]
    base = min(lead or groups, key=lambda group: stamps[group[0]].size)
    within = common_time(file, channels, stamps, groups, stamps[base[0]])
    note_delays(file, channels, stamps, base, findings)
    outside = int(np.count_nonzero(~within))
    if outside:
        action = "rows before or after the other topics, left out"
        findings.append(
            Finding("outside", str(file), channels[base[0]].topic, None, outside, action)
        )
    kept = stamps[base[0]][within]
    table: dict[str, FloatArray] = {"time_s": (kept - kept[0]) / NS}
    rows = f"the rows of {channels[base[0]].topic} at {rate(stamps[base[0]])}"
    for i in (i for group in groups for i in group):
        channel = channels[i]
        if i in base:
            table[channel.column] = channel.values[within]
            continue
        values, gap_s, paused = read_at(kept, stamps[i], channel.values, how)
        table[channel.column] = values
        action = f"{how} from {rate(stamps[i])} to {rows}; largest gap {gap_s * 1e3:.4g} ms"
        if paused:
            action += f"; no value in {paused} rows where it pauses"
        findings.append(Finding("joined", str(file), channel.column, None, int(kept.size), action))
    return table


def join_rows(
    columns: Mapping[str, FloatArray], leading: Collection[str], how: Join | None
) -> tuple[dict[str, FloatArray], dict[str, tuple[float, int]]] | None:
    """Join the columns of a run whose rows have numbers in some columns only.

    Parameters
    ----------
    columns : mapping
        By quantity, with ``time`` in s; NaN if missing.
    leading : collection of str
        Quantities of which the slowest defines the rows.
    how : {"nearest", "linear"} or None
        None joins only columns with the same times, which needs no choice.

    Returns
    -------
    columns : dict
        Rows at the times of the slowest leading column, between the first and last times of all.
    gaps : dict
        Largest gap in s of each resampled column, and its number of rows without a value.
        Instead of both None, if there is nothing to join.
    """
    order = np.argsort(columns["time"], kind="stable")
    order = order[np.isfinite(columns["time"][order])]
    time_ns = np.rint(columns["time"][order] / NANO).astype(np.int64)
    values = {name: column[order] for name, column in columns.items() if name != "time"}
    known = {name: np.flatnonzero(np.isfinite(column)) for name, column in values.items()}
    led = {name: time_ns[known[name]] for name in values if name in leading}
    if any(stamps.size == 0 for stamps in led.values()):
        return None
    base = min(led, key=lambda name: led[name].size)
    first, last = max(s[0] for s in led.values()), min(s[-1] for s in led.values())
    within = (led[base] >= first) & (led[base] <= last)
    if how is None:
        # Rows without any number are of a channel that has none there.
        empty = time_ns[~np.any([np.isfinite(column) for column in values.values()], axis=0)]
        clocks = [np.union1d(stamps, empty) if empty.size else stamps for stamps in led.values()]
        if not all(np.array_equal(clock, clocks[0]) for clock in clocks):
            return None
        within &= np.all([np.isin(led[base], stamps) for stamps in led.values()], axis=0)
    rows_ns = led[base][within]
    if rows_ns.size == 0:
        return None
    joined = {"time": columns["time"][order][known[base]][within]}
    gaps: dict[str, tuple[float, int]] = {}
    for name, column in values.items():
        at = known[name]
        if at.size == 0:
            joined[name] = np.full(rows_ns.size, np.nan)
            continue
        joined[name], gap_s, paused = read_at(rows_ns, time_ns[at], column[at], how or JOINS[0])
        if gap_s > 0 or paused:
            gaps[name] = gap_s, paused
    return joined, gaps


def stamps_aside(columns: Mapping[str, FloatArray], leading: AbstractSet[str]) -> FloatArray:
    """Remove wild time stamps of columns with numbers in different rows, and return them in s.

    In the order in which each column was written: sorted by time, its rows no longer show them.
    """
    wild = np.zeros(columns["time"].size, dtype=bool)
    for name in leading & columns.keys():
        rows = np.flatnonzero(np.isfinite(columns[name]) & np.isfinite(columns["time"]))
        wild[rows[wild_clock(columns["time"][rows])]] = True
    seconds = columns["time"][wild]
    columns["time"][wild] = np.nan
    return seconds


def common_time(
    file: Path,
    channels: Sequence[Channel],
    stamps: Sequence[WholeArray],
    groups: Sequence[Sequence[int]],
    time_ns: WholeArray,
) -> BoolArray:
    """Rows at which every column has values.

    Raises
    ------
    InputError
        If there is none.
    """
    first = max(stamp[0] for stamp in stamps)
    last = min(stamp[-1] for stamp in stamps)
    within = np.asarray((time_ns >= first) & (time_ns <= last))
    if not within.any():
        spans = ", ".join(
            f"{channels[at].topic} {stamps[at][0] * NANO:.3f} to {stamps[at][-1] * NANO:.3f} s"
            for at, *_ in groups
        )
        expected = "topics that overlap in time; --map receive_time=time_s if their clocks differ"
        raise InputError(file, "", f"no common time: {spans}", expected)
    return within


def choose_clock(
    file: Path,
    channels: Sequence[Channel],
    leading: Collection[str],
    clock: str | None,
    findings: list[Finding],
) -> list[WholeArray]:
    """Stamps of every column, all of one clock.

    Header stamps if torque and angles have them. Other columns without stamps are assumed to have
    the same delay at receipt.

    Raises
    ------
    InputError
        If header stamps are requested that a topic does not have.
    """
    first = [c for c in channels if c.column in leading] or channels
    without = sorted({channel.topic for channel in first if channel.header_ns is None})
    if clock == HEADER_STAMP and without:
        found = f"no stamp in the headers of {', '.join(without)}"
        raise InputError(file, HEADER_STAMP, found, f"--map {RECEIVE_TIME}=time_s")
    if clock == RECEIVE_TIME or without:
        if without and clock is None and len(without) < len({c.topic for c in channels}):
            action = (
                f"times of receipt used for all topics: {', '.join(without)} has no stamps in "
                "its headers"
            )
            findings.append(Finding("clock", str(file), "time_s", None, 1, action))
        return [channel.received_ns for channel in channels]
    ages = [int(np.median(c.received_ns - c.header_ns)) for c in first if c.header_ns is not None]
    age_ns = int(np.median(ages))
    for topic in sorted({c.topic for c in channels if c.header_ns is None}):
        action = (
            f"no stamps: times of receipt minus {age_ns * 1e-6:.4g} ms, the delay of the others"
        )
        findings.append(Finding("clock", str(file), topic, None, 1, action))
    return [c.received_ns - age_ns if c.header_ns is None else c.header_ns for c in channels]


def in_order(
    file: Path,
    channels: Sequence[Channel],
    stamps: Sequence[WholeArray],
    findings: list[Finding],
) -> tuple[list[Channel], list[WholeArray]]:
    """Sort the messages of every column by their stamps, and count those out of order."""
    sorted_channels, sorted_stamps = [], []
    counted: set[str] = set()
    for channel, stamp in zip(channels, stamps, strict=True):
        back = int(np.count_nonzero(np.diff(stamp) < 0))
        if back:
            order = np.argsort(stamp, kind="stable")
            header = None if channel.header_ns is None else channel.header_ns[order]
            channel = Channel(
                channel.column,
                channel.topic,
                header,
                channel.received_ns[order],
                channel.values[order],
            )
            stamp = stamp[order]
            if channel.topic not in counted:
                counted.add(channel.topic)
                action = "messages with decreasing stamps, sorted"
                findings.append(
                    Finding("backward_time", str(file), channel.topic, None, back, action)
                )
        sorted_channels.append(channel)
        sorted_stamps.append(stamp)
    return sorted_channels, sorted_stamps


def same_clock(stamps: Sequence[WholeArray]) -> list[list[int]]:
    """Group columns whose stamps are the same."""
    groups: list[list[int]] = []
    for i, stamp in enumerate(stamps):
        for group in groups:
            if np.array_equal(stamps[group[0]], stamp):
                group.append(i)
                break
        else:
            groups.append([i])
    return groups


def note_delays(
    file: Path,
    channels: Sequence[Channel],
    stamps: Sequence[WholeArray],
    base: Sequence[int],
    findings: list[Finding],
) -> None:
    """Report topics whose delay between stamp and receipt differs from that of the rows.

    Sensor clocks that differ look like a lag; the time of receipt, from a single clock, reveals it.
    """
    delays: Mapping[str, float] = {
        channel.topic: float(np.median(channel.received_ns - channel.header_ns)) * NANO
        for channel in channels
        if channel.header_ns is not None
    }
    rows = channels[base[0]]
    step = np.diff(stamps[base[0]])
    usual = float(np.median(step)) * NANO if step.size else 0.0
    if rows.topic not in delays or stamps[base[0]] is rows.received_ns:
        return
    for topic, delay in delays.items():
        apart = delay - delays[rows.topic]
        if abs(apart) > JITTER * usual > 0:
            action = (
                f"stamps {abs(apart) * 1e3:.4g} ms {'older' if apart > 0 else 'younger'} at "
                f"receipt than those of {rows.topic}: a different clock or a slow transmission; "
                f"--map {RECEIVE_TIME}=time_s uses the times of receipt"
            )
            findings.append(Finding("delay", str(file), topic, None, 1, action))


def read_at(
    rows_ns: WholeArray, stamp_ns: WholeArray, values: FloatArray, how: Join
) -> tuple[FloatArray, float, int]:
    """Resample a column at other times within its range.

    Returns
    -------
    values : ndarray
        NaN where the column pauses.
    gap_s : float
        nearest: largest distance to a sample; linear: longest step interpolated; over rows with a
        value.
    paused : int
        Rows without a value.
    """
    after = np.clip(np.searchsorted(stamp_ns, rows_ns), 1, max(stamp_ns.size - 1, 1))
    if stamp_ns.size == 1:
        return np.full(rows_ns.size, values[0]), 0.0, 0
    before = after - 1
    step = stamp_ns[after] - stamp_ns[before]
    exact = (rows_ns == stamp_ns[after]) | (rows_ns == stamp_ns[before])
    late = rows_ns - stamp_ns[before] > stamp_ns[after] - rows_ns
    nearest = np.where(late, after, before)
    way = np.abs(rows_ns - stamp_ns[nearest])
    usual = float(np.median(np.diff(stamp_ns)))
    paused = (step > GAP_FACTOR * usual) & ~exact
    out = values[nearest].copy()
    gap = way
    if how == "linear":
        gap = np.where(exact, 0, step)
        rise = values[after] - values[before]
        covered = values[np.isfinite(values)]
        between = np.abs(rise) <= WRAP_SHARE * float(np.ptp(covered)) if covered.size else late
        share = (rows_ns - stamp_ns[before]) / np.maximum(step, 1)
        out = np.where(between & ~exact, values[before] + share * rise, out)
    out[paused] = np.nan
    kept = gap[~paused]
    return out, float(np.max(kept)) * NANO if kept.size else 0.0, int(np.count_nonzero(paused))


def rate(stamp_ns: WholeArray) -> str:
    """Usual rate of stamps."""
    span = float(stamp_ns[-1] - stamp_ns[0]) * NANO
    if stamp_ns.size < 2 or span <= 0:
        return f"{stamp_ns.size} message{'s' * (stamp_ns.size != 1)}"
    return f"{(stamp_ns.size - 1) / span:.4g} Hz"
