"""Deviations of each run in the baseline model: stiffness, friction and gap."""

from __future__ import annotations

import numpy as np

from lostmotion.arrays import FloatArray

DEVIATIONS = ("stiffness", "friction", "gap")
"""Run-to-run scatter in addition to the offset: the logarithms of the factors on the torsion curve
and on the half widths, and a gap in arc seconds. A value of the model that is a factor of all runs
is then exactly a common deviation, however large those of the runs are.
"""

STIFFNESS, FRICTION, GAP = range(len(DEVIATIONS))
"""Columns of the deviations, one row per run."""

DEVIATION_MAX = float(np.log(2.0))
"""Largest deviation of stiffness and friction, a factor of two: beyond it is another drive."""

GAP_CLOSES = 0.004
"""Torque at which a radial gap is closed, relative to rated torque (model 9a: 0.1 to 0.5 %).
Effects of a gap start from the same value (lib/runtime/effects/closed_share.h)."""


def width_factor(deviations: FloatArray) -> FloatArray:
    """Factor of each run on the half widths of the hysteresis operators."""
    return np.asarray(np.exp(np.clip(deviations[:, FRICTION], -DEVIATION_MAX, DEVIATION_MAX)))


def stiffness_factor(deviations: FloatArray) -> FloatArray:
    """Factor of each run on the torsion curve."""
    return np.asarray(np.exp(np.clip(deviations[:, STIFFNESS], -DEVIATION_MAX, DEVIATION_MAX)))


def gap_closed(wound: FloatArray, rated_torque_Nm: float) -> FloatArray:
    """Share of a gap that a torque has closed, -1 to 1, as the effects of a gap define it."""
    return np.asarray(np.clip(wound / (GAP_CLOSES * rated_torque_Nm), -1.0, 1.0))
