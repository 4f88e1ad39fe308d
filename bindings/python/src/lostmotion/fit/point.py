"""The baseline model evaluated: everything that it gives at one set of parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass
class Point:
    """Everything the model gives at one set of parameters, in arc seconds and N m."""

    torque: FloatArray
    width: FloatArray
    plays: FloatArray
    wound: FloatArray
    ramps: FloatArray
    slope: FloatArray
    backbone: FloatArray
    elastic: FloatArray
    angle: FloatArray
