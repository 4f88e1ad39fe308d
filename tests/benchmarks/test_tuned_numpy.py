"""The tuned NumPy evaluation against the check values of the model specification."""

from __future__ import annotations

import numpy as np
import pytest
import tuned_numpy as tn

ARCMIN = tn.ARCMIN
# The tables of the two-flank and of the spatial solution were made with one flank angle for all
# contacts.
COMMON_ANGLE = np.radians(23.5)
TORSION = 4.48e4  # N·m/rad

SHAPES = {
    ("cosine", 0): (
        (
            "1 0 0  .86603 -.25 .75  .5 -.43301 1.29904  0 -.5 1.5  -.5 -.43301 1.29904 "
            "-.86603 -.25 .75  -1 0 0"
        ),
        3.000,
        3.000,
    ),
    ("rollers", 0): (
        (
            "1 0 0  .84009 -.24738 .89121  .44919 -.41969 1.33997  -.0362 -.47435 1.39205 "
            "-.4887 -.40368 1.12023  -.80507 -.23046 .61939  -.91828 0 0"
        ),
        4.279,
        4.279,
    ),
    ("rollers", 30): (
        (
            "1 0 0  .89481 -.25265 .55749  .56914 -.44934 1.24694  .03897 -.53188 1.68147 "
            "-.52214 -.46716 1.49153  -.93643 -.27148 .86005  -1.08794 0 0"
        ),
        2.044,
        3.433,
    ),
    ("rollers", 35): (
        (
            "1 0 0  .91377 -.25435 .42033  .63041 -.46138 1.07412  .10001 -.56209 1.82834 "
            "-.53012 -.50504 1.75945  -1.01603 -.29736 1.04644  -1.19665 0 0"
        ),
        1.455,
        4.212,
    ),
    ("discs", 20): (
        (
            "1 0 0  .86996 -.25043 .73732  .49563 -.43384 1.35619  -.0139 -.49811 1.50535 "
            "-.50583 -.42818 1.24599  -.85534 -.24582 .69776  -.98123 0 0"
        ),
        2.816,
        2.816,
    ),
    ("discs", 30): (
        (
            "1 0 0  .88256 -.25153 .64055  .53823 -.44226 1.2811  .01825 -.51739 1.60718 "
            "-.51438 -.45082 1.3924  -.90253 -.26083 .79518  -1.04376 0 0"
        ),
        2.447,
        3.165,
    ),
}

GAPS_A_DEG = np.array([-10, -5, 0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50])
GAPS_A = {
    "discs": "1.531 .642 .174 .011 .069 .351 .780 1.277 1.761 2.163 2.368 2.206 1.614",
    "cosine": "1.688 .691 .174 -.001 .094 .445 .952 1.506 1.998 2.318 2.347 1.990 1.216",
    "rollers": "1.417 .607 .174 .020 .051 .283 .654 1.105 1.574 2.021 2.332 2.322 1.877",
}
RADII_A = (
    "25.788 25.788 25.788 26.084 26.074 26.059 26.037 26.010 25.976 25.938 25.896 25.788 25.788"
)


def numbers(text: str) -> np.ndarray:
    """Read a row of a printed table."""
    return np.array(text.split(), dtype=float)


def line_of(design: dict) -> tuple[dict, dict]:
    """Give geometry and neutral line of a design."""
    geo = tn.geometry(design)
    return geo, tn.neutral_line(geo["kind"], geo["beta"], geo["r_m"], geo["deflection"])


def mesh_at(contacts: dict, torque_Nm: np.ndarray) -> dict:
    """Read the mesh at positive torques."""
    torque = 1e3 * np.asarray(torque_Nm, dtype=float)
    return tn.mesh_shares(contacts, tn.mesh_path(contacts, torque.max()), torque)


@pytest.mark.parametrize(("generator", "printed"), SHAPES.items())
def test_shapes_match_the_printed_table(generator, printed):
    kind, beta = generator[0], np.radians(generator[1])
    phi = np.radians(np.arange(0.0, 91.0, 15.0))
    found = np.stack(tn.first_order(kind, beta, phi), axis=1).ravel()
    assert found == pytest.approx(numbers(printed[0]), abs=6e-6)
    curvature = tn.shape(kind, beta, np.linspace(0, np.pi / 2, 91))[2]
    assert curvature[0] == pytest.approx(printed[1], abs=6e-4)
    assert np.abs(curvature).max() == pytest.approx(printed[2], abs=6e-4)


