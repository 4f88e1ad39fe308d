"""Forms of effects: how they are linearised, and how coefficients convert to values.

In the screening, the columns of all starts together represent the effect; the joint refit follows.
An effect with its own form has a file of its name in `own_forms`.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.candidates.own_forms import own_forms
from lostmotion.candidates.slipped_teeth import slipped_teeth
from lostmotion.candidates.tangents import (
    Tangents,
    at_base,
    difference,
    distinct,
    start_points,
    thresholds,
    unit_size,
    wound_up,
)
from lostmotion.effects.effect import Effect
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.point import Point

HALF_A_TOOTH = 0.5
"""Least multiple of a tooth that counts as a slip."""


class Starts(Protocol):
    """Values at which columns were linearised, and the start that each column belongs to."""

    starts: list[FloatArray]
    start_of: list[int]


class Form(Protocol):
    """How effects of one form are linearised, and how coefficients convert to values."""

    def linearise(
        self, effect: Effect, base: BaselineModel, point: Point, ratio: float
    ) -> Tangents:
        """Compute the columns of an effect at a fitted baseline model."""
        ...

    def values(
        self, effect: Effect, of: Starts, start: int, coefficients: FloatArray
    ) -> FloatArray:
        """Values of the effect for the coefficients of the columns of one start."""
        ...

    def right_way(self, effect: Effect, coefficients: FloatArray) -> bool:
        """Whether these coefficients belong to this start and not to another."""
        ...

    def possible(self, effect: Effect, coefficients: FloatArray) -> bool:
        """Whether these coefficients are possible for the effect."""
        ...


class Linear:
    """Linear values, for starts of the inner ones."""

    def linearise(
        self, effect: Effect, base: BaselineModel, point: Point, ratio: float
    ) -> Tangents:
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
            # An effect on the torque winds up the drive, through its friction and its soft range.
            kept = distinct(made.columns, made.start_of)
            made.start_of = [made.start_of[k] for k in kept]
            made.columns = [wound_up(effect, base, point, *units[k], made.columns[k]) for k in kept]
        return made

    def values(
        self, effect: Effect, of: Starts, start: int, coefficients: FloatArray
    ) -> FloatArray:
        """See `Form`: one column per linear value; multiples of earlier ones were removed."""
        values = of.starts[start].copy()
        linear = effect.indices("linear")
        if of.start_of.count(start) == len(linear):
            values[linear] = coefficients
        elif of.start_of.count(0) == len(linear):
            values[linear[-coefficients.size :]] = coefficients
        return values

    def right_way(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`: friction and creep dissipate energy; no value may contradict the name."""
        linear = effect.indices("linear")
        values = np.zeros(len(effect.values))
        values[linear[: coefficients.size]] = coefficients
        return self.possible(effect, coefficients) and effect.against_its_name(values) is None

    def possible(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`: one of several values can be zero."""
        linear = [effect.values[i] for i in effect.indices("linear")]
        return len(linear) > 1 or bool(linear[0].low < 0.0 or coefficients[0] > 0.0)


class Differenced:
    """Values that all enter nonlinearly: derivatives at zero."""

    def linearise(
        self, effect: Effect, base: BaselineModel, point: Point, ratio: float
    ) -> Tangents:
        """See `Form`."""
        values = start_points(effect, base, ratio)[0]
        shape = effect.inner()
        columns = [difference(effect, i, base, point, values) for i in shape]
        return Tangents(columns, [values], [0] * len(shape))

    def values(
        self, effect: Effect, of: Starts, start: int, coefficients: FloatArray
    ) -> FloatArray:
        """See `Form`."""
        values = of.starts[start].copy()
        shape = effect.inner()
        values[shape] = 0.0
        values[shape[: coefficients.size]] = coefficients
        return values

    def right_way(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`."""
        return True

    def possible(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`."""
        return True


class WholeTeeth:
    """Slipped teeth, at the threshold found or at given starts: whole teeth."""

    def linearise(
        self, effect: Effect, base: BaselineModel, point: Point, ratio: float
    ) -> Tangents:
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
        """See `Form`: the number of teeth is an integer for every coefficient."""
        return of.starts[start].copy()

    def right_way(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`."""
        return True

    def possible(self, effect: Effect, coefficients: FloatArray) -> bool:
        """See `Form`: there are no fractions of a tooth."""
        return float(np.max(np.abs(coefficients))) >= HALF_A_TOOTH


def form_of(effect: Effect) -> Form:
    """Return how an effect is linearised."""
    own: Form | None = own_forms().get(effect.name)
    if own is not None:
        return own
    if effect.steps:
        return WholeTeeth()
    return Linear() if effect.indices("linear") else Differenced()


def tangents_of(effect: Effect, base: BaselineModel, point: Point, ratio: float) -> Tangents:
    """Columns of a `resolved` effect not yet in the model, without multiples."""
    made = form_of(effect).linearise(effect, base, point, ratio)
    kept = distinct(made.columns, made.start_of)
    columns = [made.columns[k] for k in kept]
    return Tangents(columns, made.starts, [made.start_of[k] for k in kept])
