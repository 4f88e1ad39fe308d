"""Keys and limits of a search: their names, units and values in the optimizer."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

from lostmotion import structs, units
from lostmotion.core import core
from lostmotion.design.engine import keys
from lostmotion.errors import InputError, did_you_mean
from lostmotion.keys import as_in_file

SWITCH_LIMITS = ("free_assembly", "gap_at_worst_corner")
"""Limits that are on or off."""

TEETH, MODULE, WIDTH = "teeth.flexspline_teeth", "teeth.module_mm", "teeth.face_width_mm"
RIGID, DIFFERENCE = "teeth.rigid_shift", "teeth.shift_difference"
RIGID_TEETH = "teeth.rigid_teeth"
AXIAL_SECTIONS = "axial_sections"
PLANAR_ONLY = "planar_only"
DEPTH = "teeth.engagement_depth"
DEFLECTION, DEFLECTION_MODULES = "generator.deflection_mm", "generator.deflection_modules"
DEFORMATION = "teeth.deformation"

NEVER = {
    RIGID_TEETH: "it follows from teeth.flexspline_teeth, two more or two fewer",
    "generator.floating": "a search assumes a floating wave generator",
    "generator.eccentricity": "a search assumes a wave generator without eccentricity",
    "generator.eccentricity_angle": "a search assumes a wave generator without eccentricity",
}

ASSUMED = {"generator.floating": True, "generator.eccentricity": 0}
"""Values that the search assumes; they may be fixed only to these."""

NAMED = {
    structs.field_path(key.section, key): tuple(name for name in key.choices if name != "points")
    for key in structs.design_keys()
    if key.kind == "choice"
}
"""Keys whose values are names; measured points, the last of the kinds, are not variables."""

SWITCHES = {
    structs.field_path(key.section, key) for key in structs.design_keys() if key.kind == "switch"
}
"""Keys that are true or false."""

FIXED_ONLY = (AXIAL_SECTIONS, PLANAR_ONLY)
"""Keys of the evaluation, which are the same for all drives of a search."""

WHOLE = {TEETH: ("an even number", 2), AXIAL_SECTIONS: ("a whole number", 1)}
"""Keys with integer values."""


def tooth_counts() -> tuple[int, int]:
    """Fewest and most teeth that a flexspline may have."""
    lib = core().lib
    return int(lib.LM_FLEXSPLINE_TEETH_MIN), int(lib.LM_FLEXSPLINE_TEETH_MAX)


def find_key(file: str, table: str, written: str) -> tuple[str, float]:
    """Name of a key in the search, and its unit in the unit of the file."""
    place = f"search.{table}.{written}"
    if re.fullmatch(r"tolerance\.\d+\.(it_)?grade", written):
        return written.replace("it_grade", "grade"), 1.0
    base, unit = units.split_unit(written)
    for bare, why in NEVER.items():
        if base == bare:
            raise InputError(file, place, "a key that cannot be set", f"none ({why})")
    for name in keys():
        if name == written:
            return name, 1.0
        known, kept = units.split_unit(name)
        if kept is not None and known == base and unit is not None:
            if unit.dimension != kept.dimension:
                found = f"unit '{unit.symbol}', {units.dimension_name(unit.dimension)}"
                raise InputError(file, place, found, units.dimension_name(kept.dimension))
            return name, unit.scale / kept.scale
        if kept is not None and written == known:
            found = units.dimension_name(kept.dimension)
            raise InputError(file, place, "no unit", f"{found} as a suffix, e.g. {name}")
    hint = did_you_mean(written, keys())
    expected = f"a dotted key of a drive file's [design], such as {MODULE}{hint}"
    raise InputError(file, place, "an unknown key", expected)


def find_limit(file: str, place: str, written: str, names: Sequence[str]) -> tuple[str, float]:
    """Name of a limit, and the unit of the file in that of the limit."""
    base, suffix = split_limit(written)
    unit = units.parse_unit(suffix)
    for name in names:
        known, kept_suffix = split_limit(name)
        kept = units.parse_unit(kept_suffix)
        if name == written:
            return name, 1.0
        if kept is not None and unit is not None and known == base:
            if unit.dimension != kept.dimension:
                found = f"unit '{unit.symbol}', {units.dimension_name(unit.dimension)}"
                raise InputError(file, place, found, units.dimension_name(kept.dimension))
            return name, unit.scale / kept.scale
    every = [*names, *SWITCH_LIMITS, "ratio"]
    hint = did_you_mean(written, every)
    raise InputError(file, place, "an unknown limit", f"one of {', '.join(every)}{hint}")


def split_limit(name: str) -> tuple[str, str]:
    """Split a limit into quantity and unit; "min" does not mean minutes there."""
    match = re.fullmatch(r"(.*_(?:min|max))_(.*)", name)
    return (match[1], match[2]) if match else (name, "")


def read_value(file: str, place: str, name: str, scale: float, value: Any) -> float:
    """Read a number, or a name that represents one, in the unit of the search."""
    if name in NAMED:
        names = NAMED[name]
        if value not in names:
            hint = did_you_mean(value, names) if isinstance(value, str) else ""
            raise InputError(file, place, as_in_file(value), f"one of {', '.join(names)}{hint}")
        return float(names.index(value))
    if name in SWITCHES:
        if not isinstance(value, bool):
            raise InputError(file, place, as_in_file(value), "true or false")
        return float(value)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(file, place, as_in_file(value), "a number")
    if not math.isfinite(value):
        raise InputError(file, place, as_in_file(value), "a finite number")
    return float(value) if scale == 1.0 else float(value) * scale


def one_value(file: str, place: str, name: str, scale: float, value: Any) -> float:
    """Read a value that is not a bound of a range."""
    number = read_value(file, place, name, scale, value)
    if name in WHOLE and number % WHOLE[name][1] != 0:
        raise InputError(file, place, as_in_file(value), WHOLE[name][0])
    return number


def word(name: str, value: float) -> object:
    """Write a value for the optimizer."""
    if name in NAMED:
        return NAMED[name][int(value)]
    return int(value) if value == int(value) and abs(value) < 1e9 else value
