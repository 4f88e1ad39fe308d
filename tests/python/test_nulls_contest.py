"""The contest without a missing effect: every p, every gate, and the stated error rates."""

from __future__ import annotations

import numpy as np
import pytest
from nulls import fewest, most, ramps, white
from scipy import stats
from scipy.signal import lfilter

from lostmotion.discover.gates import (
    accepted,
    deviations_least,
    paired_t,
    runs_separate,
    signed_rank,
)
from lostmotion.evidence.contest import Contest
from lostmotion.evidence.gram import Evidence, gather
from lostmotion.evidence.noise import fit_noise

RUNS, ROWS, SCATTER, COLOUR = 14, 100, 0.5, 0.7
CANDIDATES = 16


def made(seed: int, *, coloured: bool = False, size: float = 0.0) -> Evidence:
    """Runs whose slope and zero scatter; candidates that vary within runs, and from run to run."""
    rng = np.random.default_rng(seed)
    x, starts, run_of = ramps(RUNS, ROWS)
    columns = np.column_stack((x, np.ones(x.size)))
    blocks = []
    for k in range(CANDIDATES):
        level = rng.normal(size=(RUNS, 2))
        wave = np.sin((k + 2) * x + rng.uniform(0, 6, RUNS)[run_of])
        between, within = x * level[run_of, 0], wave * level[run_of, 1]
        blocks.append((f"{k}", [between[:, None], within[:, None]][k % 2]))
    own = SCATTER * rng.normal(size=(RUNS, 2))
    noise = rng.normal(size=(RUNS, ROWS))
    model = white(RUNS)
    if coloured:
        noise = lfilter([1.0], [1.0, -COLOUR], noise, axis=1)
        model = fit_noise(noise.ravel(), np.tile(np.arange(ROWS) * 0.1, RUNS), starts, 0)
    y = 3 * x + np.einsum("nk,nk->n", columns, own[run_of]) + noise.ravel()
    y += size * blocks[0][1][:, 0]
    return gather(columns, np.zeros(2), columns, blocks, y, model, starts)


@pytest.fixture(scope="module")
def judged():
    """All candidates of many sets of evidence without any effect."""
    return [
        [contest.test(f"{k}") for k in range(CANDIDATES)]
        for contest in (Contest(made(seed)) for seed in range(40))
    ]


def test_p_of_the_f_test_is_what_it_states_and_not_far_more_careful(judged) -> None:
    p = np.array([result.p for row in judged for result in row])
    # The candidates of one set share its noise: a bound for fewer trials than candidates.
    for level in (0.01, 0.05, 0.2):
        assert np.count_nonzero(p <= level) / p.size <= most(200, level) / 200
    assert np.count_nonzero(p <= 0.2) / p.size >= fewest(200, 0.2) / 200


def test_p_of_the_sign_flips_is_what_it_states(judged) -> None:
    p = np.array([result.flip_p for row in judged for result in row])
    for level in (0.05, 0.2):
        assert np.count_nonzero(p <= level) / p.size <= most(200, level) / 200


def test_all_gates_together_keep_five_percent_over_all_candidates(judged) -> None:
    # Bonferroni over the candidates: one set of evidence is one trial.
    alarms = sum(any(accepted(result, CANDIDATES) for result in row) for row in judged)
    assert alarms <= most(40, 0.05)


def test_coloured_noise_is_not_named_as_an_effect() -> None:
    alarms, trials = 0, 40
    for seed in range(100, 100 + trials):
        contest = Contest(made(seed, coloured=True))
        p = [contest.test(name).p for name in ("0", "1")]
        alarms += min(p) * 2 <= 0.05
    assert alarms <= most(trials, 0.05)


def test_colour_that_is_not_whitened_would() -> None:
    # The same with white noise in the model, an error that the test above has to find.
    alarms = 0
    for seed in range(100, 120):
        rng = np.random.default_rng(seed)
        noise = lfilter([1.0], [1.0, -0.95], rng.normal(size=(RUNS, ROWS)), axis=1).ravel()
        noise /= noise.std()
        x, starts, _ = ramps(RUNS, ROWS)
        columns = np.column_stack((x, np.ones(x.size)))
        block = [("wave", np.sin(3 * x)[:, None])]
        evidence = gather(columns, np.zeros(2), columns, block, noise, white(RUNS), starts)
        alarms += Contest(evidence).test("wave").p <= 0.05
    assert alarms > most(20, 0.05)


@pytest.mark.parametrize("size", [0.0, 1.0])
def test_intervals_from_the_covariance_hold_the_truth_as_often_as_they_state(size: float) -> None:
    trials, outside = 120, 0
    for seed in range(trials):
        evidence = made(seed, size=size)
        result = Contest(evidence).test("0")
        scale = evidence.scale[evidence.blocks["0"]][0]
        error = np.sqrt(result.covariance[0, 0]) / scale
        # A between-run effect with 14 runs has no more degrees of freedom than runs.
        limit = stats.t.isf(0.025, RUNS - 3)
        outside += abs(result.coefficients[0] / scale - size) > limit * error
    assert fewest(trials, 0.05) <= outside <= most(trials, 0.05)


def test_equal_effects_are_seldom_distinguished_by_chance() -> None:
    rng = np.random.default_rng(5)
    trials = 2000
    told = sum(paired_t(*rng.normal(size=(2, RUNS))) >= deviations_least() for _ in range(trials))
    level = float(stats.t.sf(deviations_least(), RUNS - 1))
    assert fewest(trials, level) <= told <= most(trials, level)


@pytest.mark.parametrize("tail", [30, 1])
def test_signed_ranks_distinguish_equal_effects_as_seldom_as_stated(tail: int) -> None:
    rng = np.random.default_rng(6)
    trials = 4000
    pairs = rng.standard_t(tail, size=(trials, 2, RUNS))
    told = sum(signed_rank(*pair) >= deviations_least() for pair in pairs)
    # So few runs have fewer large ranks than the normal distribution has.
    assert 0 < told <= most(trials, float(stats.norm.sf(deviations_least())))


def test_signed_ranks_of_four_runs() -> None:
    # Ranks 1 to 3 ahead, 4 behind: a sum of 6 where 5 is the mean, with variance 4 x 5 x 9 / 24.
    behind = np.zeros(4)
    assert signed_rank(np.array([1.0, 2.0, 3.0, -4.0]), behind) == pytest.approx(1 / np.sqrt(7.5))
    assert signed_rank(behind, behind) == 0.0


def test_a_dominant_run_does_not_hide_the_evidence_of_the_others() -> None:
    ahead = np.abs(np.random.default_rng(8).normal(size=RUNS)) + 0.1
    ahead[3] = 1000.0
    assert paired_t(ahead, np.zeros(RUNS)) < deviations_least()
    assert runs_separate(ahead, np.zeros(RUNS))
    assert not runs_separate(np.zeros(RUNS), ahead)
    assert not runs_separate(np.where(np.arange(RUNS) == 3, 1000.0, 0.0), np.zeros(RUNS))
