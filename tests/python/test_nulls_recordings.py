"""Sound recordings have hardly any findings before any effect is tested."""

from __future__ import annotations

import numpy as np
import pytest
from nulls import most
from scipy import stats
from scipy.signal import lfilter

from lostmotion import rules
from lostmotion.discover.events import scan_run
from lostmotion.discover.outliers import clean_outliers
from lostmotion.discover.recording_check import check
from lostmotion.effects.conditions import Conditions
from lostmotion.evidence.noise import Noise, fit_noise
from lostmotion.fit.baseline import BaselineModel
from lostmotion.recordings import Campaign, Run
from lostmotion.recordings.encoders import unwrap
from lostmotion.recordings.soundness import check_sign, longest_stuck, steps_of_disorder

ARCSEC = np.pi / 180 / 3600


def triangle(rows: int) -> np.ndarray:
    """Two cycles of torque."""
    return 40 * 2 / np.pi * np.arcsin(np.sin(4 * np.pi * np.arange(rows) / rows))


def campaign(rng: np.random.Generator, runs: int = 8, rows: int = 600, **columns) -> Campaign:
    """Loops of a spring with white noise; more columns as functions of the run's number."""
    made = []
    for r in range(runs):
        torque = triangle(rows)
        angle = 20 * torque + 1.5 * rng.normal(size=rows)
        more = {name: np.full(rows, float(of(r))) for name, of in columns.items()}
        made.append(
            Run(
                r + 1,
                "made.csv",
                {
                    "time": np.arange(rows) * 0.05,
                    "torque": torque + 0.01 * rng.normal(size=rows),
                    "lost_motion": angle * ARCSEC,
                    **more,
                },
            )
        )
    return Campaign(made)


def test_columns_that_have_nothing_to_do_with_each_other_are_seldom_called_aliased() -> None:
    # With 8 runs the rank correlation of independent columns passes 0.9 in 0.5 % of plans a pair;
    # temperature, cycles and the order of the runs make three.
    trials, alarms = 150, 0
    rng = np.random.default_rng(1)
    for _ in range(trials):
        temperature, cycles = rng.permutation(8) * 5.0, rng.permutation(8) * 1e4
        data = campaign(
            rng,
            rows=20,
            temperature=lambda r, t=temperature: t[r],
            cycles=lambda r, c=cycles: c[r],
        )
        pairs = [set(pair["columns"]) for pair in check(data, {})["aliased"]]
        alarms += any(pair <= {"temperature_C", "cycles", "order of the runs"} for pair in pairs)
    assert alarms <= most(trials, 0.015)


def test_a_column_that_moves_in_one_run_only_does_not_rise_with_the_order_of_the_runs() -> None:
    rng = np.random.default_rng(2)
    data = campaign(rng, rows=20, cycles=lambda r: 1e5 * (r == 7), temperature=lambda _: 20.0)
    pairs = [set(pair["columns"]) for pair in check(data, {})["aliased"]]
    assert {"cycles", "order of the runs"} not in pairs


def test_sound_recordings_have_no_findings() -> None:
    rng = np.random.default_rng(3)
    data = campaign(rng)
    check_sign(data)
    assert check(data, {})["sound"]


@pytest.mark.parametrize("count", [0.3, 3.0])
def test_an_encoder_with_coarse_counts_is_not_called_stuck(count: float) -> None:
    rng = np.random.default_rng(4)
    for _ in range(50):
        torque = triangle(1200)
        angle = count * np.round((20 * torque + 1.5 * rng.normal(size=1200)) / count)
        assert longest_stuck(angle, torque) == 0
        assert longest_stuck(torque, angle) == 0


def test_noise_about_the_seam_is_no_turn_and_quick_steps_are_no_wrap() -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        angle = np.cumsum(rng.normal(0, 0.3, 1000))
        kept, wraps = unwrap(angle)
        assert wraps == 0
        assert kept is angle


@pytest.mark.parametrize("colour", [0.0, 0.8])
def test_noise_holds_no_outliers(colour: float) -> None:
    # Seven deviations off the median of four neighbours: less than one in 1e8 samples.
    rng = np.random.default_rng(6)
    alarms = 0
    for _ in range(8):
        data = campaign(rng, runs=6, rows=1500)
        for run in data.runs:
            noise = lfilter([1.0], [1.0, -colour], rng.normal(size=1500))
            run.columns["lost_motion"] = (20 * run.columns["torque"] + noise) * ARCSEC
        base = BaselineModel(Conditions(data), 40.0)
        base.first_fit()
        alarms += clean_outliers(base)
    assert alarms == 0


