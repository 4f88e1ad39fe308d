"""Parsing of option values."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

from lostmotion.errors import InputError

if TYPE_CHECKING:
    from lostmotion.core import Bits
    from lostmotion.effects.effect import Effect


def effects_of(arguments: argparse.Namespace) -> dict[str, Effect]:
    """Return the library's effects and the user's own."""
    from lostmotion.effects.library import library

    return {**library(), **own_effects(arguments)}


def own_effects(arguments: argparse.Namespace, bits: Bits = 64) -> dict[str, Effect]:
    """Return the user effects; those in C must be compiled in the given precision."""
    found: dict[str, Effect] = {}
    for file in arguments.effects:
        from lostmotion.effects.library import library
        from lostmotion.effects.loading import load

        for name, effect in load(file, bits).items():
            if name in library() or name in found:
                raise InputError(file, name, "the name of another effect", "a unique name")
            found[name] = effect
    return found


def read_number(option: str, text: str, limit: float) -> float:
    """Read a number of the command line with magnitude at most `limit`."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(option, "", f"'{text}'", "a number")
    if abs(value) > limit:
        raise InputError(option, "", f"'{text}'", f"a number from {-limit:g} to {limit:g}")
    return value


RATIO_MAX = 1e4
"""Largest ratio that the option accepts."""


def ratio_of(text: str) -> float:
    """Read the ratio of a drive, of either sign."""
    ratio = read_number("--ratio", text, math.inf)
    if not 1.0 <= abs(ratio) <= RATIO_MAX:
        expected = f"1 to {RATIO_MAX:g}, or {-RATIO_MAX:g} to -1"
        raise InputError("--ratio", "", f"'{text}'", expected)
    return ratio


def whole_number(option: str, text: str, low: int, high: int) -> int:
    """Read an integer of the command line."""
    digits = text.isascii() and text.isdecimal() and len(text) <= len(str(high))
    if not digits or not low <= int(text) <= high:
        raise InputError(option, "", f"'{text}'", f"an integer from {low} to {high}")
    return int(text)
