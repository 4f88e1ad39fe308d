"""Types of the arrays that functions take and return."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

IntArray = npt.NDArray[np.intp]
"""Rows, offsets and numbers of things."""

BoolArray = npt.NDArray[np.bool_]
"""Which of several are marked."""

WholeArray = npt.NDArray[np.int64]
"""Whole numbers that a file states: nanoseconds, counts, parts of a date."""
