"""Leave-one-run-out error: every run is predicted by a fit to the others.

One linear step from the fit to all runs approximates it. Only free parameters take the step, within
their bounds; those at a bound are kept. If the step predicts a run clearly worse than the fit to
all, it may be too large, and the other runs are refitted. Each run has its own offset, because the
zero of an encoder is arbitrary.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray, IntArray
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.least_squares import solve_within
from lostmotion.fit.parameters import placed
from lostmotion.rms import rms_of
from lostmotion.threads import in_parallel

DOUBTFUL = 1.1
"""Ratio of the error of a run after the step to that of the fit to all, above which the others are
refitted.
"""

REFIT_STEPS = 12
"""Evaluations of such a fit."""

NEAR_BOUND = 1e-9
"""Relative distance to a bound within which a value is at it."""

RIDGE = 1e-9
"""Relative ridge: values that the other runs do not determine are kept."""


class LeftOut:
    """Prediction of samples that are left out of the fit, in whole pieces.

    Parameters that belong to one recording are still estimated from it: its offset, and the initial
    states of the operators if a session begins with it.

    Parameters
    ----------
    base : BaselineModel
        Fitted to all.
    starts : ndarray, optional
        Offsets of the pieces that are left out; by default the runs.
    rows : ndarray of bool, optional
        Samples that were fitted, whole pieces.

    Attributes
    ----------
    pieces : list of slice
    out : ndarray
        Residual under the fit to all, each piece about its mean, arc seconds.
    """

    def __init__(
        self,
        base: BaselineModel,
        starts: IntArray | None = None,
        rows: BoolArray | None = None,
    ) -> None:
        starts = base.conditions.starts if starts is None else starts
        self.base, self.rows = base, rows
        point = base.at()
        fixed = base.fixed_columns(point)
        out = base.measured - point.angle
        self.pieces = [slice(int(a), int(b)) for a, b in pairwise(starts)]
        for at in self.pieces:
            fixed[at] -= fixed[at].mean(axis=0)
            out[at] -= out[at].mean()
        known = base.precision() * float(np.mean(out**2))
        for block, places in placed(base.blocks()):
            if block.prior is not None and block.prior.per_run:
                known[places.start + block.prior.places] = 1.0 / block.prior.sd**2
        x, low, high = base.vector()
        room = np.where(np.isfinite(high - low), NEAR_BOUND * (high - low), 0.0)
        self.free = (x > low + room) & (x < high - room)
        fixed, known = fixed[:, self.free], known[self.free] / out.size
        # Columns are scaled so that the sum of their square and the prior precision is one.
        norm = np.sqrt(np.einsum("ij,ij->j", fixed, fixed) / out.size + known)
        norm[norm == 0] = 1.0
        fixed /= norm
        self.least, self.most = (low - x)[self.free] * norm, (high - x)[self.free] * norm
        self.fixed, self.norm, self.out = fixed, norm, out
        size = fixed.shape[1]
        self.gram = np.zeros((len(self.pieces), size, size))
        self.slope = np.zeros((len(self.pieces), size))
        for i, at in enumerate(self.pieces):
            if rows is None or rows[at].any():
                self.gram[i] = fixed[at].T @ fixed[at]
                self.slope[i] = fixed[at].T @ out[at]
        self.whole = self.gram.sum(axis=0) + out.size * np.diag(known / norm**2 + RIDGE)
        self.own = own_states(base, self.pieces)

    def normal_without(self, group: Sequence[int]) -> tuple[IntArray, FloatArray]:
        """Unknowns of a fit to the pieces outside a group, and their normal matrix."""
        held = np.zeros(self.free.size, dtype=np.bool_)
        held[np.concatenate([self.own[i] for i in group])] = True
        kept = np.flatnonzero(~held[self.free])
        normal = self.whole - self.sum_of(self.gram, group)
        return kept, normal if kept.size == self.norm.size else normal[np.ix_(kept, kept)]

    @staticmethod
    def sum_of(parts: FloatArray, group: Sequence[int]) -> FloatArray:
        """Sum over the pieces of a group; that of one piece is not copied."""
        return parts[group[0]] if len(group) == 1 else np.asarray(parts[group].sum(axis=0))

    def determined_without(self, group: Sequence[int]) -> BoolArray:
        """Whether the pieces outside a group determine each unknown; a sudden event is in one."""
        seen, every = self.seen
        return np.asarray(every - self.sum_of(seen, group) > RIDGE * every)

    @cached_property
    def seen(self) -> tuple[FloatArray, FloatArray]:
        """Square of every column in each piece, and in all of them."""
        by_piece = np.einsum("kii->ki", self.gram)
        return by_piece, by_piece.sum(axis=0)

    def step_without(self, group: Sequence[int]) -> FloatArray:
        """Step of the unknowns, in units of their columns, to the optimum of the other pieces."""
        # The gradient of a fit to all is zero: that of the others is minus that of the left-out
        # pieces.
        kept, normal = self.normal_without(group)
        least, most = self.least[kept], self.most[kept]
        step = np.zeros(self.norm.size)
        right = -self.sum_of(self.slope, group)[kept]
        # A fit that has not quite converged leaves a slope for what these pieces alone determine.
        right[~self.determined_without(group)[kept]] = 0.0
        step[kept] = np.clip(solve_within(normal, right, least, most), least, most)
        return step

    def stepped(self, group: Sequence[int]) -> list[FloatArray]:
        """Residual of a group's pieces after `step_without`."""
        step = self.step_without(group)
        return [self.out[at] - self.fixed[at] @ step for at in self.pieces_of(group)]

    def refitted(self, group: Sequence[int]) -> list[FloatArray]:
        """Residual of a group's pieces after refitting the others."""
        return residual_without(self.base, self.pieces_of(group), self.rows)

    def residual(self, group: Sequence[int], refits: bool = True) -> list[FloatArray]:
        """Residual of a group's pieces; refitted if the step may be too large."""
        left = self.stepped(group)
        before = np.sqrt(sum(float(self.out[at] @ self.out[at]) for at in self.pieces_of(group)))
        if refits and np.linalg.norm(np.concatenate(left)) > DOUBTFUL * before:
            return self.refitted(group)
        return left

    def residuals(
        self,
        groups: Sequence[Sequence[int]],
        refits: bool = True,
        known: FloatArray | None = None,
    ) -> list[list[FloatArray]]:
        """`residual` of several groups, each left out alone, equal ones once.

        Parameters
        ----------
        groups : sequence
        refits : bool
        known : ndarray, optional
            Residual of every piece alone, if it was computed before.
        """
        keys = [tuple(int(piece) for piece in group) for group in groups]
        found: dict[tuple[int, ...], list[FloatArray]] = {}
        if known is not None:
            found = {(i,): [known[at]] for i, at in enumerate(self.pieces)}
        apart = list(dict.fromkeys(key for key in keys if key not in found))
        rests = in_parallel(lambda group: self.residual(list(group), refits), apart)
        found |= dict(zip(apart, rests, strict=True))
        return [found[key] for key in keys]

    def pieces_of(self, group: Sequence[int]) -> list[slice]:
        """Pieces of a group."""
        return [self.pieces[i] for i in group]


