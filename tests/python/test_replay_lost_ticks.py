"""Replay of logs with missing numbers or ticks: every row is a tick, as on the controller."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from conftest import DATA
from lostmotion.cli import main
from lostmotion.core import core
from lostmotion.recordings import read_campaign
from lostmotion.replay import OUTPUTS, STATES, read_parameters, replay

DRIVE = DATA / "drives" / "size_25.toml"
PERIOD_S = 1e-3
TICKS = 600
REFUSED = 1 << STATES.index("input_refused")


def loop(ticks: int = TICKS) -> dict[str, npt.NDArray[np.float64]]:
    time_s = np.arange(ticks) * PERIOD_S
    torque = 50 * np.sin(2 * np.pi * time_s / 0.3)
    return {"time_s": time_s, "torque_Nm": torque, "lost_motion_rad": torque / 35e3}


def write_log(folder: Path, columns: dict[str, npt.NDArray[np.float64]], name: str = "log") -> Path:
    file = folder / f"{name}.csv"
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(map(repr, map(float, row))) for row in rows)]
    file.write_text("\n".join(lines) + "\n")
    return file


def by_hand(torque: npt.NDArray[np.float64], elapsed: npt.NDArray[np.float64]) -> Any:
    """Numbers and status of the compensator, stepped by the test with the rows of the log."""
    parameters, _, _ = read_parameters(DRIVE, {})
    c = core(32)
    compensator, fault = c.ffi.new("lm_compensator *"), c.fault()
    c.check(c.lib.lm_start_compensator(compensator, parameters, torque[0], fault), fault)
    at = c.ffi.new("lm_conditions *")
    at.temperature_C = c.lib.LM_REFERENCE_TEMPERATURE_C
    rows, status = [], []
    for torque_Nm, elapsed_s in zip(torque, elapsed, strict=True):
        at.torque_Nm, at.elapsed_s = torque_Nm, elapsed_s
        now = c.lib.lm_step_compensator(compensator, at)
        rows.append([getattr(now, name) for name in OUTPUTS])
        status.append(now.status)
    return np.array(rows, dtype=np.float32), np.array(status, dtype=np.uint32)


def replayed(file: Path) -> Any:
    parameters, ratio, _ = read_parameters(DRIVE, {})
    return replay(parameters, read_campaign(file, ratio=ratio))


@pytest.mark.parametrize("lost", [slice(0, 3), slice(200, 299), slice(TICKS - 5, TICKS)])
def test_ticks_without_a_torque_are_the_compensators_own_bit_for_bit(
    tmp_path: Path, lost: slice
) -> None:
    columns = loop()
    columns["torque_Nm"][lost] = np.nan
    result = replayed(write_log(tmp_path, columns))
    elapsed = np.diff(columns["time_s"], prepend=columns["time_s"][0])
    rows, status = by_hand(columns["torque_Nm"], elapsed)
    tape = result.tapes[0]
    np.testing.assert_array_equal(tape.values.view(np.uint32), rows.view(np.uint32))
    np.testing.assert_array_equal(tape.status, status)
    refused = np.flatnonzero(tape.status & REFUSED)
    assert refused.tolist() == list(range(TICKS))[lost]
    answer = result.answer()
    count = len(range(TICKS)[lost])
    assert answer["samples"] == TICKS
    assert answer["samples_compared"] == TICKS - count
    assert answer["by_run"][0]["not_a_number"] == {"torque_Nm": count}
    assert any(f"torque_Nm is not a number in {count} ticks (run log)" in n for n in result.notes)


def test_a_lost_measurement_of_the_output_changes_no_bit(tmp_path: Path) -> None:
    columns = loop()
    whole = replayed(write_log(tmp_path, columns, "whole"))
    columns["lost_motion_rad"][100:180] = np.nan
    result = replayed(write_log(tmp_path, columns))
    assert result.tapes[0].words() == whole.tapes[0].words()
    assert result.answer()["samples_compared"] == TICKS - 80
    assert result.notes == []


def test_ticks_that_were_not_recorded_are_counted_and_stepped_across_once(tmp_path: Path) -> None:
    columns = loop()
    left = np.r_[0:150, 151:300, 340:TICKS]  # one tick, then forty
    result = replayed(write_log(tmp_path, {name: v[left] for name, v in columns.items()}))
    elapsed = np.diff(columns["time_s"][left], prepend=columns["time_s"][0])
    rows, _ = by_hand(columns["torque_Nm"][left], elapsed)
    np.testing.assert_array_equal(result.tapes[0].values.view(np.uint32), rows.view(np.uint32))
    run = result.answer()["by_run"][0]
    assert (run["missing_ticks"], run["longest_gap_s"]) == (41, pytest.approx(0.041))
    note = next(n for n in result.notes if "missing" in n)
    assert note.startswith("41 ticks missing in 2 gaps of the clock (run log; longest 0.041 s, run")
    assert "at 0.299 s" in note
    assert "with its length as elapsed_s" in note


def test_a_clock_at_rest_or_not_a_number_counts_a_period_a_tick(tmp_path: Path) -> None:
    columns = loop(100)
    columns["time_s"][40] = columns["time_s"][39]
    columns["time_s"][70] = np.nan
    result = replayed(write_log(tmp_path, columns))
    assert result.answer()["samples"] == 100
    told = result.tapes[0].told["elapsed_s"]
    assert told[[40, 70, 71]].tolist() == [0.0, 0.0, 0.0]
    rows, _ = by_hand(columns["torque_Nm"], told.astype(np.float64))
    np.testing.assert_array_equal(result.tapes[0].values.view(np.uint32), rows.view(np.uint32))
    assert any(n.startswith("time_s is not a number in 1 tick ") for n in result.notes)
    assert any(n.startswith("The time does not advance in 1 tick ") for n in result.notes)


def test_a_torque_beyond_the_limit_reaches_the_compensator_as_it_was_logged(tmp_path: Path) -> None:
    columns = loop()
    columns["torque_Nm"][321] = 900.0
    result = replayed(write_log(tmp_path, columns))
    elapsed = np.diff(columns["time_s"], prepend=columns["time_s"][0])
    rows, status = by_hand(columns["torque_Nm"], elapsed)
    np.testing.assert_array_equal(result.tapes[0].values.view(np.uint32), rows.view(np.uint32))
    assert status[321] & 1 << STATES.index("torque_clipped")
    # The row is an outlier of the measurement, but still a tick.
    answer = result.answer()
    assert (answer["samples"], answer["samples_compared"]) == (TICKS, TICKS - 1)


def test_angles_keep_their_turns_where_rows_were_left_out(tmp_path: Path) -> None:
    columns = loop()
    del columns["lost_motion_rad"]
    turned = 40.0 * columns["time_s"]
    columns["input_angle_rad"] = np.remainder(turned, 2 * np.pi)
    columns["output_angle_rad"] = turned / 100 + columns["torque_Nm"] / 35e3
    whole = replayed(write_log(tmp_path, columns, "whole")).tapes[0].told
    columns["torque_Nm"][100:400] = np.nan
    told = replayed(write_log(tmp_path, columns)).tapes[0].told
    np.testing.assert_allclose(told["input_velocity_rad_s"], 40.0, rtol=1e-3)
    for name in ("input_angle_rad", "input_velocity_rad_s", "output_acceleration_rad_s2"):
        np.testing.assert_array_equal(told[name], whole[name])


def test_the_command_states_what_the_log_lacks_and_writes_every_tick(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = loop()
    columns["torque_Nm"][10:20] = np.nan
    file, table = write_log(tmp_path, columns), tmp_path / "ticks.csv"
    assert main(["replay", str(DRIVE), str(file), "--table", str(table)]) == 0
    assert "torque_Nm is not a number in 10 ticks (run log)" in capsys.readouterr().out
    assert len(table.read_text().splitlines()) == TICKS + 1
    assert main(["replay", str(DRIVE), str(file), "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["states"]["input_refused"] == 10
    assert len(answer["notes"]) == 1
