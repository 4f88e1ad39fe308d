"""The contest of candidates: each is tested against the baseline model with its own scatter.

The unit of evidence is the run. A candidate is tested with its own variances: with those of the
baseline model alone, effects between runs would be treated as scatter.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import special

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.evidence.gram import Evidence
from lostmotion.evidence.left_out import log_density
from lostmotion.evidence.overlap import RANK
from lostmotion.evidence.scatter import Reduced, RestrictedLikelihood, reduce, solved
from lostmotion.evidence.sign_flips import flip_limit, flip_p, sign_patterns

VISIBLE = 1e-9
"""A column is not identifiable if less than this share of its square remains after projection on
the baseline columns.
"""

REDUCED = 1e-12
"""Share of a column's square below which the part not explained by deviations is rounding: about a
thousand times the precision of the subtracted sums.
"""

FIRST_OMEGA = 1e-2
"""Start of the first search for the variances of scaled columns."""


@dataclass
class Result:
    """One candidate in the contest.

    Attributes
    ----------
    wald : float
        Decrease of the quadratic form.
    rank : int
        Dimensions of the candidate in addition to the baseline model.
    p : float
        Of the run-level F test, before Bonferroni.
    flip_p : float
        Fraction of sign patterns of the runs that do at least as well, including the true one.
    flip_limit : float
        Largest `flip_p` that supports the candidate with this plan; if it exceeds the level, the F
        test must compensate.
    gain : float
        Leave-one-run-out gain in log predictive density, nats.
    gain_by_run : ndarray
    coefficients : ndarray
        Of the scaled columns.
    covariance : ndarray
    omega : ndarray
    block : str
        Tested columns: all of the candidate, or those of one start.
    """

    name: str
    wald: float
    rank: int
    p: float
    flip_p: float
    flip_limit: float
    gain: float
    gain_by_run: FloatArray
    coefficients: FloatArray
    covariance: FloatArray
    omega: FloatArray
    block: str


@dataclass
class Estimates:
    """Coefficients with and without a candidate, at given variances.

    Attributes
    ----------
    n0 : int
        Columns of the baseline model; those of the candidate follow.
    delta, alone : ndarray
        Coefficients of all columns; of the baseline columns without the candidate.
    inverse : ndarray
        Covariance of `delta`.
    carried : ndarray
        Projection of the candidate's columns on those of the baseline model.
    wald : float
        Decrease of the quadratic form by the candidate.
    """

    n0: int
    delta: FloatArray
    alone: FloatArray
    inverse: FloatArray
    carried: FloatArray
    wald: float


class Contest:
    """The contest for one body of evidence.

    Parameters
    ----------
    evidence : Evidence
    start : ndarray, optional
        Start of the variances of the scattering columns.

    Attributes
    ----------
    evidence : Evidence
    null_omega, null_objective : ndarray, float
        Variances of the scattering columns without any candidate, and minus the restricted log
        likelihood there, nats.
    null : Reduced
        The baseline model alone.
    """

    def __init__(self, evidence: Evidence, start: FloatArray | None = None) -> None:
        self.evidence = evidence
        self.runs = evidence.runs
        index = evidence.index()
        likelihood = RestrictedLikelihood(evidence, index)
        found = likelihood.lowest(
            np.full(evidence.scatter.size, FIRST_OMEGA) if start is None else start
        )
        self.null_omega, self.null_objective = found.omega, found.value
        self.null = likelihood.reduced(found)

    @cached_property
    def signs(self) -> FloatArray:
        """Sign patterns of the runs."""
        return sign_patterns(self.runs)

    @cached_property
    def null_density(self) -> FloatArray:
        """Leave-one-run-out log predictive density of every run for the baseline model alone."""
        return log_density(self.null, self.evidence.ridge(self.evidence.index()))

    def omega_of(self, evidence: Evidence) -> FloatArray:
        """The same variances for the scattering columns of other evidence, scaled as these are."""
        ratio = evidence.scale[evidence.scatter] / self.evidence.scale[self.evidence.scatter]
        return np.asarray(self.null_omega * ratio**2)

    def freedom(self, rank: int) -> int:
        """Degrees of freedom of the F test of a candidate: one for each run, less two.

        Under REML every direction of a candidate costs the variances one run.
        """
        return self.runs - 2 - rank

    def null_step(self) -> FloatArray:
        """Coefficients of the baseline model's columns alone."""
        matrix = self.null.total
        h = matrix[:-1, :-1] + np.diag(self.evidence.ridge(self.evidence.index()))
        return solved(h, matrix[:-1, -1])

    def test(self, name: str, *, refit_scatter: bool = True) -> Result | None:
        """Test a candidate; None if these recordings cannot identify it."""
        e = self.evidence
        index, n0 = e.index(name), e.fixed.size
        omega = self.null_omega
        if refit_scatter:
            likelihood = RestrictedLikelihood(e, index)
            lowest = likelihood.lowest(omega)
            omega, reduced = lowest.omega, likelihood.reduced(lowest)
        else:
            reduced = reduce(e, index, omega)
        turn = visible_directions(e, reduced, index)
        rank = turn.shape[1]
        if rank == 0:
            return None
        seen = Reduced(rotated(reduced.matrix, turn, n0), reduced.log_det)
        ridge = np.append(e.ridge(index)[:n0], np.full(rank, 1e-10))
        found = fit_both(seen, ridge, n0)
        # With and without, each under its own variances.
        gain = log_density(seen, ridge) - self.null_density
        score, ideal, weight = run_scores(seen, ridge, found)
        return Result(
            name,
            found.wald,
            rank,
            float(special.fdtrc(rank, max(self.freedom(rank), 1), max(found.wald, 0.0) / rank)),
            flip_p(self.signs, score, weight),
            flip_limit(self.signs, ideal, weight, found.wald),
            float(gain.sum()),
            gain,
            turn @ found.delta[n0:],
            turn @ found.inverse[n0:, n0:] @ turn.T,
            omega,
            name,
        )


