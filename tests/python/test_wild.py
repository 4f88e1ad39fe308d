"""Outliers are set aside and reported in every column; real motion is never reported."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from conftest import DATA
from lostmotion.recordings import Campaign, Run, read_campaign, say_findings
from lostmotion.recordings.bursts import bursts
from lostmotion.recordings.frozen import frozen_rows
from lostmotion.recordings.wild import set_wild_aside
from lostmotion.units import ARCSEC

CLEAN = 400
"""Clean recordings of every kind together."""


def loops(rows: int, samples: float, shape: str, rng: np.random.Generator) -> np.ndarray:
    """Torque of loops with a number of samples each."""
    phase = np.arange(rows) / samples + rng.uniform(0, 1)
    if shape == "sine":
        return 40 * np.sin(2 * np.pi * phase)
    if shape == "triangle":
        return 40 * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * phase))
    if shape == "steps":
        return 40 * np.round(2 * np.sin(2 * np.pi * phase)) / 2
    if shape == "pulses":
        return 40.0 * (np.mod(phase, 1.0) < 3 / samples) + 5
    return np.full(rows, 12.0)


def wound(torque: np.ndarray, play_Nm: float) -> np.ndarray:
    """Lost motion of a stiffening spring with friction, arc seconds."""
    behind = torque.copy()
    state = 0.0
    for i, load in enumerate(torque):
        state = min(max(state, load - play_Nm), load + play_Nm)
        behind[i] = state
    return 5 * behind + 60 * np.tanh(behind / 4)


def clean(seed: int) -> Campaign:
    """Make a recording of a kind without outliers."""
    rng = np.random.default_rng(seed)
    shape = ("sine", "triangle", "steps", "pulses", "hold")[seed % 5]
    # A plan of pulses repeats them: for a single one nothing shows that the drive followed it.
    samples = float(rng.choice([8, 36] if shape == "pulses" else [5, 8, 36, 100, 1000]))
    rows = int(rng.choice([300, 2000] if shape == "pulses" else [60, 300, 2000]))
    runs = []
    event = ("none", "slip", "zero", "stick", "quantised", "creep")[seed // 5 % 6]
    for label in range(int(rng.integers(1, 5))):
        torque = loops(rows, samples, shape, rng)
        lost = wound(torque, rng.uniform(0, 6))
        if event in ("slip", "zero"):
            lost[rng.integers(8, rows - 8) :] += {"slip": 6000.0, "zero": 80.0}[event]
        if event == "stick":
            lost += 30 * np.floor(np.cumsum(rng.random(rows)) / 20)
        if event == "creep":
            lost += 20 * (1 - np.exp(-np.arange(rows) / 30))
        lost += rng.choice([0.0, 0.3, 3.0]) * rng.normal(size=rows)
        torque = torque + rng.choice([0.0, 0.01, 0.3]) * rng.normal(size=rows)
        if event == "quantised":
            count = 2 * np.pi / 2**14 / ARCSEC
            lost, torque = count * np.round(lost / count), 0.25 * np.round(torque / 0.25)
        warm = 23 + 0.5 * np.round(2 * np.arange(rows) / rows * rng.uniform(0, 8)) + label
        columns = {
            "time": np.arange(rows) * 0.02,
            "torque": torque,
            "lost_motion": lost * ARCSEC,
            "temperature": warm,
            "cycles": np.full(rows, 1e4 * label),
            "direction": np.sign(np.gradient(torque)),
        }
        runs.append(Run(label, "clean.csv", columns))
    return Campaign(runs)


def test_real_motion_is_never_an_outlier() -> None:
    wrong = []
    for seed in range(CLEAN):
        data = clean(seed)
        set_wild_aside(data)
        wrong += [f"seed {seed}: {finding}" for finding in say_findings(data.findings)]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("name", ["joint/joint.csv.gz"])
def test_the_campaign_of_the_demo_has_no_wild_value(name: str) -> None:
    assert read_campaign(DATA / name, ratio=100).findings == []


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("torque", lambda x: 0.0),
        ("torque", lambda x: 655.35),
        ("torque", lambda x: -x),
        ("lost_motion", lambda x: 0.01),
        ("lost_motion", lambda x: x + 150 * ARCSEC),
        ("temperature", lambda x: 85.0),
        ("temperature", lambda x: -127.0),
        ("cycles", lambda x: 0.0),
        ("time", lambda x: 0.0),
    ],
)
@pytest.mark.parametrize("samples", [36, 100, 1000])
@pytest.mark.parametrize("burst", [1, 3])
def test_a_wild_value_is_named_by_column_run_and_second(
    name: str, value: Callable[[float], float], samples: int, burst: int
) -> None:
    rng = np.random.default_rng(1)
    runs = []
    for label in range(1, 4):
        torque = loops(1200, samples, "sine", rng)
        lost = wound(torque, 2.0) + 0.5 * rng.normal(size=1200)
        columns = {
            "time": 5 + np.arange(1200) * 0.02,
            "torque": torque + 0.01 * rng.normal(size=1200),
            "lost_motion": lost * ARCSEC,
            "temperature": 23 + 0.5 * np.round(2 * np.arange(1200) / 600),
            "cycles": np.full(1200, 1e4 * label),
        }
        runs.append(Run(label, "a.csv", columns))
    data = Campaign(runs)
    at = 600 + int(np.argmax(runs[1].torque_Nm[600:700]))
    column = runs[1].columns[name]
    seconds = runs[1].time_s[at : at + burst].copy()
    column[at : at + burst] = [value(float(x)) for x in column[at : at + burst]]
    before = [{name: x.copy() for name, x in run.columns.items()} for run in runs]
    set_wild_aside(data)
    (finding,) = data.findings
    assert (finding.kind, finding.run, finding.count) == ("wild", 2, burst)
    assert finding.column.startswith(name)
    if name != "time":
        np.testing.assert_array_equal(finding.seconds, seconds)
        assert f"(run 2 at {seconds[0]:.6g}" in str(finding)
    if name in ("temperature", "cycles"):
        unknown = np.flatnonzero(np.isnan(runs[1].columns[name]))
        np.testing.assert_array_equal(unknown, np.arange(at, at + burst))
    else:
        for key, values in runs[1].columns.items():
            kept = np.delete(before[1][key], np.arange(at, at + burst))
            np.testing.assert_array_equal(values, kept)
    for k in (0, 2):
        for key, values in runs[k].columns.items():
            np.testing.assert_array_equal(values, before[k][key])


@pytest.mark.parametrize(
    ("name", "value"), [("torque", 655.35), ("lost_motion", 0.01), ("temperature", -127.0)]
)
@pytest.mark.parametrize("samples", [5, 8])
def test_wild_values_are_found_at_a_few_samples_a_loop(
    name: str, value: float, samples: int
) -> None:
    rng = np.random.default_rng(4)
    torque = loops(600, samples, "sine", rng)
    columns = {
        "time": np.arange(600) * 0.02,
        "torque": torque + 0.01 * rng.normal(size=600),
        "lost_motion": (wound(torque, 2.0) + 0.5 * rng.normal(size=600)) * ARCSEC,
        "temperature": np.full(600, 23.0),
    }
    columns[name][333] = value
    data = Campaign([Run(1, "a.csv", columns)])
    set_wild_aside(data)
    (finding,) = data.findings
    assert (finding.column.startswith(name), finding.count) == (True, 1)
    assert finding.seconds == (pytest.approx(333 * 0.02),)


@pytest.mark.parametrize(
    ("name", "value", "aside"),
    [("temperature", 85.0, 40), ("cycles", 65535.0, 40), ("axial_force", 500.0, 0)],
)
def test_what_cannot_jump_is_set_aside_however_long_it_is_away(
    name: str, value: float, aside: int
) -> None:
    rng = np.random.default_rng(6)
    torque = loops(900, 100, "sine", rng)
    columns = {
        "time": np.arange(900) * 0.1,
        "torque": torque,
        "lost_motion": (wound(torque, 1.0) + 0.3 * rng.normal(size=900)) * ARCSEC,
        "temperature": np.round(23 + 0.004 * np.arange(900), 1),
        "cycles": np.floor(1e4 + 0.01 * np.arange(900)),
        "axial_force": np.zeros(900),
    }
    columns[name][300:340] = value
    data = Campaign([Run(1, "a.csv", columns)])
    set_wild_aside(data)
    unknown = np.flatnonzero(np.isnan(data.runs[0].columns[name]))
    np.testing.assert_array_equal(unknown, np.arange(300, 300 + aside))
    assert sum(finding.count for finding in data.findings) == aside


def test_a_single_torque_that_came_late_is_set_aside() -> None:
    rng = np.random.default_rng(7)
    torque = loops(400, 40, "triangle", rng) + 0.002 * rng.normal(size=400)
    lost = (wound(torque, 2.0) + 0.3 * rng.normal(size=400)) * ARCSEC
    columns = {"torque": torque, "lost_motion": lost}
    assert not frozen_rows(columns, None)
    torque[215] = torque[214]
    (found,) = frozen_rows(columns, None).items()
    assert (found[0], np.flatnonzero(found[1]).tolist()) == ("torque", [215])
    torque[100::4] = torque[99:-1:4]  # now with a slower sensor
    assert not frozen_rows(columns, None)


def test_several_wild_values_close_together_are_all_set_aside() -> None:
    rng = np.random.default_rng(2)
    x = np.sin(np.arange(800) / 40) + 0.01 * rng.normal(size=800)
    wild = [0, 100, 105, 110, 400, 401, 402, 799]
    x[wild] = (9, 5, -7, 300, 2, 2.5, 2.2, -8)
    np.testing.assert_array_equal(np.flatnonzero(bursts(x)), wild)


def test_a_load_that_really_jumps_stays_where_the_lost_motion_follows() -> None:
    rng = np.random.default_rng(3)
    torque = loops(900, 300, "sine", rng)
    torque[450:452] += 25
    lost = wound(torque, 1.0) + 0.3 * rng.normal(size=900)
    columns = {"time": np.arange(900) * 0.1, "torque": torque, "lost_motion": lost * ARCSEC}
    data = Campaign([Run(1, "a.csv", columns)])
    set_wild_aside(data)
    assert data.findings == []


@pytest.mark.parametrize("samples", [8, 36, 100])
@pytest.mark.parametrize(
    ("name", "value"), [("torque", 655.35), ("torque", -1024.0), ("lost_motion", 0.05)]
)
def test_full_scale_for_twenty_samples_is_set_aside(name: str, value: float, samples: int) -> None:
    rng = np.random.default_rng(5)
    runs = []
    for label in range(3):
        torque = loops(400, samples, "sine", rng)
        columns = {
            "time": np.arange(400) * 0.02,
            "torque": torque + 0.01 * rng.normal(size=400),
            "lost_motion": (wound(torque, 2.0) + 0.5 * rng.normal(size=400)) * ARCSEC,
        }
        runs.append(Run(label, "a.csv", columns))
    runs[1].columns[name][200:220] = value
    data = Campaign(runs)
    set_wild_aside(data)
    assert [len(run) for run in data.runs] == [400, 380, 400]
    (finding,) = data.findings
    assert (finding.column.startswith(name), finding.run, finding.count) == (True, 1, 20)
