"""The commands of discovery, from recordings to a fitted file."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from small_campaigns import ARCSEC, DRIVE, campaign, gap, turning_joint, write

from lostmotion.cli import main
from lostmotion.discover import library
from lostmotion.discover.fitted_model import fit_model
from lostmotion.drives import format_toml, parse_drive, read_drive, tomllib
from lostmotion.errors import InputError
from lostmotion.fit.drive_file import make_base


def test_a_fitted_file_reads_back_as_the_same_model():
    drive = parse_drive(tomllib.loads(DRIVE))
    data = campaign(add=gap)
    model = fit_model(drive, data, ["thermal_gap"])
    again = parse_drive(tomllib.loads(format_toml(model.document(drive))))
    base = make_base(again, data, None, library())
    base.hysteresis.start = model.base.hysteresis.start
    np.testing.assert_allclose(base.at().angle, model.base.at().angle, atol=1e-9)
    falls = [rung["rms_heldout_arcsec"] for rung in model.ladder]
    assert falls[1] < falls[0]
    place = model.names.index("thermal_gap.gap_rad_per_K")
    error = model.standard_errors[place]
    assert abs(model.values[place] - 0.3 * ARCSEC) < 5 * error + 0.03 * ARCSEC


def test_an_effect_without_its_column_cannot_be_added():
    drive = parse_drive(tomllib.loads(DRIVE))
    with pytest.raises(InputError, match="cycles"):
        fit_model(drive, campaign(), ["wear"])


def test_commands_from_diagnosis_to_fitted_file(tmp_path, capsys):
    drive, data = tmp_path / "drive.toml", tmp_path / "data.csv"
    drive.write_text(DRIVE)
    write(campaign(add=gap), data)
    assert main(["diagnose", str(drive), str(data), "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["effects"] == ["thermal_gap"]
    fitted = tmp_path / "fitted.toml"
    words = ["fit", str(drive), str(data), "--add", "thermal_gap", "-o", str(fitted)]
    assert main(words) == 0
    assert "thermal_gap" in capsys.readouterr().out
    assert read_drive(fitted).effects[0]["name"] == "thermal_gap"
    assert main(["diagnose", str(fitted), str(data), "--json", "-"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["ladder"][0]["effects"] == ["thermal_gap"]
    assert (again["verdict"], again["effects"]) == ("complete", [])


def test_commands_about_effects_recordings_and_plans(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    drive, data = tmp_path / "drive.toml", tmp_path / "data.csv"
    drive.write_text(DRIVE)
    write(campaign(), data)
    assert main(["effects"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 28
    assert main(["effects", "wear"]) == 0
    assert "cycles" in capsys.readouterr().out
    assert main(["effects", "wera"]) == 2
    assert "wear" in capsys.readouterr().err
    assert main(["effects", "new", "cable_pull"]) == 0
    assert (tmp_path / "cable_pull.py").exists()
    assert main(["effects", "new", "cable_pull"]) == 2
    assert main(["check", str(data)]) == 0
    capsys.readouterr()
    assert main(["forecast", str(drive), str(data), "--json", "-"]) == 0
    forecast = json.loads(capsys.readouterr().out)
    assert forecast["schema"] == "lostmotion.forecast/1"
    rows = {row["name"]: row for row in forecast["effects"]}
    assert rows["thermal_gap"]["testable"]
    assert rows["ratcheting"]["testable"]
    assert not rows["wear"]["testable"]


def test_check_needs_no_ratio_to_be_right_about_a_turning_joint(tmp_path, capsys):
    def findings(file, *more):
        assert main(["check", file, "--json", "-", *more]) == 0
        found = json.loads(capsys.readouterr().out)
        return found["ratio_known"], found["findings"]

    sound = turning_joint(tmp_path / "a.csv")
    assert findings(sound) == (False, [])
    assert findings(sound, "--ratio", "100") == (True, [])
    assert findings(sound, "--ratio", "1e2") == (True, [])
    assert findings(turning_joint(tmp_path / "b.csv", locked=True)) == (False, [])
    for more in ([], ["--ratio", "100"]):
        (text,) = findings(turning_joint(tmp_path / "c.csv", dead=True), *more)[1]
        assert "output_angle_rad (run c at" in text
        assert "wild x 499: constant reading while the drive moved" in text
    for ratio, expected in (("0", "1 to 10000, or"), ("-2e4", "1 to 10000, or"), ("x", "a number")):
        assert main(["check", sound, "--ratio", ratio]) == 2
        assert f"--ratio: found '{ratio}', expected {expected}" in capsys.readouterr().err


def test_effects_of_c_and_their_cards():
    for name, one in library().items():
        assert one.name == name
        assert one.mechanism
        assert one.equation
        assert all(v.low <= v.typical <= v.high for v in one.values)
        assert dataclasses.is_dataclass(one)
