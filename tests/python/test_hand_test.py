"""A manual test: torque wrench and dial gauge, 5 to 30 readings."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from loops_of_known_drives import ARCMIN, ARCSEC, Loop

from lostmotion.characterize import characterize, standard_figures
from lostmotion.characterize.characterization import fit_torsion_curve
from lostmotion.characterize.figures import hysteresis_loss
from lostmotion.characterize.stretches import collect
from lostmotion.cli import main
from lostmotion.drives import read_drive
from lostmotion.recordings import Campaign, Run
from lostmotion.threads import one_thread

SHEET = Path(__file__).parents[1] / "data" / "drives" / "size_25.toml"

UP = [0, 5, 10, 15, 20, 30, 40, 50, 60]
PATH = [*UP, *UP[-2::-1], *[-t for t in UP[1:]], *[-t for t in UP[-2::-1]]]
"""Torques of a complete manual test: up, back, in the other direction, and back."""

HALF = 0.1 * ARCMIN


def readings(path: list[float], noise: float, seed: int, step: float = 0.0) -> np.ndarray:
    """Torques and angles: the curve of a size 25 drive, Coulomb friction, rounded as read."""
    generator = np.random.default_rng(seed)
    torque = np.array(path, dtype=float)
    state, angle = 0.0, []
    for before, now in zip([torque[0], *torque[:-1]], torque, strict=True):
        state = float(np.clip(state - (now - before) / 2.0, -1, 1))
        angle.append(float(Loop().curve(np.array([now]))[0]) + HALF * state)
    measured = np.array(angle) + noise * generator.normal(size=torque.size)
    if step:
        measured = np.round(measured / step) * step
    return np.column_stack((torque, measured))


def write(folder: Path, table: np.ndarray, clock: str = "time_s") -> str:
    file = folder / "wrench.csv"
    rows = [f"{clock},torque_Nm,output_angle_rad"]
    rows += [f"{30 * i},{t:g},{a:.9f}" for i, (t, a) in enumerate(table)]
    file.write_text("\n".join(rows) + "\n")
    return str(file)


def campaign_of(table: np.ndarray) -> Campaign:
    columns = {
        "time": 30.0 * np.arange(len(table)),
        "torque": table[:, 0],
        "lost_motion": table[:, 1],
    }
    return Campaign([Run(1, "wrench.csv", columns)])


def test_intervals_of_few_readings_cover_the_truth() -> None:
    """Of 200 manual tests 95 % and not much less: 4 binomial standard errors are 6 %.

    The interval of a knee between readings is by its profile likelihood on a grid, and wider.
    """
    truth = {"T1": 14.0, "K1": 31e3, "K2": 50e3, "hysteresis": 2 * HALF}
    hits, seen = dict.fromkeys(truth, 0), dict.fromkeys(truth, 0)
    path = [t for t in PATH if abs(t) <= 45]
    with one_thread():
        for seed in range(200):
            samples = collect(campaign_of(readings(path, 1.0 * ARCSEC, seed)))
            fit, curve = fit_torsion_curve(samples)
            found = {**curve, "hysteresis": hysteresis_loss(samples, fit)}
            for name, value in truth.items():
                if found[name].interval is None:
                    continue
                low, high = found[name].interval
                seen[name] += 1
                hits[name] += low <= value <= high
    print(hits, seen)
    for name, count in seen.items():
        assert count >= 190, name
        assert hits[name] / count - 0.95 >= -0.065, name


def test_more_readings_carry_more_slopes_and_few_carry_one() -> None:
    shown = []
    for path in ([0, 20, 40, 20, 0], [0, 10, 20, 40, 20, 10, 0, -10, -20, -40], PATH):
        fit = standard_figures(campaign_of(readings(path, 0.3 * ARCSEC, 1)), 67.0).fit
        assert fit is not None
        values = fit.slopes_rad_per_Nm.size + fit.kinks_Nm.size + fit.half_width_rad.size + 1
        assert values <= 0.5 * len(path) + 1
        shown.append(fit.slopes_rad_per_Nm.size)
    assert shown[0] == 1
    assert shown == sorted(shown)
    assert shown[-1] == 3


def test_readings_that_agree_by_rounding_are_no_better_than_their_step() -> None:
    """A dial gauge of 2 arcsec steps: no interval is narrower than the step allows."""
    step = 2.0 * ARCSEC
    table = readings([0, 20, 40, 20, 0, -20, -40, -20, 0], 0.0, 1, step)
    found = standard_figures(campaign_of(table), 67.0)
    assert found.fit is not None
    assert found.curve["K1"].standard_error is not None
    least = step / np.sqrt(12.0) / (40.0 * np.sqrt(len(table)))
    slope_error = found.curve["K1"].standard_error / found.curve["K1"].value ** 2
    assert slope_error > 0.5 * least


@pytest.mark.parametrize("clock", ["time_s", "order"])
def test_the_commands_take_a_hand_test(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], clock: str
) -> None:
    file = write(tmp_path, readings(PATH, 0.5 * ARCSEC, 3), clock)
    locked = ["--locked", "input"]

    def said(*words: str) -> str:
        assert main([*words, *locked]) == 0, capsys.readouterr().err
        return capsys.readouterr().out

    printed = said("compare", str(SHEET), file)
    assert "values from 33 readings" in printed
    assert "explains" not in printed
    assert "100" not in printed.split("figure")[0]
    answer = json.loads(said("compare", str(SHEET), file, "--json", "-"))
    assert answer["heldout_by"] == "reading"
    assert 0.3 < answer["noise_floor_arcsec"] < 0.9
    assert answer["heldout_rms_arcsec"] > answer["rms_arcsec"]
    assert answer["explained_share"] < 1.0
    assert answer["where_it_fails"] == []

    fitted = tmp_path / "fitted.toml"
    said("fit", str(SHEET), file, "-o", str(fitted))
    drive = read_drive(fitted)
    assert drive.fit is not None
    assert drive.fit["standard_errors"]["slope_1_rad_per_Nm"] > 0
    again = json.loads(said("compare", str(fitted), file, "--json", "-"))
    assert again["unfitted_rms_arcsec"] == pytest.approx(again["rms_arcsec"], rel=0.02)
    assert (
        main(
            [
                "export",
                str(fitted),
                "-o",
                str(tmp_path / "a.h"),
                "--set",
                "period_us=500",
            ]
        )
        == 0
    )
    capsys.readouterr()

    answer = json.loads(said("diagnose", str(SHEET), file, "--json", "-"))
    assert answer["verdict"] == "inconclusive"
    assert answer["effects"] == []
    assert "33 readings" in answer["next_experiment"]
    if clock == "order":
        assert any("no time stamps" in finding for finding in answer["findings"])
    said("diagnose", str(SHEET), file, "--report", str(tmp_path / "report.html"))

    answer = json.loads(
        said("characterize", file, "-o", str(tmp_path / "drive.toml"), "--json", "-")
    )
    assert answer["standard_errors_from"] == "readings"
    assert answer["torsion_curve"]["K1_Nm_per_rad"]["value"] == pytest.approx(31e3, rel=0.03)
    said("compare", str(tmp_path / "drive.toml"), file)


def test_few_readings_carry_no_effect(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = write(tmp_path, readings(PATH, 0.5 * ARCSEC, 3))
    words = ["fit", str(SHEET), file, "--locked", "input", "--add", "creep"]
    assert main([*words, "-o", str(tmp_path / "fitted.toml")]) == 2
    assert "33 samples" in capsys.readouterr().err
    words = ["diagnose", str(SHEET), file, "--locked", "input"]
    report = tmp_path / "report.html"
    saved = ["--save-evidence", str(tmp_path / "evidence.npz"), "--report", str(report)]
    assert main([*words, *saved]) == 2
    assert "--save-evidence: found 33 readings" in capsys.readouterr().err
    assert not report.exists()
    assert main(["next", *words[1:], "--plan", file]) == 2
    assert "found 33 readings, too few to test an effect" in capsys.readouterr().err


def test_a_turn_reads_on_the_branch_that_led_to_it() -> None:
    """Without noise the values are exact: no reading at a tip counts on the other branch."""
    found = characterize(campaign_of(readings(PATH, 0.0, 1)), rated_torque_Nm=67.0).figures
    for name, truth in Loop().truth.items():
        assert found.curve[name].value == pytest.approx(truth, rel=1e-3), name
    assert found.hysteresis_loss.value == pytest.approx(2 * HALF, rel=1e-3)
