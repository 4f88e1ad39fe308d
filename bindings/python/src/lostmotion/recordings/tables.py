"""Files as tables: CSV, gzip and Parquet, read as they stand, with or without pyarrow."""

from __future__ import annotations

import csv
import gzip
import re
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.errors import InputError, one_line
from lostmotion.files import read_bytes

FloatArray = npt.NDArray[np.float64]

DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
"""A number as it is written where a comma stands before the fraction."""


def header_of(file: Path) -> list[str]:
    """Read the names of a file's columns."""
    if file.name.lower().endswith(".parquet"):
        return list(open_parquet(file).schema_arrow.names)
    return _open_csv(file)[0]


def expected_number(text: str) -> str:
    """Say what stands in the place of a text that is no number."""
    if text.count(",") == 1 and "." not in text:
        return "a number with a decimal point"
    return "a number, or nothing, NA or nan where there is none"


def numbers_of(file: str, column: str, values: npt.NDArray[Any]) -> FloatArray:
    """Read a column as numbers; what is empty is not a number."""
    if values.dtype.kind in "fiub":
        return values.astype(np.float64)
    out = np.empty(values.size)
    for i, text in enumerate(values):
        try:
            out[i] = float(text) if str(text).strip() else np.nan
        except ValueError:
            if str(text).strip().lower() in ("na", "n/a", "null", "none"):
                out[i] = np.nan
                continue
            found = f"'{text}' in row {i + 1}"
            raise InputError(file, column, found, expected_number(str(text))) from None
    return out


def read_table(file: Path) -> dict[str, npt.NDArray[Any]]:
    """Read a file's columns as they stand."""
    if file.name.lower().endswith(".parquet"):
        return _read_parquet(file)
    return _read_csv(file)


def _read_parquet(file: Path) -> dict[str, npt.NDArray[Any]]:
    with arrow_errors(file):
        return from_arrow(open_parquet(file).read())


@contextmanager
def arrow_errors(file: str | Path) -> Iterator[None]:
    """Say in one line that a Parquet file cannot be opened, or read further on.

    Raises
    ------
    InputError
        For what Arrow raises inside, and where there is no Arrow.
    """
    try:
        import pyarrow
    except ImportError:
        raise InputError(
            file, "", "a Parquet file, but no pyarrow to read it", "pip install pyarrow, or CSV"
        ) from None
    try:
        yield
    except (pyarrow.ArrowException, OSError) as error:
        found = f"unreadable Parquet ({one_line(str(error))})"
        raise InputError(file, "", found, "a Parquet file") from None


def open_parquet(file: Path) -> Any:
    """Open a Parquet file without reading it; read it inside `arrow_errors` too."""
    with arrow_errors(file):
        import pyarrow.parquet

        opened = pyarrow.parquet.ParquetFile(file)
    refuse_twins(file, opened.schema_arrow.names)
    return opened


def refuse_twins(file: Path, header: Sequence[str]) -> None:
    """Refuse a header that names a column twice."""
    for name in header:
        if list(header).count(name) > 1:
            raise InputError(file, name, "the column twice", "each column once")


def from_arrow(table: Any) -> dict[str, npt.NDArray[Any]]:
    """Take the columns out of an Arrow table."""
    columns: dict[str, npt.NDArray[Any]] = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        kind = str(column.type)
        if kind.startswith(("int", "uint")) and column.null_count == 0:
            columns[name] = column.to_numpy(zero_copy_only=False)
        elif kind.startswith(("int", "uint", "float", "double", "halffloat")):
            columns[name] = column.cast("float64").to_numpy(zero_copy_only=False)
        elif kind == "null":
            columns[name] = np.full(len(column), np.nan)
        else:
            columns[name] = np.array(arrow_texts(column), dtype=np.str_)
    return columns


def native_bytes(text: bytes) -> Any:
    """Put text into memory of Arrow's own, for its readers.

    Their threads let go of it when they like, also while Python ends; of an object of Python they
    could not, and would abort a command that has already answered.
    """
    import pyarrow

    memory = pyarrow.allocate_buffer(len(text))
    np.frombuffer(memory, dtype=np.uint8)[:] = np.frombuffer(text, dtype=np.uint8)
    return pyarrow.BufferReader(memory)


