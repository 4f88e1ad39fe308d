"""A baseline model from few readings: as many values as they determine, with errors.

A torque wrench and a dial gauge give 5 to 30 readings. They determine one to three slopes and one
loop width (`lostmotion.characterize`), not the compliances and operators of a fit to a log. The
values are stored in a baseline model in the form of a drive file: slopes between its knots, and the
width as one play operator in series with the spring.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.characterize.characterization import fit_torsion_curve
from lostmotion.characterize.stretches import Samples, collect
from lostmotion.characterize.three_slopes import CurveFit, left_out
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.hysteresis import (
    ENVELOPE_FILED,
    KNEE_FILED,
    OUTSIDE_FILED,
    PLAYS,
    RADII_FILED,
    SHARES_FILED,
)
from lostmotion.fit.segmented_curve import KNOTS_FILED, SLOPES_FILED
from lostmotion.units import ARCSEC

STICKING = 0.9
"""Share of the least compliance that the operator may remove while it sticks, so that the angle
still rises with the torque and the model has an inverse.
"""

TABLE = (
    SLOPES_FILED,
    SHARES_FILED,
    ENVELOPE_FILED,
    OUTSIDE_FILED,
    KNOTS_FILED,
    RADII_FILED,
    KNEE_FILED,
)
"""Parameters of the covariance, in the order of a fit to many readings: parameters, then the grid.
"""


@dataclass(frozen=True)
class FewReadings:
    """A baseline model that was set from few readings.

    Attributes
    ----------
    base : BaselineModel
        With the values in it.
    fit : CurveFit
        The values with their covariance.
    samples : Samples
        The readings on loops that were used.
    operator : int
        Index of the operator with the width.
    """

    base: BaselineModel
    fit: CurveFit
    samples: Samples
    operator: int

    @property
    def values(self) -> int:
        """Number of values that were estimated, offsets included."""
        fit = self.fit
        flat = int(np.unique(self.samples.loop).size)
        return flat + fit.slopes_rad_per_Nm.size + fit.kinks_Nm.size + fit.half_width_rad.size

    @property
    def error_arcsec(self) -> float:
        """Standard deviation of a reading, from the residual."""
        squares = float(self.fit.residual_rad @ self.fit.residual_rad)
        return float(np.sqrt(squares / self.fit.dof)) / ARCSEC

    def heldout(self) -> FloatArray:
        """Leave-one-out residual of every reading, arc seconds.

        Readings outside loops are never used in the fit.
        """
        residual = self.base.residual()
        rows = self.samples.rows
        residual[rows] = left_out(self.samples, self.fit) / ARCSEC
        return residual

    def table(self) -> tuple[list[str], FloatArray, FloatArray]:
        """Values by the names of a drive file, and the covariance of the estimated ones."""
        curve, fit = self.base.curve, self.fit
        stretches = curve.slopes.size
        kept = [(filed, filed.of(self.base)) for filed in TABLE]
        names = [name for filed, numbers in kept for name in filed.keys(numbers.size)]
        values = np.concatenate([numbers for _, numbers in kept])
        slopes = fit.slopes_rad_per_Nm.size
        made_of = np.zeros((values.size, fit.covariance.shape[0]))
        made_of[np.arange(stretches), stretch_of(curve.knots_Nm, fit.kinks_Nm)] = 1.0
        if fit.half_width_rad.size:
            row = stretches + PLAYS + 1 + self.operator
            made_of[row, slopes + fit.kinks_Nm.size] = (
                1.0 / self.base.hysteresis.radius_Nm[self.operator]
            )
        return names, values, made_of @ fit.covariance @ made_of.T


def stretch_of(knots_Nm: FloatArray, kinks_Nm: FloatArray) -> IntArray:
    """Index of the slope of each segment between knots, and beyond the last."""
    begins = np.concatenate(([0.0], knots_Nm))
    return np.searchsorted(kinks_Nm, begins, side="right").astype(np.intp)


def fit_few_readings(base: BaselineModel) -> FewReadings | None:
    """Set a baseline model from few readings; None if they determine no slope.

    Parameters
    ----------
    base : BaselineModel
        Model of the readings; it receives the values.
    """
    samples = collect(base.conditions.campaign)
    fit, _ = fit_torsion_curve(samples)
    if fit is None or np.any(fit.slopes_rad_per_Nm <= 0):
        return None
    curve, hysteresis = base.curve, base.hysteresis
    for kink in fit.kinks_Nm:
        curve.knots_Nm[int(np.argmin(np.abs(curve.knots_Nm - kink)))] = kink
    curve.knots_Nm = np.sort(curve.knots_Nm)
    curve.slopes = fit.slopes_rad_per_Nm[stretch_of(curve.knots_Nm, fit.kinks_Nm)] / ARCSEC
    base.terms = []  # readings of one loop do not determine an effect in addition
    hysteresis.take_inside_out()
    hysteresis.outside = np.zeros(PLAYS)
    operator = 0
    if fit.half_width_rad.size and fit.half_width_rad[0] > 0:
        half = float(fit.half_width_rad[0])
        least = half / (STICKING * float(fit.slopes_rad_per_Nm.min()))
        wide = np.flatnonzero(hysteresis.radius_Nm >= least)
        operator = int(wide[0]) if wide.size else PLAYS - 1
        hysteresis.outside[operator] = half / hysteresis.radius_Nm[operator] / ARCSEC
    return FewReadings(base, fit, samples, operator)
