"""Columns: quantity and unit of each column, from its name or a map."""

from __future__ import annotations

import difflib
import math
import re
import shlex
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lostmotion import units
from lostmotion.errors import InputError, did_you_mean, shorten
from lostmotion.recordings.cells import is_missing, is_value, plain, unit_behind
from lostmotion.recordings.clocks import EPOCH_RANGE_S, UNITS_NS, in_whole_seconds, stamped
from lostmotion.recordings.encoders import Counter
from lostmotion.recordings.findings import UNUSED
from lostmotion.recordings.opening import header_of
from lostmotion.recordings.protocol import FREE, MOTOR_SIDE, ORDER, Protocol, suggest_protocol
from lostmotion.recordings.quantities import QUANTITIES, Quantity
from lostmotion.recordings.tables import Header

BRACKETED = re.compile(r"(.+?)[\s_]*[\[({<]\s*(.*?)\s*[\])}>]\.?")
"""A name with its unit in brackets, as plots and loggers label their columns."""

SLASHED = re.compile(r"(.+?)\s*/\s*([^/0-9]+)")
"""A name over its unit, as ISO 80000-1 labels columns."""

DIVIDED = re.compile(r"(.+)/(\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)(?:%(\d+))?")
"""A name with the number of counts per unit, for example of an encoder, and the counts until
overflow.
"""

COUNTS = frozenset(("count", "counts", "cnt", "cnts", "tick", "ticks", "inc", "increments", "lsb"))
"""Count units of encoders; names do not state the counts per turn."""

STAMPS = frozenset(
    [
        "timestamp",
        "time_stamp",
        "stamp",
        "datetime",
        "date_time",
        "utc",
        "utc_time",
        "time_utc",
        "local_time",
        "time_string",
        "system_time",
        "header_stamp",
        "stamp_time",
        "header_time",
        "t_stamp",
    ]
)
"""Names of clocks, in lower case with underscores; a column named ``time`` takes precedence."""

SECONDS = frozenset(["sec", "secs", "second", "seconds", "s"])
FRACTIONS = {
    **dict.fromkeys(
        ["nanosec", "nanosecs", "nsec", "nsecs", "nanosecond", "nanoseconds", "ns"], "ns"
    ),
    **dict.fromkeys(
        ["usec", "usecs", "microsec", "microsecs", "microsecond", "microseconds", "us"], "us"
    ),
}
"""Suffixes of the names of two columns that form one clock, as in ROS stamps."""

THOUSANDTHS = frozenset(
    ["ms", "msec", "msecs", "millisec", "millisecs", "millisecond", "milliseconds", "millitm"]
)
"""Names of a column of the milliseconds of a date or time of day in whole seconds."""

TEXT_STAMP = frozenset(("iso", "date", "utc", "stamp"))
"""Entry of a map instead of a unit if the stamps are dates or times of day."""


NEEDED = ("run", "time", "torque", "input_angle", "output_angle", "lost_motion")
"""Quantities that are always read; others are not used if they contain text."""

NOT_READ = "unused"
"""Entry of a map for a column that is not read, whatever its name suggests."""


@dataclass(frozen=True)
class ColumnName:
    """A quantity with a unit, as named in the header or a map."""

    quantity: Quantity
    unit: units.Unit | None
    factor: float = 1.0
    """Factor on the numbers before the unit is converted."""

    overflow: float | None = None
    """Counts until overflow, if a map states them."""

    index: int = -1
    """Number of the column in its table."""

    behind: str = ""
    """Unit after every number of the column."""

    fraction: tuple[int, str] | None = None
    """Column of the fractions of a second of a clock in two columns, and their unit."""

    again: tuple[int, ...] = ()
    """Columns of the same name, which must have the same cells."""


def parse_map(entries: Iterable[str]) -> dict[str, str]:
    """Read ``COLUMN=NAME_UNIT`` options of the command line.

    Raises
    ------
    InputError
        If an entry has no ``=`` or a column is named twice.
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
    """Describe which units a column of this quantity may have."""
    return units.dimension_name(quantity.dimension)


def normal(name: str) -> str:
    """Return a name in lower case, with underscores between words."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name.strip())
    return re.sub(r"[^a-z0-9]+", "_", apart.lower()).strip("_")


