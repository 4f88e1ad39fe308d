"""A small design search, written as a spec, and its output files."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lostmotion.drives import format_toml

SPECS = ("robot_joint", "instrument", "ring_generator")
"""The specs that ship with the package."""

REACHED = (
    (1.4280, 0.2967),
    (1.4567, 0.0658),
    (1.8102, 0.0644),
    (2.0617, 0.0630),
    (2.3045, 0.0614),
    (3.3073, 0.0358),
)
"""Designs with a ring wave generator that a search of 2,000 evaluations delivered: arcmin, arcsec.
A front may become shorter only by designs that are no worse than these."""

FILES = ("best.toml", "front.csv", "history.csv", "combinations.csv", "certificate.json")
"""Files that must have the same bytes; the report also contains the command and the date."""

SMALL: dict[str, Any] = {
    "search": {
        "objectives": ["tolerance_lost_motion", "cost"],
        "seed": 3,
        "evaluations": 2500,
        "fixed": {"teeth.module_mm": 0.25, "teeth.face_width_mm": 10},
        "range": {
            "generator.type": {"choose": ["discs", "rollers"]},
            "teeth.flexspline_teeth": {"choose": [198, 200]},
            "teeth.flexspline_shift": [2, 4],
            "teeth.shift_difference": [-0.3, 0.3],
            "generator.deflection_modules": [0.88, 1.05],
            "generator.contact_half_angle_deg": [22, 35],
            "teeth.engagement_depth": [0.6, 1.3],
            "tolerance.0.it_grade": [5, 9],
        },
        "limits": {"safety_factor_min": 1.5},
    },
    "drive": {"name": "small", "rated_torque_Nm": 40},
    "design": {
        "tolerance": [{"kind": "hole", "name": "bore", "zone": "generator", "nominal_mm": 48}]
    },
}


Write = Callable[[dict[str, Any]], Path]


def format_spec(document: dict[str, Any]) -> str:
    """Format a spec; a list of choices is an inline table."""
    plain = copy.deepcopy(document)
    chosen = {}
    for key, value in list(plain["search"].get("range", {}).items()):
        if isinstance(value, dict):
            chosen[key] = plain["search"]["range"].pop(key)
    text = format_toml(plain)
    lines = "".join(f'"{k}" = {{choose = {json.dumps(v["choose"])}}}\n' for k, v in chosen.items())
    return text.replace("[search.range]\n", f"[search.range]\n{lines}")


def left_by(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in FILES}
