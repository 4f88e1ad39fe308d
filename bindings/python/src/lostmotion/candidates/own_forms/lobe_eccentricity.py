"""Eccentric lobes: run-out in four directions in addition to the first order."""

from __future__ import annotations

from itertools import product

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.candidates.tangents import Tangents, at_base, start_points, unit_size
from lostmotion.effects.effect import Effect
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.point import Point

RUNOUT_RAD = 2e-5
CLOSING_ANGLE = 2.0
CLOSING_SHARES = (0.1, 1.0)
"""Starts for eccentric lobes: run-out; angle over which the teeth of a lobe come into contact,
relative to the run-out; torque for this, relative to rated torque.
"""


class Lobes:
    """Eccentric lobes: run-out in four directions in addition to the first order.

    The run-out is not a linear value. One lobe leads and the other lags: a negative size is that of
    lobes turned by a quarter turn, which have a separate start.
    """

    def linearise(
        self, effect: Effect, base: BaselineModel, point: Point, ratio: float
    ) -> Tangents:
        """See `Form`."""
        values = start_points(effect, base, ratio)[0]
        made = Tangents([], [], [])
        for i in effect.indices("linear"):
            unit = values.copy()
            unit[2:4] = 0.0
            unit[i] = unit_size(effect, i) or 1e-5
            made.columns.append(at_base(effect, unit, base, point) / unit[i])
            made.start_of.append(0)
        for share, angle in product(CLOSING_SHARES, np.arange(4) * np.pi / 4):
            start = values.copy()
            start[0] = start[1] = 0.0
            start[2], start[3] = RUNOUT_RAD * np.cos(angle), RUNOUT_RAD * np.sin(angle)
            start[5] = share * base.rated_torque_Nm
            start[4] = CLOSING_ANGLE * RUNOUT_RAD / start[5]
            made.start_of.append(len(made.starts))
            made.starts.append(start)
            made.columns.append(at_base(effect, start, base, point) / RUNOUT_RAD)
        return made

    def values(
        self, effect: Effect, of: Tangents, start: int, coefficients: FloatArray
    ) -> FloatArray:
        """See `Form`: run-out and compliance change together; the shape over the torque is kept."""
        values = of.starts[start].copy()
        runout = np.hypot(values[2], values[3])
        size = coefficients[0]
        if start == 0:
            values[:2] = coefficients[:2]
            size = coefficients[2] if coefficients.size > 2 else runout
        values[2:5] *= abs(size) / runout
        return values

    def right_way(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`."""
        return bool(coefficients[-1] > 0)

    def possible(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`."""
        return True


FORM = Lobes()
