"""Tables of a TOML file, read key by key: names, units, types and ranges, or an `InputError`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

from lostmotion import units
from lostmotion.errors import InputError, did_you_mean

Kind = Literal["real", "integer", "switch", "text", "choice"]


INTEGER_MAX = 2**31 - 1
"""Largest integer of the library."""


@dataclass(frozen=True)
class Key:
    """One key of a table.

    Attributes
    ----------
    name : str
        Without its unit.
    unit : str
        The unit in which the value is kept; empty for a pure number. The file may state any unit of
        the same dimension.
    kind : str
        ``real``, ``integer``, ``switch`` (true or false), ``text`` or ``choice``.
    required : bool
        Whether the table must have it.
    choices : tuple of str
        Permitted values of a choice.
    above, low, high : float
        Range in `unit`: ``value > above``, ``low <= value <= high``.
    """

    name: str
    unit: str = ""
    kind: Kind = "real"
    required: bool = False
    choices: tuple[str, ...] = ()
    above: float = -math.inf
    low: float = -math.inf
    high: float = math.inf

    @cached_property
    def written(self) -> str:
        """The key with the unit of its stored value."""
        return f"{self.name}_{self.unit}" if self.unit else self.name

    @cached_property
    def kept(self) -> units.Unit:
        """The unit in which the key is kept; a pure number has the unit 1."""
        return units.unit(self.unit) if self.unit else units.Unit("", units.DIMENSIONLESS, 1.0)

    @property
    def expected(self) -> str:
        """Description of permitted values."""
        if self.kind == "choice":
            return "one of " + ", ".join(f"'{choice}'" for choice in self.choices)
        if self.kind == "switch":
            return "true or false"
        if self.kind == "text":
            return "text"
        return "an integer" if self.kind == "integer" else "a number"


@dataclass(frozen=True)
class TableEntry:
    """Value of a key in a table.

    Attributes
    ----------
    value
        Converted to the unit in which the key is kept.
    place : str
        Dotted key as the file has it, with the file's unit.
    unit : str
        The file's unit.
    """

    value: Any
    place: str
    unit: str = ""


SHOWN_MAX = 4
"""Most values of an array that a message shows."""


def as_in_file(value: Any) -> str:
    """Format a value as in the file."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f"'{value}'"
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list):
        short = len(value) <= SHOWN_MAX and not any(isinstance(v, (list, Mapping)) for v in value)
        return f"[{', '.join(map(as_in_file, value))}]" if short else "an array"
    if isinstance(value, float):
        return repr(value)
    return str(value)


def read_keys(
    file: str, place: str, table: Any, keys: Sequence[Key], tables: Sequence[str] = ()
) -> dict[str, TableEntry]:
    """Read one table.

    Parameters
    ----------
    file, place : str
        For messages: the file and the dotted name of the table.
    table
        The table as TOML returns it.
    keys : sequence of Key
        Permitted keys of the table.
    tables : sequence of str
        Sub-tables that are read elsewhere.

    Returns
    -------
    dict
        From the `key_label` of a key to its value; absent keys are left out.
    """
    if not isinstance(table, Mapping):
        raise InputError(file, place, as_in_file(table), "a table")
    by_name: dict[str, list[Key]] = {}
    for key in keys:
        by_name.setdefault(key.name, []).append(key)
    known = [key.written for key in keys] + list(tables)
    found: dict[str, TableEntry] = {}
    for written, value in table.items():
        if written in tables:
            continue
        at = f"{place}.{written}" if place else written
        key, unit = _identify(file, at, written, by_name, known)
        name = _label(key, by_name[key.name])
        if name in found:
            raise InputError(file, at, f"{found[name].place} as well", "the quantity once")
        found[name] = TableEntry(
            _convert(file, at, key, unit, value), at, unit.symbol if unit else ""
        )
    for key in keys:
        if key.required and _label(key, by_name[key.name]) not in found:
            at = f"{place}.{key.written}" if place else key.written
            raise InputError(file, at, "nothing", f"this key, {key.expected}")
    return found


