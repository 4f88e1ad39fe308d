"""Derivatives with respect to the dimensions of a drawing, and changes that repair a failed
check."""

from __future__ import annotations

import copy
import functools
import json
from pathlib import Path

import pytest

from lostmotion.cli import main
from lostmotion.design.textbook import textbook_drive
from lostmotion.drives import Drive, format_toml, parse_drive
from lostmotion.errors import InputError
from lostmotion.idealisations import interference
from lostmotion.model import design_model
from lostmotion.sensitivity import (
    figures_of,
    hint_sentence,
    hints,
    margins,
    sensitivities,
    with_value,
)

textbook = functools.cache(textbook_drive)


def drawn(**teeth: float) -> Drive:
    document = copy.deepcopy(textbook(20, 100, "discs")[0])
    for name, change in teeth.items():
        document["design"]["teeth"][name] += change
    return parse_drive(document)


def test_a_derivative_predicts_a_small_change() -> None:
    drive = drawn()
    before = figures_of(drive, 1.6)
    for one in sensitivities(drive, 1.6):
        change = 2e-5
        after = figures_of(with_value(drive, one.key, one.value + change), 1.6)
        slopes = (one.lost_motion_arcmin, one.stiffness_Nm_per_rad, one.stress)
        for a, b, slope in zip(after, before, slopes, strict=True):
            assert a - b == pytest.approx(slope * change, rel=1e-2, abs=1e-9)
    assert {one.key for one in sensitivities(drive, 1.6)} >= {"teeth.rigid_shift"}


def moved(drive: Drive, key: str, to: float) -> float:
    return figures_of(with_value(drive, key, to), 1.6)[0]


def test_a_derivative_is_that_at_the_drive_and_says_where_it_ends() -> None:
    # The free play of a drive of `new` becomes zero within the last digit of its shifts.
    drive = drawn()
    found = {one.key: one for one in sensitivities(drive, 1.6)}
    for key in ("teeth.flexspline_shift", "teeth.rigid_shift", "generator.deflection_mm"):
        one = found[key]
        near = [moved(drive, key, one.value + side * 1e-6) for side in (-1, 1)]
        assert one.lost_motion_arcmin == pytest.approx((near[1] - near[0]) / 2e-6, rel=1e-4)
        (end,) = (e for e in (one.holds_from, one.holds_to) if e is not None)
        assert 0 < abs(end - one.value) < 0.01
        here = moved(drive, key, one.value)
        for share, holds in ((0.9, True), (1.1, False)):
            change = share * (end - one.value)
            after = moved(drive, key, one.value + change) - here
            assert (after == pytest.approx(one.lost_motion_arcmin * change, rel=0.1)) == holds


@pytest.mark.parametrize(
    "wrong", [{"rigid_shift": -0.15}, {"engagement_depth": 0.3}, {"flexspline_shift": 0.3}]
)
def test_the_first_hint_mends_every_check(wrong: dict[str, float]) -> None:
    drive = drawn(**wrong)
    first = hints(drive)[0]
    assert first.broken == ()
    after = margins(with_value(drive, first.key, first.to))
    assert after is not None
    assert min(after.values()) >= 0
    assert "every check passes" in hint_sentence(first)


def test_a_sound_drive_has_no_hint() -> None:
    assert hints(drawn()) == []


def test_predict_prints_hints_and_sensitivity(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "drive.toml"
    file.write_text(format_toml(drawn(rigid_shift=-0.15).document))
    assert main(["predict", str(file), "--sensitivity"]) == 0
    out = capsys.readouterr().out
    assert "hint: with teeth." in out
    assert "change per unit of a dimension" in out
    assert main(["predict", str(file), "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {one["key"] for one in answer["sensitivity"]} >= {"teeth.face_width_mm"}


def test_torques_beyond_the_ratcheting_torque_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "drive.toml"
    file.write_text(format_toml(drawn().document))
    ratchets = {c.name: c.value for c in design_model(drawn()).checks()}["ratcheting_torque"]
    for share, said in ((0.99, 0), (1.01, 2)):
        reach = share * ratchets
        assert main(["predict", str(file), f"--torque={-reach}:{reach}:3"]) == 0
        out = capsys.readouterr().out
        assert (f"{said} torques: Angles at torques beyond" in out) == bool(said)
        assert ("do not ratchet" in out) == bool(said)


@pytest.mark.parametrize(
    ("fit", "said"), [("H7/p6", ["up to 21 um"]), ("H7/h6", []), ("H7/g6", [])]
)
def test_an_interference_fit_is_said_to_count_as_no_gap(fit: str, said: list[str]) -> None:
    document = copy.deepcopy(drawn().document)
    entry = {"kind": "fit", "name": "seat", "fit": fit, "nominal_mm": 40, "zone": "generator"}
    document["design"]["tolerance"] = [entry]
    found = interference(design_model(parse_drive(document)))
    assert len(found) == len(said)
    assert all(word in line for word, line in zip(said, found, strict=True))


def test_a_planar_drive_with_sections_is_refused_by_both_keys() -> None:
    document = copy.deepcopy(drawn().document)
    document["design"]["planar_only"] = True
    with pytest.raises(InputError, match="axial_sections = 3, expected axial_sections = 1"):
        design_model(parse_drive(document))


def test_a_bought_drive_has_no_dimensions(capsys: pytest.CaptureFixture[str]) -> None:
    file = Path(__file__).parents[1] / "data" / "drives" / "size_25.toml"
    assert main(["predict", str(file), "--sensitivity"]) == 2
    assert "size_25.toml: design: found no such table" in capsys.readouterr().err
