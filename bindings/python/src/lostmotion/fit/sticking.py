"""The limits of sticking friction as bounds of a fit.

While every operator sticks, the angle still rises with the torque: with the slope r of the envelope
at zero torque, shares w in parallel, compliances c in series and the slopes s of the torsion curve

    r sum w <= SHARE_MAX,    r sum c <= (STICKING_MAX - r sum w) s   for every s

(`lm_check_play_bank` requires the same of the controller's parameters). The second is for models
that are constrained to rise (`BaselineModel.rises`).

A fit is done in ``v = r w`` and ``s - r sum c / (STICKING_MAX - sum v)``, in which these are a sum
limit and bounds: steps end on them, whereas a penalty would cause zigzagging.
"""

from __future__ import annotations

from collections.abc import Mapping

from lostmotion.arrays import FloatArray
from lostmotion.fit.hysteresis import (
    ENVELOPE_FILED,
    OUTSIDE_FILED,
    SHARE_MAX,
    SHARES_FILED,
    STICKING_MAX,
)
from lostmotion.fit.least_squares import SumLimit
from lostmotion.fit.parameters import Filed
from lostmotion.fit.segmented_curve import SLOPES_FILED

NOWHERE = slice(0, 0)


class Sticking:
    """A change of variables of the parameter vector and its inverse.

    Parameters
    ----------
    places : mapping
        Places of the parameters that a drive file stores.
    knee_Nm : float
        Of the envelope.
    rises : bool
        Whether the second bound applies.
    """

    def __init__(self, places: Mapping[Filed, slice], knee_Nm: float, rises: bool) -> None:
        self.slopes = places[SLOPES_FILED]
        self.shares = places.get(SHARES_FILED, NOWHERE)
        self.more = places.get(ENVELOPE_FILED, NOWHERE)
        self.outside = places.get(OUTSIDE_FILED, NOWHERE) if rises else NOWHERE
        self.knee_Nm = knee_Nm

    @property
    def limit(self) -> SumLimit:
        """Largest sum of the shares among a fit's variables."""
        return SumLimit(self.shares, SHARE_MAX)

    def rise(self, x: FloatArray) -> float:
        """Slope of the envelope at zero torque."""
        return 1.0 + float(x[self.more].sum()) / self.knee_Nm

    def least_slope(self, free: FloatArray) -> float:
        """Least slope of the torsion curve with which the angle rises."""
        room = STICKING_MAX - min(float(free[self.shares].sum()), SHARE_MAX)
        return self.rise(free) * float(free[self.outside].sum()) / room

    def free(self, x: FloatArray) -> FloatArray:
        """A fit's variables of a parameter vector."""
        free = x.copy()
        free[self.shares] *= self.rise(x)
        free[self.slopes] -= self.least_slope(free)
        return free

    def vector(self, free: FloatArray) -> FloatArray:
        """The parameter vector of a fit's variables."""
        x = free.copy()
        x[self.shares] /= self.rise(free)
        x[self.slopes] += self.least_slope(free)
        return x

    def convert(self, columns: FloatArray, free: FloatArray) -> None:
        """Convert derivatives by the parameters to those by the variables of a fit, in place."""
        rise = self.rise(free)
        if columns[:, self.more].shape[1]:
            by_shares = columns[:, self.shares] @ free[self.shares]
            columns[:, self.more] -= (by_shares / rise**2 / self.knee_Nm)[:, None]
            columns[:, self.shares] /= rise
        if columns[:, self.outside].shape[1]:
            room = STICKING_MAX - min(float(free[self.shares].sum()), SHARE_MAX)
            compliance = float(free[self.outside].sum())
            together = columns[:, self.slopes].sum(axis=1)[:, None]
            columns[:, self.outside] += together * (rise / room)
            columns[:, self.shares] += together * (rise * compliance / room**2)
            columns[:, self.more] += together * (compliance / room / self.knee_Nm)
