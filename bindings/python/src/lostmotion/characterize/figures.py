"""Figures of a loop by the definitions of catalogues, with standard errors.

Lost motion at a torque is the angle between the middles of the loop at plus and at minus that
torque. Harmonic Drive SE states it at 4 % of the rated torque (`catalogue.REVERSAL_TORQUE_SHARE`),
makers of cycloidal reducers at 3 % (Nabtesco, Sumitomo: middle of the hysteresis width at 3 % of
the rated torque). Hysteresis loss is the width of the loop at zero torque after full swings.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import special

from lostmotion.arrays import FloatArray
from lostmotion.catalogue import REVERSAL_TORQUE_SHARE
from lostmotion.characterize.loop_regression import ScaledColumns, covariance_of, without_loop_means
from lostmotion.characterize.stretches import FEW_READINGS, Samples
from lostmotion.characterize.three_slopes import (
    CONFIDENCE,
    WIDTH_NODES,
    CurveFit,
    hats,
    supported,
    width_columns,
)
from lostmotion.units import ARCMIN

LOST_MOTION_SHARES = (0.03, REVERSAL_TORQUE_SHARE)
"""Shares of the rated torque at which lost motion is stated."""

WINDOW_NODES = 9
"""Nodes of the mean curve in this window."""

LOST_MOTION_WINDOW = 8.0
"""Lost motion is determined from samples up to this multiple of its torque, in separate bins."""


@dataclass(frozen=True)
class Estimate:
    """A figure with its standard error and interval, or the reason why there is none."""

    value: float | None
    standard_error: float | None = None
    interval: tuple[float, float] | None = None
    reason: str = ""

    def answer(self, scale: float = 1.0) -> dict[str, Any]:
        """Return it for JSON, in a unit of `scale` times its own."""
        if self.value is None:
            return {"value": None, "reason": self.reason}
        error, ends = self.standard_error, self.interval
        return {
            "value": self.value / scale,
            "standard_error": None if error is None else error / scale,
            "interval_95": None
            if ends is None
            else [end / scale if np.isfinite(end) else None for end in ends],
        }


def none(reason: str) -> Estimate:
    """Make a figure that the data do not determine."""
    return Estimate(None, reason=reason)


def figure(value: float, variance: float, dof: float) -> Estimate:
    """Make a figure from its variance, with an interval by Student's t."""
    error = float(np.sqrt(max(variance, 0.0)))
    half = float(special.stdtrit(dof, 0.5 + CONFIDENCE / 2.0)) * error
    return Estimate(value, error, (value - half, value + half))


def stiffness(slope: float, variance: float, dof: float) -> Estimate:
    """Make a stiffness from a slope; its interval is the inverted interval of the slope.

    None if the angle does not rise with the torque.
    """
    if not slope > 0:
        return none("the angle does not rise with the torque")
    at = figure(slope, variance, dof)
    assert at.interval is not None
    assert at.standard_error is not None
    low, high = at.interval
    upper = 1.0 / low if low > 0 else np.inf
    return Estimate(1.0 / slope, at.standard_error / slope**2, (1.0 / high, upper))


def curve_figures(fit: CurveFit) -> dict[str, Estimate]:
    """Slopes and kinks of a torsion curve as K1, T1, K2 ... in N m/rad and N m."""
    found: dict[str, Estimate] = {}
    n = fit.slopes_rad_per_Nm.size
    for i, slope in enumerate(fit.slopes_rad_per_Nm):
        at = stiffness(float(slope), float(fit.covariance[i, i]), fit.dof)
        if fit.shared_rad > 0 and at.interval is not None and np.isinf(at.interval[1]):
            at = none(
                f"the loops have {fit.shared_rad / ARCMIN:.2g} arcmin rms in common that does not "
                "depend on the torque: compared with it the slope does not differ from zero"
            )
        found[f"K{i + 1}"] = at
    for i, kink in enumerate(fit.kinks_Nm):
        at = figure(float(kink), float(fit.covariance[n + i, n + i]), fit.dof)
        if fit.kink_intervals_Nm:
            assert at.interval is not None
            lows, highs = zip(at.interval, fit.kink_intervals_Nm[i], strict=True)
            at = replace(at, interval=(min(lows), max(highs)))
        found[f"T{i + 1}"] = at
    return found


