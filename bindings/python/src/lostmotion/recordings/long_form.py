"""Long form: tables with one value in a row, as databases of time series write them.

The name of the value's channel is in another column. Such a table becomes one with a column per
channel. Rows stay as they are: each has a number in the column of its channel only. Channels of
the same times are then put together, and others joined on request, as in any table.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from lostmotion.arrays import BoolArray, IntArray
from lostmotion.recordings.cells import MISSING, is_missing, is_value
from lostmotion.recordings.clocks import stamped
from lostmotion.recordings.findings import Finding
from lostmotion.recordings.layout import COLUMNS_MAX, known_names
from lostmotion.recordings.tables import CELLS_SHOWN, Header, Rows, Table, first_cells
from lostmotion.units import is_unit

VALUE = re.compile(r"(?i).*value_?")
"""Name of the column of the values if several columns have numbers."""

NUMBER = "^[^A-Za-z_#]*[0-9]"
"""Beginning of a number in a column of text."""


class LongTable:
    """A table in long form, as a table with a column per channel.

    Parameters
    ----------
    table : Table
    place_of_name, place_of_value : int
        Columns of the channels' names and of the values.
    """

    def __init__(self, table: Table, place_of_name: int, place_of_value: int) -> None:
        self.table, self.value = table, place_of_value
        header = table.header
        texts = [i for i in range(len(header.names)) if holds_names(header, i)]
        rows = table.read([*texts, place_of_value], as_text=True)
        read = {place: combined(column) for place, column in rows.columns.items()}
        names, values = read[place_of_name], read[place_of_value]
        channels = different_texts(names.filter(with_numbers(values)))
        units = {c: units_of(channels, names, read[c]) for c in texts if c != place_of_name}
        stated = next((found for found in units.values() if found), dict.fromkeys(channels, ""))
        taken = {place_of_name, place_of_value, *(c for c, found in units.items() if found)}
        self.kept = [i for i in range(len(header.names)) if i not in taken]
        self.code = codes_of(names, channels)
        self.rows = np.flatnonzero(self.code >= 0)
        self.first = first_values(values, self.code, len(channels))
        self.header = Header(
            header.file,
            (*(header.names[i] for i in self.kept), *channels),
            (*(header.units[i] for i in self.kept), *(stated[one] for one in channels)),
            f"names in column {header.names[place_of_name] or place_of_name + 1}",
            self.cells,
        )

    def cells(self, column: int) -> Sequence[str]:
        """First cells of a column; of a channel its own."""
        if column < len(self.kept):
            return self.table.header.cells(self.kept[column])
        return self.first[column - len(self.kept)]

    def read(self, columns: Collection[int], as_text: bool = False) -> Rows:
        """Read columns; a channel is missing in the rows of the others.

        Rows of no channel, as those of a header that is repeated, are left out and counted.
        """
        import pyarrow as pa
        import pyarrow.compute as pc

        channel = {i: i - len(self.kept) for i in columns if i >= len(self.kept)}
        inner = {i: self.kept[i] if i < len(self.kept) else self.value for i in columns}
        rows = self.table.read(sorted(set(inner.values())), as_text)
        found = {i: combined(rows.columns[place]) for i, place in inner.items()}
        findings = rows.findings + self.left_out(rows)
        for i, one in channel.items():
            own, nothing = self.code == one, pa.scalar(None, found[i].type)
            findings += self.without_number(rows, i, own & marked_missing(found[i]))
            found[i] = pc.if_else(own, found[i], nothing)
        found = {i: column.take(pa.array(self.rows)) for i, column in found.items()}
        blocks = tuple(int(np.searchsorted(self.rows, row)) for row in rows.blocks)
        return Rows(
            found, self.rows.size, lambda row: rows.place(int(self.rows[row])), findings, blocks
        )

    def without_number(self, rows: Rows, column: int, where: BoolArray) -> list[Finding]:
        """Report the rows of a channel that have no number, which a join cannot see."""
        at, label = np.flatnonzero(where), self.header.names[column]
        if at.size == 0:
            return []
        more = f", and {at.size - 1} more" if at.size > 1 else ""
        action = f"no number in {rows.place(int(at[0]))}{more}"
        return [Finding("nan", self.header.file, label, None, int(at.size), action)]

    def left_out(self, rows: Rows) -> list[Finding]:
        """Report the rows of no channel."""
        others = np.setdiff1d(np.arange(rows.count), self.rows)
        if others.size == 0:
            return []
        more = f", and {others.size - 1} more" if others.size > 1 else ""
        action = f"no number in {rows.place(int(others[0]))}{more}; left out"
        return [
            Finding("set_aside", self.header.file, "all columns", None, int(others.size), action)
        ]


def in_columns(table: Table, wanted: Collection[str] = ()) -> Table:
    """Return a table in long form with one column per channel, any other table as it is.

    Long form is recognised by its names: those of the header are no quantities of a drive, those in
    a column of text are, or another column is called value.
    """
    found = may_be_long(table.header, wanted)
    if not found:
        return table
    names, value, called = found
    read = table.read(names, as_text=True).columns
    known = {i: known_names(different_texts(read[i]), wanted) for i in names}
    best = max(known, key=lambda i: (known[i], -i))
    return LongTable(table, best, value) if known[best] or called else table


def may_be_long(header: Header, wanted: Collection[str]) -> tuple[list[int], int, bool] | None:
    """Find the columns of a table in long form: those of text, the values, and if it is called so.

    None if a column is a quantity of a drive, or the column of the values is not certain.
    """
    places = [i for i in range(len(header.names)) if not is_clock(header, i)]
    places = [i for i in places if header.names[i].lower() != "run"]
    if known_names([header.names[i] for i in places], wanted):
        return None
    values = [i for i in places if begins_with_numbers(header, i)]
    called = [i for i in values if VALUE.fullmatch(header.names[i])]
    names = [i for i in places if holds_names(header, i)]
    values = called or values
    return (names, values[0], bool(called)) if names and len(values) == 1 else None


def is_clock(header: Header, column: int) -> bool:
    """Whether a column is a clock: by its name, or because its first cells are dates or times."""
    return header.names[column].lstrip("_ ").lower().startswith("time") or stamped(
        header.cells(column)
    )


def begins_with_numbers(header: Header, column: int) -> bool:
    """Whether all first cells of a column are numbers."""
    stated = [cell for cell in header.cells(column) if not is_missing(cell)]
    return bool(stated) and all(is_value(cell) for cell in stated)


def holds_names(header: Header, column: int) -> bool:
    """Whether no first cell of a column is a number, and one is a text."""
    stated = [cell for cell in header.cells(column) if not is_missing(cell)]
    return bool(stated) and not any(is_value(cell) for cell in stated)


def different_texts(column: Any) -> list[str]:
    """Different texts of a column, in the order of their first appearance."""
    import pyarrow.compute as pc

    texts = pc.unique(column).drop_null().to_pylist()
    return [text for _, text in zip(range(COLUMNS_MAX), texts, strict=False) if text.strip()]


def units_of(channels: Sequence[str], names: Any, column: Any) -> dict[str, str]:
    """Units of the channels, if a column states one for each."""
    import pyarrow as pa

    pairs = pa.table({"name": combined(names), "unit": combined(column)})
    each = pairs.group_by("name").aggregate([("unit", "count_distinct"), ("unit", "min")])
    found = dict(zip(each["name"].to_pylist(), each["unit_min"].to_pylist(), strict=True))
    single = all(one <= 1 for one in each["unit_count_distinct"].to_pylist())
    stated = [found.get(channel) or "" for channel in channels]
    if not single or not any(map(is_unit, stated)):
        return {}
    return dict(zip(channels, stated, strict=True))


def with_numbers(values: Any) -> Any:
    """Mask of the rows of a column that begin with a number."""
    import pyarrow as pa
    import pyarrow.compute as pc

    if not pa.types.is_string(values.type):
        return pc.is_valid(values)
    return pc.fill_null(pc.match_substring_regex(values, NUMBER), False)


def marked_missing(values: Any) -> BoolArray:
    """Mask of the cells that mark a missing number."""
    import pyarrow as pa
    import pyarrow.compute as pc

    if pa.types.is_floating(values.type):
        found = pc.is_null(values, nan_is_null=True)
    elif pa.types.is_string(values.type):
        trimmed = pc.utf8_lower(pc.utf8_trim_whitespace(values))
        found = pc.fill_null(pc.is_in(trimmed, value_set=pa.array(MISSING)), True)
    else:
        found = pc.is_null(values)
    return np.asarray(found.to_numpy(zero_copy_only=False), dtype=bool)


def codes_of(names: Any, channels: Sequence[str]) -> IntArray:
    """Number of the channel of every row; -1 for none."""
    import pyarrow as pa
    import pyarrow.compute as pc

    found = pc.fill_null(pc.index_in(names, value_set=pa.array(channels, names.type)), -1)
    return np.asarray(found.to_numpy(zero_copy_only=False), dtype=np.intp)


def first_values(values: Any, code: IntArray, channels: int) -> list[list[str]]:
    """First values of every channel as text."""
    order = np.argsort(code, kind="stable")
    begin = np.searchsorted(code[order], np.arange(channels))
    rows = [order[at : at + CELLS_SHOWN] for at in begin]
    return [
        first_cells(values.take(some[code[some] == channel])) for channel, some in enumerate(rows)
    ]


def combined(column: Any) -> Any:
    """Return an Arrow column as one piece."""
    return column.combine_chunks() if hasattr(column, "combine_chunks") else column
