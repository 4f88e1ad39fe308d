"""Numerals: convert columns of text to numbers, with any decimal and thousands separator.

``3,767`` is 3.767 with a decimal comma, and 3767 with a comma for thousands. The rest of the file
decides: unambiguous numbers, digits without a mark, and the steps from row to row. If nothing
decides, or the evidence is contradictory, both readings are stated and the file is refused.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray, WholeArray
from lostmotion.errors import InputError, shorten
from lostmotion.recordings.cells import (
    COMMA_NUMBER,
    GROUPS,
    MISSING,
    NUMBER,
    SIGN_APART,
    SIGN_BEHIND,
)
from lostmotion.recordings.findings import Finding
from lostmotion.recordings.from_arrow import floats_of, integers_of, mask_of

AGREEING_MIN = 2
"""Least number of cells that agree on the meaning of a mark: a single damaged number looks like
another format."""

TEXT_SHARE = 0.1
"""Largest share of text in a column that is set aside. Chosen: messages of a failing sensor are
few; if every tenth cell is text, the column does not contain numbers.
"""

JUMP_RATIO = 2.0
"""Least ratio of the largest steps of the wrong and the correct reading. From 999 to 1.000 the
wrong reading jumps by at least half its range; the steps of a sampled channel are far smaller."""

BILLION = 1_000_000_000

DIGITS_OF_STAMP = r"^(?P<whole>[0-9]{1,10})(?:[.,](?P<rest>[0-9]{1,9}))?$"
"""Seconds since an epoch, which with nine decimals fit into 64 bits."""

POINT_EXPECTED = "a number with a decimal point"

NUMBER_EXPECTED = "a number, or nothing, NA or nan where there is none"

SAME_MEANING = "numbers with a decimal point and without separators of thousands"


def patterns(mark: str) -> dict[str, str]:
    """Formats of a number with a mark, as regular expressions."""
    m, other = ("[.]", ",") if mark == "." else (",", "[.]")
    end = r"(?:[eEdD][+-]?[0-9]+)"
    return {
        # Not three digits after the mark, or a beginning that is not a group of thousands, or an
        # exponent.
        "decimal": rf"^[+-]?(?:[0-9]*{m}(?:[0-9]{{0,2}}|[0-9]{{4,}})|(?:0[0-9]*|[0-9]{{4,}}|)"
        rf"{m}[0-9]{{3}}){end}?$|^[+-]?[0-9]+{m}[0-9]+{end}$",
        "either": rf"^[+-]?[1-9][0-9]{{0,2}}{m}[0-9]{{3}}$",
        "groups": rf"^[+-]?[1-9][0-9]{{0,2}}(?:{m}[0-9]{{3}}){{2,}}$",
        "both": rf"^[+-]?[1-9][0-9]{{0,2}}(?:{other}[0-9]{{3}})+{m}[0-9]*$",
    }


BLANK_GROUPS = rf"^[+-]?[0-9]{{1,3}}(?:[{GROUPS}][0-9]{{3}})+(?:[.,][0-9]*)?$"
"""Thousands separated by a character that has no other meaning."""

OTHER_MARK = {".": ",", ",": "."}


class Texts:
    """The cells of a text column, without the unit after every number."""

    def __init__(self, column: Any, behind: str = "") -> None:
        import pyarrow as pa
        import pyarrow.compute as pc

        if isinstance(column, pa.ChunkedArray):
            column = column.combine_chunks()
        text = pc.fill_null(column.cast(pa.string()), "")
        self.text = pc.replace_substring(pc.utf8_trim_whitespace(text), "−", "-")
        if behind:
            self.text = pc.replace_substring_regex(self.text, rf"\s*{re.escape(behind)}$", "")
        self.text = pc.replace_substring_regex(self.text, SIGN_APART, r"\1\2")
        # A single minus sign behind digits is a damaged line, unless other numbers have it too.
        if not pc.any(pc.match_substring_regex(self.text, "^-[0-9.,]")).as_py():
            self.text = pc.replace_substring_regex(self.text, SIGN_BEHIND, r"-\1")
        self.pc, self.pa = pc, pa
        self.missing = self.mask(
            pc.is_in(pc.utf8_lower(self.text), value_set=pa.array(MISSING, self.text.type))
        )
        self.integer = self.form(r"^[+-]?[0-9]+$")

    @staticmethod
    def mask(values: Any) -> BoolArray:
        """Make an array of NumPy from one of Arrow."""
        return mask_of(values)

    def form(self, pattern: str) -> BoolArray:
        """Mark the cells of a format."""
        return self.mask(self.pc.match_substring_regex(self.text, pattern))

    def of(self, mark: str) -> dict[str, BoolArray]:
        """Mark the cells in which a mark occurs."""
        kept: dict[str, dict[str, BoolArray]] = self.__dict__.setdefault("forms", {})
        if mark not in kept:
            kept[mark] = {name: self.form(p) for name, p in patterns(mark).items()}
        return kept[mark]

    @cached_property
    def blank_groups(self) -> BoolArray:
        """Mark the numbers with thousands separated by other characters."""
        return self.form(BLANK_GROUPS)

    @cached_property
    def plain(self) -> BoolArray:
        """Mark the numbers written with a decimal point."""
        return self.form(f"^(?:{NUMBER})$")

    def certain(self, mark: str) -> BoolArray:
        """Mark the numbers in which a mark can only be the decimal separator."""
        other = self.of(OTHER_MARK[mark])
        forms = self.of(mark)
        return np.asarray(forms["decimal"] | forms["both"] | other["groups"])

    def numbers(self, mark: str, grouped: bool) -> FloatArray:
        """Read all cells, NaN if not a number in this style."""
        pc, pa = self.pc, self.pa
        text = self.text
        if grouped or bool(np.any(self.blank_groups)):
            signs = f"[{GROUPS}]" if not grouped else f"[{GROUPS}{OTHER_MARK[mark]}]"
            text = pc.replace_substring_regex(text, rf"({signs})([0-9]{{3}})", r"\2")
        valid = self.mask(
            pc.match_substring_regex(text, f"^(?:{NUMBER if mark == '.' else COMMA_NUMBER})$")
        )
        if mark == ",":
            text = pc.replace_substring(text, ",", ".")
        text = pc.replace_substring_regex(text, "[dD]", "e")
        text = pc.if_else(pa.array(valid), text, pa.scalar(None, text.type))
        return floats_of(text)

    def whole_numbers(self) -> Any:
        """Read the whole numbers as integers of 64 bits; None where one has more digits."""
        good = self.pc.if_else(
            self.pa.array(self.integer), self.text, self.pa.scalar(None, self.text.type)
        )
        try:
            return self.pc.replace_substring_regex(good, "^[+]", "").cast(self.pa.int64())
        except self.pa.ArrowInvalid:
            return None

    def billionths(self) -> tuple[WholeArray, BoolArray] | None:
        """Read all cells as integers in units of 1e-9; None if a cell has more decimals."""
        pc = self.pc
        parts = pc.extract_regex(self.text, DIGITS_OF_STAMP)
        known = self.mask(pc.is_valid(parts))
        if not bool(np.all(known | self.missing)):
            return None
        whole = pc.fill_null(pc.struct_field(parts, [0]), "0")
        rest = pc.utf8_rpad(pc.fill_null(pc.struct_field(parts, [1]), ""), 9, "0")
        ones, billionths = integers_of(whole), integers_of(rest)
        return np.asarray(ones * BILLION + billionths, dtype=np.int64), known


@dataclass(frozen=True)
class NumberStyle:
    """Number style of a column: decimal mark, with or without groups."""

    mark: str
    grouped: bool
    told: str = ""
    """Evidence that decided an ambiguous mark."""


def largest_jump(values: FloatArray) -> float:
    """Largest step as a share of the range; infinite if constant."""
    known = values[np.isfinite(values)]
    if known.size < 3 or np.ptp(known) == 0:
        return np.inf
    return float(np.max(np.abs(np.diff(known))) / np.ptp(known))


def decide_column(texts: Texts, mark: str) -> NumberStyle | None:
    """Meaning of a mark before three digits from the column alone; None if undecided."""
    import pyarrow.compute as pc

    whole = texts.integer & ~texts.form(r"^[+-]?0+$")
    if bool(np.any(texts.form(r"^[+-]?[0-9]{4,}$"))):
        return NumberStyle(mark, False, "numbers above 999 without it")
    if not bool(np.any(whole)):
        return None
    either = texts.of(mark)["either"]
    as_decimals = largest_jump(texts.numbers(mark, False))
    as_groups = largest_jump(texts.numbers(OTHER_MARK[mark], True))
    if as_groups * JUMP_RATIO <= as_decimals:
        return NumberStyle(OTHER_MARK[mark], True, "the steps from row to row")
    if as_decimals * JUMP_RATIO <= as_groups:
        return NumberStyle(mark, False, "the steps from row to row")
    ends = texts.mask(pc.match_substring_regex(texts.text, "0$")) & either
    if np.count_nonzero(ends) >= AGREEING_MIN:
        # Decimals that end in 0 have a fixed number of digits, and then every number has them.
        return NumberStyle(OTHER_MARK[mark], True, "numbers below 1000 without it")
    return None


def number_styles(
    file: str, columns: Mapping[str, Texts], place: Callable[[int], str]
) -> dict[str, NumberStyle]:
    """Decide the number styles of the columns of a file.

    Raises
    ------
    InputError
        If a mark is ambiguous; states both readings.
    """
    votes = {
        name: {mark: int(np.count_nonzero(texts.certain(mark))) for mark in ".,"}
        for name, texts in columns.items()
    }
    total = {mark: sum(vote[mark] for vote in votes.values()) for mark in ".,"}
    settled = {mark: total[mark] >= AGREEING_MIN for mark in ".,"}
    readings = {}
    for name, texts in columns.items():
        vote = votes[name]
        if vote["."] or vote[","]:
            mark = "." if vote["."] >= vote[","] else ","
            if not settled[mark]:
                mark = "."
        else:
            mark = by_the_rest(file, name, texts, settled, place)
        other = texts.of(OTHER_MARK[mark])
        grouped = other["either"] | other["groups"] | texts.of(mark)["both"]
        many = int(np.count_nonzero(grouped)) >= AGREEING_MIN
        contradicted = vote[OTHER_MARK[mark]] > np.count_nonzero(
            other["groups"] | texts.of(mark)["both"]
        )
        told = f"'{OTHER_MARK[mark]}' separates thousands" if many and not contradicted else ""
        readings[name] = NumberStyle(mark, bool(told), told)
    return readings


def by_the_rest(
    file: str,
    name: str,
    texts: Texts,
    settled: Mapping[str, bool],
    place: Callable[[int], str],
) -> str:
    """Decide the decimal mark of a column without a certain one."""
    either = {mark: texts.of(mark)["either"] for mark in ".,"}
    marked = [mark for mark in ".," if np.any(either[mark])]
    if not marked:
        return "."
    doubtful = marked[-1]
    count = int(np.count_nonzero(either[doubtful]))
    own = decide_column(texts, doubtful) if len(marked) == 1 else None
    rest = {mark for mark in ".," if settled[mark]}
    of_file = next(iter(rest)) if len(rest) == 1 else None
    if len(marked) == 1 and count >= AGREEING_MIN:
        if of_file is not None and (own is None or own.mark == of_file):
            return of_file
        if of_file is None and own is not None:
            return own.mark
        if of_file is None and doubtful == ".":
            return "."  # as this package writes it, and nothing contradicts it
    elif count < AGREEING_MIN and (of_file == "." or doubtful == "."):
        return "."
    row = int(np.flatnonzero(either[doubtful])[0])
    cell = str(texts.text[row])
    decimals, thousands = cell.replace(doubtful, "."), cell.replace(doubtful, "")
    raise InputError(
        file, name, f"'{cell}' in {place(row)}, which is {decimals} or {thousands}", SAME_MEANING
    )


def expected_number(text: str) -> str:
    """Describe what is expected instead of a text that is not a number."""
    if text.count(",") == 1 and "." not in text:
        return POINT_EXPECTED
    return NUMBER_EXPECTED


def refuse_text(
    file: str, name: str, texts: Texts, bad: BoolArray, rows: int, place: Callable[[int], str]
) -> None:
    """Refuse a column with more text than damage explains."""
    if np.count_nonzero(bad) > TEXT_SHARE * rows:
        row = int(np.flatnonzero(bad)[0])
        cell = str(texts.text[row])
        raise InputError(file, name, f"'{shorten(cell)}' in {place(row)}", expected_number(cell))


def note_text(
    file: str, name: str, texts: Texts, bad: BoolArray, place: Callable[[int], str]
) -> Finding:
    """Report the cells of a column that are not numbers."""
    rows = np.flatnonzero(bad)
    cell = shorten(str(texts.text[int(rows[0])]))
    more = f", and {rows.size - 1} more" if rows.size > 1 else ""
    action = f"no numbers ('{cell}' in {place(int(rows[0]))}{more}); counted as missing"
    return Finding("text", file, name, None, int(rows.size), action)
