"""Least squares for the samples of loops, and the covariance of its values.

Samples of a loop are not independent: sensor noise is coloured, and differences between loops are
common to all samples of a loop. Therefore the covariance is that of the delete-one-block jackknife,
linearised at the estimate. Blocks are whole loops if there are enough of them, otherwise parts of
sections. Manual readings are treated as independent.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dpocon, dposv, dpotrf

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.characterize.stretches import FEW_READINGS, Samples

LOOPS_LEAST = 4
"""Least number of loops from which their differences are estimated: with three, Student's t has two
degrees of freedom and a 95 % interval is 4.3 standard errors wide on either side.
"""

PIECES = 8
"""Blocks per loop if there are too few loops: each has about 40 correlated neighbours, and there
are enough blocks for a variance.
"""

SHARED_PIECES = 2
"""Parts of each branch on either side of zero for the common residual of loops."""

SHARED_SHARE = 0.02
"""Share of the fitted variance above which the common residual of the loops is included in the
errors. Chosen: straight lines leave 0.001 for strain-wave and cycloidal drives, but a tenth and
more for a joint that turns without load with coarse encoders.
"""

SINGULAR = 1e-9
"""Reciprocal condition below which equations do not determine their solution."""

WELL_CONDITIONED = 1e-6
"""Reciprocal condition of normal equations above which their solution keeps ten digits."""

DETERMINED = 1e-6
"""A value is determined if less than this share of it is in the null space: rounding of the
decomposition, not of the data.
"""


def without_loop_means(columns: FloatArray, loop: IntArray) -> FloatArray:
    """Subtract the mean of each loop: every loop has its own offset. Loops are in order."""
    edges = np.flatnonzero(np.diff(loop, prepend=-1))
    count = np.diff(edges, append=loop.size)
    if not count.size:
        return columns
    means = np.add.reduceat(columns, edges, axis=0) / count[:, None]
    return np.asarray(columns - np.repeat(means, count, axis=0))


class ScaledColumns:
    """Columns of a linear model, scaled to the same norm.

    Attributes
    ----------
    size : ndarray
        Norms of the columns, 1 where a column is zero.
    scaled : ndarray
    """

    def __init__(self, columns: FloatArray) -> None:
        size = np.sqrt(np.sum(columns**2, axis=0))
        self.columns = columns
        self.size = np.where(size > 0, size, 1.0)
        self.scaled = columns / self.size

    @cached_property
    def normal(self) -> FloatArray:
        """Normal matrix of the scaled columns."""
        return np.asarray(self.scaled.T @ self.scaled)

    def fit(self, values: FloatArray) -> FloatArray:
        """Least squares; minimum norm if it is not unique."""
        found = solve_determined(self.normal, self.scaled.T @ values, WELL_CONDITIONED)
        if found is not None:
            return found / self.size
        return np.asarray(np.linalg.lstsq(self.scaled, values, rcond=SINGULAR)[0] / self.size)

    def determines(self, pick: FloatArray) -> bool:
        """Whether least squares determines the sum of values with these weights."""
        squares, vectors = np.linalg.eigh(self.normal)
        weights = pick / self.size
        nothing = vectors[:, squares <= 1e-12 * squares[-1]]
        return float(np.sum((weights @ nothing) ** 2)) < DETERMINED * float(weights @ weights)


def solve_determined(normal: FloatArray, gradient: FloatArray, least: float) -> FloatArray | None:
    """Solve normal equations; None if their reciprocal condition is not above the least one."""
    if not gradient.size:
        return np.zeros(0)
    factor, found, failed = dposv(normal, gradient)
    if failed:
        return None
    reciprocal, _ = dpocon(factor, float(np.abs(normal).sum(axis=0).max()))
    return np.asarray(found) if reciprocal > least else None


def blocks_of(samples: Samples) -> IntArray:
    """Blocks of the jackknife: loops, or parts of them if there are few."""
    if samples.loops >= LOOPS_LEAST:
        return samples.loop
    # Without a piece on one side of zero, the other side determines the middle of the loop.
    _, half = np.unique(2 * samples.stretch + (samples.torque_Nm > 0), return_inverse=True)
    order = np.argsort(half, kind="stable")
    size = np.bincount(half)
    place = np.empty(half.size, dtype=np.intp)
    place[order] = np.arange(half.size) - (np.cumsum(size) - size)[half[order]]
    each = max(1, -(-PIECES * samples.loops // size.size))
    return np.asarray(half * each + place * each // size[half], dtype=np.intp)


def errors_from(samples: Samples) -> str:
    """State what the standard errors are estimated from."""
    if samples.readings < FEW_READINGS:
        return "readings"
    return "loops" if samples.loops >= LOOPS_LEAST else "pieces of loops"


def shared_rms(samples: Samples, residual: FloatArray) -> float:
    """Rms of the residual common to all loops at a torque and branch, corrected for noise."""
    cell = np.floor(samples.torque_Nm / samples.cell_Nm).astype(np.intp)
    _, place = np.unique(2 * cell + (samples.falling > 0), return_inverse=True)
    count = np.bincount(place)
    mean = np.bincount(place, residual) / count
    within = float(np.mean((residual - mean[place]) ** 2))
    several = count[place] > 1
    if not np.any(several):
        return 0.0
    noise = within * float(np.mean(1.0 / np.maximum(count[place] - 1, 1)[several]))
    return float(np.sqrt(max(float(np.mean(mean[place][several] ** 2)) - noise, 0.0)))


def is_shared(samples: Samples, residual: FloatArray, fitted: FloatArray) -> bool:
    """Whether the residual common to all loops is a large part of the fitted values."""
    if samples.readings < FEW_READINGS or samples.loops < LOOPS_LEAST:
        return False
    return shared_rms(samples, residual) ** 2 > SHARED_SHARE * float(np.var(fitted))


def shared_blocks(samples: Samples) -> IntArray:
    """Parts of the branches on either side of zero, for all loops together."""
    half = 2 * (samples.falling > 0) + (samples.torque_Nm > 0)
    blocks = np.zeros(half.size, dtype=np.intp)
    for i in range(4):
        rows = np.flatnonzero(half == i)
        order = rows[np.argsort(np.abs(samples.torque_Nm[rows]), kind="stable")]
        blocks[order] = SHARED_PIECES * (i + np.arange(order.size) / max(order.size, 1))
    return blocks


def covariance_of(
    samples: Samples, design: ScaledColumns, residual: FloatArray, fitted: FloatArray
) -> tuple[FloatArray, float]:
    """Covariance of least squares and its degrees of freedom.

    For few readings, that of independent errors of equal size, at least the rounding; otherwise by
    leaving out one block at a time, linearised. A residual common to all loops does not appear when
    a loop is left out; if it is large, the covariance of leaving out a part of all loops is added,
    with the degrees of freedom of four quarters.
    """
    scale = np.outer(design.size, design.size)
    if samples.readings < FEW_READINGS:
        left = residual.size - design.size.size - int(np.unique(samples.loop).size)
        dof = float(max(left, 1))
        variance = max(float(residual @ residual) / dof, samples.resolution_rad**2 / 12.0)
        return variance * np.linalg.pinv(design.normal, rcond=1e-9) / scale, dof
    blocks = blocks_of(samples)
    covariance = jackknife(design, residual, blocks) / scale
    # A figure depends on the pieces near its torque: one per branch on either side of zero.
    few = samples.loops < LOOPS_LEAST
    count = 4 * samples.loops if few else int(np.unique(blocks).size)
    if is_shared(samples, residual, fitted):
        shared = jackknife(design, residual, shared_blocks(samples))
        covariance, count = covariance + shared / scale, 4
    return covariance, float(max(count - 1, 1))


def jackknife(design: ScaledColumns, residual: FloatArray, blocks: IntArray) -> FloatArray:
    """Covariance of scaled values by leaving out one block at a time, linearised."""
    whole = design.normal
    order = np.argsort(blocks, kind="stable")
    ends = np.flatnonzero(np.diff(blocks[order])) + 1
    columns, residual = design.scaled[order], residual[order]
    sizes = np.diff(np.concatenate(([0], ends, [order.size])))
    starts, count = np.cumsum(sizes) - sizes, sizes.size
    shifts = np.full((count, columns.shape[1]), np.nan)
    leave_out_short(whole, columns, residual, starts, sizes, shifts)
    for b in np.flatnonzero(np.isnan(shifts).any(axis=1)):
        at = slice(starts[b], starts[b] + sizes[b])
        rest, gradient = whole - columns[at].T @ columns[at], columns[at].T @ residual[at]
        shift = solve_determined(rest, gradient, SINGULAR)
        if shift is None:
            shift = np.asarray(np.linalg.lstsq(rest, gradient, rcond=SINGULAR)[0])
        shifts[b] = shift
    shifts -= shifts.mean(axis=0)
    return np.asarray((count - 1) / count * shifts.T @ shifts)


def leave_out_short(
    whole: FloatArray,
    columns: FloatArray,
    residual: FloatArray,
    starts: IntArray,
    sizes: IntArray,
    shifts: FloatArray,
) -> None:
    """Set the shifts of blocks with fewer rows than columns, all blocks of a size at once.

    With the rows Z of a block in the basis in which the normal matrix is one, leaving it out shifts
    the solution by Z' (1 - Z Z')^-1 times its residual (Woodbury). Blocks without which the others
    do not determine the solution are not set.
    """
    factor, failed = dpotrf(whole)
    if failed or dpocon(factor, float(np.abs(whole).sum(axis=0).max()))[0] <= WELL_CONDITIONED:
        return
    factor = np.triu(factor)
    basis = solve_triangular(factor, columns.T, trans="T").T
    for size in np.unique(sizes[sizes < columns.shape[1]]):
        blocks = np.flatnonzero(sizes == size)
        rows = starts[blocks, None] + np.arange(size)
        z = basis[rows]
        left = np.eye(size) - z @ z.transpose(0, 2, 1)
        # The sum of the eigenvalues of Z Z' is at least the largest.
        determined = np.einsum("kij,kij->k", z, z) < 1.0 - SINGULAR
        determined[~determined] = np.linalg.eigvalsh(left[~determined])[:, 0] > SINGULAR
        blocks, rows, z, left = (x[determined] for x in (blocks, rows, z, left))
        across = np.linalg.solve(left, residual[rows][:, :, None])
        moved = (z.transpose(0, 2, 1) @ across)[:, :, 0]
        shifts[blocks] = solve_triangular(factor, moved.T).T
