"""Runs that contradict the others: an arm with an eccentric output, with and without a fault."""

from __future__ import annotations

import math
import re
from itertools import pairwise

import numpy as np
import pytest

from lostmotion.errors import InputError
from lostmotion.recordings import read_campaign

STIFFNESS_NM_PER_RAD = 2e4
FRICTION_NM = 2.0
ARCSEC = np.pi / 180 / 3600
COLUMNS = ("torque_Nm", "lost_motion_rad")


def arm(eccentricity_arcsec: float, phase_rad: float) -> dict[str, np.ndarray]:
    """Four payloads, three moves each; the eccentricity shares the period of the gravity."""
    rng = np.random.default_rng(1)
    parts: dict[str, list[np.ndarray]] = {"run": [], "time_s": [], **{key: [] for key in COLUMNS}}
    time = np.linspace(0.0, 20.0, 400)
    for payload in (3.0, 12.0, 24.0, 36.0):
        for low, high in ((0.0, np.pi), (0.2, 1.4), (-1.5, 1.5)):
            angle = low + (high - low) * (1 - np.cos(2 * np.pi * time / 20)) / 2
            torque = payload * np.cos(angle)
            held, elastic = np.zeros_like(torque), 0.0
            for i, load in enumerate(torque):
                elastic = min(max(elastic, load - FRICTION_NM), load + FRICTION_NM)
                held[i] = elastic
            lost = held / STIFFNESS_NM_PER_RAD + 5e-6 * rng.standard_normal(time.size)
            lost = lost + eccentricity_arcsec * ARCSEC * np.cos(angle + phase_rad)
            parts["run"].append(np.full(time.size, len(parts["run"]) + 1))
            for key, values in (("time_s", time), ("torque_Nm", torque), ("lost_motion_rad", lost)):
                parts[key].append(values)
    return {key: np.concatenate(values) for key, values in parts.items()}


@pytest.mark.parametrize("eccentricity_arcsec", [10.0, 60.0, 240.0])
def test_an_eccentric_output_reverses_no_sign(eccentricity_arcsec: float) -> None:
    for phase_rad in np.arange(8) * np.pi / 4:
        assert len(read_campaign(arm(eccentricity_arcsec, phase_rad)).runs) == 12


@pytest.mark.parametrize("run", [4, 5, 7, 10, 12])
@pytest.mark.parametrize("column", COLUMNS)
def test_a_run_with_a_reversed_sign_is_refused(run: int, column: str) -> None:
    for phase_rad in np.arange(4) * np.pi / 2:
        columns = arm(10.0, phase_rad)
        damaged = columns["run"] == run
        columns[column] = np.where(damaged, -columns[column], columns[column])
        with pytest.raises(InputError, match=re.escape(f"increasing torque in run {run}, unlike")):
            read_campaign(columns)


@pytest.mark.parametrize("run", [4, 7, 10])
@pytest.mark.parametrize("column", COLUMNS)
def test_a_run_of_magnitudes_is_refused(run: int, column: str) -> None:
    for phase_rad in np.arange(4) * np.pi / 2:
        columns = arm(10.0, phase_rad)
        damaged = columns["run"] == run
        columns[column] = np.where(damaged, np.abs(columns[column]), columns[column])
        with pytest.raises(InputError, match=f"{column}: .*without sign in run {run}"):
            read_campaign(columns)


def turning_arm(rng: np.random.Generator, run: int) -> dict[str, np.ndarray]:
    """Moves between random stations under gravity, with an error of position of any period."""
    ramp = np.clip(np.arange(120) / 72, 0.0, 1.0)
    smooth = ramp**3 * (10 - 15 * ramp + 6 * ramp**2)
    stations = rng.uniform(-1.2, 1.2, 6)
    angle = np.concatenate([a + (b - a) * smooth for a, b in pairwise(stations)])
    torque = rng.uniform(5.0, 40.0) * np.cos(angle)
    period = rng.choice((0.5, 1, 2, 3, 7))
    error = rng.uniform(0.0, 4e-3) * np.cos(period * angle + rng.uniform(0, 6))
    lost = torque / STIFFNESS_NM_PER_RAD + error + 5e-6 * rng.standard_normal(angle.size)
    return {
        "run": np.full(angle.size, run),
        "time_s": 0.02 * np.arange(angle.size),
        "torque_Nm": torque,
        "input_angle_rad": 100.0 * angle,
        "output_angle_rad": angle + lost,
    }


@pytest.mark.parametrize("ratio", [100.0, math.inf])
def test_an_arm_that_holds_a_weight_has_a_torque_with_its_sign(ratio: float) -> None:
    """Also without a ratio, where the output angle alone is known."""
    rng = np.random.default_rng(5)
    for _ in range(50):
        parts = [turning_arm(rng, run) for run in range(3)]
        columns = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
        assert len(read_campaign(columns, ratio=ratio).runs) == 3
