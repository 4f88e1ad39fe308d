"""Drive files: errors are refused with file, key, found and expected; values read are kept."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from conftest import BOUGHT, DRAWN
from lostmotion.core import core, library_effects
from lostmotion.drives import format_toml, parse_drive, read_drive, write_drive
from lostmotion.effects.library import library
from lostmotion.errors import InputError
from lostmotion.export import make_controller
from lostmotion.fit.drive_file import term_from
from lostmotion.keys import Key, read_keys
from lostmotion.model import design_model
from lostmotion.predict import predict
from lostmotion.structs import make_drive

try:
    import tomllib
except ImportError:
    import tomli as tomllib

Document = dict[str, Any]


def change(document: Document, path: str, value: Any) -> None:
    """Set a dotted key; a value of None removes it."""
    *tables, key = path.split(".")
    for table in tables:
        document = document.setdefault(table, {})
    if value is None:
        del document[key]
    else:
        document[key] = value


REFUSED_HEAD: list[tuple[dict[str, Any], tuple[str, ...]]] = [
    ({"drive": None}, ("drive:", "no such table")),
    ({"drives": {}}, ("drives:", "unknown table", "did you mean 'drive'?")),
    ({"drive.ratio": None}, ("drive.ratio", "nothing")),
    ({"drive.ratio": 0.5}, ("drive.ratio", "0.5", "more than 1")),
    ({"drive.ratio": "100"}, ("drive.ratio", "'100'", "a number")),
    ({"drive.ratio": math.nan}, ("drive.ratio", "nan", "a finite number")),
    ({"drive.ratio_rad": 100}, ("drive.ratio_rad", "unit 'rad'", "no unit")),
    ({"drive.rated_torque_Nm": 0}, ("drive.rated_torque_Nm", "from 1e-06 to 500000")),
    ({"drive.rated_torque_Nm": True}, ("drive.rated_torque_Nm", "true", "a number")),
    (
        {"drive.rated_torque_Nm": None, "drive.rated_torque": 67},
        ("drive.rated_torque:", "no unit", "a torque", "rated_torque_Nm"),
    ),
    (
        {"drive.rated_torque_Nm": None, "drive.rated_torque_mm": 67},
        ("drive.rated_torque_mm", "unit 'mm'", "a length", "a torque"),
    ),
    (
        {"drive.rated_torque_Nm": None, "drive.rated_torque_nM": 67},
        ("drive.rated_torque_nM", "unknown unit 'nM'", "a torque"),
    ),
    (
        {"drive.rated_torque_mNm": 67e3},
        ("drive.rated_torque_mNm", "drive.rated_torque_Nm as well", "once"),
    ),
    ({"drive.raito": 100}, ("drive.raito", "unknown key", "did you mean 'ratio'?")),
    ({"drive.name": 7}, ("drive.name", "7", "text")),
    ({"design": {}}, ("catalogue, design", "both", "exactly one")),
    ({"catalogue": None}, ("catalogue, design", "neither", "exactly one")),
    ({"catalogue.K1_Nm_per_rad": None}, ("catalogue.K1_Nm_per_rad", "nothing")),
    ({"catalogue.K2_Nm_per_rad": -1}, ("catalogue.K2_Nm_per_rad", "-1", "from 0.001 to 1e+12")),
    ({"catalogue.K2_Nm_per_rad": 10**400}, ("catalogue.K2_Nm_per_rad", "a finite number")),
    ({"drive.ratio_rad_per_rad": 1001}, ("drive.ratio_rad_per_rad", "drive.ratio as well")),
    # Values of a sheet printed under "10^4 Nm/rad", and one of the three in N m/arcmin.
    (
        {f"catalogue.K{i}_Nm_per_rad": k for i, k in ((1, 3.1), (2, 5.0), (3, 5.7))},
        ("catalogue.K1_Nm_per_rad", "found 3.1 Nm/rad", "less than 0.5 rad", "power of ten"),
    ),
    ({"catalogue.K2_Nm_per_rad": 14.5}, ("catalogue.K2_Nm_per_rad", "winds up by 2.3", "power")),
    (
        {"catalogue.hysteresis_arcmin": None, "catalogue.hystersis_arcmin": 1},
        ("catalogue.hystersis_arcmin", "did you mean 'hysteresis_arcmin'?"),
    ),
    ({"catalogue.T2_Nm": 14}, ("catalogue.T2_Nm", "14 Nm", "more than T1, 14 Nm")),
    ({"catalogue.hysteresis_Nm": 1}, ("catalogue.hysteresis_Nm", "unit 'Nm'", "an angle")),
    ({"catalogue": 7}, ("catalogue", "7", "a table")),
    ({"columns": 7}, ("columns", "7", "a table")),
    ({"columns.TIME": 1}, ("columns.TIME", "1", "a name with unit")),
    ({"effect": {"name": "wear"}}, ("effect:", "a table", "[[effect]]")),
    ({"effect": [7]}, ("effect[0]", "7", "[[effect]]")),
    ({"effect": [{"size_um": 3}]}, ("effect[0].name", "nothing", "the name of an effect")),
    (
        {"effect": [{"name": "thermal_gpa"}]},
        ("effect[0].name", "'thermal_gpa'", "did you mean 'thermal_gap'?"),
    ),
    ({"effect": [{"name": {"a": 1}}]}, ("effect[0].name", "a table", "the name of an effect")),
    ({"effect": [{"name": "wear"}, {"name": "wear"}]}, ("effect[1].name", "'wear'", "once")),
    ({"effect": [{"name": "wear", "a_um": "3"}]}, ("effect[0].a_um", "'3'", "finite number")),
    ({"effect": [{"name": "sensor_lag"}]}, ("effect[0].lag_s", "nothing", "this key")),
    (
        {"effect": [{"name": "sensor_lag", "lag_mm": 1}]},
        ("effect[0].lag_mm", "a length", "a time"),
    ),
    (
        {"effect": [{"name": "sensor_lag", "lag_s": 0.1, "lagg_s": 1}]},
        ("effect[0].lagg_s", "an unknown key", "did you mean 'lag_s'?"),
    ),
    (
        {"effect": [{"name": "sensor_lag", "lag_ms": 1e9}]},
        ("effect[0].lag_ms", "1000000000.0", "a number from"),
    ),
    ({"fit": {}}, ("fit.values", "no such table")),
    ({"fit": {"values": 7}}, ("fit.values", "7", "a table of numbers")),
    ({"fit": {"values": {"a": "x"}}}, ("fit.values.a", "'x'", "finite number")),
    (
        {"fit": {"values": {"knot_1_Nm": 1.0, "knot_3_Nm": 3.0}}},
        ("fit.values.knot_3_Nm", "a gap in the numbering before it", "knot_2_Nm first"),
    ),
    (
        {"fit": {"values": {"knot_1_Nm": 1.0, "slope_1_rad_per_Nm": 1e-5}}},
        ("fit.values", "1 slopes and 1 knots", "one slope more than knots"),
    ),
    (
        {"fit": {"values": {"knot_1_Nm": 1, "slope_1_rad_per_Nm": 1, "slope_2_rad_per_Nm": -1}}},
        ("fit.values.slope_2_rad_per_Nm", "-1", "0 or more"),
    ),
    (
        {"fit": {"values": {"play_radius_1_Nm": 1.0}}},
        ("fit.values", "1 radii of operators, 0 shares, 0 outside", "a share for each radius"),
    ),
    (
        {"fit": {"values": {"play_radius_1_Nm": -1.0, "play_share_1": 0.1}}},
        ("fit.values.play_radius_1_Nm", "numbers that do not rise", "rising numbers"),
    ),
    (
        {"fit": {"values": {"play_envelope_Nm": 1.0}}},
        ("fit.values", "play_envelope_Nm alone", "both play_envelope_Nm and play_envelope_knee_Nm"),
    ),
    (
        {"fit": {"values": {"play_envelope_Nm": -1.0, "play_envelope_knee_Nm": 9.0}}},
        ("fit.values.play_envelope_Nm", "-1", "0 or more"),
    ),
    (
        {"fit": {"values": {"play_envelope_Nm": 1.0, "play_envelope_knee_Nm": 0.0}}},
        ("fit.values.play_envelope_knee_Nm", "0", "more than 0"),
    ),
    (
        {"fit": {"values": {"a": 1.0}, "standard_errors": {"b": 1.0}}},
        ("fit.standard_errors", "b", "keys of [fit.values]: a"),
    ),
    (
        {"fit": {"values": {"a": 1.0}, "covariance": [[1.0, 2.0]]}},
        ("fit.covariance", "an array", "1 rows of 1 numbers"),
    ),
    (
        {"fit": {"values": {"a": 1.0}, "covariance": [[math.inf]]}},
        ("fit.covariance[0][0]", "inf", "finite number"),
    ),
    ({"fit": {"values": {}, "notes": 1}}, ("fit.notes", "unknown key")),
]

REFUSED_DESIGN: list[tuple[dict[str, Any], tuple[str, ...]]] = [
    ({"design": 7}, ("design", "7", "a table")),
    ({"design.teeth": None}, ("design.teeth", "no such table")),
    ({"design.tooth": {}}, ("design.tooth", "unknown key", "did you mean 'teeth'?")),
    ({"design.teeth.modul_mm": 1}, ("design.teeth.modul_mm", "did you mean 'module_mm'?")),
    ({"design.teeth.module_mm": None}, ("design.teeth.module_mm", "nothing")),
    ({"design.teeth.module_mm": 50}, ("design.teeth.module_mm", "50", "0.05 to 10")),
    (
        {"design.teeth.module_mm": None, "design.teeth.module_um": 20},
        ("design.teeth.module_um", "20", "50 to 10000"),
    ),
    ({"design.teeth.flexspline_teeth": 200.0}, ("flexspline_teeth", "200.0", "an integer")),
    (
        {"design.teeth.flexspline_teeth": 201},
        ("flexspline_teeth: found 201, expected an even number, 200 or 202",),
    ),
    (
        {"design.teeth.rigid_teeth": 204},
        ("design.teeth.rigid_teeth: found 204, expected 202, two more than the flexspline has",),
    ),
    ({"design.teeth.deformation": "inward"}, ("deformation", "'inward'", "'internal'")),
    ({"design.teeth.deformation": "external"}, ("design.", "found")),
    (
        {"drive.ratio": 99},
        ("drive.ratio: found 99, expected 100 (the flexspline turns the output) or 101",),
    ),
    (
        {"design.teeth.flexspline_shift": -2, "design.teeth.pressure_angle_deg": 10},
        (
            "engagement_depth: found 1.2, which puts the tip at 24.5375 mm",
            "expected a tip outside the base circle at 24.8664 mm",
        ),
    ),
    ({"design.friction_angle_deg": -1}, ("design.friction_angle_deg: found -1, expected 0 to 17",)),
    ({"design.generator.type": "disk"}, ("type", "'disk'", "did you mean 'discs'?")),
    (
        {"design.generator.contact_half_angle_deg": None},
        ("contact_half_angle_deg", "nothing", "an angle", "'discs'"),
    ),
    (
        {"design.generator.contact_half_angle_deg": 80},
        ("design.generator.contact_half_angle_deg", "80", "2.86479 to 68.7549"),
    ),
    ({"design.generator.floating": 1}, ("floating", "1", "true or false")),
    ({"design.flexspline.rim_thickness_mm": -1.0}, ("design.flexspline.rim_thickness_mm", "-1")),
    ({"design.material.youngs_modulus_Nm": 1}, ("youngs_modulus_Nm", "a torque", "a stress")),
    ({"design.axial_sections": 9}, ("design.axial_sections: found 9, expected 1 to 7",)),
    ({"design.radial_chain": 7}, ("design.radial_chain", "7", "[[design.radial_chain]]")),
    ({"design.radial_chain": [7]}, ("design.radial_chain[0]", "7")),
    ({"design.radial_chain": [{}]}, ("design.radial_chain[0].kind", "nothing", "ball")),
    (
        {"design.radial_chain": [{"kind": "bal"}]},
        ("design.radial_chain[0].kind", "'bal'", "did you mean 'ball'?"),
    ),
    (
        {"design.radial_chain": [{"kind": "ball"}]},
        ("design.radial_chain[0].ball_diameter_mm", "nothing"),
    ),
    (
        {"design.radial_chain": [{"kind": "ball", "ball_diameter_mm": 4, "share": 3}]},
        ("design.radial_chain[0].share", "3", "-1 to 1"),
    ),
    (
        {"design.radial_chain": [{"kind": "spring", "stiffness_N_per_um": -1.0}]},
        ("design.radial_chain[0].stiffness_N_per_um", "-1"),
    ),
    (
        {"design.radial_chain": [{"kind": "spring", "stiffness_N_per_mm": 1e5}] * 9},
        ("design.radial_chain", "9 entries", "at most 8"),
    ),
    (
        {"design.torsion_chain": [{"kind": "shaft", "outer_diameter_mm": 8, "length_mm": 0}]},
        ("design.torsion_chain[0].length_mm", "0", "0.0001 to 10000"),
    ),
    (
        {"design.torsion_chain": [{"kind": "lock", "stiffness_N_per_mm": 8}]},
        ("design.torsion_chain[0].stiffness_N_per_mm", "a stiffness", "a torsional stiffness"),
    ),
    (
        {"design.tolerance": [{"kind": "hole", "zone": "teeth", "lower_um": 3}]},
        ("design.tolerance[0]", "lower", "it_grade and nominal_mm"),
    ),
    (
        {"design.tolerance": [{"kind": "hole", "zone": "teeth", "it_grade": 40, "nominal_mm": 40}]},
        ("design.tolerance[0].it_grade", "40", "3 to 16"),
    ),
    (
        {"design.tolerance": [{"kind": "hole", "zone": "teeth", "lower_um": 3, "upper_um": 2}]},
        ("design.tolerance[0].upper_um: found 2, expected 3 to 10000",),
    ),
    (
        {
            "design.torsion_chain": [
                {"kind": "shaft", "outer_diameter_mm": 8, "bore_mm": 9, "length_mm": 20}
            ]
        },
        ("design.torsion_chain[0].bore_mm: found 9, expected 0 to 8",),
    ),
    (
        {
            "design.torsion_chain": [
                {"kind": "diaphragm", "hub_radius_mm": 9, "outer_radius_mm": 8, "thickness_mm": 1}
            ]
        },
        ("design.torsion_chain[0].hub_radius_mm: found 9, expected 0.0001 to 8",),
    ),
    (
        {"design.generator.type": "ring"},
        (
            "design.generator.type",
            "found 'ring'",
            "expected 'cosine', 'ellipse', 'discs', 'rollers'",
        ),
    ),
    (
        {"design.tolerance": [{"kind": "hole", "zone": "cam", "lower_um": 3, "upper_um": 4}]},
        ("design.tolerance[0].zone", "'cam'", "'generator', 'teeth'"),
    ),
]


@pytest.mark.parametrize(("changes", "parts"), REFUSED_HEAD, ids=lambda v: str(v)[:60])
def test_a_wrong_file_of_a_bought_drive_is_refused_with_key_found_and_expected(
    bought: Document, write: Callable[..., Path], changes: Document, parts: tuple[str, ...]
) -> None:
    refuse(bought, write, changes, parts)


@pytest.mark.parametrize(("changes", "parts"), REFUSED_DESIGN, ids=lambda v: str(v)[:60])
def test_a_wrong_file_of_a_drawn_drive_is_refused_with_key_found_and_expected(
    drawn: Document, write: Callable[..., Path], changes: Document, parts: tuple[str, ...]
) -> None:
    refuse(drawn, write, changes, parts)


def refuse(
    document: Document, write: Callable[..., Path], changes: Document, parts: tuple[str, ...]
) -> None:
    for path, value in changes.items():
        change(document, path, value)
    file = write(document)
    with pytest.raises(InputError) as caught:
        read_drive(file)
    message = str(caught.value)
    assert message.startswith(f"{file}: ")
    assert "\n" not in message
    assert " found " in message
    assert ", expected " in message
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("content", "part"),
    [("ratio = [", "expected TOML"), (b"\xff\xfe", "not UTF-8")],
)
def test_what_is_not_toml_is_refused(tmp_path: Path, content: str | bytes, part: str) -> None:
    file = tmp_path / "drive.toml"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError, match=part):
        read_drive(file)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.toml: found no such file, expected a drive file"):
        read_drive(tmp_path / "none.toml")
    with pytest.raises(InputError, match="found a folder, expected a drive file"):
        read_drive(tmp_path)


def test_any_unit_of_the_right_dimension_gives_the_same_drive(drawn: Document) -> None:
    other = copy.deepcopy(drawn)
    teeth, generator = other["design"]["teeth"], other["design"]["generator"]
    del teeth["module_mm"], teeth["pressure_angle_deg"], other["drive"]["rated_torque_Nm"]
    del generator["deflection_mm"], generator["contact_half_angle_deg"]
    teeth |= {"module_um": 250, "pressure_angle_arcmin": 1200}
    generator |= {"deflection_um": 237.5, "contact_half_angle_rad": math.pi / 6}
    other["drive"]["rated_torque_kNm"] = 0.04
    torque = [-40.0, 1.6, 40.0]
    expected = predict(parse_drive(drawn), torque)["total_arcmin"]
    assert predict(parse_drive(other), torque)["total_arcmin"] == pytest.approx(expected, rel=1e-9)


def test_teeth_that_run_to_a_point_are_refused_by_their_height(drawn: Document) -> None:
    drawn["design"]["teeth"]["tooth_height"] = 3
    found = r"tooth_height: found 3 and a tooth -0\.0\d+ mm thick below its tip, expected lower"
    with pytest.raises(InputError, match=found):
        predict(parse_drive(drawn), [1.0])


def test_shifts_that_leave_a_tooth_no_root_are_named(drawn: Document) -> None:
    drawn["design"]["teeth"]["flexspline_shift"] = -2
    found = r"design\.teeth: found shifts of -2 and 2\.957 \(flexspline, rigid gear\), expected"
    with pytest.raises(InputError, match=found):
        predict(parse_drive(drawn), [1.0])


def test_more_pairs_than_there_is_room_for_are_called_that(drawn: Document) -> None:
    drawn["design"]["axial_sections"] = 7
    drawn["design"]["generator"] |= {"floating": False, "eccentricity_um": 5}
    drawn["design"]["support"] = {"gap_limit_arcmin": 60}
    with pytest.raises(InputError, match=r"design: found more than 384 pairs .* smaller torque"):
        predict(parse_drive(drawn), [-1e6, 1e6])


def test_the_largest_catalogue_ratio_is_taken_in_both_forms(
    drawn: Document, bought: Document
) -> None:
    bought["drive"]["ratio"] = 320
    assert predict(parse_drive(bought), [1.0])["total_arcmin"][0] > 0
    drawn["drive"]["ratio"] = 320
    drawn["design"]["teeth"] |= {
        "module_mm": 50 / 640,
        "flexspline_teeth": 640,
        "rigid_teeth": 642,
    }
    drawn["design"]["generator"]["deflection_mm"] = 0.95 * 50 / 640
    for sections in (1, 7):
        drawn["design"]["axial_sections"] = sections
        total = predict(parse_drive(drawn), [-80, -1, 0, 1, 80])["total_arcmin"]
        assert total == sorted(set(total))


def test_what_the_file_leaves_open_is_listed_with_the_value_taken(drawn: Document) -> None:
    model = design_model(parse_drive(drawn))
    defaults = model.defaults()
    assert defaults["design.teeth.rack_addendum"] == 1
    assert defaults["design.material.youngs_modulus_MPa"] == 2.1e5
    assert defaults["design.radial_chain"].endswith("in proportion to size")
    assert "design.flexspline.rim_thickness_mm" not in defaults
    assert defaults["design.generator.floating"] is True
    # A value that the wave generator of this drive does not have is not a missing value.
    assert "design.generator.cam_offset_mm" not in defaults
    assert "design.generator.eccentricity_angle_rad" not in defaults
    element = model.drive.torsion[2]
    shaft = element.stiffness_Nm_per_rad * element.ratio**2
    chain = defaults["design.torsion_chain"]
    assert shaft == pytest.approx(1.07e7, rel=5e-3)
    assert "input shaft 10700000," in chain
    assert chain.startswith("Nm/rad at the output: cup wall ")
    assert "ovalisation of the rigid gear " in defaults["design.radial_chain"]
    # Writing the defaults into the file changes nothing.
    table = drawn["design"]
    for key, value in defaults.items():
        *path, name = key.removeprefix("design.").split(".")
        if name in ("radial_chain", "torsion_chain", "tolerance"):
            continue
        target = table.setdefault(path[0], {}) if path else table
        target[name] = value
    torque = [1.0, 10.0, 40.0]
    full = design_model(parse_drive(drawn))
    expected = model.torsion_curve(torque).total_rad
    assert full.torsion_curve(torque).total_rad.tolist() == expected.tolist()
    assert set(full.defaults()) == {
        f"design.{n}" for n in ("radial_chain", "torsion_chain", "tolerance")
    }


def test_members_of_the_chains_become_the_laws_of_the_library(drawn: Document) -> None:
    drawn["design"] |= {
        "radial_chain": [
            {"kind": "ball", "ball_diameter_mm": 3.97, "share": 0.3, "preload_N": 15},
            {"kind": "ball", "ball_diameter_mm": 4, "conformity": 0.52, "balls": 20},
            {"kind": "ball", "ball_diameter_mm": 4, "bearing": "thrust", "balls_in_lobe": 6},
            {"kind": "roller", "roller_length_mm": 5, "rollers": 12},
            {"kind": "roller", "roller_length_mm": 5, "crowned": True},
            {"kind": "spring", "name": "disc", "stiffness_N_per_um": 200},
            {"kind": "shaft", "diameter_mm": 10, "a_mm": 5, "b_mm": 6},
            {"kind": "ring", "mean_radius_mm": 30, "thickness_mm": 6, "width_mm": 12},
        ],
        "torsion_chain": [
            {"kind": "shaft", "outer_diameter_mm": 8, "length_mm": 30, "at": "input"},
            {"kind": "shell", "mean_radius_mm": 24.7, "wall_mm": 0.35, "length_mm": 17},
            {"kind": "diaphragm", "hub_radius_mm": 15, "outer_radius_mm": 24, "thickness_mm": 0.5},
            {"kind": "lock", "stiffness_Nm_per_rad": 100},
            {"kind": "stiffness", "stiffness_Nm_per_arcmin": 20, "at": "output"},
            {"kind": "stiffness", "stiffness_Nm_per_rad": 50, "ratio": 3},
        ],
    }
    drive = make_drive(parse_drive(drawn).design)  # type: ignore[arg-type]
    laws = drive.radial_laws
    # Palmgren, 4.36e-4 D^(-1/3), exponent 2/3.
    assert laws[0].coefficient_mm_per_Nn == pytest.approx(4.36e-4 * 3.97 ** (-1 / 3))
    assert (laws[0].share, laws[0].preload_N) == (0.3, 15)
    assert laws[1].coefficient_mm_per_Nn == pytest.approx(4.53e-4 * 4 ** (-1 / 3))
    assert laws[1].share == pytest.approx(4.37 / 20)
    assert laws[2].coefficient_mm_per_Nn == pytest.approx(5.24e-4 * 4 ** (-1 / 3))
    assert laws[2].share == pytest.approx(0.3)  # between 0.35 at 5 balls and 0.25 at 7
    assert laws[3].exponent == pytest.approx(0.9)
    assert laws[3].share == pytest.approx(4.08 / 12)
    assert laws[4].exponent == pytest.approx(0.75)
    assert laws[5].coefficient_mm_per_Nn == pytest.approx(1 / 200e3)
    # F a^2 b^2 / (3 E I (a + b)), I = pi d^4 / 64.
    bending = 25 * 36 / (3 * 2.1e5 * math.pi * 1e4 / 64 * 11)
    assert laws[6].coefficient_mm_per_Nn == pytest.approx(bending)
    # 0.0744 F R^3 / (E I), I = b h^3 / 12.
    oval = 0.0744 * 30**3 / (2.1e5 * 12 * 6**3 / 12)
    assert laws[7].coefficient_mm_per_Nn == pytest.approx(oval, rel=1e-3)
    torsion = drive.torsion
    assert torsion[0].stiffness_Nm_per_rad == pytest.approx(8e4 * math.pi * 8**4 / 32 / 30 / 1e3)
    assert [torsion[i].ratio for i in range(6)] == [100, 1, 1, 100, 1, 3]
    assert torsion[4].stiffness_Nm_per_rad == pytest.approx(20 * 10800 / math.pi)
    assert drive.radial_law_count == 8
    assert drive.torsion_count == 6

    drawn["design"]["radial_chain"] = [
        {"kind": "ring_widening", "inner_radius_mm": 27, "outer_radius_mm": 33, "width_mm": 12}
    ]
    widening = make_drive(parse_drive(drawn).design)  # type: ignore[arg-type]
    assert widening.radial_laws[0].coefficient_mm_per_Nn > 0


def test_tolerances_become_signed_links(drawn: Document) -> None:
    it6 = 16e-3  # ISO 286, table of standard tolerances: IT6 of 40 mm
    drawn["design"]["tolerance"] = [
        {"kind": "hole", "zone": "generator", "it_grade": 6, "nominal_mm": 40},
        {
            "kind": "shaft",
            "zone": "generator",
            "it_grade": 6,
            "nominal_mm": 40,
            "fundamental_deviation_um": -9,
            "distribution": "uniform",
        },
        {"kind": "shaft", "zone": "teeth", "lower_um": -5, "upper_um": 2, "diameter": False},
        {"kind": "link", "zone": "teeth", "influence": 1.1, "it_grade": 6, "nominal_mm": 40},
    ]
    links = make_drive(parse_drive(drawn).design).tolerances  # type: ignore[arg-type]
    found = [
        (
            links[i].influence,
            links[i].lower_mm,
            links[i].upper_mm,
            links[i].distribution,
            links[i].zone,
        )
        for i in range(4)
    ]
    expected = [
        (0.5, 0.0, it6, 0, 0),
        (-0.5, -0.009 - it6, -0.009, 3, 0),
        (-1.0, -0.005, 0.002, 0, 1),
        (1.1, -it6 / 2, it6 / 2, 0, 1),
    ]
    for a, b in zip(found, expected, strict=True):
        assert a == pytest.approx(b)


def test_the_tolerance_budget_names_each_link_and_adds_up(drawn: Document) -> None:
    drawn["design"]["tolerance"] = [
        {"kind": "hole", "zone": "generator", "lower_um": 0, "upper_um": 12, "name": "bore"},
        {"kind": "shaft", "zone": "generator", "lower_um": -4, "upper_um": 4},
        {"kind": "link", "zone": "teeth", "influence": 1.5, "lower_um": -4, "upper_um": 0},
    ]
    budget = predict(parse_drive(drawn), [1.0])["tolerance_budget"]
    assert [link["name"] for link in budget] == ["bore", "tolerance[1]", "tolerance[2]"]
    assert [link["zone"] for link in budget] == ["generator", "generator", "teeth"]
    assert [link["influence"] for link in budget] == [0.5, -0.5, 1.5]
    assert [link["lower_um"] for link in budget] == pytest.approx([0, -4, -4])
    # |A| tau is 3, 2 and 3 um.
    assert [link["worst_percent"] for link in budget] == pytest.approx([37.5, 25, 37.5])
    squares = [100 * share / 22 for share in (9, 4, 9)]
    assert [link["probable_percent"] for link in budget] == pytest.approx(squares)
    del drawn["design"]["tolerance"]
    assert predict(parse_drive(drawn), [1.0])["tolerance_budget"] == []


def test_an_eccentricity_that_a_floating_generator_takes_away_is_called_that(
    drawn: Document,
) -> None:
    drawn["design"]["generator"]["eccentricity_um"] = 5
    said = " ".join(predict(parse_drive(drawn), [1.0])["assumptions"])
    assert "eccentricity has no effect: the wave generator floats" in said
    drawn["design"]["generator"]["floating"] = False
    said = " ".join(predict(parse_drive(drawn), [1.0])["assumptions"])
    assert "eccentricity" not in said


def test_tolerance_limits_follow_equations_10_and_11(drawn: Document) -> None:
    # Hole 0..25 um around a shaft -25..-9 um, on the diameter; a nominal gap of 2 um besides.
    drawn["design"]["gap"] = {"generator_um": 2}
    drawn["design"]["tolerance"] = [
        {"kind": "hole", "zone": "generator", "lower_um": 0, "upper_um": 25},
        {"kind": "shaft", "zone": "generator", "lower_um": -25, "upper_um": -9},
    ]
    answer = predict(parse_drive(drawn), [1.0, 2.0])
    limits = answer["tolerance_um"]
    assert limits["worst_min"] == pytest.approx(2 + 9 / 2)
    assert limits["worst_max"] == pytest.approx(2 + 50 / 2)
    middle, spread = 2 + (12.5 + 17) / 2, math.hypot(12.5, 8) / 2
    assert limits["probable_min"] == pytest.approx(middle - spread)
    assert limits["probable_max"] == pytest.approx(middle + spread)
    # Equation (9): gap * tan(flank angle) / r, the same factor for all four.
    lost = answer["tolerance_lost_motion_arcmin"]
    factors = [lost[name] / limits[name] for name in limits]
    assert factors == pytest.approx([factors[0]] * 4)
    assert 0.05 < factors[0] < 0.08  # 20 um are about 1.27 arcmin at size 20


@pytest.mark.parametrize("document", [BOUGHT, DRAWN], ids=["bought", "drawn"])
def test_a_written_file_reads_back_as_the_same_numbers(document: Document, tmp_path: Path) -> None:
    document = copy.deepcopy(document)
    document["columns"] = {"TIME": "time_s", "POSITION in rev": "-lost_motion_rev"}
    document["fit"] = {
        "data_fingerprint": "sha256:00",
        "friction": "both",
        "rms_arcsec": 1.5,
        "values": {"compliance_low": 1 / 3, "gap_um": 0.1},
        "standard_errors": {"compliance_low": 1e-3, "gap_um": 2.5e-17},
        "covariance": [[1e-6, 0.0], [0.0, 6.25e-34]],
    }
    document["effect"] = [
        {"name": "thermal_drift", "drift_arcsec_per_K": 0.1 + 0.2},
        {"name": "torque_offset", "offset_Nm": -1e-300},
    ]
    if "design" in document:
        document["design"]["tolerance"] = [
            {
                "kind": "hole",
                "name": 'a "quoted" \\ name\n',
                "zone": "teeth",
                "lower_um": 0,
                "upper_um": 7,
            }
        ]
    drive = parse_drive(document)
    file = tmp_path / "again.toml"
    write_drive(drive, file)
    again = read_drive(file)
    assert again.document == document
    assert (again.columns, again.fit, again.effects) == (drive.columns, drive.fit, drive.effects)
    torque = [-10.0, 0.1, 33.3]
    assert predict(again, torque)["total_arcmin"] == predict(drive, torque)["total_arcmin"]


keys = st.text(st.characters(blacklist_categories=("Cs",)), min_size=1, max_size=8)
values = st.one_of(
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False, allow_infinity=False),
    st.booleans(),
    st.text(st.characters(blacklist_categories=("Cs",)), max_size=20),
    st.lists(st.integers(0, 9), max_size=3),
    st.lists(st.lists(st.floats(-1, 1), max_size=2), max_size=2),
)
tables = st.recursive(
    st.dictionaries(keys, values, max_size=4),
    lambda inner: st.dictionaries(
        keys, st.one_of(values, inner, st.lists(inner, min_size=1, max_size=3)), max_size=4
    ),
    max_leaves=8,
)


@given(tables)
def test_formatted_toml_parses_back_to_the_same_document(document: Document) -> None:
    assert tomllib.loads(format_toml(document)) == document


def test_a_name_defaults_to_the_file_name(bought: Document, write: Callable[..., Path]) -> None:
    del bought["drive"]["name"]
    assert read_drive(write(bought, "shoulder.toml")).name == "shoulder"


def test_a_bought_drive_has_no_clearances(bought: Document) -> None:
    with pytest.raises(InputError, match=r"design: found no such table, expected \[design\]"):
        design_model(parse_drive(bought))


def test_defaults_follow_the_values_that_the_file_gives() -> None:
    """The wall is 0.6 of the rim stated in the file, not of the default rim."""
    document = copy.deepcopy(DRAWN)
    document["design"]["flexspline"] = {"rim_thickness_mm": 0.7}
    design = parse_drive(document).design
    assert design is not None
    drive = make_drive(design)
    assert drive.flexspline.wall_thickness_mm == pytest.approx(0.6 * 0.7, rel=1e-12)


def test_keys_of_one_name_are_distinguished_by_their_dimension() -> None:
    keys = (Key("gap", "rad_per_K"), Key("gap", "rad", required=True))
    found = read_keys("f", "", {"gap_arcmin": 1, "gap_arcsec_per_K": 60}, keys)
    assert found["gap_rad"].value == pytest.approx(found["gap_rad_per_K"].value)
    for table, message in (
        ({"gap_rad_per_K": 1}, "f: gap_rad: found nothing"),
        ({"gap_Nm": 1}, "expected a unit of dimension rad^1 K^-1 or an angle"),
        ({"gap": 1}, "gap: found no unit"),
        ({"gap_rad": 1, "gap_deg": 1}, "gap_deg: found gap_rad as well"),
    ):
        with pytest.raises(InputError) as caught:
            read_keys("f", "", table, keys)
        assert message in str(caught.value)


@given(st.floats(1e-6, 1e6))
def test_a_value_in_the_keys_own_unit_keeps_every_bit(value: float) -> None:
    keys = (Key("length", "mm"), Key("angle", "arcmin"))
    read = read_keys("drive.toml", "", {"length_mm": value, "angle_arcmin": value}, keys)
    assert [read["length"].value, read["angle"].value] == [value, value]


@pytest.mark.parametrize("name", library())
def test_every_effect_of_the_library_can_be_exported_from_a_drive_file(
    tmp_path: Path, bought: dict[str, Any], name: str
) -> None:
    c = core()
    effect = library_effects(c)[name]
    table: dict[str, Any] = {"name": name}
    for i in range(effect.value_count):
        low, high = effect.bound[i]
        key = c.ffi.string(effect.card.value[i].name).decode()
        table[key] = min(max(effect.card.value[i].typical, low), high)
    bought["effect"] = [table]
    controller = make_controller(parse_drive(bought), {})
    assert [used for used, _ in controller.effects] == [name]
    assert controller.effects[0][1] == pytest.approx([v for k, v in table.items() if k != "name"])


def test_values_of_an_effect_may_have_any_unit_in_fits_and_in_the_controller(
    bought: Document,
) -> None:
    kept = {"gap_rad_per_K": 1e-6, "gap_rad": 2e-3, "takeup_Nm": 0.4}
    other = {"gap_urad_per_C": 1, "takeup_mNm": 400, "gap_mrad": 2}
    found = []
    for values in (kept, other):
        drive = parse_drive({**bought, "effect": [{"name": "thermal_gap", **values}]})
        (exported,) = make_controller(drive, {}).effects
        fitted = term_from(drive.effects[0], library(), drive.file).values
        found += [exported[1], list(fitted)]
    assert all(one == pytest.approx(list(kept.values())) for one in found)
