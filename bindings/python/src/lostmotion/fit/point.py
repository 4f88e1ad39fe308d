"""The evaluated baseline model at one set of parameters."""

from __future__ import annotations

from dataclasses import dataclass

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
    slope : ndarray
        Derivative of the torsion curve by the torque, with that factor.
    torsion_curve, elastic, angle : ndarray
        Torsion curve without that factor; elastic angle; with effects of the angle.
    """

    torque: FloatArray
    width: FloatArray
    plays: FloatArray
    wound: FloatArray
    stiffness: FloatArray
    slope: FloatArray
    torsion_curve: FloatArray
    elastic: FloatArray
    angle: FloatArray
