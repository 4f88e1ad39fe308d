"""A catalogue drive: data sheet values as a torsion curve in reduced form.

A catalogue states no geometry, but the mean torque-angle curve (three stiffnesses and two torques)
and guaranteed limits of hysteresis loss and lost motion. The same five contributions as for a
drawing are estimated from these by a split taken from a reference drive. Every answer states it
(`Catalogue.assumptions`); it is not a measurement.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lostmotion.arrays import FloatArray
from lostmotion.core import core
from lostmotion.units import ARCMIN

PARTS = ("radial_gap", "side_clearance", "radial_compliance", "torsion", "tooth_bending")
"""The contributions, in the order in which they appear with growing torque."""

TORSION_SHARE = 0.65
"""Torsion in the linear part: 4.48e4 N m/rad of torsion chain against K3 = 2.9e4 N m/rad, the
reference design calibrated to size 20, ratio above 50."""

TOOTH_SHARE = 0.01
"""Teeth in the linear part: 0.8 to 1.3 % for the same drive; the paper states a few percent."""

RADIAL_SHARE = 1.0 - TORSION_SHARE - TOOTH_SHARE
"""The rest of the linear part: the radial chain."""

WIND_UP_MAX_RAD = 0.5
"""Wind-up at rated torque that is implausible: strain-wave drives wind up by a few thousandths of a
radian."""

REVERSAL_TORQUE_SHARE = float(core().lib.LM_LOST_MOTION_SHARE)
"""Share of the rated torque at which manufacturers state lost motion."""

PLAY_RADII = (0.0125, 0.05, 0.125, 0.25)
"""Half widths of the operators at zero torque, relative to the rated torque."""

PLAY_WEIGHTS = (1.5, 3.0, 5.0, 6.0)
"""Compliances of the operators relative to each other."""

PLAY_WIDENING = 0.5
"""Growth of an operator's half width from zero to rated torque, relative to that at zero."""


