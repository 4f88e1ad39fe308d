"""Torsion of the cup and deflection of the rim against an independent finite element solver.

Bounds: the closed forms are those of thin walls, so they may differ by the influence of the corner
of cup and diaphragm and of the thickness: 0.5 % of the stiffness of usual cups, 2 % of a thick one,
0.5 % of the deflection.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lostmotion.core import core

pytest.importorskip("skfem", reason="pip install scikit-fem: finite elements to compare with")

sys.path.insert(0, str(Path(__file__).parents[1]))
from brute_force.finite_elements import (
    Cup,
    cup_stiffness_Nm_per_rad,
    rim_deflection,
    tooth_compliance_mm_per_N,
)

STEEL_G_MPA = 8e4

TOOTH_BOUND = 0.08
"""Error for a tooth as short as thick, which is not a beam; Weber's tilt is that of a straight
edge."""


@pytest.mark.parametrize(
    ("cup", "bound"),
    [
        (Cup(25, 0.35, 22.5, 15, 0.53), 0.005),  # size 20, with the library's own proportions
        (Cup(25, 0.35, 35, 15, 0.53), 0.005),  # a long one
        (Cup(12, 0.2, 8, 6, 0.3), 0.005),  # a short one
        (Cup(25, 2, 12, 12, 3), 0.02),  # walls of an eighth of the radius
    ],
)
def test_wall_and_diaphragm_in_series_are_the_cup(cup: Cup, bound: float) -> None:
    c = core()
    wall, diaphragm = (c.ffi.new("lm_torsion_element *") for _ in range(2))
    radius = cup.mean_radius_mm
    c.check(
        c.lib.lm_make_shell_torsion(
            radius, cup.wall_mm, cup.length_mm, STEEL_G_MPA, wall, c.ffi.NULL
        )
    )
    c.check(
        c.lib.lm_make_diaphragm_torsion(
            cup.hub_radius_mm, radius, cup.diaphragm_mm, STEEL_G_MPA, diaphragm, c.ffi.NULL
        )
    )
    series = 1 / (1 / wall.stiffness_Nm_per_rad + 1 / diaphragm.stiffness_Nm_per_rad)
    found = cup_stiffness_Nm_per_rad(cup, STEEL_G_MPA)
    assert series == pytest.approx(found, rel=bound)
    # Twice as many elements change the result by a fifth of the bound at most.
    assert found == pytest.approx(cup_stiffness_Nm_per_rad(cup, STEEL_G_MPA, 24), rel=bound / 5)


@pytest.mark.parametrize("half_angle_deg", [0.0, 20.0, 30.0])
def test_rollers_deflect_the_rim_as_the_neutral_line_states(half_angle_deg: float) -> None:
    c, radius_mm, deflection_mm = core(), 25.3, 0.02
    generator, line = c.ffi.new("lm_generator *"), c.ffi.new("lm_neutral_line *")
    generator.type = c.lib.LM_ROLLERS
    generator.deflection_mm = deflection_mm
    generator.contact_half_angle_rad = math.radians(half_angle_deg)
    internal = c.lib.LM_INTERNAL
    c.check(
        c.lib.lm_make_neutral_line(
            generator, internal, radius_mm, deflection_mm, 64, line, c.ffi.NULL
        )
    )
    angles, found = rim_deflection(radius_mm, 0.6, math.radians(half_angle_deg))
    at, slope = (c.ffi.new("lm_real *") for _ in range(2))
    for angle, deflection in zip(angles[::5], found[::5], strict=True):
        c.lib.lm_neutral_radius(line, angle, at, slope)
        assert (at[0] - radius_mm) / deflection_mm == pytest.approx(deflection, abs=0.005)
    assert np.ptp(found) > 1.8


@pytest.mark.parametrize(
    ("height_mm", "thickness_mm", "load_angle_deg"),
    [(0.5, 0.5, 20), (0.7, 0.5, 20), (0.4, 0.5, 25), (0.5, 0.5, 10)],
)
def test_a_tooth_in_its_rim_gives_as_equation_6_and_the_tilt(
    height_mm: float, thickness_mm: float, load_angle_deg: float
) -> None:
    # A force on a half plane moves it without bound, by the logarithm of its depth: 3 % from 4 to 8
    # tooth thicknesses. The rim of a strain-wave gear has less than 4.
    c, width_mm = core(), 10.0
    angle = math.radians(load_angle_deg)
    material = c.ffi.new("lm_tooth_material *", c.lib.lm_steel_tooth_material())
    material.plane_strain = 1
    bent, tilt = c.ffi.new("lm_tooth_compliance *"), c.ffi.new("lm_real *")
    size = (height_mm, thickness_mm, width_mm, angle, material)
    c.check(c.lib.lm_tooth_rectangle_compliance(*size, bent, c.ffi.NULL))
    c.check(c.lib.lm_foundation_compliance(*size, tilt, c.ffi.NULL))
    steel = (material.youngs_modulus_MPa, material.poisson_ratio)
    found = tooth_compliance_mm_per_N(height_mm, thickness_mm, width_mm, angle, *steel, 4.0)
    assert bent.total_mm_per_N + tilt[0] == pytest.approx(found, rel=TOOTH_BOUND)


@pytest.mark.parametrize(
    ("height_mm", "thickness_mm", "fillet_mm", "taper"),
    [(0.5, 0.5, 0.1, 0.27), (0.35, 0.4, 0.06, 0.2)],
)
def test_a_tooth_with_root_fillets_gives_as_its_outline_states(
    height_mm: float, thickness_mm: float, fillet_mm: float, taper: float
) -> None:
    """Sizes of a double arc of module 0.5; without the fillets the tooth gives 4 % more."""
    c, width_mm, angle = core(), 10.0, math.radians(20)
    steep = math.atan(taper)
    form = fillet_mm * (1 - math.sin(steep))
    centre = thickness_mm / 2 - taper * form + fillet_mm * math.cos(steep)

    def half(y: NDArray[np.float64]) -> NDArray[np.float64]:
        arc = centre - np.sqrt(np.maximum(fillet_mm**2 - (fillet_mm - y) ** 2, 0))
        return np.where(y >= form, thickness_mm / 2 - taper * y, arc)

    material = c.ffi.new("lm_tooth_material *", c.lib.lm_steel_tooth_material())
    material.plane_strain = 1
    bent, tilt = c.ffi.new("lm_tooth_compliance *"), c.ffi.new("lm_real *")
    share = form / height_mm
    places = [c.lib.lm_tooth_sample_height(i, share) for i in range(c.lib.LM_TOOTH_SAMPLES)]
    samples = [float(x) for x in half(height_mm * np.array(places))]
    load = (width_mm, angle, material)
    c.check(c.lib.lm_tooth_outline_compliance(samples, share, height_mm, *load, bent, c.ffi.NULL))
    c.check(c.lib.lm_foundation_compliance(height_mm, thickness_mm, *load, tilt, c.ffi.NULL))
    steel = (material.youngs_modulus_MPa, material.poisson_ratio)
    found = tooth_compliance_mm_per_N(height_mm, 2 * centre, width_mm, angle, *steel, 4.0, half, 16)
    sharp = tooth_compliance_mm_per_N(
        height_mm,
        thickness_mm,
        width_mm,
        angle,
        *steel,
        4.0,
        lambda y: thickness_mm / 2 - taper * y,
        16,
    )
    assert bent.total_mm_per_N + tilt[0] == pytest.approx(found, rel=TOOTH_BOUND)
    assert 1.03 < sharp / found < 1.06
