"""Permutation tests: share of the residual explained beyond random signs of blocks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import sparse

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]

TINY = float(np.finfo(np.float64).tiny)
"""Below it a ratio of two sums is meaningless."""

FLIPS = 2047
"""Random sign patterns of the permutation test."""

FLIPS_AT_ONCE = 64
"""Patterns in memory at a time: all of them for tens of thousands of blocks are half a gigabyte."""

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
    for first in range(0, flips, FLIPS_AT_ONCE):
        rows = np.arange(first, min(first + FLIPS_AT_ONCE, flips))
        if few:
            patterns = (rows[:, None] >> np.arange(blocks)) & 1
        else:
            patterns = generator.integers(0, 2, (rows.size, blocks))
            patterns[rows == 0] = 0
        signs = patterns.astype(np.float64)
        signs *= -2.0
        signs += 1.0
        yield signs


def chance_of(statistics: FloatArray) -> float:
    """Fraction of random sign patterns that give at least the measured value."""
    return float(np.mean(statistics >= statistics[0] * (1 - 1e-12)))


def beyond_chance(observed: float, chance: float) -> float:
    """Share beyond what is expected by chance."""
    return max(0.0, float((observed - chance) / (1.0 - chance))) if chance < 1 else 0.0


def common_part(residual: FloatArray, runs: IntArray, bins: IntArray) -> FloatArray:
    """Part of each sample explained by an offset per run and a curve common to all runs."""
    (many, few), cells = np.unique((runs, bins), axis=1, return_inverse=True)
    cells = np.ravel(cells)
    size = np.bincount(cells)
    scaled = np.bincount(cells, residual) / np.sqrt(size)
    whole = scaled - without_groups(scaled[None], size, many, few)[0]
    return np.asarray((whole / np.sqrt(size))[cells])


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
    (many, few), cells = np.unique((runs, ranges), axis=1, return_inverse=True)
    cells = np.ravel(cells)
    _, blocks = np.unique(blocks, return_inverse=True)
    width, height = many.size, int(blocks.max()) + 1
    # A block has samples in few cells: its sums are a row of a sparse matrix.
    place, inside = np.unique(blocks * width + cells, return_inverse=True)
    sums, counts = np.bincount(inside, residual), np.bincount(inside)
    size = np.bincount(cells)
    at = place // width, place % width
    scaled = sparse.csr_array((sums / np.sqrt(size[at[1]]), at), shape=(height, width))
    within = float(np.sum(sums**2 / counts))
    flips, aparts = [], []
    for signs in random_signs(height, generator):
        flipped = signs @ scaled
        flips.append(np.sum(flipped**2, axis=1))
        aparts.append(np.sum(without_groups(flipped, size, many, few) ** 2, axis=1))
    apart = np.concatenate(aparts)
    alike = np.concatenate(flips) - apart
    # Random signs reintroduce offsets and a common curve, which reduce the variance that can differ
    # between runs.
    parts = apart / np.maximum(within - alike, TINY)
    chance = float(np.mean(parts)) * within
    return beyond_chance(float(apart[0]) / total, chance / total), chance_of(parts)


def without_groups(
    scaled: FloatArray, size: npt.NDArray[Any], many: IntArray, few: IntArray
) -> FloatArray:
    """Subtract the part that a constant for each group of cells explains.

    Parameters
    ----------
    scaled : ndarray
        Rows of cell sums divided by the square roots of `size`.
    size : ndarray
        Samples of each cell.
    many, few : ndarray
        The two groups of each cell: one of a kind with many groups, one of a kind with few.
    """
    root = np.sqrt(size)
    groups = (few[:, None] == np.unique(few)) * root[:, None]
    order = np.unique(many, return_inverse=True)[1]
    inside = np.bincount(order, size)
    # Groups of one kind share no cell, so each is subtracted separately, before those of the other
    # kind.
    rows = np.vstack((scaled, groups.T))
    for row in rows:
        row -= root * (np.bincount(order, root * row) / inside)[order]
    rest, groups = rows[: scaled.shape[0]], rows[scaled.shape[0] :].T
    left, values, _ = np.linalg.svd(groups, full_matrices=False)
    left = left[:, values > 1e-9 * float(root.max())]
    return np.asarray(rest - (rest @ left) @ left.T)