@pytest.mark.parametrize("generator", SHAPES)
def test_slope_is_the_derivative_and_the_length_is_kept(generator):
    kind, beta = generator[0], np.radians(generator[1])
    phi, step = np.radians(np.linspace(-88, 88, 50)), 1e-6
    w, slope, _ = tn.shape(kind, beta, phi)
    difference = (tn.shape(kind, beta, phi + step)[0] - tn.shape(kind, beta, phi - step)[0]) / 2e-6
    assert slope == pytest.approx(difference, abs=1e-8)
    assert w == pytest.approx(tn.shape(kind, beta, -phi)[0], abs=1e-15)


def test_radii_of_reference_a():
    geo, line = line_of(tn.REFERENCE_A)
    expected = {
        "base_f": 23.49232,
        "base_r": 23.72724,
        "root_f": 25.4125,
        "r_m": 25.1125,
        "tip_f": 25.85,
        "tip_r": 25.7875,
    }
    for key, value in expected.items():
        assert geo[key] == pytest.approx(value, abs=5e-6)
    assert line["c0"] == pytest.approx(-0.002446, abs=6e-7)
    assert line["arc"][-1] == pytest.approx(np.pi / 2 * 25.1125, rel=1e-14)


@pytest.mark.parametrize("kind", GAPS_A)
def test_clearances_of_reference_a(kind):
    geo, line = line_of(tn.REFERENCE_A | {"generator": kind})
    phi = np.radians(GAPS_A_DEG.astype(float))
    ahead = tn.clearances(geo, line, phi)
    assert ahead["gap"] / ARCMIN == pytest.approx(numbers(GAPS_A[kind]), abs=0.003)
    back = tn.clearances(geo, line, -phi, forward=False)
    assert back["gap"] == pytest.approx(ahead["gap"], abs=1e-12)
    assert np.degrees(ahead["flank_angle"]).min() > 22.4
    assert np.degrees(ahead["flank_angle"]).max() < 24.35
    if kind == "discs":
        assert ahead["radius"] == pytest.approx(numbers(RADII_A), abs=0.003)


def test_clearances_of_the_external_reference():
    geo, line = line_of(tn.REFERENCE_E)
    phi = np.radians([-20.0, -10, 0, 5, 10, 20, 30, 40, 50])
    printed = numbers("1.893 .567 .090 .282 .905 3.733 9.119 17.519 28.646")
    ahead = tn.clearances(geo, line, phi)["gap"]
    back = tn.clearances(geo, line, -phi, forward=False)["gap"]
    assert ahead / ARCMIN == pytest.approx(printed, abs=0.003)
    assert back == pytest.approx(ahead, abs=1e-12)


def test_clearances_do_not_depend_on_the_module():
    larger = {k: 2 * tn.REFERENCE_A[k] for k in ("module_mm", "deflection_mm", "rim_thickness_mm")}
    phi = np.radians(GAPS_A_DEG.astype(float))
    one = tn.clearances(*line_of(tn.REFERENCE_A), phi)["gap"]
    two = tn.clearances(*line_of(tn.REFERENCE_A | larger), phi)["gap"]
    assert two == pytest.approx(one, abs=1e-9)


def test_rigid_shift_opens_all_gaps_alike():
    geo, line = line_of(tn.REFERENCE_A)
    wider, _ = line_of(tn.REFERENCE_A | {"rigid_shift": 2.957 + 0.1})
    phi = np.radians(GAPS_A_DEG.astype(float))
    change = tn.clearances(wider, line, phi)["gap"] - tn.clearances(geo, line, phi)["gap"]
    assert change == pytest.approx(2 * 0.1 * np.tan(geo["alpha"]) / 202, abs=1e-12)


