"""The statistical routines of discovery on data with a known truth: nulls and recoveries."""

from __future__ import annotations

import numpy as np
import pytest
from nulls import ramps, white
from scipy import stats
from scipy.signal import lfilter

from lostmotion.discover.detectable import noncentrality
from lostmotion.evidence.contest import Contest
from lostmotion.evidence.gram import gather
from lostmotion.evidence.noise import Noise, autoregression, fit_noise, rate_groups, variance_of
from lostmotion.evidence.scatter import LOG_OMEGA, RestrictedLikelihood, without_scatter

RUNS, ROWS = 14, 120


def data(seed: int, *, scatter: float = 0.5, effect: float = 0.0):
    """Linear data: two fixed columns, a slope that scatters, and a candidate that varies by run."""
    rng = np.random.default_rng(seed)
    x, starts, run_of = ramps(RUNS, ROWS)
    fixed = np.column_stack((x, np.ones(x.size)))
    random = np.column_stack((x, np.ones(x.size)))
    between = np.repeat(rng.normal(size=RUNS), ROWS)
    blocks = [
        ("between", (x * between)[:, None]),
        ("within", np.sin(9 * x + run_of)[:, None]),
    ]
    own = scatter * rng.normal(size=(RUNS, 2))
    y = 3 * x + np.einsum("nk,nk->n", random, own[run_of]) + rng.normal(size=x.size)
    y += effect * blocks[0][1][:, 0]
    return gather(fixed, np.zeros(2), random, blocks, y, white(RUNS), starts)


@pytest.mark.parametrize("block", ["between", "within"])
def test_f_test_keeps_its_level_when_runs_scatter(block):
    # 120 data sets without an effect: at 5 %, 14 or more have a chance of 0.3 % (binomial).
    p = [Contest(data(seed)).test(block).p for seed in range(120)]
    assert np.count_nonzero(np.array(p) < 0.05) < 14


def test_without_scatter_in_the_model_the_same_test_cries_wolf():
    wrong = 0
    for seed in range(40):
        contest = Contest(data(seed))
        contest.null_omega = np.full(2, 1e-12)
        result = contest.test("between", refit_scatter=False)
        wrong += result.p < 0.05
    assert wrong > 10


def test_sign_flips_keep_their_level_and_count_the_true_pattern():
    p = np.array([Contest(data(seed)).test("between").flip_p for seed in range(100)])
    assert np.count_nonzero(p <= 0.05) < 13  # binomial(100, 0.05): 0.15 % beyond
    assert p.min() >= 1 / 4096


def test_leave_one_run_out_gain_is_negative_on_average_without_an_effect():
    gains = [Contest(data(seed)).test("between").gain for seed in range(50)]
    assert np.mean(gains) < 0


def test_an_effect_between_runs_is_found_and_estimated():
    for seed in range(5):
        evidence = data(seed, effect=2.0)
        result = Contest(evidence).test("between")
        assert result.p < 1e-3
        assert result.gain > 2
        size = result.coefficients[0] / evidence.scale[evidence.blocks["between"]][0]
        error = np.sqrt(result.covariance[0, 0]) / evidence.scale[evidence.blocks["between"]][0]
        assert abs(size - 2.0) < 4 * error


def test_reml_recovers_the_scatter():
    found = []
    for seed in range(60):
        evidence = data(seed, scatter=0.5)
        contest = Contest(evidence)
        found.append(np.sqrt(contest.null_omega) / evidence.scale[evidence.scatter])
    # REML is unbiased for the variance; 60 x 13 degrees of freedom give 5 %.
    assert np.sqrt(np.mean(np.square(found), axis=0)) == pytest.approx([0.5, 0.5], rel=0.12)


def test_reml_slope_is_the_derivative_of_its_objective():
    # The gradient is analytic: if it is wrong, the found optimum is not one.
    evidence = data(3)
    contest = Contest(evidence)
    index = evidence.index()
    best = contest.null_objective
    for k in range(2):
        for factor in (0.7, 1.4):
            omega = contest.null_omega.copy()
            omega[k] *= factor
            _, nearby = objective_at(contest, index, omega)
            assert nearby >= best - 1e-6


