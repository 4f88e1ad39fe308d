"""Undamaged files of every kind that a command reads."""

from __future__ import annotations

import contextlib
import copy
import io
import math
import random
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

from lostmotion import cli
from lostmotion.drives import format_toml, read_toml
from lostmotion.effects.template import template

RUNS, ROWS = 3, 40

TEMPERATURES_C = ((20, 25, 30), (15, 20, 35))
"""Labels of the runs of two campaigns."""

# Harmonic Drive size 25, ratio above 50 (catalogue/torsional_stiffness.csv), rated 67 N m.
BOUGHT: dict[str, Any] = {
    "drive": {"name": "joint 2", "ratio": 100, "rated_torque_Nm": 67},
    "catalogue": {
        "T1_Nm": 14,
        "T2_Nm": 48,
        "K1_Nm_per_rad": 31e3,
        "K2_Nm_per_rad": 50e3,
        "K3_Nm_per_rad": 57e3,
        "hysteresis_arcmin": 1,
        "lost_motion_arcmin": 1,
    },
}

# Data sheet of a drive as soft as the drawn one with all members of its chains.
SHEET: dict[str, Any] = {
    "drive": {"name": "joint 3", "ratio": 100, "rated_torque_Nm": 40},
    "catalogue": {
        "T1_Nm": 7,
        "T2_Nm": 25,
        "K1_Nm_per_rad": 8e3,
        "K2_Nm_per_rad": 12e3,
        "K3_Nm_per_rad": 14e3,
        "hysteresis_arcmin": 1,
        "lost_motion_arcmin": 1,
    },
}

# A designed drive, size 20: every required key, and a few more.
DRAWN: dict[str, Any] = {
    "drive": {"name": "joint 3", "ratio": 100, "rated_torque_Nm": 40},
    "design": {
        "teeth": {
            "deformation": "internal",
            "module_mm": 0.25,
            "flexspline_teeth": 200,
            "rigid_teeth": 202,
            "pressure_angle_deg": 20,
            "flexspline_shift": 3.0,
            "rigid_shift": 2.957,
            "tooth_height": 1.75,
            "engagement_depth": 1.2,
            "root_clearance": 0.35,
            "face_width_mm": 10,
        },
        "generator": {"type": "discs", "deflection_mm": 0.2375, "contact_half_angle_deg": 30},
        "flexspline": {"rim_thickness_mm": 0.6},
    },
}


def bought() -> dict[str, Any]:
    """Return the catalogue drive."""
    return copy.deepcopy(BOUGHT)


def drawn() -> dict[str, Any]:
    """Return the designed drive with all optional parts of a file: members in each chain."""
    drive, design = copy.deepcopy(DRAWN["drive"]), copy.deepcopy(DRAWN["design"])
    design["flexspline"] |= {"wall_thickness_mm": 0.35, "length_mm": 25}
    return {
        "drive": drive,
        "design": {
            "friction_angle_deg": 5.7,
            "axial_sections": 1,
            **design,
            "material": {"youngs_modulus_GPa": 210, "poisson_ratio": 0.3},
            "support": {"foundation_N_per_mm2": 2600},
            "gap": {"generator_um": 2},
            "radial_chain": [
                {"kind": "ball", "ball_diameter_mm": 4, "balls": 21},
                {"kind": "ring", "mean_radius_mm": 29, "thickness_mm": 5, "width_mm": 10},
            ],
            "torsion_chain": [
                {"kind": "shaft", "outer_diameter_mm": 25, "length_mm": 40, "at": "output"},
                {"kind": "stiffness", "stiffness_Nm_per_rad": 4.48e4},
            ],
            "tolerance": [
                {"kind": "hole", "zone": "generator", "lower_um": 0, "upper_um": 5},
                {"kind": "shaft", "zone": "generator", "it_grade": 5, "nominal_mm": 36},
                {
                    "kind": "link",
                    "zone": "teeth",
                    "influence": 1.374,
                    "lower_um": -1,
                    "upper_um": 1,
                },
            ],
        },
    }


def spec() -> dict[str, Any]:
    """A short search."""
    return {
        "drive": {"rated_torque_Nm": 40},
        "search": {
            "objectives": ["lost_motion", "cost"],
            "seed": 1,
            "evaluations": 60,
            "workers": 1,
            "fixed": {"teeth.module_mm": 0.25, "teeth.face_width_mm": 10},
            "range": {
                "generator.deflection_mm": [0.22, 0.26],
                "generator.type": {"choose": ["discs", "cosine"]},
            },
            "limits": {"safety_factor_min": 1.0},
        },
    }


@cache
def made(what: str, kind: str = "bought", campaign: int = 0) -> dict[str, bytes]:
    """Files that a command makes from sound ones, by name."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        drive, data, spec_file, out = (folder / n for n in ("d.toml", "d.csv", "s.toml", "made"))
        drive.write_text(sound_drive(kind))
        data.write_text(csv_text(recording(campaign)))
        spec_file.write_text(format_toml(spec()))
        out.mkdir()
        words = {
            "evidence": ["diagnose", drive, data, "--save-evidence", out / "one.npz"],
            "fitted": ["fit", drive, data, "--add", "thermal_drift", "-o", out / "fitted.toml"],
            "blob": ["export", drive, "-o", out / "params.bin"],
            "search": ["design", spec_file, "-o", out],
        }[what]
        with contextlib.redirect_stdout(io.StringIO()):
            assert cli.main([*map(str, words), "--quiet"]) == 0, words
        return {file.name: file.read_bytes() for file in sorted(out.iterdir())}


def fitted() -> dict[str, Any]:
    """Return a catalogue drive with a fit and an effect."""
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "fitted.toml"
        file.write_bytes(made("fitted")["fitted.toml"])
        document: dict[str, Any] = read_toml(file, "a drive file")
    return document


DRIVES = {"bought": bought, "drawn": drawn, "fitted": fitted}


def sound_drive(kind: str) -> str:
    """Return a drive file."""
    return format_toml(DRIVES[kind]())


def sound_file(file: str, kind: str, place: int = 0) -> bytes:
    """Return a file of a kind, for a drive of a kind; `place` distinguishes a command's files."""
    if file == "EVIDENCE":
        return made("evidence", kind, place)["one.npz"]
    if file == "OWN":
        return template("own", in_c=False)["own.py"].encode()
    if file == "DRIVE":
        blob = kind == "blob"
        return made("blob")["params.bin"] if blob else sound_drive(kind).encode()
    if file == "SHEET":
        return format_toml(SHEET).encode()
    return (format_toml(spec()) if file == "SPEC" else csv_text(recording())).encode()


def recording(campaign: int = 0) -> list[list[str]]:
    """Three runs of a torque that swings, with friction and a little noise; the header first."""
    noise = random.Random(campaign)
    table = [["run", "time_s", "torque_Nm", "lost_motion_rad", "temperature_C"]]
    for run in range(RUNS):
        slip = 0.0
        for i in range(ROWS):
            torque = 12.0 * (1 + run) * math.sin(2 * math.pi * i / (ROWS / 2))
            slip = min(max(slip, torque - 2.0), torque + 2.0)
            angle = torque / 31e3 + (slip - torque) * 2e-6 + noise.gauss(0, 2e-6)
            row = (100.0 * run + 0.01 * i, torque, angle, TEMPERATURES_C[campaign][run])
            table.append([str(run), *(f"{value:.7g}" for value in row)])
    return table


def csv_text(table: list[list[str]], delimiter: str = ",", end: str = "\n") -> str:
    """Write a table as a CSV file."""
    return end.join(delimiter.join(row) for row in table) + end