def split_label(label: str) -> tuple[str, str] | None:
    """Split a label into the quantity and the rest, which should be its unit.

    Case, blanks and hyphens do not matter; None if it names no quantity.

    Examples
    --------
    >>> split_label("Input angle [°]"), split_label("TORQUE_N.m"), split_label("torque/Nm")
    (('input_angle', '°'), ('torque', 'N.m'), ('torque', 'Nm'))
    """
    for form in (BRACKETED, SLASHED):
        found = form.fullmatch(label)
        if found is not None and normal(found[1]) in QUANTITIES:
            return normal(found[1]), found[2]
    ends = [found.end() for found in re.finditer(r"[^\s_,;:.-]+", label)]
    for end in reversed(ends[:3]):
        base = normal(label[:end])
        if base in QUANTITIES:
            return base, label[end:].strip(" _,;:.-")
    return None


def read_suffix(text: str, dimension: units.Dimension) -> units.Unit | None:
    """Read the unit after a name, also with a word between them."""
    found = units.read_unit(text, dimension)
    if found is None and text.lower().startswith("in ") and len(text) > 3:
        found = units.read_unit(text[3:], dimension)
    return found


def divisor(file: str, column: str, text: str) -> float:
    """Read the divisor of a column."""
    value = float(text)
    if not 0.0 < value < math.inf:
        raise InputError(file, column, f"'/{text}' in --map", "a positive number after the slash")
    return value


def parse_column(file: str, column: str, name: str, beside: str = "") -> ColumnName | None:
    """Parse a column name; None if it is unknown.

    A leading minus sign (in a map) reverses the sign, a number after a slash is a divisor. `beside`
    is a unit from elsewhere: from a row of units, or from the mapped name.
    """
    factor = -1.0 if name.startswith("-") else 1.0
    name = name.removeprefix("-")
    divided, overflow = DIVIDED.fullmatch(name), None
    if divided is not None:
        name, factor = divided[1], factor / divisor(file, column, divided[2])
        overflow = None if divided[3] is None else divisor(file, column, divided[3])
    found = split_label(name)
    if found is None:
        return None
    quantity = QUANTITIES[found[0]]
    suffix = found[1] or (beside if quantity.unit else "")
    shown = shorten(column)
    if quantity.name == "time" and suffix.lower() in TEXT_STAMP:
        return ColumnName(quantity, None, factor)
    if not suffix:
        if not quantity.unit:
            return ColumnName(quantity, None, factor)
        if name == column != quantity.name:
            return None  # TORQUE may be another torque; `unused` states what to write
        raise InputError(
            file,
            column,
            "no unit",
            f"{expected_units(quantity)} as a suffix, e.g. {quantity.column}, "
            f"or --map {shown}={quantity.column}",
        )
    unit = read_suffix(suffix, quantity.dimension)
    if unit is None:
        if not quantity.unit or (re.search(r"[\s_]", suffix) and not beside):
            return None
        expected = expected_units(quantity)
        if quantity.dimension == units.ANGLE and suffix.lower() in COUNTS:
            expected += f"; counts by --map {shown}={quantity.name}_rev/COUNTS_IN_A_TURN"
        if quantity.name not in NEEDED:
            option = shlex.quote(f"{shown}={NOT_READ}")
            expected += f"; if the column is another quantity, --map {option}"
        raise InputError(file, column, f"unknown unit '{suffix}'", expected)
    if unit.dimension != quantity.dimension:
        described = units.dimension_name(unit.dimension)
        raise InputError(file, column, f"unit '{suffix}', {described}", expected_units(quantity))
    return ColumnName(quantity, unit, factor, overflow)


def unit_in(label: str) -> str:
    """Return the text in brackets at the end of a label."""
    found = BRACKETED.fullmatch(label)
    return found[2] if found is not None else ""


def resolve_columns(
    header: Header, mapping: Mapping[str, str], protocol: Protocol = FREE
) -> tuple[dict[str, tuple[str, ColumnName]], list[str]]:
    """Assign columns of a recording to quantities; refuse a recording that lacks some.

    Returns
    -------
    chosen : dict
        Column and conversion by the name of a quantity.
    ignored : list of str
        Columns with unknown names; those without a name are not listed.
    """
    chosen, ignored, doubts = choose_columns(header, mapping)
    needless = [d.key for q, d in doubts if q in MOTOR_SIDE and protocol.locked != "output"]
    faults = [doubt for _, doubt in doubts if doubt.key not in needless]
    ignored += needless
    there = {*chosen, *(quantity for quantity, _ in doubts)}
    refuse_faults(header.file, faults + lacking(header, mapping, there, protocol))
    return chosen, ignored


