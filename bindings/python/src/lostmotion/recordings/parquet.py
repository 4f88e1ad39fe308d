"""Parquet files as tables."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from lostmotion.errors import InputError, one_line
from lostmotion.recordings.tables import (
    CELLS_SHOWN,
    Header,
    Rows,
    first_cells,
    single_values,
)

VALUE_BYTES = 8
"""Bytes of a number in memory."""

INFLATED_LEAST = 1 << 27
"""Content in bytes, 128 MiB, up to which no Parquet file is refused."""

INFLATION_MAX = 32
"""Largest ratio of content to size beyond that: constant columns take no space, others at least one
byte for a number of eight.
"""


def is_parquet(file: Path) -> bool:
    """Whether a file is Parquet by its name."""
    return file.name.lower().endswith(".parquet")


@contextmanager
def arrow_errors(file: str | Path) -> Iterator[None]:
    """Convert errors of opening or reading a Parquet file to one line.

    Raises
    ------
    InputError
        For errors of Arrow.
    """
    import pyarrow

    try:
        yield
    except (pyarrow.ArrowException, OSError, MemoryError) as error:
        found = f"unreadable Parquet ({one_line(str(error))})"
        raise InputError(file, "", found, "a Parquet file") from None


def open_parquet(file: Path) -> Any:
    """Open a Parquet file without reading it; read it inside `arrow_errors` too.

    Raises
    ------
    InputError
        If its content is implausibly large for its size.
    """
    with arrow_errors(file):
        import pyarrow.parquet

        opened = pyarrow.parquet.ParquetFile(file)
        numbers = opened.metadata.num_rows * len(opened.schema_arrow.names) * VALUE_BYTES
        size = file.stat().st_size
    if numbers > max(INFLATED_LEAST, INFLATION_MAX * size):
        raise InputError(
            file,
            "",
            f"{opened.metadata.num_rows} rows of {len(opened.schema_arrow.names)} columns in "
            f"{size} bytes, which would fill {numbers >> 20} MiB of memory",
            f"at most {INFLATED_LEAST >> 20} MiB, or {INFLATION_MAX} times the file; write only "
            "measured columns",
        )
    return opened


class ParquetTable:
    """A Parquet file."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.opened = open_parquet(file)
        names = tuple(map(str, self.opened.schema_arrow.names))
        self.header = Header(str(file), names, ("",) * len(names), "", self.cells)

    def cells(self, column: int) -> list[str]:
        """First cells of a column."""
        with arrow_errors(self.file):
            for batch in self.raw_batches(0, [column], CELLS_SHOWN):
                return first_cells(batch.columns[column])
        return []

    def read(self, columns: Collection[int], as_text: bool = False) -> Rows:
        """Read columns."""
        found: dict[int, Any] = {}
        with arrow_errors(self.file):
            if len(set(self.header.names)) == len(self.header.names):
                named = self.opened.read(columns=[self.header.names[i] for i in columns])
                found = {i: named.column(self.header.names[i]) for i in columns}
            else:
                whole = self.opened.read()
                found = {i: whole.column(i) for i in columns}
        return Rows(self.single(found), self.opened.metadata.num_rows)

    def single(self, columns: dict[int, Any]) -> dict[int, Any]:
        """Return columns with one value per row; refuse others."""
        named = {i: self.header.names[i] for i in columns}
        return {i: single_values(str(self.file), named[i], c) for i, c in columns.items()}

    def batches(self, group: int | None, columns: Collection[int], size: int) -> Iterator[Rows]:
        """Read a row group in batches; damage inside is detected only here."""
        for rows in self.raw_batches(group, columns, size):
            yield Rows(self.single(rows.columns), rows.count)

    def raw_batches(self, group: int | None, columns: Collection[int], size: int) -> Iterator[Rows]:
        """Read columns of any type in batches."""
        names = [self.header.names[i] for i in columns]
        groups = None if group is None else [group]
        if group is not None and self.opened.num_row_groups == 0:
            return
        with arrow_errors(self.file):
            for batch in self.opened.iter_batches(size, row_groups=groups, columns=names):
                found = {
                    i: batch.column(batch.schema.get_field_index(self.header.names[i]))
                    for i in columns
                }
                yield Rows(found, batch.num_rows)
