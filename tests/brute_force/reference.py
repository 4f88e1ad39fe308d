"""The drive to which the published values apply."""

from __future__ import annotations

from .polygons import Design

REFERENCE_A = Design(
    deformation="internal",
    module_mm=0.25,
    flexspline_teeth=200,
    rigid_teeth=202,
    pressure_angle_deg=20.0,
    flexspline_shift=3.0,
    rigid_shift=2.957,
    tooth_height=1.75,
    engagement_depth=1.2,
    root_clearance=0.35,
    rim_thickness_mm=0.6,
    generator_type="discs",
    deflection_mm=0.2375,
    contact_half_angle_deg=30.0,
)
"""Size 20, ratio 100, wave generator inside."""
