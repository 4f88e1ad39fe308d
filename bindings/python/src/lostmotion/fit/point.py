"""The evaluated baseline model at one set of parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lostmotion.arrays import FloatArray


def before_friction(
    torque: FloatArray, compliance: FloatArray, curve_at: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Angle before friction has acted, arc seconds: what effects on the width see."""
    return compliance * curve_at(torque)


@dataclass
class Driven:
    """Loads and friction of the model at one set of parameters, N m.

    Attributes
    ----------
    torque : ndarray
        Torque including torque effects.
    compliance : ndarray
        Factor of effects on the compliance.
    width : ndarray
        Scale of the half widths of the hysteresis operators.
    followed : ndarray
        Envelope U that the operators follow.
    plays : ndarray
        Differences ``z_i - U`` of the operators, one column each.
    wound : ndarray
        Torque minus friction in parallel, the input of the torsion curve.
    """

    torque: FloatArray
    compliance: FloatArray
    width: FloatArray
    followed: FloatArray
    plays: FloatArray
    wound: FloatArray


@dataclass
class Point(Driven):
    """Results of the model at one set of parameters, in arc seconds and N m.

    Attributes
    ----------
    stiffness : ndarray
        Factor on the torsion curve: of each run, and of effects on the compliance.
    slope_at, curve_at : callable
        Slope and angle of the torsion curve at torques, without that factor.
    torsion_curve, elastic, angle : ndarray
        Torsion curve without that factor; elastic angle; with effects of the angle.
    """

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

    def swing(self, error_Nm: float) -> FloatArray:
        """Half the angle that the torsion curve turns within an error of the torque each way."""
        above, below = (self.curve_at(self.wound + error) for error in (error_Nm, -error_Nm))
        return np.asarray(0.5 * self.stiffness * (above - below))
