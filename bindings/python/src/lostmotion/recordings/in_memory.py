"""Data in memory as tables: data frames, Arrow, dictionaries and structured arrays."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from lostmotion.errors import InputError
from lostmotion.recordings.tables import Header, Rows, first_cells, single_values

TABLE_EXPECTED = (
    "columns: a data frame of pandas or polars, an Arrow table, a dictionary of arrays, or a "
    "structured array"
)


class MemoryTable:
    """Columns in memory.

    Parameters
    ----------
    name : str
        Name of the data in messages.
    data : object with columns
    """

    def __init__(self, name: str, data: Any) -> None:
        named = named_columns(name, data)
        self.columns = [arrow_of(name, label, values) for label, values in named]
        names = tuple(label for label, _ in named)
        self.count = rows_in(name, names, self.columns)
        self.header = Header(name, names, ("",) * len(names), "", self.cells)

    def cells(self, column: int) -> list[str]:
        """First cells of a column."""
        return first_cells(self.columns[column])

    def read(self, columns: Collection[int], as_text: bool = False) -> Rows:
        """Read columns; `as_text` is for text files."""
        return Rows({i: self.columns[i] for i in columns}, self.count)


def has_columns(data: Any) -> bool:
    """Whether data are a table for `named_columns`."""
    structured = getattr(getattr(data, "dtype", None), "names", None)
    tables = ("columns", "__arrow_c_stream__")
    return isinstance(data, Mapping) or bool(structured) or any(hasattr(data, t) for t in tables)


def named_columns(name: str, data: Any) -> list[tuple[str, Any]]:
    """Return the columns of data, with their names.

    Raises
    ------
    InputError
        If they have none.
    """
    if isinstance(data, Mapping):
        return [(str(label), values) for label, values in data.items()]
    fields = getattr(getattr(data, "dtype", None), "names", None)
    if fields:
        return [(field, data[field]) for field in fields]
    if hasattr(data, "columns") and hasattr(data, "iloc"):  # pandas: names may repeat
        return [(str(label), data.iloc[:, i]) for i, label in enumerate(data.columns)]
    if hasattr(data, "schema") and hasattr(data, "columns") and hasattr(data, "column"):  # Arrow
        return list(zip(map(str, data.schema.names), data.columns, strict=True))
    if hasattr(data, "__arrow_c_stream__"):  # polars, DuckDB and others
        import pyarrow

        table = pyarrow.table(data)
        return list(zip(table.column_names, table.columns, strict=True))
    if hasattr(data, "to_dict") and hasattr(data, "columns"):
        return [(str(label), data[label]) for label in data.columns]
    kind = type(data).__name__
    raise InputError(name, "", f"a {kind}, which has no columns", TABLE_EXPECTED)


def arrow_of(name: str, label: str, values: Any) -> Any:
    """Make an array of Arrow from a column.

    Raises
    ------
    InputError
        For anything but a column of single values.
    """
    import pyarrow as pa

    if isinstance(values, (pa.Array, pa.ChunkedArray)):
        return single_values(name, label, values)
    if isinstance(values, (str, bytes)) or not hasattr(values, "__len__"):
        kind = type(values).__name__
        raise InputError(name, label, f"a {kind}", "a value for every row")
    if isinstance(values, np.ndarray) and values.ndim != 1:
        raise InputError(name, label, f"an array of {values.ndim} dimensions", "one dimension")
    if isinstance(values, np.ndarray) and values.dtype.kind == "c":
        raise InputError(name, label, "complex numbers", "real numbers")
    try:
        return single_values(name, label, pa.array(values, from_pandas=True))
    except (pa.ArrowException, TypeError, ValueError, OverflowError, AttributeError):
        return single_values(name, label, of_objects(name, label, values))


def of_objects(name: str, label: str, values: Any) -> Any:
    """Make an Arrow array from values of several types, or of types unknown to Arrow."""
    import pyarrow as pa

    cells = list(values)
    try:
        return pa.array([None if missing(cell) else float(cell) for cell in cells], pa.float64())
    except (TypeError, ValueError):
        pass
    odd = next(
        (
            i
            for i, cell in enumerate(cells)
            if isinstance(cell, (Sequence, np.ndarray, Mapping))
            and not isinstance(cell, (str, bytes))
        ),
        None,
    )
    if odd is not None:
        kind = type(cells[odd]).__name__
        raise InputError(name, label, f"a {kind} in row {odd + 1}", "one value")
    return pa.array([None if missing(cell) else str(cell) for cell in cells], pa.string())


def missing(cell: Any) -> bool:
    """Whether a value is missing: None, NA, NaN, NaT."""
    if cell is None or type(cell).__name__ in ("NAType", "NaTType"):
        return True
    return isinstance(cell, (float, np.floating)) and bool(np.isnan(cell))


def rows_in(name: str, labels: Sequence[str], columns: Sequence[Any]) -> int:
    """Count the rows of columns.

    Raises
    ------
    InputError
        If their lengths differ.
    """
    for label, column in zip(labels, columns, strict=True):
        if len(column) != len(columns[0]):
            found = f"{len(column)} values"
            raise InputError(name, label, found, f"{len(columns[0])}, as in {labels[0]}")
    return len(columns[0]) if columns else 0
