"""Columns: which one of a file is which quantity, in which unit, by its name or by a map."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion import units
from lostmotion.errors import InputError, did_you_mean
from lostmotion.recordings.bags import bag_header, is_bag
from lostmotion.recordings.encoders import Counter
from lostmotion.recordings.findings import UNUSED
from lostmotion.recordings.protocol import FREE, ORDER, Protocol, advice
from lostmotion.recordings.quantities import QUANTITIES, Quantity
from lostmotion.recordings.tables import header_of, numbers_of

FloatArray = npt.NDArray[np.float64]

BRACKETED = re.compile(r"\s*([^\[(]+?)\s*[\[(]\s*([^\])]+?)\s*[\])]\s*")
"""A name with its unit in brackets, as plots and loggers label their columns."""

DIVIDED = re.compile(r"(.+)/(\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)(?:%(\d+))?")
"""A name whose numbers are so many to the unit, as the counts of an encoder, and after how many
counts they begin anew."""


@dataclass(frozen=True)
class ColumnName:
    """A quantity with a unit, as the header or a map names it."""

    quantity: Quantity
    unit: units.Unit | None
    factor: float = 1.0
    """What the numbers are multiplied by before the unit is converted."""
    overflow: float | None = None
    """After how many counts the numbers begin anew, where a map says so."""


def parse_map(entries: Iterable[str]) -> dict[str, str]:
    """Read ``COLUMN=NAME_UNIT`` options of the command line.

    Raises
    ------
    InputError
        When an entry has no ``=`` or names a column twice.
    """
    mapping: dict[str, str] = {}
    for entry in entries:
        column, separator, target = entry.partition("=")
        if not separator or not column or not target:
            raise InputError("--map", entry, "no COLUMN=NAME_UNIT", "e.g. POSITION=lost_motion_rev")
        if column in mapping:
            raise InputError("--map", column, "the column twice", "each column once")
        mapping[column] = target
    return mapping


def expected_units(quantity: Quantity) -> str:
    """Say which units a column of this quantity may have."""
    return units.describe(quantity.dimension)


def spelled_out(label: str) -> str:
    """Name with a unit suffix of a label that has its unit in brackets; others stay.

    Examples
    --------
    >>> spelled_out("Input angle [°]"), spelled_out("Torque (N·m)"), spelled_out("torque_Nm")
    ('input_angle_deg', 'torque_Nm', 'torque_Nm')
    """
    found = BRACKETED.fullmatch(label)
    if found is None:
        return label
    unit = found[2].replace("°C", "C").replace("°", "deg").replace("/", "_per_")
    base = re.sub(r"[\s-]+", "_", found[1]).lower()
    return f"{base}_{re.sub('[ ·*]', '', unit)}"


def divisor(file: str, column: str, text: str) -> float:
    """Read the number that a column is divided by."""
    value = float(text)
    if not 0.0 < value < math.inf:
        raise InputError(file, column, f"'/{text}' in --map", "a positive number behind the slash")
    return value


def parse_column(file: str, column: str, name: str) -> ColumnName | None:
    """Understand a column name; None when it names nothing that is known here.

    A leading minus sign (in a map) turns the column round, a number behind a slash divides it.
    """
    factor = -1.0 if name.startswith("-") else 1.0
    name = name.removeprefix("-")
    divided, overflow = DIVIDED.fullmatch(name), None
    if divided is not None:
        name, factor = divided[1], factor / divisor(file, column, divided[2])
        overflow = None if divided[3] is None else divisor(file, column, divided[3])
    name = spelled_out(name)
    base, unit = units.split_unit(name)
    if name in QUANTITIES:
        base, unit = name, None
    if base not in QUANTITIES:
        for known in QUANTITIES.values():
            suffix = name.removeprefix(f"{known.name}_")
            if unit is None and known.unit and suffix != name and "_" not in suffix:
                raise InputError(file, column, f"unknown unit '{suffix}'", expected_units(known))
        return None
    quantity = QUANTITIES[base]
    if unit is None and quantity.unit:
        raise InputError(
            file,
            column,
            "no unit",
            f"{expected_units(quantity)} as a suffix, e.g. {quantity.column}, "
            f"or --map {column}={quantity.column}",
        )
    found = unit.dimension if unit else units.DIMENSIONLESS
    if found != quantity.dimension:
        symbol = unit.symbol if unit else ""
        raise InputError(
            file, column, f"unit '{symbol}', {units.describe(found)}", expected_units(quantity)
        )
    return ColumnName(quantity, unit, factor, overflow)


def resolve_columns(
    file: str, header: Sequence[str], mapping: Mapping[str, str], protocol: Protocol = FREE
) -> tuple[dict[str, tuple[str, ColumnName]], list[str]]:
    """Decide which column of a file is which quantity; a map counts where its column is.

    Returns
    -------
    chosen : dict
        From the name of a quantity to the column and how it is to be read.
    ignored : list of str
        Columns that name nothing known.
    """
    chosen: dict[str, tuple[str, ColumnName]] = {}
    doubtful: list[tuple[str, InputError]] = []
    ignored: list[str] = []
    for column in sorted(header, key=lambda name: name not in mapping):
        try:
            name = parse_column(file, column, mapping.get(column, column))
        except InputError as error:
            if column in mapping:
                raise
            doubtful.append((column, error))
            continue
        if name is None:
            if column in mapping:
                raise InputError(
                    file,
                    column,
                    f"the name '{mapping[column]}' in --map",
                    f"one of {', '.join(q.column for q in QUANTITIES.values())}"
                    + did_you_mean(mapping[column], (q.column for q in QUANTITIES.values())),
                )
            ignored.append(column)
        elif name.quantity.name in chosen:
            first = chosen[name.quantity.name][0]
            if first in mapping and column not in mapping:
                ignored.append(column)
                continue
            raise InputError(
                file, column, f"{name.quantity.name} a second time (first '{first}')", "it once"
            )
        else:
            chosen[name.quantity.name] = (column, name)
    faults: list[InputError] = []
    there = set(chosen)
    for column, doubt in doubtful:
        # A column such as torque_raw beside torque_Nm is not meant; alone it has no known unit.
        meant = {q for q in QUANTITIES if f"{spelled_out(column)}_".startswith(f"{q}_")}
        if meant & set(chosen):
            ignored.append(column)
        else:
            faults.append(doubt)
            there |= meant
    refuse_faults(file, faults + lacking(file, header, mapping, there, protocol))
    return chosen, ignored


def lacking(
    file: str,
    header: Sequence[str],
    mapping: Mapping[str, str],
    there: Collection[str],
    protocol: Protocol = FREE,
) -> list[InputError]:
    """Say which quantities a recording needs and a file has not."""
    faults = []
    recorded, there = there, {*there, *protocol.supplies(there)}
    locked = advice(recorded) if protocol.locked is None else ""
    nothing = f"no such column (there are {', '.join(header)})"

    def named(name: str) -> str:
        """Say how a column of the quantity may be called."""
        foreign = [
            c for c, t in mapping.items() if f"{t.removeprefix('-')}_".startswith(f"{name}_")
        ]
        return ", ".join([QUANTITIES[name].column, *(f"{c} by the map" for c in foreign)])

    for name in ("time", "torque"):
        if name not in there:
            column = QUANTITIES[name].column
            near = {h.lower(): h for h in header}
            close = difflib.get_close_matches(name, near, n=1)
            meant = near[close[0]] if close else "COLUMN"
            measured = name == "time" and "torque" in there
            others = f", or {ORDER}, a running number" if measured else ""
            if name == "torque" and locked and "output_angle" not in there:
                others = f"; {locked}"
            expected = f"{named(name)}, or --map {meant}={column}{others}"
            faults.append(InputError(file, column, nothing, expected))
    if "lost_motion" not in there and not {"input_angle", "output_angle"} <= set(there):
        have = [name for name in ("input_angle", "output_angle") if name in there]
        found = f"only {have[0]} among {', '.join(header)}" if have else nothing
        expected = f"{named('input_angle')} and {named('output_angle')}, or {named('lost_motion')}"
        expected += f"; or {locked}" if locked else ""
        faults.append(InputError(file, "lost_motion_rad", found, expected))
    return faults


def refuse_faults(file: str, faults: Sequence[InputError]) -> None:
    """Raise all that is wrong with the columns of a file as one error of one line."""
    if len(faults) == 1:
        raise faults[0]
    if faults:
        columns = ", ".join(fault.key for fault in faults)
        alike = len({fault.found for fault in faults}) == 1
        found = [fault.found if alike else f"{fault.key}: {fault.found}" for fault in faults]
        expected = "; ".join(fault.expected for fault in faults)
        raise InputError(file, columns, "; ".join(dict.fromkeys(found)), expected)


def check_map(files: Sequence[Path], mapping: Mapping[str, str]) -> None:
    """Refuse a map of a column that no file has; files of one campaign may name theirs apart.

    Raises
    ------
    InputError
        Names the column and those that there are.
    """
    headers: dict[str, None] = {}
    unread = list(files)
    for column, target in mapping.items():
        while column not in headers and unread:
            file = unread.pop(0)
            header = bag_header(file, mapping) if is_bag(file) else header_of(file)
            headers.update(dict.fromkeys(header))
        if column in headers:
            continue
        more = f" and {len(files) - 1} more file{'s' * (len(files) > 2)}" if len(files) > 1 else ""
        raise InputError(
            f"{files[0]}{more}",
            column,
            f"no such column (there are {', '.join(headers)})",
            f"the column that the map {column}={target} names" + did_you_mean(column, headers),
        )


def unused(column: str, chosen: Iterable[str]) -> str:
    """Say that a column is not used, and what to write if it is what its name says."""
    quantity = column.lower()
    if quantity not in QUANTITIES or quantity in chosen:
        return UNUSED
    return f"{UNUSED}; if it is the {quantity}: --map {column}={QUANTITIES[quantity].column}"


def in_si(
    file: str,
    table: Mapping[str, npt.NDArray[Any]],
    chosen: Mapping[str, tuple[str, ColumnName]],
    protocol: Protocol = FREE,
    ratio: float | None = None,
) -> dict[str, FloatArray]:
    """Return the quantities of a table, but for the run, in the units that they are kept in.

    What the protocol tells, which needs the ratio, is put in.
    """
    numbers: dict[str, FloatArray] = {}
    for quantity, (column, meaning) in chosen.items():
        if quantity == "run":
            continue
        values = meaning.factor * numbers_of(file, column, table[column])
        if meaning.unit is not None:
            values = units.convert(values, meaning.unit.symbol, meaning.quantity.unit)
        check_range(file, column, values, meaning.quantity)
        numbers[quantity] = np.ascontiguousarray(values)
    return protocol.complete(file, numbers, ratio)


def counters_of(chosen: Mapping[str, tuple[str, ColumnName]]) -> dict[str, Counter]:
    """Say of the angles that are counts by a map how large a count is."""
    return {
        quantity: Counter(abs(meaning.factor) * meaning.unit.scale, meaning.overflow)
        for quantity, (_, meaning) in chosen.items()
        if quantity in ("input_angle", "output_angle")
        and meaning.unit is not None
        and abs(meaning.factor) != 1.0
    }


def check_range(file: str, column: str, values: FloatArray, quantity: Quantity) -> None:
    """Refuse numbers that this quantity cannot have; what is not finite is counted elsewhere."""
    beyond = np.isfinite(values) & ~((values >= quantity.low) & (values <= quantity.high))
    if np.any(beyond):
        row = int(np.flatnonzero(beyond)[0])
        unit = f" {quantity.unit}" if quantity.unit else ""
        raise InputError(
            file,
            column,
            f"{values[row]:.6g}{unit} in row {row + 1}",
            f"{quantity.low:g} to {quantity.high:g}{unit}",
        )
