"""Run-to-run scatter by REML compared with the mixed linear model of statsmodels."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pytest

from lostmotion.evidence.contest import Contest
from lostmotion.evidence.gram import gather
from lostmotion.evidence.noise import Noise
from lostmotion.evidence.scatter import SLOPE_LEAST, RestrictedLikelihood

RUNS, ROWS = 30, 40
SCATTER = (1.5, 0.6)
"""Standard deviations from run to run of an offset and a slope; that of the noise is 1."""

FloatArray = npt.NDArray[np.float64]


def recordings(seed: int) -> tuple[FloatArray, FloatArray]:
    """An offset and a time as columns, and a response with both scattering from run to run."""
    rng = np.random.default_rng(seed)
    time = np.tile(np.linspace(-1.0, 2.0, ROWS), RUNS)
    columns = np.column_stack((np.ones(RUNS * ROWS), time))
    own = np.repeat(rng.normal(size=(RUNS, 2)) * SCATTER, ROWS, axis=0)
    fixed = columns @ np.array([3.0, -2.0])
    return columns, fixed + np.sum(columns * own, axis=1) + rng.normal(size=time.size)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_variances_are_those_of_a_mixed_linear_model(seed: int) -> None:
    mixed = pytest.importorskip(
        "statsmodels.regression.mixed_linear_model", reason="statsmodels is not installed"
    )
    columns, response = recordings(seed)
    groups = np.repeat(np.arange(RUNS), ROWS)
    apart = mixed.MixedLMParams.from_components(fe_params=np.ones(2), cov_re=np.eye(2))
    model = mixed.MixedLM(response, columns, groups, exog_re=columns)
    found = model.fit(reml=True, free=apart)
    noise = Noise([np.zeros(0)] * RUNS, np.full(RUNS, np.sqrt(found.scale)))
    starts = np.arange(0, RUNS * ROWS + 1, ROWS)
    evidence = gather(columns, np.zeros(2), columns, (), response, noise, starts)
    contest = Contest(evidence)
    scale = evidence.scale[evidence.scatter]
    own = contest.null_omega / scale**2 * found.scale
    np.testing.assert_allclose(own, np.diag(found.cov_re), rtol=0.02)
    fixed = contest.null_step()
    np.testing.assert_allclose(fixed / evidence.scale[evidence.fixed], found.fe_params, rtol=1e-3)
    # The truth lies within the scatter of 30 runs.
    np.testing.assert_allclose(np.sqrt(own), SCATTER, rtol=0.35)


@pytest.mark.parametrize("seed", [22, 24])
def test_a_variance_of_nothing_holds_up_no_other(seed: int) -> None:
    """A third column without scatter, with start values near the variances of the data."""
    rng = np.random.default_rng(seed)
    time = np.tile(np.linspace(-1.0, 2.0, ROWS), RUNS)
    columns = np.column_stack((np.ones(RUNS * ROWS), time, time**2))
    own = np.repeat(rng.normal(size=(RUNS, 3)) * (*SCATTER, 0.0), ROWS, axis=0)
    response = np.sum(columns * (own + np.array([3.0, -2.0, 0.5])), axis=1) + rng.normal(
        size=time.size
    )
    noise = Noise([np.zeros(0)] * RUNS, np.ones(RUNS))
    starts = np.arange(0, RUNS * ROWS + 1, ROWS)
    evidence = gather(columns, np.zeros(3), columns, (), response, noise, starts)
    likelihood = RestrictedLikelihood(evidence, evidence.index())
    far = likelihood.lowest(np.full(3, 1e-2))
    near = likelihood.lowest(np.array([1.1 * far.omega[0], 0.9 * far.omega[1], 3e-3]))
    assert np.max(np.abs(near.slope[:2])) < 2 * SLOPE_LEAST
    assert near.value <= far.value + SLOPE_LEAST


def test_innovations_of_all_runs_are_those_of_each() -> None:
    rng = np.random.default_rng(3)
    starts = np.array([0, 30, 32, 33, 100])  # including runs shorter than the memory
    phi = [0.2 * rng.normal(size=count) for count in (3, 0, 2, 3)]
    noise = Noise(phi, np.array([1.0, 2.0, 3.0, 4.0]))
    values = rng.normal(size=100)
    each = [noise.whiten(values[a:b], run) for run, (a, b) in enumerate(pairwise(starts))]
    together, begins = noise.whiten_runs(values, starts)
    np.testing.assert_allclose(together, np.concatenate(each), rtol=1e-12)
    np.testing.assert_array_equal(np.diff([*begins, together.size]), [one.size for one in each])
