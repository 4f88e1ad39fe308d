"""Held-out error: every run under a fit to the others.

What a run changes of one linear step comes close to it. Only parameters that are free take the
step, and none leaves its bounds; those at a bound stay there. Where the step predicts a run clearly
worse than the fit to all, it may have gone too far, and the others are fitted in truth. Offsets are
each run's own, because the zero of an encoder is arbitrary.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.least_squares import solve_within
from lostmotion.fit.parameters import placed

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]

DOUBTFUL = 1.1
"""Error of a run after the step, over that under the fit to all, from which the others are fitted
in truth."""

REFIT_STEPS = 12
"""Evaluations of such a fit."""

NEAR_BOUND = 1e-9
"""A value this near to a bound, over the width between both, stands there but for rounding."""

RIDGE = 1e-9
"""Relative ridge: what the other runs do not see stays where it is."""


def held_out_residual(
    base: BaselineModel,
    starts: IntArray | None = None,
    rows: npt.NDArray[np.bool_] | None = None,
    groups: Sequence[Sequence[int]] | None = None,
    refits: bool = True,
) -> FloatArray:
    """Residual of every sample under a fit without its piece, arc seconds.

    What belongs to a recording alone is its own here too: its offset, and where the operators stood
    before it, where a session begins with it.

    Parameters
    ----------
    base : BaselineModel
        Fitted to all.
    starts : ndarray, optional
        Offsets of the pieces that are left out; by default the runs.
    rows : ndarray of bool, optional
        Samples that were fitted, whole pieces.
    groups : sequence, optional
        Numbers of pieces that are left out together; by default each alone. Those of no group keep
        the residual of the fit to all.
    refits : bool
        Whether the others are fitted in truth where the step may have gone too far.
    """
    starts = base.conditions.starts if starts is None else starts
    point = base.at()
    fixed = base.fixed_columns(point)
    out = base.measured - point.angle
    pieces = [slice(int(a), int(b)) for a, b in pairwise(starts)]
    groups = [[i] for i in range(len(pieces))] if groups is None else groups
    for at in pieces:
        fixed[at] -= fixed[at].mean(axis=0)
        out[at] -= out[at].mean()
    known = base.precision() * float(np.mean(out**2))
    for block, places in placed(base.blocks()):
        if block.prior is not None and block.prior.per_run:
            known[places.start + block.prior.places] = 1.0 / block.prior.sd**2
    x, low, high = base.vector()
    room = np.where(np.isfinite(high - low), NEAR_BOUND * (high - low), 0.0)
    free = (x > low + room) & (x < high - room)
    fixed, known = fixed[:, free], known[free] / out.size
    # The units of a column are such that it and what is known of its value are one together.
    norm = np.sqrt(np.einsum("ij,ij->j", fixed, fixed) / out.size + known)
    norm[norm == 0] = 1.0
    fixed /= norm
    least, most = (low - x)[free] * norm, (high - x)[free] * norm
    size = fixed.shape[1]
    gram = np.zeros((len(pieces), size, size))
    slope = np.zeros((len(pieces), size))
    for i, at in enumerate(pieces):
        if rows is None or rows[at].any():
            gram[i] = fixed[at].T @ fixed[at]
            slope[i] = fixed[at].T @ out[at]
    whole = gram.sum(axis=0) + out.size * np.diag(known / norm**2 + RIDGE)
    own = own_states(base, pieces)
    for group in groups:
        # Nothing pulls at a fit to all: what the others want is what the pieces do not.
        held = np.isin(np.flatnonzero(free), np.concatenate([own[i] for i in group]))
        kept = np.flatnonzero(~held)
        normal = whole - gram[group].sum(axis=0)
        step = np.zeros(size)
        step[kept] = np.clip(
            solve_within(
                normal[np.ix_(kept, kept)], -slope[group].sum(axis=0)[kept], least[kept], most[kept]
            ),
            least[kept],
            most[kept],
        )
        ats = [pieces[i] for i in group]
        before = np.sqrt(sum(float(out[at] @ out[at]) for at in ats))
        left = [out[at] - fixed[at] @ step for at in ats]
        if refits and np.linalg.norm(np.concatenate(left)) > DOUBTFUL * before:
            left = residual_without(base, ats, rows)
        for at, rest in zip(ats, left, strict=True):
            out[at] = rest
    return out


def own_states(base: BaselineModel, pieces: Sequence[slice]) -> list[IntArray]:
    """Places of the start states among the parameters that belong to each piece alone."""
    out = [np.zeros(0, dtype=np.intp) for _ in pieces]
    for session, places in zip(base.hysteresis.sessions, base.start_places(), strict=True):
        piece = next(i for i, at in enumerate(pieces) if at.stop > session.start)
        out[piece] = np.arange(places.start, places.stop)
    return out


def residual_without(
    base: BaselineModel, ats: Sequence[slice], rows: npt.NDArray[np.bool_] | None
) -> list[FloatArray]:
    """Residual of pieces, arc seconds, under a fit to the samples beside them, from the fit to all.

    `rows` are those of `held_out_residual`; the mean of each piece is taken off.
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
    return float(np.sqrt(np.mean(held_out_residual(base) ** 2)))
