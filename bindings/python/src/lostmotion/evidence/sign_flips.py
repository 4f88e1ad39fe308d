"""The sign-flip test: what a candidate explains when the signs of whole runs change."""

from __future__ import annotations

import itertools

import numpy as np

from lostmotion import rules
from lostmotion.arrays import FloatArray

FLIPS = 4095
"""Random sign patterns; all of them where there are no more runs than `ALL_FLIPS_RUNS`."""

ALL_FLIPS_RUNS = 12

SEED = 20


def sign_patterns(runs: int) -> FloatArray:
    """Signs ``[pattern, run]``; the first pattern is the true one."""
    if runs <= ALL_FLIPS_RUNS:
        codes = np.arange(2 ** (runs - 1))
        return np.asarray(1.0 - 2.0 * ((codes[:, None] >> np.arange(runs)) & 1))
    signs = np.random.default_rng(SEED).choice([-1.0, 1.0], (FLIPS + 1, runs))
    signs[0] = 1.0
    return signs


def runs_least() -> int:
    """Least number of runs that can identify an effect.

    With fewer, the smallest p of the test, one of 2^(n-1) patterns, is above its level.
    """
    return next(n for n in itertools.count(1) if 0.5 ** (n - 1) <= rules.RUN_LEVEL)


def flip_p(signs: FloatArray, score: FloatArray, weight: FloatArray) -> float:
    """Fraction of the patterns that do at least as well as the true one, which is included.

    Parameters
    ----------
    signs : ndarray
    score : ndarray
        ``[run, direction]`` of each run under the baseline model.
    weight : ndarray
        Inverse of the information of the directions.
    """
    sums = signs @ score
    statistic = ((sums @ weight) * sums).sum(axis=1)
    return float(np.mean(statistic >= statistic[0] * (1 - 1e-12)))


def flip_limit(signs: FloatArray, ideal: FloatArray, weight: FloatArray, wald: float) -> float:
    """Largest `flip_p` that supports a candidate with this plan.

    Parameters
    ----------
    signs : ndarray
    ideal : ndarray
        Score of each run if it agreed exactly with the fitted candidate.
    weight : ndarray
    wald : float
        Noise determines the signs of runs that show almost nothing: allowed deviation of the sum.
    """
    sums = signs @ ideal
    reach = ((sums @ weight) * sums).sum(axis=1)
    least = max(1.0 - 1.0 / np.sqrt(max(wald, 1.0)), 0.0) ** 2
    best = float(np.mean(reach >= reach[0] * least * (1 - 1e-9)))
    return max(best, rules.RUN_LEVEL)