def nodes_about(torque_Nm: float, reach_Nm: float) -> FloatArray:
    """Nodes at zero and at a torque, closer below it for a gap, and beyond as for the width."""
    near = np.array([0.0, 0.25, 0.5, 1.0, 2.0]) * torque_Nm
    reach_Nm = min(reach_Nm, LOST_MOTION_WINDOW * torque_Nm)
    others = np.linspace(0.0, reach_Nm, WINDOW_NODES)
    return np.concatenate((near, others[others > 3.0 * torque_Nm]))


def loop_value(
    samples: Samples, nodes_Nm: FloatArray, torque_Nm: float | None = None
) -> tuple[float, float, float] | None:
    """Value of the mean curve at a torque, or of the half width at zero torque.

    The mean curve is linear between nodes, without another shape.

    Returns
    -------
    value, variance, dof : float
        None if the samples do not determine it.
    """
    width, _ = width_columns(samples)
    nodes = supported(samples, nodes_Nm)
    if nodes.size < 2:
        return None
    curve = np.sign(samples.torque_Nm)[:, None] * hats(np.abs(samples.torque_Nm), nodes)
    columns = without_loop_means(np.column_stack([curve[:, 1:], width]), samples.loop)
    design, pick = ScaledColumns(columns), np.zeros(columns.shape[1])
    if torque_Nm is None:
        pick[nodes.size - 1] = 1.0
    else:
        pick[: nodes.size - 1] = hats(np.array([torque_Nm]), nodes)[0, 1:]
    if not design.determines(pick):
        return None
    angle = without_loop_means(samples.angle_rad[:, None], samples.loop)[:, 0]
    found = design.fit(angle)
    fitted = columns @ found
    covariance, dof = covariance_of(samples, design, angle - fitted, fitted)
    return float(pick @ found), float(pick @ covariance @ pick), dof


def lost_motion(samples: Samples, torque_Nm: float, fit: CurveFit | None = None) -> Estimate:
    """Lost motion of a reversal at plus and minus a torque, in rad.

    Few readings have none near such a small torque; then it follows from the first slope of the
    curve.
    """
    if not samples.two_directions:
        return none("the torque has one direction only: no middle of the loop on the other side")
    if not samples.both_branches:
        return none("one branch only: the middle of the loop needs the other")
    if torque_Nm > samples.amplitude_Nm:
        return none(f"the loops end at {samples.amplitude_Nm:.4g} N m")
    if fit is not None and samples.readings < FEW_READINGS:
        twice = 2.0 * torque_Nm
        return figure(
            twice * float(fit.slopes_rad_per_Nm[0]), twice**2 * float(fit.covariance[0, 0]), fit.dof
        )
    found = loop_value(samples, nodes_about(torque_Nm, samples.amplitude_Nm), torque_Nm)
    if found is None:
        return none(f"too few samples near {torque_Nm:.3g} N m on either side of zero")
    value, variance, dof = found
    return figure(2.0 * value, 4.0 * variance, dof)


def hysteresis_loss(samples: Samples, fit: CurveFit | None = None) -> Estimate:
    """Width of the loop at zero torque, falling branch minus rising one, in rad.

    For few readings the width is the same at all torques.
    """
    if not samples.both_branches:
        return none("one branch only: no width")
    if not samples.two_directions:
        return none("the torque has one direction only: no full swing through zero")
    if fit is not None and samples.readings < FEW_READINGS:
        return figure(2.0 * float(fit.half_width_rad[0]), 4.0 * fit.width_variance, fit.dof)
    found = loop_value(samples, np.array(WIDTH_NODES) * samples.amplitude_Nm)
    if found is None:
        return none("too few samples near zero torque")
    value, variance, dof = found
    return figure(2.0 * value, 4.0 * variance, dof)
