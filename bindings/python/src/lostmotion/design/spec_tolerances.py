"""Tolerances of a search spec, as links that the optimizer can price and vary."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from lostmotion.design.engine import engine
from lostmotion.design.statements import Statements
from lostmotion.keys import Key, as_in_file, read_keys
from lostmotion.structs import DISTRIBUTIONS, ZONES

POSITIONS = {"hole": (1.0, 0.5), "shaft": (-1.0, -0.5), "link": (1.0, 0.0)}
"""Sign of the influence, and the middle of a field that starts at zero, in fields."""

GRADES = (3, 12)
"""Finest and coarsest ISO tolerance grade that a search takes."""

TOLERANCE_KEYS = (
    Key("kind", kind="text"),
    Key("name", kind="text"),
    Key("zone", kind="choice", choices=ZONES, required=True),
    Key("it_grade", low=GRADES[0], high=GRADES[1]),
    Key("nominal", "mm", low=0, high=500),
    Key("lower", "mm", low=-10, high=10),
    Key("upper", "mm", low=-10, high=10),
    Key("fundamental_deviation", "mm", low=-10, high=10),
    Key("distribution", kind="choice", choices=DISTRIBUTIONS),
    Key("position", low=-10, high=10),
    Key("diameter", kind="switch"),
    Key("influence", low=-100, high=100),
    Key("cost_weight", above=0, high=1e6),
)
"""Keys of [[design.tolerance]] in a spec: those of a drive file, and what a feature costs."""


def read_tolerances(out: Statements, said: Mapping[str, str]) -> list[str]:
    """State the tolerances of a spec; returns their names, empty where one has none.

    Parameters
    ----------
    said : mapping
        Place in the file of each dotted key of the search.
    """
    design = out.document.get("design", {})
    known = ("tolerance", "radial_chain", "torsion_chain")
    if not isinstance(design, Mapping):
        raise out.refuse("design", as_in_file(design), "a table [design]")
    for name in design:
        if name not in known:
            expected = f"[[design.{name}]] only for {', '.join(known)}; other values stand in "
            raise out.refuse(f"design.{name}", "a key", expected + "[search.fixed]")
    entries = design.get("tolerance", [])
    if not isinstance(entries, list) or not all(isinstance(e, Mapping) for e in entries):
        raise out.refuse("design.tolerance", as_in_file(entries), "tables [[design.tolerance]]")
    for index, entry in enumerate(entries):
        state_tolerance(out, said, index, entry)
    for name, place in said.items():
        match = re.fullmatch(r"tolerance\.(\d+)\.grade", name)
        if match and int(match[1]) >= len(entries):
            expected = f"one of the {len(entries)} tables [[design.tolerance]], counted from 0"
            raise out.refuse(place, f"tolerance {match[1]}", expected)
    return [str(entry.get("name", "")) for entry in entries]


def state_tolerance(
    out: Statements, said: Mapping[str, str], index: int, entry: Mapping[str, Any]
) -> None:
    """State the grade and the link of one tolerance."""
    place = f"design.tolerance[{index}]"
    values = read_keys(out.file, place, entry, TOLERANCE_KEYS)
    given = {name: value.value for name, value in values.items()}
    kind = given.get("kind")
    if kind not in POSITIONS:
        expected = "one of " + ", ".join(POSITIONS)
        raise out.refuse(f"{place}.kind", as_in_file(kind) if kind else "nothing", expected)
    sign, position = POSITIONS[kind]
    half = 0.5 if kind != "link" and given.get("diameter", True) else 1.0
    if kind == "link" and "influence" not in given:
        raise out.refuse(f"{place}.influence", "nothing", "this key, a number")
    nominal = given.get("nominal", 0.0)
    offset = given.get("fundamental_deviation", 0.0)
    position = given.get("position", position)
    grade = f"tolerance.{index}.grade"
    if "it_grade" in given and grade in said:
        raise out.refuse(f"{place}.it_grade", "a second value", f"one of this and {grade}")
    if "it_grade" in given:
        out.say(f"{place}.it_grade", "fixed", grade, given["it_grade"])
    elif "lower" in given and "upper" in given:
        width = given["upper"] - given["lower"]
        if not width > 0 or not nominal > 0:
            raise out.refuse(place, "lower and upper", "lower below upper, and nominal_mm")
        out.say(place, "fixed", grade, continuous_grade(out, place, nominal, width))
        offset, position = (given["lower"] + given["upper"]) / 2, 0.0
    elif grade not in said:
        expected = f'it_grade here, or "tolerance.{index}.it_grade" in [search.range]'
        raise out.refuse(place, "no grade", expected)
    out.say(
        place,
        "link",
        float(given.get("influence", sign * half)),
        float(nominal),
        position,
        float(offset),
        float(given.get("cost_weight", 1.0)),
        given.get("distribution", "normal"),
        given["zone"],
    )


def continuous_grade(out: Statements, place: str, nominal: float, width: float) -> float:
    """Grade whose field has a given width; fields grow with the grade."""
    ffi, lib = engine()
    one = ffi.new("double *")

    def field(grade: float) -> float:
        if lib.lm_it_tolerance_continuous(nominal, grade, one, ffi.NULL) != 0:
            raise out.refuse(f"{place}.nominal_mm", as_in_file(nominal), "from 0.001 to 500 mm")
        return float(one[0])

    low, high = map(float, GRADES)
    if not field(low) <= width <= field(high):
        least, most = f"IT {low:g} ({field(low):.4g} mm)", f"IT {high:g} ({field(high):.4g} mm)"
        expected = f"from {least} to {most}"
        raise out.refuse(place, f"a field of {width:.4g} mm", expected)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if field(middle) >= width else (middle, high)
    return high
