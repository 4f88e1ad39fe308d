"""Column table: what each column of some recordings is taken as under a map, with first values.

Nothing is refused here: a fault becomes the remark of its column, so that a map can be corrected.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lostmotion import units
from lostmotion.errors import InputError, one_line
from lostmotion.recordings.columns import (
    DIVIDED,
    ColumnName,
    choose_columns,
    expected_units,
    lacking,
    split_label,
)
from lostmotion.recordings.opening import header_of
from lostmotion.recordings.protocol import FREE, Protocol
from lostmotion.recordings.quantities import QUANTITIES, Quantity
from lostmotion.recordings.tables import Header

DATES = "iso"
"""Unit of a map for time stamps that are dates or times of day."""


@dataclass(frozen=True)
class Choice:
    """Parts of a map entry ``-NAME_UNIT/NUMBER``.

    Attributes
    ----------
    quantity, unit : str
        An empty quantity stands for no entry: the column is read by its name.
    reversed : bool
    divisor : str
        Counts per unit, and after ``%`` the counts until overflow; empty for none.
    """

    quantity: str = ""
    unit: str = ""
    reversed: bool = False
    divisor: str = ""

    @classmethod
    def of_entry(cls, entry: str) -> Choice:
        """Split an entry into its parts; an entry that names no quantity is left whole."""
        name = entry.removeprefix("-")
        before, _, divisor = name.partition("/")
        if divisor and (DIVIDED.fullmatch(name) or (split_label(before) or ("", ""))[1]):
            name = before
        else:  # the slash, if any, is before the unit
            divisor = ""
        quantity, unit = split_label(name) or (name, "")
        return cls(quantity, unit, entry.startswith("-"), divisor)

    def entry(self) -> str:
        """Join the parts; empty if the column is read by its name."""
        if not self.quantity:
            return ""
        name = f"{self.quantity}_{self.unit}" if self.unit else self.quantity
        divisor = f"/{self.divisor}" if self.divisor else ""
        return f"{'-' if self.reversed else ''}{name}{divisor}"


@dataclass(frozen=True)
class ColumnRow:
    """A column of the recordings.

    Attributes
    ----------
    name : str
    first : tuple of str
        Its first cells, as in the file.
    quantity, unit : str
        What it is taken as; an empty quantity if it is not used.
    remark : str
        The fault of its name or map entry, or its part in a clock of two columns.
    fault : bool
        Whether the remark is a fault.
    """

    name: str
    first: tuple[str, ...]
    quantity: str = ""
    unit: str = ""
    remark: str = ""
    fault: bool = False


@dataclass(frozen=True)
class ColumnTable:
    """The columns of some recordings, and a map of them.

    Attributes
    ----------
    headers : list of Header
        The different ones of the recordings.
    stated : dict
        Map of the drive file.
    entries : dict
        Map from the command line or the page, which takes precedence.
    """

    headers: list[Header]
    stated: dict[str, str]
    entries: dict[str, str]
    protocol: Protocol = FREE

    @classmethod
    def of_files(
        cls,
        files: Sequence[Path],
        entries: Mapping[str, str],
        stated: Mapping[str, str] | None = None,
        protocol: Protocol = FREE,
    ) -> ColumnTable:
        """Read the headers of recordings.

        Raises
        ------
        InputError
            If a file has no header.
        """
        wanted = {**(stated or {}), **entries}
        found: dict[tuple[tuple[str, ...], tuple[str, ...]], Header] = {}
        for file in files:
            header = header_of(file, wanted)
            found.setdefault((header.names, header.units), header)
        return cls(list(found.values()), dict(stated or {}), dict(entries), protocol)

    @property
    def names(self) -> list[str]:
        """Names of all columns, each once."""
        return list(dict.fromkeys(n for header in self.headers for n in header.names if n))

    @property
    def mapping(self) -> dict[str, str]:
        """The whole map."""
        return {**self.stated, **self.entries}

    def with_choice(self, column: str, choice: Choice) -> ColumnTable:
        """Return the table with another map entry of a column."""
        entries = {name: entry for name, entry in self.entries.items() if name != column}
        entry = choice.entry()
        if entry and entry != self.stated.get(column):
            entries[column] = entry
        return replace(self, entries=entries)

    def without_absent(self) -> ColumnTable:
        """Return the table without the entries of columns that the recordings do not have."""
        names = set(self.names)
        return replace(
            self, entries={name: entry for name, entry in self.entries.items() if name in names}
        )

    def choice(self, column: str) -> Choice:
        """Return the parts of the map entry of a column."""
        return Choice.of_entry(self.mapping.get(column, ""))

    def rows(self) -> tuple[list[ColumnRow], list[str]]:
        """Return a row for every column, and what the recordings lack."""
        rows: dict[str, ColumnRow] = {}
        missing: list[str] = []
        for header in self.headers:
            new, faults = describe_columns(header, self.mapping, self.protocol)
            for name, row in new.items():
                if name not in rows or (row.fault and not rows[name].fault):
                    rows[name] = row
            missing += [fault for fault in faults if fault not in missing]
        return list(rows.values()), missing


def describe_columns(
    header: Header, mapping: Mapping[str, str], protocol: Protocol
) -> tuple[dict[str, ColumnRow], list[str]]:
    """Describe the columns of a header, and what it lacks; a faulty map entry is not applied."""
    rows = {
        name: ColumnRow(name, tuple(header.cells(i)))
        for i, name in reversed(list(enumerate(header.names)))
        if name
    }
    rows = dict(reversed(rows.items()))
    applied = {name: entry for name, entry in mapping.items() if name in rows}
    chosen: dict[str, tuple[str, ColumnName]] = {}
    doubts: list[tuple[str, InputError]] = []
    for _ in range(len(applied) + 1):
        try:
            chosen, _, doubts = choose_columns(header, applied)
            break
        except InputError as error:
            if error.key not in rows:
                return rows, [one_line(str(error))]
            said = without_unit(applied.get(error.key, "")) or fault_of(error)
            rows[error.key] = replace(rows[error.key], remark=said, fault=True)
            if applied.pop(error.key, None) is None:
                return rows, [f"{error.key}: {said}"]
    for quantity, (name, meaning) in chosen.items():
        if rows[name].fault:
            continue
        rows[name] = replace(rows[name], quantity=quantity, unit=unit_of(meaning), remark="")
        if meaning.fraction is not None:
            fraction = header.names[meaning.fraction[0]]
            remark = f"fractions of a second of {name}"
            rows[fraction] = replace(rows[fraction], quantity=quantity, remark=remark)
    for _, doubt in doubts:
        said = without_unit(applied.get(doubt.key, "")) or fault_of(doubt)
        rows[doubt.key] = replace(rows[doubt.key], remark=said, fault=True)
    there = {*chosen, *(quantity for quantity, _ in doubts)}
    return rows, [
        f"missing: {fault.expected}" for fault in lacking(header, applied, there, protocol)
    ]


def fault_of(error: InputError) -> str:
    """Return a message without its file and column, which the table shows."""
    return f"found {error.found}, expected {error.expected}"


def without_unit(entry: str) -> str:
    """Describe an entry that lacks its unit; empty if it has one."""
    choice = Choice.of_entry(entry)
    quantity = QUANTITIES.get(choice.quantity)
    if quantity is None or choice.unit or not quantity.unit:
        return ""
    return f"no unit; expected {expected_units(quantity)}"


def unit_of(meaning: ColumnName) -> str:
    """Return the unit of a column."""
    if meaning.unit is not None:
        return meaning.unit.symbol
    return DATES if meaning.quantity.name == "time" else ""


def units_for(quantity: Quantity) -> list[str]:
    """Return the units that a column of a quantity may have."""
    found = [s for s, unit in units.ATOMS.items() if unit.dimension == quantity.dimension]
    return [*found, DATES] if quantity.name == "time" else found
