"""Loss-free torsion curve and play operators, common to all models of a drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lostmotion.arrays import FloatArray
from lostmotion.core import core


@dataclass(frozen=True)
class TorsionCurve:
    """A loss-free torsion curve as straight lines between knots.

    Attributes
    ----------
    torque_Nm, angle_rad : ndarray
        Knots, rising, through zero; the end segments continue beyond them.
    """

    torque_Nm: FloatArray
    angle_rad: FloatArray

    def __call__(self, torque_Nm: npt.ArrayLike) -> FloatArray:
        """Angle in rad at each torque."""
        torque_Nm = np.asarray(torque_Nm, dtype=np.float64)
        slope = np.diff(self.angle_rad) / np.diff(self.torque_Nm)
        inside = np.interp(torque_Nm, self.torque_Nm, self.angle_rad)
        below = np.minimum(torque_Nm - self.torque_Nm[0], 0.0) * slope[0]
        above = np.maximum(torque_Nm - self.torque_Nm[-1], 0.0) * slope[-1]
        return np.asarray(inside + below + above)

    def with_step(self, size_rad: float, within_Nm: float) -> TorsionCurve:
        """The curve with an additional step at zero torque in each direction.

        Parameters
        ----------
        size_rad : float
            Of each step.
        within_Nm : float
            Torque up to which the angle rises by it, in proportion.
        """
        ends = max(self.torque_Nm[-1], 2.0 * within_Nm) * np.array([-1.0, 1.0])
        torque = np.union1d(self.torque_Nm, [*ends, -within_Nm, within_Nm])
        return TorsionCurve(
            torque, self(torque) + size_rad * np.clip(torque / within_Nm, -1.0, 1.0)
        )


def run_plays(
    radius_Nm: FloatArray,
    torque_Nm: FloatArray,
    state: float = 0.0,
    widening: FloatArray | None = None,
) -> FloatArray:
    """Differences ``z_i - T`` of play operators over a recording, one column per operator.

    Parameters
    ----------
    radius_Nm : ndarray
        Half widths at zero torque.
    torque_Nm : ndarray
        The recording.
    state : float
        State of the operators before the first sample, in half widths from the torque there.
    widening : ndarray, optional
        Growth of the half widths per torque; by default they do not grow.
    """
    c = core(64)
    widening = np.zeros(radius_Nm.size) if widening is None else widening
    out = c.zeros(torque_Nm.size, radius_Nm.size)
    z = c.array(torque_Nm[0] + state * (radius_Nm + widening * abs(torque_Nm[0])))
    c.lib.lm_run_plays(
        c.pointer(c.array(radius_Nm)),
        c.pointer(c.array(widening)),
        radius_Nm.size,
        c.pointer(z, write=True),
        c.pointer(c.array(torque_Nm)),
        c.ffi.NULL,
        torque_Nm.size,
        c.pointer(out, write=True),
    )
    return out
