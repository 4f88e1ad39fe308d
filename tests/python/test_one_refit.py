"""`diagnose`, `fit` and `compare` use the same refit: the same numbers on the same data."""

from __future__ import annotations

import pytest
import tomllib
from small_campaigns import ARCSEC, DRIVE, campaign, gap

from lostmotion.commands.discover import show_diagnosis, show_fit
from lostmotion.compare import Comparison, compare
from lostmotion.discover import Diagnosis, FittedModel, diagnose, fit_model
from lostmotion.drives import parse_drive

EFFECT = "thermal_gap"


@pytest.fixture(scope="module")
def answers() -> tuple[Diagnosis, FittedModel, Comparison]:
    drive = parse_drive(tomllib.loads(DRIVE))
    data = campaign(add=gap)
    return diagnose(drive, data), fit_model(drive, data, add=EFFECT), compare(drive, data)


def printed_values(text: str) -> dict[str, str]:
    """Values of the effect as a command prints them, by name."""
    lines = [line.replace(" = ", " ").split(None, 1) for line in text.splitlines()]
    return {line[0]: line[1] for line in lines if line and line[0].startswith(f"{EFFECT}.")}


def test_diagnose_and_fit_print_the_same_values(
    answers: tuple[Diagnosis, FittedModel, Comparison], capsys: pytest.CaptureFixture[str]
) -> None:
    found, fitted, _ = answers
    show_diagnosis(found.answer())
    assert found.effects == [EFFECT]
    values = printed_values(capsys.readouterr().out)
    show_fit(fitted, "fitted.toml")
    assert values == printed_values(capsys.readouterr().out)
    assert "+-" in values[f"{EFFECT}.gap_rad_per_K"]


def test_every_rung_and_yardstick_is_the_same(
    answers: tuple[Diagnosis, FittedModel, Comparison],
) -> None:
    found, fitted, compared = answers
    errors = [
        [(rung["rms_arcsec"], rung["rms_heldout_arcsec"]) for rung in one.ladder]
        for one in (found, fitted)
    ]
    assert errors[0] == errors[1]
    assert found.noise_floor_arcsec == fitted.noise_floor_arcsec
    assert errors[0][0] == (
        pytest.approx(compared.rms_rad / ARCSEC, rel=1e-12),
        pytest.approx(compared.heldout_rms_rad / ARCSEC, rel=1e-12),
    )


def test_the_value_is_the_hidden_one_within_its_standard_error(
    answers: tuple[Diagnosis, FittedModel, Comparison],
) -> None:
    first = answers[0].candidates[0]
    error = first["standard_errors"]["gap_rad_per_K"]
    off = first["parameters"]["gap_rad_per_K"] - 0.3 * ARCSEC
    assert 0 < error < 0.03 * ARCSEC
    assert abs(off) < 4 * error


def test_fit_marks_an_effect_that_is_not_significant(
    answers: tuple[Diagnosis, FittedModel, Comparison], capsys: pytest.CaptureFixture[str]
) -> None:
    show_fit(answers[1], "fitted.toml")
    assert "not significant" not in capsys.readouterr().out
    made_up = fit_model(
        parse_drive(tomllib.loads(DRIVE)), campaign(), add="size_rad * cos(7*input_angle_rad)"
    )
    show_fit(made_up, "fitted.toml")
    assert "not significant: formula_1 (p = " in capsys.readouterr().out
