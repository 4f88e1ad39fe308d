"""The numbers behind a figure, as CSV."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.files import csv_text

CSV_DIGITS = 10
"""Significant digits of the numbers behind a picture."""


@dataclass(frozen=True)
class FigureData:
    """Data of a figure: columns of equal length, named with their unit.

    Attributes
    ----------
    name : str
        File name without suffix.
    columns : mapping
        Numbers or texts; values that are not finite become empty cells.
    """

    name: str
    columns: Mapping[str, Sequence[object] | npt.NDArray[Any]]

    def csv(self) -> str:
        """Return the table as CSV."""
        rows = zip(*self.columns.values(), strict=True)
        return csv_text(self.columns, (map(_cell, row) for row in rows))


def _cell(value: object) -> str:
    if isinstance(value, (float, np.floating)):
        return f"{float(value) + 0.0:.{CSV_DIGITS}g}" if np.isfinite(value) else ""
    return str(value)
