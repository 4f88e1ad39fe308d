"""The gate refuses each mistake before any fit; the suggested correction gives the right result."""

from __future__ import annotations

import argparse
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import DATA
from lostmotion.cli import main
from lostmotion.commands.inputs import read_inputs
from lostmotion.compare import compare
from lostmotion.discover import diagnose, fit_model
from lostmotion.drives import format_toml, read_drive
from lostmotion.errors import InputError
from lostmotion.recordings import Campaign, Run, read_campaign
from lostmotion.recordings.gate import RATIO_TOLERANCE
from lostmotion.recordings.ratio import measured_ratio
from lostmotion.workbench.bench import Bench

EVERY = 10
"""Rows of the demo's campaign that are used."""

Columns = dict[str, np.ndarray]
NAMES = ("time_s", "torque_Nm", "input_angle_rad", "output_angle_rad", "temperature_C")
DEG, ARCMIN = np.pi / 180, np.pi / 10800


@pytest.fixture(scope="module")
def clean() -> Columns:
    campaign = read_campaign(DATA / "joint" / "joint.csv.gz", ratio=100)
    labels = np.concatenate([np.full(len(run), run.label) for run in campaign.runs])
    return {"run": labels[::EVERY]} | {name: campaign.column(name)[::EVERY] for name in NAMES}


