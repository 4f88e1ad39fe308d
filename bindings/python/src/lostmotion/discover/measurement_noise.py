"""The largest linear model: its residual is the measurement noise; it shows what is confounded."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TypeVar

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.discover.linearise import columns_of
from lostmotion.effects.conditions import Conditions, side_by_side
from lostmotion.evidence.noise import Noise, fit_noise
from lostmotion.evidence.torque_error import relative_noise
from lostmotion.fit.baseline import BaselineModel
from lostmotion.threads import in_parallel

CALM_RIDGE = 1e-7
"""Relative ridge of the large least squares fit whose residual gives the noise."""


ROWS_AT_ONCE = 2048
"""Rows of all columns in a piece."""

PIECES_AT_ONCE = 8
"""Pieces whose products are in memory together."""

Answer = TypeVar("Answer")


@dataclass
class LargestModel:
    """The baseline model with the columns of all blocks, linear, without deviations of runs.

    Attributes
    ----------
    base : BaselineModel
    residual : ndarray or None
        What none of the columns follows, arc seconds; None if it was not wanted.
    normal : ndarray
        Gram matrix of the columns, centred by run and of unit length.
    norm : ndarray
        Length of the columns.
    along : ndarray
        Product of the columns with the residual of the baseline model, arc seconds.
    places : list of slice
        Columns of the baseline model, and of each block.
    """

    base: BaselineModel
    residual: FloatArray | None
    normal: FloatArray
    norm: FloatArray
    along: FloatArray
    places: list[slice]

    @classmethod
    def of(
        cls, base: BaselineModel, blocks: Sequence[FloatArray], wanted: bool = True
    ) -> LargestModel:
        """The largest model at the present point of a baseline model.

        Its residual takes a second pass over all columns; without it `noise` is not available.
        """
        point = base.at()
        fixed, _, scatter, _ = columns_of(base, point, form=False)
        residual = base.residual(point)
        parts = [side_by_side(fixed, scatter[:, :3]), *blocks]
        ends = np.cumsum([0, *(part.shape[1] for part in parts)])
        places = [slice(a, b) for a, b in pairwise(ends.tolist())]
        width = int(ends[-1])
        square, along = np.zeros((width, width)), np.zeros(width)

        def products(at: slice, piece: FloatArray) -> tuple[FloatArray, FloatArray]:
            return piece @ piece.T, piece @ residual[at]

        for own, along_own in over_pieces(base.conditions, parts, products):
            square += own
            along += along_own
        norm = np.sqrt(np.diag(square))
        norm[norm == 0] = 1.0
        normal = square / np.outer(norm, norm)
        normal[np.diag_indices_from(normal)] += CALM_RIDGE
        along /= norm
        if not wanted:
            return cls(base, None, normal, norm, along, places)
        step = np.linalg.solve(normal, along) / norm
        rest = base.conditions.centred(residual)

        # A column that is constant in every run has only rounding left: its step is huge.
        def subtract(at: slice, piece: FloatArray) -> None:
            rest[at] -= step @ piece

        for _ in over_pieces(base.conditions, parts, subtract):
            pass
        return cls(base, rest, normal, norm, along, places)

    def noise(self) -> Noise:
        """Noise model of the residual."""
        assert self.residual is not None
        c, point = self.base.conditions, self.base.at()
        relative = relative_noise(self.residual, point.swing, self.base.largest)
        return fit_noise(self.residual, c.time_s, c.starts, self.normal.shape[0], relative)

    @cached_property
    def beside_baseline(self) -> FloatArray:
        """Gram matrix of all columns beside the baseline model."""
        return self.beside(np.r_[self.places[0]])

    @cached_property
    def beside_last(self) -> FloatArray:
        """Gram matrix of all columns beside the baseline model and the last block."""
        return self.beside(np.r_[self.places[0], self.places[-1]])

    def beside(self, known: IntArray) -> FloatArray:
        """Gram matrix of all columns after projection on the complement of some."""
        cross = self.normal[known]
        inner = self.normal[np.ix_(known, known)]
        return np.asarray(self.normal - cross.T @ np.linalg.solve(inner, cross))

    def followed_by_last(self, beside: Sequence[int]) -> float:
        """Mean square of the residual that only the last block follows, arc seconds squared.

        Parameters
        ----------
        beside : sequence of int
            Numbers of the blocks that are in the model, in addition to the baseline.
        """
        known = np.r_[tuple(self.places[k] for k in (0, *(1 + number for number in beside)))]
        last = np.r_[self.places[-1]]
        cross = np.linalg.solve(self.normal[np.ix_(known, known)], self.normal[np.ix_(known, last)])
        own = self.normal[np.ix_(last, last)] - self.normal[np.ix_(last, known)] @ cross
        rest = self.along[last] - cross.T @ self.along[known]
        return float(rest @ np.linalg.solve(own, rest)) / self.base.conditions.rows

    def width(self, block: int) -> int:
        """Number of columns of a block before the last; 0 if there is none of this number."""
        if 1 + block >= len(self.places) - 1:
            return 0
        return int(np.r_[self.places[1 + block]].size)

    def beyond_last(self, block: int, coefficients: FloatArray) -> float:
        """Share of what a block contributes that the last one cannot follow, beside the baseline.

        Parameters
        ----------
        block : int
            Its number.
        coefficients : ndarray
            Of its columns.
        """
        own = self.places[1 + block]
        x = coefficients * self.norm[own]
        whole, left = (
            float(x @ gram[own, own] @ x) for gram in (self.beside_baseline, self.beside_last)
        )
        return left / whole if whole > 0.0 else 1.0


def over_pieces(
    c: Conditions, parts: Sequence[FloatArray], work: Callable[[slice, FloatArray], Answer]
) -> Iterator[Answer]:
    """Apply a function to the columns, centred by run and transposed, some rows at a time.

    The columns are never in memory together: they would be several times the recordings.
    """
    means = np.concatenate([c.run_mean(part).T for part in parts])

    def one(first: int) -> Answer:
        at = slice(first, min(first + ROWS_AT_ONCE, c.rows))
        piece = np.concatenate([part[at].T for part in parts])
        for run in range(c.run_of[first], c.run_of[at.stop - 1] + 1):
            own = slice(max(int(c.starts[run]) - first, 0), int(c.starts[run + 1]) - first)
            piece[:, own] -= means[:, run, None]
        return work(at, piece)

    for begin in range(0, c.rows, PIECES_AT_ONCE * ROWS_AT_ONCE):
        end = min(begin + PIECES_AT_ONCE * ROWS_AT_ONCE, c.rows)
        yield from in_parallel(one, range(begin, end, ROWS_AT_ONCE))


def estimate_noise(base: BaselineModel, blocks: Sequence[FloatArray]) -> Noise:
    """Estimate the noise model from the residual of the largest model."""
    return LargestModel.of(base, blocks).noise()
