"""Columns of Arrow as arrays of NumPy, without pandas: Arrow's own conversion imports it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.arrays import BoolArray, FloatArray, WholeArray


def floats_of(column: Any) -> FloatArray:
    """Return a column of numbers; a missing one is NaN, and integers beyond float64 are rounded."""
    return content(column.cast("float64", safe=False), np.float64, np.nan)


def integers_of(column: Any) -> WholeArray:
    """Return a column of numbers as integers; a missing one is 0, and decimals are cut off."""
    return content(column.cast("int64", safe=False), np.int64, 0)


def mask_of(column: Any) -> BoolArray:
    """Return a column of truth values; a missing one is false."""
    return content(column.cast("uint8"), np.uint8, 0).astype(np.bool_)


def content(column: Any, kind: type[Any], missing: float) -> npt.NDArray[Any]:
    """Copy the values of a column whose type is `kind`; those that it lacks are `missing`."""
    parts = [np.zeros(0, kind)]
    for piece in getattr(column, "chunks", [column]):
        valid, data = piece.buffers()
        first, last = piece.offset, piece.offset + len(piece)
        values = np.frombuffer(data, kind, last)[first:] if last else parts[0]
        if piece.null_count:
            bits = np.unpackbits(np.frombuffer(valid, np.uint8), count=last, bitorder="little")
            values = np.where(bits[first:] != 0, values, np.array(missing, kind))
        parts.append(values)
    return np.concatenate(parts)