def choose_columns(
    header: Header, mapping: Mapping[str, str]
) -> tuple[dict[str, tuple[str, ColumnName]], list[str], list[tuple[str, InputError]]]:
    """Assign columns of a table to quantities; a map applies if its column exists.

    Returns
    -------
    chosen, ignored
        As of `resolve_columns`.
    doubts : list of tuple
        Quantities with only faulty columns, and the fault.
    """
    file = header.file
    chosen: dict[str, tuple[str, ColumnName]] = {}
    doubtful: list[tuple[int, str, InputError]] = []
    ignored: list[str] = []
    places = sorted(range(len(header.names)), key=lambda i: header.names[i] not in mapping)
    for index in places:
        column = header.names[index]
        mapped = column in mapping
        if mapping.get(column) == NOT_READ:
            ignored.append(column)
            continue
        behind = unit_of_cells(header.cells(index))
        beside = behind or header.units[index] or (unit_in(column) if mapped else "")
        try:
            name = parse_column(file, column, mapping.get(column, column), beside)
        except InputError as error:
            quantity = (split_label(mapping.get(column, column)) or ("", ""))[0]
            if mapped and not (quantity == "time" and error.found == "no unit"):
                raise
            doubtful.append((index, quantity, error))
            continue
        if name is None:
            if mapped:
                known = [q.column for q in QUANTITIES.values()]
                raise InputError(
                    file,
                    column,
                    f"the name '{mapping[column]}' in --map",
                    f"one of {', '.join(known)}" + did_you_mean(mapping[column], known),
                )
            ignored.append(column)
            continue
        name = replace(name, index=index, behind=behind)
        if abs(name.factor) == 1.0:  # a divisor converts from any unit
            refuse_two_units(file, column, name, behind)
        if not mapped:
            refuse_two_units(file, column, name, beside)
        if not mapped and name.quantity.name not in NEEDED and holds_text(header.cells(index)):
            ignored.append(column)
        elif name.quantity.name in chosen:
            first, before = chosen[name.quantity.name]
            if first in mapping and not mapped:
                ignored.append(column)
                continue
            same = first == column and list(header.cells(index)) == list(header.cells(before.index))
            if same and name.quantity.name == "time":
                # Oscilloscopes write the clock beside every channel.
                chosen["time"] = (first, replace(before, again=(*before.again, index)))
                continue
            whole = joined_clock(before, name) if mapped and first != column else None
            if whole is None:
                if first == column and name.quantity.name == "time":
                    raise second_clock(file, column)
                found = f"{name.quantity.name} a second time (first '{first}')"
                if first == column:
                    found = "the column twice"
                expected = "each quantity once" if first != column else "each column once"
                raise InputError(file, column, found, expected)
            chosen[name.quantity.name] = (first, whole)
        else:
            chosen[name.quantity.name] = (column, name)
    if "time" not in chosen:
        find_clock(header, mapping, doubtful, chosen, ignored)
    else:
        add_fraction(header, chosen, ignored)
    doubts: list[tuple[str, InputError]] = []
    for index, quantity, doubt in doubtful:
        # A column such as torque_raw is not used if there is torque_Nm; alone it has no known unit.
        if quantity not in chosen:
            doubts.append((quantity, doubt))
        elif index != chosen[quantity][1].index:
            ignored.append(header.names[index])
    return chosen, [column for column in ignored if column], doubts


def second_clock(file: str, column: str) -> InputError:
    """Refuse two clocks of one name that differ, as a controller writes them for its channels."""
    expected = "one clock; or a file for each clock with its channels, given together with --join"
    return InputError(file, column, "two clocks with different times", f"{expected} linear")


def unit_of_cells(cells: Sequence[str]) -> str:
    """Return the unit after the number of every cell; empty if there is none."""
    stated = [cell for cell in cells if not is_missing(cell)]
    found = {unit_behind(plain(cell)) for cell in stated}
    return found.pop() if len(found) == 1 else ""


