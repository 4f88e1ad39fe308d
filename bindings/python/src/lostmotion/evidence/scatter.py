"""Run-to-run scatter: its variances by REML, and the residual of a hypothesis without it.

With the scattering columns B and their variances omega, the covariance of a run is
``I + B omega B'`` in whitened units; Woodbury reduces every run to a small matrix.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.linalg.lapack import dtrtrs

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.evidence.gram import Evidence

LOG_OMEGA = (-30.0, 25.0)
"""Bounds of the logarithm of a variance of a scaled column."""

SLOPE_LEAST = 1e-2
"""Slope of the objective with respect to the logarithm of a variance at which REML stops, nats."""

FALL_LEAST = 1e-4
"""Decrease of the objective per step below which REML also stops, nats."""

STEPS_MOST, STEP_MOST, HALVINGS = 40, 4.0, 8
"""Largest number of steps of a descent, largest change of a logarithm per step, and largest number
of times that a step that increases the objective is shortened to a quarter.
"""

FLAT = 1e-9
"""Added to the curvature, relative to it and to 1, because a variance of zero has no curvature."""

STUCK = 0.05
"""Possible gain of a variance in nats according to the score, above which REML has stalled ..."""

LIFTED = 1.0
"""... and the variance from which it continues."""

DAMPED_MAX = 17
"""Largest power of ten of the damping of normal equations, relative to the diagonal. After
elimination of the scatter only rounding may remain; beyond the inverse of the precision the
diagonal dominates.
"""


@dataclass
class Reduced:
    """A hypothesis reduced to its fixed columns, with the log determinant of the scatter."""

    matrix: FloatArray
    log_det: FloatArray

    @cached_property
    def total(self) -> FloatArray:
        """Sum of the matrices of all runs."""
        return np.asarray(self.matrix.sum(axis=0))


def without_scatter(
    gram: FloatArray, omega: FloatArray, sides: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Solve ``(I + gram omega) x = sides`` for every run, and the logarithms of the determinants.

    If the variances are so large that the identity is lost in rounding (the first step of a descent
    goes to their bounds), elimination may have a zero pivot. The eigenvectors of the symmetric
    ``omega^1/2 gram omega^1/2`` avoid this.

    Parameters
    ----------
    gram : ndarray, (runs, n, n)
        Of the scattering columns, positive semidefinite.
    omega : ndarray, (n,)
        Variance of each scattering column, above 0.
    sides : ndarray, (runs, n, m) or (n, m)
        Right sides, of each run or of all.

    Returns
    -------
    solved : ndarray, (runs, n, m)
    log_det : ndarray, (runs,)
    """
    k = np.eye(omega.size) + gram * omega
    # A single right side is repeated for all runs, because NumPy 1 reads (n, m) as vectors of n
    # runs.
    sides = np.broadcast_to(sides, (*k.shape[:-2], *sides.shape[-2:]))
    try:
        return np.asarray(np.linalg.solve(k, sides)), np.asarray(np.linalg.slogdet(k)[1])
    except np.linalg.LinAlgError:
        root = np.sqrt(omega)
        value, vector = np.linalg.eigh(root[:, None] * gram * root)
        value = np.maximum(value, 0.0)
        turned = vector.transpose(0, 2, 1) @ (root[:, None] * sides)
        solved = vector @ (turned / (1.0 + value)[:, :, None]) / root[:, None]
        return solved, np.log1p(value).sum(axis=1)


def reduce(evidence: Evidence, index: IntArray, omega: FloatArray) -> Reduced:
    """Eliminate the scatter from the Gram matrix of every run (Woodbury)."""
    b = evidence.scatter
    sbb = evidence.gram[:, b[:, None], b]
    sbx = evidence.gram[:, b[:, None], index]
    return taken_out(evidence, index, omega, sbx, *without_scatter(sbb, omega, sbx))


def reduced_total(evidence: Evidence, index: IntArray, omega: FloatArray) -> FloatArray:
    """Sum over the runs of `reduce`, without the matrices of single runs."""
    b = evidence.scatter
    cross = evidence.gram[:, b[:, None], index]
    solved, _ = without_scatter(evidence.gram[:, b[:, None], b], omega, cross)
    taken = (cross * omega[:, None]).reshape(-1, index.size).T @ solved.reshape(-1, index.size)
    return np.asarray(evidence.total[np.ix_(index, index)] - taken)