@pytest.mark.parametrize("start", [1e-12, 1e-9, 1e-6, 1e-2, 1.0, 1e4])
@pytest.mark.parametrize("scatter", [0.0, 0.02, 0.5, 20.0])
def test_reml_reaches_the_same_end_from_any_start(start, scatter):
    # Over the logarithm the objective is flat if a variance is nearly zero.
    for seed in range(2):
        evidence = data(seed, scatter=scatter)
        contest = Contest(evidence)
        likelihood = RestrictedLikelihood(evidence, evidence.index())
        for uneven in ((1.0, 1.0), (1.0, 1e-9), (1e-9, 1.0)):
            reached = likelihood.lowest(start * np.array(uneven)).value
            assert reached == pytest.approx(contest.null_objective, abs=0.1)


def test_variances_at_their_bounds_leave_a_run_with_one_direction_solvable():
    # Integers: the identity vanishes by rounding beside the product, and a pivot is exactly 0.
    v = np.array([3.0, 4.0])
    gram = np.array([2.0**40 * np.outer(v, v), np.diag([2.0, 5.0])])
    omega = np.full(2, 2.0**30)
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.solve(np.eye(2) + gram * omega, gram)
    solved, log_det = without_scatter(gram, omega, gram)
    beside = 1.0 + 25 * 2.0**70
    # The scatter explains everything; the remainder is far below rounding.
    assert (gram[0] * omega) @ solved[0] == pytest.approx(gram[0], rel=1e-9)
    assert solved[1] == pytest.approx(np.diag([2 / (1 + 2 * 2.0**30), 5 / (1 + 5 * 2.0**30)]))
    assert log_det[0] == pytest.approx(np.log(beside), rel=1e-12)
    assert log_det[1] == pytest.approx(np.log1p(2 * 2.0**30) + np.log1p(5 * 2.0**30), rel=1e-12)


def test_the_first_step_of_a_descent_to_the_bounds_ends_no_contest():
    # A run has so much information that the first step moves every variance to its bound; two equal
    # columns.
    rng = np.random.default_rng(2)
    x, starts, run_of = ramps(RUNS, ROWS)
    both = np.column_stack((x, x))
    y = 3 * x + rng.normal(size=RUNS)[run_of] * x + rng.normal(size=x.size) / 2**8
    noise = Noise([np.zeros(0)] * RUNS, np.full(RUNS, 2.0**-8))
    evidence = gather(both[:, :1], np.zeros(1), both, [], y, noise, starts)
    gram = evidence.gram[:, evidence.scatter[:, None], evidence.scatter]
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.inv(np.eye(2) + gram * np.exp(LOG_OMEGA[1]))
    found = Contest(evidence).null_omega
    scatter = np.sqrt(found.sum()) / evidence.scale[evidence.scatter[0]]
    assert scatter == pytest.approx(1.0, rel=0.6)


def test_columns_of_any_scale_and_dependence_end_no_contest():
    # Scales over many decades, columns twice among the scatter, priors firm and none.
    for seed in range(60):
        rng = np.random.default_rng(seed)
        x, starts, run_of = ramps(RUNS, 60)
        columns = np.column_stack([np.sin(k * x + run_of * rng.uniform()) for k in range(1, 9)])
        columns *= 10.0 ** rng.uniform(-9, 6, 8)
        count = int(rng.integers(1, 5))
        scatter = columns[:, rng.integers(0, 8, count)] * 10.0 ** rng.uniform(-6, 6, count)
        y = columns @ rng.normal(size=8) * 10.0 ** rng.uniform(-3, 6) + rng.normal(size=x.size)
        noise = Noise([np.zeros(0)] * RUNS, np.full(RUNS, 10.0 ** rng.uniform(-9, 3)))
        prior = np.where(rng.uniform(size=8) < 0.5, 0.0, 10.0 ** rng.uniform(-3, 12, 8))
        evidence = gather(columns, prior, scatter, [], y, noise, starts)
        assert np.isfinite(Contest(evidence).null_objective)


