"""Leave-one-run-out predictions from Gram matrices, without refits."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dposv

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.evidence.gram import Evidence
from lostmotion.evidence.scatter import Reduced


def log_density(reduced: Reduced, ridge: FloatArray) -> FloatArray:
    """Log predictive density of every run for a fit to the others, including its uncertainty.

    The uncertainty of the coefficients from the other runs adds ``X inv(H) X'`` to the covariance
    of the run: an extrapolated run, such as the only one with most cycles, may deviate far.
    """
    own = reduced.matrix
    total = reduced.total
    whole = total[:-1, :-1] + np.diag(ridge)
    delta, log_det = solved_without(own, total, ridge)
    slope = own[:, :-1, -1] - (own[:, :-1, :-1] @ delta[:, :, None])[:, :, 0]
    error = own[:, -1, -1] - np.sum(delta * (own[:, :-1, -1] + slope), axis=1)
    taken = np.sum(slope * np.linalg.solve(whole, slope.T).T, axis=1)
    spread = np.linalg.slogdet(whole)[1] - log_det
    return np.asarray(-0.5 * (error - taken + reduced.log_det + spread))


def solved_without(
    own: FloatArray, total: FloatArray, ridge: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Solve the normal equations of all runs but one, for each run, and their log determinants.

    One Cholesky factorization gives both. A matrix that is indefinite by rounding is factored with
    pivots. One run at a time: the matrices of all runs do not fit into the processor's cache.

    Parameters
    ----------
    own : ndarray, (runs, n + 1, n + 1)
        Normal matrix of every run, the right side last.
    total : ndarray, (n + 1, n + 1)
        Their sum.
    ridge : ndarray, (n,)
        Added to the diagonal.
    """
    solved, log_det = np.empty((own.shape[0], ridge.size)), np.empty(own.shape[0])
    rest = np.empty_like(total[:-1])
    matrix, side = rest[:, :-1], rest[:, -1]
    diagonal = np.diag_indices_from(matrix)
    for run, mine in enumerate(own):
        np.subtract(total[:-1], mine[:-1], out=rest)
        matrix[diagonal] += ridge
        factor, solved[run], failed = dposv(matrix, side)
        if failed:
            solved[run], log_det[run] = np.linalg.solve(matrix, side), np.linalg.slogdet(matrix)[1]
        else:
            log_det[run] = 2.0 * np.log(np.diag(factor)).sum()
    return solved, log_det


def centred(plain: Evidence) -> FloatArray:
    """Unwhitened Gram matrices without run means; the last scatter column is ones."""
    ones = plain.scatter[-1]
    gram = plain.gram
    count = np.maximum(gram[:, ones, ones], 1e-300)
    return np.asarray(gram - gram[:, :, ones, None] * gram[:, None, ones, :] / count[:, None, None])


def errors(plain: Evidence, more: IntArray, rows: float) -> tuple[float, float]:
    """Fitted and leave-one-run-out rms of the baseline model with more columns, arc seconds.

    Parameters
    ----------
    plain : Evidence
        Not whitened.
    more : ndarray
        Places of the columns beside those of the baseline model.
    rows : float
        Samples.
    """
    index = np.concatenate((plain.fixed, more)).astype(np.intp)
    gram = centred(plain)
    h, g = gram[:, index[:, None], index], gram[:, index, plain.response]
    own = gram[:, plain.response, plain.response]
    ridge = np.zeros(index.size)
    ridge[: plain.precision.size] = plain.precision
    total = h.sum(axis=0)
    ridge = np.diag(ridge + 1e-9 * np.maximum(np.diag(total), 1.0))
    delta = np.linalg.solve(total + ridge, g.sum(axis=0))
    fitted = own.sum() - 2 * delta @ g.sum(axis=0) + delta @ total @ delta
    apart = np.linalg.solve(total - h + ridge, (g.sum(axis=0) - g)[:, :, None])[:, :, 0]
    held = own - 2 * np.einsum("ri,ri->r", apart, g)
    held = held + np.einsum("ri,rij,rj->r", apart, h, apart, optimize=True)
    return float(np.sqrt(max(fitted, 0.0) / rows)), float(np.sqrt(max(held.sum(), 0.0) / rows))
