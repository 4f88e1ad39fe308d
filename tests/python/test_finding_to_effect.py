"""An unnamed finding includes a formula that ``fit --add`` accepts as printed."""

from __future__ import annotations

import contextlib
import io
import shlex

import numpy as np
import pytest
import tomllib
from small_campaigns import ARCSEC, DRIVE, campaign

from lostmotion.commands.discover import show_diagnosis
from lostmotion.compare import compare
from lostmotion.discover import FittedModel, diagnose, fit_model
from lostmotion.drives import Drive, format_toml, parse_drive
from lostmotion.effects.formula import written_formula
from lostmotion.errors import InputError
from lostmotion.export import make_controller
from lostmotion.fit.drive_file import written_effects
from lostmotion.recordings import Campaign

ORDER = 0.43


def drive() -> Drive:
    return parse_drive(tomllib.loads(DRIVE))


def turning() -> Campaign:
    """Loops while the input keeps turning, 6 turns per run."""
    data = campaign(rows=400)
    for run in data.runs:
        columns = run.columns
        columns["input_angle"] = columns["input_angle"] + 2 * np.pi * 0.15 * columns["time"]
        columns["output_angle"] = columns["input_angle"] / 100
        columns["lost_motion"] += 4 * ARCSEC * np.cos(ORDER * columns["input_angle"] + 0.3)
    return data


def printed_formulas(data: Campaign) -> list[str]:
    """Formulas behind ``--add`` in what `diagnose` prints."""
    with contextlib.redirect_stdout(io.StringIO()) as text:
        show_diagnosis(diagnose(drive(), data).answer())
    lines = [line for line in text.getvalue().splitlines() if "fit --add" in line]
    return [shlex.split(line)[-1] for line in lines]


@pytest.fixture(scope="module")
def rippled() -> tuple[Campaign, FittedModel]:
    data = turning()
    formulas = printed_formulas(data)
    return data, fit_model(drive(), data, add=formulas[:1])


def test_an_order_that_is_no_whole_number_is_fitted_as_printed(
    rippled: tuple[Campaign, FittedModel],
) -> None:
    _, model = rippled
    first, last = model.ladder[0], model.ladder[-1]
    assert last["rms_heldout_arcsec"] < 0.5 * first["rms_heldout_arcsec"]
    size = float(np.hypot(*model.base.terms[0].values))
    assert size == pytest.approx(4 * ARCSEC, rel=0.1)
    assert not model.at_bound()


def test_the_fitted_file_holds_the_formula_and_reads_back(
    rippled: tuple[Campaign, FittedModel],
) -> None:
    data, model = rippled
    fitted = parse_drive(tomllib.loads(format_toml(model.document(drive()))))
    assert f"{ORDER}" in fitted.effects[0]["formula"]
    again = compare(fitted, data)
    assert again.rms_rad / ARCSEC == pytest.approx(model.ladder[-1]["rms_arcsec"], rel=0.01)


def test_the_controller_does_not_get_a_wave_of_another_period_than_a_turn(
    rippled: tuple[Campaign, FittedModel],
) -> None:
    fitted = parse_drive(tomllib.loads(format_toml(rippled[1].document(drive()))))
    own = written_effects(fitted)
    from lostmotion.effects.formula import write_c

    make_controller(fitted, profile="full", own=own)
    with pytest.raises(InputError, match="a period of one turn"):
        write_c(own["formula_1"])
    assert "lm_cosine" in write_c(written_formula("a_rad * cos(2*pi*3*input_turns)", "formula_1"))


def test_a_step_in_one_run_is_fitted_as_printed() -> None:
    data = campaign(slip=(8, 20.0, 30.0))
    formulas = printed_formulas(data)
    assert len(formulas) == 1
    model = fit_model(drive(), data, add=formulas)
    assert model.base.terms[0].values[0] == pytest.approx(30 * ARCSEC, rel=0.05)
    assert model.ladder[-1]["rms_arcsec"] < 0.4 * model.ladder[0]["rms_arcsec"]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("3 * cos(2*pi*input_turns)", "the name of a value"),
        ("a_rad * a_rad * torque_Nm", "not proportional"),
        ("a_rad * cos(b * input_turns)", "not proportional"),
        ("a_rad * run_count(3)", "run_count"),
    ],
)
def test_what_is_no_sum_of_values_is_refused(text: str, found: str) -> None:
    with pytest.raises(InputError, match=found):
        written_formula(text, "formula_1")
