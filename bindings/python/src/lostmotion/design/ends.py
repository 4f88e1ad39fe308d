"""Variables of a design at a bound of their range: price and practical limits.

A search moves a variable to its bound if no check prevents it. The price is the decrease of the
first objective if the range were twice as wide, to first order.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

STOPS = {
    ("teeth.flexspline_shift", "high"): "tip thickness, and a cutter for such a shift",
    ("teeth.flexspline_shift", "low"): "form radius and root stress of the flexspline",
    ("teeth.tooth_height", "low"): "overlap of the flanks, ratcheting",
    ("teeth.tooth_height", "high"): "tip thickness, root clearance",
    ("teeth.engagement_depth", "low"): "flank pressure, ratcheting torque",
    ("teeth.engagement_depth", "high"): "form radius at the open edge of the cup",
    ("teeth.pressure_angle_deg", "high"): "radial force on the bearing, ratcheting",
    ("teeth.face_width_mm", "high"): "room; the cone of the cup at both edges",
    ("teeth.face_width_mm", "low"): "flank pressure, root stress",
    ("generator.deflection_modules", "high"): "fatigue of the rim, coning stress",
    ("generator.deflection_modules", "low"): "disengagement at 90 deg, ratcheting",
    ("generator.contact_half_angle_deg", "high"): "fatigue of the rim beyond the arc",
    ("generator.contact_half_angle_deg", "low"): "fewer teeth that share the load",
    ("flexspline.rim_thickness_mm", "high"): "fatigue of the rim in bending",
    ("flexspline.rim_thickness_mm", "low"): "stiffness of the rim, ratcheting",
    ("flexspline.wall_thickness_mm", "high"): "coning stress",
    ("flexspline.wall_thickness_mm", "low"): "buckling of the cup, torsion stress",
    ("flexspline.length_mm", "high"): "room, torsion of the cup",
    ("flexspline.length_mm", "low"): "coning stress, gap at the open edge",
}
"""Practical limits of a variable, by key and bound."""

GRADE = {"low": "manufacturing capability and cost", "high": "interference of the fit"}
"""The same for tolerance grades."""


def at_ends(certificate: Mapping[str, Any], objective: str) -> list[str]:
    """List the variables at a bound, the price, and what limits them in practice.

    Parameters
    ----------
    certificate : dict
        Of a design.
    objective : str
        Name and unit of the first objective.
    """
    lines = []
    for end in certificate.get("at_ends", []):
        key, side = end["key"], end["end"]
        stop = GRADE[side] if key.endswith(".grade") else STOPS.get((key, side), "")
        price = end["price"]
        cost = f"a range of twice the width would gain about {price:.3g} {objective}"
        lines.append(
            f"{key} = {end['value']:.6g}, {side} end: {cost if price > 0 else 'no gain beyond'}"
            + (f"; in practice: {stop}" if stop else "")
        )
    return lines
