"""Run-to-run scatter by REML against the mixed linear model of statsmodels."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from lostmotion.evidence.contest import Contest
from lostmotion.evidence.gram import gather
from lostmotion.evidence.noise import Noise

mixed = pytest.importorskip(
    "statsmodels.regression.mixed_linear_model", reason="statsmodels is not installed"
)

RUNS, ROWS = 30, 40
SCATTER = (1.5, 0.6)
"""Standard deviations of what scatters from run to run: an offset and a slope; noise has 1."""

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
