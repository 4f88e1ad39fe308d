"""Permutation tests: share of the residual explained beyond random signs of blocks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import sparse

from lostmotion.arrays import FloatArray, IntArray

TINY = float(np.finfo(np.float64).tiny)
"""Below it a ratio of two sums is meaningless."""

FLIPS = 2047
"""Random sign patterns of the permutation test."""

FLIPS_AT_ONCE = 64
"""Patterns in memory at a time."""

SIGNS_AT_ONCE = 2**20
"""Signs in memory at a time, 8 MB: fewer patterns of tens of thousands of blocks. Larger arrays
return their pages to the system after each use, and new pages cost more than the sums."""

SIGNS = np.array([1.0, -1.0])

FULL_FLIPS_BLOCKS = 11
"""Up to this number of blocks all sign patterns are tried."""


def variance_explained(
    residual: FloatArray,
    cells: IntArray,
    blocks: IntArray,
    generator: np.random.Generator,
    covariate: FloatArray | None = None,
) -> tuple[float, float]:
    """Share of the variance that the means of cells explain beyond chance, and its p-value.

    With a covariate, a cell explains the part proportional to the covariate instead of the mean.

    The share expected by chance follows from random signs of whole blocks of the residual, which
    keep the correlation within blocks but not between them.

    Returns
    -------
    share : float
        0 to 1.
    p : float
        The measured pattern counts as one of the patterns.
    """
    _, cells = np.unique(cells, return_inverse=True)
    _, blocks = np.unique(blocks, return_inverse=True)
    width = int(cells.max()) + 1
    height = int(blocks.max()) + 1
    weight = np.ones(residual.size)
    if covariate is not None:
        weight = covariate - (np.bincount(cells, covariate) / np.bincount(cells))[cells]
    size = np.bincount(cells, weight**2)
    sums = np.bincount(blocks * width + cells, weight * residual, width * height)
    scaled = sums.reshape(height, width) / np.sqrt(np.where(size > 0, size, 1.0))
    total = float(np.sum(residual**2))
    if total == 0:
        return 0.0, 1.0
    parts = [
        np.sum((signs @ scaled) ** 2, axis=1) / total for signs in random_signs(height, generator)
    ]
    shares = np.concatenate(parts)
    return beyond_chance(shares[0], float(np.mean(shares))), chance_of(shares)


def random_signs(blocks: int, generator: np.random.Generator) -> Iterator[FloatArray]:
    """Yield sign patterns of blocks, all if the blocks are few; the first is the measured one."""
    few = blocks <= FULL_FLIPS_BLOCKS
    flips = 2 ** (blocks - 1) if few else FLIPS
    at_once = min(FLIPS_AT_ONCE, max(1, SIGNS_AT_ONCE // blocks))
    for first in range(0, flips, at_once):
        rows = np.arange(first, min(first + at_once, flips))
        if few:
            patterns = (rows[:, None] >> np.arange(blocks)) & 1
        else:
            patterns = generator.integers(0, 2, (rows.size, blocks))
            patterns[rows == 0] = 0
        yield SIGNS[patterns]


def chance_of(statistics: FloatArray) -> float:
    """Fraction of random sign patterns that give at least the measured value."""
    return float(np.mean(statistics >= statistics[0] * (1 - 1e-12)))


def beyond_chance(observed: float, chance: float) -> float:
    """Share beyond what is expected by chance."""
    return max(0.0, float((observed - chance) / (1.0 - chance))) if chance < 1 else 0.0


def common_part(residual: FloatArray, runs: IntArray, bins: IntArray) -> FloatArray:
    """Part of each sample explained by an offset per run and a curve common to all runs."""
    cells, cell_of = cells_of(runs, bins)
    scaled = np.bincount(cell_of, residual) / cells.root
    whole = scaled - cells.apart(scaled[None])[0]
    return np.asarray((whole / cells.root)[cell_of])


def explained_apart(
    residual: FloatArray,
    runs: IntArray,
    ranges: IntArray,
    blocks: IntArray,
    generator: np.random.Generator,
) -> tuple[float, float]:
    """Share of the variance between runs beyond chance, and its p-value.

    The zero of a run is arbitrary, and what all runs have in common depends on the torque: neither
    is a difference between runs. The means of a run in ranges of torque are compared with those of
    the other runs apart from a constant, relative to the differences between blocks of a run.
    `residual` is without `common_part`.
    """
    total = float(np.sum(residual**2))
    if total == 0:
        return 0.0, 1.0
    cells, cell_of = cells_of(runs, ranges)
    _, blocks = np.unique(blocks, return_inverse=True)
    width, height = cells.root.size, int(blocks.max()) + 1
    # A block has samples in few cells: its sums are a row of a sparse matrix.
    place, inside = np.unique(blocks * width + cell_of, return_inverse=True)
    sums, counts = np.bincount(inside, residual), np.bincount(inside)
    at = np.divmod(place, width)
    scaled = sparse.csr_array((sums / cells.root[at[1]], at), shape=(height, width))
    within = float(np.sum(sums**2 / counts))
    flips, aparts = [], []
    for signs in random_signs(height, generator):
        flipped = signs @ scaled
        flips.append(np.sum(flipped**2, axis=1))
        aparts.append(np.sum(cells.apart(flipped) ** 2, axis=1))
    apart = np.concatenate(aparts)
    alike = np.concatenate(flips) - apart
    # Random signs reintroduce offsets and a common curve, which reduce the variance that can differ
    # between runs.
    parts = apart / np.maximum(within - alike, TINY)
    chance = float(np.mean(parts)) * within
    return beyond_chance(float(apart[0]) / total, chance / total), chance_of(parts)


def cells_of(many: IntArray, few: IntArray) -> tuple[Cells, IntArray]:
    """Cells of samples with the same two numbers, and the cell of each sample."""
    width = int(few.max()) + 1
    pairs, cell_of = np.unique(many * width + few, return_inverse=True)
    many, few = np.divmod(pairs, width)
    return Cells(np.bincount(cell_of), many, few), np.asarray(cell_of)


class Cells:
    """Cells in two kinds of groups: a kind with many groups and one with few.

    Parameters
    ----------
    size : ndarray
        Samples of each cell.
    many, few : ndarray
        The two groups of each cell.

    Attributes
    ----------
    root : ndarray
        Square roots of `size`.
    """

    def __init__(self, size: IntArray, many: IntArray, few: IntArray) -> None:
        self.root = np.sqrt(size)
        self._order = np.unique(many, return_inverse=True)[1]
        self._inside = np.bincount(self._order, size)
        # Groups of one kind share no cell, so each is subtracted separately, before those of the
        # other kind.
        groups = (few[:, None] == np.unique(few)) * self.root[:, None]
        left, values, _ = np.linalg.svd(self._without_many(groups.T).T, full_matrices=False)
        self._few = left[:, values > 1e-9 * float(self.root.max())]

    def _without_many(self, rows: FloatArray) -> FloatArray:
        rows = rows.copy(order="K")
        for row in rows:
            row -= (
                self.root * (np.bincount(self._order, self.root * row) / self._inside)[self._order]
            )
        return rows

    def apart(self, scaled: FloatArray) -> FloatArray:
        """Subtract the part that a constant for each group explains.

        Parameters
        ----------
        scaled : ndarray
            Rows of cell sums divided by `root`.
        """
        rest = self._without_many(scaled)
        return np.asarray(rest - (rest @ self._few) @ self._few.T)
