"""The noise of the torque in the residual: its samples, and what a lag may be credited for."""

from __future__ import annotations

import numpy as np
import pytest

from lostmotion.candidates.named import named_candidates
from lostmotion.discover.contest_round import make_round
from lostmotion.discover.gates import judge
from lostmotion.discover.linearise import settle
from lostmotion.discover.measurement_noise import estimate_noise
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.library import library
from lostmotion.evidence.noise import Noise
from lostmotion.evidence.torque_error import relative_noise
from lostmotion.fit.baseline import BaselineModel
from lostmotion.recordings import Campaign
from lostmotion.units import ARCSEC

RUNS, ROWS, PERIOD_S = 10, 600, 0.02
RATIO, LARGEST_NM, COMPLIANCE = 100, 50.0, 8.0
"""Compliance in arc seconds per N m."""


def looped(torque_noise_Nm: float, lag_samples: int = 0) -> BaselineModel:
    """Fit loops of springs and a Coulomb slider, computed here, whose torque has noise."""
    rng = np.random.default_rng(7)
    columns: dict[str, list[np.ndarray]] = {}
    for number in range(RUNS):
        amplitude = LARGEST_NM * (0.4 + 0.6 * number / (RUNS - 1))
        cycles = np.arange(ROWS + lag_samples) / 200.0
        torque = amplitude * np.sin(2.0 * np.pi * cycles)
        angle, state = np.empty(torque.size), 0.0
        for row, value in enumerate(torque):
            state = min(max(state, value - 3.0), value + 3.0)
            angle[row] = COMPLIANCE * (0.6 * value + 0.4 * state)
        angle += 0.5 * rng.normal(size=angle.size)
        read = torque + torque_noise_Nm * rng.normal(size=torque.size)
        run = {
            "run": np.full(ROWS, number),
            "time_s": PERIOD_S * np.arange(ROWS),
            "torque_Nm": read[: read.size - lag_samples],
            "lost_motion_rad": angle[lag_samples:] * ARCSEC,
        }
        for name, values in run.items():
            columns.setdefault(name, []).append(values)
    table = {name: np.concatenate(values) for name, values in columns.items()}
    base = BaselineModel(Conditions(Campaign.from_table(table)), LARGEST_NM)
    base.first_fit()
    return base


def gain_of_lag(base: BaselineModel) -> float:
    """Gain of a lag of the torque, nats; it is zero if the data do not have one."""
    lag = {"sensor_lag": library()["sensor_lag"]}
    candidates, _ = named_candidates(lag, base, base.at(), RATIO)
    noise = estimate_noise(base, [one.columns for one in candidates])
    current = make_round(settle(base, noise), candidates, {})
    result = judge(current, "sensor_lag")
    return 0.0 if result is None else result.gain


def test_a_lag_is_not_credited_for_smoothing_the_noise_of_the_torque():
    # This noise is 0.8 arc seconds of the angle; the mean of two samples would halve its square.
    assert gain_of_lag(looped(torque_noise_Nm=0.1)) < 10.0
    assert gain_of_lag(looped(torque_noise_Nm=0.1, lag_samples=1)) > 50.0


@pytest.mark.parametrize("error_Nm", [0.02, 0.05, 0.15])
def test_the_error_of_the_torque_is_found_where_a_gap_closes(error_Nm):
    rng = np.random.default_rng(3)
    slope = np.where(np.arange(20000) % 40 == 0, 100.0, 5.0)
    residual = rng.normal(size=slope.size) + slope * error_Nm * rng.normal(size=slope.size)
    relative = relative_noise(residual, lambda error: slope * error, 50.0)
    true = np.sqrt(1.0 + (slope * error_Nm) ** 2)
    assert relative is not None
    for steep in (False, True):
        own = (slope > 50.0) == steep
        spread = float(np.std(residual[own] / relative[own]))
        assert spread == pytest.approx(float(np.std(residual / relative)), rel=0.15)
    ratio = float(relative[slope > 50.0][0] / relative[slope < 50.0][0])
    assert ratio == pytest.approx(float(true.max() / true.min()), rel=0.2)


def test_equal_noise_has_no_error_of_the_torque():
    rng = np.random.default_rng(4)
    slope = np.where(np.arange(20000) % 40 == 0, 100.0, 5.0)
    assert relative_noise(rng.normal(size=slope.size), lambda error: slope * error, 50.0) is None
    assert relative_noise(np.zeros(100), lambda error: slope[:100] * error, 50.0) is None


def test_whitening_divides_each_sample_by_its_own_deviation():
    rng = np.random.default_rng(5)
    starts = np.array([0, 300, 700])
    relative = [np.exp(rng.normal(size=rows)) for rows in np.diff(starts)]
    noise = Noise([np.array([0.5, -0.2]), np.array([0.3])], np.array([2.0, 3.0]), relative)
    values = rng.normal(size=(700, 3))
    each = [noise.whiten(values[a:b], run) for run, (a, b) in enumerate([(0, 300), (300, 700)])]
    by_hand = values[300:] / relative[1][:, None]
    by_hand = (by_hand[2:] - 0.3 * by_hand[1:-1]) / 3.0
    np.testing.assert_allclose(each[1], by_hand, rtol=1e-12, atol=1e-12)
    for column in range(3):
        white, _ = noise.whiten_runs(values[:, column], starts)
        np.testing.assert_allclose(white, np.concatenate(each)[:, column], rtol=1e-9, atol=1e-12)


def test_the_response_to_a_step_is_the_whitened_step():
    rng = np.random.default_rng(6)
    rows, phi = 60, np.array([0.5, -0.2, 0.1])
    noise = Noise([phi], np.array([2.0]), [np.exp(rng.normal(size=rows))])
    left = rows - noise.lags
    responses = noise.step_responses(0, left)
    for begin in (noise.lags, 20, rows - 2):
        white = noise.whiten((np.arange(rows) >= begin).astype(float), 0)
        row = np.arange(left)
        since = row + noise.lags - begin
        own = np.select(
            [since == back for back in range(phi.size)], responses[: phi.size], responses[-1]
        )
        np.testing.assert_allclose(white, np.where(since >= 0, own, 0.0), atol=1e-12)
