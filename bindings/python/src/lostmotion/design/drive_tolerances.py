"""Tolerances of a design found by a search, in the form of its spec: fits, classes and grades."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

from lostmotion.design.spec import Spec
from lostmotion.design.spec_tolerances import ToleranceLink

WHOLE = 1e-9
"""Tolerance within which a grade counts as whole."""


def kept_tolerances(
    spec: Spec, grades: Sequence[float], design: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Give [[design.tolerance]] of a drive file with the grades that the search found.

    Parameters
    ----------
    grades : sequence of float
        Of the links of the spec.
    design : mapping
        [design] of that file, in which each link has its deviations in numbers.
    """
    entries = spec.document["design"]["tolerance"]
    rows = list(zip(spec.links, grades, design["tolerance"], strict=True))
    kept: list[dict[str, Any]] = []
    for index, group in groupby(rows, key=lambda row: row[0].index):
        links = list(group)
        entry = dict(entries[index])
        if entry["kind"] == "gear":
            kept.append(entry)
        elif entry["kind"] == "fit" and all(is_whole(grade) for _, grade, _ in links):
            fit = "/".join(f"{link.letter}{round(grade)}" for link, grade, _ in links)
            kept.append({**entry, "fit": fit})
        else:
            kept.extend(kept_link(link, grade, numbers, design) for link, grade, numbers in links)
    return kept


def kept_link(
    link: ToleranceLink, grade: float, numbers: Mapping[str, Any], design: Mapping[str, Any]
) -> dict[str, Any]:
    """Return one entry, by its grade if a drive file can express it so, else by its deviations."""
    entry = dict(link.kept)
    if link.deviations_mm is not None:
        entry["lower_mm"], entry["upper_mm"] = link.deviations_mm
    elif not is_whole(grade):
        entry["lower_mm"], entry["upper_mm"] = numbers["lower_mm"], numbers["upper_mm"]
    else:
        teeth = design["teeth"]
        entry["nominal_mm"] = link.nominal_mm or teeth["module_mm"] * teeth["flexspline_teeth"]
        if link.letter:
            entry["tolerance_class"] = f"{link.letter}{round(grade)}"
        else:
            entry["it_grade"] = round(grade)
            # A drive file does not state the position of the field; a deviation expresses it.
            width = numbers["upper_mm"] - numbers["lower_mm"]
            usual = {"hole": 0.0, "shaft": -width}.get(entry["kind"], -width / 2)
            offset = numbers["lower_mm"] - usual if link.placed else link.offset_mm
            if offset:
                entry["fundamental_deviation_mm"] = offset
    return entry


def is_whole(grade: float) -> bool:
    """Whether a grade is one of the standard."""
    return abs(grade - round(grade)) <= WHOLE