def objective_at(contest: Contest, index, omega):
    """REML objective by its definition, with dense matrices."""
    e = contest.evidence
    total, log_det = 0.0, 0.0
    for gram in e.gram:
        b = e.scatter
        k = np.eye(b.size) + gram[np.ix_(b, b)] * omega
        log_det += np.linalg.slogdet(k)[1]
        total = (
            total
            + gram[np.ix_(index, index)]
            - gram[np.ix_(index, b)] @ np.diag(omega) @ np.linalg.solve(k, gram[np.ix_(b, index)])
        )
    h = total[:-1, :-1] + np.diag(e.ridge(index))
    q = total[-1, -1] - total[:-1, -1] @ np.linalg.solve(h, total[:-1, -1])
    return omega, 0.5 * (log_det + q + np.linalg.slogdet(h)[1])


@pytest.mark.parametrize("phi", [(0.0,), (0.6,), (0.5, 0.3)])
def test_autoregression_finds_coefficients_and_innovations(phi):
    rng = np.random.default_rng(5)
    x = lfilter([1.0], np.concatenate(([1.0], -np.array(phi))), 2.0 * rng.normal(size=40000))
    covariance = np.array([x[k:] @ x[: x.size - k] for k in range(9)]) / x.size
    found, variance = autoregression(covariance, x.size)
    assert np.sqrt(variance) == pytest.approx(2.0, rel=0.02)
    wanted = np.zeros(8)
    wanted[: len(phi)] = phi
    have = np.zeros(8)
    have[: found.size] = found
    assert have == pytest.approx(wanted, abs=0.03)


def test_white_noise_needs_no_autoregression():
    # BIC takes an order too many in few cases only.
    orders = []
    for seed in range(100):
        x = np.random.default_rng(seed).normal(size=2000)
        covariance = np.array([x[k:] @ x[: x.size - k] for k in range(9)]) / x.size
        orders.append(autoregression(covariance, x.size)[0].size)
    assert np.count_nonzero(orders) < 10


def test_whitened_noise_is_white_and_of_unit_size():
    rng = np.random.default_rng(6)
    x = lfilter([1.0], [1.0, -0.8], rng.normal(size=30000))
    starts = np.array([0, 10000, 30000])
    noise = fit_noise(x, np.concatenate((np.arange(10000), np.arange(20000))) * 0.1, starts, 0)
    e = np.concatenate([noise.whiten(x[:10000], 0), noise.whiten(x[10000:], 1)])
    assert np.std(e) == pytest.approx(1.0, rel=0.02)
    assert abs(np.corrcoef(e[1:], e[:-1])[0, 1]) < 4 / np.sqrt(e.size)
    assert noise.spread(0) == pytest.approx(1 / 0.6, rel=0.05)  # 1 / sqrt(1 - 0.8^2)


def test_the_spread_of_noise_is_that_of_its_endless_response():
    rng = np.random.default_rng(12)
    pulse = np.eye(20000)[0]
    for order in range(1, 9):
        half = rng.uniform(0.2, 0.97, order // 2) * np.exp(1j * rng.uniform(0, np.pi, order // 2))
        poles = np.concatenate((half, half.conj(), rng.uniform(-0.9, 0.9, order % 2)))
        phi = -np.poly(poles).real[1:]
        response = lfilter([1.0], np.concatenate(([1.0], -phi)), pulse)
        assert variance_of(phi) == pytest.approx(float(response @ response), rel=1e-6)


def test_a_drift_is_not_taken_for_noise():
    x = np.cumsum(np.random.default_rng(7).normal(size=20000))
    noise = fit_noise(x - x.mean(), np.arange(20000.0), np.array([0, 20000]), 0)
    assert noise.phi[0].sum() <= 0.95 + 1e-12


def test_runs_are_grouped_by_their_sampling_rate():
    time = np.concatenate((np.arange(50) * 0.1, np.arange(50) * 0.01, np.arange(50) * 0.105))
    groups = rate_groups(time, np.array([0, 50, 100, 150]))
    assert groups[0] == groups[2] != groups[1]


def test_smallest_detectable_has_the_power_it_states():
    size = noncentrality(2, 20, 0.001)
    limit = stats.f.isf(0.001, 2, 20)
    assert stats.ncf.sf(limit, 2, 20, size) == pytest.approx(0.8, abs=1e-3)


def test_spread_of_autoregressive_noise_is_its_standard_deviation():
    noise = Noise([np.array([0.8])], np.array([3.0]))
    assert noise.spread(0) == pytest.approx(3.0 / np.sqrt(1 - 0.64))