def visible_directions(e: Evidence, reduced: Reduced, index: IntArray) -> FloatArray:
    """Dimensions of a block that the rest of its hypothesis does not absorb."""
    n0 = e.fixed.size
    total = reduced.total
    ridge = np.diag(e.ridge(index))[:n0, :n0]
    cross = total[n0:-1, :n0]
    left = total[n0:-1, n0:-1] - cross @ np.linalg.solve(total[:n0, :n0] + ridge, cross.T)
    raw = np.diag(total)[n0:-1]
    # Relative to the column before projection on the baseline model. If a column consists only of
    # deviations of the runs, only rounding remains.
    seen = raw > REDUCED * np.diag(e.total)[index[n0:-1]]
    unit = np.where(seen, 1.0 / np.sqrt(np.where(seen, raw, 1.0)), 0.0)
    value, vector = np.linalg.eigh(left * np.outer(unit, unit))
    keep = value > max(VISIBLE, RANK * max(float(value[-1]), 0.0))
    return np.asarray(vector[:, keep] * unit[:, None])


def rotated(matrix: FloatArray, turn: FloatArray, n0: int) -> FloatArray:
    """Rotate a block of symmetric matrices, between `n0` columns and the last, by ``x @ turn``."""
    first, last = slice(0, n0), n0 + turn.shape[1]
    block = matrix[:, :, n0:-1] @ turn
    out = np.empty((matrix.shape[0], last + 1, last + 1))
    out[:, first, first] = matrix[:, first, first]
    out[:, first, n0:last] = block[:, first]
    out[:, n0:last, n0:last] = turn.T @ block[:, n0:-1]
    out[:, first, last] = matrix[:, first, -1]
    out[:, n0:last, last] = block[:, -1]
    out[:, last, last] = matrix[:, -1, -1]
    out[:, n0:last, first] = out[:, first, n0:last].transpose(0, 2, 1)
    out[:, last, :last] = out[:, :last, last]
    return out


def fit_both(reduced: Reduced, ridge: FloatArray, n0: int) -> Estimates:
    """Fit with and without a candidate, by generalised least squares."""
    total = reduced.total
    h = total[:-1, :-1] + np.diag(ridge)
    g = total[:-1, -1]
    inverse = np.asarray(np.linalg.inv(h), dtype=np.float64)
    delta = inverse @ g
    h0 = h[:n0, :n0]
    carried, alone = (
        np.asarray(np.linalg.solve(h0, side), dtype=np.float64)
        for side in (total[:n0, n0:-1], g[:n0])
    )
    wald = float(g @ delta - g[:n0] @ alone)
    return Estimates(n0, delta, alone, inverse, carried, wald)


def run_scores(
    reduced: Reduced, ridge: FloatArray, found: Estimates
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Scores of the runs under the baseline model, with a candidate's variances.

    Returns
    -------
    score : ndarray
        ``[run, direction]``. The prior acts on the baseline parameters; its part belongs to no run.
    ideal : ndarray
        The same if every run agreed exactly with the fitted candidate.
    weight : ndarray
        Inverse of the information of the directions.
    """
    own, n0, k = reduced.matrix, found.n0, found.carried
    total = reduced.total
    score = (
        own[:, n0:-1, -1]
        - own[:, :n0, -1] @ k
        - np.einsum("rkn,n->rk", own[:, n0:-1, :n0], found.alone)
        + (own[:, :n0, :n0] @ found.alone) @ k
    )
    left = total[n0:-1, n0:-1] - total[n0:-1, :n0] @ k + np.diag(ridge[n0:])
    cross = own[:, n0:-1, :n0] @ k
    seen = own[:, n0:-1, n0:-1] - cross - cross.transpose(0, 2, 1)
    seen += k.T @ own[:, :n0, :n0] @ k
    return score, seen @ found.delta[n0:], np.asarray(np.linalg.inv(left), dtype=np.float64)
