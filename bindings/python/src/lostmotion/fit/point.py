"""The evaluated baseline model at one set of parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from lostmotion.arrays import FloatArray


@dataclass
class Point:
    """Results of the model at one set of parameters, in arc seconds and N m.

    Attributes
    ----------
    torque : ndarray
        Torque including torque effects.
    width : ndarray
        Scale of the half widths of the hysteresis operators.
    plays : ndarray
        Differences ``z_i - U`` of the operators, one column each.
    wound : ndarray
        Torque minus friction in parallel, the input of the torsion curve.
    stiffness : ndarray
        Factor of each run on the torsion curve.
    slope_at, curve_at : callable
        Slope and angle of the torsion curve at torques, without that factor.
    torsion_curve, elastic, angle : ndarray
        Torsion curve without that factor; elastic angle; with effects of the angle.
    """

    torque: FloatArray
    width: FloatArray
    plays: FloatArray
    wound: FloatArray
    stiffness: FloatArray
    slope_at: Callable[[FloatArray], FloatArray]
    curve_at: Callable[[FloatArray], FloatArray]
    torsion_curve: FloatArray
    elastic: FloatArray
    angle: FloatArray

    @cached_property
    def slope(self) -> FloatArray:
        """Derivative of the torsion curve by the torque: only derivatives of the model use it."""
        return self.stiffness * self.slope_at(self.wound)
