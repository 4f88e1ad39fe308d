"""Several drives, or one with a dimension swept, in one table."""

from __future__ import annotations

import copy
import csv
import json
import math
from pathlib import Path

import pytest

from conftest import DATA
from lostmotion.cli import main
from lostmotion.drives import parse_drive, read_drive
from lostmotion.model import design_model
from lostmotion.predict import predict
from lostmotion.side_by_side import drive_row, sweep

DRIVES = [DATA / "drives" / f"{name}.toml" for name in ("reference_a", "external_ring", "size_25")]


def test_each_drive_has_a_row_of_what_predict_states(tmp_path: Path) -> None:
    table, answer = tmp_path / "out.csv", tmp_path / "out.json"
    arguments = ["predict", *map(str, DRIVES), "--table", str(table), "--json", str(answer)]
    assert main(arguments) == 0
    with table.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["drive"] for row in rows] == [read_drive(file).name for file in DRIVES]
    for row, file in zip(rows, DRIVES, strict=True):
        drive = read_drive(file)
        alone = predict(drive, [drive.rated_torque_Nm])
        for column, value in (
            ("reversal_lost_motion_arcmin", alone["reversal_lost_motion_arcmin"]),
            ("angle_at_rated_arcmin", alone["total_arcmin"][0]),
            ("stiffness_at_rated_Nm_per_rad", alone["stiffness_Nm_per_rad"][0]),
            ("secant_stiffness_Nm_per_rad", alone["secant_stiffness_Nm_per_rad"]),
        ):
            assert float(row[column]) == value
    assert rows[2]["safety_factor"] == ""
    assert rows[0]["checks_not_kept"] == ""
    assert [row["drive"] for row in json.loads(answer.read_text())["rows"]] == [
        row["drive"] for row in rows
    ]


def test_a_refused_file_has_a_row_with_the_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table, bad, gone = tmp_path / "out.csv", tmp_path / "bad.toml", tmp_path / "gone.toml"
    bad.write_text(DRIVES[0].read_text().replace("flexspline_teeth = ", "flexspline_teeth = 1"))
    files = [*map(str, (DRIVES[0], bad, gone, DRIVES[2]))]
    assert main(["predict", *files, "--table", str(table)]) == 0
    assert capsys.readouterr().out.count("refused: ") == 2
    with table.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [bool(row["refused"]) for row in rows] == [False, True, True, False]
    assert [bool(row["reversal_lost_motion_arcmin"]) for row in rows] == [True, False, False, True]
    assert (rows[1]["drive"], rows[2]["drive"]) == (str(bad), str(gone))
    assert "teeth" in rows[1]["refused"]
    # If there is no row of numbers, nothing is written.
    assert main(["predict", str(bad), str(gone), "--table", str(tmp_path / "none.csv")]) == 2
    assert not (tmp_path / "none.csv").exists()
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("key", "teeth"), [("flexspline_teeth", 198), ("rigid_teeth", 200)])
def test_a_sweep_of_the_teeth_takes_the_other_gear_and_the_ratio_along(
    key: str, teeth: int, sign: int
) -> None:
    document = copy.deepcopy(read_drive(DRIVES[0]).document)
    document["drive"]["ratio"] *= sign
    stated = sweep(parse_drive(document), f"teeth.{key}", [teeth, teeth + 1])["rows"]
    gears, ratio = document["design"]["teeth"], document["drive"]["ratio"]
    assert gears["rigid_teeth"] - gears["flexspline_teeth"] == 2
    gears.update(flexspline_teeth=198, rigid_teeth=200)
    document["drive"]["ratio"] = ratio - math.copysign(1.0, ratio)
    by_hand = drive_row(parse_drive(document))
    assert stated[0] == {f"teeth.{key}": teeth, **by_hand}
    assert "an even number" in stated[1]["refused"]


def test_a_sweep_changes_one_key_and_states_what_it_refuses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = tmp_path / "sweep.html"
    at = "teeth.rigid_shift=2.9:5.0:4"
    assert main(["predict", str(DRIVES[0]), "--sweep", at, "--report", str(report)]) == 0
    shown = capsys.readouterr().out
    assert "refused: " in shown
    assert "run to a point" in shown
    assert "teeth.rigid_shift" in report.read_text(encoding="utf-8")
    drive = read_drive(DRIVES[0])
    rows = sweep(drive, "teeth.face_width_mm", [8.0, 12.0])["rows"]
    assert rows[0]["reversal_lost_motion_arcmin"] > rows[1]["reversal_lost_motion_arcmin"]
    # A key in another unit replaces the one stated in the file.
    by_unit = sweep(drive, "teeth.face_width_um", [8000.0])["rows"][0]
    checks = {c.name: c.value for c in design_model(drive).checks()}
    assert by_unit["flank_pressure_MPa"] == pytest.approx(rows[0]["flank_pressure_MPa"])
    assert by_unit["flank_pressure_MPa"] > checks["flank_pressure"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--sweep", "teeth.face_width_mm"], "KEY=FROM:TO:N"),
        (["--sweep", "teeth.face_width_mm=8:8:3"], "KEY=FROM:TO:N"),
        (["--sweep", "teeth.fac_width_mm=8:9:3"], "did you mean 'face_width_mm'"),
        (["--sweep", "teeth.face_width=8:9:3"], "a length"),
        (["--sweep", "teeth.module_mm.x=8:9:3"], "a key such as"),
        (["--table", "t.csv", "--torque", "1:2:3"], "one drive, without"),
        ([str(DRIVES[1]), "--sweep", "teeth.face_width_mm=8:9:3"], "one, whose key"),
    ],
)
def test_a_table_that_cannot_be_made_is_refused_with_one_line(
    options: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["predict", str(DRIVES[0]), *options]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