@dataclass(frozen=True)
class Catalogue:
    """Values of a data sheet, in SI units (torque N m, stiffness N m/rad, angles rad)."""

    T1_Nm: float
    T2_Nm: float
    K1_Nm_per_rad: float
    K2_Nm_per_rad: float
    K3_Nm_per_rad: float
    hysteresis_rad: float | None = None
    lost_motion_rad: float | None = None

    def knots(self, largest_torque_Nm: float) -> tuple[FloatArray, FloatArray]:
        """Knots of the mean curve over both signs of torque.

        Returns
        -------
        torque_Nm, angle_rad : ndarray
            Rising and odd; beyond T2 the curve is straight, so the outermost knots only set the
            range of the arrays (at least 2 T2).
        """
        end = max(2.0 * self.T2_Nm, largest_torque_Nm)
        torque = np.array([self.T1_Nm, self.T2_Nm, end])
        angle = self.angle(torque)
        return (
            np.concatenate((-torque[::-1], [0.0], torque)),
            np.concatenate((-angle[::-1], [0.0], angle)),
        )

    def angle(self, torque_Nm: npt.ArrayLike) -> FloatArray:
        """One-sided deflection in rad: slopes K1 up to T1, K2 up to T2, K3 above; odd."""
        size = np.abs(np.asarray(torque_Nm, dtype=np.float64))
        low = np.minimum(size, self.T1_Nm) / self.K1_Nm_per_rad
        middle = np.clip(size - self.T1_Nm, 0.0, self.T2_Nm - self.T1_Nm) / self.K2_Nm_per_rad
        high = np.maximum(size - self.T2_Nm, 0.0) / self.K3_Nm_per_rad
        return np.asarray(np.sign(torque_Nm) * (low + middle + high))

    def parts(self, torque_Nm: npt.ArrayLike) -> dict[str, FloatArray]:
        """The five contributions in rad; they add up to `angle`."""
        torque = np.asarray(torque_Nm, dtype=np.float64)
        total = self.angle(torque)
        linear = torque / self.K3_Nm_per_rad
        torsion = TORSION_SHARE * linear
        tooth = TOOTH_SHARE * linear
        radial = RADIAL_SHARE * linear
        return {
            "radial_gap": np.zeros_like(total),
            "side_clearance": total - (torsion + tooth + radial),
            "radial_compliance": radial,
            "torsion": torsion,
            "tooth_bending": tooth,
        }

    def stiffness(self, torque_Nm: npt.ArrayLike) -> FloatArray:
        """Local stiffness in N m/rad; at a knot, that of the segment above it."""
        size = np.abs(np.asarray(torque_Nm, dtype=np.float64))
        return np.asarray(
            np.where(
                size < self.T1_Nm,
                self.K1_Nm_per_rad,
                np.where(size < self.T2_Nm, self.K2_Nm_per_rad, self.K3_Nm_per_rad),
            )
        )

    def reversal_lost_motion(self, torque_Nm: float) -> float:
        """Angle between the middles of the loop at plus and minus this torque, in rad."""
        return 2.0 * float(self.angle(torque_Nm))

    def radial_gap_bound(self, rated_torque_Nm: float) -> float | None:
        """Upper bound in rad, per direction, of a radial gap that the data sheet does not reveal.

        Guaranteed lost motion minus the wind-up at 4 % of the rated torque. None if the data sheet
        states no lost motion.
        """
        if self.lost_motion_rad is None:
            return None
        wind_up = float(self.angle(REVERSAL_TORQUE_SHARE * rated_torque_Nm))
        return max(0.0, self.lost_motion_rad / 2.0 - wind_up)

    def plays(self, rated_torque_Nm: float) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """Play operators with the loop width at zero torque that the data sheet states.

        After unloading from plus or minus the rated torque to zero, every operator is at its half
        width, so the loss is ``2 sum(weight * radius)``.

        Returns
        -------
        radius_Nm, widening, weight_rad_per_Nm : ndarray
            None if the data sheet states no hysteresis.
        """
        if self.hysteresis_rad is None:
            return None
        radius = np.array(PLAY_RADII) * rated_torque_Nm
        widening = np.array(PLAY_RADII) * PLAY_WIDENING
        weight = np.array(PLAY_WEIGHTS)
        weight *= self.hysteresis_rad / (2.0 * float(np.dot(weight, radius)))
        return radius, widening, weight

    def assumptions(self, rated_torque_Nm: float) -> list[str]:
        """List the assumptions of the catalogue model, one sentence each."""
        lines = [
            "The total is the catalogue's mean curve: slopes K1 up to T1, K2 up to T2, K3 above, "
            "the same for both directions.",
            "side_clearance is the excess of the curve over its final straight line, phi(T) - T / "
            "K3, while clearances close.",
            "The straight line T / K3 is split into "
            f"{100 * TORSION_SHARE:.0f} % torsion, {100 * RADIAL_SHARE:.0f} % "
            f"radial compliance, {100 * TOOTH_SHARE:.0f} % tooth bending, as in a reference design "
            "calibrated to size 20, ratio 100.",
        ]
        if self.K1_Nm_per_rad > self.K3_Nm_per_rad:
            lines.append(
                "K1 is above K3: the teeth are preloaded, and side_clearance is negative, because "
                "the preload adds stiffness."
            )
        bound = self.radial_gap_bound(rated_torque_Nm)
        if bound is None:
            lines.append(
                "radial_gap is 0: the data sheet states no lost motion that would limit it."
            )
        else:
            lines.append(
                "radial_gap is 0: a data sheet does not state it. The stated lost motion allows at "
                f"most {bound / ARCMIN:.3g} arcmin in one direction."
            )
        lines.append(
            "Hysteresis and lost motion of a catalogue are guaranteed upper limits: an actual unit "
            "is likely to have less."
        )
        lines.append("Tolerances and engaged teeth cannot be read from a catalogue.")
        return lines
