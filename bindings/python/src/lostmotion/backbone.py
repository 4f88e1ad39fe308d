"""What the models of a drive have in common: a loss-free characteristic, and plays with memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lostmotion.core import core

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Backbone:
    """A loss-free characteristic as straight lines between knots.

    Attributes
    ----------
    torque_Nm, angle_rad : ndarray
        Knots, rising, through zero; the end segments go on beyond them.
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


def run_plays(radius_Nm: FloatArray, torque_Nm: FloatArray, state: float = 0.0) -> FloatArray:
    """Differences ``z_i - T`` of play operators over a recording, one column an operator.

    Parameters
    ----------
    radius_Nm : ndarray
        Half widths; they do not grow with the torque.
    torque_Nm : ndarray
        The recording.
    state : float
        Where the operators stand before the first sample, in half widths from the torque there.
    """
    c = core(64)
    out = c.zeros(torque_Nm.size, radius_Nm.size)
    z = c.array(torque_Nm[0] + state * radius_Nm)
    c.lib.lm_run_plays(
        c.pointer(c.array(radius_Nm)),
        c.pointer(c.zeros(radius_Nm.size)),
        radius_Nm.size,
        c.pointer(z, write=True),
        c.pointer(c.array(torque_Nm)),
        c.ffi.NULL,
        torque_Nm.size,
        c.pointer(out, write=True),
    )
    return out
