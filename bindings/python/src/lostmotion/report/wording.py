"""Formatting of numbers, units and names for display."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from lostmotion.effects.library import library
from lostmotion.report.svg import signs
from lostmotion.units import ANGULAR_SPEED, ARCMIN, ARCSEC, plain_number, split_unit

RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

SMALLEST, LARGEST = 1e-3, 1e6
"""Range of numbers written without a power of ten."""

GROUPED = 10_000
"""Least number whose digits are written in groups of three."""

NOTHING = 1e-12
"""Smaller numbers are rounding errors, written as zero."""

SURE = 0.001
"""Smaller p-values are written as "p < " this value."""

ANGLES = ((600 * ARCSEC, ARCSEC, "arcsec"), (600 * ARCMIN, ARCMIN, "arcmin"))
"""Largest angle for each unit; degrees above."""

DEGREE = 60 * ARCMIN

SYMBOLS = {"Nm": "N·m", "mNm": "mN·m", "um": "µm", "C": "°C"}

PEOPLE = {"stribeck": "Stribeck", "coulomb": "Coulomb", "hertz": "Hertz"}
"""Names of people among the names of effects and of their values."""

SPEEDS = {"rad_s": "rad_per_s"}
"""Suffixes in the library's effects without `per`."""


CROSS_VALIDATED = {
    "run": "leave-one-run-out",
    "half of the run": "leave-half-out",
    "reading": "leave-one-out",
    "runs not fitted": "predicted",
}
"""Name of a cross-validated error by what was left out of the fit."""

NOISE_FLOOR = "noise floor"
"""Reference of an error in `diagnose` and `fit`; `compare` uses the repeatability instead."""

NOISE_FLOOR_IS = "noise within runs, and run-to-run scatter of stiffness, friction and gap"


def words(name: str) -> str:
    """Write a name as words."""
    return " ".join(PEOPLE.get(word, word) for word in name.split("_"))


def parameter(name: str) -> str:
    """Describe a value of an effect by its name without the unit."""
    return parameter_words().get(name) or words(name)


@cache
def parameter_words() -> dict[str, str]:
    """Descriptions on the cards of values whose names are not sufficient."""
    values = [value for effect in library().values() for value in effect.values]
    return {split_unit(value.name)[0]: value.words for value in values if value.words}


def written(value: float, digits: int = 3) -> str:
    """Write a number with a number of significant digits, in groups or with a power of ten."""
    size = abs(float(f"{value:.{digits}g}"))
    if size and not SMALLEST <= size < LARGEST:
        mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
        return signs(f"{float(mantissa):g}") + f"·10{str(int(power)).translate(RAISED)}"
    return signs(grouped(plain_number(value, digits)))


def with_zeros(value: float, digits: int = 3) -> str:
    """Write a number like `written`, with trailing zeros: 1.50 next to 1.66."""
    size = float(f"{value:.{digits}g}")
    if not SMALLEST <= abs(size) < LARGEST:
        return written(value, digits)
    places = max(0, digits - 1 - math.floor(math.log10(abs(size))))
    return signs(grouped(f"{size:.{places}f}"))


def grouped(text: str) -> str:
    """Put the digits of a large number into groups of three, with spaces that do not break."""
    whole, point, rest = text.partition(".")
    if abs(float(text)) >= GROUPED:
        whole = f"{int(whole):,}".replace(",", "\u202f")
    return whole + point + rest


def chance(p: float) -> str:
    """Write a p-value."""
    return f"p < {SURE:g}" if p < SURE else f"p {p:.3f}"


def unit_text(symbol: str) -> str:
    """Write a unit suffix such as ``rad_per_Nm`` with its signs."""
    above, _, below = re.sub("^per_", "1_per_", SPEEDS.get(symbol, symbol)).partition("_per_")
    top, bottom = ("·".join(map(_unit, part.split("_"))) for part in (above, below))
    if not bottom:
        return top
    return f"{top}/({bottom})" if "·" in bottom else f"{top}/{bottom}"


def with_signs(sentence: str) -> str:
    """Write newton metres in a sentence of an answer as on the page."""
    return re.sub(r"\bNm\b", SYMBOLS["Nm"], sentence)


def _unit(token: str) -> str:
    return SYMBOLS.get(token) or re.sub(
        r"(?<=\D)\d+$", lambda found: found[0].translate(RAISED), token
    )


def split_quantity(name: str, value: float) -> tuple[str, float, str]:
    """Split a name with a unit into words, a factor for its values, and their unit.

    Angles in rad become arc seconds, minutes or degrees, by the size of `value`; speeds stay.
    """
    stem, unit = split_unit(name)
    symbol = unit.symbol if unit is not None else ""
    if re.match("1_(?!per_)", symbol):  # the first of several that are numbered
        stem, symbol = f"{stem}_1", symbol.removeprefix("1_")
    head, per, rest = symbol.partition("_per_")
    if head != "rad" or (unit is not None and unit.dimension == ANGULAR_SPEED):
        return parameter(stem), 1.0, unit_text(symbol)
    for most, angle, shown in ANGLES:
        if abs(value) < most:
            return parameter(stem), 1.0 / angle, unit_text(shown + per + rest)
    return parameter(stem), 1.0 / DEGREE, unit_text("deg" + per + rest)


def event_text(event: Mapping[str, Any]) -> str:
    """Describe a sudden event of an answer."""
    size = plain_number(event["size_arcsec"])
    return f"run {event['run']} at {event['time_s']:.6g} s, {size} arcsec"


def explained_text(answer: Mapping[str, Any]) -> str:
    """Write the explained share of the variance of a comparison."""
    share = answer["explained_share"]
    return f"{100 * share:.2f} %" if share > 0 else "nothing"


def angle_text(arcsec: float) -> str:
    """Write an angle in a unit that suits its size."""
    _, factor, unit = split_quantity("angle_rad", arcsec * ARCSEC)
    return f"{written(arcsec * ARCSEC * factor)} {unit}"


def quantity(name: str, value: float) -> str:
    """Write a named number: name, value, unit."""
    stem, factor, unit = split_quantity(name, value)
    return f"{stem} {written(value * factor)} {unit}".rstrip()


AT_BOUND = "at its bound"
"""Text for a value whose best estimate is at or beyond a bound."""

TOO_SMALL = "too small to count"
"""Text for an effect that is significant but smaller than the accuracy assumed of any model."""

NOT_FITTED = "fixed: saturation limit"
"""Text for a fixed value that limits an effect."""


OF_FORM = "form of the hysteresis"
"""What an effect is confounded with that is a function of the torque and its history."""


def confounded_with(candidate: Mapping[str, Any]) -> list[str]:
    """List what a candidate effect of an answer is confounded with."""
    return [*candidate.get("confused_with", ()), *([OF_FORM] if candidate.get("of_form") else [])]


def named_numbers(
    values: Mapping[str, float], at_bound: Sequence[str] = (), not_fitted: Sequence[str] = ()
) -> list[str]:
    """Write the named numbers that are not zero or are at a bound, and mark the latter."""

    def known(name: str) -> str:
        if name in not_fitted:
            return f" ({NOT_FITTED})"
        return f" ({AT_BOUND})" if name in at_bound else ""

    return [
        quantity(name, value) + known(name)
        for name, value in values.items()
        if abs(value) > NOTHING or name in at_bound
    ]
