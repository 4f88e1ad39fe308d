"""Calibrate the support constants of a drawing to the torsion curve of a data sheet or a fit."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.drives import Drive, parse_drive
from lostmotion.errors import InputError
from lostmotion.model import design_model, fitted_torsion_curve

CONSTANTS = {"ring_factor": 1.0, "tooth_compliance_mm_per_N": 1e-5, "foundation_N_per_mm2": 2600.0}
"""Keys of [design.support] that can be calibrated, each with the start value of its search. Sources
in this order: first principles; the order of magnitude of equation (6) for steel; balls under a rim
of size 20."""

DEFAULT = ("ring_factor",)
"""Default constant. It alone fits manufacturers' curves of sizes 14 to 40 within 2 to 8 % over the
whole torque range; three slopes rarely identify a second one.
"""

POINTS = 12
"""Number of torques at which the curves are compared, evenly spaced."""

CONFIDENCE = 0.95
"""Confidence level of the intervals; conventional."""

RATIO_APART = 0.01
"""Relative difference allowed between ratios: a drawing has the ratio of its teeth, a data sheet a
rounded one.
"""

STEP = 1e-4
"""Step of the logarithm of a constant for derivatives; the accuracy of the model is 1e-9."""

FACTOR_MOST = 1e3
"""Largest factor on a constant, either way; it ends the search if the curve does not identify the
constant.
"""


@dataclass(frozen=True)
class Constant:
    """A calibrated constant and its confidence interval from the misfit."""

    name: str
    value: float
    low: float
    high: float
    identified: bool


@dataclass(frozen=True)
class Calibration:
    """Result of a calibration.

    Attributes
    ----------
    drive : Drive
        The drawing with its constants.
    constants : tuple of Constant
    torque_Nm, target_rad, before_rad, after_rad : ndarray
        Both curves, loss-free and one-sided.
    """

    drive: Drive
    constants: tuple[Constant, ...]
    torque_Nm: FloatArray
    target_rad: FloatArray
    before_rad: FloatArray
    after_rad: FloatArray

    def misfit_percent(self, angle_rad: FloatArray) -> float:
        """Root mean square of the misfit, in % of the angle at the largest torque."""
        return float(
            100 * np.sqrt(np.mean((angle_rad - self.target_rad) ** 2)) / self.target_rad[-1]
        )


def target_curve(source: Drive, reach_Nm: float) -> tuple[FloatArray, FloatArray, int]:
    """Torques and angles of the curve of the data sheet or the fit, and its number of slopes."""
    if source.catalogue is not None:
        reach = min(reach_Nm, 2.0 * source.catalogue.T2_Nm)
        torque = np.linspace(reach / POINTS, reach, POINTS)
        sizes = np.array([0.0, source.catalogue.T1_Nm, source.catalogue.T2_Nm])
        return torque, source.catalogue.angle(torque), int(np.sum(sizes < reach))
    curve = fitted_torsion_curve(source, reach_Nm)
    if curve is None:
        raise InputError(
            source.file,
            "",
            "neither [catalogue] nor a fitted torsion curve",
            "the drive file of a data sheet, or a fitted drive file with a torsion curve",
        )
    torque = np.linspace(reach_Nm / POINTS, reach_Nm, POINTS)
    angle = np.interp(torque, curve.torque_Nm, curve.angle_rad)
    return torque, np.asarray(angle, dtype=np.float64), int(np.sum(curve.torque_Nm > 0))


def with_constants(drawing: Drive, values: dict[str, float]) -> Drive:
    """Return the drawing with other support constants."""
    document = copy.deepcopy(drawing.document)
    document["design"].setdefault("support", {}).update(values)
    return parse_drive(document, drawing.file)


def calibrate(drawing: Drive, source: Drive, names: Sequence[str] = DEFAULT) -> Calibration:
    """Find the support constants that give a drawing the torsion curve of a source.

    Parameters
    ----------
    drawing : Drive
        With a [design].
    source : Drive
        With a [catalogue], or fitted to a measurement.
    names : sequence of str
        Of `CONSTANTS`.

    Raises
    ------
    InputError
        If a file has other contents, or the two are not the same drive.
    """
    from scipy.optimize import least_squares  # a search needs only the names of the constants

    if drawing.design is None:
        raise InputError(drawing.file, "design", "no such table", "[design]: the drawing")
    if abs(abs(source.ratio / drawing.ratio) - 1.0) > RATIO_APART:
        raise InputError(
            source.file,
            "drive.ratio",
            f"{source.ratio:g}",
            f"the ratio of the drawing, {drawing.ratio:g}: both files must describe the same drive",
        )
    torque, target, slopes = target_curve(source, max(drawing.rated_torque_Nm, 1e-9))
    if slopes <= len(names):
        raise InputError(
            source.file,
            "",
            f"{slopes} slopes below the rated torque of the drawing",
            f"more than {len(names)}: with as many slopes as constants no misfit remains",
        )
    given = drawing.document["design"].get("support", {})
    start = np.array([float(given.get(name, 0.0)) or CONSTANTS[name] for name in names])

    def angles(logs: FloatArray) -> FloatArray:
        values = {n: float(s * np.exp(x)) for n, s, x in zip(names, start, logs, strict=True)}
        model = design_model(with_constants(drawing, values))
        return np.asarray(model.torsion_curve(torque).total_rad, dtype=np.float64)

    def residual(logs: FloatArray) -> FloatArray:
        apart: FloatArray = (angles(logs) - target) / target[-1]
        return apart

    before = np.asarray(design_model(drawing).torsion_curve(torque).total_rad, dtype=np.float64)
    bound = np.log(FACTOR_MOST)
    found = least_squares(
        residual, np.zeros(len(names)), bounds=(-bound, bound), diff_step=STEP, x_scale=1.0
    )
    constants = constants_with_intervals(names, start, found, slopes)
    values = {one.name: one.value for one in constants}
    return Calibration(
        with_constants(drawing, values), constants, torque, target, before, angles(found.x)
    )


def constants_with_intervals(
    names: Sequence[str], start: FloatArray, found: Any, slopes: int
) -> tuple[Constant, ...]:
    """Compute the interval of each constant from the misfit, with one degree of freedom per slope.

    Points between two knots carry no independent information, so the scatter is that of all points
    and the degrees of freedom are those of the slopes. An interval as wide as the search range is
    not reported.
    """
    from scipy.special import stdtrit

    free = slopes - len(names)
    scatter = float(np.mean(found.fun**2)) * slopes / free
    curvature = found.jac.T @ found.jac * slopes / found.fun.size
    spread = np.sqrt(np.diagonal(scatter * np.linalg.pinv(curvature)))
    wide = stdtrit(free, 0.5 + CONFIDENCE / 2) * spread
    result = []
    for name, begin, log, width in zip(names, start, found.x, wide, strict=True):
        seen = bool(np.isfinite(width) and 0 < width < np.log(FACTOR_MOST))
        seen &= bool(abs(log) < 0.99 * np.log(FACTOR_MOST))
        value = float(begin * np.exp(log))
        low, high = (float(value * np.exp(side * min(width, 700.0))) for side in (-1, 1))
        result.append(Constant(name, value, low, high, seen))
    return tuple(result)
