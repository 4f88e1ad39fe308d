"""Clocks: time stamps as dates, times of day, seconds since an epoch, or in two columns.

Stamps are kept as integers until the first one is subtracted: nanoseconds since 1970 need 61 bits,
a float64 has 53.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.arrays import BoolArray, FloatArray, WholeArray
from lostmotion.errors import InputError
from lostmotion.recordings.cells import MISSING
from lostmotion.recordings.findings import Finding
from lostmotion.recordings.from_arrow import integers_of, mask_of

NS = 1_000_000_000
"""Nanoseconds in a second."""

DAY_NS = 86_400 * NS

LONGEST_S = (2**63 - 1) // 10**9 - 1
"""Largest number of seconds that 64 bits of ns hold, with a fraction: 292 years."""

EPOCH_S = 1e8
"""Three years: a clock that starts above this counts from an epoch, not from its own start."""

EPOCH_RANGE_S = (946_684_800.0, 4_102_444_800.0)
"""From 2000 to 2100, seconds since 1970: possible dates of a recording."""

STEP_RANGE_S = (1e-6, 600.0)
"""Possible steps of a recording: from 1 MHz to the readings of a manual test."""

UNITS_NS = {"s": NS, "ms": 1_000_000, "us": 1_000, "ns": 1}
"""Nanoseconds per clock unit."""

TIME_OF_DAY = (
    r"(?:(?P<days>[0-9]+) days? )?(?P<h>[0-9]{1,2}):(?P<min>[0-9]{2})(?::(?P<s>[0-9]{2}))?"
    r"(?:[.,:](?P<frac>[0-9]{1,12}))?(?: ?(?P<half>[aApP])\.?[mM]\.?)?"
)
ZONE = r"(?: ?(?P<zone>Z|z|UTC|GMT|[+-][0-9]{2}:?[0-9]{2}))?"
DAYS = {
    "year first": r"(?P<y>[0-9]{4})[-./](?P<m>[0-9]{1,2})[-./](?P<d>[0-9]{1,2})",
    "day first": r"(?P<d>[0-9]{1,2})[-./](?P<m>[0-9]{1,2})[-./](?P<y>[0-9]{4})",
    "month first": r"(?P<m>[0-9]{1,2})[-./](?P<d>[0-9]{1,2})[-./](?P<y>[0-9]{4})",
    "digits": r"(?P<y>[0-9]{4})(?P<m>[0-9]{2})(?P<d>[0-9]{2})",
}
"""Orders in which dates are written."""

BASIC = r"(?P<h>[0-9]{2})(?P<min>[0-9]{2})(?P<s>[0-9]{2})(?:[.,](?P<frac>[0-9]{1,12}))?"
"""Time of day in digits only, after a date and a T."""


def as_texts(column: Any) -> Any:
    """Return stamps as text without surrounding blanks; null if missing."""
    import pyarrow as pa
    import pyarrow.compute as pc

    if isinstance(column, pa.ChunkedArray):
        column = column.combine_chunks()
    text = pc.utf8_trim_whitespace(column.cast(pa.string()))
    lost = pc.is_in(pc.utf8_lower(text), value_set=pa.array(MISSING, pa.string()))
    return pc.if_else(lost, pa.scalar(None, pa.string()), text)


def stamped(cells: Sequence[str]) -> bool:
    """Whether most cells are dates or times of day."""
    count = sum(any(form.fullmatch(cell) for form in STAMP_FORMS) for cell in cells)
    return count > 0 and 2 * count > len(cells)


def in_whole_seconds(cells: Sequence[str]) -> bool:
    """Whether the cells are dates or times of day without fractions of a second."""
    whole = re.compile(r"[0-9]:[0-9]{2}:[0-9]{2}(?![0-9.,:])")
    return stamped(cells) and all(whole.search(cell) for cell in cells)


def stamp_forms() -> list[tuple[str, str]]:
    """List the formats of a stamp, and the order of the date in each; empty if none."""
    forms = [
        (rf"{days}(?:[T ,_]+{TIME_OF_DAY}{ZONE})?", order)
        for order, days in DAYS.items()
        if order != "digits"
    ]
    forms.append((rf"{DAYS['digits']}[T _]+{TIME_OF_DAY}{ZONE}", "digits"))
    forms += [
        (rf"{days}T{BASIC}{ZONE}", order)
        for order, days in DAYS.items()
        if order in ("year first", "digits")
    ]
    return [*forms, (rf"{TIME_OF_DAY}{ZONE}", "")]


STAMP_FORMS = [re.compile(form) for form, _ in stamp_forms()]


def stamp_parts(texts: Any, form: str) -> tuple[dict[str, npt.NDArray[Any]], BoolArray]:
    """Split stamps by a format: text of every part, and which stamps have the format."""
    import pyarrow.compute as pc

    found = pc.extract_regex(texts, f"^(?:{form})$")
    has = mask_of(pc.is_valid(found))
    parts = {}
    for i in range(found.type.num_fields):
        name = found.type.field(i).name
        field = pc.fill_null(pc.struct_field(found, [i]), "")
        parts[name] = field
    return parts, has


def whole(parts: dict[str, Any], name: str, rows: int) -> WholeArray:
    """Read a part as integers, 0 if empty."""
    import pyarrow.compute as pc

    if name not in parts:
        return np.zeros(rows, dtype=np.int64)
    text = pc.if_else(pc.equal(parts[name], ""), "0", parts[name])
    return integers_of(text)


def seconds_of_day(parts: dict[str, Any], rows: int) -> WholeArray:
    """Nanoseconds since midnight, without zones."""
    import pyarrow.compute as pc

    hours, minutes, seconds = (whole(parts, name, rows) for name in ("h", "min", "s"))
    if "frac" in parts:
        padded = pc.utf8_slice_codeunits(pc.utf8_rpad(parts["frac"], 9, "0"), 0, 9)
        fraction = whole({"frac": padded}, "frac", rows)
    else:
        fraction = np.zeros(rows, dtype=np.int64)
    if "half" in parts:
        half = np.asarray(pc.utf8_lower(parts["half"]).to_numpy(zero_copy_only=False))
        hours = np.where(half == "", hours, hours % 12 + 12 * (half == "p"))
    if "s" in parts and "h" in parts:
        # 12:34.5 is minutes and seconds: decimals of a minute are not used.
        short = mask_of(pc.equal(parts["s"], ""))
        given = mask_of(pc.not_equal(parts["frac"], ""))
        shift = short & given
        hours, minutes, seconds = (
            np.where(shift, 0, hours),
            np.where(shift, hours, minutes),
            np.where(shift, minutes, seconds),
        )
    total = ((hours * 60 + minutes) * 60 + seconds) * NS + fraction
    total += whole(parts, "days", rows) * DAY_NS
    if "zone" in parts:
        zone = pc.replace_substring_regex(parts["zone"], "^(?:Z|z|UTC|GMT)$", "")
        zone = pc.replace_substring(zone, ":", "")
        offset = whole({"zone": pc.replace_substring_regex(zone, "^[+]", "")}, "zone", rows)
        sign, size = np.sign(offset), np.abs(offset)
        total -= sign * ((size // 100) * 60 + size % 100) * 60 * NS
    return total


def days_of(parts: dict[str, Any], rows: int) -> tuple[WholeArray, BoolArray]:
    """Days since 1970, and which dates exist."""
    year, month, day = (whole(parts, name, rows) for name in ("y", "m", "d"))
    good = (month >= 1) & (month <= 12) & (day >= 1)
    months = ((year - 1970) * 12 + np.where(good, month, 1) - 1).astype("M8[M]")
    first = months.astype("M8[D]").astype(np.int64)
    length = (months + 1).astype("M8[D]").astype(np.int64) - first
    return first + day - 1, good & (day <= length)


def read_stamps(
    file: str, column: str, texts: Any, place: Callable[[int], str]
) -> tuple[WholeArray, BoolArray, list[Finding]]:
    """Read dates and times of day as nanoseconds.

    Returns
    -------
    stamps : ndarray of int64
        Since 1970, or since midnight of the first day if there is no date.
    known : ndarray of bool
        Which rows have a stamp.
    findings : list of Finding

    Raises
    ------
    InputError
        If the order of day and month is unknown and matters.
    """
    rows = len(texts)
    readings: list[tuple[str, WholeArray, BoolArray]] = []
    for form, order in stamp_forms():
        parts, has = stamp_parts(texts, form)
        if not has.any():
            continue
        total = seconds_of_day(parts, rows)
        if order:
            days, there = days_of(parts, rows)
            total, has = total + days * DAY_NS, has & there
        readings.append((order, total, has))
    if not readings:
        return np.zeros(rows, dtype=np.int64), np.zeros(rows, dtype=np.bool_), []
    most = max(int(np.count_nonzero(has)) for _, _, has in readings)
    best = [reading for reading in readings if np.count_nonzero(reading[2]) == most]
    order, stamps, known = best[0]
    for other_order, other, _ in best[1:]:
        steps, others = np.diff(stamps[known]), np.diff(other[known])
        if not np.array_equal(steps, others):
            row = int(np.flatnonzero(known)[0])
            found = f"'{texts[row]}' in {place(row)}, which is the {order} or the {other_order}"
            raise InputError(file, column, found, "dates as 2025-04-17, the year first")
    findings = []
    if not order:
        at = np.flatnonzero(known)
        over = np.flatnonzero(np.diff(stamps[at]) < -DAY_NS // 2)
        for row in at[over + 1]:
            stamps[row:] += DAY_NS
        if over.size:
            action = "time of day passes midnight; one day added"
            findings.append(Finding("clock", file, column, None, int(over.size), action))
    return stamps, known, findings


def epoch_unit(file: str, column: str, values: FloatArray) -> tuple[str, Finding] | None:
    """Find the unit of a clock without unit, if dates and steps allow only one.

    None if the numbers do not count from an epoch.

    Raises
    ------
    InputError
        If no unit, or more than one, is possible.
    """
    known = values[np.isfinite(values)]
    if known.size == 0:
        return None
    steps = np.abs(np.diff(known))
    steps = steps[steps > 0]
    step = float(np.median(steps)) if steps.size else float("nan")
    dated = [
        unit
        for unit, ns in UNITS_NS.items()
        if EPOCH_RANGE_S[0] <= known[0] * ns / NS <= EPOCH_RANGE_S[1]
    ]
    if not dated:
        return None
    (unit,) = dated
    if not STEP_RANGE_S[0] <= step * UNITS_NS[unit] / NS <= STEP_RANGE_S[1]:
        others = [
            f"{name} (steps of {step * ns / NS:.3g} s)"
            for name, ns in UNITS_NS.items()
            if name == unit or STEP_RANGE_S[0] <= step * ns / NS <= STEP_RANGE_S[1]
        ]
        expected = f"the unit by --map {column}=time_s, time_ms, time_us or time_ns"
        found = f"no unit, and numbers from {known[0]:.15g} that fit {' or '.join(others)}"
        raise InputError(file, column, found, expected)
    date = np.datetime64(int(known[0] * UNITS_NS[unit] / NS), "s")
    action = (
        f"no unit; interpreted as {unit} since 1970: it begins at {date} UTC in steps of "
        f"{step * UNITS_NS[unit] / NS:.3g} s; no other unit gives a date in this century"
    )
    return unit, Finding("clock", file, column, None, int(known.size), action)
