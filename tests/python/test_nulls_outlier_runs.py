"""Outlier runs: rates of false and of correct detection."""

from __future__ import annotations

import numpy as np
import pytest
from nulls import fewest, most, ramps, white
from small_campaigns import RATED_NM, RATIO, campaign

from lostmotion.discover import diagnose
from lostmotion.discover.outlier_runs import (
    OutlierRuns,
    apart,
    find_outlier_runs,
    share_told,
)
from lostmotion.evidence.contest import Contest
from lostmotion.evidence.gram import gather

RUNS, ROWS = 24, 60

LEVEL = 0.002


@pytest.mark.parametrize("runs", [5, 14, 31, 80])
def test_scatter_alone_gives_outlier_runs_at_the_stated_rate(runs: int) -> None:
    rng = np.random.default_rng(runs)
    level, trials = 0.02, 2000
    alarms = sum(bool(apart(rng.normal(size=runs), level)[0]) for _ in range(trials))
    # With few runs the rate of two outliers is slightly above the stated one.
    assert fewest(trials, level) <= alarms <= most(trials, level * (4 / 3 if runs < 25 else 1))


def test_several_that_would_hide_each_other_are_found() -> None:
    rng = np.random.default_rng(3)
    found = 0
    for _ in range(200):
        values = rng.normal(size=31)
        values[[4, 5, 20]] += 8.0
        found += set(apart(values, LEVEL)[0]) == {4, 5, 20}
    assert found > 190


def test_few_runs_and_runs_that_are_all_alike_are_no_evidence() -> None:
    assert apart(np.append(np.zeros(3), 1e6), 0.5) == ([], 1.0)
    assert apart(np.ones(40), 0.5) == ([], 1.0)


def contest_of(seed: int, odd: float = 0.0) -> Contest:
    """Runs of a ramp whose stiffness, friction and gap scatter; in a third friction is not seen."""
    rng = np.random.default_rng(seed)
    x, starts, run_of = ramps(RUNS, ROWS)
    one_way = run_of % 3 == 0
    columns = np.column_stack((x, np.where(one_way, 0.0, np.cos(3 * x)), np.tanh(9 * x), 0 * x + 1))
    own = rng.normal(size=(RUNS, 4)) * (0.5, 0.3, 0.4, 1.0)
    own[[7, 8], 1] += odd
    y = 3 * x + np.einsum("nk,nk->n", columns, own[run_of]) + rng.normal(size=x.size)
    return Contest(gather(columns, np.zeros(4), columns, [], y, white(RUNS), starts))


def test_predicted_deviations_of_a_contest_keep_the_level() -> None:
    trials = 400
    alarms = sum(find_outlier_runs(contest_of(seed), LEVEL) is not None for seed in range(trials))
    assert alarms <= most(trials, LEVEL)


def test_outlying_runs_in_a_contest_are_named_with_their_part() -> None:
    found = find_outlier_runs(contest_of(1, odd=3.0), LEVEL)
    assert found is not None
    assert (found.part, found.runs) == ("friction", [7, 8])
    assert found.deviations == pytest.approx([3.0, 3.0], abs=1.2)
    assert found.p < LEVEL
    # Runs that never reverse do not show friction.
    share = share_told(contest_of(1))
    assert np.all(share[::3, 1] < 1e-6)
    assert np.all(share[1::3, 1] > 0.5)


def test_outlying_runs_are_reported_in_a_sentence() -> None:
    labels = [str(run) for run in range(1, 9)]
    assert OutlierRuns("gap", [3], [1.0], 0.1).told(labels, 0.5) == {
        "covariate": "run",
        "shape": "gap, in run 4 alone",
        "p": 0.1,
        "rms_arcsec": 0.5,
    }
    assert OutlierRuns("gap", [0, 3, 4], [1.0] * 3, 0.1).told(labels, 0.5)["shape"] == (
        "gap, in runs 1, 4 and 5 alone"
    )


def test_three_runs_in_an_oven_that_nobody_noted_are_not_complete() -> None:
    def oven(columns: dict[str, np.ndarray], wound: np.ndarray) -> np.ndarray:
        hot = columns["input_angle"][0] in (0.7 * 4, 0.7 * 9, 0.7 * 13)
        return np.asarray(6.0 * hot * np.tanh(wound / 0.2))

    data = campaign(seed=5, runs=18, add=oven, warm=False)
    answer = diagnose(None, data, ratio=RATIO, rated_torque_Nm=RATED_NM).answer()
    assert (answer["verdict"], answer["effects"]) == ("unexplained", [])
    (one,) = answer["unexplained"]["depends_on"]
    assert (one["covariate"], one["shape"]) == ("run", "gap, in runs 5, 10 and 14 alone")
    # 6 arcsec either side in one run of six.
    assert one["rms_arcsec"] == pytest.approx(6.0 * np.sqrt(3 / 18), rel=0.25)
    assert "record it" in answer["next_experiment"]
