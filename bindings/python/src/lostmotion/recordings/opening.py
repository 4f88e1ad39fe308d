"""Opening: open a file of any kind as a table."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from lostmotion.recordings.bags import bag_header, is_bag
from lostmotion.recordings.long_form import in_columns, may_be_long
from lostmotion.recordings.parquet import ParquetTable, is_parquet
from lostmotion.recordings.tables import Header, Table
from lostmotion.recordings.texts import TextTable


def open_table(file: Path, wanted: Collection[str] = ()) -> Table:
    """Open a file; `wanted` are names in a map, which identify the header."""
    table = ParquetTable(file) if is_parquet(file) else TextTable.of_file(file, wanted)
    return in_columns(table, wanted)


def header_of(file: Path, wanted: Collection[str] = ()) -> Header:
    """Read the header of a file; of a bag the columns that a map may name."""
    if is_bag(file):
        names = tuple(bag_header(file, wanted))
        return Header(str(file), names, ("",) * len(names), "", lambda _: ())
    if is_parquet(file):
        return in_columns(ParquetTable(file), wanted).header
    header = TextTable.header_of_file(file, wanted)
    return open_table(file, wanted).header if may_be_long(header, wanted) else header
