"""A baseline model from few readings: as many values as they carry, and how far each is known.

A torque wrench and a dial gauge give 5 to 30 readings. They carry one to three slopes and one width
of the loop (`lostmotion.characterize`), not the compliances and operators of a fit to a log. The
values are put into a baseline model, in the form in which a drive file keeps it: the slopes on its
knots, the width as one play operator outside the elasticity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lostmotion.characterize.characterization import torsion_curve
from lostmotion.characterize.stretches import Samples, collect
from lostmotion.characterize.three_slopes import CurveFit, left_out
from lostmotion.drives import (
    KNOT,
    PLAY_ENVELOPE,
    PLAY_KNEE,
    PLAY_OUTSIDE,
    PLAY_RADIUS,
    PLAY_SHARE,
    SLOPE,
    row_names,
)
from lostmotion.fit.baseline import PLAYS, Base
from lostmotion.units import ARCSEC

FloatArray = npt.NDArray[np.float64]

STICKING = 0.9
"""Share of the stiffest slope's compliance that the operator may take off while it sticks: the
angle then still rises with the torque, and the model has an inverse."""


@dataclass(frozen=True)
class FewReadings:
    """A baseline model that was set from few readings.

    Attributes
    ----------
    base : Base
        With the values in it.
    fit : CurveFit
        The values with their covariance.
    samples : Samples
        The readings on loops that they are from.
    operator : int
        Which of the base's operators carries the width.
    """

    base: Base
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
        """Standard deviation of a reading, by what the values leave."""
        squares = float(self.fit.residual_rad @ self.fit.residual_rad)
        return float(np.sqrt(squares / self.fit.dof)) / ARCSEC

    def heldout(self) -> FloatArray:
        """Residual of every reading under values that it has no part in, arc seconds.

        Readings that are on no loop have no part in them anyway.
        """
        residual = self.base.residual()
        rows = self.samples.rows
        residual[rows] = left_out(self.samples, self.fit) / ARCSEC
        return residual

    def table(self) -> tuple[list[str], FloatArray, FloatArray]:
        """Values by the names of a drive file, and their covariance; chosen ones have none."""
        base, fit = self.base, self.fit
        stretches = base.slopes.size
        names = [
            *row_names(SLOPE, stretches),
            *row_names(PLAY_SHARE, PLAYS),
            PLAY_ENVELOPE,
            *row_names(PLAY_OUTSIDE, PLAYS),
            *row_names(KNOT, base.knots_Nm.size),
            *row_names(PLAY_RADIUS, PLAYS),
            PLAY_KNEE,
        ]
        assert base.outside is not None
        values = np.concatenate(
            (
                base.slopes * ARCSEC,
                base.shares,
                [base.envelope_Nm],
                base.outside * ARCSEC,
                base.knots_Nm,
                base.radius_Nm,
                [base.knee_Nm],
            )
        )
        slopes = fit.slopes_rad_per_Nm.size
        made_of = np.zeros((values.size, fit.covariance.shape[0]))
        made_of[np.arange(stretches), stretch_of(base.knots_Nm, fit.kinks_Nm)] = 1.0
        if fit.half_width_rad.size:
            row = stretches + PLAYS + 1 + self.operator
            made_of[row, slopes + fit.kinks_Nm.size] = 1.0 / base.radius_Nm[self.operator]
        return names, values, made_of @ fit.covariance @ made_of.T


def stretch_of(knots_Nm: FloatArray, kinks_Nm: FloatArray) -> npt.NDArray[np.intp]:
    """Which slope of a curve each stretch between knots has, and that beyond the last."""
    begins = np.concatenate(([0.0], knots_Nm))
    return np.searchsorted(kinks_Nm, begins, side="right").astype(np.intp)


def fit_few_readings(base: Base) -> FewReadings | None:
    """Set a baseline model from few readings; None where they carry no slope.

    Parameters
    ----------
    base : Base
        Over the readings; it gets the values.
    """
    samples = collect(base.conditions.campaign)
    fit, _ = torsion_curve(samples)
    if fit is None or np.any(fit.slopes_rad_per_Nm <= 0):
        return None
    for kink in fit.kinks_Nm:
        base.knots_Nm[int(np.argmin(np.abs(base.knots_Nm - kink)))] = kink
    base.knots_Nm = np.sort(base.knots_Nm)
    base.slopes = fit.slopes_rad_per_Nm[stretch_of(base.knots_Nm, fit.kinks_Nm)] / ARCSEC
    base.terms = []  # readings of one loop carry no effect beside it
    base.shares = np.zeros(PLAYS)
    base.envelope_Nm = 0.0
    base.outside = np.zeros(PLAYS)
    operator = 0
    if fit.half_width_rad.size and fit.half_width_rad[0] > 0:
        half = float(fit.half_width_rad[0])
        least = half / (STICKING * float(fit.slopes_rad_per_Nm.min()))
        wide = np.flatnonzero(base.radius_Nm >= least)
        operator = int(wide[0]) if wide.size else PLAYS - 1
        base.outside[operator] = half / base.radius_Nm[operator] / ARCSEC
    return FewReadings(base, fit, samples, operator)
