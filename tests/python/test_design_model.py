"""The design model from Python: published check values, and properties of random designs."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from conftest import DRAWN
from lostmotion.catalogue import PARTS
from lostmotion.core import Bits, core
from lostmotion.drives import parse_drive
from lostmotion.errors import InputError, LibraryError
from lostmotion.model import DesignModel, design_model, make_torsion_curve
from lostmotion.predict import clearances, predict
from lostmotion.structs import DesignKey, design_keys, field_path, make_drive
from lostmotion.units import ARCMIN

Document = dict[str, Any]

BITS: tuple[Bits, ...] = (64, 32)


def variant(**changes: Any) -> Document:
    document = copy.deepcopy(DRAWN)
    for path, value in changes.items():
        section, _, key = path.partition("__")
        document["design"][section][key] = value
    return document


# Reference design A: forward gap in arcmin by exact placement, tolerance 0.003.
ANGLES = (-10, -5, 0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50)
GAPS = {
    "discs": (
        1.531, 0.642, 0.174, 0.011, 0.069, 0.351, 0.780,
        1.277, 1.761, 2.163, 2.368, 2.206, 1.614,
    ),
    "cosine": (
        1.688, 0.691, 0.174, -0.001, 0.094, 0.445, 0.952,
        1.506, 1.998, 2.318, 2.347, 1.990, 1.216,
    ),
    "rollers": (
        1.417, 0.607, 0.174, 0.020, 0.051, 0.283, 0.654,
        1.105, 1.574, 2.021, 2.332, 2.322, 1.877,
    ),
}  # fmt: skip


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("generator", GAPS)
def test_reference_A_has_its_published_clearances(generator: str, bits: Bits) -> None:
    design = parse_drive(variant(generator__type=generator)).design
    assert design is not None
    found = DesignModel(design, bits).clearances(angles_rad=np.radians(ANGLES))
    atol = 0.003 if bits == 64 else 0.01
    np.testing.assert_allclose(found.forward_rad / ARCMIN, GAPS[generator], atol=atol)
    mirrored = DesignModel(design, bits).clearances(angles_rad=-np.radians(ANGLES))
    np.testing.assert_allclose(mirrored.backward_rad / ARCMIN, GAPS[generator], atol=atol)


def test_reference_A_has_its_published_contact_radii() -> None:
    answer = clearances(parse_drive(DRAWN), 0.0, np.radians(ANGLES))
    expected = [
        25.788, 25.788, 25.788, 26.084, 26.074, 26.059, 26.037,
        26.010, 25.976, 25.938, 25.896, 25.788, 25.788,
    ]  # fmt: skip
    np.testing.assert_allclose(answer["contact_radius_mm"], expected, atol=6e-4)


def test_reference_E_has_its_published_clearances() -> None:
    # External deformation: ring outside; polygons turned until they touch, tolerance 0.003 arcmin.
    document = variant(
        teeth__deformation="external",
        teeth__flexspline_teeth=202,
        teeth__rigid_teeth=200,
        teeth__rigid_shift=3.05,
        generator__type="ring",
    )
    angles = np.radians([-20, -10, 0, 5, 10, 20, 30, 40, 50])
    answer = clearances(parse_drive(document), 0.0, angles)
    expected = [1.893, 0.567, 0.090, 0.282, 0.905, 3.733, 9.119, 17.519, 28.646]
    np.testing.assert_allclose(answer["forward_arcmin"], expected, atol=0.003)


def test_every_tooth_of_a_lobe_is_listed_once_and_none_without_contact() -> None:
    answer = clearances(parse_drive(DRAWN))
    angle = np.array(answer["angle_deg"])
    assert answer["schema"] == "lostmotion.clearances/1"
    assert angle.size == 101  # 200 teeth: every 1.8 deg from -90 to 90
    np.testing.assert_allclose(np.diff(angle), 1.8)
    assert (angle[0], angle[-1]) == pytest.approx((-90, 90))
    for i, overlap in enumerate(answer["overlap"]):
        assert (answer["forward_arcmin"][i] is not None) == overlap
        assert (answer["contact_radius_mm"][i] is not None) == overlap
    assert answer["forward_arcmin"] == pytest.approx(answer["backward_arcmin"][::-1], abs=1e-9)
    shifted = clearances(parse_drive(DRAWN), np.radians(0.9))
    np.testing.assert_allclose(shifted["angle_deg"], angle[:-1] + 0.9)


def test_interference_keeps_its_sign() -> None:
    tight = clearances(parse_drive(variant(teeth__rigid_shift=2.9)), 0.0, [0.0])
    assert tight["forward_arcmin"][0] < 0
    # The gap of all teeth moves by 2 dx2 tan(alpha) / z2.
    moved = -2 * 0.057 * np.tan(np.radians(20)) / 202 / ARCMIN
    assert tight["forward_arcmin"][0] - 0.174 == pytest.approx(moved, abs=0.01)


def test_axial_sections_are_listed_one_after_the_other() -> None:
    document = variant()
    document["design"]["axial_sections"] = 3
    answer = clearances(parse_drive(document), 0.0, [0.0, 0.1])
    assert answer["section"] == [0, 0, 1, 1, 2, 2]
    assert len(set(answer["forward_arcmin"][::2])) == 3


def test_the_prediction_of_a_drawn_drive_has_every_promised_key() -> None:
    answer = predict(parse_drive(DRAWN), np.linspace(-40, 40, 9))
    assert answer["schema"] == "lostmotion.prediction/1"
    assert tuple(answer["parts_arcmin"]) == PARTS
    for key in ("tolerance_um", "tolerance_lost_motion_arcmin"):
        assert set(answer[key]) == {"worst_min", "worst_max", "probable_min", "probable_max"}
    assert answer["reversal_torque_Nm"] == pytest.approx(1.6)
    at = predict(parse_drive(DRAWN), [-1.6, 1.6])["total_arcmin"]
    assert answer["reversal_lost_motion_arcmin"] == pytest.approx(at[1] - at[0], rel=1e-9)
    assert answer["engaged_teeth_per_lobe"] == answer["engaged_teeth_per_lobe"][::-1]
    assert {check["name"] for check in answer["checks"]} >= {"form_radius", "safety_factor"}


def test_a_radial_gap_closes_first_and_shows_in_its_own_part() -> None:
    # Equation (9): 20 um at a flank angle of 26 deg and r = 26.4 mm are 76.2 arcsec; here 24.2 deg.
    document = variant()
    document["design"]["gap"] = {"generator_um": 20}
    answer = predict(parse_drive(document), [-40.0, 0.01, 0.8, 40.0])
    gap = answer["parts_arcmin"]["radial_gap"]
    full = 0.020 * np.tan(answer["flank_angle_rad"]) / 25.9375 / ARCMIN
    assert gap[3] == pytest.approx(full, rel=1e-6)
    assert gap[0] == pytest.approx(-full, rel=1e-6)
    assert 0 < gap[1] < full
    assert gap[2] == pytest.approx(full, rel=1e-6)  # closed below 2 % of the rated torque
    assert 0 < answer["gap_closing_torque_Nm"] < 0.8


def test_torques_that_do_not_rise_are_refused_by_the_library() -> None:
    model = design_model(parse_drive(DRAWN))
    with pytest.raises(LibraryError, match="torque_Nm: a sequence that must rise does not"):
        model.torsion_curve([1.0, 1.0])


def test_a_design_becomes_a_torsion_curve_through_zero() -> None:
    drive = parse_drive(DRAWN)
    torsion_curve = make_torsion_curve(drive, 60.0)
    assert torsion_curve.torque_Nm[-1] == 60.0
    torque = np.array([-33.0, 0.0, 7.7, 25.0])
    expected = design_model(drive).torsion_curve(torque).total_rad
    np.testing.assert_allclose(torsion_curve(torque), expected, atol=0.002 * ARCMIN)


@st.composite
def designs(draw: st.DrawFn) -> Document:
    """Draw designs from ranges that a designer would search; not all of them can be built."""
    half = draw(st.integers(40, 160))
    module = draw(st.floats(0.1, 2.0))
    flexspline_shift = draw(st.floats(0.5, 5.0))
    generator = draw(st.sampled_from(["cosine", "ellipse", "discs", "rollers"]))
    document: Document = {
        "drive": {"ratio": half, "rated_torque_Nm": 40 * (2 * half * module / 50) ** 3},
        "design": {
            "teeth": {
                "module_mm": module,
                "flexspline_teeth": 2 * half,
                "rigid_teeth": 2 * half + 2,
                "pressure_angle_deg": draw(st.floats(18, 30)),
                "flexspline_shift": flexspline_shift,
                "rigid_shift": flexspline_shift - draw(st.floats(-0.1, 0.12)),
                "tooth_height": draw(st.floats(1.4, 1.9)),
                "engagement_depth": draw(st.floats(0.9, 1.4)),
                "face_width_mm": 40 * module,
            },
            "generator": {
                "type": generator,
                "deflection_mm": draw(st.floats(0.85, 1.1)) * module,
                "contact_half_angle_deg": draw(st.floats(20, 35)),
            },
        },
    }
    return document


def build(document: Document) -> DesignModel:
    try:
        return design_model(parse_drive(document))
    except (InputError, LibraryError):
        assume(False)
        raise


def evaluate(document: Document, torque: Any) -> Any:
    try:
        return build(document).torsion_curve(torque)
    except InputError as error:
        # Teeth that cannot meet, or that are pointed before they meet, are not a design.
        assume("teeth that cannot touch" not in str(error) and "tooth_height" not in str(error))
        raise


random_designs = settings(
    max_examples=500, deadline=None, suppress_health_check=[HealthCheck.filter_too_much]
)


@random_designs
@given(designs())
def test_contributions_add_up_and_the_torsion_curve_rises_through_zero(document: Document) -> None:
    rated = document["drive"]["rated_torque_Nm"]
    found = evaluate(document, np.linspace(-2, 2, 41) * rated)
    scale = found.total_rad[-1]
    assert scale > 0
    np.testing.assert_allclose(sum(found.parts_rad.values()), found.total_rad, atol=1e-10 * scale)
    assert found.total_rad[20] == 0
    assert np.all(np.diff(found.total_rad) > 0)
    for part in found.parts_rad.values():
        assert np.all(part * np.sign(found.torque_Nm) >= -1e-10 * scale)


@random_designs
@given(designs(), st.floats(0, 1))
def test_exchanging_the_flanks_mirrors_the_torsion_curve(document: Document, at: float) -> None:
    model = build(document)
    pitch = 2 * np.pi / document["design"]["teeth"]["flexspline_teeth"]
    torque = np.linspace(-1, 1, 9) * document["drive"]["rated_torque_Nm"]
    try:
        one = model.torsion_curve(torque).total_rad
    except InputError:
        assume(False)
        return
    np.testing.assert_allclose(one, -one[::-1], atol=1e-7 * one[-1])
    gaps = model.clearances(at * pitch)
    mirrored = model.clearances((1 - at) * pitch)
    both = np.isin(np.round(gaps.angle_rad, 9), np.round(-mirrored.angle_rad, 9))
    back = np.isin(np.round(mirrored.angle_rad, 9), np.round(-gaps.angle_rad, 9))
    np.testing.assert_allclose(gaps.forward_rad[both], mirrored.backward_rad[back][::-1], atol=1e-9)


def toleranced(document: Document, links: list[dict[str, Any]]) -> DesignModel:
    document = copy.deepcopy(document)
    document["design"]["tolerance"] = links
    return design_model(parse_drive(document))


def test_tolerances_of_no_width_leave_the_drive_as_drawn(drawn: Document) -> None:
    exact = {"kind": "hole", "zone": "generator", "lower_um": 0, "upper_um": 0}
    torque = np.linspace(-40, 40, 9)
    plain, model = toleranced(drawn, []), toleranced(drawn, [exact, exact | {"zone": "teeth"}])
    assert set(model.tolerance_limits().values()) == {0}
    one, two = plain.torsion_curve(torque), model.torsion_curve(torque)
    assert one.total_rad.tolist() == two.total_rad.tolist()


def test_a_reversal_loses_twice_the_angle_of_a_gap(drawn: Document) -> None:
    link = {"kind": "link", "influence": 1, "zone": "teeth", "lower_um": 3, "upper_um": 3}
    plain, model = toleranced(drawn, []), toleranced(drawn, [link])
    torque = 2 * model.mesh_state()["gap_torque_Nm"]
    more = model.reversal_lost_motion(torque) - plain.reversal_lost_motion(torque)
    assert more == pytest.approx(2 * model.gap_angle(3e-3), rel=1e-9)


DEVIATES = {
    "normal": lambda random, size: random.normal(size=size) / 3,
    "triangular": lambda random, size: random.triangular(-1, 0, 1, size),
    "uniform": lambda random, size: random.uniform(-1, 1, size),
}


@pytest.mark.parametrize("seed", range(40))
def test_probable_limits_hold_what_they_state_and_stay_in_the_worst_case(
    drawn: Document, seed: int
) -> None:
    random = np.random.default_rng(seed)
    gap = {"generator": np.zeros(40_000), "teeth": np.zeros(40_000)}
    links = []
    for _ in range(random.integers(1, 6)):
        middle = random.normal() * random.choice([0.0, 3.0, 10.0])
        half = random.uniform(0, 10)
        zone, spread = random.choice(list(gap)), random.choice(list(DEVIATES))
        influence = random.normal()
        gap[zone] += influence * (middle + half * DEVIATES[spread](random, 40_000))
        fields = {"lower_um": float(middle - half), "upper_um": float(middle + half)}
        kinds = {"kind": "link", "zone": str(zone), "distribution": str(spread)}
        links.append({"influence": float(influence), **fields, **kinds})
    limits = toleranced(drawn, links).tolerance_limits()
    assert 0 <= limits["worst_min"] <= limits["probable_min"] + 1e-12
    assert limits["probable_min"] <= limits["probable_max"] <= limits["worst_max"] + 1e-12
    drives_mm = 1e-3 * sum(np.maximum(zone, 0) for zone in gap.values())
    # 0.135 % are meant; four standard errors of the count are allowed.
    for outside in (
        drives_mm < limits["probable_min"] - 1e-9,
        drives_mm > limits["probable_max"] + 1e-9,
    ):
        assert outside.mean() < 1.35e-3 + 4 * math.sqrt(1.35e-3 / 40_000)


@pytest.mark.parametrize("generator", ["discs", "cosine", "rollers"])
def test_less_room_between_the_teeth_is_less_clearance_to_take_up(
    drawn: Document, generator: str
) -> None:
    drawn["design"]["generator"]["type"] = generator
    taken = []
    for shift in (3.2, 3.0, 2.96, 2.9, 2.8):
        drawn["design"]["teeth"]["rigid_shift"] = shift
        model = toleranced(drawn, [])
        found = model.torsion_curve([40.0])
        play = model.mesh_state()["free_play_rad"]
        taken.append((play, float(found.parts_rad["side_clearance"][0])))
    assert taken == sorted(taken, reverse=True)
    assert taken[0][1] > taken[-1][1]


@random_designs
@given(designs(), st.floats(0.3, 3.0))
def test_scaling_all_lengths_leaves_the_clearances(document: Document, factor: float) -> None:
    other = copy.deepcopy(document)
    for table, key in (
        ("teeth", "module_mm"),
        ("teeth", "face_width_mm"),
        ("generator", "deflection_mm"),
    ):
        other["design"][table][key] *= factor
    one, two = build(document).clearances(), build(other).clearances()
    np.testing.assert_allclose(one.forward_rad, two.forward_rad, atol=1e-9)
    np.testing.assert_allclose(one.forward_radius_mm * factor, two.forward_radius_mm, rtol=1e-6)


@random_designs
@given(designs())
def test_both_precisions_agree_within_a_hundredth_of_an_arcmin(document: Document) -> None:
    # A tooth exactly on the engagement limit may carry load in only one precision.
    document["design"]["support"] = {"engagement_limit_deg": 43.21}
    design = parse_or_skip(document)
    torque = np.linspace(-1, 1, 9) * document["drive"]["rated_torque_Nm"]
    try:
        double, single = DesignModel(design, 64), DesignModel(design, 32)
        one = double.torsion_curve(torque).total_rad
        two = single.torsion_curve(torque).total_rad
    except InputError:
        assume(False)
        return
    # Parallel flanks touch along a line: the gap is determined there, the radius of contact is not,
    # nor is the compliance of the tooth.
    here, there = double.clearances(), single.clearances()
    both = np.isfinite(here.forward_rad) & np.isfinite(there.forward_rad)
    gap = np.abs(here.forward_rad[both] - there.forward_rad[both])
    radius = np.abs(here.forward_radius_mm[both] - there.forward_radius_mm[both])
    assert np.all(gap < 0.01 * ARCMIN)
    assume(np.all(radius < 0.05 * document["design"]["teeth"]["module_mm"]))
    np.testing.assert_allclose(one, two, atol=0.01 * ARCMIN)


def parse_or_skip(document: Document) -> Any:
    try:
        return parse_drive(document).design
    except InputError:
        assume(False)
        raise


def test_two_constants_bring_reference_A_to_the_catalogue_of_size_20() -> None:
    # Size 20, ratio above 50: 7 / 16e3, + 18 / 25e3, + 55 / 29e3 rad at 7, 25 and 80 N m.
    catalogue = np.array([1.504, 3.979, 10.499])
    torque = [7.0, 25.0, 80.0]
    document = variant()
    plain = np.array(predict(parse_drive(document), torque)["total_arcmin"])
    assert np.all(plain > catalogue / 4)
    assert np.all(plain < catalogue * 4)
    # The two: c_rad of the rim's share and the stiffness of the whole torsion chain.
    document["design"]["support"] = {
        "foundation_N_per_mm2": 2600,
        "ring_stiffness_N_mm2": 3.5e5,
        "ring_factor": 7.88,
        "tooth_compliance_mm_per_N": 3.5e-6,
    }
    document["design"]["radial_chain"] = []
    document["design"]["torsion_chain"] = [{"kind": "stiffness", "stiffness_Nm_per_rad": 4.48e4}]
    answer = predict(parse_drive(document), torque)
    np.testing.assert_allclose(answer["total_arcmin"], catalogue, rtol=0.03)
    # Published with it: 6, 13 and 24 teeth a lobe; tooth bending about 1 % of the total.
    assert answer["engaged_teeth_per_lobe"] == [6, 13, 24]
    assert 0.005 < answer["parts_arcmin"]["tooth_bending"][2] / answer["total_arcmin"][2] < 0.05


KEYS = [key for key in design_keys() if key.range and key.kind == "real"]
CHECKED_ELSEWHERE = {"contact_half_angle"}  # by the shape of the wave generator, if it has one


@pytest.mark.parametrize("key", KEYS, ids=lambda key: field_path(key.section, key))
def test_a_value_beyond_the_range_of_its_row_is_refused_by_its_name(key: DesignKey) -> None:
    c = core(64)
    design = parse_drive(variant()).design
    assert design is not None
    drive = make_drive(design)
    member = field_path(key.section, key)
    owner = drive
    for name in member.split(".")[:-1]:
        owner = getattr(owner, name)
    fault = c.fault()
    setattr(owner, key.written, 1e30)
    assert c.lib.lm_check_drive(drive, fault) == c.lib.LM_OUT_OF_RANGE
    assert c.ffi.string(fault.input).decode().removeprefix("drive.") in (member, key.written)
    assert fault.found == 1e30
    measure = {
        "deg": math.pi / 180,
        "arcmin": math.pi / 10_800,
        "modules": drive.teeth.module_mm,
        "pitch": drive.teeth.module_mm * drive.teeth.flexspline_teeth,
        "rim": drive.flexspline.rim_thickness_mm,
        "face": drive.teeth.face_width_mm,
    }
    if key.name not in CHECKED_ELSEWHERE:
        _, _, high, *per = key.range.split()
        assert fault.high == pytest.approx(float(high) * (measure[per[0]] if per else 1.0))
