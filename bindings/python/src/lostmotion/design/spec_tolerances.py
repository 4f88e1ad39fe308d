"""Tolerances of a search spec, as links with costs and variables for the optimizer."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lostmotion.combined_tolerances import COMBINED, spelled_out
from lostmotion.design.engine import engine
from lostmotion.design.spec_keys import MODULE, TEETH
from lostmotion.design.statements import Statements
from lostmotion.design.variables import Variables
from lostmotion.keys import Key, TableEntry, as_in_file, read_keys
from lostmotion.structs import DISTRIBUTIONS, ZONES, Entry, class_of
from lostmotion.tolerance_classes import ToleranceClass, limit_deviations

POSITIONS = {"hole": (1.0, 0.5), "shaft": (-1.0, -0.5), "link": (1.0, 0.0)}
"""Sign of the influence, and the middle of a field that starts at zero, in widths of the field."""

GRADES = (3, 12)
"""Finest and coarsest ISO tolerance grade of a search."""

TOLERANCE_KEYS = (
    Key("kind", kind="text"),
    Key("name", kind="text"),
    Key("zone", kind="choice", choices=ZONES, required=True),
    Key("it_grade", low=GRADES[0], high=GRADES[1]),
    Key("nominal", "mm", low=0, high=500),
    Key("lower", "mm", low=-10, high=10),
    Key("upper", "mm", low=-10, high=10),
    Key("fundamental_deviation", "mm", low=-10, high=10),
    Key("tolerance_class", kind="text"),
    Key("distribution", kind="choice", choices=DISTRIBUTIONS),
    Key("position", low=-10, high=10),
    Key("diameter", kind="switch"),
    Key("influence", low=-100, high=100),
    Key("cost_weight", above=0, high=1e6),
)
"""Keys of [[design.tolerance]] in a spec: those of a drive file, and the cost of a feature."""

KEPT = ("kind", "name", "zone", "distribution", "influence", "diameter", "cost_weight")
"""Keys of a feature that are copied unchanged to the drive files of a search."""


@dataclass(frozen=True)
class ToleranceLink:
    """One link of a spec, in mm.

    Attributes
    ----------
    index : int
        Index of its entry in the spec.
    kept : dict
        Keys that are copied unchanged to a drive file.
    nominal_mm : float
        0: the pitch diameter of the flexspline.
    offset_mm : float
        Fundamental deviation as a number.
    letter : str
        Letter of the tolerance class; empty if none.
    deviations_mm : tuple of float or None
        Both deviations, if the spec states them.
    placed : bool
        Whether the spec states the position of the field, which a drive file cannot express.
    """

    index: int
    kept: dict[str, Any]
    nominal_mm: float
    offset_mm: float = 0.0
    letter: str = ""
    deviations_mm: tuple[float, float] | None = None
    placed: bool = False


def read_tolerances(out: Statements, variables: Variables) -> list[ToleranceLink]:
    """State the tolerances of a spec; returns its links (two for a fit and for a gear)."""
    design = out.document.get("design", {})
    known = ("tolerance", "radial_chain", "torsion_chain")
    if not isinstance(design, Mapping):
        raise out.refuse("design", as_in_file(design), "a table [design]")
    for name in design:
        if name not in known:
            expected = f"[[design.{name}]] only for {', '.join(known)}; other values in "
            raise out.refuse(f"design.{name}", "a key", expected + "[search.fixed]")
    entries = design.get("tolerance", [])
    if not isinstance(entries, list) or not all(isinstance(e, Mapping) for e in entries):
        raise out.refuse("design.tolerance", as_in_file(entries), "tables [[design.tolerance]]")
    said = variables.said
    links: list[ToleranceLink] = []
    fixed = fixed_teeth(variables)
    for place, entry in spelled_out(out.file, "design.tolerance", entries, fixed, True):
        index = int(place.partition("[")[2].rstrip("]"))
        links.append(state_tolerance(out, variables, place, index, len(links), entry))
    for name, place in said.items():
        match = re.fullmatch(r"tolerance\.(\d+)\.grade", name)
        if match and int(match[1]) >= len(links):
            expected = f"one of the {len(links)} tables [[design.tolerance]], counted from 0"
            if len(links) > len(entries):
                expected = (
                    f"one of {len(links)} links, counted from 0; a fit and a gear count as two"
                )
            raise out.refuse(place, f"tolerance {match[1]}", expected)
    return links


def fixed_teeth(variables: Variables) -> dict[str, float]:
    """Module and numbers of teeth that every drive of the search has."""
    fixed = {
        name.partition(".")[2]: variables.values[name]
        for name in (MODULE, TEETH)
        if variables.said.get(name, "").startswith("search.fixed")
    }
    if "flexspline_teeth" in fixed and len(variables.deformations()) == 1:
        fixed["rigid_teeth"] = fixed["flexspline_teeth"] + (-2 if variables.external() else 2)
    return fixed


def state_tolerance(
    out: Statements,
    variables: Variables,
    place: str,
    index: int,
    number: int,
    entry: Mapping[str, Any],
) -> ToleranceLink:
    """State the grade and the link of one tolerance, the `number`-th of the search."""
    said = variables.said
    values = read_keys(out.file, place, entry, TOLERANCE_KEYS)
    given = {name: value.value for name, value in values.items()}
    kind = given.get("kind")
    if kind not in POSITIONS:
        expected = "one of " + ", ".join((*POSITIONS, *COMBINED))
        raise out.refuse(f"{place}.kind", as_in_file(kind) if kind else "nothing", expected)
    sign, position = POSITIONS[kind]
    half = 0.5 if kind != "link" and given.get("diameter", True) else 1.0
    if kind == "link" and "influence" not in given:
        raise out.refuse(f"{place}.influence", "nothing", "this key, a number")
    nominal = given.get("nominal", 0.0)
    offset = given.get("fundamental_deviation", 0.0)
    position = given.get("position", position)
    letter, deviations = "", None
    grade = f"tolerance.{number}.grade"
    fixed = given.get("it_grade")
    if "tolerance_class" in given:
        one = read_feature_class(out, Entry(kind, place, values))
        letter, fixed = one.letter, one.grade
    if fixed is not None and grade in said:
        key = "it_grade" if "it_grade" in given else "tolerance_class"
        raise out.refuse(f"{place}.{key}", "a second value", f"one of this and {grade}")
    if fixed is not None:
        out.say(f"{place}.it_grade", "fixed", grade, fixed)
    elif "lower" in given and "upper" in given:
        width = given["upper"] - given["lower"]
        if not width > 0 or not nominal > 0:
            raise out.refuse(place, "lower and upper", "lower below upper, and nominal_mm")
        out.say(place, "fixed", grade, continuous_grade(out, place, nominal, width))
        deviations = (given["lower"], given["upper"])
        offset, position = (given["lower"] + given["upper"]) / 2, 0.0
    elif grade not in said:
        expected = f'it_grade here, or "tolerance.{number}.it_grade" in [search.range]'
        raise out.refuse(place, "no grade", expected)
    if letter:
        grades = [fixed] if fixed is not None else grades_of(out, variables, grade)
        offset, position = place_class(out, values["tolerance_class"], letter, nominal, grades)
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
    return ToleranceLink(
        index,
        {key: given[key] for key in KEPT if key in given},
        float(nominal),
        float(offset),
        letter,
        deviations,
        "position" in given,
    )


def read_feature_class(out: Statements, feature: Entry) -> ToleranceClass:
    """Read the tolerance class of a hole or a shaft that states only its grade in addition."""
    stated = feature.values["tolerance_class"]
    beside = ("lower", "upper", "fundamental_deviation", "position")
    others = [name for name in beside if name in feature.values]
    if feature.kind == "link":
        raise out.refuse(
            stated.place, "a tolerance class of a link", "a class of a hole or a shaft"
        )
    if others or not feature.get("nominal"):
        found = ", ".join(others) + " beside it" if others else "no nominal_mm"
        raise out.refuse(stated.place, found, "a class and nominal_mm, which give the deviations")
    return class_of(out.file, feature, stated)


def grades_of(out: Statements, variables: Variables, grade: str) -> list[int]:
    """List the whole grades that a tolerance may take in the search."""
    table, _, written = variables.said[grade].removeprefix("search.").partition(".")
    value = out.table(table)[written]
    ends = value["choose"] if isinstance(value, Mapping) else value
    ends = ends if isinstance(ends, list) else [ends]
    return list(range(int(min(ends)), -int(-max(ends) // 1) + 1))


def place_class(
    out: Statements, stated: TableEntry, letter: str, nominal: float, grades: Sequence[int]
) -> tuple[float, float]:
    """Offset in mm and position in fields of a letter, valid for all its grades.

    One end of the field is constant, or its middle.
    """
    try:
        found = [limit_deviations(ToleranceClass(letter, grade), nominal) for grade in grades]
    except ValueError as error:
        raise out.refuse(stated.place, as_in_file(stated.value), str(error)) from None
    lower, upper = found[0]
    for still, position in ((0, 0.5), (1, -0.5)):
        if all(pair[still] == found[0][still] for pair in found):
            return found[0][still], position
    if all(abs(sum(pair) - lower - upper) < ROUNDING_MM for pair in found):
        return (lower + upper) / 2, 0.0
    expected = "a letter whose fundamental deviation does not depend on the grade, or its grade"
    raise out.refuse(stated.place, as_in_file(stated.value), expected)


ROUNDING_MM = 1e-9
"""Field centres that differ by less are equal; tables state tenths of a um."""


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
