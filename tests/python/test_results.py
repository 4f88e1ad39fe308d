"""Results in Python: parameters, residuals, predictions, tables, figures, copies."""

from __future__ import annotations

import copy
import pickle
import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import public_script
import pytest
from scipy.signal import lombscargle

import lostmotion as lm
from lostmotion.fit.model_result import amplitudes
from lostmotion.results import Parameter, ParameterTable
from lostmotion.units import ARCMIN, ARCSEC

ROOT = Path(__file__).parents[2]
JOINT = ROOT / "tests" / "data" / "joint"
RATIO = lm.read_drive(JOINT / "joint.toml").ratio

RUNS = (1, 2, 3, 11, 12, 13, 21, 22, 23)
"""Runs of the joint, cold and warm."""


@pytest.fixture(scope="module")
def campaign() -> lm.Campaign:
    whole = lm.read_campaign(JOINT / "joint.csv.gz", ratio=RATIO)
    return lm.Campaign([run for run in whole.runs if run.label in RUNS])


@pytest.fixture(scope="module")
def fitted(campaign: lm.Campaign) -> lm.FittedModel:
    return lm.fit(lm.read_drive(JOINT / "joint.toml"), campaign, add="thermal_gap")


def test_parameters_are_those_of_the_fitted_drive_file(fitted: lm.FittedModel) -> None:
    table = fitted.params
    values = fitted.answer()["values"]
    assert {name: table[name].value for name in values} == pytest.approx(values, rel=1e-12)
    errors = fitted.answer()["standard_errors"]
    estimated = [one for one in table.values() if one.estimated]
    assert all(one.error == errors[one.name] for one in estimated)
    assert {one.name for one in table.values() if one.error} == {n for n, e in errors.items() if e}
    gap = table["thermal_gap.gap_rad_per_K"]
    assert (gap.unit, gap.low, gap.high) == ("rad_per_K", -1e-3, 1e-3)
    assert not table["thermal_gap.gap_rad"].estimated
    assert "thermal_gap.gap_rad_per_K" in fitted.fit_report()
    frame = table.to_dataframe()
    assert list(frame["parameter"]) == list(table)


def test_a_table_prints_what_a_fit_report_prints() -> None:
    table = ParameterTable(
        [
            Parameter("gap_rad", 2e-3, 1e-5, 0.0, 0.1, True),
            Parameter("share", 0.0, 0.1, 0.0, 1.0, True),
            Parameter("knee_Nm", 3.0),
        ]
    )
    assert str(table).splitlines() == [
        "gap_rad  0.002  +/- 1e-05 (0.50 %)",
        "share    0      +/- 0.1             at its bound",
        "knee_Nm  3                          (fixed)",
    ]
    assert str(table["gap_rad"]) == "gap_rad = 0.002 +/- 1e-05 (0.50 %)"
    assert repr(table) == "<ParameterTable: 2 estimated, 1 fixed>"
    assert "<td>share</td>" in table._repr_html_()


def test_model_and_residual_add_up_to_what_was_measured(
    campaign: lm.Campaign, fitted: lm.FittedModel
) -> None:
    frame = fitted.to_dataframe()
    assert len(frame) == campaign.rows
    lost = campaign.column("lost_motion_rad")
    for label, rows in frame.groupby("run").groups.items():
        own = lost[rows] - lost[rows].mean()
        np.testing.assert_allclose(frame["measured_arcmin"][rows], own / ARCMIN, atol=1e-9)
        assert label in RUNS
    rms = np.sqrt(np.mean(fitted.residuals**2))
    assert rms == pytest.approx(fitted.ladder[-1]["rms_arcsec"], rel=1e-12)


def test_recordings_that_a_fit_has_not_seen_are_predicted(fitted: lm.FittedModel) -> None:
    whole = lm.read_campaign(JOINT / "joint.csv.gz", ratio=RATIO)
    others = lm.Campaign([run for run in whole.runs if run.label not in RUNS])
    lost = np.concatenate([run.lost_motion_rad - run.lost_motion_rad.mean() for run in others.runs])
    error = np.sqrt(np.mean((lost - fitted.predict(others)) ** 2)) / ARCSEC
    assert error < 1.5 * fitted.ladder[-1]["rms_heldout_arcsec"]


def test_what_a_prediction_needs_and_has_not_is_named(fitted: lm.FittedModel) -> None:
    table = lm.read_campaign(JOINT / "joint.csv.gz", ratio=RATIO).table()
    del table["temperature_C"]
    with pytest.raises(lm.InputError, match="temperature_C"):
        fitted.predict(lm.read_campaign(table, ratio=RATIO))


def test_a_copy_by_pickle_states_the_same(fitted: lm.FittedModel) -> None:
    for other in (pickle.loads(pickle.dumps(fitted)), copy.deepcopy(fitted)):
        np.testing.assert_array_equal(other.predict(), fitted.predict())
        assert other.answer() == fitted.answer()
    own = lm.formula(
        "own", "a_rad * sin(input_turns)", values=[lm.Value("a_rad", "linear", 1, 0, 2)]
    )
    assert pickle.loads(pickle.dumps(own)).formula == own.formula