def test_phases_hold_the_flanks_of_every_phase():
    geo, line = line_of(tn.REFERENCE_A)
    gaps = tn.clearances_by_phase(geo, line)
    assert gaps["angle"].size == 8 * 100 + 1
    for k in range(8):
        phi = tn.tooth_angles(200, k / 8)
        where = np.searchsorted(gaps["angle"], phi - 1e-9)
        for forward, key in ((True, "gap"), (False, "backward_gap")):
            one = tn.clearances(geo, line, phi, forward)["gap"]
            assert gaps[key][where] == pytest.approx(one, abs=1e-12)


@pytest.mark.parametrize(
    ("factor", "printed"),
    [(0.89, -1.04), (0.95, 0.21), (1.0, 0.0), (1.05, -0.57), (1.11, -1.33), (1.26, -3.51)],
)
def test_smallest_gap_of_a_section(factor, printed):
    geo, _ = line_of(tn.REFERENCE_A)
    line = tn.neutral_line(geo["kind"], geo["beta"], geo["r_m"], factor * geo["deflection"])
    # The inner sections touch steeply near 53 deg: the table is a scan in steps of 0.25 deg, and
    # the tooth phases, which are at other angles, find up to 0.05 arcmin less.
    phi = np.radians(np.linspace(-60, 60, 481))
    smallest = tn.clearances(geo, line, phi)["gap"].min() / ARCMIN
    assert smallest == pytest.approx(printed, abs=0.0051)
    by_phase = tn.clearances_by_phase(geo, line)["gap"].min() / ARCMIN
    assert by_phase == pytest.approx(smallest, abs=0.05)


def test_independent_springs():
    gap, stiffness = np.array([0, 1e-4, 3e-4]), np.array([1000.0, 2000, 3000])
    rotation, engaged = tn.independent_springs(gap, stiffness, np.array([0.05, 0.4, 1.0]))
    assert rotation == pytest.approx([5e-5, 2e-4, 3.5e-4], rel=1e-12)
    assert engaged.tolist() == [1, 2, 3]


def test_path_without_ring_equals_independent_springs():
    contacts = tn.mesh_contacts(tn.REFERENCE_A | {"radial_factor": 0.0})
    ahead = contacts["sign"] > 0
    stiffness = 2 * contacts["radius"] ** 2 / contacts["tooth"] / 1e3
    torque = np.array([0.5, 3.0, 40.0, 80.0])
    rotation, engaged = tn.independent_springs(contacts["gap"][ahead], stiffness[ahead], torque)
    mesh = mesh_at(contacts, torque)
    assert mesh["rotation"] == pytest.approx(rotation, rel=1e-10)
    assert mesh["engaged"].tolist() == engaged.tolist()


def test_rectangular_tooth():
    height, angle = np.array([0.5]), np.array([np.radians(20.0)])
    found = tn.tooth_compliance(lambda y: np.full_like(y, 0.25), height, angle, 10.0)
    assert found == pytest.approx(3.062184e-6, rel=1e-6)


def test_tooth_of_a_fine_drive():
    depth = {"tooth_height": 1.8, "engagement_depth": 1.1}
    design = tn.REFERENCE_A | {"flexspline_shift": 5.0, "rigid_shift": 4.957} | depth
    geo = tn.geometry(design)
    at = geo["tip_f"] - np.array([0.0, 0.55]) * geo["module"]  # tip and middle of the engagement
    pair = tn.pair_compliance(design, geo, geo["tip_r"] + 0 * at, at)
    assert pair["flexspline"] == pytest.approx([3.7e-6 + 2.0e-6, 1.38e-6 + 1.34e-6], rel=0.03)
    middle = np.array([geo["tip_r"] + 0.55 * geo["module"]])
    rigid = tn.pair_compliance(design, geo, middle, at[:1])["rigid"][0]
    # Printed 1.27e-6 to 2.3e-6; the depth of that root is not, and a shallow one is stiffer.
    assert 1.2e-6 < rigid < 2.3e-6


