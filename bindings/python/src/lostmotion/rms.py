"""Root mean square, the size of every error, and the same of the noise below outliers."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def rms_of(values: npt.ArrayLike) -> float:
    """Root mean square of all values."""
    return float(np.sqrt(np.mean(np.square(values))))


NORMAL_MEDIAN = 1.4826
"""Standard deviation of a normal variable over the median of its absolute value."""


def robust_rms(values: npt.ArrayLike) -> float:
    """Standard deviation of normal noise around zero, from the median of its absolute value."""
    return NORMAL_MEDIAN * float(np.median(np.abs(values)))
