"""Layout: start of the table in a text, separator, header and units.

The program that wrote the text is unknown. Of all separators and header lines, those are chosen for
which most lines agree: same number of fields, numbers in the same places, and as many names above
them.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from lostmotion.errors import InputError
from lostmotion.recordings.cells import is_missing, is_value
from lostmotion.recordings.quantities import QUANTITIES
from lostmotion.recordings.separators import CANDIDATES, STATED, Separator
from lostmotion.units import is_unit

COLUMNS_MAX = 16_384
"""Largest number of columns of a table: that of the widest spreadsheets."""

LOOKED_AT = (64, 4096)
"""Number of lines that are examined first, and then if no table begins in them."""

BLANK_SHARE = 4
"""Number of lines that are read per line that is examined, because some are blank."""

LEAST_LINES = 8
"""Number of lines that are examined, however long they are."""

LOOKED_AT_BYTES = 1 << 16
"""Length after which no more lines are examined than `LEAST_LINES`."""

AGREEING = 6
"""Number of consistent rows that identify a table."""

COMMENT = re.compile(r"\s*(?:#+|%+|//+|;+|'|!+|\*+|--+|REM\b)\s*")
"""Comment characters; a comment line may be the header."""

TYPES = frozenset(
    [
        "float",
        "float32",
        "float64",
        "double",
        "single",
        "real",
        "int",
        "int16",
        "int32",
        "int64",
        "integer",
        "uint8",
        "uint16",
        "uint32",
        "str",
        "string",
        "text",
        "bool",
        "boolean",
        "datetime",
        "object",
        "number",
        "numeric",
        "char",
    ]
)
"""Names of types, of which some programs write a line below the header."""

OTHER_UNITS = frozenset(
    (
        *("v", "mv", "uv", "kv", "volt", "volts", "w", "mw", "kw", "ohm", "hz", "khz", "mhz", "db"),
        *("bar", "mbar", "psi", "rpm", "counts", "count", "cnt", "lsb", "inc", "ticks", "bool"),
        *("m/s", "m/s^2", "m/s2", "g", "rad/s", "deg/s", "°/s", "1/min", "kg", "t", "l/min"),
    )
)
"""Units of quantities that are not read, in lower case, which also occur in a line of units."""

NO_UNIT = frozenset(("", "-", "--", "1", "none", "n/a", "[]", "()", "[-]", "(-)", "%"))
"""Marks of a missing unit in a line of units."""


@dataclass(frozen=True)
class Layout:
    """How a text is read.

    Attributes
    ----------
    separator : Separator
    names, units : tuple of str
        One for every field of a row; empty if none.
    header_line : int or None
        Line of the header, from 1; None if there is none and names are column numbers.
    last_line : int
        Last line above the rows.
    before : tuple of int
        Lines above the header that look like rows.
    """

    separator: Separator
    names: tuple[str, ...]
    units: tuple[str, ...]
    header_line: int | None
    last_line: int
    before: tuple[int, ...] = ()


@dataclass(frozen=True)
class Heading:
    """A header found above rows, with its score."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    place: int
    last: int


def without_brackets(cell: str) -> str:
    """Return a unit without brackets."""
    found = re.fullmatch(r"[\[({<]\s*(.*?)\s*[\])}>]", cell)
    return found[1] if found else cell


def are_units(cells: Sequence[str], share: float = 0.5) -> bool:
    """Whether at least this share of the cells are units or state that there is none."""
    stated = [cell for cell in cells if cell.lower() not in NO_UNIT]
    if stated and all(without_brackets(cell) != cell for cell in stated):
        return True
    bare = [without_brackets(cell) for cell in stated]
    known = sum(is_unit(cell) for cell in bare)
    alike = sum(is_unit(cell) or cell.lower() in OTHER_UNITS for cell in bare)
    return known > 0 and alike >= share * len(bare)


def known_names(cells: Sequence[str], wanted: Collection[str]) -> int:
    """Count the cells that a map names, or that start with a quantity."""

    def known(cell: str) -> bool:
        name = re.sub(r"[^a-z0-9]+", "_", cell.lower())
        return any(name == q or name.startswith(f"{q}_") for q in QUANTITIES)

    return sum(cell in wanted or known(cell) for cell in cells if len(cell) < 200)


