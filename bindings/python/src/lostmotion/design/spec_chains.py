"""Radial and torsion chains of a search spec, as values common to all drives of the search."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lostmotion.design.spec_keys import (
    DEFLECTION,
    DEFLECTION_MODULES,
    DIFFERENCE,
    MODULE,
    RIGID,
    TEETH,
    WIDTH,
)
from lostmotion.design.statements import Statements
from lostmotion.design.variables import Variables
from lostmotion.drives import parse_drive
from lostmotion.structs import GENERATORS, make_drive


def state_chains(out: Statements, variables: Variables, sign: int, rated_Nm: float) -> None:
    """State the members of the chains for the drive in the middle of the ranges."""
    design = out.document.get("design", {})
    chains = {n: design[n] for n in ("radial_chain", "torsion_chain") if n in design}
    if not chains:
        return
    document = middle(variables, chains, sign, rated_Nm)
    drive = make_drive(parse_drive(document, out.file).design)  # type: ignore[arg-type]
    for i in range(drive.radial_law_count if "radial_chain" in chains else 0):
        law = drive.radial_laws[i]
        numbers = (law.coefficient_mm_per_Nn, law.exponent, law.share, law.preload_N)
        out.say(f"design.radial_chain[{i}]", "radial", *numbers)
    for i in range(drive.torsion_count if "torsion_chain" in chains else 0):
        element = drive.torsion[i]
        origin = f"design.torsion_chain[{i}]"
        out.say(origin, "torsion", element.stiffness_Nm_per_rad, element.ratio)


def middle(
    variables: Variables, chains: Mapping[str, Any], sign: int, rated_Nm: float
) -> dict[str, Any]:
    """A drive file of the drive in the middle of all ranges."""
    v = variables.values
    module, teeth = v[MODULE], int(v[TEETH])
    x1 = v.get("teeth.flexspline_shift", 3.0)
    deflection = v.get(DEFLECTION, module * v.get(DEFLECTION_MODULES, 1.0))
    design: dict[str, Any] = {
        "teeth": {
            "deformation": "external" if variables.external() else "internal",
            "module_mm": module,
            "flexspline_teeth": teeth,
            "rigid_teeth": teeth + (-2 if variables.external() else 2),
            "flexspline_shift": x1,
            "rigid_shift": v.get(RIGID, x1 + v.get(DIFFERENCE, 0.0)),
            "tooth_height": v.get("teeth.tooth_height", 1.75),
            "engagement_depth": v.get("teeth.engagement_depth", 1.2),
            "face_width_mm": v[WIDTH],
        },
        "generator": {
            "type": GENERATORS[int(v.get("generator.type", 0))],
            "deflection_mm": deflection,
            "contact_half_angle_deg": v.get("generator.contact_half_angle_deg", 30.0),
        },
        **chains,
    }
    material = {k.partition(".")[2]: x for k, x in v.items() if k.startswith("material.")}
    if material:
        design["material"] = material
    ratio = sign * variables.turning(teeth) / 2
    return {"drive": {"ratio": ratio, "rated_torque_Nm": rated_Nm}, "design": design}