def key_label(key: Key, keys: Sequence[Key]) -> str:
    """Name under which `read_keys` returns a key, with its unit if two keys share the name."""
    return _label(key, [other for other in keys if other.name == key.name])


def _label(key: Key, same: Sequence[Key]) -> str:
    """Label of a key, with all keys of its name."""
    return key.written if len(same) > 1 else key.name


def _identify(
    file: str, at: str, written: str, by_name: Mapping[str, Sequence[Key]], known: Sequence[str]
) -> tuple[Key, units.Unit | None]:
    """Find the key and the unit of a name."""
    if written in by_name:
        keys = by_name[written]
        for key in keys:
            if not key.unit:
                return key, None
        raise InputError(
            file, at, "no unit", f"{_dimensions(keys)} as a suffix, e.g. {keys[0].written}"
        )
    base, unit = units.split_unit(written)
    if unit is not None and base in by_name:
        for key in by_name[base]:
            if unit.dimension == key.kept.dimension:
                return key, unit
        found = f"unit '{unit.symbol}', {units.dimension_name(unit.dimension)}"
        raise InputError(file, at, found, _dimensions(by_name[base]))
    for name, keys in by_name.items():
        suffix = written.removeprefix(f"{name}_")
        if keys[0].unit and suffix != written and "_" not in suffix:
            raise InputError(file, at, f"unknown unit '{suffix}'", _dimensions(keys))
    same = [
        f"{name}_{unit.symbol}"
        for name, keys in by_name.items()
        if unit is not None and any(unit.dimension == key.kept.dimension for key in keys)
    ]
    hint = did_you_mean(written, [*same, *known]) or f": {', '.join(known)}"
    raise InputError(file, at, "an unknown key", f"a key of this table{hint}")


def _dimensions(keys: Sequence[Key]) -> str:
    """Describe the permitted units of keys with the same name."""
    return " or ".join(units.dimension_name(key.kept.dimension) for key in keys)


def _convert(file: str, at: str, key: Key, unit: units.Unit | None, value: Any) -> Any:
    """Check type and range, and convert to the unit in which the key is kept."""
    if key.kind == "switch":
        right = isinstance(value, bool)
    elif key.kind in ("text", "choice"):
        right = isinstance(value, str)
    elif key.kind == "integer":
        right = isinstance(value, int) and not isinstance(value, bool)
    else:
        right = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not right:
        raise InputError(file, at, as_in_file(value), key.expected)
    if key.kind == "choice" and value not in key.choices:
        raise InputError(
            file, at, as_in_file(value), key.expected + did_you_mean(value, key.choices)
        )
    if key.kind != "real":
        if key.kind == "integer":
            low, high = max(key.low, -INTEGER_MAX), min(key.high, INTEGER_MAX)
            if not low <= value <= high:
                raise InputError(
                    file, at, as_in_file(value), f"{key.expected} from {low} to {high}"
                )
        return value
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InputError(file, at, as_in_file(value), "a finite number")
    kept = key.kept
    if unit is not None and unit != kept:  # in its own unit a value keeps every bit
        number = kept.from_si(unit.to_si(number))
    if not (number > key.above and key.low <= number <= key.high):
        raise InputError(file, at, as_in_file(value), _range(key, unit))
    return number


def _range(key: Key, unit: units.Unit | None) -> str:
    """Describe the range of a key in the unit of the file."""

    def local(bound: float) -> str:
        return f"{unit.from_si(key.kept.to_si(bound)) if unit else bound:.6g}"

    parts = []
    if math.isfinite(key.above):
        parts.append(f"above {local(key.above)}")
    if math.isfinite(key.low) and math.isfinite(key.high):
        parts.append(f"from {local(key.low)} to {local(key.high)}")
    elif math.isfinite(key.low):
        parts.append(f"at least {local(key.low)}")
    elif math.isfinite(key.high):
        parts.append(f"at most {local(key.high)}")
    return f"{key.expected} {' and '.join(parts)}"