class Trial:
    """The lines of a text, cut by one separator."""

    def __init__(
        self, separator: Separator, lines: Sequence[tuple[int, str]], wanted: Collection[str]
    ) -> None:
        self.separator, self.lines, self.wanted = separator, lines, wanted
        self.cells = [separator.fields(line) for _, line in lines]
        self.good = [[is_value(c) or is_missing(c) for c in cells] for cells in self.cells]
        widths = Counter(
            len(cells)
            for cells in self.cells
            if len(cells) > 1 and any(is_value(cell) for cell in cells)
        )
        self.width = max(widths, key=lambda w: (widths[w] * w, w), default=0)
        rows = [good for good in self.good if len(good) == self.width]
        self.numeric = [
            j for j in range(self.width) if 2 * sum(good[j] for good in rows) >= len(rows)
        ]
        self.is_row = [
            self.row(cells, good) for cells, good in zip(self.cells, self.good, strict=True)
        ]
        self.heading = self.find_heading()

    def row(self, cells: Sequence[str], good: Sequence[bool]) -> bool:
        """Whether a line is a typical row."""
        if len(cells) != self.width or not self.numeric:
            return False
        return all(good[j] for j in self.numeric) and any(is_value(cells[j]) for j in self.numeric)

    def score(self) -> tuple[float, int]:
        """Agreement of the lines, and the number of fields."""
        if not any(self.is_row):
            return 0.0, 0
        first = self.heading.last + 1 if self.heading else self.is_row.index(True)
        below = self.is_row[first:]
        agreeing = sum(below) / max(len(below), 1)
        share = len(self.numeric) / self.width
        return share * agreeing * (1.0 if self.heading else 0.5), self.width

    def blocks(self) -> list[tuple[int, int]]:
        """Sections of other lines before a row."""
        found, begin = [], None
        for i, row in enumerate(self.is_row):
            if row and begin is not None:
                found.append((begin, i))
            if row:
                begin = None
            elif begin is None:
                begin = i
        return found

    def find_heading(self) -> Heading | None:
        """Find the header in the first block above rows that has one."""
        for begin, end in self.blocks():
            heading = self.heading_in(begin, end)
            above = any(self.is_row[:begin])
            if heading and (not above or known_names(heading.names, self.wanted)):
                return heading
        return None

    def names_of(self, place: int) -> tuple[str, ...] | None:
        """Names of the fields of a row in a line, if it has them."""
        line = self.lines[place][1]
        best: tuple[int, tuple[str, ...]] | None = None
        for text in dict.fromkeys((line, COMMENT.sub("", line, count=1))):
            names = self.separator.names(text)
            if len(names) > self.width and not any(names[self.width :]):
                names = names[: self.width]
            if len(names) < self.width and self.empty_from(len(names)):
                names += [""] * (self.width - len(names))
            stated = [name for name in names if name]
            if len(names) == self.width - 1 and self.counts_rows():
                names = ["", *names]  # as R writes tables with row names
            named = not any(map(is_value, stated)) or any(name in self.wanted for name in stated)
            if len(names) != self.width or len(stated) < 2 or not named:
                continue
            score = known_names(names, self.wanted)
            if best is None or score > best[0]:
                best = score, tuple(names)
        return best[1] if best else None

    def counts_rows(self) -> bool:
        """Whether the first field of the rows is their number."""
        first = [cells[0].strip().strip('"') for cells in self.cells if len(cells) == self.width]
        numbers = [cell for cell in first if cell.isdecimal()]
        return len(numbers) > 1 and all(int(b) == int(a) + 1 for a, b in pairwise(numbers))

    def empty_from(self, column: int) -> bool:
        """Whether the rows are empty from a column on."""
        rows = [cells for cells, row in zip(self.cells, self.is_row, strict=True) if row]
        return column > 1 and not any(cell.strip() for cells in rows for cell in cells[column:])

    def heading_in(self, begin: int, end: int) -> Heading | None:
        """Find names, and units, among the lines directly above a row."""
        found: list[tuple[tuple[int, int, int], int, tuple[str, ...]]] = []
        for place in range(begin, end):
            names = self.names_of(place)
            if names is not None:
                distinct = len({name for name in names if name})
                found.append(((known_names(names, self.wanted), distinct, place), place, names))
        titles = [entry for entry in found if not self.is_below(entry[2])] or found
        if not titles:
            return None
        _, place, names = max(titles)
        units: tuple[str, ...] = ("",) * self.width
        for _, other, cells in sorted(found, key=lambda line: -abs(line[1] - place)):
            # Lines above the names may contain more than units; those below contain almost nothing
            # else. The nearest line counts.
            share = 1.0 if other < place else 0.5
            if cells != names and are_units(cells, share):
                units = tuple("" if c.lower() in NO_UNIT else without_brackets(c) for c in cells)
        return Heading(names, units, place, end - 1)

    @staticmethod
    def is_below(cells: Sequence[str]) -> bool:
        """Whether a line has units or types, and is not a header."""
        return are_units(cells) or all(cell.lower() in TYPES for cell in cells if cell)


