"""Units as suffixes of names: ``torque_Nm``, ``module_mm``, ``K1_Nm_per_rad``.

A suffix is a product of unit symbols, with ``per`` for division and a trailing digit for a power:
``Nm_per_rad``, ``N_per_mm2``, ``kg_m2``. Dimensions are computed, not listed, so any unit of the
right dimension is accepted. A unit is never guessed: a name without a suffix has no unit.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

from lostmotion.arrays import FloatArray

Dimension = tuple[int, int, int, int, int, int]
"""Powers of force, length, time, angle, temperature and electric current."""

DIMENSIONLESS: Dimension = (0, 0, 0, 0, 0, 0)
FORCE: Dimension = (1, 0, 0, 0, 0, 0)
LENGTH: Dimension = (0, 1, 0, 0, 0, 0)
TIME: Dimension = (0, 0, 1, 0, 0, 0)
ANGLE: Dimension = (0, 0, 0, 1, 0, 0)
TEMPERATURE: Dimension = (0, 0, 0, 0, 1, 0)
TORQUE: Dimension = (1, 1, 0, 0, 0, 0)
TORSIONAL_STIFFNESS: Dimension = (1, 1, 0, -1, 0, 0)
STIFFNESS: Dimension = (1, -1, 0, 0, 0, 0)
COMPLIANCE: Dimension = (-1, 1, 0, 0, 0, 0)
STRESS: Dimension = (1, -2, 0, 0, 0, 0)
BENDING_STIFFNESS: Dimension = (1, 2, 0, 0, 0, 0)
ANGULAR_SPEED: Dimension = (0, 0, -1, 1, 0, 0)

CURRENT: Dimension = (0, 0, 0, 0, 0, 1)
TORQUE_CONSTANT: Dimension = (1, 1, 0, 0, 0, -1)

ZERO_CELSIUS_K = 273.15

Number = TypeVar("Number", float, FloatArray)


@dataclass(frozen=True)
class Unit:
    """A unit: ``SI value = scale * value + offset``.

    The SI base here is N, m, s, rad, K and A.
    """

    symbol: str
    dimension: Dimension
    scale: float
    offset: float = 0.0

    def to_si(self, value: Number) -> Number:
        """Convert a value, or an array of values, to SI."""
        if self.offset:
            return value * self.scale + self.offset
        return value * self.scale

    def from_si(self, value: Number) -> Number:
        """Convert a value, or an array of values, from SI."""
        return (value - self.offset) / self.scale


def _atoms() -> dict[str, Unit]:
    table: list[tuple[str, Dimension, float, float]] = [
        ("rad", ANGLE, 1.0, 0.0),
        ("mrad", ANGLE, 1e-3, 0.0),
        ("urad", ANGLE, 1e-6, 0.0),
        ("deg", ANGLE, math.pi / 180, 0.0),
        ("arcmin", ANGLE, math.pi / 10_800, 0.0),
        ("arcsec", ANGLE, math.pi / 648_000, 0.0),
        ("mdeg", ANGLE, math.pi / 180_000, 0.0),
        ("gon", ANGLE, math.pi / 200, 0.0),
        ("rev", ANGLE, 2 * math.pi, 0.0),
        ("N", FORCE, 1.0, 0.0),
        ("mN", FORCE, 1e-3, 0.0),
        ("kN", FORCE, 1e3, 0.0),
        ("lbf", FORCE, 4.4482216152605, 0.0),
        ("kgf", FORCE, 9.80665, 0.0),
        ("m", LENGTH, 1.0, 0.0),
        ("cm", LENGTH, 1e-2, 0.0),
        ("mm", LENGTH, 1e-3, 0.0),
        ("um", LENGTH, 1e-6, 0.0),
        ("nm", LENGTH, 1e-9, 0.0),
        ("s", TIME, 1.0, 0.0),
        ("ms", TIME, 1e-3, 0.0),
        ("us", TIME, 1e-6, 0.0),
        ("ns", TIME, 1e-9, 0.0),
        ("min", TIME, 60.0, 0.0),
        ("h", TIME, 3600.0, 0.0),
        ("day", TIME, 86_400.0, 0.0),
        ("K", TEMPERATURE, 1.0, 0.0),
        ("C", TEMPERATURE, 1.0, ZERO_CELSIUS_K),
        ("F", TEMPERATURE, 5 / 9, ZERO_CELSIUS_K - 32 * 5 / 9),
        ("Nm", TORQUE, 1.0, 0.0),
        ("mNm", TORQUE, 1e-3, 0.0),
        ("uNm", TORQUE, 1e-6, 0.0),
        ("kNm", TORQUE, 1e3, 0.0),
        ("Ncm", TORQUE, 1e-2, 0.0),
        ("Nmm", TORQUE, 1e-3, 0.0),
        ("kgfm", TORQUE, 9.80665, 0.0),
        ("kgfcm", TORQUE, 0.0980665, 0.0),
        ("gfcm", TORQUE, 0.0000980665, 0.0),
        ("lbfin", TORQUE, 4.4482216152605 * 0.0254, 0.0),
        ("ozfin", TORQUE, 4.4482216152605 * 0.0254 / 16, 0.0),
        ("lbfft", TORQUE, 4.4482216152605 * 0.3048, 0.0),
        ("Pa", STRESS, 1.0, 0.0),
        ("kPa", STRESS, 1e3, 0.0),
        ("MPa", STRESS, 1e6, 0.0),
        ("GPa", STRESS, 1e9, 0.0),
        ("kg", (1, -1, 2, 0, 0, 0), 1.0, 0.0),
        ("g", (1, -1, 2, 0, 0, 0), 1e-3, 0.0),
        ("Hz", (0, 0, -1, 0, 0, 0), 1.0, 0.0),
        ("A", CURRENT, 1.0, 0.0),
        ("mA", CURRENT, 1e-3, 0.0),
        ("rpm", ANGULAR_SPEED, 2 * math.pi / 60, 0.0),
    ]
    return {
        symbol: Unit(symbol, dimension, scale, offset) for symbol, dimension, scale, offset in table
    }


ATOMS = _atoms()

_EXAMPLES: dict[Dimension, str] = {
    DIMENSIONLESS: "no unit",
    ANGLE: "an angle (rad, deg, arcmin, arcsec, rev, mrad or urad)",
    TORQUE: "a torque (Nm, mNm, kNm or Ncm)",
    TIME: "a time (s, ms, us, min or h)",
    TEMPERATURE: "a temperature (C, K or F)",
    LENGTH: "a length (mm, um or m)",
    FORCE: "a force (N or kN)",
    TORSIONAL_STIFFNESS: "a torsional stiffness (Nm_per_rad, Nm_per_arcmin or Nm_per_deg)",
    STIFFNESS: "a stiffness (N_per_mm, N_per_um or N_per_m)",
    COMPLIANCE: "a compliance (mm_per_N or um_per_N)",
    STRESS: "a stress (MPa, GPa, Pa or N_per_mm2)",
    BENDING_STIFFNESS: "a bending stiffness (N_mm2 or N_m2)",
    ANGULAR_SPEED: "an angular speed (rad_per_s or rpm)",
    CURRENT: "an electric current (A or mA)",
    TORQUE_CONSTANT: "a torque constant (Nm_per_A or mNm_per_A)",
}


def dimension_name(dimension: Dimension) -> str:
    """Name a dimension together with units that have it."""
    if dimension in _EXAMPLES:
        return _EXAMPLES[dimension]
    names = ("N", "m", "s", "rad", "K", "A")
    parts = [f"{name}^{power}" for name, power in zip(names, dimension, strict=True) if power]
    return "a unit of dimension " + " ".join(parts)


@lru_cache(maxsize=1024)
def parse_unit(symbol: str) -> Unit | None:
    """Read a unit suffix such as ``mNm`` or ``N_per_mm2``; None when it is not one.

    A temperature alone is absolute, in a compound unit it is a difference (``um_per_C``). No
    quantity is an angle times a time: ``rad_s``, used for fields in C, means ``rad_per_s``.
    """
    if symbol in ATOMS:
        return ATOMS[symbol]
    if "_" not in symbol and not symbol[-1:].isdigit():
        return None
    dimension = [0, 0, 0, 0, 0, 0]
    scale = 1.0
    sign = 1
    expects_unit = True
    for token in symbol.split("_"):
        if token == "per":
            if sign < 0:
                return None
            sign = -1
            expects_unit = True
            continue
        if token == "1" and sign > 0:
            expects_unit = False
            continue
        match = re.fullmatch(r"([A-Za-z]+)([2-4]?)", token)
        if match is None or match[1] not in ATOMS:
            return None
        atom = ATOMS[match[1]]
        power = sign * int(match[2] or 1)
        dimension = [d + power * a for d, a in zip(dimension, atom.dimension, strict=True)]
        scale *= atom.scale**power
        expects_unit = False
    if expects_unit:
        return None
    f, le, t, a, k, i = dimension
    if (f, le, a, k, i) == (0, 0, 1, 0, 0) and t > 0 and sign > 0:
        angle, _, times = symbol.partition("_")
        return parse_unit(f"{angle}_per_{times}")
    return Unit(symbol, (f, le, t, a, k, i), scale)


SPELLINGS = {
    **dict.fromkeys(("radian", "radians", "rads"), "rad"),
    **dict.fromkeys(("millirad", "millirads", "milliradian", "milliradians"), "mrad"),
    **dict.fromkeys(("µrad", "microrad", "microradian", "microradians"), "urad"),
    **dict.fromkeys(("°", "degree", "degrees", "degs", "angulardegrees"), "deg"),
    **dict.fromkeys(("m°", "millideg", "millidegs", "millidegree", "millidegrees"), "mdeg"),
    **dict.fromkeys(("'", "′", "arcmins", "arcminute", "arcminutes", "amin"), "arcmin"),
    **dict.fromkeys(("gons", "grad", "grads", "gradian", "gradians"), "gon"),
    **dict.fromkeys(('"', "″", "arcsecs", "arcsecond", "arcseconds", "asec"), "arcsec"),
    **dict.fromkeys(("revs", "revolution", "revolutions", "turn", "turns", "rotations"), "rev"),
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("msec", "msecs", "millisec", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("µs", "usec", "usecs", "µsec", "microsecond", "microseconds"), "us"),
    **dict.fromkeys(("nsec", "nsecs", "nanosec", "nanosecond", "nanoseconds"), "ns"),
    **dict.fromkeys(("mins", "minute", "minutes"), "min"),
    **dict.fromkeys(("d", "days"), "day"),
    **dict.fromkeys(("hr", "hrs", "hour", "hours"), "h"),
    **dict.fromkeys(("°c", "℃", "degc", "degreec", "degreesc", "celsius", "degreescelsius"), "C"),
    **dict.fromkeys(("°f", "℉", "degf", "degreesf", "fahrenheit", "degreesfahrenheit"), "F"),
    **dict.fromkeys(("°k", "kelvin", "kelvins", "degk"), "K"),
    **dict.fromkeys(("newtonmeter", "newtonmeters", "newtonmetre", "newtonmetres"), "Nm"),
    **dict.fromkeys(("newtonm", "nmeter"), "Nm"),
    **dict.fromkeys(("cnm",), "Ncm"),
    **dict.fromkeys(("kgm", "kpm", "mkgf", "mkp"), "kgfm"),
    **dict.fromkeys(("kgcm", "cmkgf", "kpcm"), "kgfcm"),
    **dict.fromkeys(("gcm",), "gfcm"),
    **dict.fromkeys(("inlb", "inlbs", "inlbf", "lbin", "lbsin", "inchpounds"), "lbfin"),
    **dict.fromkeys(("ftlb", "ftlbs", "ftlbf", "lbft", "lbsft", "footpounds"), "lbfft"),
    **dict.fromkeys(("inoz", "inozf", "ozin", "ounceinch", "inchounces"), "ozfin"),
    **dict.fromkeys(("newton", "newtons"), "N"),
    **dict.fromkeys(("lb", "lbs", "pound", "pounds"), "lbf"),
    **dict.fromkeys(("amp", "amps", "ampere", "amperes"), "A"),
    **dict.fromkeys(("milliamp", "milliamps", "milliampere"), "mA"),
}
"""Other ways in which logs write a unit: without signs of multiplication, in small letters."""

FOLDED = frozenset(symbol.lower() for symbol in ATOMS)

MULTIPLIED = re.compile(r"[\s.*·•×⋅∙‧_-]+")
"""Separators between the factors of a unit."""


def read_unit(text: str, dimension: Dimension) -> Unit | None:
    """Read a unit as logs write it: ``N.m``, ``in-lb``, ``°C``, ``Seconds``; None where it is none.

    Case matters first. If the text is no unit of the dimension, case is ignored if all letters have
    the same case or only the first is a capital: ``NM`` is a torque, ``MNm`` is refused.

    Examples
    --------
    >>> read_unit("in-lb", TORQUE).symbol, read_unit("Seconds", TIME).symbol
    ('lbfin', 's')
    >>> read_unit("nm", LENGTH).symbol, read_unit("nm", TORQUE).symbol
    ('nm', 'Nm')
    """
    text = text.strip().replace("º", "°").replace("˚", "°").replace("μ", "µ")
    exact = parse_unit(text)
    if exact is not None and exact.dimension == dimension:
        return exact
    joined = MULTIPLIED.sub("", text)
    for known in (joined, joined.replace("µ", "u")):
        if known in ATOMS and ATOMS[known].dimension == dimension:
            return ATOMS[known]
    folded = joined.lower()
    found = {SPELLINGS[folded]} if folded in SPELLINGS else set()
    if not found and joined in (folded, joined.upper(), joined.capitalize()):
        found = {symbol for symbol in ATOMS if symbol.lower() == folded}
    fitting = [ATOMS[symbol] for symbol in found if ATOMS[symbol].dimension == dimension]
    if len(fitting) == 1:
        return fitting[0]
    return exact


def is_unit(text: str) -> bool:
    """Whether a text is a unit of any dimension in any notation of logs."""
    joined = MULTIPLIED.sub("", text.strip()).lower()
    return parse_unit(text.strip()) is not None or joined in SPELLINGS or joined in FOLDED


@lru_cache(maxsize=1024)
def split_unit(name: str) -> tuple[str, Unit | None]:
    """Split a name into quantity and unit; the longest suffix that is a unit is used.

    Examples
    --------
    >>> split_unit("rated_torque_Nm")[0]
    'rated_torque'
    >>> split_unit("flexspline_teeth")
    ('flexspline_teeth', None)
    """
    tokens = name.split("_")
    for start in range(1, len(tokens)):
        unit = parse_unit("_".join(tokens[start:]))
        if unit is not None:
            return "_".join(tokens[:start]), unit
    return name, None


def unit(symbol: str) -> Unit:
    """Return the unit of a symbol that is known to be one.

    Raises
    ------
    KeyError
        If the symbol is not a unit.
    """
    found = parse_unit(symbol)
    if found is None:
        raise KeyError(symbol)
    return found


def convert(value: Number, source: str, target: str) -> Number:
    """Convert a value or an array between two units of one dimension.

    Raises
    ------
    KeyError
        If a symbol is not a unit.
    ValueError
        If the dimensions differ.
    """
    a, b = unit(source), unit(target)
    if a == b:
        return value
    if a.dimension != b.dimension:
        raise ValueError(
            f"{source} is {dimension_name(a.dimension)}, {target} {dimension_name(b.dimension)}"
        )
    return b.from_si(a.to_si(value))


def plain_number(value: float, digits: int = 3) -> str:
    """Write a number with a number of significant digits, without a power of ten up to 1e15."""
    rounded = float(f"{value:.{digits}g}")
    return f"{rounded:.15g}"


ARCMIN = ATOMS["arcmin"].scale
"""One arc minute in rad."""

ARCSEC = ATOMS["arcsec"].scale
"""One arc second in rad."""
