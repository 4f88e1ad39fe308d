"""Least squares within bounds, for many samples and few unknowns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dposv

from lostmotion.arrays import BoolArray, FloatArray, IntArray

FIRST_DAMPING = 1e-4
"""Damping of the first step, in units of the diagonal of the normal equations."""

LEAST_DAMPING, GREATEST_DAMPING = 1e-12, 1e8

CHANGES_MOST = 20
"""Changes of the active bounds for each unknown, at most; one to ten in all are usual."""

DRAWN = 1e-12
"""Gradient at a bound, relative to the largest, that is rounding and does not free an unknown."""

ROUNDING = 8 * float(np.finfo(np.float64).eps)
"""Relative rounding of a few multiplications and a sum."""

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

    places: IntArray | slice
    most: float


@dataclass(frozen=True)
class Solution:
    """Result of `bounded_least_squares`.

    Attributes
    ----------
    x : ndarray
    cost : float
        Sum of squares.
    at_bound : ndarray of bool
    steps : int
        Number of evaluations.
    """

    x: FloatArray
    cost: float
    at_bound: BoolArray
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
        function that is called only if a step begins at the point, before the next one.
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
    cost = float(residual @ residual)
    damping = FIRST_DAMPING
    used = 1
    small_falls = 0
    moved = True
    while used < steps and damping < GREATEST_DAMPING and cost > 0 and small_falls < 2:
        if moved:
            normal, gradient = normal_equations(residual, derivatives)
        if not np.any(gradient):
            break  # the residuals depend on no unknown (constant torque)
        room = (
            None
            if limit is None
            else SumLimit(limit.places, limit.most - float(x[limit.places].sum()))
        )
        move = solve_within(normal, -gradient, low - x, high - x, damping, room)
        predicted = -float(move @ (2.0 * gradient + normal @ move))
        if predicted <= tolerance * cost:
            break
        trial = moved_within(x, move, low, high)
        residual, derivatives = evaluate(trial)
        used += 1
        found = float(residual @ residual)
        moved = found < cost
        if moved:
            small_falls = small_falls + 1 if cost - found < tolerance * cost else 0
            damping = max(LEAST_DAMPING, damping * (0.1 if cost - found > 0.5 * predicted else 1.0))
            x, cost = trial, found
        else:
            damping *= 10.0
    return Solution(x, cost, (x <= low) | (x >= high), used)


def moved_within(x: FloatArray, step: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Move by a step within a box; a value that reaches a bound is exactly there.

    The sum of a value and its distance from a bound differs from the bound by rounding. A share of
    1e-17 is not zero: what depends on it would be scaled up as if it had been measured.
    """
    moved = np.clip(x + step, low, high)
    rounding = ROUNDING * np.maximum(np.abs(x), np.abs(step))
    for bound in (low, high):
        moved = np.where(np.abs(moved - bound) <= rounding, bound, moved)
    return np.asarray(moved)


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

    By a primal active-set method (Nocedal and Wright, Numerical Optimization, 2nd ed., algorithm
    16.3): the objective decreases with every change, so it does not cycle, however nearly singular
    the matrix is.

    Parameters
    ----------
    normal : ndarray
        Symmetric, positive semidefinite.
    right, low, high : ndarray
        ``low < high``. The point of the box nearest to zero must satisfy the limit.
    damping : float
        Added to the diagonal, in its own units.
    limit : SumLimit, optional
        Limit of a sum of unknowns, one more bound that may be active.
    """
    if right.size == 0:  # every unknown is held at its bound
        return np.zeros(0)
    diagonal = np.diag(normal)
    floor = LEAST_DIAGONAL * max(float(diagonal.max()), 1e-300)
    scale = 1.0 / np.sqrt(np.maximum(diagonal, floor))
    scaled = normal * np.outer(scale, scale)
    scaled.flat[:: right.size + 1] += damping
    least, greatest, drawn = low, high, right * scale
    low, high = low / scale, high / scale
    x = np.clip(0.0, low, high)
    side = np.where((x <= low) & (drawn < 0), -1, np.where((x >= high) & (drawn > 0), 1, 0))
    weight, most = np.zeros(right.size), np.inf
    if limit is not None:
        weight[limit.places], most = scale[limit.places], limit.most
    # Rounding can make the matrix slightly indefinite: damping is added until it can be factored.
    extra = 1e-14
    while True:
        firm = scaled.copy()
        firm.flat[:: right.size + 1] += extra
        _, moves, indefinite = dposv(firm, np.column_stack((drawn - firm @ x, weight)))
        if not indefinite:
            break
        extra *= 10.0
    if limit is None and not side.any():
        step = moves[:, 0]
        if np.all(share_within(x, step, low, high) >= 1.0):  # no bound becomes active
            return np.asarray(np.clip((x + step) * scale, least, greatest), dtype=np.float64)

    limited = False
    sides = np.column_stack((drawn, weight))
    rounding = DRAWN * float(np.abs(drawn).max())
    columns = np.ascontiguousarray(firm.T)  # LAPACK takes contiguous columns without a copy
    for _ in range(CHANGES_MOST * right.size):
        free, multiplier, step = (side == 0).nonzero()[0], 0.0, np.zeros(right.size)
        if free.size:
            np.subtract(drawn, firm @ x, out=sides[:, 0])
            own = columns.take(free, 0).take(free, 1).T
            _, moves, _ = dposv(own, sides.take(free, 0), overwrite_a=1)
            step[free] = moves[:, 0]
            if limited and (fall := float(weight[free] @ moves[:, 1])) > 0.0:
                multiplier = float(weight @ (x + step) - most) / fall
                step[free] -= multiplier * moves[:, 1]
        share = share_within(x, step, low, high)
        first, grows = int(share.argmin()), float(weight @ step)
        reached = float(share[first])
        room = np.inf
        if grows > 0.0 and not limited:
            room = max(most - float(weight @ x), 0.0) / grows
        x += min(reached, room, 1.0) * step
        if room < min(reached, 1.0):
            limited = True
        elif reached < 1.0:
            falls = step[first] < 0
            side[first], x[first] = (-1, low[first]) if falls else (1, high[first])
        elif multiplier < 0.0:
            limited = False
        else:
            pull = side * (firm @ x - drawn + multiplier * weight)
            first = int(pull.argmax())
            if pull[first] <= rounding:
                break
            side[first] = 0
    return np.asarray(np.clip(x * scale, least, greatest), dtype=np.float64)


def share_within(x: FloatArray, step: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Share of a step after which each unknown reaches its bound."""
    share = np.full(x.size, np.inf)
    with np.errstate(over="ignore"):  # a vanishing step reaches no bound
        np.divide(np.where(step < 0, low, high) - x, step, out=share, where=step != 0)
    return share
