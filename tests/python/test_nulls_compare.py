"""`compare` with a complete model: no quantity is called significant too often."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from nulls import most
from scipy.signal import lfilter

from lostmotion.compare.chance import variance_explained
from lostmotion.compare.failures import where_it_fails
from lostmotion.compare.repeatability import repeatability_of
from lostmotion.effects.conditions import Conditions
from lostmotion.recordings import Campaign, Run

TRIALS = 60


def conditions(runs: int, rows: int = 200) -> Conditions:
    """Runs of three amplitudes over temperatures, cycles and angles."""
    rng = np.random.default_rng(1)
    t = np.arange(rows) * 0.1
    made = []
    for r in range(runs):
        torque = 40 * (0.4, 0.7, 1.0)[r % 3] * np.sin(2 * np.pi * t / 10) + 0.01 * rng.normal(
            size=rows
        )
        made.append(
            Run(
                r + 1,
                "made.csv",
                {
                    "time": t,
                    "torque": torque,
                    "lost_motion": torque * 1e-4,
                    "temperature": np.full(rows, rng.uniform(10, 45)),
                    "cycles": np.full(rows, 1e4 * rng.integers(0, 9)),
                    "input_angle": 0.2 * r + 3.0 * t,
                    "output_angle": 0.002 * r + 0.03 * t,
                },
            )
        )
    return Conditions(Campaign(made))


def left(c: Conditions, rng: np.random.Generator, colour: float, scatter: float) -> np.ndarray:
    """Residual of noise after a fit: each run about its zero, with scatter of the slope."""
    parts = []
    for at in c.slices():
        noise = lfilter([1.0], [1.0, -colour], rng.normal(size=at.stop - at.start + 50))[50:]
        parts.append(noise + scatter * rng.normal() * c.torque[at] / 40)
    residual = np.concatenate(parts)
    return residual - c.run_mean(residual)[c.run_of]


@pytest.mark.parametrize(("colour", "scatter"), [(0.0, 0.0), (0.8, 0.0), (0.5, 1.0)])
def test_no_covariate_is_significant_more_often_than_its_p_states(
    colour: float, scatter: float
) -> None:
    c = conditions(12)
    rng = np.random.default_rng(2)
    alarms: Counter[str] = Counter()
    for trial in range(TRIALS):
        for failure in where_it_fails(c, left(c, rng, colour, scatter), trial):
            # Runs whose slopes scatter do differ: `run` has to report this.
            if failure.covariate != "run" or scatter == 0:
                alarms[failure.covariate] += failure.p <= 0.05
    assert len(alarms) >= 10
    assert max(alarms.values()) <= most(TRIALS, 0.05), alarms


@pytest.mark.parametrize("shift", [0.0, 100.0])
def test_a_zero_and_a_misfit_that_all_runs_share_are_no_difference_between_runs(
    shift: float,
) -> None:
    # Runs of three amplitudes contain three parts of one misfit, each about another mean.
    c = conditions(12)
    rng = np.random.default_rng(6)
    zeros = shift * rng.normal(size=12)[c.run_of]
    shared = 5.0 * (c.torque > 20) + zeros
    shared -= c.run_mean(shared)[c.run_of]
    alarms, found = 0, 0
    for trial in range(TRIALS):
        for scatter in (0.0, 1.5)[: 1 + (trial < 10)]:
            noise = left(c, rng, 0.5, scatter)
            failures = where_it_fails(c, shared + noise, trial)
            run = next(failure for failure in failures if failure.covariate == "run")
            if scatter:
                found += run.p <= 0.05
            else:
                alarms += run.p <= 0.05
                assert run.share < 0.02
    assert alarms <= most(TRIALS, 0.05)
    assert found == 10


def test_a_between_run_covariate_keeps_its_level_in_few_runs() -> None:
    # All signs of eight runs, not a sample of them.
    rng = np.random.default_rng(3)
    trials, alarms = 300, 0
    blocks = np.repeat(np.arange(8), 40).astype(np.intp)
    cells = np.tile(np.repeat(np.arange(2), 20), 8).astype(np.intp)
    for _ in range(trials):
        covariate = np.repeat(rng.normal(size=8), 40)
        slopes = np.repeat(rng.normal(size=8), 40) * np.tile(np.linspace(-1, 1, 40), 8)
        _, p = variance_explained(slopes + rng.normal(size=320), cells, blocks, rng, covariate)
        alarms += p <= 0.05
    assert alarms <= most(trials, 0.05)


def test_rows_that_count_as_independent_would_cry_wolf() -> None:
    # The same residual with a block for every row, which shows why whole blocks are needed.
    rng = np.random.default_rng(4)
    alarms = 0
    for _ in range(40):
        residual = lfilter([1.0], [1.0, -0.95], rng.normal(size=400))
        cells = (np.arange(400) // 50).astype(np.intp)
        _, p = variance_explained(residual, cells, np.arange(400), rng)
        alarms += p <= 0.05
    assert alarms > most(40, 0.05)


def test_the_noise_floor_of_nothing_but_noise_is_the_noise() -> None:
    c = conditions(12)
    rng = np.random.default_rng(5)
    floors = [repeatability_of(c, rng.normal(size=c.rows)).floor_rad for _ in range(20)]
    # The largest hundredth is left out: 4 % less.
    assert np.mean(floors) == pytest.approx(1.0, abs=0.06)
