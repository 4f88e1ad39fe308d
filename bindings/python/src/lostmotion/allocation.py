"""The cheapest grades of a tolerance chain that meet a lost motion target.

A feature with the tolerance field T costs ``w (T7 / T)^k``, where T7 is the field of grade 7 and k
= 1: the reciprocal power law of cost and tolerance (Sutherland and Roth, J. Eng. Ind. 97, 1975,
283; Chase and Greenwood, Manuf. Rev. 1, 1988, 50), which is also the default of a design search.
Grades are integers, so the allocation is a combinatorial problem. It starts with a greedy choice by
cost per gap and then exchanges one or two features as long as this reduces the cost.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from lostmotion.combined_tolerances import parts_of_fit
from lostmotion.core import core
from lostmotion.drives import Drive, tolerance_chain
from lostmotion.errors import InputError, LostMotionError
from lostmotion.model import PROBABLE_T, DesignModel, design_model, reversal_torque
from lostmotion.structs import tolerance_links
from lostmotion.tolerance_classes import read_class
from lostmotion.tooth_grades import GRADES as TOOTH_GRADES
from lostmotion.units import ARCMIN

COST_EXPONENT = 1.0
"""Exponent k of the cost."""

GRADES = (4, 11)
"""Grades of holes, shafts and links that are tried: finer ones are for gauges, coarser ones are not
used for fits (ISO 286-1, Annex B)."""

LEVELS = ("probable", "worst")
"""Production level at which the target must be met."""

ROUNDS_MOST = 50
"""Largest number of exchange rounds; each reduces the cost."""


@dataclass(frozen=True)
class Option:
    """A grade of a feature: its entries in the file, the gaps of its links, and its cost."""

    grade: int
    written: str
    links: tuple[tuple[float, float], ...]
    cost: float

    @property
    def field_um(self) -> float:
        """Widest field of its links."""
        return 1e3 * max(upper - lower for lower, upper in self.links)


@dataclass(frozen=True)
class Feature:
    """A toleranced feature whose grade may be chosen.

    Attributes
    ----------
    name : str
    first : int
        Index of its first link in the chain.
    options : list of Option
        From the finest grade to the coarsest.
    now : int
        The option that the file states.
    """

    name: str
    first: int
    options: list[Option]
    now: int


def cheapest_tolerances(
    drive: Drive, target_arcmin: float | None = None, level: str = "probable"
) -> dict[str, Any]:
    """Find the cheapest grades with which the reversal lost motion meets a target.

    Parameters
    ----------
    drive : Drive
        With a design and tolerances.
    target_arcmin : float, optional
        Reversal lost motion at 4 % of the rated torque; by default the present value.
    level : {"probable", "worst"}
        Which limits of the radial gap are used.

    Returns
    -------
    dict
        ``target_arcmin``, ``level``, ``now_arcmin``, ``then_arcmin``, ``cost_now``, ``cost_then``,
        and ``features``: name, now, cheapest (grades or classes), fields and costs.

    Raises
    ------
    InputError
        When no feature states a grade, or the finest grades miss the target.
    """
    model = design_model(drive)
    features = features_of(drive)
    if not features:
        expected = "it_grade, tolerance_class, fit or tooth_grade for at least one"
        raise InputError(drive.file, "design.tolerance", "no grade", expected)
    at = reversal_torque(drive)
    limit = f"{level}_max"

    def lost(gap_mm: float) -> float:
        return model.reversal_lost_motion(at, 0.0, gap_mm) / ARCMIN

    gap_of = gap_function(model, features, level)
    now = [feature.now for feature in features]
    now_arcmin = lost(model.tolerance_limits()[limit])
    target = now_arcmin if target_arcmin is None else target_arcmin
    finest = [0] * len(features)
    if lost(gap_of(finest)) > target * (1 + ROUNDING):
        least = lost(gap_of(finest))
        found = f"{target:.4g} arcmin"
        expected = f"{least:.4g} arcmin or more, the value with the finest grades"
        raise InputError(drive.file, "design.tolerance", found, expected)
    module_mm = float(model.drive.teeth.module_mm)
    gap_mm = gap_of(now) if target_arcmin is None else widest_gap(lost, target, module_mm)
    chosen = allocate(features, gap_of, gap_mm)
    cost = [
        sum(f.options[i].cost for f, i in zip(features, where, strict=True))
        for where in (now, chosen)
    ]
    return {
        "schema": "lostmotion.allocation/1",
        "target_arcmin": target,
        "level": level,
        "now_arcmin": now_arcmin,
        "then_arcmin": lost(gap_of(chosen)),
        "cost_now": cost[0],
        "cost_then": cost[1],
        "features": [
            {
                "name": feature.name,
                "now": feature.options[feature.now].written,
                "cheapest": feature.options[i].written,
                "field_now_um": feature.options[feature.now].field_um,
                "field_um": feature.options[i].field_um,
                "cost_now": feature.options[feature.now].cost,
                "cost": feature.options[i].cost,
            }
            for feature, i in zip(features, chosen, strict=True)
        ],
    }


ROUNDING = 1e-9
"""Relative rounding tolerance of the widest gap and of the target."""


def widest_gap(lost: Callable[[float], float], target: float, most_mm: float) -> float:
    """Radial gap in mm at which the lost motion, which grows with it, reaches the target."""
    low, high = 0.0, most_mm
    if lost(high) <= target:
        return high
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if lost(middle) <= target else (low, middle)
    return low


HALVINGS = 50
"""Bisections of a gap of one module, to the last bit of a float64."""


def allocate(
    features: Sequence[Feature], gap_of: Callable[[Sequence[int]], float], gap_mm: float
) -> list[int]:
    """Choose the cheapest options of all features with a gap of at most `gap_mm`."""

    def cost(where: Sequence[int]) -> float:
        return sum(f.options[i].cost for f, i in zip(features, where, strict=True))

    def kept(where: Sequence[int]) -> bool:
        return gap_of(where) <= gap_mm * (1 + ROUNDING)

    here = [0] * len(features)
    while True:  # coarsen the feature that saves most per added gap
        gap, best = gap_of(here), None
        for i, feature in enumerate(features):
            for to in range(here[i] + 1, len(feature.options)):
                there = [*here[:i], to, *here[i + 1 :]]
                saved = cost(here) - cost(there)
                if saved > 0 and kept(there):
                    rate = saved / max(gap_of(there) - gap, 1e-12)
                    best = max(best or (rate, there), (rate, there))
        if best is None:
            break
        here = best[1]
    for _ in range(ROUNDS_MOST):  # then exchange two features at a time
        best_cost, best_there = cost(here), None
        for i, j in itertools.combinations(range(len(features)), 2):
            for to_i, to_j in itertools.product(
                range(len(features[i].options)), range(len(features[j].options))
            ):
                there = list(here)
                there[i], there[j] = to_i, to_j
                if cost(there) < best_cost - 1e-12 and kept(there):
                    best_cost, best_there = cost(there), there
        if best_there is None:
            return here
        here = best_there
    return here


def gap_function(
    model: DesignModel, features: Sequence[Feature], level: str
) -> Callable[[Sequence[int]], float]:
    """Return a function that gives the largest radial gap in mm for one option per feature."""
    c, links = model.core, model.tolerance_links()
    limits = c.ffi.new("lm_tolerance_limits *")

    def largest(where: Sequence[int]) -> float:
        for feature, chosen in zip(features, where, strict=True):
            for k, (lower, upper) in enumerate(feature.options[chosen].links):
                links[feature.first + k].lower_mm = lower
                links[feature.first + k].upper_mm = upper
        if level == "worst":
            c.call(c.lib.lm_worst_limits, links, len(links), limits)
        else:
            c.call(c.lib.lm_probable_limits, links, len(links), PROBABLE_T, limits)
        return float(limits.total_max_mm)

    return largest


def features_of(drive: Drive) -> list[Feature]:
    """List the features of [[design.tolerance]] that state a grade, with every grade they may have.

    A fit is expanded into its hole and its shaft; numeric deviations are kept.
    """
    document = copy.deepcopy(drive.document)
    design = document.get("design", {})
    entries: list[dict[str, Any]] = []
    for i, entry in enumerate(design.get("tolerance", [])):
        place = f"design.tolerance[{i}]"
        parts = parts_of_fit(drive.file, place, i, entry) if entry["kind"] == "fit" else [entry]
        entries.extend({"name": f"tolerance[{i}]", **part} for part in parts)
    design["tolerance"] = entries
    found: list[Feature] = []
    first = 0
    for i, entry in enumerate(entries):
        graded = grade_of(entry)
        links = 2 if entry["kind"] == "gear" else 1
        if graded is not None:
            grades = TOOTH_GRADES if entry["kind"] == "gear" else GRADES
            low, high = min(grades[0], graded), max(grades[1], graded)
            fields = {
                grade: links_at(drive, document, i, grade, first, links)
                for grade in range(low, high + 1)
            }
            usual = fields[core().lib.LM_COST_GRADE]
            weight = float(entry.get("cost_weight", 1.0))
            options = [
                Option(grade, with_grade(entry, grade)[1], at, weight * price(usual, at))
                for grade, at in fields.items()
                if at is not None and usual is not None
            ]
            now = next((k for k, o in enumerate(options) if o.grade == graded), None)
            if now is not None:
                found.append(Feature(str(entry["name"]), first, options, now))
        first += links
    return found


def price(
    usual: tuple[tuple[float, float], ...] | None, at: Sequence[tuple[float, float]]
) -> float:
    """Cost of a field relative to grade 7; for a gear, that of its infeed, its last link."""
    assert usual is not None
    wide, here = (links[-1][1] - links[-1][0] for links in (usual, at))
    return float((wide / here) ** COST_EXPONENT)


def grade_of(entry: dict[str, Any]) -> int | None:
    """Grade that an entry states; None where it states deviations."""
    if entry["kind"] == "gear":
        return int(entry["tooth_grade"])
    if "it_grade" in entry:
        return int(entry["it_grade"])
    return read_class(entry["tolerance_class"]).grade if "tolerance_class" in entry else None


def with_grade(entry: dict[str, Any], grade: int) -> tuple[dict[str, Any], str]:
    """Return an entry with another grade, and the grade as written on a drawing."""
    if entry["kind"] == "gear":
        return {**entry, "tooth_grade": grade}, f"grade {grade}"
    if "tolerance_class" in entry:
        letter = read_class(entry["tolerance_class"]).letter
        rest = {key: value for key, value in entry.items() if key != "it_grade"}
        return {**rest, "tolerance_class": f"{letter}{grade}"}, f"{letter}{grade}"
    return {**entry, "it_grade": grade}, f"IT{grade}"


def links_at(
    drive: Drive, document: dict[str, Any], place: int, grade: int, first: int, links: int
) -> tuple[tuple[float, float], ...] | None:
    """Deviations in mm of the links of an entry at a grade; None where the standard has none."""
    entries = list(document["design"]["tolerance"])
    entries[place] = with_grade(entries[place], grade)[0]
    changed = {**document["design"], "tolerance": entries}
    try:
        found = tolerance_links(drive.file, tolerance_chain(drive.file, changed))
    except LostMotionError:
        return None
    return tuple((found[k].lower_mm, found[k].upper_mm) for k in range(first, first + links))