def held_out_residual(
    base: BaselineModel,
    starts: IntArray | None = None,
    rows: BoolArray | None = None,
    groups: Sequence[Sequence[int]] | None = None,
    refits: bool = True,
) -> FloatArray:
    """Residual of every sample for a fit without its piece, arc seconds.

    Parameters
    ----------
    base, starts, rows
        See `LeftOut`.
    groups : sequence, optional
        Numbers of pieces that are left out together; by default each alone. Pieces of no group have
        the residual of the fit to all.
    refits : bool
        Whether the others are refitted if the step may be too large.
    """
    left = LeftOut(base, starts, rows)
    out = left.out.copy()
    groups = [[i] for i in range(len(left.pieces))] if groups is None else groups
    for group, residual in zip(groups, left.residuals(groups, refits), strict=True):
        for at, rest in zip(left.pieces_of(group), residual, strict=True):
            out[at] = rest
    return out


class LeftOutResiduals:
    """Leave-one-run-out residuals of models, of equal ones once."""

    def __init__(self) -> None:
        self.known: dict[Hashable, FloatArray] = {}

    def of(self, base: BaselineModel) -> FloatArray:
        """`held_out_residual` of a model."""
        key = base.content_key()
        if key not in self.known:
            self.known[key] = held_out_residual(base)
        return self.known[key]

    def squares_by_run(self, base: BaselineModel) -> FloatArray:
        """Sum of squares of a model's residual over every run, arc seconds squared."""
        return np.asarray(np.add.reduceat(self.of(base) ** 2, base.conditions.starts[:-1]))


def own_states(base: BaselineModel, pieces: Sequence[slice]) -> list[IntArray]:
    """Places of the start states that belong to a single piece, by piece."""
    out = [np.zeros(0, dtype=np.intp) for _ in pieces]
    for session, places in zip(base.hysteresis.sessions, base.start_places(), strict=True):
        piece = next(i for i, at in enumerate(pieces) if at.stop > session.start)
        out[piece] = np.arange(places.start, places.stop)
    return out


def residual_without(
    base: BaselineModel, ats: Sequence[slice], rows: BoolArray | None
) -> list[FloatArray]:
    """Residual of pieces, arc seconds, for a fit to the other samples, started from the fit to all.

    `rows` are those of `held_out_residual`; the mean of each piece is subtracted.
    """
    others = np.ones(base.conditions.rows, dtype=np.bool_) if rows is None else rows.copy()
    for at in ats:
        others[at] = False
    fitted = base.copy()
    fitted.fit(steps=REFIT_STEPS, rows=others)
    for session, rest in enumerate(base.hysteresis.sessions):
        if any(at.start <= rest.start < at.stop for at in ats):
            fitted.hysteresis.start[session] = base.hysteresis.start[session]
    rest_of = base.measured - fitted.at().angle
    return [np.asarray(rest_of[at] - rest_of[at].mean()) for at in ats]


def held_out_rms(base: BaselineModel) -> float:
    """Root mean square of `held_out_residual` over the runs."""
    return rms_of(held_out_residual(base))