def taken_out(
    evidence: Evidence,
    index: IntArray,
    omega: FloatArray,
    cross: FloatArray,
    solved: FloatArray,
    log_det: FloatArray,
) -> Reduced:
    """Gram matrices of a hypothesis minus what the scatter explains.

    Parameters
    ----------
    evidence, index, omega
        See `reduce`.
    cross : ndarray
        Products of the scattering columns with those of the hypothesis, of every run.
    solved, log_det : ndarray
        Of `without_scatter` for them.
    """
    taken = (cross * omega[:, None]).transpose(0, 2, 1) @ solved
    # Adjacent columns together: places one by one take several times as long.
    pieces = adjacent_columns(index)
    for (rows, of_rows), (columns, of_columns) in product(pieces, pieces):
        own = taken[:, rows, columns]
        np.subtract(evidence.gram[:, of_rows, of_columns], own, out=own)
    return Reduced(taken, log_det)


def adjacent_columns(index: IntArray) -> list[tuple[slice, slice]]:
    """Adjacent columns of an index: their places in it, and the columns."""
    cuts = np.flatnonzero(np.diff(index) != 1) + 1
    ends = [0, *cuts.tolist(), index.size]
    firsts = [int(index[a]) for a in ends[:-1]]
    return [
        (slice(a, b), slice(first, first + b - a))
        for a, b, first in zip(ends[:-1], ends[1:], firsts, strict=True)
    ]


def deviations(
    evidence: Evidence, index: IntArray, omega: FloatArray, delta: FloatArray
) -> FloatArray:
    """Predicted deviations of every run (BLUP), in scaled units.

    Parameters
    ----------
    evidence : Evidence
    index : ndarray
        Columns of a hypothesis, the residual last.
    omega : ndarray
        Variances of the scattering columns.
    delta : ndarray
        Coefficients of the columns of the hypothesis.
    """
    b = evidence.scatter
    sbb = evidence.gram[:, b[:, None], b]
    sbx = evidence.gram[:, b[:, None], index]
    rest = sbx[:, :, -1] - sbx[:, :, :-1] @ delta
    return np.asarray(omega * without_scatter(sbb, omega, rest[:, :, None])[0][:, :, 0])


def factored(h: FloatArray) -> FloatArray:
    """Cholesky factor of normal equations, damped if rounding has made them indefinite."""
    try:
        return np.asarray(np.linalg.cholesky(h))
    except np.linalg.LinAlgError:
        unit = np.abs(np.diag(h)) + 1.0
    for power in range(-6, DAMPED_MAX):
        try:
            return np.asarray(np.linalg.cholesky(h + 10.0**power * np.diag(unit)))
        except np.linalg.LinAlgError:
            continue
    raise np.linalg.LinAlgError("normal equations are not finite")


def solved(h: FloatArray, side: FloatArray) -> FloatArray:
    """Solution of normal equations, damped as in `factored` if rounding has made them singular."""
    try:
        return np.asarray(np.linalg.solve(h, side))
    except np.linalg.LinAlgError:
        factor = factored(h)
        return np.asarray(np.linalg.solve(factor.T, np.linalg.solve(factor, side)))


@dataclass
class Evaluation:
    """The restricted likelihood at some variances.

    Attributes
    ----------
    log_omega : ndarray
        Logarithms of the variances.
    value : float
        Minus the restricted log likelihood, nats.
    solved, log_det : ndarray
        Of `without_scatter`: for the columns of the hypothesis, then for the scattering columns.
    factor, delta : ndarray
        Cholesky factor of the normal equations of the hypothesis, and their solution.
    """

    log_omega: FloatArray
    value: float
    solved: FloatArray
    log_det: FloatArray
    factor: FloatArray
    delta: FloatArray

    @property
    def omega(self) -> FloatArray:
        """The variances."""
        return np.exp(self.log_omega)

    @property
    def slope(self) -> FloatArray:
        """Slope of the value over the logarithms of the variances."""
        return self.derivatives[0]

    @property
    def curvature(self) -> FloatArray:
        """Expected curvature; it neglects the coupling of the runs by the coefficients."""
        return self.derivatives[1]

    @cached_property
    def derivatives(self) -> tuple[FloatArray, FloatArray]:
        """Slope and curvature, as costly as the value: of steps that are taken back not needed."""
        omega, n = self.omega, self.delta.size + 1
        c, a = self.solved[:, :, :n], self.solved[:, :, n:]
        rest = c[:, :, -1] - c[:, :, :-1] @ self.delta
        spread, _ = dtrtrs(self.factor.T, c[:, :, :-1].reshape(-1, n - 1).T, trans=1)
        spread = spread.T.reshape(*c.shape[:2], n - 1)
        slope = 0.5 * (np.einsum("rkk->k", a) - (spread**2).sum((0, 2)) - (rest**2).sum(0))
        own = a - spread @ spread.transpose(0, 2, 1)
        curvature = 0.5 * (own**2).sum(axis=0)
        return slope * omega, curvature * np.outer(omega, omega)


