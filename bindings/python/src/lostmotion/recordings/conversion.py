"""Conversion: the chosen columns of a table become numbers in SI, and the run of every row."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from lostmotion import units
from lostmotion.arrays import BoolArray, FloatArray, IntArray, WholeArray
from lostmotion.errors import InputError, shorten
from lostmotion.recordings import clocks
from lostmotion.recordings.columns import ColumnName, normal, second_clock, split_label
from lostmotion.recordings.findings import Finding
from lostmotion.recordings.from_arrow import floats_of, integers_of, mask_of
from lostmotion.recordings.numerals import (
    TEXT_SHARE,
    NumberStyle,
    Texts,
    note_text,
    number_styles,
    refuse_text,
)
from lostmotion.recordings.protocol import FREE, Protocol
from lostmotion.recordings.quantities import Quantity
from lostmotion.recordings.tables import Rows, Table

Chosen = Mapping[str, tuple[str, ColumnName]]

HEADERS_LOOKED_AT = 64
"""Largest number of lines without numbers that are compared with the header."""

STAMPS_LOOKED_AT = 100
"""Number of cells from which a clock of text is classified as dates or numbers."""


@dataclass
class Numbers:
    """Values of a table, in SI units.

    Attributes
    ----------
    quantities : dict
        Columns by quantity.
    run : array of Arrow or None
        Content of the run column.
    place : callable
        Location of a row in its file.
    findings : list of Finding
    blocks : tuple of int
        Rows that follow a blank line.
    """

    quantities: dict[str, FloatArray]
    run: Any
    place: Callable[[int], str]
    findings: list[Finding]
    blocks: tuple[int, ...] = ()


def read_numbers(
    table: Table, chosen: Chosen, protocol: Protocol = FREE, ratio: float | None = None
) -> Numbers:
    """Read the chosen columns of a table."""
    used = sorted(indices_of(chosen))
    rows = table.read(used)
    refuse_different(table.header.file, rows, chosen)
    if needs_text(rows, chosen):
        rows = table.read(used, as_text=True)
    return in_si(table.header.file, rows, chosen, protocol, ratio)


def indices_of(chosen: Chosen) -> set[int]:
    """Numbers of the columns that are read."""
    found = {place for _, name in chosen.values() for place in (name.index, *name.again)}
    return found | {name.fraction[0] for _, name in chosen.values() if name.fraction}


def refuse_different(file: str, rows: Rows, chosen: Chosen) -> None:
    """Refuse clocks of one name that are not the same."""
    for label, name in chosen.values():
        first = rows.columns[name.index]
        if not all(rows.columns[place].equals(first) for place in name.again):
            raise second_clock(file, label)


def is_text(column: Any) -> bool:
    """Whether a column of Arrow contains text."""
    kind = str(column.type)
    return kind.startswith(("string", "large_string", "dictionary<values=string"))


def writes_numbers(column: Any) -> bool:
    """Whether a clock column contains numbers as text, not dates or times of day."""
    if not is_text(column):
        return False
    known = clocks.as_texts(column).drop_null().slice(0, STAMPS_LOOKED_AT).to_pylist()
    return not clocks.stamped([str(cell) for cell in known])


def holds_numbers(column: Any) -> bool:
    """Whether a column of Arrow contains numbers."""
    return str(column.type).startswith(("int", "uint", "float", "double", "halffloat", "decimal"))


def needs_text(rows: Rows, chosen: Chosen) -> bool:
    """Whether the text of numbers must be examined because a mark may be ambiguous.

    If a column could not be read as numbers, the others may use the same marks. If all could,
    points may still separate thousands if all numbers have groups of three digits and none is below
    one (which would begin with 0 and a point).
    """
    for quantity, (_, name) in chosen.items():
        if quantity == "run":
            continue
        column = rows.columns[name.index]
        if is_text(column) and quantity != "time":
            return True
        if not str(column.type).startswith(("float", "double")):
            continue
        values = np.abs(floats_of(column))
        if grouped_by_points(values):
            return True
        if quantity == "time" and np.any(values[:1] > clocks.EPOCH_S):
            return True
    return False


def grouped_by_points(size: FloatArray) -> bool:
    """Whether unsigned numbers may be thousands separated by points."""
    size = size[np.isfinite(size) & (size > 0)]
    if size.size == 0 or size.min() < 1 or size.max() >= 1000 or size.max() < 100:
        return False
    whole = size == np.round(size)
    thousandths = np.abs(size * 1000 - np.round(size * 1000)) < 1e-6
    return bool(np.any(whole & (size >= 100)) and not np.all(whole) and np.all(thousandths))


def in_si(
    file: str,
    rows: Rows,
    chosen: Chosen,
    protocol: Protocol = FREE,
    ratio: float | None = None,
    zero: int | None = None,
) -> Numbers:
    """Return the quantities of rows, except the run, in the stored units.

    Quantities that follow from the protocol, which needs the ratio, are added. `zero` is the stamp
    from which a clock with an epoch counts; by default its first one.
    """
    findings = list(rows.findings)
    texts = {
        label: Texts(rows.columns[name.index], name.behind)
        for quantity, (label, name) in chosen.items()
        if quantity not in ("run", "time") and not holds_numbers(rows.columns[name.index])
    }
    if "time" in chosen:
        label, name = chosen["time"]
        if writes_numbers(rows.columns[name.index]):
            texts[label] = Texts(rows.columns[name.index], name.behind)
    readings = number_styles(file, texts, rows.place)
    found: dict[str, FloatArray] = {}
    bad: dict[str, BoolArray] = {}
    for quantity, (label, name) in chosen.items():
        if quantity in ("run", "time"):
            continue
        if label not in texts:
            found[quantity] = floats_of(rows.columns[name.index])
            continue
        reading = readings[label]
        found[quantity] = texts[label].numbers(reading.mark, reading.grouped)
        bad[quantity] = np.isnan(found[quantity]) & ~texts[label].missing
        if reading.told:
            count = int(np.count_nonzero(np.isfinite(found[quantity])))
            findings.append(Finding("thousands", file, label, None, count, reading.told))
    if "time" in chosen:
        label, name = chosen["time"]
        clock = Clock(file, label, name, rows, zero, texts.get(label), readings.get(label))
        found["time"] = clock.seconds
        bad["time"] = clock.bad
        findings += clock.findings
    keep = set_aside_text(file, rows, found, bad, chosen, texts, findings)
    place = rows.place
    if keep is not None:
        at = np.flatnonzero(keep)
        found = {quantity: values[at] for quantity, values in found.items()}
        place = lambda row: rows.place(int(at[row]))  # noqa: E731
    for quantity, values in found.items():
        label, name = chosen[quantity]
        with np.errstate(over="ignore"):
            if quantity != "time":
                values = name.factor * values
                if name.unit is not None:
                    values = units.convert(values, name.unit.symbol, name.quantity.unit)
        # A value beyond the range of 64 bits is missing, like one that is written as infinite.
        values = np.where(np.isinf(values), np.nan, values)
        values, beyond = within_range(file, label, values, name.quantity, place)
        findings += beyond
        found[quantity] = np.ascontiguousarray(values)
    run = rows.columns[chosen["run"][1].index] if "run" in chosen else None
    if run is not None and keep is not None:
        import pyarrow

        run = run.filter(pyarrow.array(keep))
    blocks = rows.blocks if keep is None else ()
    return Numbers(protocol.complete(file, found, ratio), run, place, findings, blocks)


def set_aside_text(
    file: str,
    rows: Rows,
    found: Mapping[str, FloatArray],
    bad: Mapping[str, BoolArray],
    chosen: Chosen,
    texts: Mapping[str, Texts],
    findings: list[Finding],
) -> BoolArray | None:
    """Report text instead of numbers; return the rows to keep, None if all.

    A row without numbers, and with text or without a label, is not data: a repeated header, a
    message, or separators only. If a row also has numbers, its text is a missing number.

    Raises
    ------
    InputError
        If a column has more text than damage explains.
    """
    numberless = ~np.any([np.isfinite(values) for values in found.values()], axis=0)
    if not np.any(numberless) and not any(np.any(mask) for mask in bad.values()):
        return None
    rowless = numberless & (np.any(list(bad.values()), axis=0) | without_label(rows, chosen))
    left = rows.count - int(np.count_nonzero(rowless))
    for quantity, mask in bad.items():
        label = chosen[quantity][0]
        shown = texts.get(label) or Texts(rows.columns[chosen[quantity][1].index])
        if left == 0:
            refuse_text(file, label, shown, mask, rows.count, rows.place)
        mask = mask & ~rowless
        refuse_text(file, label, shown, mask, left, rows.place)
        if np.any(mask):
            findings.append(note_text(file, label, shown, mask, rows.place))
    if not np.any(rowless):
        return None
    at = np.flatnonzero(rowless)
    refuse_other_header(file, at[:HEADERS_LOOKED_AT], chosen, rows, texts)
    more = f", and {at.size - 1} more" if at.size > 1 else ""
    action = f"no numbers in {rows.place(int(at[0]))}{more}"
    findings.append(
        Finding("set_aside", file, "all columns", None, int(at.size), f"{action}; left out")
    )
    return np.asarray(~rowless)


def refuse_other_header(
    file: str,
    at: IntArray,
    chosen: Chosen,
    rows: Rows,
    texts: Mapping[str, Texts],
) -> None:
    """Refuse a repeated header with other names, because the rows below it have another meaning."""
    shown = {
        label: texts.get(label) or Texts(rows.columns[name.index])
        for label, name in chosen.values()
    }
    for row in map(int, at):
        cells = {label: str(text.text[row].as_py() or "") for label, text in shown.items()}
        header = any(normal(cell) == normal(label) != "" for label, cell in cells.items())
        if not header and sum(split_label(cell) is not None for cell in cells.values()) < 2:
            continue
        for label, cell in cells.items():
            if normal(cell) != normal(label):
                found = f"another header in {rows.place(row)}, with '{shorten(cell)}' in its place"
                raise InputError(
                    file, label, found, "columns with one meaning each; split the file"
                )


def without_label(rows: Rows, chosen: Chosen) -> BoolArray:
    """Mark the rows without a run label."""
    import pyarrow as pa
    import pyarrow.compute as pc

    if "run" not in chosen:
        return np.zeros(rows.count, dtype=np.bool_)
    column = rows.columns[chosen["run"][1].index]
    lost = column.is_null()
    if is_text(column):
        lost = pc.or_(lost, pc.fill_null(pc.equal(column.cast(pa.string()), ""), False))
    return mask_of(lost)


class Clock:
    """The clock of a table, in seconds.

    Attributes
    ----------
    seconds : ndarray
        Unchanged, or from the first stamp if they count from an epoch.
    bad : ndarray of bool
        Text that is not a stamp.
    findings : list of Finding
    """

    def __init__(
        self,
        file: str,
        label: str,
        name: ColumnName,
        rows: Rows,
        zero: int | None,
        texts: Texts | None,
        reading: NumberStyle | None,
    ) -> None:
        self.file, self.label, self.name, self.rows, self.zero = file, label, name, rows, zero
        self.findings: list[Finding] = []
        column = rows.columns[name.index]
        self.bad = np.zeros(rows.count, dtype=np.bool_)
        kind = str(column.type)
        if name.fraction is not None and name.unit is not None:
            self.seconds = self.of_two(column, rows.columns[name.fraction[0]], name.fraction[1])
        elif kind.startswith("duration"):
            self.seconds = self.of_integers(column.cast("int64"), kind[9:-1])
        elif kind.startswith("timestamp"):
            unit = kind.removeprefix("timestamp[").split(",")[0].rstrip("]")
            self.seconds = self.of_stamps(column.cast("int64"), unit)
        elif holds_numbers(column):
            self.seconds = self.of_numbers(column)
        elif texts is not None and reading is not None:
            self.seconds = self.of_text(texts, reading)
        else:
            self.seconds = self.of_dates(column)

    def of_stamps(self, column: Any, unit: str) -> FloatArray:
        """Read stamps that are integers since 1970."""
        values, known = integers(column)
        return self.from_zero(values, known, clocks.UNITS_NS[unit])

    def from_zero(self, values: WholeArray, known: BoolArray, unit_ns: int) -> FloatArray:
        """Count from the first stamp, or from the given zero."""
        out = np.full(values.size, np.nan)
        if known.any():
            zero = values[int(np.flatnonzero(known)[0])] if self.zero is None else self.zero
            since = (values[known] - zero).astype(np.float64)
            out[known] = self.name.factor * since / (clocks.NS // unit_ns)
        return out

    def of_integers(self, column: Any, unit: str) -> FloatArray:
        """Read a clock of integers exactly: from its first stamp if they count from an epoch."""
        values, known = integers(column)
        first = values[known][:1].astype(np.float64) * clocks.UNITS_NS[unit] / clocks.NS
        if self.zero is not None or (first.size and abs(first[0]) > clocks.EPOCH_S):
            return self.from_zero(values, known, clocks.UNITS_NS[unit])
        out = np.full(values.size, np.nan)
        out[known] = self.name.factor * values[known] / (clocks.NS / clocks.UNITS_NS[unit])
        return out

    def of_numbers(self, column: Any) -> FloatArray:
        """Read a clock of numbers in the stated unit, or that of an epoch."""
        unit = self.name.unit.symbol if self.name.unit is not None else None
        if unit is None:
            numbers = floats_of(column)
            told = clocks.epoch_unit(self.file, self.label, numbers)
            if told is None:
                time = units.dimension_name(units.TIME)
                expected = f"{time} as a suffix, or --map {self.label}=time_s"
                raise InputError(self.file, self.label, "no unit", expected)
            unit, finding = told
            self.findings.append(finding)
        kind = str(column.type)
        if kind.startswith(("int", "uint")) and unit in clocks.UNITS_NS:
            return self.of_integers(column, unit)
        numbers = floats_of(column)
        values = self.name.factor * numbers
        seconds = units.convert(values, unit, "s")
        known = np.flatnonzero(np.isfinite(seconds))
        if known.size and abs(seconds[known[0]]) > clocks.EPOCH_S:
            zero = numbers[known[0]] if self.zero is None else float(self.zero)
            seconds = units.convert(self.name.factor * (numbers - zero), unit, "s")
        return np.asarray(seconds, dtype=np.float64)

    def of_dates(self, column: Any) -> FloatArray:
        """Read a clock of dates or times of day."""
        stamps = clocks.as_texts(column)
        values, known, findings = clocks.read_stamps(self.file, self.label, stamps, self.rows.place)
        if self.name.fraction is not None:
            place, unit = self.name.fraction
            rest, both = self.in_billionths(self.rows.columns[place], clocks.UNITS_NS[unit])
            self.refuse_outside(rest, known & both, unit)
            values, known = values + rest, known & both
        told = mask_of(stamps.is_valid())
        self.bad = told & ~known
        self.findings += findings
        return self.from_zero(values, known, 1)

    def of_text(self, texts: Texts, reading: NumberStyle) -> FloatArray:
        """Read a clock of numbers among text; integers exactly."""
        import pyarrow as pa

        numbers = texts.numbers(reading.mark, reading.grouped)
        self.bad = np.isnan(numbers) & ~texts.missing
        stated = self.name.unit is None or self.name.unit.symbol == "s"
        if stated and not reading.grouped and np.any(numbers[:1] > clocks.EPOCH_S):
            exact = texts.billionths()
            if exact is not None:
                self.of_numbers(
                    pa.array(numbers, from_pandas=True)
                )  # refuses a clock that is not an epoch in s
                return self.from_zero(*exact, 1)
        whole = texts.whole_numbers()
        if whole is not None and bool(np.all(texts.integer | self.bad | texts.missing)):
            return self.of_numbers(whole)
        if np.isnan(numbers).all() and self.name.unit is None:
            return numbers
        return self.of_numbers(pa.array(numbers, from_pandas=True))

    def of_two(self, whole: Any, part: Any, unit: str) -> FloatArray:
        """Read a clock in two columns: whole seconds, and fractions in a smaller unit."""
        seconds, known = self.exact(whole)
        ns = clocks.UNITS_NS[unit]
        rest_ns, both = self.in_billionths(part, ns)
        known = known & both
        self.refuse_outside(rest_ns, known, unit)
        first = int(seconds[known][0]) if known.any() else 0
        zero = first if abs(first) > clocks.EPOCH_S else 0
        since = (seconds - zero) * clocks.NS + rest_ns
        if zero:
            return self.from_zero(since, known, 1)
        return np.where(known, since / clocks.NS, np.nan)

    def refuse_outside(self, rest_ns: WholeArray, known: BoolArray, unit: str) -> None:
        """Refuse parts of a second that are a second or more."""
        outside = known & ((rest_ns < 0) | (rest_ns >= clocks.NS))
        if outside.any():
            row, ns = int(np.flatnonzero(outside)[0]), clocks.UNITS_NS[unit]
            found = f"{rest_ns[row] / ns:g} {unit} beside whole seconds in {self.rows.place(row)}"
            raise InputError(self.file, self.label, found, f"0 to {clocks.NS // ns - 1} {unit}")

    def in_billionths(self, column: Any, ns: int) -> tuple[WholeArray, BoolArray]:
        """Read parts of a second in ns, integers exactly, others rounded."""
        numbers = floats_of(column) if holds_numbers(column) else Texts(column).numbers(".", False)
        known = np.isfinite(numbers)
        if np.all(numbers[known] == np.round(numbers[known])):
            whole, known = self.exact(column)
            return whole * ns, known
        return np.where(known, np.round(numbers * ns), 0.0).astype(np.int64), known

    def exact(self, column: Any) -> tuple[WholeArray, BoolArray]:
        """Read a column of integers exactly."""
        if is_text(column):
            texts = Texts(column)
            self.bad |= ~texts.integer & ~texts.missing
            whole = texts.whole_numbers()
            column = texts.text.cast("float64") if whole is None else whole
        if not str(column.type).startswith(("int", "uint")):
            numbers = floats_of(column)
            known = self.within_clock(numbers, np.isfinite(numbers))
            rounded = np.where(known, np.round(numbers), 0)
            off = np.flatnonzero(known & (rounded != numbers))
            if off.size:
                row = int(off[0])
                found = f"{numbers[row]} in {self.rows.place(row)} in a clock of two columns"
                raise InputError(self.file, self.label, found, "whole numbers")
            return rounded.astype(np.int64), known
        whole, known = integers(column)
        return whole, self.within_clock(whole, known)

    def within_clock(self, numbers: FloatArray | WholeArray, known: BoolArray) -> BoolArray:
        """Which of the known numbers a clock in ns can hold as seconds; the others are bad."""
        held = known & (numbers >= -clocks.LONGEST_S) & (numbers <= clocks.LONGEST_S)
        self.bad |= known & ~held
        return held


def integers(column: Any) -> tuple[WholeArray, BoolArray]:
    """Return a column of integers, 0 if missing, and a mask of the existing ones."""
    return integers_of(column), mask_of(column.is_valid())


def within_range(
    file: str,
    column: str,
    values: FloatArray,
    quantity: Quantity,
    place: Callable[[int], str],
) -> tuple[FloatArray, list[Finding]]:
    """Remove numbers out of the range of the quantity; refuse a column with more than a few.

    Values that are not finite are counted elsewhere.
    """
    beyond = np.isfinite(values) & ~((values >= quantity.low) & (values <= quantity.high))
    count = int(np.count_nonzero(beyond))
    if count == 0:
        return values, []
    row = int(np.flatnonzero(beyond)[0])
    unit = f" {quantity.unit}" if quantity.unit else ""
    found = f"{values[row]:.6g}{unit} in {place(row)}"
    allowed = f"{quantity.low:g} to {quantity.high:g}{unit}"
    if count > TEXT_SHARE * values.size:
        raise InputError(file, column, found, allowed)
    more = f", and {count - 1} more" if count > 1 else ""
    action = f"{found}{more}: outside {allowed}; counted as missing"
    return np.where(beyond, np.nan, values), [Finding("range", file, column, None, count, action)]
