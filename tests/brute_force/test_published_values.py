"""The brute-force reference reproduces the reference values of the geometry.

Angles count from the deformation axis. The gap tables are values of two reference gears, with teeth
at exact arc length along the neutral line, printed to 0.001 arcmin.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from .neutral_line import (
    QUARTER_TURN,
    EllipseLine,
    RingLine,
    WaveShape,
    arc_length,
    neutral_line,
    place,
    wave_shape,
)
from .polygons import (
    ARCMIN_PER_RAD,
    Design,
    first_contact,
    gap_arcmin,
    meshing_outline,
    overlap_area_mm2,
    radii,
    tooth_flank,
)
from .reference import REFERENCE_A

REFERENCE_E = replace(
    REFERENCE_A,
    deformation="external",
    flexspline_teeth=202,
    rigid_teeth=200,
    rigid_shift=3.05,
    generator_type="ring",
)
"""The same size with a ring wave generator outside."""

TABLE_TOLERANCE_ARCMIN = 0.001
"""One unit of the last printed digit of the gap tables."""

GENERATORS_A = {
    "discs": ("discs", 30.0),
    "cosine": ("cosine", 0.0),
    "four rollers": ("rollers", 30.0),
}

ANGLES_A_DEG = (-10, -5, 0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50)

GAPS_A_ARCMIN = {
    "discs": (
        1.531, 0.642, 0.174, 0.011, 0.069, 0.351, 0.780, 1.277, 1.761, 2.163, 2.368, 2.206, 1.614,
    ),
    "cosine": (
        1.688, 0.691, 0.174, -0.001, 0.094, 0.445, 0.952, 1.506, 1.998, 2.318, 2.347, 1.990, 1.216,
    ),
    "four rollers": (
        1.417, 0.607, 0.174, 0.020, 0.051, 0.283, 0.654, 1.105, 1.574, 2.021, 2.332, 2.322, 1.877,
    ),
}  # fmt: skip

CONTACT_RADII_A_MM = (
    25.788, 25.788, 25.788, 26.084, 26.074, 26.059, 26.037, 26.010, 25.976, 25.938, 25.896, 25.788,
    25.788,
)  # fmt: skip
"""Contact radii with discs."""

GAPS_E_ARCMIN = {
    -20: 1.893,
    -10: 0.567,
    0: 0.090,
    5: 0.282,
    10: 0.905,
    20: 3.733,
    30: 9.119,
    40: 17.519,
    50: 28.646,
}

SHAPE_ANGLES_DEG = (0, 15, 30, 45, 60, 75, 90)

SHAPES = {
    ("cosine", 0.0): (
        (1, 0.86603, 0.50000, 0, -0.50000, -0.86603, -1),
        (0, -0.25000, -0.43301, -0.50000, -0.43301, -0.25000, 0),
        (0, 0.75000, 1.29904, 1.50000, 1.29904, 0.75000, 0),
    ),
    ("rollers", 0.0): (
        (1, 0.84009, 0.44919, -0.03620, -0.48870, -0.80507, -0.91828),
        (0, -0.24738, -0.41969, -0.47435, -0.40368, -0.23046, 0),
        (0, 0.89121, 1.33997, 1.39205, 1.12023, 0.61939, 0),
    ),
    ("rollers", 30.0): (
        (1, 0.89481, 0.56914, 0.03897, -0.52214, -0.93643, -1.08794),
        (0, -0.25265, -0.44934, -0.53188, -0.46716, -0.27148, 0),
        (0, 0.55749, 1.24694, 1.68147, 1.49153, 0.86005, 0),
    ),
    ("rollers", 35.0): (
        (1, 0.91377, 0.63041, 0.10001, -0.53012, -1.01603, -1.19665),
        (0, -0.25435, -0.46138, -0.56209, -0.50504, -0.29736, 0),
        (0, 0.42033, 1.07412, 1.82834, 1.75945, 1.04644, 0),
    ),
    ("discs", 20.0): (
        (1, 0.86996, 0.49563, -0.01390, -0.50583, -0.85534, -0.98123),
        (0, -0.25043, -0.43384, -0.49811, -0.42818, -0.24582, 0),
        (0, 0.73732, 1.35619, 1.50535, 1.24599, 0.69776, 0),
    ),
    ("discs", 30.0): (
        (1, 0.88256, 0.53823, 0.01825, -0.51438, -0.90253, -1.04376),
        (0, -0.25153, -0.44226, -0.51739, -0.45082, -0.26083, 0),
        (0, 0.64055, 1.28110, 1.60718, 1.39240, 0.79518, 0),
    ),
}
"""Radial and tangential displacement over deflection, rotation times radius over deflection [-]."""

BENDING = {
    ("cosine", 0.0): (3.000, 3.000),
    ("rollers", 0.0): (4.279, 4.279),
    ("rollers", 30.0): (2.044, 3.433),
    ("rollers", 35.0): (1.455, 4.212),
    ("discs", 20.0): (2.816, 2.816),
    ("discs", 30.0): (2.447, 3.165),
    ("discs", 40.0): (2.192, None),
}
"""Change of curvature times r**2 / w0 [-]: on the axis, and the largest."""

LOBE_FORCE = {
    ("rollers", 0.0): (13.44, 0.005),
    ("rollers", 30.0): (25.9, 0.05),
    ("rollers", 35.0): (37.8, 0.05),
    ("discs", 20.0): (17.0, 0.05),
    ("discs", 30.0): (22.4, 0.05),
}
"""Radial force of one lobe times r**3 / (EI w0) [-], and half its last printed digit."""


def bending(shape: WaveShape, angle_rad: np.ndarray) -> np.ndarray:
    """Change of curvature of the ring times -r**2 / w0 [-]."""
    return shape.radial(angle_rad, 2) + shape.radial(angle_rad)


@pytest.mark.parametrize("generator", SHAPES, ids=str)
def test_ring_shapes_match_the_check_values(generator: tuple[str, float]) -> None:
    shape = wave_shape(*generator)
    angle = np.radians(SHAPE_ANGLES_DEG)
    radial, tangential, rotation = SHAPES[generator]
    last_digit = 0.5e-5 * (1 + 1e-6)
    np.testing.assert_allclose(shape.radial(angle), radial, rtol=0, atol=last_digit)
    np.testing.assert_allclose(shape.tangential(angle), tangential, rtol=0, atol=last_digit)
    np.testing.assert_allclose(shape.rotation(angle), rotation, rtol=0, atol=last_digit)


@pytest.mark.parametrize("generator", BENDING, ids=str)
def test_bending_on_the_axis_and_at_its_largest(generator: tuple[str, float]) -> None:
    shape = wave_shape(*generator)
    on_axis, largest = BENDING[generator]
    found = np.abs(bending(shape, np.linspace(0, QUARTER_TURN, 9001)))
    assert found[0] == pytest.approx(on_axis, abs=0.0005)
    if largest is not None:
        assert found.max() == pytest.approx(largest, abs=0.0005)


@pytest.mark.parametrize("generator", LOBE_FORCE, ids=str)
def test_lobe_force_from_the_cut_at_90_deg(generator: tuple[str, float]) -> None:
    """Cut moment and cut force bend the free arc; the two cuts of a lobe carry its force."""
    angle = np.linspace(math.radians(generator[1]), QUARTER_TURN, 200)
    terms = np.column_stack([np.ones_like(angle), np.sin(angle)])
    moment = bending(wave_shape(*generator), angle)
    factors, *_ = np.linalg.lstsq(terms, moment)
    expected, half_digit = LOBE_FORCE[generator]
    assert 2 * abs(factors[1]) == pytest.approx(expected, abs=half_digit)
    np.testing.assert_allclose(terms @ factors, moment, atol=1e-4)


def test_lobe_force_of_a_cosine_from_its_pressure() -> None:
    """The pressure on the bent ring, along the axis over a lobe, sums up to 6."""
    angle = np.linspace(-QUARTER_TURN, QUARTER_TURN, 2001)
    shape = wave_shape("cosine", 0.0)
    pressure = shape.radial(angle, 4) + 2 * shape.radial(angle, 2) + shape.radial(angle)
    assert np.trapezoid(pressure * np.cos(angle), angle) == pytest.approx(6.0, abs=1e-4)


def test_discs_without_an_arc_are_two_rollers() -> None:
    angle = np.linspace(-QUARTER_TURN, QUARTER_TURN, 91)
    small = wave_shape("discs", 0.01).radial(angle)
    np.testing.assert_allclose(small, wave_shape("rollers", 0.0).radial(angle), atol=1e-3)
    assert wave_shape("discs", 0.0) == wave_shape("rollers", 0.0)


def test_rollers_too_far_apart_are_refused() -> None:
    with pytest.raises(ValueError, match="inward"):
        wave_shape("rollers", 44.0)


@pytest.mark.parametrize("generator_type", ["cosine", "discs", "rollers", "ring", "ellipse"])
@pytest.mark.parametrize("deflection_mm", [0.2375, -0.2375])
def test_deformed_line_keeps_its_length_and_the_distance_of_teeth(
    generator_type: str, deflection_mm: float
) -> None:
    mean_mm = 25.1125
    line = neutral_line(generator_type, 30.0, mean_mm, deflection_mm)
    assert float(line.radius(0.0)) == pytest.approx(mean_mm + deflection_mm, abs=1e-12)
    assert arc_length(line, QUARTER_TURN) == pytest.approx(QUARTER_TURN * mean_mm, abs=1e-11)

    placed = [
        place(line, mean_mm, angle) for angle in np.linspace(-QUARTER_TURN, QUARTER_TURN, 181)
    ]
    chords = [abs(after[0] - before[0]) for before, after in pairwise(placed)]
    # A chord of 0.44 mm on a radius of 25 mm is 6e-6 mm shorter than its arc.
    np.testing.assert_allclose(chords, math.pi * mean_mm / 180, atol=8e-6)
    for before, here, after in zip(placed, placed[1:], placed[2:], strict=False):
        along = after[0] - before[0]
        assert (here[1].conjugate() * along / abs(along)).real == pytest.approx(0, abs=2e-5)


def test_length_correction_of_reference_a() -> None:
    line = neutral_line("discs", 30.0, radii(REFERENCE_A).neutral_mm, REFERENCE_A.deflection_mm)
    assert isinstance(line, RingLine)
    assert line.length_correction_mm == pytest.approx(-0.002446, abs=0.5e-6 * 1.01)


def test_ellipse_of_constant_perimeter_against_the_cosine() -> None:
    mean_mm, deflection_mm = 25.11, 0.23
    line = neutral_line("ellipse", 0.0, mean_mm, deflection_mm)
    assert isinstance(line, EllipseLine)
    angle = np.radians(SHAPE_ANGLES_DEG)
    found_um = 1e3 * (line.radius(angle) - mean_mm - deflection_mm * np.cos(2 * angle))
    np.testing.assert_allclose(found_um, (0, -0.9, -2.7, -3.7, -3.2, -1.8, -1.1), atol=0.06)


def test_radii_of_reference_a() -> None:
    found = radii(REFERENCE_A)
    assert found.flexspline_inner_mm == pytest.approx(25.4125)
    assert found.flexspline_outer_mm == pytest.approx(25.85)
    assert found.rigid_inner_mm == pytest.approx(25.7875)
    assert found.neutral_mm == pytest.approx(25.1125)


@pytest.mark.parametrize(("teeth", "shift"), [(200, 3.0), (202, 2.957), (80, 0.0), (60, -0.3)])
def test_flank_is_the_envelope_of_the_rolling_rack(teeth: int, shift: float) -> None:
    """The rack touches every point of the flank and cuts none while it rolls past the gear."""
    module_mm, pressure_angle = 0.25, math.radians(20)
    reference_mm = module_mm * teeth / 2
    inner_mm = reference_mm + module_mm * (shift - 0.5)
    flank = tooth_flank(teeth, shift, module_mm, 20.0, inner_mm, inner_mm + module_mm, points=9)

    roll = np.linspace(-0.5, 0.5, 40_001)[:, None]
    in_rack = flank * np.exp(1j * roll) - 1j * reference_mm * roll
    height = in_rack.real - (reference_mm + module_mm * shift)
    rack_flank = module_mm * math.pi / 4 - height * math.tan(pressure_angle)
    room_mm = (rack_flank - in_rack.imag) * math.cos(pressure_angle)
    # At half a step of 2.5e-5 rad from the contact, the distance at a radius of 10 mm is 1e-9 mm.
    np.testing.assert_allclose(room_mm.min(axis=0), 0, atol=5e-9)


@pytest.mark.parametrize("generator", GAPS_A_ARCMIN)
def test_gaps_of_reference_a(generator: str) -> None:
    generator_type, half_angle = GENERATORS_A[generator]
    design = replace(REFERENCE_A, generator_type=generator_type, contact_half_angle_deg=half_angle)
    forward = [gap_arcmin(design, angle, "forward") for angle in ANGLES_A_DEG]
    np.testing.assert_allclose(
        forward, GAPS_A_ARCMIN[generator], rtol=0, atol=TABLE_TOLERANCE_ARCMIN
    )
    backward = [gap_arcmin(design, -angle, "backward") for angle in ANGLES_A_DEG]
    np.testing.assert_allclose(backward, forward, rtol=0, atol=1e-6)


def test_contact_radii_of_reference_a() -> None:
    contacts = [first_contact(REFERENCE_A, angle, "forward") for angle in ANGLES_A_DEG]
    found = [contact.radius_mm for contact in contacts if contact]
    np.testing.assert_allclose(found, CONTACT_RADII_A_MM, rtol=0, atol=0.0006)


def test_gaps_of_reference_e() -> None:
    for angle, expected in GAPS_E_ARCMIN.items():
        forward = gap_arcmin(REFERENCE_E, angle, "forward")
        assert forward == pytest.approx(expected, abs=TABLE_TOLERANCE_ARCMIN)
        assert gap_arcmin(REFERENCE_E, -angle, "backward") == pytest.approx(forward, abs=1e-6)


@pytest.mark.parametrize("design", [REFERENCE_A, REFERENCE_E], ids=["A", "E"])
def test_gaps_do_not_depend_on_the_points_of_a_flank(design: Design) -> None:
    for angle in (-10, 5, 25, 50):
        coarse = first_contact(design, angle, "forward")
        fine = first_contact(design, angle, "forward", points=1600)
        assert coarse
        assert fine
        assert coarse.gap_rad * ARCMIN_PER_RAD == pytest.approx(
            fine.gap_rad * ARCMIN_PER_RAD, abs=1e-5
        )


@pytest.mark.parametrize("design", [REFERENCE_A, REFERENCE_E], ids=["A", "E"])
def test_gap_angles_do_not_depend_on_size(design: Design) -> None:
    large = replace(design, module_mm=1.0, rim_thickness_mm=2.4, deflection_mm=0.95)
    for angle in (-10, 0, 20, 45):
        expected = gap_arcmin(design, angle, "forward")
        assert gap_arcmin(large, angle, "forward") == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("shift_change", [0.3, -0.3])
def test_profile_shift_of_the_rigid_gear_opens_all_gaps_alike(shift_change: float) -> None:
    """The space grows by the same angle at every radius; with less shift the teeth interfere."""
    shifted = replace(REFERENCE_A, rigid_shift=REFERENCE_A.rigid_shift + shift_change)
    tangent = math.tan(math.radians(REFERENCE_A.pressure_angle_deg))
    change = 2 * shift_change * tangent / REFERENCE_A.rigid_teeth * ARCMIN_PER_RAD
    for angle in (-10, 0, 10, 30, 50):
        expected = gap_arcmin(REFERENCE_A, angle, "forward") + change
        assert gap_arcmin(shifted, angle, "forward") == pytest.approx(expected, abs=1e-5)


def test_teeth_that_share_no_radius_have_no_contact() -> None:
    for angle in (-90, 80, 90):
        assert gap_arcmin(REFERENCE_A, angle, "forward") == math.inf
        assert gap_arcmin(REFERENCE_E, angle, "backward") == math.inf
        assert overlap_area_mm2(REFERENCE_A, angle, twist_rad=0.005) == 0
        assert overlap_area_mm2(REFERENCE_E, angle, twist_rad=0.005) == 0


@pytest.mark.parametrize("design", [REFERENCE_A, REFERENCE_E], ids=["A", "E"])
@pytest.mark.parametrize("angle_deg", [-20, 0, 5, 20, 40])
def test_polygons_overlap_as_soon_as_a_gap_is_used_up(design: Design, angle_deg: float) -> None:
    forward_rad = gap_arcmin(design, angle_deg, "forward") / ARCMIN_PER_RAD
    backward_rad = gap_arcmin(design, angle_deg, "backward") / ARCMIN_PER_RAD
    margin_rad = 1e-4 / ARCMIN_PER_RAD
    assert overlap_area_mm2(design, angle_deg) == 0
    assert overlap_area_mm2(design, angle_deg, forward_rad - margin_rad) == 0
    assert overlap_area_mm2(design, angle_deg, forward_rad + margin_rad) > 0
    assert overlap_area_mm2(design, angle_deg, -backward_rad + margin_rad) == 0
    assert overlap_area_mm2(design, angle_deg, -backward_rad - margin_rad) > 0


def test_interference_shows_as_negative_gap_and_as_area() -> None:
    """Reference A under a cosine cam: the tip of the tooth at 5 deg is 0.001 arcmin too far."""
    cosine = replace(REFERENCE_A, generator_type="cosine")
    assert gap_arcmin(cosine, 5, "forward") < 0
    assert overlap_area_mm2(cosine, 5) > 0
    assert overlap_area_mm2(cosine, 10) == 0


def test_outline_of_a_mesh_has_room_between_all_teeth() -> None:
    pitch_deg = 360 / REFERENCE_A.flexspline_teeth
    flexspline, rigid = meshing_outline(REFERENCE_A, pitch_deg * np.arange(-20, 21))
    assert len(flexspline) == 41
    assert all(polygon.is_valid for polygon in flexspline + rigid)
    assert not any(tooth.intersects(other) for tooth in flexspline for other in rigid)


def test_wrong_names_are_refused() -> None:
    with pytest.raises(ValueError, match="deformation"):
        replace(REFERENCE_A, deformation="inside")
    with pytest.raises(ValueError, match="flank"):
        gap_arcmin(REFERENCE_A, 0, "left")
    with pytest.raises(ValueError, match="generator_type"):
        gap_arcmin(replace(REFERENCE_A, generator_type="cam"), 0, "forward")
    with pytest.raises(ValueError, match="material angle"):
        gap_arcmin(REFERENCE_A, 91, "forward")
