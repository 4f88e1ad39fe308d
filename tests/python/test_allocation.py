"""The cheapest grades that meet a target of the lost motion, against every combination."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import pytest

from lostmotion.allocation import (
    LEVELS,
    cheapest_tolerances,
    features_of,
    gap_function,
    price,
    widest_gap,
)
from lostmotion.cli import main
from lostmotion.drives import format_toml, parse_drive
from lostmotion.errors import InputError
from lostmotion.model import design_model, reversal_torque
from lostmotion.units import ARCMIN


@pytest.fixture
def toleranced(drawn: dict[str, Any]) -> dict[str, Any]:
    drawn["design"]["tolerance"] = [
        {"kind": "fit", "fit": "H7/g6", "nominal_mm": 48, "zone": "generator", "name": "seat"},
        {"kind": "gear", "gear": "flexspline", "tooth_grade": 6, "cost_weight": 2},
        {"kind": "shaft", "lower_um": -4, "upper_um": 4, "zone": "generator"},
        {"kind": "hole", "it_grade": 6, "nominal_mm": 20, "zone": "generator", "name": "bore"},
    ]
    return drawn


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("share", [None, 0.85, 1.2])
def test_no_combination_of_grades_is_cheaper(
    toleranced: dict[str, Any], level: str, share: float | None
) -> None:
    drive = parse_drive(toleranced)
    model, features = design_model(drive), features_of(drive)
    at = reversal_torque(drive)
    whole = model.tolerance_limits()[f"{level}_max"]
    now = model.reversal_lost_motion(at, 0.0, whole) / ARCMIN
    found = cheapest_tolerances(drive, None if share is None else share * now, level)
    assert found["now_arcmin"] == pytest.approx(now)
    assert found["then_arcmin"] <= found["target_arcmin"] * (1 + 1e-9)
    gap_of = gap_function(model, features, level)
    widest = widest_gap(
        lambda gap: model.reversal_lost_motion(at, 0.0, gap) / ARCMIN, found["target_arcmin"], 0.25
    )
    every = itertools.product(*(range(len(feature.options)) for feature in features))
    cheapest = min(
        sum(feature.options[i].cost for feature, i in zip(features, where, strict=True))
        for where in every
        if gap_of(where) <= widest * (1 + 1e-9)
    )
    assert found["cost_then"] == pytest.approx(cheapest, rel=1e-9)
    assert [f["name"] for f in found["features"]] == [
        "seat, hole",
        "seat, shaft",
        "tolerance[1]",
        "bore",
    ]


def test_the_cost_is_the_reciprocal_of_the_field() -> None:
    assert price(((0.0, 0.025),), ((0.0, 0.025),)) == 1
    assert price(((0.0, 0.025),), ((-0.009, 0.0),)) == pytest.approx(25 / 9)


def test_predict_prints_the_cheapest_grades(
    toleranced: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, answer, report = tmp_path / "d.toml", tmp_path / "a.json", tmp_path / "r.html"
    file.write_text(format_toml(toleranced))
    arguments = ["predict", str(file), "--target", "7", "--json", str(answer)]
    assert main([*arguments, "--report", str(report)]) == 0
    shown = capsys.readouterr().out
    found = json.loads(answer.read_text())["allocation"]
    assert found["then_arcmin"] <= 7
    assert f"cost {found['cost_then']:.3f} (now {found['cost_now']:.3f})" in shown
    assert "Cheapest grades" in report.read_text(encoding="utf-8")
    assert main(["predict", str(file), "--target", "0.1"]) == 2
    assert "the value with the finest grades" in capsys.readouterr().err


def test_without_a_grade_there_is_nothing_to_allocate(drawn: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="no grade"):
        cheapest_tolerances(parse_drive(drawn))
