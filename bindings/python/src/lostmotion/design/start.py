"""Start without a search: textbook values for the variables of a spec."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from lostmotion.design.result import Designs
from lostmotion.design.spec import Spec
from lostmotion.design.textbook import textbook

USUAL_GRADE = 7.0
"""ISO tolerance grade of a fit without special demands."""


@dataclass(frozen=True)
class Start:
    """A design to compare with.

    Attributes
    ----------
    values : dict
        Of the variables, by dotted key of the search.
    figures, margins : dict
    drive : dict
        Its drive file.
    """

    values: dict[str, float]
    figures: dict[str, float]
    margins: dict[str, float]
    drive: dict[str, Any]


def starts_of(designs: Designs, spec: Spec, combination: int, best: Any) -> tuple[Start, ...]:
    """Textbook start of a combination, in three forms.

    Unchanged, with its smallest gap closed, and also with the tolerance grades of the best design.
    Values of [search.start] take precedence; a variable without a textbook value is set to the
    middle of its range. Empty if the model refuses it.

    Parameters
    ----------
    best : cdata
        Unit variables of the best design.
    """
    ffi, lib = designs.ffi, designs.lib
    problem = designs.problem
    middle = ffi.new("double[]", [0.5] * lib.LM_FREE_MAX)
    values = designs.values(combination, middle)
    teeth = values["teeth.flexspline_teeth"]
    external = values["teeth.deformation"] > 0
    book = textbook(teeth, external, values["teeth.module_mm"], teeth / 2) | spec.start
    unit = ffi.new("double[]", lib.LM_FREE_MAX)
    graded = []
    for i in range(problem.range_count):
        entry = problem.range[i]
        name = designs.key_name(entry.key)
        if ".grade" in name:
            graded.append(i)
        usual = USUAL_GRADE if ".grade" in name else (entry.low + entry.high) / 2
        unit[i] = (book.get(name, usual) - entry.low) / (entry.high - entry.low)
    try:
        found = [measured(designs, combination, unit)]
        lib.lm_close_gap(problem, designs.layout, combination, designs.result, unit)
        found.append(measured(designs, combination, unit))
        for i in graded:
            unit[i] = best[i]
        found.append(measured(designs, combination, unit))
    except ValueError:
        return ()
    return tuple(found)


def measured(designs: Designs, combination: int, unit: Any) -> Start:
    """Evaluate a start."""
    figures, margins = designs.measure(combination, unit)
    drive = designs.drive(combination, unit, "textbook start")
    return Start(designs.varied(combination, unit), figures, margins, drive)
