"""The other form of friction: contacts in parallel with the elasticity, that stick by the angle.

The base lets friction stick by the torque, as a controller runs it. Contacts beside a spring that
hardens take up most where it is soft: the share of the torque that they hold until they slip is
k s / (1 + k s) with their stiffness k and the compliance s of the drive, not the same everywhere.
Loops of one size hardly tell the two apart; small loops beside large ones do. What stands apart in
the base's form alone, and hangs on the load, is no unknown cause.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from lostmotion.discover.base import FIRST_SHARES, Base
from lostmotion.discover.study import Settled, plain_rms, settle

FloatArray = npt.NDArray[np.float64]

GRIPS = (2.0, 1.0, 0.5, 0.25)
"""Stiffness of friction's contacts that are tried, over that of the drive under load."""

ROUNDS = 2
"""Fits of each: what the contacts hold hangs on the slopes, which a fit changes."""

FIT_STEPS = 25

SMOOTH = 0.5
"""Spread, in logarithms of the torque, over which the compliance is taken: single slopes at next to
no torque are told by few samples."""

UNDER_LOAD = 8
"""Last stretches, in which the drive is under load."""


def other_form(settled: Settled) -> Settled | None:
    """Fit the other form of friction; None where it explains no more than the base's own."""
    found = [with_grip(settled, grip) for grip in GRIPS]
    best = settle(min(found, key=plain_rms), settled.noise)
    better = best.contest.null_objective < settled.contest.null_objective
    return best if better else None


def with_grip(settled: Settled, grip: float) -> Base:
    """Fit a base whose friction sticks by the angle, from where no run differs from another."""
    base = settled.base.copy()
    base.deviations[:] = 0.0
    base.shares[:] = FIRST_SHARES[-1]
    base.start[:] = 0.0
    for _ in range(ROUNDS):
        hold = grip * smooth_slopes(base)
        hold /= hold[-UNDER_LOAD:].mean() / grip
        base.play_slopes = hold / (1 + hold) * (1 + grip) / grip
        base.fit(noise=float(np.median(settled.noise.sigma)), steps=FIT_STEPS)
    return base


def smooth_slopes(base: Base) -> FloatArray:
    """Compliance of each stretch with its neighbours, arc seconds a N m."""
    ends = np.concatenate(([0.0], base.knots_Nm, [max(base.largest, 1.01 * base.knots_Nm[-1])]))
    length, place = np.diff(ends), np.log(0.5 * (ends[1:] + ends[:-1]))
    near = np.exp(-0.5 * ((place[:, None] - place) / SMOOTH) ** 2) * length
    return np.asarray(near @ base.slopes / near.sum(axis=1))
