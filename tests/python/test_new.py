"""A new drive file: textbook proportions that pass all checks, every key explained."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from lostmotion.cli import main
from lostmotion.design.textbook import CLOSEST_ROLLERS, textbook_drive
from lostmotion.drives import Drive, parse_drive, read_drive
from lostmotion.model import ADVICE, design_model
from lostmotion.structs import GENERATORS, design_keys


@pytest.mark.parametrize("generator", GENERATORS)
@pytest.mark.parametrize(("size", "ratio"), [(8, 80), (20, 100), (25, 80), (32, 160), (65, 120)])
def test_a_usual_size_keeps_every_check_at_both_edges_of_the_face(
    size: int, ratio: int, generator: str
) -> None:
    document, broken = textbook_drive(size, ratio, generator)
    assert broken == []
    for sections in (1, 3, 5, 7):
        document["design"]["axial_sections"] = sections
        checks = design_model(parse_drive(document)).checks()
        assert [c.name for c in checks if c.margin < 0 and c.name not in ADVICE] == []


def test_proportions_are_those_of_a_catalogue_size() -> None:
    document, _ = textbook_drive(20, 100)
    teeth = document["design"]["teeth"]
    assert teeth["module_mm"] * teeth["flexspline_teeth"] == pytest.approx(50.0)
    assert document["drive"]["rated_torque_Nm"] == 40  # CSF-20-100
    # CSF-20-50 is rated 25 N m, CSF-20-80 34 N m: within 5 %.
    assert textbook_drive(20, 50)[0]["drive"]["rated_torque_Nm"] == pytest.approx(25, rel=0.05)
    assert textbook_drive(20, 80)[0]["drive"]["rated_torque_Nm"] == pytest.approx(34, rel=0.05)


def failed(drive: Drive) -> list[str]:
    return [c.name for c in design_model(drive).checks() if c.margin < 0 and c.name not in ADVICE]


@pytest.mark.parametrize(("size", "torque_Nm"), [(17, 21.0), (20, 33.0), (25, 51.0)])
def test_a_drive_is_drawn_for_the_torque_of_a_data_sheet(
    size: int, torque_Nm: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ratings above the usual torque: the drive of the usual torque is too weak for them."""
    monkeypatch.chdir(tmp_path)
    words = [f"size-{size}", "ratio-50", f"torque-{torque_Nm:g}", "cosine", "rated"]
    assert main(["new", *words]) == 0
    rated = read_drive(tmp_path / "rated.toml")
    assert rated.rated_torque_Nm == torque_Nm
    assert failed(rated) == []
    usual, _ = textbook_drive(size, 50, "cosine")
    assert usual["drive"]["rated_torque_Nm"] < torque_Nm
    usual["drive"]["rated_torque_Nm"] = torque_Nm
    assert failed(parse_drive(usual)) == ["safety_factor"]


def test_what_no_proportion_mends_is_stated_in_the_file_and_in_the_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "size-200", "ratio-319", "cosine", "steep", "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["broken_checks"] == ["ratcheting_torque"]  # teeth of 0.8 mm for 40 kNm
    text = (tmp_path / "steep.toml").read_text()
    assert re.search(r"^# check failed: ratcheting_torque \S+ Nm, limit \S+$", text, re.M)


def test_rollers_move_closer_until_the_rim_endures() -> None:
    """A ring under four forces at 20 deg bends less than at 30 deg for the same deflection."""
    document, broken = textbook_drive(20, 30, "rollers")
    assert broken == []
    assert 20 < document["design"]["generator"]["contact_half_angle_deg"] < 30
    order, place = np.arange(2, 4000, 2), np.radians(np.linspace(0, 90, 181))
    peak = {}
    for half_deg in (10, CLOSEST_ROLLERS, 30):
        force = np.cos(order * np.radians(half_deg))
        curvature = (force / (order**2 - 1)) @ np.cos(np.outer(order, place))
        peak[half_deg] = np.abs(curvature).max() / (3 * (force / (order**2.0 - 1) ** 2).sum())
    assert min(peak, key=lambda angle: peak[angle]) == CLOSEST_ROLLERS
    assert peak[CLOSEST_ROLLERS] == pytest.approx(0.97, abs=0.005)
    assert peak[30] == pytest.approx(1.14, abs=0.005)


def test_every_key_of_a_design_is_in_the_file_which_reads_as_what_was_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "d.toml"
    assert main(["new", "size-25", "ratio-80", "ellipse", "-o", str(file)]) == 0
    text = file.read_text()
    for key in design_keys():
        assert re.search(rf"^(# )?{key.name}(_\w+)?( = |$)", text, re.M), key.name
        assert f"# {key.meaning} [" in text
    made, _ = textbook_drive(25, 80, "ellipse", "size_25_ratio_80")
    read, expected = design_model(read_drive(file)), design_model(parse_drive(made))
    for one, other in zip(read.checks(), expected.checks(), strict=True):
        assert one.margin == pytest.approx(other.margin, rel=1e-9, abs=1e-12)
    # The values in comments are the defaults: stated, they change nothing.
    filled = re.sub(r"^# (\w+ = \S+)$", r"\1", text, flags=re.M)
    assert filled != text
    file.write_text(filled)
    for one, other in zip(design_model(read_drive(file)).checks(), read.checks(), strict=True):
        assert one.margin == pytest.approx(other.margin, rel=1e-6, abs=1e-9)
    capsys.readouterr()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("size-x", "found 'size-x', expected numbers, as in size-20 ratio-100"),
        ("size-20 size-25", "size: found '20' and '25', expected one size"),
        ("discs ring", "wave generator: found 'discs' and 'ring', expected one wave generator"),
        ("elbow knee", "name: found 'elbow' and 'knee', expected one name"),
        ("size-1", "size: found 1, expected 3 to 200"),
        ("ratio-500", "ratio: found 500, expected 30 to 319"),
        ("ratio-99.5", "expected numbers, as in size-20 ratio-100"),
        ("torque-x", "found 'torque-x', expected numbers, as in size-20 ratio-100 torque-40 (N m)"),
        ("torque-0", "torque: found 0, expected 1e-06 to 500000 N m"),
        ("torque-nan", "torque: found nan, expected 1e-06 to 500000 N m"),
        ("torque-25 torque-33", "torque: found '25' and '33', expected one torque"),
        ("size-nan", "size: found nan, expected 3 to 200"),
    ],
)
def test_words_that_mean_nothing_are_refused_in_one_line(
    words: str,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", *words.split()]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert said in lines[0]
    assert list(tmp_path.iterdir()) == []


def test_what_was_made_of_the_words_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "hat.toml"
    assert main(["new", "size-20", "hat", "-o", str(file)]) == 0
    said = "'hat': a cup of size 20, ratio 100, wave generator discs"
    assert capsys.readouterr().out.splitlines() == [str(file), said]


def test_a_file_that_exists_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.toml"
    file.write_text("mine")
    assert main(["new", "-o", str(file)]) == 2
    assert file.read_text() == "mine"
    assert "a file that exists" in capsys.readouterr().err
