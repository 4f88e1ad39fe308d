"""Where a designer would start without a search: textbook values for the variables of a spec.

Internal teeth deformed outwards: Ivanov's recommendations, x1 = 3 + 0.01 z1, w0/m = 0.89 + 8e-5 z1,
x2 = x1 - 1 + (w0/m)(1 + 5e-5 z1 w0/m), engagement depth 4 w0/m - 2.48 - (4.6 - 4 w0/m) 1e-4 z1.
A ring generator about internal teeth: x = 3 and 3.05, w0/m = 0.95, depth 1.2, the published
reference of that kind. What the books leave open has the values of `USUAL`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from lostmotion.design.result import Designs
from lostmotion.design.spec import Spec

USUAL = {
    "teeth.pressure_angle_deg": 20.0,
    "teeth.tooth_height": 1.75,
    "generator.contact_half_angle_deg": 30.0,
}
"""Of the usual drive of size 20."""

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


def textbook(teeth: float, external: bool, module_mm: float, ratio: float) -> dict[str, float]:
    """Textbook values, by dotted key of the search.

    Parameters
    ----------
    teeth : float
        Of the flexspline.
    external : bool
        Whether a ring deforms it inwards.
    module_mm, ratio : float
    """
    if external:
        x1, x2, kappa, depth = 3.0, 3.05, 0.95, 1.2
        # The ring turns inwards: the rigid gear has the shift that is named second.
    else:
        x1 = 3 + 0.01 * teeth
        kappa = 0.89 + 8e-5 * teeth
        x2 = x1 - 1 + kappa * (1 + 5e-5 * teeth * kappa)
        depth = 4 * kappa - 2.48 - (4.6 - 4 * kappa) * 1e-4 * teeth
    rim = (65 + 2.5 * abs(ratio) ** (2 / 3)) * 1e-4 * module_mm * teeth
    return {
        **USUAL,
        "teeth.flexspline_shift": x1,
        "teeth.rigid_shift": x2,
        "teeth.shift_difference": x2 - x1,
        "generator.deflection_modules": kappa,
        "generator.deflection_mm": kappa * module_mm,
        "teeth.engagement_depth": depth,
        "flexspline.rim_thickness_mm": rim,
        "flexspline.wall_thickness_mm": 0.6 * rim,
    }


def starts_of(designs: Designs, spec: Spec, combination: int, best: Any) -> tuple[Start, ...]:
    """Textbook start of a combination, in three forms.

    As it stands, with its smallest gap closed, and with the tolerance grades of the best design
    too. What [search.start] says goes first; a variable that neither it nor a book names is taken
    in the middle of its range. Nothing when the model refuses it.

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
