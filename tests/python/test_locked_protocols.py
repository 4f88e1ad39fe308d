"""Locked protocols: one side is at rest, and the torque may be that of the motor."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lostmotion.cli import main
from lostmotion.drives import read_drive
from lostmotion.effects.columns import closed_by_columns
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.library import library
from lostmotion.errors import InputError
from lostmotion.recordings import Campaign, Protocol, read_campaign
from lostmotion.sample import sample_campaign

DATA = Path(__file__).parents[1] / "data"
CYCLOIDAL = DATA / "cycloidal_locked_output"
RATIO = 13
OUTPUT = Protocol("output")


def written(folder: Path, columns: dict[str, np.ndarray], name: str = "log.csv") -> Path:
    file = folder / name
    table = np.column_stack(list(columns.values()))
    np.savetxt(file, table, "%.12g", ",", header=",".join(columns), comments="")
    return file


def locked_output(ratio: float, stiffness: float = 3e4) -> dict[str, np.ndarray]:
    """A motor that winds up a gear with a locked output, in the motor's angle and torque.

    From the energy of the spring: E = K (theta / ratio)^2 / 2, so the motor's torque is dE / dtheta
    = K theta / ratio^2.
    """
    theta = 0.3 * np.sin(np.linspace(0.0, 4 * np.pi, 400))
    torque = stiffness * theta / ratio**2
    return {
        "time_s": np.linspace(0.0, 4.0, 400),
        "input_angle_rad": theta,
        "motor_torque_Nm": torque,
        "motor_current_A": torque / 0.05,
    }


@pytest.mark.parametrize("ratio", [100.0, -100.0])
@pytest.mark.parametrize("by", ["motor_torque_Nm", "motor_current_A"])
def test_a_locked_output_gives_the_gear_s_own_stiffness(
    tmp_path: Path, ratio: float, by: str
) -> None:
    columns = locked_output(ratio)
    kept = {name: columns[name] for name in ("time_s", "input_angle_rad", by)}
    campaign = read_campaign(
        written(tmp_path, kept), ratio=ratio, protocol=Protocol("output", 0.05)
    )
    stiffness = np.polyfit(campaign.column("lost_motion"), campaign.column("torque"), 1)[0]
    assert stiffness == pytest.approx(3e4, rel=1e-6)
    kinds = {finding.kind for finding in campaign.findings}
    assert {"locked", "motor_torque"} <= kinds
    assert "sign" not in kinds
    assert {"motor_torque", "motor_current"}.isdisjoint(campaign.quantities())


def test_a_motor_that_pushes_forward_is_a_negative_torque_on_the_output(tmp_path: Path) -> None:
    columns = locked_output(100.0)
    campaign = read_campaign(written(tmp_path, columns), ratio=100.0, protocol=OUTPUT)
    pushed = columns["motor_torque_Nm"] > 0.01
    assert np.all(campaign.column("torque")[pushed] < 0)
    assert np.all(campaign.column("lost_motion")[pushed] < 0)


def test_a_real_log_reads_as_with_the_map_that_was_made_by_hand() -> None:
    """Signs and sizes of the printed reducer: its drive file reverses both columns."""
    file = CYCLOIDAL / "base_onyx_runin5.csv"
    drive = read_drive(CYCLOIDAL / "drive.toml")
    by_hand = read_campaign(file, ratio=drive.ratio, mapping=drive.columns)
    mapping = {
        "TIME": "time_s",
        "test_nr": "run",
        "POSITION": f"input_angle_rev/{1 / RATIO!r}",
        "TORQUE": f"motor_torque_Nm/{RATIO}",
    }
    by_protocol = read_campaign(file, ratio=RATIO, mapping=mapping, protocol=OUTPUT)
    for name in ("torque", "lost_motion"):
        np.testing.assert_allclose(by_protocol.column(name), by_hand.column(name), atol=1e-9)
    rising = np.polyfit(by_protocol.column("torque"), by_protocol.column("lost_motion"), 1)[0]
    assert rising > 0


def test_a_locked_input_needs_no_input_angle_and_no_ratio(tmp_path: Path) -> None:
    torque = 20 * np.sin(np.linspace(0, 4 * np.pi, 200))
    columns = {
        "time_s": np.linspace(0.0, 2.0, 200),
        "torque_Nm": torque,
        "output_angle_rad": 0.4 + torque / 2e4,
    }
    campaign = read_campaign(written(tmp_path, columns), protocol=Protocol("input"))
    np.testing.assert_allclose(campaign.column("lost_motion"), 0.4 + torque / 2e4, atol=1e-12)
    assert [f.kind for f in campaign.findings] == ["locked"]


def test_what_was_measured_overrides_the_protocol(tmp_path: Path) -> None:
    columns = locked_output(100.0)
    columns["torque_Nm"] = 1.01 * -100 * columns["motor_torque_Nm"]
    columns["output_angle_rad"] = 1e-5 * columns["torque_Nm"]
    campaign = read_campaign(written(tmp_path, columns), ratio=100.0, protocol=OUTPUT)
    np.testing.assert_allclose(campaign.column("torque"), columns["torque_Nm"], atol=1e-9)
    assert np.ptp(campaign.column("output_angle")) > 0
    assert {f.kind for f in campaign.findings} == {"ignored_column"}


@pytest.mark.parametrize(
    ("columns", "hint"),
    [
        (("time_s", "input_angle_rad", "motor_current_A"), "--torque-constant-Nm-per-A"),
        (("time_s", "input_angle_rad", "motor_torque_Nm"), "--locked output"),
        (("time_s", "torque_Nm", "output_angle_rad"), "--locked input"),
    ],
)
def test_a_file_that_lacks_a_side_is_refused_with_the_protocol_that_reads_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], columns: tuple[str, ...], hint: str
) -> None:
    known = {**locked_output(100.0), "torque_Nm": np.arange(400.0)}
    known["output_angle_rad"] = known["input_angle_rad"]
    file = written(tmp_path, {name: known[name] for name in columns})
    assert main(["check", str(file)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert hint in said


def test_a_torque_constant_that_is_none_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(written(tmp_path, locked_output(100.0)))
    for bad in ("0", "much", "nan"):
        words = ["check", file, "--locked", "output", "--torque-constant-Nm-per-A", bad]
        assert main(words) == 2
        assert "--torque-constant-Nm-per-A" in capsys.readouterr().err


def test_the_drive_file_may_state_the_protocol(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = locked_output(100.0)
    del columns["motor_torque_Nm"]
    log = written(tmp_path, columns)
    drive = tmp_path / "drive.toml"
    text = (DATA / "drives" / "size_25.toml").read_text()
    drive.write_text(text + '\n[recordings]\nlocked = "output"\ntorque_constant_mNm_per_A = 50\n')
    assert read_drive(drive).protocol == Protocol("output", 0.05)
    assert main(["compare", str(drive), str(log), "--json", "-"]) == 0
    stated = json.loads(capsys.readouterr().out)
    bought = str(DATA / "drives" / "size_25.toml")
    options = ["--locked", "output", "--torque-constant-Nm-per-A", "0.05", "--json", "-"]
    assert main(["compare", bought, str(log), *options]) == 0
    by_option = json.loads(capsys.readouterr().out)
    assert stated["data_fingerprint"] == by_option["data_fingerprint"]
    assert any("motor" in finding for finding in stated["findings"])
    drive.write_text(text + '\n[recordings]\nlocked = "both"\n')
    with pytest.raises(InputError, match=r"recordings\.locked"):
        read_drive(drive)


def test_a_sample_of_a_large_log_keeps_the_protocol(tmp_path: Path) -> None:
    columns = locked_output(100.0)
    del columns["motor_torque_Nm"]
    file = written(tmp_path, columns)
    protocol = Protocol("output", 0.05)
    whole = read_campaign(file, ratio=100.0, protocol=protocol)
    sampled = sample_campaign([file], ratio=100.0, protocol=protocol, rows=1000)
    assert sampled.fingerprint() == whole.fingerprint()
    assert {f.kind for f in sampled.findings} == {f.kind for f in whole.findings}


def test_rows_in_a_stated_order_need_no_clock(tmp_path: Path) -> None:
    torque = 20 * np.sin(np.linspace(0, 4 * np.pi, 30))
    columns = {
        "order": np.arange(30.0),
        "torque_Nm": torque,
        "input_angle_rad": np.sin(torque),
        "output_angle_rad": torque / 2e4 + np.sin(torque) / 100,
    }
    file = written(tmp_path, columns)
    campaign = read_campaign(file, ratio=100.0)
    assert not campaign.timed
    closed = closed_by_columns(library(), Conditions(campaign))
    assert {"creep", "viscous_friction", "inertia"} <= set(closed["time"])
    with pytest.raises(InputError, match="time_s"):
        read_campaign(written(tmp_path, {k: v for k, v in columns.items() if k != "order"}))


def test_a_plan_may_be_one_of_a_locked_output(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = locked_output(100.0)
    plan = written(tmp_path, {k: columns[k] for k in ("time_s", "motor_current_A")}, "plan.csv")
    drive = str(DATA / "joint" / "joint.toml")
    assert main(["forecast", drive, str(plan)]) == 2
    assert "no such column" in capsys.readouterr().err
    options = ["--locked", "output", "--torque-constant-Nm-per-A", "0.05"]
    assert main(["forecast", drive, str(plan), *options, "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["schema"] == "lostmotion.forecast/1"


@pytest.mark.parametrize("read", [read_campaign, sample_campaign])
@pytest.mark.parametrize("ratio", [None, 100.0])
def test_a_locked_input_has_no_encoder_that_could_lose_turns(
    tmp_path: Path, read: Callable[..., Campaign], ratio: float | None
) -> None:
    """A soft drive, at rest at two loads: its moves are longer than a turn of the input."""
    ends, up = np.zeros(9), np.array([0.03, 0.09, 0.135])
    angle = np.tile(np.concatenate([ends, up, ends + 0.15, 0.15 - up]), 6)
    torque = 33 * angle + 0.3 * np.sin(np.arange(angle.size))
    for run in (1, 2):
        columns = {"time_s": 0.1 * np.arange(angle.size), "torque_Nm": torque}
        written(tmp_path, columns | {"output_angle_rad": angle + 0.2 * run}, f"{run}.csv")
    campaign = read([tmp_path], ratio=ratio, protocol=Protocol("input"))
    for run, found in enumerate(campaign.runs, start=1):
        np.testing.assert_allclose(found.lost_motion_rad, angle + 0.2 * run)
        assert not found.columns["input_angle"].any()
    assert {finding.kind for finding in campaign.findings} == {"locked"}
