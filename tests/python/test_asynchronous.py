"""Asynchronous channels: one that repeats its values, and an angle that is delayed."""

from __future__ import annotations

import numpy as np
import pytest

from lostmotion.recordings import Campaign, Run
from lostmotion.recordings.asynchronous import check_asynchronous, leave_out_repeated


def turning(lag_s: float, every: int) -> Campaign:
    """Two runs that turn back and forth; the output is joined with a delay, or by its last
    value."""
    runs = []
    for label in (1, 2):
        time = np.arange(1500) * 0.01

        def output(at: np.ndarray) -> np.ndarray:
            return 0.9 * np.sin(0.7 * at)

        torque = 20 * np.sin(2.9 * time + label)
        out = output(time - lag_s) + torque * 5e-5
        noise = 2e-6 * np.random.default_rng(label).normal(size=1500)
        out = (out + noise)[np.arange(1500) // every * every]
        put_in = 100 * output(time)
        columns = {"time": time, "torque": torque, "input_angle": put_in, "output_angle": out}
        columns["lost_motion"] = out - put_in / 100
        runs.append(Run(label, "a.csv", columns))
    return Campaign(runs)


@pytest.mark.parametrize("every", [2, 3, 4, 5, 20])
def test_rows_that_repeat_the_last_value_of_a_slower_channel_are_left_out(every: int) -> None:
    data = turning(0.0, every)
    leave_out_repeated(data)
    assert [len(run) for run in data.runs] == [-(-1500 // every)] * 2
    found = [f for f in data.findings if f.kind == "repeats"]
    assert [(f.run, f.column) for f in found] == [(1, "output_angle_rad"), (2, "output_angle_rad")]
    assert f"a new value every {every} rows" in found[0].action


@pytest.mark.parametrize("lag_s", [0.03, -0.05])
def test_an_angle_that_is_older_than_the_other_is_named_with_its_age(lag_s: float) -> None:
    data = turning(lag_s, 1)
    check_asynchronous(data)
    found = [f for f in data.findings if f.kind == "lag"]
    assert [f.run for f in found] == [1, 2]
    age = float(found[0].action.split("were ")[1].split(" ms")[0])
    assert age == pytest.approx(1e3 * lag_s, rel=0.02)


@pytest.mark.parametrize("count", [1e-5, 1e-3])
def test_angles_of_one_moment_and_coarse_counts_are_no_findings(count: float) -> None:
    data = turning(0.0, 1)
    for run in data.runs:
        for name in ("input_angle", "output_angle"):
            run.columns[name] = count * np.round(run.columns[name] / count)
    leave_out_repeated(data)
    check_asynchronous(data)
    assert data.findings == []


@pytest.mark.parametrize("rows", [2, 3, 4, 20, 100])
@pytest.mark.parametrize("standing", ["torque", "input_angle"])
def test_stations_are_no_slower_channel(rows: int, standing: str) -> None:
    """Weights that are stated, or an encoder whose reading repeats while the drive stands."""
    at = np.repeat(np.sin(np.arange(48) / 4.0), rows)
    rng = np.random.default_rng(rows)
    if standing == "torque":
        torque, put_in = 40 * at, 3e-4 * rng.normal(size=at.size)
    else:
        torque, put_in = 5 * rng.normal(size=at.size), 100 * at
    out = put_in / 100 + torque / 3e4 + 2e-6 * rng.normal(size=at.size)
    columns = {"time": 0.1 * np.arange(at.size), "torque": torque, "input_angle": put_in}
    columns |= {"output_angle": out, "lost_motion": out - put_in / 100}
    data = Campaign([Run(1, "a.csv", columns)])
    leave_out_repeated(data)
    assert (len(data.runs[0]), data.findings) == (at.size, [])


@pytest.mark.parametrize("held", ["torque", "lost_motion"])
def test_a_slower_channel_is_found_beside_a_recorded_lost_motion(held: str) -> None:
    at = np.arange(1500)
    torque = 20 * np.sin(0.03 * at)
    columns = {"time": 0.01 * at, "torque": torque, "lost_motion": torque * 5e-5}
    noise = 1e-3 * np.ptp(columns[held]) * np.random.default_rng(4).normal(size=at.size)
    columns[held] = (columns[held] + noise)[at // 4 * 4]
    data = Campaign([Run(1, "a.csv", columns)])
    leave_out_repeated(data)
    assert len(data.runs[0]) == 375
    assert [f.kind for f in data.findings] == ["repeats"]
