"""Least squares within bounds, for many samples and few unknowns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import brentq, lsq_linear

FloatArray = npt.NDArray[np.float64]

FIRST_DAMPING = 1e-4
"""Damping of the first step, in units of the diagonal of the normal equations."""

LEAST_DAMPING, GREATEST_DAMPING = 1e-12, 1e8

PIVOTS_MOST = 60
"""Largest number of active-set changes; five to ten are usual."""

LEAST_DIAGONAL = 1e-12
"""Least relative diagonal: unknowns that the samples do not determine are kept."""


@dataclass(frozen=True)
class SumLimit:
    """Unknowns that add up to at most a number.

    Attributes
    ----------
    places : ndarray or slice
        Of the unknowns.
    most : float
    """

    places: npt.NDArray[np.intp] | slice
    most: float


@dataclass(frozen=True)
class Solution:
    """Result of `bounded_least_squares`.

    Attributes
    ----------
    x : ndarray
    cost : float
        Sum of squares.
    normal : ndarray
        The normal matrix ``J.T @ J`` at the solution.
    at_bound : ndarray of bool
    steps : int
        Number of evaluations.
    """

    x: FloatArray
    cost: float
    normal: FloatArray
    at_bound: npt.NDArray[np.bool_]
    steps: int


def bounded_least_squares(
    evaluate: Callable[[FloatArray], tuple[FloatArray, FloatArray | Callable[[], FloatArray]]],
    start: FloatArray,
    low: FloatArray,
    high: FloatArray,
    *,
    tolerance: float = 1e-7,
    steps: int = 60,
    limit: SumLimit | None = None,
) -> Solution:
    """Minimise a sum of squares in a box by damped Gauss-Newton steps on the normal equations.

    Each step solves its quadratic model within the box exactly, so bounds become active and
    inactive as they should. Only matrices of the size of the unknowns are factored; each step uses
    the samples in one product.

    Parameters
    ----------
    evaluate : callable
        Returns the residuals and their Jacobian at a point; the Jacobian as an array, or as a
        function that is called only if the point is accepted, before the next one.
    start, low, high : ndarray
        Starting point and box; `start` is clipped into it.
    tolerance : float
        Relative decrease of the cost below which the search ends.
    steps : int
        Largest number of evaluations.
    limit : SumLimit, optional
        Limit of nonnegative unknowns; the starting point is scaled down to it.
    """
    x = np.clip(start, low, high)
    if limit is not None and (total := float(x[limit.places].sum())) > limit.most:
        x[limit.places] *= limit.most / total
    residual, derivatives = evaluate(x)
    normal, gradient = normal_equations(residual, derivatives)
    cost = float(residual @ residual)
    damping = FIRST_DAMPING
    used = 1
    small_falls = 0
    # If the residuals depend on no unknown (constant torque), the starting point is kept.
    while used < steps and damping < GREATEST_DAMPING and cost > 0 and np.any(gradient):
        room = (
            None
            if limit is None
            else SumLimit(limit.places, limit.most - float(x[limit.places].sum()))
        )
        move = solve_within(normal, -gradient, low - x, high - x, damping, room)
        predicted = -float(move @ (2.0 * gradient + normal @ move))
        if predicted <= tolerance * cost:
            break
        trial = np.clip(x + move, low, high)
        residual, derivatives = evaluate(trial)
        used += 1
        found = float(residual @ residual)
        if found < cost:
            small_falls = small_falls + 1 if cost - found < tolerance * cost else 0
            damping = max(LEAST_DAMPING, damping * (0.1 if cost - found > 0.5 * predicted else 1.0))
            x, cost = trial, found
            normal, gradient = normal_equations(residual, derivatives)
            if small_falls > 1:
                break
        else:
            damping *= 10.0
    return Solution(x, cost, normal, (x <= low) | (x >= high), used)


def normal_equations(
    residual: FloatArray, derivatives: FloatArray | Callable[[], FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Normal matrix and gradient."""
    jacobian = derivatives() if callable(derivatives) else derivatives
    return jacobian.T @ jacobian, jacobian.T @ residual


