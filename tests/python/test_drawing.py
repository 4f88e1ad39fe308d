"""Output for drawings: profiles with fillets, measures, files."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from lostmotion.cli import main
from lostmotion.design.textbook import textbook_drive
from lostmotion.drawing.files import curves_of
from lostmotion.drawing.measures import (
    base_half_angle,
    drawing_table,
    involute,
    pin_measure,
    shown,
    span_measure,
)
from lostmotion.drives import format_toml, parse_drive
from lostmotion.model import DesignModel, design_model
from lostmotion.report.gear_profiles import gear_profiles

GENERATORS = ("cosine", "discs", "rollers", "ring")


@pytest.fixture(scope="module", params=GENERATORS)
def model(request: pytest.FixtureRequest) -> DesignModel:
    return design_model(parse_drive(textbook_drive(25, 80, request.param)[0]))


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, -s], [s, c]])


def test_a_profile_runs_from_root_to_tip_without_a_corner_at_the_fillet(model: DesignModel) -> None:
    for gear in gear_profiles(model):
        radius = np.hypot(*gear.half_pitch.T)
        low, high = sorted((gear.root_mm, gear.tip_mm))
        assert radius.min() == pytest.approx(low, abs=1e-6)
        assert radius.max() == pytest.approx(high, abs=1e-6)
        assert low < gear.form_radius_mm < high
        assert gear.fillet_radius_mm > 0
        angle = np.arctan2(*gear.half_pitch.T)
        assert np.all(np.diff(angle) > -1e-9)
        assert angle[-1] == pytest.approx(math.pi / gear.teeth, abs=1e-9)
        # the arc is tangent to the flank and to the root circle: the polygon has no corner
        step = np.diff(gear.half_pitch, axis=0)
        turn = np.abs(np.diff(np.unwrap(np.arctan2(step[:, 1], step[:, 0]))))
        assert np.sum(turn > 0.35) <= 1  # the edge of the tip alone


def test_the_flank_is_the_involute_of_the_library(model: DesignModel) -> None:
    for gear in gear_profiles(model):
        teeth = model.drive.teeth
        base = teeth.module_mm * gear.teeth / 2 * math.cos(teeth.pressure_angle_rad)
        radius = np.hypot(*gear.half_pitch.T)
        low, high = sorted((gear.form_radius_mm, gear.tip_mm))
        on = (radius >= low - 1e-9) & (radius <= high + 1e-9)
        angle = np.arctan2(*gear.half_pitch.T)[on]
        expected = np.array(
            [base_half_angle(model, gear) - involute(math.acos(base / r)) for r in radius[on]]
        )
        near = np.abs(angle - expected) < 1e-9
        assert near.sum() >= 25


def test_pins_touch_both_flanks_and_do_not_cut_them(model: DesignModel) -> None:
    for gear in gear_profiles(model):
        pin = pin_measure(model, gear)
        side = -1.0 if gear.internal else 1.0
        reach = (pin.measure_mm - side * pin.diameter_mm) / 2
        middle = 0.0 if gear.internal else math.pi / gear.teeth
        centre = reach * np.array([math.sin(middle), math.cos(middle)])
        # closely spaced along the flank: the smallest distance is the pin's radius
        base = float(
            model.drive.teeth.module_mm
            * gear.teeth
            / 2
            * math.cos(model.drive.teeth.pressure_angle_rad)
        )
        radius = np.linspace(*sorted((gear.form_radius_mm, gear.tip_mm)), 20001)
        angle = base_half_angle(model, gear) - np.array(
            [involute(math.acos(base / r)) for r in radius]
        )
        flank = np.column_stack((radius * np.sin(angle), radius * np.cos(angle)))
        distance = np.hypot(*(flank - centre).T)
        assert distance.min() == pytest.approx(pin.diameter_mm / 2, abs=1e-6)
        assert gear.form_radius_mm != pin.contact_radius_mm


def test_a_span_is_the_distance_of_parallel_tangents_to_two_flanks(model: DesignModel) -> None:
    for gear in gear_profiles(model):
        found = span_measure(model, gear)
        assert (found is None) == gear.internal
        if found is None:
            continue
        k, width = found
        # jaws turned until they touch: at the angle at which both flanks are parallel, the extent
        # of k teeth is that of the flanks of the first and last tooth
        outline = gear.pitch()
        radius = np.hypot(*outline.T)
        flank = outline[(radius >= gear.form_radius_mm) & (radius < gear.tip_mm - 1e-9)]
        pitch = 2 * math.pi / gear.teeth
        last = turned(flank[flank[:, 0] > 0], pitch * (k - 1) / 2)
        assert 2 * last[:, 0].max() == pytest.approx(width, rel=1e-4)


def test_the_module_of_the_table_gives_its_diameters() -> None:
    # 35 mm / 102: with 4 decimals the reference diameter is 4 um off.
    drive = parse_drive(textbook_drive(14, 51, "discs")[0])
    rows = {r.key: shown(r.flexspline, r.digits) for r in drawing_table(design_model(drive))}
    teeth = int(rows["z"])
    assert float(rows["m"]) * teeth == pytest.approx(float(rows["d"]), abs=1e-4)


def test_contours_are_where_the_rim_ends(model: DesignModel) -> None:
    curves = curves_of(model)
    half_rim = model.drive.flexspline.rim_thickness_mm / 2
    apart = np.hypot(*(curves["generator_seat"] - curves["neutral_line_deformed"]).T)
    assert apart == pytest.approx(half_rim, rel=1e-9)
    assert ("cam" in curves) == (model.drive.generator.type == model.core.lib.LM_COSINE)
    assert len(curves["flexspline"]) % model.drive.teeth.flexspline_teeth == 0


def test_the_command_writes_every_file_and_refuses_a_folder_that_is_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, folder = tmp_path / "drive.toml", tmp_path / "drawing"
    file.write_text(format_toml(textbook_drive(25, 80, "cosine")[0]))
    assert main(["drawing", str(file), "-o", str(folder), "--csv-only", "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [Path(f).name for f in answer["files"]] == [
        "flexspline.csv",
        "rigid.csv",
        "neutral_line_deformed.csv",
        "generator_seat.csv",
        "cam.csv",
        "table.csv",
        "table.html",
    ]
    assert "span measure" in (folder / "table.html").read_text()
    assert answer["table"]["W_k"]["rigid"] is None
    assert main(["drawing", str(file), "-o", str(folder), "--csv-only"]) == 2


def test_a_dxf_holds_the_curves_in_mm(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf", reason="DXF needs the package ezdxf")
    file, folder = tmp_path / "drive.toml", tmp_path / "drawing"
    file.write_text(format_toml(textbook_drive(25, 80, "cosine")[0]))
    assert main(["drawing", str(file), "-o", str(folder)]) == 0
    read = ezdxf.readfile(folder / "profiles.dxf")
    lines = {line.dxf.layer: line for line in read.modelspace().query("LWPOLYLINE")}
    points = np.loadtxt(folder / "rigid.csv", delimiter=",", skiprows=1)
    assert lines["rigid"].closed
    assert np.array(lines["rigid"].get_points("xy")) == pytest.approx(points, abs=1e-6)
    assert read.units == ezdxf.units.MM
    assert set(lines) >= {"flexspline", "rigid", "generator_seat", "cam"}
