"""Terms that are added to the baseline model: effects with their values, and frozen shapes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.effects.effect import Effect
from lostmotion.fit.hysteresis import RADIUS_STEP
from lostmotion.fit.parameters import Block, Prior, block_names
from lostmotion.fit.point import Point

ANGLE_STEP = 1e-3
"""Relative step of a value in differences; values that act on the friction are not smooth on the
scale of a sample's noise and use `hysteresis.RADIUS_STEP`.
"""

EVENLY = 12.0
"""Precision of a uniform prior, relative to the inverse square of its range."""

RUN_SCATTER = 0.6
"""A dependence on a quantity that is constant within a run is determined only by differences
between runs: the accuracy of each run is limited by its own deviations, relative to the noise,
regardless of its number of samples. The prior of such a law is weighted accordingly: counting
single samples would fit the scatter of a few runs and extrapolate poorly.
"""


@dataclass
class Term:
    """An effect in the model, with its values and the places of the estimated ones."""

    effect: Effect
    values: FloatArray
    free: list[int]

    def around(self, index: int) -> tuple[FloatArray, FloatArray]:
        """Values with one of them a step lower and a step higher, within bounds."""
        value = self.effect.values[index]
        size = max(abs(self.values[index]), 0.1 * abs(value.typical), 1e-12)
        step = (ANGLE_STEP if self.effect.kind == "angle" else RADIUS_STEP) * size
        low, high = self.values.copy(), self.values.copy()
        low[index] = max(value.low, self.values[index] - step)
        high[index] = min(value.high, self.values[index] + step)
        return low, high

    def block(self, run_noise: float, column: Callable[[Term, int, Point], FloatArray]) -> Block:
        """Estimated values; laws between runs have a prior at typical values.

        For one linear step the value may be anywhere between its bounds, because few runs determine
        an exponent poorly.

        Parameters
        ----------
        run_noise : float
            Noise of a whole run, arc seconds.
        column : callable
            Derivative of the angle by the value of a place.
        """
        free = [self.effect.values[i] for i in self.free]
        low, high = (np.array([getattr(value, end) for value in free]) for end in ("low", "high"))
        laws = np.array([k for k, value in enumerate(free) if value.between_runs], dtype=np.intp)
        usual = np.array([free[k].typical for k in laws])
        sd = (high - low)[laws] / np.sqrt(EVENLY) / run_noise
        names = [f"{self.effect.name}.{value.name}" for value in free]

        def put(values: FloatArray) -> None:
            self.values = self.values.copy()
            self.values[self.free] = values

        def fill(point: Point, out: FloatArray) -> None:
            for k, i in enumerate(self.free):
                out[:, k] = column(self, i, point)

        return Block(
            names,
            self.values[self.free],
            low,
            high,
            EVENLY / (high - low) ** 2,
            put,
            fill,
            Prior(laws, usual, sd, per_run=True) if laws.size else None,
            keys=names,
            of=self,
        )

    def copy(self) -> Term:
        """An independent copy of the term."""
        return Term(self.effect, self.values.copy(), list(self.free))


@dataclass
class Additive:
    """A fixed unnamed shape: columns in arc seconds, and their coefficients."""

    name: str
    columns: FloatArray
    coefficients: FloatArray
    covariate: str = ""
    shape: str = ""

    def block(self) -> Block:
        """Coefficients without bounds."""
        count = self.coefficients.size

        def put(coefficients: FloatArray) -> None:
            self.coefficients = coefficients

        def fill(_: Point, out: FloatArray) -> None:
            out[:] = self.columns

        return Block(
            block_names(self.name, count),
            self.coefficients,
            np.full(count, -np.inf),
            np.full(count, np.inf),
            np.zeros(count),
            put,
            fill,
            of=self,
        )

    def copy(self) -> Additive:
        """An independent copy of the shape."""
        return Additive(
            self.name, self.columns, self.coefficients.copy(), self.covariate, self.shape
        )


def start_values(effect: Effect, given: Mapping[str, float]) -> FloatArray:
    """Typical values, with the known values of the drive."""
    values = effect.typical.copy()
    for i, value in enumerate(effect.values):
        if value.role == "given" and value.scale in given:
            values[i] = given[value.scale]
    return values
