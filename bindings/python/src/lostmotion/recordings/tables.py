"""Tables: common interface of files and data in memory: a header and raw columns.

Every table has a header, known before any row is read, and returns requested columns as Arrow
arrays.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from lostmotion.errors import InputError
from lostmotion.recordings.findings import Finding

CELLS_SHOWN = 8
"""Number of first cells of a column that distinguish dates from numbers before the column is
read."""


@dataclass(frozen=True)
class Header:
    """Properties of a table before it is read.

    Attributes
    ----------
    file : str
        File, or name of the table.
    names, units : tuple of str
        Names of the columns, which may repeat or be empty, and their units if there is a row of
        units.
    place : str
        ``line 4`` if the header is not the first line; otherwise empty.
    cells : callable
        First cells of a column by its number, as text.
    """

    file: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    place: str
    cells: Callable[[int], Sequence[str]]

    def there_are(self) -> str:
        """List the columns for a message."""
        place = f"; header: {self.place}" if self.place else ""
        return f"there are {', '.join(name or 'one without a name' for name in self.names)}{place}"


@dataclass
class Rows:
    """Columns of a table that were read.

    Attributes
    ----------
    columns : dict
        Arrow arrays by column number.
    count : int
    place : callable
        Location of a row: ``line 7`` of a text, else ``row 7``.
    findings : list of Finding
        What was set aside.
    blocks : tuple of int
        Rows after a blank line.
    """

    columns: dict[int, Any]
    count: int
    place: Callable[[int], str] = field(default=lambda row: f"row {row + 1}")
    findings: list[Finding] = field(default_factory=list)
    blocks: tuple[int, ...] = ()


class Table(Protocol):
    """A table that can be read."""

    header: Header

    def read(self, columns: Collection[int], as_text: bool = False) -> Rows:
        """Read columns, as text if requested and possible."""
        ...


def single_values(name: str, label: str, column: Any) -> Any:
    """Return a column with one value per row, in a plain type.

    Raises
    ------
    InputError
        If its values are lists or the like, or bytes that are no text.
    """
    import pyarrow as pa

    kind = column.type
    if pa.types.is_nested(kind):
        raise InputError(name, label, f"values of type {kind}", "one value for every row")
    if pa.types.is_binary(kind) or pa.types.is_large_binary(kind):
        try:
            return column.cast(pa.string())
        except pa.ArrowInvalid:
            raise InputError(name, label, f"values of type {kind}", "numbers or text") from None
    if pa.types.is_fixed_size_binary(kind):
        raise InputError(name, label, f"values of type {kind}", "numbers or text")
    if pa.types.is_dictionary(kind):
        return column.cast(kind.value_type)
    if pa.types.is_decimal(kind):
        return column.cast(pa.string())  # Arrow rounds twice on conversion to float64
    return column


def first_cells(column: Any) -> list[str]:
    """First cells of a column as text."""
    return [arrow_text(value) for value in column.slice(0, CELLS_SHOWN)]


def arrow_text(value: Any) -> str:
    """Return an Arrow value as text, because Python's times end at microseconds."""
    kind = str(value.type)
    if not value.is_valid:
        return ""
    if kind.startswith("duration"):
        return str(value.value)
    if kind.startswith("timestamp"):
        return str(value.cast("string"))
    return str(value.as_py())
