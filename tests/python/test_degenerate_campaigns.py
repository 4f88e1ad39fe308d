"""Campaigns with hardly any data: every command gives a result or refuses in one line.

A secondary calculation (a root, an inverse, the logarithm of an estimate, a picture) that has no
result must never prevent the answer of its command.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from conftest import DATA
from lostmotion.cli import main
from lostmotion.discover.detectable import noncentrality

Columns = dict[str, npt.NDArray[np.float64]]

DRIVE = DATA / "drives" / "size_25.toml"
SEED = 31
RUNS = 8
"""More runs than a diagnosis needs to name an effect."""


def one(
    rng: np.random.Generator,
    samples: int = 60,
    largest_Nm: float = 50.0,
    noise_rad: float = 2e-6,
    **more: float | npt.NDArray[np.float64],
) -> Columns:
    """One loop of torque with other columns, constant or as measured."""
    phase = 2 * np.pi * np.arange(samples) / max(samples, 2)
    torque = largest_Nm * np.sin(phase)
    lost = torque / 4e4 + 1e-4 * np.tanh(torque / 5) + noise_rad * rng.standard_normal(samples)
    extra = {name: np.broadcast_to(value, (samples,)) * 1.0 for name, value in more.items()}
    return {
        "time_s": np.arange(samples) * 0.02,
        "torque_Nm": torque,
        "lost_motion_rad": lost,
        **extra,
    }


def turning(run: Columns) -> Columns:
    """The same with the two angles of a drive that turns."""
    turned = {name: values for name, values in run.items() if name != "lost_motion_rad"}
    turned["input_angle_rad"] = 2.0 * run["time_s"]
    turned["output_angle_rad"] = turned["input_angle_rad"] / 100 + run["lost_motion_rad"]
    return turned


def campaigns() -> Iterator[tuple[str, list[Columns]]]:
    """Things that a campaign can lack, one in each case."""
    rng = np.random.default_rng(SEED)
    several = range(RUNS)
    still = np.zeros(60)
    yield "one run", [one(rng, 200)]
    yield "one run that cools", [one(rng, 200, temperature_C=np.linspace(99, 20, 200))]
    yield "two runs", [one(rng, temperature_C=20.0 + k) for k in range(2)]
    for samples in (1, 2, 3, 7):
        yield (
            f"runs of {samples}",
            [one(rng, samples, temperature_C=20.0 + k) for k in range(60 // samples)],
        )
    unequal = (2, 3, 500, 10, 1, 60, 7, 200)
    yield "unequal runs", [one(rng, n, temperature_C=20.0 + k) for k, n in enumerate(unequal)]
    yield "one temperature", [one(rng, temperature_C=25.0) for _ in several]
    yield (
        "temperature in one run",
        [one(rng, temperature_C=30.0), *(one(rng) for _ in several)],
    )
    half = np.where(np.arange(60) % 2, np.nan, 22.0)
    yield "temperature in every other row", [one(rng, temperature_C=half + k) for k in several]
    yield "one amplitude", [one(rng) for _ in several]
    yield "no noise", [one(rng, noise_rad=0.0, temperature_C=20.0 + k) for k in several]
    yield "noise alone", [one(rng, noise_rad=0.1, temperature_C=20.0 + k) for k in several]
    yield "one run repeated many times", [one(rng, temperature_C=22.0)] * RUNS
    yield "the same without noise", [one(rng, noise_rad=0.0)] * RUNS
    rising = [one(rng, temperature_C=20.0 + k) for k in several]
    for run in rising:
        run["torque_Nm"] = np.sort(run["torque_Nm"])
    yield "one direction", rising
    yield "next to no torque", [one(rng, largest_Nm=1e-9) for _ in several]
    yield "a torque that stands", [one(rng) | {"torque_Nm": still + 5.0 + k} for k in several]
    yield "a torque of one sample", [one(rng) | {"torque_Nm": np.r_[still[1:], 1.0]}] * RUNS
    flips = np.where(np.arange(60) % 2, 1e-4, -1e-4)
    yield "two values", [one(rng) | {"torque_Nm": 1e5 * flips, "lost_motion_rad": flips}] * RUNS
    yield (
        "coarse",
        [one(rng) | {"lost_motion_rad": np.round(one(rng)["lost_motion_rad"], 4)}] * RUNS,
    )
    step = one(rng) | {"lost_motion_rad": np.r_[still[:30], still[30:] + 1e-3]}
    yield "a step in one run", [*[one(rng) | {"lost_motion_rad": still}] * RUNS, step]
    yield "turning", [turning(one(rng, temperature_C=20.0 + k)) for k in several]
    yield "turning, one run", [turning(one(rng))]
    held = [turning(one(rng)) for _ in several]
    for run in held:
        run["output_angle_rad"] -= run["input_angle_rad"] / 100
        run["input_angle_rad"] = still
    yield "an input that is held", held
    few = [turning(one(rng, 10, 1900.0, 1e-4)) for _ in range(5)]
    for run in few:
        run["torque_Nm"] = 900.0 * rng.standard_normal(10)
    yield "fewer samples than a fit has values", few
    constant = {"cycles": 5.0, "tilt_moment_Nm": 1.0, "axial_force_N": 2.0}
    yield "everything else constant", [one(rng, **constant) for _ in several]
    yield "a slow clock", [one(rng) | {"time_s": 1e5 * np.arange(60.0)} for _ in several]
    yield "a fast clock", [one(rng) | {"time_s": 1e-7 * np.arange(60.0)} for _ in several]


def write(folder: Path, runs: list[Columns]) -> Path:
    names = list(dict.fromkeys(name for run in runs for name in run))
    lines = ["run," + ",".join(names)]
    for label, run in enumerate(runs):
        for row in range(run["time_s"].size):
            cells = [repr(float(run[name][row])) if name in run else "" for name in names]
            lines.append(",".join([str(label), *cells]))
    file = folder / "campaign.csv"
    file.write_text("\n".join(lines) + "\n")
    return file


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("runs", [pytest.param(runs, id=name) for name, runs in campaigns()])
def test_every_command_answers_or_refuses_in_one_line(
    runs: list[Columns], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive, file, report = str(DRIVE), str(write(tmp_path, runs)), str(tmp_path / "report.html")
    answer = str(tmp_path / "answer.json")
    fitted, evidence = str(tmp_path / "fitted.toml"), str(tmp_path / "evidence.npz")
    commands = [
        ["check", file],
        ["compare", drive, file, "--report", report],
        ["diagnose", drive, file, "--report", report, "--save-evidence", evidence],
        ["merge", evidence, evidence],
        ["fit", drive, file, "--report", report, "-o", fitted],
        ["fit", drive, file, "--add", "thermal_gap", "creep", "-o", str(tmp_path / "two.toml")],
        ["compare", fitted, file],
        ["characterize", file, "--ratio", "100", "-o", str(tmp_path / "own.toml")],
        ["characterize", drive, file, "--report", report],
        ["forecast", drive, file],
        ["next", drive, file, "--plan", file],
        ["replay", drive, file],
    ]
    for words in commands:
        if not all(Path(word).exists() for word in words[1:3] if word.endswith((".npz", ".toml"))):
            continue  # what writes it has refused
        status = main([*words, "--json", answer, "--quiet"])
        said = capsys.readouterr().err
        assert status in (0, 2), (words, said)
        if status == 0:
            json.loads(Path(answer).read_text())
        else:
            assert said.startswith("lostmotion: ")
            assert said.count("\n") == 1


def test_no_size_is_stated_if_none_would_be_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(SEED)
    file = write(tmp_path, [one(rng, 200, temperature_C=np.linspace(99, 20, 200))])
    report = tmp_path / "report.html"
    words = ["diagnose", str(DRIVE), str(file), "--json", "-", "--report", str(report)]
    assert main(words) == 0
    answer = json.loads(capsys.readouterr().out)
    assert "thermal gap" in report.read_text()
    assert "no size is detectable: 1 run leaves its test" in report.read_text()
    assert answer["smallest_detectable"] == {}
    reasons = answer["not_detectable"]
    assert reasons["thermal_gap"].startswith("no size is detectable: 1 run leaves its test")
    assert main(["forecast", str(DRIVE), str(file), "--json", "-"]) == 0
    rows = {row["name"]: row for row in json.loads(capsys.readouterr().out)["effects"]}
    assert not rows["thermal_gap"]["testable"]
    assert rows["thermal_gap"]["reason"] == reasons["thermal_gap"]


def test_a_test_with_too_few_degrees_of_freedom_has_no_smallest_size() -> None:
    assert noncentrality(1, 0, 1e-3) is None
    assert noncentrality(4, 1, 1e-6) is None
    found = noncentrality(1, 1, 1e-2)
    assert found is not None
    assert found > noncentrality(1, 20, 1e-2)
