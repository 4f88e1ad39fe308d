"""Start a search from the designs of an earlier one."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lostmotion.design.engine import engine
from lostmotion.design.statements import Statements
from lostmotion.errors import InputError
from lostmotion.files import read_bytes
from lostmotion.keys import as_in_file

FRONT = "front.csv"
"""File of the designs of a search."""

NEAREST = "nearest.csv"
"""File of the nearest point if no design satisfies all limits."""

ROUNDING = 1e-9
"""Relative rounding tolerance of a written bound of a range."""


def begin_with(out: Statements, folder: str) -> None:
    """Start with the front of an earlier search, as far as it is within the ranges of this one.

    If that search found no design, start with the nearest point.
    """
    place = "search.start_from"
    front = Path(out.file).parent / folder / FRONT
    columns, rows = read_front(out, place, front)
    nearest = front.with_name(NEAREST)
    if not rows and nearest.is_file():
        columns, rows = read_front(out, place, nearest)
    statements = [line.split() for line in out.lines]
    choices = [words[1:] for words in statements if words[0] == "choose"]
    ranges = [words[1:] for words in statements if words[0] in ("range", "whole")]
    for name, *_ in choices + ranges:
        if name not in columns:
            raise out.refuse(
                place, f"{front} without a column {name}", "a search with the same variables"
            )
    starts = []
    for row in rows:
        words = [chosen(row[name], values) for name, *values in choices]
        words += [inside(row[name], low, high) for name, low, high in ranges]
        if None not in words:
            starts.append(words)
    if not starts:
        found = f"no design of {front} in the ranges and choices"
        raise out.refuse(place, found, "the folder of a search with designs in these ranges")
    most = min(engine()[1].LM_START_MAX, len(starts))
    for i in range(most):  # spread over the front, including both ends
        out.say(place, "start", *starts[i * (len(starts) - 1) // max(most - 1, 1)])


def read_front(
    out: Statements, place: str, front: Path
) -> tuple[Sequence[str], list[dict[str, Any]]]:
    """Columns and rows of the designs of a search."""
    expected = f"the folder of a search, with its {FRONT}"
    try:
        found = "no file" if not front.is_file() else ""
        text = "" if found else read_bytes(front, expected).decode("utf-8-sig")
        lines = csv.DictReader(text.splitlines())
        rows = list(lines)
    except (InputError, ValueError, csv.Error) as error:
        found = error.found if isinstance(error, InputError) else str(error)
    if found:
        raise out.refuse(place, f"{as_in_file(str(front))} ({found})", expected)
    return lines.fieldnames or (), rows


def chosen(written: str | None, values: Sequence[str]) -> str | None:
    """Find the word of a choice that has the value of a cell."""
    number = _number_of(written)
    for word in values:
        if word == written or (number is not None and number == _number_of(word)):
            return word
    return None


def inside(written: str | None, low: str, high: str) -> str | None:
    """Return a cell as a value of a range; None outside."""
    number = _number_of(written)
    least, most = float(low), float(high)
    beyond = ROUNDING * (most - least)
    if number is None or not least - beyond <= number <= most + beyond:
        return None
    return repr(min(max(number, least), most))


def _number_of(written: str | None) -> float | None:
    try:
        number = float(written or "")
    except ValueError:
        return None
    return number if math.isfinite(number) else None