def refuse_two_units(file: str, column: str, name: ColumnName, beside: str) -> None:
    """Refuse a column whose name and row of units, or numbers, have different units."""
    if not beside or name.unit is None:
        return
    other = read_suffix(beside, name.quantity.dimension)
    if other is None and beside != name.behind:
        return  # a line of units also has other words
    found = f"{name.unit.symbol} in the name and {shorten(beside)} beside it"
    if other is None or other.dimension != name.quantity.dimension:
        expected = f"{expected_units(name.quantity)}; a prefix belongs to a unit"
        raise InputError(file, column, found, expected)
    if (other.scale, other.offset) != (name.unit.scale, name.unit.offset):
        columns = [f"{name.quantity.name}_{unit.symbol}" for unit in (name.unit, other)]
        maps = " or ".join(f"--map {shorten(column)}={one}" for one in columns)
        raise InputError(file, column, found, f"one unit: {maps}")


def holds_text(cells: Sequence[str]) -> bool:
    """Whether the first cells of a column contain text and no number."""
    stated = [cell for cell in cells if not is_missing(cell)]
    return bool(stated) and not any(is_value(cell) for cell in stated)


def joined_clock(first: ColumnName, second: ColumnName) -> ColumnName | None:
    """Join two columns of a clock that a map names: seconds, and a fraction in a smaller unit."""
    if first.quantity.name != "time" or first.unit is None or second.unit is None:
        return None
    pair = {first.unit.symbol: first, second.unit.symbol: second}
    if len(pair) != 2 or "s" not in pair:
        return None
    small = next(symbol for symbol in pair if symbol != "s")
    if small not in ("ns", "us", "ms"):
        return None
    return replace(pair["s"], fraction=(pair[small].index, small))


def fractions_in(header: Header) -> dict[str, tuple[int, str]]:
    """Find the columns that may contain fractions of a second, by their names."""
    found = {}
    for index, label in enumerate(header.names):
        stem, _, end = normal(label).rpartition("_")
        if end in FRACTIONS:
            found[stem] = (index, FRACTIONS[end])
    return found


def fraction_of(
    header: Header, index: int, fractions: Mapping[str, tuple[int, str]]
) -> tuple[int, str] | None:
    """Find the column that has the fractions of the seconds of another."""
    stem, _, end = normal(header.names[index]).rpartition("_")
    return fractions.get(stem) if end in SECONDS else None


def add_fraction(
    header: Header, chosen: dict[str, tuple[str, ColumnName]], ignored: list[str]
) -> None:
    """Add the fractions of a second to a clock of seconds if they are in another column."""
    label, name = chosen["time"]
    if name.unit is not None and name.unit.symbol == "s" and name.fraction is None:
        fraction = fraction_of(header, name.index, fractions_in(header))
        if fraction is not None:
            chosen["time"] = (label, replace(name, fraction=fraction))
            if header.names[fraction[0]] in ignored:
                ignored.remove(header.names[fraction[0]])


def find_clock(
    header: Header,
    mapping: Mapping[str, str],
    doubtful: Sequence[tuple[int, str, InputError]],
    chosen: dict[str, tuple[str, ColumnName]],
    ignored: list[str],
) -> None:
    """Find the clock of a table without a time column with unit.

    It is a column named time or stamp with dates, times of day or seconds since 1970; a stamp
    column with a unit; or two columns of seconds and their fractions.
    """
    quantity = QUANTITIES["time"]
    fractions = fractions_in(header)
    places = [index for index, name, _ in doubtful if name == "time"]
    named = set(places)
    places += [i for i, label in enumerate(header.names) if label not in mapping]
    for index in dict.fromkeys(places):
        label = header.names[index]
        found: ColumnName | None = None
        name = normal(label)
        stamp = name in STAMPS or name == "time" or index in named
        # An index of a data frame has no name; without one, only dates and times are a clock.
        stamp |= not label and stamped(header.cells(index))
        if stamp and dated(header.cells(index)):
            rest = thousandths_of(header, index)
            found = ColumnName(quantity, None, index=index, fraction=rest)
        elif name in STAMPS and header.units[index]:
            unit = units.read_unit(header.units[index], units.TIME)
            found = ColumnName(quantity, unit, index=index) if unit else None
        elif (stem := stamp_unit(label)) is not None:
            found = ColumnName(quantity, stem, index=index)
        elif (fraction := fraction_of(header, index, fractions)) is not None:
            found = ColumnName(quantity, units.unit("s"), index=index, fraction=fraction)
        if found is not None:
            chosen["time"] = (label, found)
            used = [label] + ([header.names[found.fraction[0]]] if found.fraction else [])
            for one in used:
                if one in ignored:
                    ignored.remove(one)
            return


