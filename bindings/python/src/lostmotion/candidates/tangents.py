"""Tangents of an effect at the fitted baseline model: its contribution to the recordings.

Linear values give exact columns. Nonlinear values are evaluated at a few starts, which the card of
the effect states.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from lostmotion import units
from lostmotion.arrays import FloatArray
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.effect import Effect, Value
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.point import Point
from lostmotion.fit.terms import start_values
from lostmotion.units import ARCSEC

POINTS_MAX = 4
"""Largest number of combinations of starts of the inner values of an effect."""

TORQUE_SHARES = (0.02, 0.1, 0.5)
"""Default starts of a torque value, relative to rated torque."""

TAKEUP_MOST = 0.54
"""Largest torque that takes up a gap, relative to rated torque.

Drives are soft below the first corner T1 of their torsion curve: at 0.13 to 0.54 of it in the
tables of Harmonic Drive SE (tests/data/catalogue), in half of them below 0.17.
"""

SMALL = 0.005
"""Step of a torque effect in finite differences, relative to rated torque."""


def given_values(base: BaselineModel, ratio: float) -> dict[str, float]:
    """Known values of the drive, by the scales of effects."""
    # Two lobes: the teeth differ by two, the flexspline has 2 |ratio| of them.
    return {
        "ratio": abs(ratio),
        "rated_torque": base.rated_torque_Nm,
        "tooth_angle": 2 * np.pi / (2 * abs(ratio) + 2),
    }


def grid(effect: Effect, index: int, base: BaselineModel) -> list[float]:
    """Starts of one inner value, as stated on the card."""
    value = effect.values[index]
    if value.scale == "times":
        starts = recorded_times(base.conditions)
    elif value.scale == "speeds":
        starts = recorded_speeds(base.conditions)
    elif value.starts:
        sense = -1.0 if value.sign == "ratio" and value.high <= 0 else 1.0
        starts = [sense * share * start_scale(value, base) for share in value.starts]
    elif (unit := units.split_unit(value.name)[1]) and unit.dimension == units.TORQUE:
        starts = [float(unit.from_si(share * base.rated_torque_Nm)) for share in TORQUE_SHARES]
    elif value.typical == 0:
        starts = [0.0]
    else:
        starts = [0.25 * value.typical, value.typical, 4.0 * value.typical]
    return [float(np.clip(start, value.low, value.high)) for start in starts]


def start_scale(value: Value, base: BaselineModel) -> float:
    """Scale of the start values of a value."""
    if value.scale == "rated_torque":
        return base.rated_torque_Nm
    if value.scale == "rated_windup":
        return base.rated_torque_Nm * base.curve.mean_slope * ARCSEC
    if value.scale == "largest_torque":
        return base.largest
    if value.scale == "largest_speed":
        speed = base.conditions.columns.get("input_velocity_rad_s", np.zeros(1))
        return float(np.abs(speed).max())
    return value.high if value.scale == "greatest" else 1.0


def recorded_times(c: Conditions) -> list[float]:
    """Times that the recordings resolve, from three samples to a tenth of the longest run."""
    steps = c.columns["elapsed_s"]
    least = 3.0 * float(np.median(steps[steps > 0])) if np.any(steps > 0) else 1.0
    longest = max(float(np.max(np.diff(c.starts))) * float(np.median(steps)), 10 * least)
    return list(np.geomspace(least, longest / 10.0, 4))


def recorded_speeds(c: Conditions) -> list[float]:
    """Input speeds that the recordings resolve, from below the slowest to the fastest."""
    speed = np.abs(c.columns["input_velocity_rad_s"])
    moving = speed[speed > 0.02 * speed.max()] if speed.max() > 0 else np.ones(1)
    return list(np.geomspace(max(0.3 * np.quantile(moving, 0.1), 1e-3), np.max(moving), 3))


def resolved(effect: Effect, base: BaselineModel, ratio: float) -> Effect:
    """The effect with its inner values bounded by the recordings and by the drive.

    Beyond the speeds and times that the recordings resolve, an effect would fit the noise of a
    drive at rest. A gap that the rated torque hardly closes would be a stiffness.
    """
    values = []
    for i, value in enumerate(effect.values):
        if value.scale in ("speeds", "times"):
            starts = grid(effect, i, base)
            if min(starts) < max(starts):  # short runs resolve a single time, not a range
                value = replace(value, low=min(starts), high=max(starts))
        elif value.role == "shape" and value.scale == "rated_torque":
            value = replace(value, high=TAKEUP_MOST * base.rated_torque_Nm)
        elif value.sign == "ratio":
            value = replace(value, low=0.0) if ratio > 0 else replace(value, high=0.0)
        values.append(value)
    return replace(effect, values=tuple(values))


def start_points(effect: Effect, base: BaselineModel, ratio: float) -> list[FloatArray]:
    """Starts of all inner values, linear ones at zero; at most `POINTS_MAX`."""
    first = start_values(effect, given_values(base, ratio))
    linear = effect.indices("linear")
    shapes = effect.inner()
    if not linear:
        return [first]
    first[linear] = 0.0
    every = list(product(*(grid(effect, i, base) for i in shapes)))
    keep = every if len(every) <= POINTS_MAX else every[:: -(-len(every) // POINTS_MAX)]
    points = []
    for combination in keep:
        values = first.copy()
        values[shapes] = combination
        points.append(values)
    return points


@dataclass
class Tangents:
    """Columns of an effect that is not in the model, arc seconds per unit.

    Attributes
    ----------
    columns : list of ndarray
    starts : list of ndarray
        Values at which the columns were linearised.
    start_of : list of int
        The start that each column belongs to.
    """

    columns: list[FloatArray]
    starts: list[FloatArray]
    start_of: list[int]


def thresholds(effect: Effect, base: BaselineModel, values: FloatArray) -> list[FloatArray]:
    """Values of an effect at starts of each of its inner ones."""
    out = []
    for i in effect.inner():
        for threshold in grid(effect, i, base):
            out.append(values.copy())
            out[-1][i] = threshold
    return out


def at_base(effect: Effect, values: FloatArray, base: BaselineModel, point: Point) -> FloatArray:
    """Contribution of an effect at a fitted baseline model; arc seconds if it acts on the angle."""
    return base.run_effect(effect, values, point) / ARCSEC


def wound_up(
    effect: Effect,
    base: BaselineModel,
    point: Point,
    unit: FloatArray,
    index: int,
    acts: FloatArray,
) -> FloatArray:
    """Derivative of the angle by a linear value acting on torque or friction, `acts` per unit."""
    peak = float(np.max(np.abs(acts))) * ARCSEC
    if not np.isfinite(peak) or peak == 0:
        return np.zeros_like(acts)
    small = unit.copy()
    small[index] *= 0.05
    if effect.kind == "torque":
        small[index] = SMALL * base.rated_torque_Nm / peak
    back = small.copy()
    back[index] = -small[index]
    return base.slope_by(effect, back, small, index, point)


def unit_size(effect: Effect, index: int) -> float:
    """A size at which a linear value is evaluated."""
    value = effect.values[index]
    return float(value.typical or 1e-3 * value.high)


def difference(
    effect: Effect, index: int, base: BaselineModel, point: Point, values: FloatArray
) -> FloatArray:
    """Derivative at zero by a nonlinear value."""
    value = effect.values[index]
    step = 0.05 * abs(value.typical or value.high)
    if value.scale == "sample_time":
        elapsed = base.conditions.columns["elapsed_s"]
        step = float(np.median(elapsed[elapsed > 0])) if np.any(elapsed > 0) else step
    nothing = values.copy()
    nothing[effect.inner()] = 0.0
    high, low = nothing.copy(), nothing.copy()
    high[index], low[index] = step, -step
    return base.slope_by(effect, low, high, index, point)


def distinct(columns: list[FloatArray], start_of: list[int]) -> list[int]:
    """Indices of the columns that are not multiples of an earlier one of their own start.

    A start whose columns are all multiples of those of earlier starts is left out.
    """
    kept: list[int] = []
    units: dict[int, list[FloatArray]] = {}
    for start in sorted(set(start_of)):
        known = [unit for others in units.values() for unit in others]
        own: list[FloatArray] = []
        places: list[int] = []
        for i, column in enumerate(columns):
            norm = float(np.linalg.norm(column))
            if start_of[i] == start and np.isfinite(norm) and norm > 0:
                unit = column / norm
                if not is_multiple(unit, own):
                    places.append(i)
                    own.append(unit)
        if not all(is_multiple(unit, known) for unit in own):
            kept += places
            units[start] = own
    return sorted(kept)


def is_multiple(unit: FloatArray, others: list[FloatArray]) -> bool:
    """Whether a column of unit length is a multiple of one of some others."""
    return any(abs(float(unit @ other)) >= 1 - 1e-9 for other in others)
