"""How many false alarms a test of a null may see before it fails."""

from __future__ import annotations

from scipy.stats import binom

SURE = 0.999
"""A routine that keeps its level fails its test once in a thousand choices of seeds; the seeds are
fixed, so it passes for good."""


def most(trials: int, level: float) -> int:
    """Most false alarms of so many trials that go with a level."""
    return int(binom.ppf(SURE, trials, level))


def fewest(trials: int, level: float) -> int:
    """Fewest of so many trials that go with a share: for what must not be too careful either."""
    return int(binom.ppf(1.0 - SURE, trials, level))