def test_calibrated_characteristic():
    torque = numbers("0.4 1.6 4 7 10 16 25 40 60 80")
    total = numbers(".097 .387 .918 1.506 2.002 2.796 3.948 5.800 8.199 10.560")
    mesh = numbers(".067 .264 .612 .969 1.235 1.569 2.031 2.732 3.597 4.424")
    found = mesh_at(tn.mesh_contacts(tn.REFERENCE_A, from_first_contact=True), torque)
    assert found["rotation"] / ARCMIN == pytest.approx(mesh, abs=0.0011)
    assert found["engaged"].tolist() == [2, 2, 4, 6, 8, 10, 13, 17, 22, 24]
    rotation = (found["rotation"] + torque / TORSION) / ARCMIN
    assert rotation == pytest.approx(total, abs=0.0045)  # torsion constant printed to 3 digits


def test_uncalibrated_characteristic():
    design = tn.REFERENCE_A | {"radial_factor": 1.0}
    torque = np.array([7.0, 25.0, 80.0])
    found = mesh_at(tn.mesh_contacts(design, from_first_contact=True), torque)["rotation"]
    rotation = (found + torque / 9.9e4) / ARCMIN
    assert rotation == pytest.approx([0.418, 1.406, 4.079], abs=0.006)


@pytest.mark.parametrize(
    ("shift", "smallest", "ratio", "lost_motion"),
    [
        (-0.12, -1.48, 1.18, 0.33),
        (-0.08, -0.99, 1.04, 0.40),
        (-0.04, -0.49, 0.82, 0.41),
        (-0.02, -0.24, 0.66, 0.40),
        (0.0, 0.0, 0.56, 0.75),
        (0.02, 0.25, 0.48, 1.24),
        (0.05, 0.62, 0.40, 1.99),
    ],
)
def test_stiffness_ratio_shows_the_smallest_gap(shift, smallest, ratio, lost_motion):
    design = tn.REFERENCE_A | {"rigid_shift": 2.957 + shift}
    contacts = tn.mesh_contacts(design, flank_angle=COMMON_ANGLE)
    assert contacts["gap"].min() / ARCMIN == pytest.approx(smallest, abs=0.0051)
    torque = np.array([1.6, 7.0, 25.0, 80.0])
    rotation = mesh_at(contacts, torque)["rotation"] + torque / TORSION
    first, third = 7.0 / rotation[1], 55.0 / (rotation[3] - rotation[2])
    assert first / third == pytest.approx(ratio, abs=0.0075)
    assert 2 * rotation[0] / ARCMIN == pytest.approx(lost_motion, abs=0.0051)


def test_spatial_model():
    torque = np.array([1.6, 7.0, 40.0])

    def rotation(opening: float, sections: int) -> np.ndarray:
        design = tn.REFERENCE_A | {"rigid_shift": 2.957 + opening}
        factors = np.linspace(0.89, 1.11, sections) if sections > 1 else np.ones(1)
        contacts = tn.mesh_contacts(design, flank_angle=COMMON_ANGLE, section_factors=factors)
        return (mesh_at(contacts, torque)["rotation"] + torque / TORSION) / ARCMIN

    assert rotation(0.0, 1) == pytest.approx([0.374, 1.530, 5.872], abs=0.0015)
    opened = rotation(0.11, 5)
    assert opened == pytest.approx([0.443, 1.429, 6.152], abs=0.0006)
    assert 2 * opened[0] == pytest.approx(0.89, abs=0.006)
    assert rotation(0.11, 3) == pytest.approx(opened, rel=0.03)
    half = rotation(0.055, 5)
    assert 2 * half[0] == pytest.approx(0.30, abs=0.006)
    assert 7.0 / (half[1] * ARCMIN) == pytest.approx(3.2e4, rel=0.01)


@pytest.mark.parametrize("shift", [-0.12, -0.04, 0.0, 0.05])
@pytest.mark.parametrize("phase", [0.0, 0.3])
def test_path_equals_nnls(shift, phase):
    contacts = tn.mesh_contacts(tn.REFERENCE_A | {"rigid_shift": 2.957 + shift}, phase=phase)
    torque = np.array([0.2, 4.0, 33.0, 79.0])
    slow = [tn.rotation_by_nnls(contacts, 1e3 * t) for t in torque]
    assert mesh_at(contacts, torque)["rotation"] == pytest.approx(slow, abs=1e-11)


