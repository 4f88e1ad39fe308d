"""The numbers behind a figure, as CSV."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.files import csv_text

CSV_DIGITS = 10
"""Significant digits of the numbers behind a picture."""

Columns = Mapping[str, Sequence[object] | npt.NDArray[Any]]
"""Numbers or texts behind a figure: columns of equal length, named with their unit."""


def numbers_csv(columns: Columns) -> str:
    """Return columns as CSV; values that are not finite become empty cells."""
    rows = zip(*columns.values(), strict=True)
    return csv_text(columns, (map(_cell, row) for row in rows))


def _cell(value: object) -> str:
    if isinstance(value, (float, np.floating)):
        return f"{float(value) + 0.0:.{CSV_DIGITS}g}" if np.isfinite(value) else ""
    return str(value)