def written(folder: Path, columns: Columns, drive: dict[str, Any]) -> tuple[str, str]:
    """Write a drive file and recordings."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    text = "\n".join([",".join(columns), *(",".join(f"{x!r}" for x in row) for row in rows)])
    (folder / "a.csv").write_text(text + "\n")
    (folder / "drive.toml").write_text(format_toml(drive))
    return str(folder / "drive.toml"), str(folder / "a.csv")


def read(drive: str, data: str, maps: list[str] | None = None) -> Campaign:
    """Read as the commands do."""
    words = {"drive": drive, "data": [data], "map": maps or [], "dask": None}
    arguments = argparse.Namespace(**words, locked=None, torque_constant=None, join=None)
    return read_inputs(arguments)[1]


def sheet() -> dict[str, Any]:
    return read_drive(DATA / "joint" / "joint.toml").document


def pasted(reading: str, drive: str) -> list[str]:
    """Apply a suggested correction: write keys into the drive file, return the maps."""
    paste = reading.split(": ", 1)[1]
    if paste.startswith("--map"):
        words = shlex.split(paste)
        return [word for word in words if word != "--map"]
    document = read_drive(drive).document
    keys = paste.split(" in ")[0]
    for key, value in re.findall(r"(\w+) = ([-\d.e+]+)", keys):
        table = document["drive"] if key == "ratio" else document["catalogue"]
        stem = key.split("_")[0]
        for old in [k for k in table if k.split("_")[0] == stem]:
            del table[old]
        table[key] = float(value)
    Path(drive).write_text(format_toml(document))
    return []


def by(name: str, factor: float) -> Callable[[Columns, dict], None]:
    """Write a column in another unit than its name states, or with the sign reversed."""

    def damage(columns: Columns, _: dict[str, Any]) -> None:
        columns[name] = columns[name] * factor

    return damage


def both(factor: float) -> Callable[[Columns, dict], None]:
    """Write both angles in another unit than their names state."""

    def damage(columns: Columns, _: dict[str, Any]) -> None:
        for name in ("input_angle_rad", "output_angle_rad"):
            columns[name] = columns[name] * factor

    return damage


def named(old: str, new: str) -> Callable[[Columns, dict], None]:
    """Give columns with correct numbers the name of another unit."""

    def damage(columns: Columns, _: dict[str, Any]) -> None:
        for name in [name for name in columns if name.endswith(old)]:
            columns[name.removesuffix(old) + new] = columns.pop(name)

    return damage


def swapped(columns: Columns, _: dict[str, Any]) -> None:
    one, other = columns["input_angle_rad"], columns["output_angle_rad"]
    columns["input_angle_rad"], columns["output_angle_rad"] = other, one


def ratio(value: float) -> Callable[[Columns, dict], None]:
    """State another ratio in the drive file."""

    def damage(_: Columns, drive: dict[str, Any]) -> None:
        drive["drive"]["ratio"] = value

    return damage


def stiffness(factor: float, unit: str) -> Callable[[Columns, dict], None]:
    """Write the stiffnesses in another unit than their keys state."""

    def damage(_: Columns, drive: dict[str, Any]) -> None:
        sheet = drive["catalogue"]
        for key in [key for key in sheet if key.startswith("K")]:
            sheet[f"{key[:2]}_{unit}"] = sheet.pop(key) * factor

    return damage


MISTAKES = {
    "sign of the ratio": ratio(-100),
    "half the ratio": ratio(50),
    "another ratio": ratio(121),
    "angles swapped": swapped,
    "sign of the torque": by("torque_Nm", -1),
    "sign of both angles": both(-1),
    "torque of the motor": by("torque_Nm", 0.01),
    "degrees for radians": both(1 / DEG),
    "arc minutes for radians": both(1 / ARCMIN),
    "arc seconds for radians": both(60 / ARCMIN),
    "mrad for radians": both(1e3),
    "radians for degrees": named("_rad", "_deg"),
    "radians for arc minutes": named("_rad", "_arcmin"),
    "radians for mrad": named("_rad", "_mrad"),
    "input in degrees": by("input_angle_rad", 1 / DEG),
    "input in revolutions": by("input_angle_rad", 0.5 / np.pi),
    "output in degrees": by("output_angle_rad", 1 / DEG),
    "N mm for N m": by("torque_Nm", 1e3),
    "N m for N mm": named("_Nm", "_Nmm"),
    "N cm for N m": by("torque_Nm", 1e2),
    "stiffness a degree": stiffness(DEG, "Nm_per_rad"),
    "stiffness a radian": stiffness(1, "Nm_per_deg"),
    "stiffness in N mm": stiffness(1e3, "Nm_per_rad"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_the_line_repairs_the_mistake(tmp_path: Path, clean: Columns, mistake: str) -> None:
    columns, drive = dict(clean), sheet()
    right = read(*written(tmp_path, columns, drive))
    MISTAKES[mistake](columns, drive)
    files = written(tmp_path, columns, drive)
    with pytest.raises(InputError) as refused:
        read(*files)
    assert str(refused.value).count("\n") == 0
    errors = []
    for said in refused.value.expected.split("; or, "):
        written(tmp_path, columns, drive)
        again = read(*files, pasted(said, files[0]))
        torque, lost = again.column("torque"), again.column("lost_motion")
        # With all signs reversed the answer is the same.
        sign = np.sign(float(torque @ right.column("torque")))
        error = max(
            np.ptp(sign * torque - right.column("torque")) / np.ptp(torque),
            max(
                float(np.ptp(sign * a.lost_motion_rad - b.lost_motion_rad))
                for a, b in zip(again.runs, right.runs, strict=True)
            )
            / float(np.ptp(lost)),
        )
        errors.append(float(error))
    assert min(errors) < 1e-3, refused.value
    assert len(errors) <= 3, refused.value


@pytest.mark.parametrize("softer", [0.1, 0.3, 3.0, 10.0])
def test_a_drive_that_is_softer_than_its_sheet_is_not_refused(
    tmp_path: Path, clean: Columns, softer: float
) -> None:
    drive = sheet()
    for key in [key for key in drive["catalogue"] if key.startswith("K")]:
        drive["catalogue"][key] *= softer
    read(*written(tmp_path, dict(clean), drive))


def test_the_command_ends_with_status_2_and_writes_nothing(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, clean: Columns
) -> None:
    columns, drive = dict(clean), sheet()
    drive["drive"]["ratio"] = -100
    files = written(tmp_path, columns, drive)
    report = tmp_path / "report.html"
    assert main(["compare", *files, "--report", str(report)]) == 2
    captured = capsys.readouterr()
    assert (captured.out, report.exists()) == ("", False)
    assert captured.err.count("\n") == 1
    assert f"ratio = 100 in {files[0]}" in captured.err


@pytest.mark.parametrize("call", ["compare", "diagnose", "fit_model", "workbench"])
def test_python_and_workbench_pass_the_same_gate(tmp_path: Path, clean: Columns, call: str) -> None:
    drive = sheet()
    drive["drive"]["ratio"] = -100
    drive_file, data = written(tmp_path, dict(clean), drive)
    held = read_drive(drive_file)

    def campaign() -> Campaign:
        return read_campaign(data, ratio=held.ratio)

    calls: dict[str, Callable[[], object]] = {
        "compare": lambda: compare(held, campaign()),
        "diagnose": lambda: diagnose(held, campaign()),
        "fit_model": lambda: fit_model(held, campaign()),
        "workbench": lambda: Bench().load_recordings([data], [], lambda *_: None, drive_file),
    }
    with pytest.raises(InputError, match="ratio = 100 in"):
        calls[call]()


SWING_RAD = {"one joint of an arm": 4.7, "a drive of soft plastic": 0.3}


def swing(folder: Path, largest_rad: float, **columns: str) -> tuple[str, list[str]]:
    """Write three loops up to an angle, and the maps of its columns."""
    phase = 2 * np.pi * np.arange(600) / 200
    torque, angle = 5 * np.sin(phase), largest_rad / 2 * np.sin(phase) + 1e-4 * np.cos(phase)
    table = {"time_s": 0.02 * np.arange(600), "torque_Nm": torque}
    table |= {name: angle if how == "angle" else -0.9 * angle for name, how in columns.items()}
    file = folder / "swing.csv"
    rows = [",".join(f"{x:.8g}" for x in row) for row in zip(*table.values(), strict=True)]
    file.write_text("\n".join([",".join(table), *rows]) + "\n")
    return str(file), ["--ratio", "20"]


@pytest.mark.parametrize("command", ["check", "characterize"])
@pytest.mark.parametrize(
    ("columns", "options", "line"),
    [
        ({"lost_motion_rad": "angle"}, [], "lost_motion_rad: found 4.7 rad in run swing"),
        (
            {"output_angle_rad": "angle"},
            ["--locked", "input"],
            "output_angle_rad: found 4.7 rad of lost motion in run swing, expected less than 0.5 "
            "rad of wind-up: recordings with the input locked, or with both angles",
        ),
        (
            {"output_angle_rad": "angle", "input_angle_rad": "other"},
            [],
            "output_angle_rad: found 4.91 rad between output and input / 20 in run swing",
        ),
    ],
)
def test_angles_that_no_drive_winds_up_by_are_refused(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    command: str,
    columns: dict[str, str],
    options: list[str],
    line: str,
) -> None:
    """The swing of a joint, or the angles of two, are no lost motion, in every command."""
    file, ratio = swing(tmp_path, SWING_RAD["one joint of an arm"], **columns)
    output = ["-o", str(tmp_path / "drive.toml")] if command == "characterize" else []
    with pytest.raises(SystemExit) as ended:
        raise SystemExit(main([command, file, *ratio, *options, *output]))
    assert ended.value.code == 2
    assert line in capsys.readouterr().err
    assert not (tmp_path / "drive.toml").exists()


def test_a_locked_input_needs_no_encoder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A soft drive winds up by more than encoders may differ; its locked input has none."""
    file, ratio = swing(tmp_path, SWING_RAD["a drive of soft plastic"], output_angle_rad="angle")
    drive = str(tmp_path / "drive.toml")
    assert main(["characterize", file, *ratio, "--locked", "input", "-o", drive]) == 0
    assert main(["compare", drive, file, "--locked", "input"]) == 0
    assert "fitted" in capsys.readouterr().out


