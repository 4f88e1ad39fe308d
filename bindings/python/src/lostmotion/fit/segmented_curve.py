"""Torsion curve of the baseline model: odd, rising, piecewise linear, with a data sheet prior.

A data sheet has three slopes, which is not enough to reach the noise of a good encoder; it is the
start and a weak prior.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.drives import KNOT, SLOPE
from lostmotion.effects.conditions import Conditions
from lostmotion.fit.parameters import Block, Filed, Prior, block_names
from lostmotion.fit.point import Point
from lostmotion.torsion_curve import TorsionCurve
from lostmotion.units import ARCSEC

KNOTS = 28
"""Ends of segments of the curve on each side, spaced geometrically. The curve has 59 points, zero
and both ends included; a controller holds 64. With 17 knots the corners of a staged take-up are
still visible.
"""

KNOT_RANGE = (1e-3, 0.9)
"""First and last knot relative to the largest torque."""

SLOPE_MAX = 50.0
"""Largest compliance of a segment relative to its prior, or to the mean one of the drive."""

KNOTS_FILED = Filed("curve.knots_Nm", KNOT, "knot_Nm")
SLOPES_FILED = Filed("curve.slopes", SLOPE, "slope_rad_per_Nm", ARCSEC)
CURVE_FILED = (KNOTS_FILED, SLOPES_FILED)


@dataclass
class SegmentedCurve:
    """Piecewise linear torsion curve.

    Attributes
    ----------
    knots_Nm : ndarray
        Ends of the segments; beyond the last the curve continues with the last slope.
    slopes, prior_slopes : ndarray
        Compliance of each segment, arc seconds per N m, and its prior.
    mean_slope : float
        Mean compliance of the drive, the scale of the bounds.
    """

    knots_Nm: FloatArray
    slopes: FloatArray
    prior_slopes: FloatArray
    mean_slope: float

    @classmethod
    def of_recordings(
        cls, conditions: Conditions, largest_Nm: float, sheet: TorsionCurve | None
    ) -> SegmentedCurve:
        """Knots spaced over the recorded torques, slopes as `begin_from` sets them."""
        empty = np.zeros(0)
        curve = cls(largest_Nm * np.geomspace(*KNOT_RANGE, KNOTS), empty, empty, 1.0)
        curve.begin_from(conditions, conditions.lost_motion, sheet)
        return curve

    def begin_from(
        self, conditions: Conditions, lost_motion: FloatArray, sheet: TorsionCurve | None
    ) -> None:
        """Start with the mean slope of a lost motion, with the slopes of the data sheet as prior.

        Parameters
        ----------
        lost_motion : ndarray
            As recorded, minus known parts other than elasticity, arc seconds.
        sheet : TorsionCurve or None
            Torsion curve of the data sheet.
        """
        c = conditions
        t, y = c.centred(c.torque), c.centred(lost_motion)
        mean = float(t @ y / max(float(t @ t), 1e-300))
        self.mean_slope = abs(mean) if mean else 1.0
        self.slopes = np.full(self.knots_Nm.size + 1, self.mean_slope)
        self.prior_slopes = self.slopes.copy()
        if sheet is not None:
            last = max(1.2 * float(np.max(np.abs(c.torque))), self.knots_Nm[-1])
            ends = np.concatenate(([0.0], self.knots_Nm, [last]))
            self.prior_slopes = np.diff(sheet(ends)) / np.diff(ends) / ARCSEC

    def add_step(self, size: float, within_Nm: float) -> None:
        """Add a step at zero torque in each direction, see `TorsionCurve.with_step`; arc seconds.

        Its end becomes a knot.
        """
        place = int(np.searchsorted(self.knots_Nm, within_Nm))
        if within_Nm not in self.knots_Nm:
            self.knots_Nm = np.insert(self.knots_Nm, place, within_Nm)
            self.slopes = np.insert(self.slopes, place, self.slopes[place])
        self.slopes[: place + 1] += size / within_Nm

    def slope_at(self, wound: FloatArray) -> FloatArray:
        """Slope of the segment of each torque."""
        return self.slopes[np.searchsorted(self.knots_Nm, np.abs(wound), side="right")]

    def angle(self, wound: FloatArray) -> FloatArray:
        """Angle, arc seconds."""
        size = np.abs(wound)
        ends = np.concatenate(([0.0], self.knots_Nm))
        heights = np.concatenate(([0.0], np.cumsum(np.diff(ends) * self.slopes[:-1])))
        angle = np.interp(size, ends, heights)
        angle += self.slopes[-1] * np.maximum(size - ends[-1], 0.0)
        return np.asarray(np.sign(wound) * angle)

    def block(self) -> Block:
        """Slopes, each with a prior of its own size around that of the data sheet.

        For one step its present size counts if that is larger: a gap has slopes far above those of
        the data sheet, and must be free to change when an effect takes over a part of it.
        """
        n = self.slopes.size
        sd = np.maximum(self.prior_slopes, 0.1 * self.mean_slope)

        def fill(point: Point, out: FloatArray) -> None:
            size, turned = np.abs(point.wound), np.sign(point.wound) * point.stiffness
            within = np.empty_like(size)
            for segment, (low, high) in enumerate(pairwise([0.0, *self.knots_Nm, np.inf])):
                np.clip(size, low, high, out=within)
                within -= low
                np.multiply(turned, within, out=out[:, segment])

        return Block(
            block_names("slope", n),
            self.slopes,
            np.zeros(n),
            SLOPE_MAX * np.maximum(self.mean_slope, self.prior_slopes),
            1.0 / np.maximum(sd, self.slopes) ** 2,
            partial(setattr, self, "slopes"),
            fill,
            Prior(np.arange(n), self.prior_slopes, sd),
            filed=SLOPES_FILED,
        )

    def copy(self) -> SegmentedCurve:
        """An independent copy of the curve."""
        return replace(self, slopes=self.slopes.copy())
