"""The noise floor: noise within runs and the scatter between them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from lostmotion.discover.linearise import Settled
from lostmotion.evidence.contest import Contest
from lostmotion.evidence.scatter import deviations, without_scatter
from lostmotion.fit.deviations import DEVIATIONS

FloatArray = npt.NDArray[np.float64]


def scatter_of(contest: Contest) -> FloatArray:
    """Standard deviations of stiffness, friction (relative), gap and offset (arc seconds)."""
    e = contest.evidence
    return np.asarray(np.sqrt(contest.null_omega) / e.scale[e.scatter])


def noise_floor(settled: Settled, within: float) -> float:
    """Noise within runs and scatter between them, as one rms in arc seconds.

    Every run counts with the deviations that it has, not with those that its like might have: one
    odd run may have little that they act on. It is not measured against the error of the model: a
    floor above the leave-one-run-out error says that deviations make up for what the model lacks.

    Parameters
    ----------
    settled : Settled
        The model at the deviations of the runs.
    within : float
        Noise within runs.
    """
    base = settled.base
    scatter = base.run_columns(base.at())[:, : len(DEVIATIONS)]
    centred = (scatter[at] - scatter[at].mean(axis=0) for at in base.conditions.slices())
    squares = np.array([columns.T @ columns for columns in centred])
    return floor_of(settled.contest, squares, base.conditions.rows, within)


def floor_of(contest: Contest, squares: FloatArray, rows: float, within: float) -> float:
    """The same from squares and products ``[run, part, part]`` of what scatters."""
    known = len(DEVIATIONS)
    moments = second_moments(contest)[:, :known, :known]
    total = float(np.sum(moments * squares))
    return float(np.sqrt(within**2 + total / rows))


def second_moments(contest: Contest) -> FloatArray:
    """Expected squares and products of every run's deviations, given its recordings."""
    e = contest.evidence
    index, omega = e.index(), contest.null_omega
    own = deviations(e, index, omega, contest.null_step())
    gram = e.gram[:, e.scatter[:, None], e.scatter]
    left = omega[:, None] * without_scatter(gram, omega, np.eye(omega.size))[0]
    scale = e.scale[e.scatter]
    moment = own[:, :, None] * own[:, None, :] + left
    return np.asarray(moment / np.outer(scale, scale))
