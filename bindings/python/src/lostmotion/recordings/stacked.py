"""Stacked: files that each have other channels of one recording, as one table.

The rows of one file follow those of the other; columns of the same name are one column. What puts
channels in rows of their own together does the rest.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import accumulate
from pathlib import Path
from typing import Any

from lostmotion.recordings.findings import Finding
from lostmotion.recordings.tables import Header, Rows, Table


class StackedTable:
    """Tables with different columns, one below the other.

    Parameters
    ----------
    tables : sequence of Table
        Units of a column that several of them have must be the same.
    """

    def __init__(self, tables: Sequence[Table]) -> None:
        self.tables = tables
        headers = [table.header for table in tables]
        named = dict.fromkeys(name for header in headers for name in header.names if name)
        self.places = [
            [header.names.index(name) if name in header.names else None for header in headers]
            for name in named
        ]
        units = tuple(
            next(h.units[at] for h, at in zip(headers, places, strict=True) if at is not None)
            for places in self.places
        )
        self.header = Header(headers[0].file, tuple(named), units, "", self.cells)

    def cells(self, column: int) -> Sequence[str]:
        """First cells of a column, in the first table that has it."""
        found = zip(self.tables, self.places[column], strict=True)
        return next(table.header.cells(at) for table, at in found if at is not None)

    def read(self, columns: Collection[int], as_text: bool = False) -> Rows:
        """Read columns; missing in the rows of a table without them."""
        parts = []
        for number, table in enumerate(self.tables):
            own = [self.places[i][number] for i in columns]
            parts.append(table.read({at for at in own if at is not None}, as_text))
        found = {}
        for i in columns:
            places = zip(parts, self.places[i], strict=True)
            pieces = [None if at is None else rows.columns[at] for rows, at in places]
            found[i] = one_below_the_other(pieces, [rows.count for rows in parts])
        ends = list(accumulate(rows.count for rows in parts))

        def place(row: int) -> str:
            number = next(n for n, end in enumerate(ends) if row < end)
            rows = parts[number]
            name = Path(self.tables[number].header.file).name
            return f"{rows.place(row - ends[number] + rows.count)} of {name}"

        others = ", ".join(Path(table.header.file).name for table in self.tables[1:])
        action = f"one recording with {others}, which have its other channels"
        whole = Finding("joined", self.header.file, "all columns", None, ends[-1], action)
        findings = [whole, *(one for rows in parts for one in rows.findings)]
        return Rows(found, ends[-1], place, findings)


def have_the_same_units(tables: Sequence[Table]) -> bool:
    """Whether the columns that several tables have are in the same units."""
    units: dict[str, str] = {}
    headers = [table.header for table in tables]
    named = [pair for h in headers for pair in zip(h.names, h.units, strict=True)]
    return all(units.setdefault(name, unit) == unit for name, unit in named)


def one_below_the_other(pieces: Sequence[Any], counts: Sequence[int]) -> Any:
    """Put Arrow columns one below the other; None is a missing one."""
    import pyarrow as pa

    kinds = {str(piece.type): piece.type for piece in pieces if piece is not None}
    kind = next(iter(kinds.values())) if len(kinds) == 1 else pa.string()
    whole: list[Any] = []
    for piece, count in zip(pieces, counts, strict=True):
        column = pa.nulls(count, kind) if piece is None else piece.cast(kind)
        whole += column.chunks if isinstance(column, pa.ChunkedArray) else [column]
    return pa.concat_arrays(whole)