def thousandths_of(header: Header, index: int) -> tuple[int, str] | None:
    """Find the column beside dates or times of day in whole seconds that has their milliseconds."""
    after = index + 1
    if after >= len(header.names) or normal(header.names[after]) not in THOUSANDTHS:
        return None
    stamps, rest = header.cells(index), [plain(cell) for cell in header.cells(after)]
    parts = all(re.fullmatch("[0-9]{1,3}", cell) or is_missing(cell) for cell in rest)
    return (after, "ms") if parts and in_whole_seconds(stamps) else None


def stamp_unit(label: str) -> units.Unit | None:
    """Return the unit after the name of a clock: ``timestamp_ns``, ``Stamp [ms]``."""
    bracketed = BRACKETED.fullmatch(label)
    base, suffix = bracketed.groups() if bracketed else label.rpartition("_")[::2]
    unit = units.read_unit(suffix, units.TIME) if normal(base) in STAMPS and suffix else None
    return unit if unit is not None and unit.dimension == units.TIME else None


def dated(cells: Sequence[str]) -> bool:
    """Whether cells are dates, times of day, or numbers that count from 1970 in some unit."""
    stated = [cell for cell in cells if not is_missing(cell)]
    if not stated:
        return False
    if stamped(stated):
        return True
    try:
        first = float(stated[0])
    except ValueError:
        return False
    low, high = EPOCH_RANGE_S
    return any(low <= first * ns / UNITS_NS["s"] <= high for ns in UNITS_NS.values())


LISTED = 4
"""Most columns with a unit of one dimension that a message lists."""


def list_some(columns: Sequence[str]) -> str:
    """List columns that may be meant, the first few of many."""
    more = f" and {len(columns) - LISTED} more" if len(columns) > LISTED else ""
    return ", ".join(f"'{one}'" for one in columns[:LISTED]) + more


def in_dimension(header: Header, quantity: Quantity) -> dict[str, units.Unit]:
    """List the columns with foreign names whose stated unit is one of the quantity."""
    found = {}
    for label, beside in zip(header.names, header.units, strict=True):
        bracketed = BRACKETED.fullmatch(label) or SLASHED.fullmatch(label)
        text = bracketed[2] if bracketed else beside
        foreign = bool(label and text) and split_label(label) is None
        unit = read_suffix(text, quantity.dimension) if foreign else None
        if unit is not None and unit.dimension == quantity.dimension:
            found[label] = unit
    return found


JOINED = "the other angle, also in another file of the same clock, given with this one"
"""What is expected if there is one encoder."""


def lacking(
    header: Header,
    mapping: Mapping[str, str],
    there: Collection[str],
    protocol: Protocol = FREE,
) -> list[InputError]:
    """Describe the required quantities that a file lacks."""
    faults = []
    recorded, there = there, {*there, *protocol.supplies(there)}
    locked = suggest_protocol(recorded) if protocol.locked is None else ""
    file, names = header.file, header.names
    nothing = f"no such column ({header.there_are()})"

    def named(name: str) -> str:
        """Describe the possible names of a column of the quantity."""
        foreign = [
            c for c, t in mapping.items() if f"{t.removeprefix('-')}_".startswith(f"{name}_")
        ]
        return ", ".join([QUANTITIES[name].column, *(f"{c} by the map" for c in foreign)])

    for name in ("time", "torque"):
        if name not in there:
            column = QUANTITIES[name].column
            near = {h.lower(): h for h in names}
            close = difflib.get_close_matches(name, near, n=1)
            stated = in_dimension(header, QUANTITIES[name])
            meant = near[close[0]] if close else "COLUMN"
            if len(stated) == 1:
                ((meant, unit),) = stated.items()
                column = f"{name}_{unit.symbol}"
            elif stated:
                meant = "COLUMN"  # which of them it is, only their owner knows
            option = shlex.quote(f"{meant}={column}")
            measured = name == "time" and "torque" in there
            others = f", or {ORDER}, a running number" if measured else ""
            if name == "torque" and locked and "output_angle" not in there:
                others = f"; {locked}"
            if "%" in meant:  # a share of a rated value, or of the range of a sensor
                option += "/NUMBER (percent for one unit)"
            if len(stated) > 1:
                option += f" in its unit ({list_some([*stated])})"
            expected = f"{named(name)}, or --map {option}{others}"
            faults.append(InputError(file, QUANTITIES[name].column, nothing, expected))
    if "lost_motion" not in there and not {"input_angle", "output_angle"} <= set(there):
        have = [name for name in ("input_angle", "output_angle") if name in there]
        found = f"only {have[0]} among {', '.join(names)}" if have else nothing
        expected = f"{named('input_angle')} and {named('output_angle')}, or {named('lost_motion')}"
        angles = [c for c in in_dimension(header, QUANTITIES["output_angle"]) if c not in mapping]
        if not have and angles:
            expected += (
                f", e.g. --map COLUMN=input_angle_rad in its unit (angles: {list_some(angles)})"
            )
        expected += f"; or {locked}" if locked else ""
        expected += f"; or {JOINED}" if have else ""
        faults.append(InputError(file, "lost_motion_rad", found, expected))
    return faults


