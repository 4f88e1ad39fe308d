"""Comparison: only the deviations of a synthetic campaign are found."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from conftest import DATA
from lostmotion.catalogue import Catalogue
from lostmotion.commands.compare import show_comparison
from lostmotion.commands.discover import show_diagnosis
from lostmotion.compare import Comparison, compare
from lostmotion.compare.chance import variance_explained
from lostmotion.compare.loops import directions, zero_widths
from lostmotion.compare.repeatability import repeatability_of
from lostmotion.discover import Value, diagnose, effect
from lostmotion.discover.fitted_model import fit_model
from lostmotion.drives import format_toml, read_drive
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.library import library
from lostmotion.errors import InputError
from lostmotion.fit.drive_file import make_base
from lostmotion.fit.hysteresis import PLAY_RANGE, PLAYS
from lostmotion.model import make_torsion_curve
from lostmotion.recordings import Campaign, Run, read_campaign
from lostmotion.torsion_curve import TorsionCurve
from lostmotion.units import ARCSEC

FloatArray = npt.NDArray[np.float64]

# Size 20, ratio above 50, from the catalogue.
SHEET = Catalogue(7.0, 25.0, 16e3, 25e3, 29e3)
NOISE = 1.5 * ARCSEC
HALF_WIDTH_NM = 40.0 * float(np.geomspace(*PLAY_RANGE, PLAYS)[5])
"""Half width of the simulated play: one of the bank of the baseline model, 6.1 N m."""


def torsion_curve() -> TorsionCurve:
    return TorsionCurve(*SHEET.knots(40.0))


def play(radius: float, torque: FloatArray, z: float) -> tuple[FloatArray, float]:
    out = np.empty(torque.size)
    for i, t in enumerate(torque):
        z = max(t - radius, min(t + radius, z))
        out[i] = z - t
    return out, z


def campaign(
    runs: int = 8,
    *,
    seed: int = 1,
    noise: float = NOISE,
    inside: float = 0.0,
    outside: float = 3e-6,
    amplitudes: tuple[float, ...] = (40.0, 30.0, 40.0, 30.0),
    gap_per_kelvin: float = 0.0,
    scale: float = 1.0,
) -> Campaign:
    """Synthesise recordings: slow torque cycles, one play, white noise.

    The play's state continues from run to run; each run has its own encoder zero.
    """
    random = np.random.default_rng(seed)
    curve = torsion_curve()
    z = 0.0
    made = []
    for i in range(runs):
        peak = amplitudes[i % len(amplitudes)]
        legs = [(0, peak), (peak, -peak), (-peak, 0.3 * peak)]
        torque = np.concatenate([np.linspace(a, b, 150, endpoint=False) for a, b in legs])
        difference, z = play(HALF_WIDTH_NM, torque, z)
        wound = torque + inside * difference
        temperature = 20.0 + 4.0 * ((3 * i) % 5)
        angle = scale * curve(wound) + outside * difference
        angle += gap_per_kelvin * (temperature - 20.0) * np.tanh(torque / 0.5)
        angle += random.normal(0, noise, torque.size) + random.normal(0, 1e-3)
        columns = {
            "time": np.arange(torque.size) * 0.01,
            "torque": torque,
            "lost_motion": angle,
            "temperature": np.full(torque.size, temperature),
            "output_angle": 0.3 * np.arange(torque.size) % 6.28,
        }
        made.append(Run(i + 1, "synthetic", columns))
    return Campaign(made)


def test_the_friction_that_was_put_in_is_found_and_the_rest_is_noise() -> None:
    result = compare(torsion_curve(), campaign(outside=0.0, inside=0.4, scale=1.1))
    assert result.friction == "inside"
    # The narrowest play is narrower than a step of the torque, which therefore hardly determines
    # it.
    assert result.base.hysteresis.shares[1:].sum() == pytest.approx(0.4, abs=0.04)
    assert result.base.hysteresis.rise == pytest.approx(1.0, abs=0.05)
    assert result.base.hysteresis.shares[5] == pytest.approx(0.4, abs=0.06)
    assert result.rms_rad == pytest.approx(NOISE, rel=0.05)
    assert result.heldout_rms_rad == pytest.approx(NOISE, rel=0.07)
    assert result.noise.floor_rad == pytest.approx(NOISE, rel=0.15)
    assert result.explained_share > 0.999
    assert result.as_it_stands_rms_rad > 10 * NOISE
    assert all(failure.p > 0.01 for failure in result.failures)
    assert result.invertible


def test_friction_outside_the_elasticity_is_distinguished_from_friction_inside() -> None:
    result = compare(torsion_curve(), campaign(outside=2e-5))
    assert result.friction == "outside"
    inside, outside = result.frictions["inside"], result.frictions["outside"]
    assert outside[1] < 0.7 * inside[1]
    assert result.rms_rad == pytest.approx(NOISE, rel=0.05)
    assert result.base.hysteresis.outside is not None
    assert result.base.hysteresis.outside.sum() * ARCSEC == pytest.approx(2e-5, rel=0.25)


def test_the_base_is_that_of_the_diagnosis() -> None:
    data = campaign(8, inside=0.4, outside=0.0)
    rung = diagnose(
        None, data, ratio=100, rated_torque_Nm=40, torsion_curve=torsion_curve()
    ).ladder[0]
    assert compare(torsion_curve(), data).rms_rad / ARCSEC == pytest.approx(
        rung["rms_arcsec"], rel=0.02
    )


def test_memory_continues_between_runs() -> None:
    data = campaign(noise=1e-9, inside=0.4, outside=0.0)
    carried = compare(torsion_curve(), data).rms_rad
    # In another order of the runs their memory is not continuous.
    mixed = Campaign([data.runs[i] for i in (0, 4, 1, 6, 3, 2, 7, 5)])
    assert compare(torsion_curve(), mixed).rms_rad > 5 * carried


def test_the_state_before_the_first_sample_is_estimated() -> None:
    data = campaign(noise=1e-9, inside=0.4, outside=0.0)
    later = Campaign(data.runs[1:])  # starts where the first run left the play
    result = compare(torsion_curve(), later)
    # It stood at 12 - 6 N m; the fall to 0 N m pulls it to the upper edge of its band.
    weights = result.base.hysteresis.shares / result.base.hysteresis.shares.sum()
    assert float(weights @ result.base.hysteresis.start[0]) > 0.8


def test_some_runs_are_fitted_and_the_others_predicted() -> None:
    data = campaign(6, amplitudes=(40.0, 20.0), inside=0.4, outside=0.0)
    result = compare(torsion_curve(), data, fit_on=[1, "3", 5])
    assert result.seen.tolist() == [True, False] * 3
    assert result.answer()["heldout_by"] == "runs not fitted"
    assert result.heldout_rms_rad == pytest.approx(NOISE, rel=0.25)
    # A run that is only predicted does not influence the fit.
    other = campaign(6, amplitudes=(40.0, 20.0), inside=0.4, outside=0.0)
    other.runs[1].columns["lost_motion"] = 1.2 * other.runs[1].lost_motion_rad
    again = compare(torsion_curve(), other, fit_on=[1, 3, 5])
    assert again.rms_rad == pytest.approx(result.rms_rad, rel=0.02)
    assert again.heldout_rms_rad > 5 * result.heldout_rms_rad
    with pytest.raises(InputError, match="--fit-on: 7: found no such run, expected one of 1, 2"):
        compare(torsion_curve(), data, fit_on=[7])
    with pytest.raises(InputError, match="--fit-on: found no run, expected one or more of 1, 2"):
        compare(torsion_curve(), data, fit_on=[])


def test_the_width_at_zero_is_that_of_the_loop() -> None:
    torque = -10 * np.cos(np.linspace(0, 4 * np.pi, 4000))
    half, _ = play(2.0, torque, -8.0)
    widths = zero_widths(torque, np.column_stack((1e-5 * half, 3e-5 * half)))
    assert widths is not None
    np.testing.assert_allclose(widths, [2 * 2.0e-5, 6 * 2.0e-5], rtol=0.01)
    assert zero_widths(np.linspace(1, 2, 100), np.zeros((100, 1))) is None


def test_a_fitted_drive_is_compared_with_its_effects(tmp_path: Path) -> None:
    sheet = tmp_path / "drive.toml"
    sheet.write_text(
        "[drive]\nratio = 100\nrated_torque_Nm = 40\n[catalogue]\nT1_Nm = 7\nT2_Nm = 25\n"
        "K1_Nm_per_rad = 16e3\nK2_Nm_per_rad = 25e3\nK3_Nm_per_rad = 29e3\n"
    )
    drive = read_drive(sheet)
    data = campaign(8, inside=0.4, outside=0.0, gap_per_kelvin=2e-6)
    fitted = fit_model(drive, data, ["thermal_gap"], torsion_curve=torsion_curve())
    (tmp_path / "fitted.toml").write_text(format_toml(fitted.document(drive)))
    again = read_drive(tmp_path / "fitted.toml")
    base = make_base(again, data, torsion_curve(), library())
    result = compare(torsion_curve(), data, base=base)
    assert result.answer()["effects"] == ["thermal_gap"]
    assert result.as_it_stands_rms_rad == pytest.approx(result.rms_rad, rel=0.05)
    assert result.rms_rad < 0.7 * compare(torsion_curve(), data).rms_rad


def test_a_missing_effect_shows_in_its_covariate() -> None:
    result = compare(torsion_curve(), campaign(inside=0.4, outside=0.0, gap_per_kelvin=2e-6))
    by_name = {failure.covariate: failure for failure in result.failures}
    assert {failure.covariate for failure in result.failures[:2]} == {"temperature", "run"}
    assert by_name["temperature"].share > 0.25
    assert by_name["temperature"].p <= 0.05
    assert by_name["output_angle"].p > 0.05
    assert result.heldout_rms_rad > 1.9 * result.noise.within_rad
    shares = [failure.share for failure in result.failures]
    assert shares == sorted(shares, reverse=True)


def test_scatter_between_repeats_belongs_to_the_noise_floor() -> None:
    data = campaign()
    random = np.random.default_rng(5)
    for run in data.runs:
        # Stiffness scatters by 3 % from run to run, which no model of shared columns can describe.
        run.columns["lost_motion"] = run.lost_motion_rad + random.normal(0, 0.03) * torsion_curve()(
            run.torque_Nm
        )
        run.columns["temperature"][:] = 22.0
    noise = compare(torsion_curve(), data).noise
    assert noise.between_rad is not None
    assert noise.between_rad > 3 * noise.within_rad
    assert noise.repeats == [[1, 3, 5, 7], [2, 4, 6, 8]]


def test_a_run_at_another_temperature_is_no_repeat() -> None:
    result = compare(torsion_curve(), campaign(gap_per_kelvin=4 * ARCSEC))
    assert result.rms_rad > 5 * NOISE
    assert result.noise.floor_rad < 1.2 * NOISE


def test_runs_that_do_not_repeat_leave_the_noise_within_runs() -> None:
    noise = compare(torsion_curve(), campaign(4, amplitudes=(40.0, 32.0, 24.0, 16.0))).noise
    assert noise.between_rad is None
    assert noise.floor_rad == noise.within_rad
    assert noise.floor_rad == pytest.approx(NOISE, rel=0.15)


def test_white_noise_is_measured_as_it_is() -> None:
    c = Conditions(campaign(8))
    noise = np.random.default_rng(11).normal(0.0, NOISE, c.rows)
    assert repeatability_of(c, noise).within_rad == pytest.approx(NOISE, rel=0.02)
    noise[::500] += 50.0 * NOISE  # slips are not noise
    assert repeatability_of(c, noise).within_rad == pytest.approx(NOISE, rel=0.1)


def test_a_single_run_is_held_out_by_halves(capsys: pytest.CaptureFixture[str]) -> None:
    result = compare(torsion_curve(), campaign(1))
    assert result.heldout_by == "half of the run"
    assert result.heldout_rms_rad >= result.rms_rad
    assert "run" not in {failure.covariate for failure in result.failures}
    show_comparison(result)
    assert re.search(r"^leave-half-out +[0-9.]+ arcsec$", capsys.readouterr().out, re.M)


def test_what_came_out_prints_on_one_line() -> None:
    data = campaign(2)
    result = compare(torsion_curve(), data)
    assert repr(data) == "<Campaign: 900 samples in 2 runs, 0 findings>"
    assert repr(data.runs[0]).startswith("<Run 1 of synthetic: 450 samples of time, torque, ")
    assert re.fullmatch(
        r"<Comparison of <Campaign: .*>: rms [0-9.]+ arcsec, cross-validated [0-9.]+>", repr(result)
    )


def test_recordings_without_torque_are_refused() -> None:
    data = campaign(2)
    for run in data.runs:
        run.columns["torque"] = np.zeros(len(run))
    with pytest.raises(InputError, match="torque_Nm: found a constant 0 Nm"):
        compare(torsion_curve(), data)


def test_recordings_with_constant_lost_motion_are_refused() -> None:
    data = campaign(3)
    for i, run in enumerate(data.runs):
        run.columns["lost_motion"] = np.round(run.lost_motion_rad, 1) + i
    with pytest.raises(
        InputError, match="lost_motion_rad: found a constant 0 rad, expected a varying los"
    ):
        compare(torsion_curve(), data)


def test_what_compare_and_diagnose_set_an_error_against_have_names_of_their_own(
    capsys: pytest.CaptureFixture[str],
) -> None:
    data = campaign(6, gap_per_kelvin=2e-6)
    show_comparison(compare(torsion_curve(), data))
    out = capsys.readouterr().out
    alone = "repeatability  .* arcsec  \\(white noise within runs only: no run repeats another\\)"
    assert re.search(alone, out)
    for run in data.runs:
        run.columns["temperature"][:] = 22.0
    show_comparison(compare(torsion_curve(), data))
    out += capsys.readouterr().out
    assert "(white noise within runs and differences between runs that repeat each other)" in out
    assert "noise floor" not in out
    show_diagnosis(diagnose(None, data, ratio=100, rated_torque_Nm=40).answer())
    found = capsys.readouterr().out
    said = r"noise floor [0-9.]+ arcsec, .*\n\(noise within runs, and run-to-run scatter of "
    assert re.search(said, found)
    assert "repeatability" not in found


def test_the_answer_has_every_promised_key_and_is_json() -> None:
    steps: list[tuple[int, int]] = []
    result = compare(
        torsion_curve(), campaign(3), progress=lambda done, of, _: steps.append((done, of))
    )
    answer = json.loads(json.dumps(result.answer(), allow_nan=False))
    assert answer["schema"] == "lostmotion.comparison/1"
    for key in ("rms_arcsec", "heldout_rms_arcsec", "noise_floor_arcsec", "explained_share"):
        assert isinstance(answer[key], float)
    assert [entry["run"] for entry in answer["by_run"]] == [1, 2, 3]
    assert set(answer["where_it_fails"][0]) == {"covariate", "share", "p"}
    assert answer["data_fingerprint"].startswith("sha256:")
    assert steps[-1] == (steps[-1][1], steps[-1][1])
    assert "wear" in answer["not_testable"]["cycles"]
    assert "temperature" not in answer["not_testable"]


def test_every_effect_without_its_column_is_reported_own_ones_too() -> None:
    @effect(values=[Value("pull_rad_per_N", "linear", 1e-6, -1.0, 1.0)], needs=["axial_force_N"])
    def pull(p: Any, at: Any) -> Any:
        return p.pull_rad_per_N * at.axial_force_N

    found = compare(torsion_curve(), campaign(3), effects={**library(), "pull": pull}).not_testable
    assert found["axial_force"] == ["axial_shift", "pull"]
    assert found["tilt_moment"] == ["output_tilt"]
    assert found["cycles"] == ["wear"]
    assert {"viscous_friction", "lobe_eccentricity"} <= set(found["input_angle"])
    assert set(found) == {"axial_force", "cycles", "input_angle", "tilt_moment"}


def test_the_same_data_give_the_same_answer() -> None:
    one, two = (compare(torsion_curve(), campaign(3)).answer() for _ in range(2))
    assert one == two


@pytest.fixture(scope="module")
def real() -> Comparison:
    folder = DATA / "cycloidal_locked_output"
    drive = read_drive(folder / "drive.toml")
    data = read_campaign(folder, ratio=drive.ratio, mapping=drive.columns)
    return compare(make_torsion_curve(drive, data.largest_torque_Nm), data)


def test_real_loops_of_a_reducer_with_backlash_are_explained(real: Comparison) -> None:
    # 575 arcmin of lost motion over the 40 N m cycles; the residual is a fortieth of it.
    assert real.explained_share > 0.99
    assert real.rms_rad / ARCSEC < 850
    assert real.heldout_rms_rad < 1.1 * real.rms_rad
    assert real.as_it_stands_rms_rad > 3 * real.rms_rad


def test_friction_in_series_helps_on_the_real_loops(real: Comparison) -> None:
    assert real.friction == "both+load"
    heldout = {name: error for name, (_, error) in real.frictions.items()}
    assert heldout["both"] < 0.7 * heldout["inside"]
    # Half widths that also grow with the load improve it by less than a twentieth.
    assert heldout["both+load"] == pytest.approx(heldout["both"], rel=0.05)


def test_the_covariance_of_signs_is_exact_for_few_blocks() -> None:
    # Four blocks with the same residual: of 8 sign patterns (up to the common sign) only the one
    # as measured explains all.
    residual = np.tile([1.0, -1.0], 8)
    cells = np.tile([0, 1], 8).astype(np.intp)
    blocks = np.repeat(np.arange(4), 4).astype(np.intp)
    share, p = variance_explained(residual, cells, blocks, np.random.default_rng(0))
    assert p == 1 / 8
    assert share == pytest.approx(1.0)


def test_chance_is_not_called_a_share() -> None:
    random = np.random.default_rng(3)
    small = 0
    for _ in range(200):
        residual = random.normal(size=1200)
        cells = random.integers(0, 10, 1200).astype(np.intp)
        blocks = np.repeat(np.arange(24), 50).astype(np.intp)
        share, p = variance_explained(residual, cells, blocks, random)
        assert share < 0.03
        small += p <= 0.05
    assert small <= 20  # 5 % of 200, and three standard deviations


def test_directions_do_not_turn_with_noise() -> None:
    torque = np.concatenate((np.linspace(0, 10, 200), np.linspace(10, -10, 400)))
    noisy = torque + np.random.default_rng(1).normal(0, 0.03, torque.size)
    direction, travel = directions(noisy, 10.0)
    assert np.count_nonzero(np.diff(direction)) == 1
    turn = int(np.flatnonzero(np.diff(direction))[0])
    assert 195 < turn < 215
    assert travel[-1] == pytest.approx(-20, abs=0.6)


def test_a_torsion_curve_continues_beyond_its_knots() -> None:
    curve = torsion_curve()
    far: Any = np.array([-100.0, 100.0])
    np.testing.assert_allclose(curve(far), SHEET.angle(far), rtol=1e-12)


def test_a_zero_that_moved_inside_a_run_is_found_where_and_when_it_did() -> None:
    campaign = read_campaign(DATA / "joint" / "joint.csv.gz", ratio=100)
    drive = read_drive(DATA / "joint" / "joint.toml")
    kept = Campaign(campaign.runs[:8])
    for run in kept.runs:
        run.columns = {name: values[::4] for name, values in run.columns.items()}
    assert compare(drive, kept).events == []
    moved = kept.runs[3]
    moved.columns["lost_motion"] = moved.lost_motion_rad.copy()
    moved.columns["lost_motion"][140:] += 40 * ARCSEC
    (event,) = compare(drive, kept).answer()["events"]
    assert event["run"] == moved.label
    assert event["time_s"] == pytest.approx(moved.time_s[140], abs=3 * moved.time_s[1])
    assert event["size_arcsec"] == pytest.approx(40, rel=0.15)