class RestrictedLikelihood:
    """Minus the restricted log likelihood of the variances under a hypothesis, nats.

    Parameters
    ----------
    evidence : Evidence
    index : ndarray
        Columns of the hypothesis, the residual last.
    """

    def __init__(self, evidence: Evidence, index: IntArray) -> None:
        b = evidence.scatter
        self.evidence, self.index = evidence, index
        self.gram = evidence.gram[:, b[:, None], b]
        self.cross = np.ascontiguousarray(evidence.gram[:, b[:, None], index])
        self.total = evidence.total[np.ix_(index, index)]
        self.ridge = np.diag(evidence.ridge(index))
        self.both = np.concatenate((self.cross, self.gram), axis=2)

    def with_ridge(self, ridge: FloatArray) -> RestrictedLikelihood:
        """The same with another prior precision of the columns."""
        other = copy.copy(self)
        other.ridge = np.diag(ridge)
        return other

    def __call__(self, log_omega: FloatArray) -> Evaluation:
        """Evaluate."""
        omega, n = np.exp(log_omega), self.total.shape[0]
        solved, log_det = without_scatter(self.gram, omega, self.both)
        flat = (self.cross * omega[:, None]).reshape(-1, n)
        x = self.total - flat.T @ solved[:, :, :n].reshape(-1, n)
        factor = factored(x[:-1, :-1] + self.ridge)
        half, _ = dtrtrs(factor.T, x[:-1, -1], trans=1)
        delta, _ = dtrtrs(factor.T, half)
        q = x[-1, -1] - half @ half
        value = 0.5 * (float(log_det.sum()) + q + 2.0 * np.log(np.diag(factor)).sum())
        return Evaluation(log_omega, float(value), solved, log_det, factor, delta)

    def descend(self, start: FloatArray) -> Evaluation:
        """The end of a descent by Fisher scoring."""
        low, high = LOG_OMEGA
        now = self(np.clip(np.log(np.maximum(start, 1e-12)), low, high))
        for _ in range(STEPS_MOST):
            x, slope, curvature = now.log_omega, now.slope, now.curvature
            free = ((x > low) | (slope < 0)) & ((x < high) | (slope > 0))
            # A variance near zero has neither slope nor curvature: their quotient would be a large
            # step, for which the steps of all other variances would be shortened.
            free &= np.abs(slope) > SLOPE_LEAST
            if not free.any():
                break
            step = np.zeros_like(x)
            inner = curvature[np.ix_(free, free)]
            inner[np.diag_indices_from(inner)] += FLAT * (1.0 + np.diag(inner))
            step[free] = np.clip(-np.linalg.solve(inner, slope[free]), -STEP_MOST, STEP_MOST)
            for _ in range(HALVINGS):
                trial = np.clip(x + step, low, high)
                found = self(trial)
                if found.value < now.value:
                    break
                step *= 0.25
            else:
                break
            fall, now = now.value - found.value, found
            if fall < FALL_LEAST:
                break
        return now

    def lowest(self, start: FloatArray) -> Evaluation:
        """Maximum likelihood variances.

        Near zero the slope over the logarithm vanishes, and the descent cannot leave a value that
        is too small. The score (Rao's test) shows the possible gain; from larger values the descent
        is regular.
        """
        found = self.descend(start)
        omega, n = found.omega, self.total.shape[0]
        score = -found.slope / omega
        own = found.solved[:, :, n:]
        information = 0.5 * (np.einsum("rkk->rk", own) ** 2).sum(axis=0)
        idle = (score > 0) & (score > np.sqrt(2.0 * STUCK * information))
        lifted = np.where(idle, np.maximum(omega, LIFTED), omega)
        if np.any(lifted > omega):
            again = self.descend(lifted)
            if again.value < found.value:
                return again
        return found

    def reduced(self, found: Evaluation) -> Reduced:
        """The hypothesis without the scatter at evaluated variances."""
        solved = found.solved[:, :, : self.total.shape[0]]
        return taken_out(self.evidence, self.index, found.omega, self.cross, solved, found.log_det)