def refuse_faults(file: str, faults: Sequence[InputError]) -> None:
    """Raise all faults of the columns of a file as one error of one line."""
    if len(faults) == 1:
        raise faults[0]
    if faults:
        columns = ", ".join(fault.key for fault in faults)
        alike = len({fault.found for fault in faults}) == 1
        found = [fault.found if alike else f"{fault.key}: {fault.found}" for fault in faults]
        expected = "; ".join(fault.expected for fault in faults)
        raise InputError(file, columns, "; ".join(dict.fromkeys(found)), expected)


def check_map(files: Sequence[Path], mapping: Mapping[str, str]) -> None:
    """Refuse a map of a column that no file has; files of one campaign may have different names.

    Raises
    ------
    InputError
        Names the column and the existing ones.
    """
    headers: list[Header] = []
    unread = list(files)
    names: dict[str, None] = {}
    for column in mapping:
        while column not in names and unread:
            headers.append(header_of(unread.pop(0), mapping))
            names.update(dict.fromkeys(headers[-1].names))
    refuse_unmapped(headers, len(files), mapping)


def refuse_unmapped(headers: Sequence[Header], files: int, mapping: Mapping[str, str]) -> None:
    """Refuse a map of a column that no table has."""
    names = dict.fromkeys(name for header in headers for name in header.names)
    for column, target in mapping.items():
        if column in names:
            continue
        more = f" and {files - 1} more file{'s' * (files > 2)}" if files > 1 else ""
        place = f"; header: {headers[0].place}" if headers[0].place and files == 1 else ""
        raise InputError(
            f"{headers[0].file}{more}",
            column,
            f"no such column (there are {', '.join(names)}{place})",
            f"the column that the map {column}={target} names" + did_you_mean(column, names),
        )


def unused(column: str, chosen: Iterable[str], text: bool = False) -> str:
    """Report that a column is not used, and the map option for what its name suggests."""
    named = split_label(column)
    if named is not None and named[0] not in chosen and text:
        return f"{UNUSED}: text in its first cells, no numbers"
    words, stated = normal(column).split("_"), unit_in(column)
    for quantity in QUANTITIES.values():
        if quantity.name in {*chosen, *NEEDED} or quantity.name not in words:
            continue
        unit = read_suffix(stated, quantity.dimension) if stated else None
        if unit is not None or normal(column) == quantity.name:
            name = quantity.column if unit is None else f"{quantity.name}_{unit.symbol}"
            option = shlex.quote(f"{column}={name}")
            return f"{UNUSED}; if it is the {quantity.name}: --map {option}"
    return UNUSED


def counters_of(chosen: Mapping[str, tuple[str, ColumnName]]) -> dict[str, Counter]:
    """Size of a count for angles that a map states as counts."""
    return {
        quantity: Counter(abs(meaning.factor) * meaning.unit.scale, meaning.overflow)
        for quantity, (_, meaning) in chosen.items()
        if quantity in ("input_angle", "output_angle")
        and meaning.unit is not None
        and abs(meaning.factor) != 1.0
    }