def find_layout(file: str | Path, text: str, whole: bool, wanted: Collection[str] = ()) -> Layout:
    """Find the layout of a text.

    Parameters
    ----------
    file : str or Path
        For messages.
    text : str
        The text, or its beginning; `whole` states which.
    wanted : collection of str
        Names of columns in a map.

    Raises
    ------
    InputError
        If there is no table: empty text, no matching lines, or rows that do not fit the header.
    """
    stated = STATED.fullmatch(text.split("\n", 1)[0])
    candidates = [Separator(stated[1])] if stated else CANDIDATES
    best: Trial | None = None
    for count in LOOKED_AT:
        lines = lines_of(text, whole, count, skipped=1 if stated else 0)
        trials = trials_of(file, candidates, looked_at(lines, count), wanted)
        best = max(trials, key=Trial.score, default=None)
        if best and best.heading and sum(best.is_row) >= min(AGREEING, len(lines)):
            break
    if best is None or best.score()[0] == 0.0:
        if all(COMMENT.match(line) and not re.search("[0-9]", line) for _, line in lines):
            raise InputError(file, "", "an empty file", "a header line and samples")
        return without_rows(file, lines, candidates)
    heading = best.heading
    if heading is None:
        refuse_width(file, best)
        first = best.is_row.index(True)
        names = column_numbers(best.width)
        return Layout(best.separator, names, ("",) * best.width, None, best.lines[first][0] - 1)
    before = [best.lines[i][0] for i in range(heading.place) if best.is_row[i]]
    last = best.lines[heading.last][0]
    place = best.lines[heading.place][0]
    return Layout(best.separator, heading.names, heading.units, place, last, tuple(before))


def column_numbers(width: int) -> tuple[str, ...]:
    """Give columns without a header their numbers as names."""
    return tuple(f"column_{j + 1}" for j in range(width))


def lines_of(text: str, whole: bool, count: int, skipped: int) -> list[tuple[int, str]]:
    """Return lines at the beginning that are not blank, with their numbers."""
    pieces = text.split("\n", BLANK_SHARE * count)
    if len(pieces) > BLANK_SHARE * count or (not whole and len(pieces) > 1):
        pieces.pop()
    numbered = list(enumerate(pieces, start=1))[skipped:]
    return [(number, line) for number, line in numbered if line.strip(" \t\0")]


def looked_at(lines: Sequence[tuple[int, str]], count: int) -> list[tuple[int, str]]:
    """Return the lines at the beginning that are examined."""
    some: list[tuple[int, str]] = []
    length = 0
    for number, line in lines[:count]:
        if len(some) >= LEAST_LINES and length > LOOKED_AT_BYTES * count / LOOKED_AT[0]:
            break
        some.append((number, line))
        length += len(line)
    return some


def trials_of(
    file: str | Path,
    candidates: Sequence[Separator],
    lines: Sequence[tuple[int, str]],
    wanted: Collection[str],
) -> list[Trial]:
    """Cut lines by every separator that they have."""
    found, widest = [], 0
    for separator in candidates:
        most = max((line.count(separator.sign) for _, line in lines), default=0)
        widest = max(widest, most + 1)
        if 0 < most < COLUMNS_MAX:
            try:
                found.append(Trial(separator, lines, wanted))
            except csv.Error as error:
                raise InputError(file, "", str(error), "lines of numbers") from None
    if widest > COLUMNS_MAX and not any(trial.score()[0] for trial in found):
        found_text = f"{widest} columns"
        raise InputError(file, "", found_text, f"at most {COLUMNS_MAX}, as spreadsheets have")
    return found


def refuse_width(file: str | Path, trial: Trial) -> None:
    """Refuse rows whose number of fields differs from that of the names."""
    first = trial.is_row.index(True)
    for place in range(first - 1, -1, -1):
        number, line = trial.lines[place]
        names = trial.separator.names(line)
        if len(names) > 1 and not any(is_value(name) for name in names):
            raise InputError(
                file,
                "",
                f"{trial.width} fields in line {trial.lines[first][0]}",
                f"{len(names)}, as in the header (line {number})",
            )


def without_rows(
    file: str | Path, lines: Sequence[tuple[int, str]], candidates: Sequence[Separator]
) -> Layout:
    """Return the layout of a text without rows: its first line is the header."""
    number, line = next(((n, s) for n, s in lines if not COMMENT.match(s)), lines[0])
    most = max(candidates, key=lambda separator: line.count(separator.sign))
    try:
        names = tuple(most.names(line)[:COLUMNS_MAX])
    except csv.Error as error:
        raise InputError(file, "", str(error), "lines of numbers") from None
    if len(names) == 1 and is_value(names[0]):
        raise InputError(
            file,
            "",
            f"one number in a line (line {number})",
            "a line for every sample: its time, torque and angles, with a separator between them",
        )
    return Layout(most, names, ("",) * len(names), number, number)
