"""Tangents of an effect at the fitted base: what it would add to the recordings.

Linear values give exact columns. Values that enter otherwise are stepped over a few starts, and all
their columns together stand for the effect in the screening; the joint refit comes afterwards. What
a coefficient of a column says of the values is known to the form that made it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Protocol

import numpy as np
import numpy.typing as npt

from lostmotion.candidates.slipped_teeth import slipped_teeth
from lostmotion.effects.effect import Effect
from lostmotion.fit.baseline import Base, Point, Term, start_values
from lostmotion.units import ARCSEC

FloatArray = npt.NDArray[np.float64]

STARTS_MAX = 4
"""Starts of the inner values of an effect."""

TAKEUP_SHARES = (0.004, 0.03)
"""Starts of a torque at which something closes, over rated torque."""

DRAG_SHARES = (0.005, 0.02)
"""Starts of the drag of turning, seen at the output, over rated torque."""

RUNOUT_RAD = 2e-5
CLOSING_ANGLE = 2.0
CLOSING_SHARES = (0.1, 1.0)
"""Starts of two lobes that do not run true: run-out; angle in which a lobe's teeth come into
contact, over the run-out; the torque that this takes, over rated torque."""

SMALL = 0.005
"""Largest torque over the rated one that an effect on the torque has where it is differenced."""

HALF_A_TOOTH = 0.5
"""Least multiple of a slipped tooth that is not taken for something else."""


def given_values(base: Base, ratio: float) -> list[tuple[str, float]]:
    """What is known of the drive, by the names that effects have for it."""
    # Two lobes: the teeth differ by two, the flexspline has 2 |ratio| of them.
    return [
        ("ratio", abs(ratio)),
        ("reference_Nm", base.rated_torque_Nm),
        ("tooth_angle_rad", 2 * np.pi / (2 * abs(ratio) + 2)),
    ]


def grid(effect: Effect, index: int, base: Base) -> list[float]:
    """Starts of one inner value."""
    c = base.conditions
    value = effect.values[index]
    name = value.name
    if name == "takeup_Nm":
        starts = [share * base.rated_torque_Nm for share in TAKEUP_SHARES]
    elif name == "drag_Nm":
        sense = 1.0 if value.high > 0 else -1.0
        starts = [sense * share * base.rated_torque_Nm for share in DRAG_SHARES]
    elif name == "threshold_Nm":
        starts = [share * base.largest for share in (0.7, 0.95)]
    elif name.endswith("_Nm"):
        starts = [share * base.rated_torque_Nm for share in (0.02, 0.1, 0.5)]
    elif name == "onset_s":
        steps = c.columns["elapsed_s"]
        least = 3.0 * float(np.median(steps[steps > 0])) if np.any(steps > 0) else 1.0
        longest = max(float(np.max(np.diff(c.starts))) * float(np.median(steps)), 10 * least)
        starts = list(np.geomspace(least, longest / 10.0, 4))
    elif name == "stribeck_rad_s":
        speed = np.abs(c.columns["input_velocity_rad_s"])
        moving = speed[speed > 0.02 * speed.max()] if speed.max() > 0 else np.ones(1)
        starts = list(np.geomspace(max(0.3 * np.quantile(moving, 0.1), 1e-3), np.max(moving), 3))
    elif name == "blend_rad_s":
        speed = np.abs(c.columns["input_velocity_rad_s"])
        starts = [max(0.02 * float(speed.max()), 1e-4)]
    elif name == "exponent":
        starts = [0.5, 1.0]
    elif name == "widening":
        starts = [0.02, 0.08, 0.3]
    elif name == "gap_rad":
        starts = [value.high]
    else:
        starts = [0.25 * value.typical, value.typical, 4.0 * value.typical]
        if value.typical == 0:
            starts = [0.0]
    return [float(np.clip(start, value.low, value.high)) for start in starts]


RESOLVED = ("stribeck_rad_s", "onset_s")
"""Inner values that a fit holds to what speeds and times of these recordings resolve: beyond them
an effect would follow the noise of a standing drive."""


def resolved(effect: Effect, base: Base, ratio: float) -> Effect:
    """The effect with the bounds of its inner values within what was recorded, and of the drive."""
    values = []
    for i, value in enumerate(effect.values):
        if value.name in RESOLVED:
            starts = grid(effect, i, base)
            if min(starts) < max(starts):  # runs of a few samples resolve one time and no range
                value = replace(value, low=min(starts), high=max(starts))
        elif value.name == "drag_Nm":  # on the output, which turns against the input or with it
            value = replace(value, low=0.0) if ratio > 0 else replace(value, high=0.0)
        values.append(value)
    return replace(effect, values=tuple(values))


def start_points(effect: Effect, base: Base, ratio: float) -> list[FloatArray]:
    """Starts of all inner values, linear ones at zero; at most `STARTS_MAX`."""
    first = start_values(effect, given_values(base, ratio))
    linear = effect.indices("linear")
    shapes = effect.indices("shape")
    if not linear:
        return [first]
    first[linear] = 0.0
    every = list(product(*(grid(effect, i, base) for i in shapes)))
    keep = every if len(every) <= STARTS_MAX else every[:: -(-len(every) // STARTS_MAX)]
    points = []
    for combination in keep:
        values = first.copy()
        values[shapes] = combination
        points.append(values)
    return points


class Starts(Protocol):
    """Values about which columns were taken, and the place of those of each column."""

    starts: list[FloatArray]
    start_of: list[int]


@dataclass
class Tangents:
    """Columns of an effect that is not in the model, arc seconds per unit.

    Attributes
    ----------
    columns : list of ndarray
    starts : list of ndarray
        Values about which the columns were taken.
    start_of : list of int
        The start that each column belongs to.
    """

    columns: list[FloatArray]
    starts: list[FloatArray]
    start_of: list[int]


class Form(Protocol):
    """How effects of one form are linearised, and what coefficients say of their values."""

    def linearise(self, effect: Effect, base: Base, point: Point, ratio: float) -> Tangents:
        """Take the columns of an effect at a fitted base."""
        ...

    def values(
        self, effect: Effect, of: Starts, start: int, coefficients: FloatArray
    ) -> FloatArray:
        """Values of the effect that coefficients of the columns of one start stand for."""
        ...

    def right_way(self, effect: Effect, coefficients: FloatArray) -> bool:
        """Whether these coefficients are those of the start, and not of another."""
        ...

    def possible(self, effect: Effect, coefficients: FloatArray) -> bool:
        """Whether the effect can have these coefficients at all."""
        ...


class Linear:
    """Values to which the effect is proportional, over starts of the inner ones."""

    def linearise(self, effect: Effect, base: Base, point: Point, ratio: float) -> Tangents:
        """See `Form`."""
        made = Tangents([], start_points(effect, base, ratio), [])
        linear = effect.indices("linear")
        units: list[tuple[FloatArray, int]] = []
        for number, values in enumerate(made.starts):
            for i in linear:
                unit = values.copy()
                unit[linear] = 0.0
                unit[i] = unit_size(effect, i)
                made.columns.append(at_base(effect, unit, base, point) / unit[i])
                made.start_of.append(number)
                units.append((unit, i))
        if effect.kind != "angle":
            # What acts on the torque winds up the drive: through its friction, where it is soft.
            kept = distinct(made.columns)
            made.start_of = [made.start_of[k] for k in kept]
            made.columns = [wound_up(effect, base, *units[k], made.columns[k]) for k in kept]
        return made

    def values(
        self, effect: Effect, of: Starts, start: int, coefficients: FloatArray
    ) -> FloatArray:
        """See `Form`: columns follow the linear values; multiples of earlier ones are gone."""
        values = of.starts[start].copy()
        linear = effect.indices("linear")
        if of.start_of.count(start) == len(linear):
            values[linear] = coefficients
        elif of.start_of.count(0) == len(linear):
            values[linear[-coefficients.size :]] = coefficients
        return values

    def right_way(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`: friction and creep take, they never give."""
        linear = [effect.values[i] for i in effect.indices("linear")]
        return len(linear) > 1 or bool(linear[0].low < 0.0 or coefficients[0] > 0.0)

    def possible(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`."""
        return self.right_way(effect, coefficients)


class Differenced:
    """Values that all enter in another way: derivatives at nothing."""

    def linearise(self, effect: Effect, base: Base, point: Point, ratio: float) -> Tangents:
        """See `Form`."""
        values = start_points(effect, base, ratio)[0]
        shape = effect.indices("shape")
        columns = [difference(effect, i, base, point, values) for i in shape]
        return Tangents(columns, [values], [0] * len(shape))

    def values(
        self, effect: Effect, of: Starts, start: int, coefficients: FloatArray
    ) -> FloatArray:
        """See `Form`."""
        values = of.starts[start].copy()
        shape = effect.indices("shape")
        values[shape] = 0.0
        values[shape[: coefficients.size]] = coefficients
        return values

    def right_way(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`."""
        return True

    def possible(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`."""
        return True


def thresholds(effect: Effect, base: Base, values: FloatArray) -> list[FloatArray]:
    """Values of an effect at starts of each of its inner ones."""
    out = []
    for i in effect.indices("shape"):
        for threshold in grid(effect, i, base):
            out.append(values.copy())
            out[-1][i] = threshold
    return out


class WholeTeeth:
    """Teeth that slipped, at the threshold that meets them, or from some: whole teeth for each."""

    def linearise(self, effect: Effect, base: Base, point: Point, ratio: float) -> Tangents:
        """See `Form`."""
        made = Tangents([], [], [])
        values = start_points(effect, base, ratio)[0]
        met = slipped_teeth(base, effect, values)
        for slipped in thresholds(effect, base, values) if met is None else [met]:
            made.start_of.append(len(made.starts))
            made.starts.append(slipped)
            made.columns.append(at_base(effect, slipped, base, point))
        return made

    def values(
        self, effect: Effect, of: Starts, start: int, coefficients: FloatArray
    ) -> FloatArray:
        """See `Form`: the teeth are whole whatever the coefficient."""
        return of.starts[start].copy()

    def right_way(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`."""
        return True

    def possible(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`: there is no part of a tooth."""
        return float(np.max(np.abs(coefficients))) >= HALF_A_TOOTH


class Lobes:
    """Two lobes: run-out in four directions beside the plain first order.

    The run-out is no linear value. One lobe leads and the other lags: a size below nothing is that
    of lobes a quarter turn on, which have a start of their own.
    """

    def linearise(self, effect: Effect, base: Base, point: Point, ratio: float) -> Tangents:
        """See `Form`."""
        values = start_points(effect, base, ratio)[0]
        made = Tangents([], [], [])
        for i in effect.indices("linear"):
            unit = values.copy()
            unit[2:4] = 0.0
            unit[i] = unit_size(effect, i) or 1e-5
            made.columns.append(at_base(effect, unit, base, point) / unit[i])
            made.start_of.append(0)
        for share, angle in product(CLOSING_SHARES, np.arange(4) * np.pi / 4):
            start = values.copy()
            start[0] = start[1] = 0.0
            start[2], start[3] = RUNOUT_RAD * np.cos(angle), RUNOUT_RAD * np.sin(angle)
            start[5] = share * base.rated_torque_Nm
            start[4] = CLOSING_ANGLE * RUNOUT_RAD / start[5]
            made.start_of.append(len(made.starts))
            made.starts.append(start)
            made.columns.append(at_base(effect, start, base, point) / RUNOUT_RAD)
        return made

    def values(
        self, effect: Effect, of: Starts, start: int, coefficients: FloatArray
    ) -> FloatArray:
        """See `Form`: run-out and compliance together, so the shape over the torque stays."""
        values = of.starts[start].copy()
        runout = np.hypot(values[2], values[3])
        size = coefficients[0]
        if start == 0:
            values[:2] = coefficients[:2]
            size = coefficients[2] if coefficients.size > 2 else runout
        values[2:5] *= abs(size) / runout
        return values

    def right_way(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`."""
        return bool(coefficients[-1] > 0)

    def possible(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`."""
        return True


OWN_FORMS: dict[str, Form] = {"ratcheting": WholeTeeth(), "lobe_eccentricity": Lobes()}
"""Effects of the library whose values are neither linear nor small."""


def form_of(effect: Effect) -> Form:
    """Return how an effect is linearised."""
    usual: Form = Linear() if effect.indices("linear") else Differenced()
    return OWN_FORMS.get(effect.name, usual)


def at_base(effect: Effect, values: FloatArray, base: Base, point: Point) -> FloatArray:
    """What an effect does at a fitted base, in arc seconds where it acts on the angle."""
    found = effect.run(values, base.conditions, point.torque, point.elastic * ARCSEC, point.wound)
    return found / ARCSEC


def tangents_of(effect: Effect, base: Base, point: Point, ratio: float) -> Tangents:
    """Columns of a `resolved` effect that is not in the model yet, no multiples of one another."""
    made = form_of(effect).linearise(effect, base, point, ratio)
    kept = distinct(made.columns)
    columns = [made.columns[k] for k in kept]
    return Tangents(columns, made.starts, [made.start_of[k] for k in kept])


def wound_up(
    effect: Effect, base: Base, unit: FloatArray, index: int, acts: FloatArray
) -> FloatArray:
    """Slope of the angle over a linear value that acts on torque or friction, as `acts` a unit."""
    peak = float(np.max(np.abs(acts))) * ARCSEC
    if not np.isfinite(peak) or peak == 0:
        return np.zeros_like(acts)
    small = unit.copy()
    small[index] *= 0.05
    if effect.kind == "torque":
        small[index] = SMALL * base.rated_torque_Nm / peak
    return slope_of_model(effect, base, small, index)


def unit_size(effect: Effect, index: int) -> float:
    """A size at which a linear value is evaluated."""
    value = effect.values[index]
    return float(value.typical or 1e-3 * value.high)


def difference(
    effect: Effect, index: int, base: Base, point: Point, values: FloatArray
) -> FloatArray:
    """Derivative at nothing by a value that has no linear form."""
    value = effect.values[index]
    step = 0.05 * abs(value.typical or value.high)
    if value.name == "lag_s":
        # A first-order lag far below the time between samples does nothing to them.
        elapsed = base.conditions.columns["elapsed_s"]
        step = float(np.median(elapsed[elapsed > 0])) if np.any(elapsed > 0) else step
    nothing = values.copy()
    nothing[effect.indices("shape")] = 0.0
    high, low = nothing.copy(), nothing.copy()
    high[index], low[index] = step, -step
    if effect.kind == "angle":
        c = base.conditions
        elastic = point.elastic * ARCSEC
        up = effect.run(high, c, point.torque, elastic, point.wound)
        down = effect.run(low, c, point.torque, elastic, point.wound)
        return np.asarray((up - down) / ARCSEC / (2 * step))
    return slope_of_model(effect, base, high, index)


def slope_of_model(effect: Effect, base: Base, high: FloatArray, index: int) -> FloatArray:
    """Slope of the whole model's angle over a value, between the value given and its mirror."""
    model = base.copy()
    term = Term(effect, high, [index])
    model.terms = [*model.terms, term]
    up = model.angle()
    term.values = high.copy()
    term.values[index] = -high[index]
    return np.asarray((up - model.angle()) / (2 * high[index]))


def distinct(columns: list[FloatArray]) -> list[int]:
    """Indices of the columns that are not multiples of one before."""
    kept: list[int] = []
    units: list[FloatArray] = []
    for i, column in enumerate(columns):
        norm = float(np.linalg.norm(column))
        if not np.isfinite(norm) or norm == 0:
            continue
        unit = column / norm
        if all(abs(float(unit @ other)) < 1 - 1e-9 for other in units):
            kept.append(i)
            units.append(unit)
    return kept
