"""Backlash: a step of the mean curve at zero torque, or an upper bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import special

from lostmotion.characterize.figures import Estimate, figure, none
from lostmotion.characterize.stretches import FEW_READINGS, Samples
from lostmotion.characterize.three_slopes import CONFIDENCE, CurveFit, fit_lines, fit_slopes

TAKEUP_SHARES = (0.01, 0.02, 0.05, 0.1)
"""Shares of the amplitude at which a step may be complete."""

GAP_SHARE = 0.02
"""A step that is complete above this share of the amplitude is a soft first slope, not a gap: a
radial gap closes below 2 % of the rated torque (theory page, take-up of the radial gap)."""

CLOSED = 3.0
"""The curve beyond a gap starts at this multiple of its take-up torque: a gap that closes as a
hyperbolic tangent is closed to 0.5 % there, one that closes linearly is closed completely.
"""

SOFTER = 2.0
"""Backlash is at least this many times as soft as the curve beyond it. Less is the normal rounding
of every loop near zero.
"""


@dataclass(frozen=True)
class Backlash:
    """Backlash found in a loop.

    Attributes
    ----------
    figure : Estimate
        The full step, in rad; without a value if there is none.
    none_above_rad : float or None
        One-sided 95 % bound of the step if none was found.
    fit : CurveFit or None
        The curve with the step.
    """

    figure: Estimate
    none_above_rad: float | None = None
    fit: CurveFit | None = None


def find_backlash(samples: Samples, slopes: int) -> Backlash:
    """Search for a step at zero torque in the mean curve of loops.

    Parameters
    ----------
    samples : Samples
    slopes : int
        Of the curve beyond the step.
    """
    if not samples.two_directions:
        return Backlash(none("the torque has one direction only: it does not pass through zero"))
    if samples.readings < FEW_READINGS:
        return Backlash(none("too few readings to separate a step from the first slope"))
    fits = []
    for share in TAKEUP_SHARES:
        takeup = share * samples.amplitude_Nm
        inside = np.count_nonzero(np.abs(samples.torque_Nm) < takeup)
        if inside < 2 * samples.loops:
            continue
        fits.append(fit_lines(samples, slopes, takeup))
    if not fits:
        return Backlash(none("too few samples near zero torque"))
    nearest = min(fits, key=lambda fit: float(fit.residual_rad @ fit.residual_rad))
    closes = nearest.takeup_Nm <= GAP_SHARE * samples.amplitude_Nm
    best = (nearest if closes else fits[0]).with_errors()
    step, variance = best.step_rad, best.step_variance
    significant = step > best.critical * np.sqrt(variance)
    beyond = float(best.slopes_rad_per_Nm[0])
    soft = beyond > 0 and step / best.takeup_Nm + beyond >= SOFTER * beyond
    if closes and significant and soft:
        best = fit_slopes(samples.beyond(CLOSED * best.takeup_Nm), slopes, best.takeup_Nm)
        step, variance = best.step_rad, best.step_variance
        return Backlash(figure(2.0 * step, 4.0 * variance, best.dof), fit=best)
    bound = max(step, 0.0) + float(special.stdtrit(best.dof, CONFIDENCE)) * np.sqrt(variance)
    why = "no step of the mean curve near zero" if closes else "a soft first slope, no step"
    return Backlash(none(why), 2.0 * float(bound))