def test_figures_hold_every_run(campaign: lm.Campaign, fitted: lm.FittedModel) -> None:
    assert len(fitted.plot().data) == 3 * len(campaign.runs)
    figure = fitted.plot_residuals("temperature_C")
    assert len(figure.data) == len(campaign.runs)
    assert sum(len(trace.y) for trace in figure.data) <= campaign.rows
    by_lag = fitted.plot_autocorrelation(5).data[0].y
    assert len(by_lag) == 6
    assert by_lag[0] == pytest.approx(1.0)
    # The residual of a fit with the right effect is noise: whitened, its rms is 1.
    assert np.concatenate(fitted.whitened()).std() == pytest.approx(1.0, abs=0.05)
    predicted = fitted.plot_predicted()
    assert [trace.name for trace in predicted.data[:-1]] == [f"run {run}" for run in RUNS]
    assert len(fitted.plot_residuals("model_arcmin").data) == len(RUNS)
    normal = fitted.plot_normal().data[0]
    assert list(normal.y) == sorted(normal.y)
    correlated = np.asarray(fitted.plot_correlations().data[0].z)
    np.testing.assert_allclose(np.diag(correlated), 1.0)
    assert np.all(np.abs(correlated) <= 1 + 1e-9)
    bars = fitted.plot_ladder().data[0]
    assert list(bars.customdata) == ["baseline model", "+ thermal_gap"]
    assert list(bars.x) == [rung["rms_arcsec"] for rung in fitted.ladder]
    with pytest.raises(lm.InputError, match="plot_residuals: against: found nothing_like_it"):
        fitted.plot_residuals("nothing_like_it")


def test_a_campaign_without_runs_is_refused() -> None:
    drive = lm.read_drive(JOINT / "joint.toml")
    with pytest.raises(lm.InputError, match="campaign: found no runs, expected one or more"):
        lm.compare(drive, lm.Campaign([]))


def test_a_script_over_the_whole_of_it_runs(
    campaign: lm.Campaign, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(JOINT / "joint.toml", tmp_path)
    pd.DataFrame(campaign.table()).to_csv(tmp_path / "joint.csv.gz", index=False)
    public_script.main(tmp_path)
    assert "thermal_gap.gap_rad_per_K" in capsys.readouterr().out
    assert (tmp_path / "copy.toml").is_file()


def test_a_characterization_is_a_table_and_a_figure(campaign: lm.Campaign) -> None:
    found = lm.characterize(campaign, rated_torque_Nm=40.0)
    frame = found.to_dataframe().set_index("figure")
    first = found.answer()["torsion_curve"]["K1_Nm_per_rad"]
    assert frame["value"]["K1_Nm_per_rad"] == first["value"]
    assert found._repr_html_().count("<tr>") == 1 + len(frame)
    names = [trace.name for trace in found.plot().data]
    assert set(names) == {"measured", "mean curve"}
    assert repr(copy.deepcopy(found)) == repr(pickle.loads(pickle.dumps(found))) == repr(found)


def test_clearances_are_a_table() -> None:
    drive = lm.read_drive(JOINT.parent / "drives" / "reference_a.toml")
    found = lm.clearances(drive, angles_rad=[0.0, 0.5])
    assert list(found.to_dataframe()["angle_deg"]) == found["angle_deg"]
    assert found._repr_html_().count("<tr>") == 1 + len(found["angle_deg"])


def test_a_prediction_is_a_table_and_a_figure() -> None:
    prediction = lm.predict(lm.read_drive(JOINT / "joint.toml"), [0.0, 10.0, 20.0])
    frame = prediction.to_dataframe()
    assert prediction._repr_html_().count("<tr>") == 1 + len(frame)
    assert list(frame["torque_Nm"]) == [0.0, 10.0, 20.0]
    assert list(frame["total_arcmin"]) == prediction["total_arcmin"]
    names = [trace.name for trace in prediction.plot().data]
    assert names == ["total", *prediction["parts_arcmin"]]


def test_the_readme_runs(
    campaign: lm.Campaign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    shutil.copy(JOINT / "joint.toml", tmp_path)
    pd.DataFrame(campaign.table()).to_csv(tmp_path / "joint.csv.gz", index=False)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(compile(code, "README.md", "exec"), names)
    fitted = names["fitted"]
    assert isinstance(fitted, lm.FittedModel)
    assert [term.effect.name for term in fitted.base.terms] == ["thermal_gap"]


def test_a_spectrum_shows_the_order_and_the_amplitude_that_were_put_in() -> None:
    angle = np.sort(np.random.default_rng(1).uniform(0, 300, 4000))
    order = np.linspace(0.05, 4, 80)
    found = amplitudes(angle, 3.0 * np.sin(2.0 * angle + 1.0), order)
    assert order[np.argmax(found)] == pytest.approx(2.0)
    assert found.max() == pytest.approx(3.0, rel=0.02)


@pytest.mark.parametrize("count", [1, 2, 80, 801])
def test_a_spectrum_equals_that_of_scipy(count: int) -> None:
    rng = np.random.default_rng(count)
    angle, residual = rng.uniform(-300, 300, (2, 9000))
    residual -= residual.mean()
    order = 0.01 * np.arange(1, count + 1)
    expected = np.sqrt(4.0 * lombscargle(angle, residual, order) / angle.size)
    assert amplitudes(angle, residual, order) == pytest.approx(expected, rel=1e-9)