def test_a_ratio_that_no_drive_file_takes_is_refused_as_an_option(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, _ = swing(tmp_path, 0.1, lost_motion_rad="angle")
    output = str(tmp_path / "drive.toml")
    assert main(["characterize", file, "--ratio", "-1", "-o", output]) == 2
    line = capsys.readouterr().err
    assert line == "lostmotion: --ratio: found '-1', expected more than 1 or less than -1\n"


def test_a_drive_that_stands_most_of_the_time_turns_in_its_ratio() -> None:
    """Its moves are the long steps of both encoders, the output's a sample late; no wraps."""
    rng = np.random.default_rng(2)
    move = np.clip(np.linspace(-9.0, 10.0, 1900), 0.0, 1.0)  # at rest, 100 samples, at rest
    turned = 9.7 * (move - np.sin(2 * np.pi * move) / (2 * np.pi))
    late = np.concatenate([turned[:3] * 0, turned[:-3]])
    columns = {
        "time": 0.02 * np.arange(turned.size),
        "torque": rng.normal(size=turned.size),
        "input_angle": -6 * turned + 2e-3 * rng.normal(size=turned.size),
        "output_angle": late + 3e-4 * rng.normal(size=turned.size),
    }
    turns = measured_ratio(Run(1, "dwell.csv", columns))
    assert turns is not None
    assert turns.slope == pytest.approx(-6, rel=RATIO_TOLERANCE)