@pytest.mark.parametrize("colour", [0.0, 0.5, 0.85])
def test_p_of_a_step_is_what_it_states_where_there_is_none(colour: float) -> None:
    trials, rows = 200, 800
    rng = np.random.default_rng(7)
    base = BaselineModel(Conditions(campaign(rng, runs=1, rows=rows)), 40.0)
    x = np.linspace(-1, 1, rows)
    columns = np.column_stack((np.ones(rows), x, np.tanh(9 * x)))
    noise = Noise([np.array([colour])] if colour else [np.zeros(0)], np.array([2.0]))
    scores = []
    for _ in range(trials):
        y = lfilter([1.0], [1.0, -colour], 2.0 * rng.normal(size=rows + 200))[200:]
        scores.append(scan_run(base, noise, 0, columns, y).score)
    p = np.minimum(1.0, 2 * stats.norm.sf(scores) * rows)
    assert np.count_nonzero(p <= 0.05) <= most(trials, 0.05)
    assert max(scores) < rules.SUDDEN_LEAST


def wild_run(step: float) -> tuple[BaselineModel, Noise, np.ndarray, np.ndarray]:
    """Return a short run with a ramp and a plateau, wild samples on the ramp and at the end."""
    rng = np.random.default_rng(9)
    rows = 600
    base = BaselineModel(Conditions(campaign(rng, runs=1, rows=rows)), 40.0)
    load = np.minimum(np.arange(rows) / 40, 1.0)
    columns = np.column_stack((np.ones(rows), load, load**2))
    y = 1.5 * rng.normal(size=rows)
    y[[12, 21, rows - 1]] += (45.0, -40.0, 40.0)
    y[400:] += step
    return base, Noise([np.zeros(0)], np.array([1.5])), columns, y


def test_wild_samples_are_no_step_and_hide_none() -> None:
    base, noise, columns, y = wild_run(0.0)
    assert scan_run(base, noise, 0, columns, y).score < rules.SUDDEN_LEAST
    base, noise, columns, y = wild_run(4.0)
    found = scan_run(base, noise, 0, columns, y)
    assert abs(found.row - 400) <= 2
    assert found.size_arcsec == pytest.approx(4.0, abs=0.5)


def test_wild_samples_at_the_ends_of_a_run_are_set_right() -> None:
    rng = np.random.default_rng(10)
    data = campaign(rng, runs=6, rows=1500)
    for run in data.runs:
        angle = 20 * run.columns["torque"] + rng.normal(size=1500)
        angle[[0, 1, 1499]] += (40, -40, 40)
        run.columns["lost_motion"] = angle * ARCSEC
    base = BaselineModel(Conditions(data), 40.0)
    base.first_fit()
    assert clean_outliers(base) == 18


def test_noise_that_stays_is_followed_by_its_model() -> None:
    rng = np.random.default_rng(8)
    for colour in (0.0, 0.5, 0.85):
        for _ in range(20):
            x = lfilter([1.0], [1.0, -colour], rng.normal(size=4000))
            noise = fit_noise(x, np.arange(4000) * 0.05, np.array([0, 4000]), 0)
            assert noise.phi[0].sum() == pytest.approx(colour, abs=0.15)
            assert noise.phi[0].sum() < rules.PERSISTENCE_MAX


STAMPS_S = 0.5 * np.arange(60)


@pytest.mark.parametrize("fault", ["none", "three stamps twice", "one stamp far away"])
def test_rows_in_no_order_are_sorted_in_spite_of_a_wrong_stamp(fault: str) -> None:
    """In 60 rows one wrong stamp makes more irregular steps than a regular clock has."""
    rng = np.random.default_rng(7)
    for _ in range(200):
        time_s = STAMPS_S.copy()
        if fault == "three stamps twice":
            time_s[[10, 30, 50]] = time_s[[9, 29, 49]]
        if fault == "one stamp far away":
            time_s[20] = 1e6
        assert steps_of_disorder(rng.permutation(time_s), scrambled=False) > 0


@pytest.mark.parametrize("clock", ["jitters by two steps", "set back by a step", "wraps"])
def test_a_clock_that_goes_back_leaves_the_rows_in_file_order(clock: str) -> None:
    """The rows of a bad clock are in order, however often its stamps decrease."""
    rng = np.random.default_rng(8)
    for _ in range(200):
        time_s = STAMPS_S + 0.005 * rng.normal(size=STAMPS_S.size)
        if clock == "jitters by two steps":
            time_s = STAMPS_S + rng.normal(size=STAMPS_S.size)
        if clock == "set back by a step":
            time_s -= 0.75 * np.cumsum(np.arange(STAMPS_S.size) % 5 == 4)
        if clock == "wraps":
            time_s %= 4.0
        assert steps_of_disorder(time_s, scrambled=False) == 0


@pytest.mark.filterwarnings("error")
def test_a_clock_without_a_step_forward_has_no_order_to_restore() -> None:
    assert steps_of_disorder(np.repeat(STAMPS_S[::-1], 2), scrambled=False) == 0
