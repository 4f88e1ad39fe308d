"""Results with a residual whitened by its own noise: autocorrelation and quantiles."""

from __future__ import annotations

from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.errors import InputError
from lostmotion.evidence.noise import whitened_runs
from lostmotion.fit.model_result import ModelResult
from lostmotion.results import figures

LAGS = 50
"""Lags of an autocorrelation unless others are requested."""


class WhitenedResult(ModelResult):
    """A result whose residual can be tested for whiteness."""

    def whitened(self) -> list[FloatArray]:
        """Whitened residual of each run: independent and of unit variance if it is noise."""
        base = self.fitted_base()
        c = base.conditions
        return whitened_runs(base.residual(), c.time_s, c.starts)

    def plot_autocorrelation(self, lags: int = LAGS) -> Any:
        """Plot the autocorrelation of the whitened residual (Plotly figure)."""
        return figures.autocorrelation(self.some_whitened(), lags)

    def plot_normal(self) -> Any:
        """Plot the quantiles of the whitened residual against normal ones (Plotly figure)."""
        return figures.normal_quantiles(np.concatenate(self.some_whitened()))

    def some_whitened(self) -> list[FloatArray]:
        """`whitened`, or `InputError` if every run is too short."""
        found = self.whitened()
        if not found:
            runs = f"{self.fitted_base().conditions.runs} runs of a few samples"
            raise InputError(
                "campaign", "residual", runs, "a run long enough to estimate its noise"
            )
        return found
