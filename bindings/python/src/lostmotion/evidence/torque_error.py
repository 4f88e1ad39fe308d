"""The error of the torque in the noise: how far the torsion curve turns within it.

The noise of a torque reading moves the modelled angle, ten times further where a gap closes than
elsewhere, and so does an error of the friction. Samples there tell little about the rest.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lostmotion import rules
from lostmotion.arrays import FloatArray
from lostmotion.evidence.noise import NOISE_LEAST_ARCSEC

ERRORS = np.geomspace(1e-4, 0.03, 16)
"""Errors of the torque that are tried, relative to the largest torque."""

SHARES = np.geomspace(1.0, 0.01, 14)
"""Shares of the other noise in the mean square of the residual that are tried."""


def relative_noise(
    residual: FloatArray, swing: Callable[[float], FloatArray], largest_Nm: float
) -> FloatArray | None:
    """Standard deviation of each sample, relative to the root mean square of all.

    By maximum likelihood of a normal residual, over the error and the other noise.

    Parameters
    ----------
    residual : ndarray
        Of the largest model, arc seconds.
    swing : callable
        Angle, arc seconds, that the torsion curve turns at each sample within an error, N m.
    largest_Nm : float
        Largest torque.

    Returns
    -------
    ndarray or None
        None if the same noise at all samples explains the residual as well
        (`rules.GAIN_LEAST`).
    """
    square = residual**2
    total = float(np.mean(square))
    if total <= NOISE_LEAST_ARCSEC**2:
        return None

    def cost(variance: FloatArray) -> float:
        """Minus the log likelihood, nats, with the best common factor of the variances."""
        common = np.log(np.mean(square / variance))
        return 0.5 * float(square.size * common + np.sum(np.log(variance)))

    least, best = cost(np.ones(square.size)) - rules.GAIN_LEAST, None
    for error in largest_Nm * ERRORS:
        turned = swing(float(error)) ** 2 / total
        for share in SHARES:
            variance = 1.0 + turned / share
            if (value := cost(variance)) < least:
                least, best = value, variance
    return None if best is None else np.sqrt(best / np.mean(best))
