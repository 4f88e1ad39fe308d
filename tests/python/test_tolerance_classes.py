"""Fits, tolerance classes and tooth grades by ISO 286 and ISO 1328, from spec to result."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from small_search import format_spec

from conftest import NO_SEARCH
from lostmotion.core import core
from lostmotion.drives import parse_drive, read_drive
from lostmotion.errors import InputError
from lostmotion.model import design_model
from lostmotion.predict import predict
from lostmotion.tolerance_classes import LETTERS, limit_deviations, read_class
from lostmotion.tooth_grades import infeed_um, runout_um

PUBLISHED_UM = {
    # ISO 286-2, tables of limit deviations, as makers of bearings and tools reprint them.
    ("H7", 30): (0, 21),
    ("g6", 30): (-20, -7),
    ("f7", 50): (-50, -25),
    ("e8", 60): (-106, -60),
    ("d9", 25): (-117, -65),
    ("k6", 40): (2, 18),
    ("m6", 50): (9, 25),
    ("n6", 50): (17, 33),
    ("p6", 50): (26, 42),
    ("s6", 50): (43, 59),
    ("s6", 60): (53, 72),
    ("r6", 100): (51, 73),
    ("u6", 20): (41, 54),
    ("js6", 50): (-8, 8),
    ("j6", 40): (-5, 11),
    ("J7", 40): (-11, 14),
    ("K6", 8): (-7, 2),
    ("K7", 30): (-15, 6),
    ("M7", 30): (-21, 0),
    ("M6", 300): (-41, -9),
    ("N7", 30): (-28, -7),
    ("N9", 8): (-36, 0),
    ("P7", 30): (-35, -14),
    ("P7", 100): (-59, -24),
    ("R7", 60): (-60, -30),
    ("R7", 70): (-62, -32),
    ("R7", 100): (-73, -38),
    ("G7", 2): (2, 12),
    ("P9", 2): (-31, -6),
    ("E7", 400): (125, 182),
    ("c11", 200): (-530, -240),
}
"""Tolerance class and nominal size in mm: lower and upper limit deviation."""


@pytest.mark.parametrize(("where", "limits"), PUBLISHED_UM.items(), ids=str)
def test_classes_have_the_deviations_of_the_published_tables(
    where: tuple[str, float], limits: tuple[float, float]
) -> None:
    name, nominal_mm = where
    found = limit_deviations(read_class(name), nominal_mm)
    assert [1e3 * value for value in found] == pytest.approx(limits, abs=1e-6)


def test_a_hole_and_a_shaft_of_one_letter_mirror_each_other() -> None:
    # Delta makes H7/p6 and P7/h6 the same fit; letters before j mirror at any grade.
    for nominal_mm in (2.0, 5.0, 14.0, 48.0, 90.0, 210.0, 490.0):
        for letter in "pr":
            hole = limit_deviations(read_class(f"{letter.upper()}7"), nominal_mm)
            base = limit_deviations(read_class("h6"), nominal_mm)
            shaft = limit_deviations(read_class(f"{letter}6"), nominal_mm)
            bore = limit_deviations(read_class("H7"), nominal_mm)
            if nominal_mm > 3:
                assert base[1] - hole[0] == pytest.approx(shaft[1] - bore[0], abs=1e-9)
        for letter in LETTERS[:8]:
            hole = limit_deviations(read_class(f"{letter.upper()}9"), nominal_mm)
            shaft = limit_deviations(read_class(f"{letter}9"), nominal_mm)
            assert hole == pytest.approx((-shaft[1], -shaft[0]))


@pytest.mark.parametrize("name", ["", "7H", "Q7", "H2", "h17", "Hg7", "i6"])
def test_what_is_no_class_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=r"letter|grade"):
        limit_deviations(read_class(name), 30)


def test_a_fit_and_a_gear_are_two_links(drawn: dict[str, Any]) -> None:
    drawn["design"]["tolerance"] = [
        {"kind": "fit", "fit": "H7/g6", "nominal_mm": 48, "zone": "generator", "name": "seat"},
        {"kind": "gear", "gear": "flexspline", "tooth_grade": 6},
        {"kind": "shaft", "tolerance_class": "k", "it_grade": 5, "nominal_mm": 20, "zone": "teeth"},
    ]
    budget = design_model(parse_drive(drawn)).tolerance_budget()
    assert [link["name"] for link in budget] == [
        "seat, hole",
        "seat, shaft",
        "flexspline teeth, run-out",
        "flexspline teeth, infeed",
        "tolerance[2]",
    ]
    teeth = drawn["design"]["teeth"]
    module = teeth["module_mm"]
    d = module * teeth["flexspline_teeth"]
    runout, infeed = runout_um(d, module, 6), infeed_um(d, 6)
    expected = [(0, 25), (-25, -9), (-runout / 2, runout / 2), (0, infeed), (2, 11)]
    for link, (low, high) in zip(budget, expected, strict=True):
        assert (link["lower_um"], link["upper_um"]) == pytest.approx((low, high))


def test_tooth_grades_follow_the_standard() -> None:
    # ISO 1328-1:2013 at d = 50 mm, m = 0.5 mm, class 5: 0.9 (0.1 + 3.889 + 0.35 + 12) = 14.7 um.
    assert runout_um(50, 0.5, 5) == 15
    assert runout_um(50, 0.5, 7) == pytest.approx(2 * 14.705, abs=0.5)
    # ISO/TR 10064-2: b_r is the field of IT8 at grade 5, 39 um at 50 mm, and IT10 at grade 9.
    assert infeed_um(50, 5) == pytest.approx(39)
    assert infeed_um(50, 9) == pytest.approx(100)
    assert infeed_um(50, 6) == pytest.approx(1.26 * 39)


@pytest.mark.parametrize(
    ("entry", "key", "expected"),
    [
        ({"kind": "fit", "fit": "H7g6", "nominal_mm": 9}, "fit", "such as H7/g6"),
        ({"kind": "fit", "fit": "g6/H7", "nominal_mm": 9}, "fit", "of the hole and that"),
        ({"kind": "fit", "nominal_mm": 9}, "fit", "such as 'H7/g6'"),
        ({"kind": "fit", "fit": "H7/g6"}, "tolerance_class", "nominal_mm"),
        ({"kind": "hole", "tolerance_class": "g6", "nominal_mm": 9}, "tolerance_class", "capital"),
        ({"kind": "hole", "tolerance_class": "K9", "nominal_mm": 9}, "tolerance_class", "K3 to K8"),
        ({"kind": "hole", "tolerance_class": "H", "nominal_mm": 9}, "tolerance_class", "a grade"),
        ({"kind": "hole", "tolerance_class": "H7", "nominal_mm": 501}, "tolerance_class", "500"),
        (
            {"kind": "hole", "tolerance_class": "H7", "nominal_mm": 9, "lower_um": 1},
            "tolerance_class",
            "give the deviations",
        ),
        ({"kind": "gear", "gear": "rigid"}, "tooth_grade", "a tooth grade"),
        ({"kind": "gear", "gear": "rigid", "tooth_grade": 3}, "tooth_grade", "4 to 9"),
    ],
)
def test_what_is_no_fit_is_refused_with_its_key(
    drawn: dict[str, Any], entry: dict[str, Any], key: str, expected: str
) -> None:
    zone = {} if entry["kind"] == "gear" else {"zone": "generator"}
    drawn["design"]["tolerance"] = [{**entry, **zone}]
    with pytest.raises(InputError) as refused:
        parse_drive(drawn)
    assert refused.value.key == f"design.tolerance[0].{key}"
    assert expected in refused.value.expected


def test_a_search_keeps_fits_classes_and_grades(tmp_path: Path, small_spec: dict[str, Any]) -> None:
    pytest.importorskip("lostmotion._search", reason=NO_SEARCH)
    from lostmotion import design

    ranged = small_spec["search"]["range"]
    small_spec["search"]["fixed"]["teeth.flexspline_teeth"] = 200
    del ranged["teeth.flexspline_teeth"]
    ranged["tolerance.1.it_grade"] = [5, 9]
    ranged["tolerance.5.it_grade"] = [5, 9]
    small_spec["search"]["evaluations"] = 300
    small_spec["design"]["tolerance"] = [
        {"kind": "fit", "fit": "H/g", "nominal_mm": 48, "zone": "generator", "name": "seat"},
        {"kind": "gear", "gear": "flexspline", "tooth_grade": 4, "cost_weight": 2},
        {"kind": "hole", "tolerance_class": "JS6", "nominal_mm": 20, "zone": "generator"},
        {
            "kind": "link",
            "influence": 1.37,
            "position": 0.5,
            "nominal_mm": 0.25,
            "zone": "teeth",
            "cost_weight": 2,
        },
        {"kind": "shaft", "lower_um": -9, "upper_um": -3, "nominal_mm": 30, "zone": "generator"},
    ]
    spec = tmp_path / "spec.toml"
    spec.write_text(format_spec(small_spec))
    result = design.search(spec, tmp_path / "run", workers=1)
    assert result.best is not None
    assert result.certificate is not None
    seat, gear, wide, tooth, ring = result.best["design"]["tolerance"]
    grades = result.front[0]["variables"]
    assert seat["fit"] == f"H{grades['tolerance.0.grade']:g}/g{grades['tolerance.1.grade']:g}"
    assert gear == {"kind": "gear", "gear": "flexspline", "tooth_grade": 4, "cost_weight": 2}
    assert wide["tolerance_class"] == "JS6"
    assert tooth["it_grade"] == grades["tolerance.5.grade"]
    assert (ring["lower_mm"], ring["upper_mm"]) == (-0.009, -0.003)
    # The library's shares of the best point equal those of the written file.
    budget = design_model(read_drive(tmp_path / "run" / "best.toml")).tolerance_budget()
    shares = [link["worst_percent"] for link in budget]
    found = [share["worst"] for share in result.certificate["tolerance_percent"]]
    assert shares == pytest.approx(found, rel=1e-9)
    assert math.isclose(sum(shares), 100.0)
    assert len(budget) == 7 <= core().lib.LM_TOLERANCE_CHAIN_MAX


def test_predict_separates_the_gap_from_the_lost_motion_with_it(drawn: dict[str, Any]) -> None:
    drawn["design"]["tolerance"] = [
        {"kind": "hole", "zone": "generator", "tolerance_class": "H7", "nominal_mm": 48}
    ]
    answer = predict(parse_drive(drawn), [1.0])
    whole = answer["reversal_lost_motion_by_tolerance_arcmin"]
    alone = answer["tolerance_lost_motion_arcmin"]
    del drawn["design"]["tolerance"]
    without = predict(parse_drive(drawn), [1.0])["reversal_lost_motion_arcmin"]
    # The gap closes under torque, eq. (9a): here all of it, twice its angle in a reversal.
    assert whole["worst"] == pytest.approx(without + 2 * alone["worst_max"])
    assert without < whole["probable"] <= whole["worst"]
    # A middle gap of half the worst one, which the mean of the tolerances is.
    assert without < answer["reversal_lost_motion_arcmin"] < whole["worst"]


def test_values_of_the_generator_without_effect_are_reported(drawn: dict[str, Any]) -> None:
    generator = drawn["design"]["generator"]
    generator |= {"type": "discs", "contact_half_angle_deg": 30, "cam_offset_mm": 2}
    said = " ".join(predict(parse_drive(drawn), [1.0])["assumptions"])
    assert "generator.cam_offset has no effect" in said
    assert "contact_half_angle has no effect" not in said
    generator |= {"type": "ellipse"}
    said = " ".join(predict(parse_drive(drawn), [1.0])["assumptions"])
    assert "generator.contact_half_angle has no effect" in said
    assert "cam_offset has no effect" not in said
