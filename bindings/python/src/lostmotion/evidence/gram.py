"""Sufficient statistics: one Gram matrix of whitened columns for each run.

All later computations (one-step refit, tests, scatter, leave-one-run-out, angles, next run) use
only these small dense matrices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.evidence.noise import Noise
from lostmotion.threads import in_parallel

RIDGE = 1e-10
"""Relative ridge of normal equations: undetermined values are kept."""


@dataclass
class Evidence:
    """Gram matrices ``[run, column, column]`` of whitened, scaled columns.

    Attributes
    ----------
    gram : ndarray
        In units of the innovation variance.
    scale : ndarray
        Divisor of each column.
    fixed, scatter, response : ndarray or int
        Places of the baseline columns, of the scattering columns, and of the residual.
    blocks : dict
        Places of each candidate's columns.
    precision : ndarray
        Prior precision of the fixed columns, scaled as they are.
    """

    gram: FloatArray
    scale: FloatArray
    fixed: IntArray
    scatter: IntArray
    blocks: dict[str, IntArray]
    response: int
    precision: FloatArray

    @property
    def runs(self) -> int:
        """Number of runs."""
        return int(self.gram.shape[0])

    @cached_property
    def total(self) -> FloatArray:
        """Gram matrix of all runs together."""
        return np.asarray(self.gram.sum(axis=0))

    def ridge(self, index: IntArray) -> FloatArray:
        """Prior precision of the columns of a hypothesis; the last column is the residual."""
        out = np.zeros(index.size - 1)
        out[: self.fixed.size] = self.precision
        return out + RIDGE * np.maximum(np.diag(self.total)[index[:-1]], 1.0)

    def index(self, *blocks: str) -> IntArray:
        """Places of the columns of the baseline model and of some blocks; the residual is last."""
        parts = [self.fixed, *(self.blocks[name] for name in blocks), np.array([self.response])]
        return np.concatenate(parts).astype(np.intp)


def gather(
    fixed: FloatArray,
    precision: FloatArray,
    scatter: FloatArray,
    blocks: Sequence[tuple[str, FloatArray]],
    response: FloatArray,
    noise: Noise,
    starts: IntArray,
) -> Evidence:
    """Whiten all columns and form the Gram matrix of each run.

    Parameters
    ----------
    fixed, scatter, blocks
        Columns ``[row, column]`` in arc seconds per unit.
    precision : ndarray
        Prior precision of the fixed columns.
    response : ndarray
        Residual of the linearised model, with deviations added back.
    """
    parts = [fixed, scatter, *(columns for _, columns in blocks), response[:, None]]
    counts = [part.shape[1] for part in parts]
    offsets = np.concatenate(([0], np.cumsum(counts)))
    total = int(offsets[-1])
    rows = response.size
    squares = np.concatenate([np.einsum("ij,ij->j", part, part) for part in parts])
    scale = np.sqrt(squares / rows)
    scale[(scale == 0) | ~np.isfinite(scale)] = 1.0
    scale[-1] = 1.0
    runs = starts.size - 1
    gram = np.empty((runs, total, total))

    def multiply(r: int) -> None:
        a, b = int(starts[r]), int(starts[r + 1])
        piece = np.empty((b - a, total), order="F")
        for part, at, count in zip(parts, offsets[:-1], counts, strict=True):
            np.divide(part[a:b], scale[at : at + count], out=piece[:, at : at + count])
        white = noise.whiten(piece, r)
        np.matmul(white.T, white, out=gram[r])

    in_parallel(multiply, range(runs))
    places = [np.arange(offsets[i], offsets[i + 1], dtype=np.intp) for i in range(len(parts))]
    return Evidence(
        gram,
        scale,
        places[0],
        places[1],
        {name: place for (name, _), place in zip(blocks, places[2:-1], strict=True)},
        total - 1,
        precision / scale[places[0]] ** 2,
    )
