"""Held-out error: every run under a fit to the others.

What a run changes of one linear step comes close to it. Only parameters that are free take the
step, and none leaves its bounds; those at a bound stay there. Where the step predicts a run clearly
worse than the fit to all, it may have gone too far, and the others are fitted in truth. Offsets are
each run's own, because the zero of an encoder is arbitrary.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import numpy as np
import numpy.typing as npt

from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.least_squares import solve_within
from lostmotion.fit.parameters import placed

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]

Friction = Literal["inside", "both"]

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
    base: BaselineModel, starts: IntArray | None = None, rows: npt.NDArray[np.bool_] | None = None
) -> FloatArray:
    """Residual of every sample under a fit without its piece, arc seconds.

    Parameters
    ----------
    base : BaselineModel
        Fitted to all.
    starts : ndarray, optional
        Offsets of the pieces that are left out together; by default the runs.
    rows : ndarray of bool, optional
        Samples that were fitted, whole pieces.
    """
    starts = base.conditions.starts if starts is None else starts
    point = base.at()
    fixed = base.fixed_columns(point)
    out = base.measured - point.angle
    pieces = [slice(int(a), int(b)) for a, b in pairwise(starts)]
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
    for i, at in enumerate(pieces):
        before = float(np.linalg.norm(out[at]))
        # Nothing pulls at a fit to all: what the others want is what the piece does not.
        step = solve_within(whole - gram[i], -slope[i], least, most)
        out[at] -= fixed[at] @ np.clip(step, least, most)
        if np.linalg.norm(out[at]) > DOUBTFUL * before:
            out[at] = residual_without(base, at, rows)
    return out


def residual_without(
    base: BaselineModel, at: slice, rows: npt.NDArray[np.bool_] | None
) -> FloatArray:
    """Residual of a piece, arc seconds, under a fit to the samples beside it, from the fit to all.

    `rows` are those of `held_out_residual`; the mean is taken off.
    """
    others = np.ones(base.conditions.rows, dtype=np.bool_) if rows is None else rows.copy()
    others[at] = False
    fitted = base.copy()
    fitted.fit(steps=REFIT_STEPS, rows=others)
    rest = base.measured[at] - fitted.at().angle[at]
    return np.asarray(rest - rest.mean())


def held_out_rms(base: BaselineModel) -> float:
    """Root mean square of `held_out_residual` over the runs."""
    return float(np.sqrt(np.mean(held_out_residual(base) ** 2)))
