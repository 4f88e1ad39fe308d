"""Tables: what a file or data in memory is read through: a header, and columns as they stand.

Every kind of table has a header, which is known before any row is read, and gives the columns that
are requested as arrays of Arrow.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from lostmotion.recordings.findings import Finding

CELLS_SHOWN = 8
"""First cells of a column, which tell dates from numbers before the column is read."""


@dataclass(frozen=True)
class Header:
    """What is known of a table before it is read.

    Attributes
    ----------
    file : str
        The file, or what the table is called.
    names, units : tuple of str
        Names of the columns as they stand, which may repeat or be empty, and their units where a
        row of units says so.
    place : str
        ``line 4`` where the header is not the first line; empty where nobody wonders.
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
        return f"there are {', '.join(self.names)}{place}"


@dataclass
class Rows:
    """Columns of a table that were read.

    Attributes
    ----------
    columns : dict
        From the number of a column to its array of Arrow.
    count : int
    place : callable
        Where a row stands: ``line 7`` of a text, else ``row 7``.
    findings : list of Finding
        What was set aside.
    blocks : tuple of int
        Rows that a blank line stands before.
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
        """Read columns; as text where the table is one and that is requested."""
        ...


def first_cells(column: Any) -> list[str]:
    """First cells of a column as text."""
    return [arrow_text(value) for value in column.slice(0, CELLS_SHOWN)]


def arrow_text(value: Any) -> str:
    """Return a value of Arrow as text: Python's own times end at microseconds."""
    kind = str(value.type)
    if not value.is_valid:
        return ""
    if kind.startswith("duration"):
        return str(value.value)
    if kind.startswith("timestamp"):
        return str(value.cast("string"))
    return str(value.as_py())
