"""Cells: classify the text of a table cell as number, missing, time stamp or other text."""

from __future__ import annotations

import re

from lostmotion.units import is_unit

MISSING = (
    "", "na", "n/a", "#n/a", "<na>", "#na", "nan", "-nan", "+nan", "nan(ind)", "-nan(ind)", "nat",
    "null", "none", "nil", "missing", "-", "--", "---", "*", "****", "?", ".", "...",
    "inf", "+inf", "-inf", "infinity", "+infinity", "-infinity", "∞", "-∞", "#div/0!", "#num!",
    "#value!", "#ref!", "#null!", "1.#ind", "-1.#ind", "1.#inf", "-1.#inf", "+1.#inf", "1.#qnan",
    "-1.#qnan", "1.#snan", "-1.#snan", "ovf", "ovl", "ol", "o.l", "-ol", "+ol", "oor", "ovfl",
    "ovld", "ovrng", "ovrflw", "over", "under", "ovr", "udf", "overflow", "underflow", "overload",
    "overrange", "underrange", "over range", "bad", "invalid", "error", "err", "fault", "no data",
    "nodata", "open", "burnout", "#########", "+++++++", "-------",
)  # fmt: skip
"""Marks of a missing number, in lower case: spreadsheets, C runtimes,
instruments out of range, databases."""

GROUPS = " '’\u00a0\u202f\u2009_"
"""Characters that only separate thousands: blanks of all kinds, apostrophes, underscores."""

NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eEdD][+-]?[0-9]+)?"
"""A number with a decimal point or none."""

COMMA_NUMBER = r"[+-]?(?:[0-9]+,?[0-9]*|,[0-9]+)(?:[eEdD][+-]?[0-9]+)?"
"""A number with a decimal comma or none."""

GROUPED = rf"[+-]?[0-9]{{1,3}}(?:[.,{GROUPS}][0-9]{{3}})+(?:[.,][0-9]*)?(?:[eE][+-]?[0-9]+)?"
"""A number whose thousands are separated."""

CLOCK = (
    r"(?:[0-9]+ days? )?[0-9]{1,2}:[0-9]{2}(?::[0-9]{2}(?::[0-9]{3})?)?(?:[.,][0-9]*)?"
    r"(?: ?[aApP]\.?[mM]\.?)?(?: ?(?:Z|UTC|GMT|[+-][0-9]{2}:?[0-9]{2}))?"
)
DATE = r"[0-9]{1,4}[-./][0-9]{1,2}[-./][0-9]{1,4}\.?|[0-9]{8}"
STAMP = rf"(?:{DATE})(?:[T ,]+{CLOCK}|T[0-9]{{6}}(?:[.,][0-9]*)?Z?)?|{CLOCK}"
"""A date, a time of day, or both."""

MEASURED = re.compile(rf"(?:{NUMBER}|{COMMA_NUMBER})\s*([^\s0-9.,;:+-][^\s0-9;:]{{0,9}})")
"""A number and the text after it."""

VALUE = re.compile(rf"{NUMBER}|{COMMA_NUMBER}|{GROUPED}|{STAMP}")


SIGN_APART = r"^([+-])\s+([0-9.,])"
"""A sign and blanks before the digits."""

SIGN_BEHIND = r"^([0-9.,]*[0-9])-$"
"""A minus sign behind the digits."""


def plain(text: str) -> str:
    """Return a cell without surrounding blanks and quotes, and with a minus sign before digits."""
    cell = text.strip().strip('"').strip().replace("−", "-")
    return re.sub(SIGN_BEHIND, r"-\1", re.sub(SIGN_APART, r"\1\2", cell))


def is_missing(text: str) -> bool:
    """Whether a cell marks a missing number."""
    return plain(text).lower() in MISSING_SET


def is_value(text: str) -> bool:
    """Whether a cell contains a number, with its unit or without, or a time stamp."""
    cell = plain(text)
    return VALUE.fullmatch(cell) is not None or unit_behind(cell) != ""


def unit_behind(cell: str) -> str:
    """Return the unit after the number of a cell; empty if there is none."""
    found = MEASURED.fullmatch(cell)
    return found[1] if found is not None and is_unit(found[1]) else ""


MISSING_SET = frozenset(MISSING)

MISSING_SPELLINGS = sorted(
    {spelt for word in MISSING for spelt in (word, word.upper(), word.capitalize())}
    | {"NaN", "NaT"}
)
"""The same in the upper and lower case that programs write, for readers that are case sensitive."""
