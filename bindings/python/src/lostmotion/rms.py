"""Root mean square, the size of every error."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def rms_of(values: npt.ArrayLike) -> float:
    """Root mean square of all values."""
    return float(np.sqrt(np.mean(np.square(values))))
