"""Conditions of runs: amplitude, temperature, speed, position, direction of the load.

A model fitted under some conditions predicts the others: runs of one condition are left out
together.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.effects.conditions import Conditions
from lostmotion.units import plain_number

LEVEL_APART = 0.1
"""Least distance between settings of a condition, as a share of its range (chosen: a tenth)."""

LEVELS_MOST = 5
"""With more settings the runs are divided into three groups of similar size instead (chosen: each
group costs a fit and must be large enough for a real prediction).
"""

STANDS_RAD = np.pi / 4
"""A run whose output turns by less is at one position (chosen: an eighth of a turn)."""

ONE_SIDED = 0.1
"""A run has load in one direction only if the other direction reaches at most this share of its
amplitude (chosen)."""


@dataclass(frozen=True)
class Setting:
    """Runs of one setting of a condition.

    Attributes
    ----------
    condition : str
    low, high : float
        Range of the runs, in `unit`.
    unit : str
    runs : tuple of int
    name : str
        Name, if numbers do not describe it.
    """

    condition: str
    low: float
    high: float
    unit: str
    runs: tuple[int, ...]
    name: str = ""

    def __str__(self) -> str:
        """Describe the setting: ``amplitude 5 to 7 Nm``."""
        if self.name:
            return f"{self.condition} {self.name}"
        low, high = plain_number(self.low, 3), plain_number(self.high, 3)
        size = low if low == high else f"{low} to {high}"
        return f"{self.condition} {size} {self.unit}"


def settings_of(c: Conditions) -> dict[str, list[Setting]]:
    """Settings that the others can predict: the others have at least half of the samples."""
    rows = np.diff(c.starts)
    predicted = {
        condition: [one for one in settings if 2 * rows[list(one.runs)].sum() <= c.rows]
        for condition, settings in every_setting(c).items()
    }
    return {condition: settings for condition, settings in predicted.items() if settings}


def every_setting(c: Conditions) -> dict[str, list[Setting]]:
    """Settings of every condition that varies between these runs."""
    found = {}
    for condition, values, unit in values_by_run(c):
        groups = part_by_value(values)
        if len(groups) > 1:
            found[condition] = [
                Setting(
                    condition,
                    float(values[group].min()),
                    float(values[group].max()),
                    unit,
                    tuple(int(run) for run in group),
                )
                for group in groups
            ]
    sides = load_directions(c)
    if len(sides) > 1:
        found["load direction"] = sides
    return found


def values_by_run(c: Conditions) -> Iterator[tuple[str, FloatArray, str]]:
    """Name, value of each run, and unit of every condition that was measured."""
    yield "amplitude", np.maximum.reduceat(np.abs(c.torque), c.starts[:-1]), "Nm"
    if "temperature_C" in c.columns:
        yield "temperature", c.run_mean(c.columns["temperature_C"]), "degC"
    speed = c.columns.get("input_velocity_rad_s")
    if speed is not None:
        yield "speed", np.sqrt(c.run_mean(speed**2)), "rad/s of the input"
    for name in ("input", "output"):
        angle = c.columns.get(f"{name}_angle_rad")
        if angle is None:
            continue
        starts = c.starts[:-1]
        swing = np.maximum.reduceat(angle, starts) - np.minimum.reduceat(angle, starts)
        if np.all(swing < STANDS_RAD):
            place = np.rad2deg(np.mod(c.run_mean(angle), 2 * np.pi))
            yield f"{name} position", place, "deg"


def part_by_value(values: FloatArray) -> list[IntArray]:
    """Divide runs into settings: at gaps, else into three groups of similar size."""
    order = np.argsort(values, kind="stable")
    spread = np.diff(values[order])
    whole = float(np.ptp(values))
    if whole <= 1e-9 * float(np.max(np.abs(values), initial=1e-300)):
        return [order]
    groups = np.split(order, np.flatnonzero(spread > LEVEL_APART * whole) + 1)
    if 1 < len(groups) <= LEVELS_MOST:
        return groups
    return [part for part in np.array_split(order, 3) if part.size]


def load_directions(c: Conditions) -> list[Setting]:
    """Runs with load in one direction, in the other, or in both."""
    starts = c.starts[:-1]
    most, least = np.maximum.reduceat(c.torque, starts), np.minimum.reduceat(c.torque, starts)
    size = ONE_SIDED * np.maximum(most, -least)
    forward, backward = least > -size, most < size
    parts = {"positive": forward, "negative": backward, "both": ~(forward | backward)}
    return [
        Setting("load direction", 0.0, 0.0, "", tuple(np.flatnonzero(part).tolist()), name)
        for name, part in parts.items()
        if part.any()
    ]
