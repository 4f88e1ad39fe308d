"""Each rung has its own verdict, and unsound effects are neither recommended nor written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import tomllib
from small_campaigns import ARCSEC, DRIVE, RATED_NM, campaign, gap

from lostmotion.cli import main
from lostmotion.discover.ladder import gain, harms, make_rungs
from lostmotion.discover.measured_conditions import settings_of
from lostmotion.drives import parse_drive
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.formula import written_formula
from lostmotion.effects.library import library
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.fitted_range import beyond, in_words
from lostmotion.fit.terms import Term
from lostmotion.report.discovery import verdict_sentence


def test_what_is_certain_is_stated_apart_from_what_is_open() -> None:
    answer = {
        "verdict": "ambiguous",
        "effects": ["thermal_gap", "wear", "creep"],
        "ladder": [
            {"effects": []},
            {"effects": ["thermal_gap"], "effect": "thermal_gap", "verdict": "missing-effect"},
            {"effects": ["thermal_gap", "wear"], "effect": "wear", "verdict": "ambiguous"},
        ],
    }
    assert verdict_sentence(answer) == (
        "Missing: thermal_gap. In addition, confounded: wear, creep."
    )


def fitted_with(data, *terms: Term) -> list[BaselineModel]:
    """The fitted baseline model of a campaign, alone and with terms."""
    base = BaselineModel(Conditions(data), RATED_NM)
    base.first_fit()
    models = [base]
    for term in terms:
        models.append(models[-1].copy())
        models[-1].terms.append(term)
        models[-1].fit()
    return models


def test_settings_are_those_of_the_plan_and_leave_half_of_the_samples() -> None:
    c = Conditions(campaign())
    settings = settings_of(c)
    assert [(one.low, one.high) for one in settings["amplitude"]] == [
        pytest.approx((size, size), rel=0.02) for size in (0.4 * RATED_NM, 0.7 * RATED_NM, RATED_NM)
    ]
    assert str(settings["amplitude"][0]) == "amplitude 15.9 Nm"
    for found in settings.values():
        assert all(2 * len(one.runs) <= c.runs for one in found)


def test_an_effect_that_the_others_show_and_a_setting_contradicts_makes_it_worse() -> None:
    def turns_round(columns, wound):
        """A wave of the input's angle that has the other sign at the largest load."""
        sign = -1.0 if np.max(np.abs(columns["torque"])) > 0.9 * RATED_NM else 1.0
        return 4.0 * sign * np.cos(columns["input_angle"])

    data = campaign(rows=200)
    for run in data.runs:
        columns = run.columns
        columns["input_angle"] = 2 * np.pi * np.arange(200) / 40.0 + columns["input_angle"]
        columns["lost_motion"] += turns_round(columns, None) * ARCSEC
    wave = written_formula("size_rad * cos(2*pi*input_turns)", "formula_1")
    before, after = make_rungs(fitted_with(data, Term(wave, wave.typical.copy(), wave.free())))
    found = harms(before, after)
    assert "amplitude" in {one["condition"] for one in found}
    assert found[0]["setting"] == "amplitude 39.7 Nm"
    assert found[0]["rms_heldout_arcsec"] > 1.05 * found[0]["rms_heldout_arcsec_before"]


def test_a_true_effect_makes_no_setting_worse_and_has_a_gain_above_nothing() -> None:
    effect = library()["thermal_gap"]
    term = Term(effect, effect.typical.copy(), effect.free())
    before, after = make_rungs(fitted_with(campaign(rows=200, add=gap), term))
    assert harms(before, after) == []
    size, (low, high) = gain(before.left_out, after.left_out, before.model.conditions.starts)
    assert 0 < low < size < high
    assert size == pytest.approx(before.heldout_rms_arcsec - after.heldout_rms_arcsec)


STOPPED = """
[[effect]]
name = "thermal_gap"
gap_rad_per_K = 1e-6
gap_rad = 0.05
takeup_Nm = {takeup!r}
"""


def test_export_refuses_a_value_at_its_bound_but_with_force(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    value = next(v for v in library()["thermal_gap"].values if v.name == "takeup_Nm")
    drive, header = tmp_path / "drive.toml", tmp_path / "parameters.h"
    drive.write_text(DRIVE + STOPPED.format(takeup=value.high))
    arguments = ["export", str(drive), "-o", str(header)]
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert "thermal_gap.takeup_Nm" in said
    assert said.count("\n") == 1
    assert not header.exists()
    assert main([*arguments, "--force"]) == 0
    assert header.exists()
    within = DRIVE + STOPPED.format(takeup=0.5 * value.high)
    assert parse_drive(tomllib.loads(within)).effects
    drive.write_text(within)
    assert main(arguments) == 0


def test_a_prediction_beyond_the_fitted_range_is_marked_with_the_factor() -> None:
    fitted = {"torque_Nm": [-10.0, 10.0], "temperature_C": [20.0, 20.0]}
    assert beyond(fitted, {"torque_Nm": [-4.0, 4.0], "temperature_C": [20.0, 20.0]}) == {}
    far = beyond(fitted, {"torque_Nm": [-16.0, 4.0], "temperature_C": [20.0, 40.0]})
    assert far == {"torque": 1.6, "temperature": None}
    assert in_words(far) == (
        "1.6 times the fitted range of torque, temperature fitted at one value only"
    )
