"""Fitted ranges, and the extrapolation of a prediction beyond them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lostmotion.arrays import BoolArray
from lostmotion.drives import FIT_RANGES
from lostmotion.effects.conditions import Conditions

BEYOND = {
    "torque_Nm": "torque",
    "temperature_C": "temperature",
    "input_velocity_rad_per_s": "speed",
}
"""Keys and names of the ranges that a prediction is compared with."""

LEAST_BEYOND = 1.01
"""Multiple of the fitted range above which extrapolation is reported: less is reading noise
(chosen).
"""


def fitted_ranges(conditions: Conditions, rows: BoolArray | None = None) -> dict[str, list[float]]:
    """Ranges of the samples, by default of all, by the keys of a fit."""
    found = {}
    for key in FIT_RANGES:
        column = conditions.columns.get(key.replace("rad_per_s", "rad_s"))
        if column is not None:
            seen = column if rows is None else column[rows]
            found[key] = [float(np.min(seen)), float(np.max(seen))]
    return found


def beyond(
    fitted: Mapping[str, Sequence[float]], predicted: Mapping[str, Sequence[float]]
) -> dict[str, float | None]:
    """Extrapolation of a prediction, in multiples of the fitted range.

    1.5: 1.5 times the half range away from the middle of the fitted range. None: fitted at only one
    value, and predicted at another.

    Returns
    -------
    dict
        By torque, temperature and speed; only where extrapolated.
    """
    found: dict[str, float | None] = {}
    for key, name in BEYOND.items():
        if key not in fitted or key not in predicted:
            continue
        low, high = fitted[key]
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        reach = max(abs(end - middle) for end in predicted[key])
        if half == 0.0 and reach > 0.0:
            found[name] = None
        elif reach > LEAST_BEYOND * half:
            found[name] = float(reach / half)
    return found


def in_words(factors: Mapping[str, float | None]) -> str:
    """Return ``1.6 times the fitted range of torque, temperature fitted at one value only``."""
    return ", ".join(
        f"{name} fitted at one value only"
        if times is None
        else f"{times:.2g} times the fitted range of {name}"
        for name, times in factors.items()
    )