def solve_within(
    normal: FloatArray,
    right: FloatArray,
    low: FloatArray,
    high: FloatArray,
    damping: float = 0.0,
    limit: SumLimit | None = None,
) -> FloatArray:
    """Solve normal equations within a box: `x` of least ``x @ normal @ x / 2 - right @ x``.

    Parameters
    ----------
    normal : ndarray
        Symmetric, positive semidefinite.
    right, low, high : ndarray
        ``low < high``.
    damping : float
        Added to the diagonal, in its own units.
    limit : SumLimit, optional
        Limit of a sum of unknowns, enforced by a Lagrange multiplier.
    """
    diagonal = np.diag(normal)
    floor = LEAST_DIAGONAL * max(float(diagonal.max()), 1e-300)
    scale = 1.0 / np.sqrt(np.maximum(diagonal, floor))
    scaled = normal * np.outer(scale, scale)
    scaled[np.diag_indices_from(scaled)] += damping
    # Rounding can make the matrix slightly indefinite: damping is added until it can be factored.
    extra = 1e-14
    while True:
        firm = scaled + extra * np.eye(scaled.shape[0])
        try:
            factor = np.linalg.cholesky(firm)
            break
        except np.linalg.LinAlgError:
            extra *= 10.0

    def within(drawn: FloatArray) -> FloatArray:
        found = pivoted(firm, drawn * scale, low / scale, high / scale)
        if found is None:
            found = lsq_linear(
                factor.T,
                np.linalg.solve(factor, drawn * scale),
                bounds=(low / scale, high / scale),
                method="bvls",
                tol=1e-12,
                max_iter=50 * scale.size,
            ).x
        return np.asarray(found * scale, dtype=np.float64)

    x = within(right)
    if limit is None or x[limit.places].sum() <= limit.most:
        return x
    places, most = limit.places, limit.most

    def beyond(multiplier: float) -> float:
        drawn = right.copy()
        drawn[places] -= multiplier
        return float(within(drawn)[places].sum()) - most

    # The sum is a decreasing, piecewise linear function of the multiplier.
    high_enough = float(np.abs(right[places]).max()) + 1e-300
    while beyond(high_enough) > 0 and high_enough < np.inf:
        high_enough *= 4.0
    multiplier = float(brentq(beyond, 0.0, high_enough, xtol=1e-9 * high_enough, rtol=1e-9))
    drawn = right.copy()
    drawn[places] -= multiplier
    return within(drawn)


def pivoted(
    normal: FloatArray, right: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray | None:
    """Solve positive definite normal equations within a box by block principal pivoting.

    All unknowns that leave the box are set to its bounds at once, and all that return are freed
    (Judice and Pires, Computers & Operations Research 21 (1994) 587): a few small factorisations.
    None if it cycles, or if a part cannot be factored.
    """
    at_low, at_high = np.zeros(right.size, dtype=np.bool_), np.zeros(right.size, dtype=np.bool_)
    for _ in range(PIVOTS_MOST):
        free = ~(at_low | at_high)
        x = np.where(at_low, low, np.where(at_high, high, 0.0))
        if free.any():
            beside = right[free] - normal[np.ix_(free, ~free)] @ x[~free]
            try:
                x[free] = cho_solve(cho_factor(normal[np.ix_(free, free)]), beside)
            except np.linalg.LinAlgError:
                return None
        slope = normal @ x - right
        below, above = free & (x < low), free & (x > high)
        drawn = (at_low & (slope < 0)) | (at_high & (slope > 0))
        if not (below | above | drawn).any():
            return np.asarray(x)
        at_low, at_high = (at_low & ~drawn) | below, (at_high & ~drawn) | above
    return None
