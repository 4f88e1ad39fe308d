"""Helpers of the tests of nulls: permitted false alarms, and linear data of many runs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.stats import binom

from lostmotion.evidence.noise import Noise

Numbers = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

SURE = 0.999
"""A routine that keeps its level fails its test for one in a thousand choices of seeds; the seeds
are fixed, so the test always passes."""


def most(trials: int, level: float) -> int:
    """Most false alarms of a number of trials that are consistent with a level."""
    return int(binom.ppf(SURE, trials, level))


def fewest(trials: int, level: float) -> int:
    """Fewest of a number of trials that are consistent with a share: for routines that must not be
    too conservative."""
    return int(binom.ppf(1.0 - SURE, trials, level))


def ramps(runs: int, rows: int) -> tuple[Numbers, Places, Places]:
    """Runs of a ramp from -1 to 1 each: the ramp, the first rows of the runs, the run of a row."""
    ramp = np.tile(np.linspace(-1, 1, rows), runs)
    return ramp, np.arange(runs + 1) * rows, np.repeat(np.arange(runs), rows)


def white(runs: int) -> Noise:
    """White noise of unit variance."""
    return Noise([np.zeros(0)] * runs, np.ones(runs))