@pytest.mark.parametrize("shift", [-0.08, 0.0, 0.05])
def test_contributions_add_to_the_total(shift):
    design = tn.REFERENCE_A_FIRST_PRINCIPLES | {"rigid_shift": 2.957 + shift}
    curve = tn.evaluate(design)["characteristic"]
    names = ("radial_gap", "clearance", "ring", "tooth", "radial_chain", "torsion")
    assert sum(curve[n] for n in names) == pytest.approx(curve["total"], abs=1e-15)
    assert all(np.isfinite(curve[n]).all() for n in names)
    assert curve["total"] == pytest.approx(-curve["total"][::-1], abs=1e-15)
    assert (np.diff(curve["total"]) > 0).all()
    assert (np.diff(curve["engaged"][16:]) >= 0).all() or shift < 0


def test_teeth_are_a_small_share_of_the_rotation():
    curve = tn.evaluate(tn.REFERENCE_A)["characteristic"]
    share = curve["tooth"][24] / curve["total"][24]
    assert curve["torque_Nm"][24] == 40.0
    assert 0.005 < share < 0.02


def test_input_shaft_is_reduced_twice():
    shaft = ({"length_mm": 30.0, "diameter_mm": 8.0, "ratio": 100.0},)
    angle = tn.torsion_rotation({"torsion_chain": shaft, "shear_MPa": 8e4}, np.array([40e3]))
    assert angle / ARCMIN * 60 == pytest.approx(0.77, abs=0.005)


def test_preloaded_ball():
    geo = {"mean_radius": 1.0, "wedge": np.pi / 4}
    chain = ({"kind": "balls", "diameter_mm": 3.97, "share": 1.0, "preload_N": 0.0},)
    design = {"radial_chain": chain, "young_MPa": 2.1e5}
    sag = tn.radial_chain_rotation(design, geo, np.array([120.0, -120.0]))
    assert sag == pytest.approx([4.220e-3, -4.220e-3], abs=1e-6)


def test_radial_gap_saturates():
    design = tn.REFERENCE_A | {"radial_gap_mm": 0.02}
    geo = tn.geometry(design) | {"wedge": np.radians(26.0), "mean_radius": 26.4}
    angle = tn.radial_gap_rotation(design, geo, np.array([-1e4, 0.0, 1e4]))
    assert angle == pytest.approx([-3.694944e-4, 0, 3.694944e-4], abs=1e-9)


@pytest.mark.parametrize(
    ("kind", "beta", "printed"),
    [("cosine", 30, 68), ("discs", 30, 72), ("rollers", 30, 78), ("rollers", 0, 98)],
)
def test_bending_stress(kind, beta, printed):
    plain = {"tooth_factor": 1.0, "poisson": 0.0, "generator": kind}
    design = tn.REFERENCE_A | plain | {"contact_half_angle_deg": beta}
    # The printed stresses belong to a radius of 25.6 mm; reference A's 25.1125 gives 4 % more.
    geo = tn.geometry(design) | {"r_m": 25.6}
    found = tn.checks(design, geo, (0.0, 0.0))["bending_MPa"]["value"]
    assert found == pytest.approx(printed, abs=0.6)


def test_checks_of_reference_a():
    report = tn.evaluate(tn.REFERENCE_A)["checks"]
    assert report["form_radius_mm"]["limit"] == pytest.approx(25.5370, abs=5e-5)
    assert report["torsion_MPa"]["value"] == pytest.approx(30, abs=0.3)
    assert report["gap_forward_rad"]["value"] == report["gap_backward_rad"]["value"]
    failed = [name for name, check in report.items() if check["margin"] < 0]
    assert failed == ["free_assembly_mm"]


@pytest.mark.parametrize("generator", ["cosine", "discs", "rollers", "ring"])
def test_every_generator_is_evaluated(generator):
    design = tn.REFERENCE_E if generator == "ring" else tn.REFERENCE_A
    result = tn.evaluate(design | {"generator": generator})
    assert np.isfinite(result["characteristic"]["total"]).all()
    assert all(np.isfinite(c["margin"]) for c in result["checks"].values())
    assert (result["tooth_compliance"]["pair"] > 0).all()
