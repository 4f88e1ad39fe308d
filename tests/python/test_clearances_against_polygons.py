"""Clearances of the library against tooth polygons that are rotated until they touch.

The polygons share no formula with the library (tests/brute_force). The designs are drawn at random
over modules, pressure angles, shifts, tooth numbers, rims and generators; none of them is in a
document. Limit: 0.005 arcmin in float64, 0.01 arcmin more in float32.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lostmotion.drives import parse_drive
from lostmotion.errors import InputError
from lostmotion.model import Clearances, DesignModel

sys.path.insert(0, str(Path(__file__).parents[1]))
from brute_force import polygons
from brute_force.reference import REFERENCE_A

ARCMIN = math.pi / 180 / 60
BAR_ARCMIN = 0.005
BAR_FLOAT32_ARCMIN = 0.01

GENERATORS = ("cosine", "ellipse", "discs", "rollers", "two rollers", "ring")


def random_design(seed: int) -> polygons.Design:
    """Draw a realistic drive: engagement, deflection and shifts near usual ones."""
    rng = np.random.default_rng(seed)
    kind = GENERATORS[seed % len(GENERATORS)]
    external = kind == "ring"
    module = float(rng.choice([0.1, 0.16, 0.25, 0.4, 0.5, 0.8, 1.0, 1.5, 2.0]))
    teeth = int(2 * rng.integers(30, 161))
    deflection = rng.uniform(0.85, 1.15)
    shift = rng.uniform(0.5, 4.5)
    lead = rng.uniform(-0.1, 0.15) if external else deflection - 1.0 + rng.uniform(-0.02, 0.15)
    beta = {
        "discs": rng.uniform(15, 45),
        "ring": rng.uniform(15, 45),
        "rollers": rng.uniform(10, 35),
    }
    return polygons.Design(
        deformation="external" if external else "internal",
        module_mm=module,
        flexspline_teeth=teeth,
        rigid_teeth=teeth - 2 if external else teeth + 2,
        pressure_angle_deg=float(rng.choice([14.5, 17.5, 20.0, 22.5, 25.0, 28.0])),
        flexspline_shift=shift,
        rigid_shift=shift + lead,
        tooth_height=rng.uniform(1.4, 1.8),
        engagement_depth=rng.uniform(0.8, 1.25),
        root_clearance=0.35 if module <= 0.5 else 0.25,
        rim_thickness_mm=rng.uniform(0.009, 0.02) * module * teeth,
        generator_type="rollers" if kind == "two rollers" else kind,
        deflection_mm=deflection * module,
        contact_half_angle_deg=float(beta.get(kind, 0.0)),
    )


def library_document(design: polygons.Design) -> dict[str, Any]:
    """Write the same drive as a drive file."""
    z = design.flexspline_teeth
    return {
        "drive": {"name": "random", "ratio": z // 2, "rated_torque_Nm": 10.0},
        "design": {
            "teeth": {
                "deformation": design.deformation,
                "module_mm": design.module_mm,
                "flexspline_teeth": z,
                "rigid_teeth": design.rigid_teeth,
                "pressure_angle_deg": design.pressure_angle_deg,
                "flexspline_shift": design.flexspline_shift,
                "rigid_shift": design.rigid_shift,
                "tooth_height": design.tooth_height,
                "engagement_depth": design.engagement_depth,
                "root_clearance": design.root_clearance,
                "face_width_mm": max(0.15 * z * design.module_mm, 0.5),
            },
            "generator": {
                "type": design.generator_type,
                "deflection_mm": design.deflection_mm,
                "contact_half_angle_deg": design.contact_half_angle_deg,
            },
            "flexspline": {"rim_thickness_mm": design.rim_thickness_mm},
        },
    }


def library_model(design: polygons.Design, bits: int = 64) -> DesignModel:
    """Give the same drive to the library."""
    return DesignModel(parse_drive(library_document(design)).design, bits)


def random_angles(design: polygons.Design, seed: int, count: int) -> np.ndarray:
    """Angles near the deformation axis, where teeth meet, and a few further out."""
    rng = np.random.default_rng(10_000 + seed)
    return np.concatenate((rng.uniform(-20, 60, count - 2), rng.uniform(-85, 85, 2)))


def largest_error_arcmin(found: Clearances, design: polygons.Design, angles: np.ndarray) -> float:
    """Largest difference to the polygons; both must agree on which teeth overlap."""
    worst = 0.0
    for i, angle in enumerate(angles):
        for flank, gaps in (("forward", found.forward_rad), ("backward", found.backward_rad)):
            turned = polygons.gap_arcmin(design, float(angle), flank)
            assert math.isfinite(turned) == math.isfinite(gaps[i]), (design, angle, flank)
            if math.isfinite(turned):
                worst = max(worst, abs(float(gaps[i]) / ARCMIN - turned))
    return worst


@pytest.mark.parametrize("seed", range(48))
def test_random_designs_agree_with_turned_polygons(seed: int) -> None:
    design = random_design(seed)
    try:
        polygons.gap_arcmin(design, 0.0, "forward")
        model = library_model(design)
    except (ValueError, InputError):
        pytest.fail(f"seed {seed} drew a drive that cannot be made: {design}")
    angles = random_angles(design, seed, 8)
    found = model.clearances(angles_rad=np.radians(angles))
    assert largest_error_arcmin(found, design, angles) < BAR_ARCMIN
    single = library_model(design, 32).clearances(angles_rad=np.radians(angles))
    for gap in ("forward_rad", "backward_rad"):
        double = getattr(found, gap)
        both = np.isfinite(double) & np.isfinite(getattr(single, gap))
        difference = np.abs(getattr(single, gap)[both] - double[both]) / ARCMIN
        assert np.all(difference < BAR_FLOAT32_ARCMIN)


def test_the_random_designs_are_worth_comparing() -> None:
    """The teeth touch, clear and interfere, at corners and between them."""
    gaps = []
    for seed in range(48):
        model = library_model(random_design(seed))
        gaps.append(model.clearances().forward_rad / ARCMIN)
    every = np.concatenate(gaps)
    met = every[np.isfinite(every)]
    assert met.size > 500
    assert np.count_nonzero(met < 0) > 20
    assert np.count_nonzero((met > 0) & (met < 2)) > 50


@pytest.mark.parametrize("direction_deg", [0.0, 60.0, 150.0])
def test_the_free_play_of_an_eccentric_generator_is_that_of_moved_polygons(
    direction_deg: float,
) -> None:
    """An eccentricity moves every tooth of both lobes by the same vector, each at its own angle to
    it."""
    design = replace(REFERENCE_A, rigid_shift=3.15, deflection_mm=0.25)
    eccentricity_mm = 0.008
    nominal = library_model(design)
    document = library_document(design)
    document["design"]["generator"] |= {
        "floating": False,
        "eccentricity_mm": eccentricity_mm,
        "eccentricity_angle_deg": direction_deg,
    }
    found = DesignModel(parse_drive(document).design).mesh_state()["free_play_rad"]
    assert found > 0
    gaps = nominal.clearances()
    moved = eccentricity_mm * np.exp(1j * math.radians(direction_deg))
    nearest = {}
    for flank, gap in (("forward", gaps.forward_rad), ("backward", gaps.backward_rad)):
        # An eccentricity of e closes no gap by more than 1.2 e / r.
        near = np.nanmin(gap) + 2.4 * eccentricity_mm / 24.0
        contacts = [
            polygons.first_contact(design, math.degrees(angle), flank, moved_mm=lobe * moved)
            for angle in gaps.angle_rad[gap <= near]
            if abs(math.degrees(angle)) <= 40
            for lobe in (1, -1)
        ]
        nearest[flank] = min(c.gap_rad for c in contacts if c is not None)
    unmoved = nominal.mesh_state()["free_play_rad"]
    expected = (nearest["forward"] + nearest["backward"]) / 2
    assert found == pytest.approx(expected, abs=0.01 * (unmoved - expected))
