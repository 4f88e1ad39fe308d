"""The noise floor: noise within runs and run-to-run scatter."""

from __future__ import annotations

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.discover.linearise import Settled, columns_of
from lostmotion.evidence.contest import Contest
from lostmotion.evidence.scatter import deviations, without_scatter
from lostmotion.fit.deviations import DEVIATIONS


def scatter_of(contest: Contest) -> FloatArray:
    """Standard deviations of stiffness, friction (relative), gap and offset (arc seconds)."""
    e = contest.evidence
    return np.asarray(np.sqrt(contest.null_omega) / e.scale[e.scatter])


def noise_floor(settled: Settled, within: float) -> float:
    """Noise within runs and run-to-run scatter, as one rms in arc seconds.

    Every run counts with its own deviations, not with those expected of similar runs, because an
    outlier run may have little effect. A deviation common to all runs is not scatter: a fit to all
    runs includes it in its curve. The error of the model is not used.

    Parameters
    ----------
    settled : Settled
        The model at the deviations of the runs.
    within : float
        Noise within runs.
    """
    base = settled.base
    contest = settled.contest
    own, spread = posterior(contest)
    fixed, _, scatter, _ = columns_of(base, base.at())
    known = len(DEVIATIONS)
    scatter = scatter[:, :known]
    centre = base.conditions.centre
    centre(fixed)
    centre(scatter)
    moved = np.einsum("ij,ij->i", scatter, own[base.conditions.run_of, :known])
    used = np.einsum("ij,ij->j", fixed, fixed) > 0
    apart = moved - fixed[:, used] @ np.linalg.lstsq(fixed[:, used], moved, rcond=1e-9)[0]
    squares = np.array([scatter[at].T @ scatter[at] for at in base.conditions.slices()])
    total = float(apart @ apart) + float(np.sum(spread[:, :known, :known] * squares))
    return float(np.sqrt(within**2 + total / base.conditions.rows))


def floor_of(contest: Contest, squares: FloatArray, rows: float, within: float) -> float:
    """The same from the squares and products ``[run, part, part]`` of the scattering parts."""
    known = len(DEVIATIONS)
    moments = second_moments(contest)[:, :known, :known]
    total = float(np.sum(moments * squares))
    return float(np.sqrt(within**2 + total / rows))


def second_moments(contest: Contest) -> FloatArray:
    """Expected squares and products of every run's deviations, given its recordings."""
    own, spread = posterior(contest)
    return np.asarray(own[:, :, None] * own[:, None, :] + spread)


def posterior(contest: Contest) -> tuple[FloatArray, FloatArray]:
    """Deviations of every run given its recordings, and their covariance."""
    e = contest.evidence
    index, omega = e.index(), contest.null_omega
    own = deviations(e, index, omega, contest.null_step())
    gram = e.gram[:, e.scatter[:, None], e.scatter]
    left = omega[:, None] * without_scatter(gram, omega, np.eye(omega.size))[0]
    scale = e.scale[e.scatter]
    return np.asarray(own / scale), np.asarray(left / np.outer(scale, scale))
