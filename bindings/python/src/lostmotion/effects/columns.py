"""The columns that effects need, and those that recordings lack."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lostmotion.effects.conditions import Conditions
from lostmotion.effects.effect import Effect
from lostmotion.units import split_unit

NO_COLUMN = "not testable with these columns: no "
"""Beginning of the reason why an effect without its columns is not testable."""


RECORDED_AS = {
    "input_velocity_rad_s": "input_angle_rad",
    "output_acceleration_rad_s2": "output_angle_rad",
}
"""Columns from which unrecorded conditions are derived."""

BY_THE_CLOCK = {"input_velocity_rad_s", "output_acceleration_rad_s2", "elapsed_s"}
"""Conditions that rows without time stamps do not have."""

DERIVED = {
    "input_velocity_rad_s": "speed of the input",
    "output_acceleration_rad_s2": "acceleration of the output",
}
"""Names of conditions without a column."""


def missing_columns(effect: Effect, conditions: Conditions) -> list[str]:
    """Columns that the effect needs and the recordings lack, by their names in files."""
    lacking = effect.needs - conditions.known()
    if not conditions.campaign.timed and lacking & BY_THE_CLOCK:
        return ["time_s"]
    return sorted({RECORDED_AS.get(need, need) for need in lacking})


def closed_by_columns(
    effects: Mapping[str, Effect], conditions: Conditions
) -> dict[str, list[str]]:
    """Effects that cannot be tested, by the quantity that the recordings lack."""
    closed: dict[str, list[str]] = {}
    for name, effect in effects.items():
        for column in missing_columns(effect, conditions):
            closed.setdefault(split_unit(column)[0], []).append(name)
    return closed


def constant_columns(effect: Effect, conditions: Conditions) -> list[str]:
    """Conditions that the effect needs and that are constant, in words."""
    flat = []
    for need in sorted(effect.needs - {"elapsed_s"}):
        column = conditions.columns[need]
        if np.ptp(column) <= 1e-12 * max(1.0, float(np.max(np.abs(column)))):
            flat.append(DERIVED.get(need, need))
    return flat


def varies(conditions: Conditions, column: str | None) -> bool:
    """Whether a column was recorded and varies."""
    return column in conditions.columns and float(np.ptp(conditions.columns[column])) > 0


def absorbed(effect: Effect, conditions: Conditions) -> bool:
    """Whether the baseline model absorbs an effect, so that only one of the two is estimated."""
    return bool(effect.absorbed) and not varies(conditions, effect.told_by)