def arrow_texts(column: Any) -> list[str]:
    """Read a column that holds no numbers as texts: Python's own times end at microseconds."""
    kind = str(column.type)
    if kind.startswith("duration"):
        unit = kind.removeprefix("duration[").removesuffix("]")
        return [
            "" if value is None else f"{value} {unit}" for value in column.cast("int64").to_pylist()
        ]
    if kind.startswith("timestamp"):
        column = column.cast("string")
    return ["" if value is None else str(value) for value in column.to_pylist()]


def _open_csv(file: Path) -> tuple[list[str], list[str], str]:
    """Read a CSV file as its header, its other lines, and what separates columns."""
    raw = read_bytes(file, "a CSV file")
    try:
        if file.name.lower().endswith(".gz"):
            raw = gzip.decompress(raw)
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(file, "", "bytes that are not UTF-8", "a CSV file") from None
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(file, "", f"unreadable gzip ({error})", "a whole .csv.gz file") from None
    skip = 0
    lines = text.splitlines()
    while skip < len(lines) and (not lines[skip].strip() or lines[skip].startswith("#")):
        skip += 1
    if skip == len(lines):
        raise InputError(file, "", "an empty file", "a header line and samples")
    header_line = lines[skip]
    delimiter = next((d for d in ",;\t" if d in header_line), ",")
    header = [name.strip() for name in _fields(file, [header_line], delimiter)[0]]
    refuse_twins(file, header)
    return header, lines[skip + 1 :], delimiter


def _read_csv(file: Path) -> dict[str, npt.NDArray[Any]]:
    header, lines, delimiter = _open_csv(file)
    try:
        import pyarrow
        import pyarrow.csv
    except ImportError:
        return _with_points(_parse_csv(file, header, lines, delimiter), delimiter)
    try:
        table = pyarrow.csv.read_csv(
            native_bytes("\n".join(lines).encode()),
            read_options=pyarrow.csv.ReadOptions(column_names=header),
            parse_options=pyarrow.csv.ParseOptions(delimiter=delimiter),
            convert_options=pyarrow.csv.ConvertOptions(
                null_values=["", "NA", "N/A", "n/a", "null", "NULL", "None"],
                strings_can_be_null=False,
            ),
        )
    except pyarrow.ArrowException:
        # The plain reader finds the row at fault, or copes.
        return _with_points(_parse_csv(file, header, lines, delimiter), delimiter)
    return _with_points(from_arrow(table), delimiter)


def _with_points(
    columns: dict[str, npt.NDArray[Any]], delimiter: str
) -> dict[str, npt.NDArray[Any]]:
    """Put points for decimal commas, where commas do not separate the columns.

    A column that has points as well is left as it is: one of the two separates thousands.
    """
    if delimiter == ",":
        return columns
    for name, values in columns.items():
        if values.dtype.kind != "U" or np.any(np.char.find(values, ".") >= 0):
            continue
        if any(DECIMAL_COMMA.fullmatch(text.strip()) for text in values):
            columns[name] = np.char.replace(values, ",", ".")
    return columns


def _fields(file: Path, lines: list[str], delimiter: str) -> list[list[str]]:
    try:
        return list(csv.reader(lines, delimiter=delimiter))
    except csv.Error as error:
        raise InputError(file, "", str(error), "lines of numbers") from None


def _parse_csv(
    file: Path, header: list[str], lines: list[str], delimiter: str
) -> dict[str, npt.NDArray[Any]]:
    """Read CSV without pyarrow."""
    rows = [row for row in _fields(file, lines, delimiter) if row]
    for number, row in enumerate(rows, start=1):
        if len(row) != len(header):
            raise InputError(
                file, "", f"{len(row)} fields in row {number}", f"{len(header)}, as in the header"
            )
    columns: dict[str, npt.NDArray[Any]] = {}
    for name, texts in zip(header, zip(*rows, strict=True), strict=False) if rows else ():
        array = np.array(texts, dtype=np.str_)
        try:
            columns[name] = array.astype(np.int64)
        except ValueError:
            try:
                columns[name] = array.astype(np.float64)
            except ValueError:
                columns[name] = array
    return columns or {name: np.empty(0) for name in header}
