"""Axes: conversion of numbers to positions in a figure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lostmotion.report.svg import FAINT, GRID, INK, SMALL_SIZE, SOFT, Array, Drawing, signs
from lostmotion.report.wording import grouped

TICK_PX = 4.0


def nice_step(span: float, ticks: float) -> float:
    """Step of 1, 2 or 5 times a power of ten that divides a span into about `ticks` parts."""
    rough = span / max(ticks, 1.0)
    power = 10.0 ** math.floor(math.log10(rough))
    for factor, following in ((1.0, 2.0), (2.0, 5.0), (5.0, 10.0)):
        if rough < power * math.sqrt(factor * following):
            return factor * power
    return 10.0 * power


def ticks_between(low: float, high: float, step: float) -> list[float]:
    """Multiples of a step from low to high."""
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [i * step for i in range(first, last + 1)]


def tick_label(value: float, step: float) -> str:
    """Write a tick's number with the digits that its step needs, and a true minus sign."""
    digits = max(0, -math.floor(math.log10(step) + 1e-9))
    text = f"{value:.{digits}f}"
    return signs(grouped(text)) if float(text) != 0 else text.removeprefix("-")


def round_up(value: float) -> float:
    """Next larger round number, for the end of an axis."""
    if not value > 0:
        return 1.0
    step = nice_step(value, 10)
    return step * math.ceil(value / step - 1e-9)


@dataclass
class Axes:
    """A rectangle of a drawing with a linear scale in both directions.

    Attributes
    ----------
    box : tuple
        Left, top, width and height in the drawing.
    x_range, y_range : tuple
        Numbers at the left and right end, at the bottom and the top.
    """

    drawing: Drawing
    box: tuple[float, float, float, float]
    x_range: tuple[float, float]
    y_range: tuple[float, float]

    def x(self, value: npt.ArrayLike) -> Array:
        """Horizontal positions of numbers."""
        left, _, width, _ = self.box
        low, high = self.x_range
        return np.asarray(left + (np.asarray(value, dtype=float) - low) / (high - low) * width)

    def y(self, value: npt.ArrayLike) -> Array:
        """Vertical positions of numbers."""
        _, top, _, height = self.box
        low, high = self.y_range
        return np.asarray(top + (high - np.asarray(value, dtype=float)) / (high - low) * height)

    def points(self, x: npt.ArrayLike, y: npt.ArrayLike) -> Array:
        """Positions of points, shape (n, 2)."""
        return np.column_stack((self.x(x), self.y(y)))

    def frame(
        self,
        x_label: str,
        y_label: str,
        *,
        x_step: float | None = None,
        y_step: float | None = None,
        x_numbers: bool = True,
        ticks: tuple[float, float] | None = None,
    ) -> None:
        """Draw grid, axes, ticks, numbers and labels; the y label is on top of its axis.

        Parameters
        ----------
        x_step, y_step : float, optional
            Distance of the ticks; by default chosen for the size.
        x_numbers : bool
            False if another chart below has the numbers.
        ticks : tuple, optional
            Approximate number of ticks in each direction; none with 0.
        """
        d = self.drawing
        left, top, width, height = self.box
        right, bottom = left + width, top + height
        across, up = ticks or (width / 75.0, height / 48.0)
        x_step = x_step or nice_step(self.x_range[1] - self.x_range[0], across)
        y_step = y_step or nice_step(self.y_range[1] - self.y_range[0], up)
        for value in ticks_between(*self.y_range, y_step) if up else ():
            at = float(self.y(value))
            d.line((left, at, right, at), FAINT if value == 0 else GRID)
            d.text(
                left - 7,
                at + 4,
                tick_label(value, y_step),
                anchor="end",
                size=SMALL_SIZE,
                fill=SOFT,
            )
        for value in ticks_between(*self.x_range, x_step):
            at = float(self.x(value))
            if value == 0 and self.x_range[0] < 0:
                d.line((at, top, at, bottom), FAINT)
            d.line((at, bottom, at, bottom + TICK_PX), SOFT)
            if x_numbers:
                d.text(
                    at,
                    bottom + 17,
                    tick_label(value, x_step),
                    anchor="middle",
                    size=SMALL_SIZE,
                    fill=SOFT,
                )
        d.line((left, bottom, right, bottom), SOFT)
        if y_label:
            d.text(left - 7, top - 10, y_label, size=SMALL_SIZE, fill=INK, anchor="start")
        if x_label:
            d.text(right, bottom + 34, x_label, size=SMALL_SIZE, anchor="end")

    def open(self) -> None:
        """Clip the following elements to the rectangle plus half a line width."""
        left, top, width, height = self.box
        self.drawing.open_window(left - 0.5, top - 1, width + 1, height + 2)

    def close(self) -> None:
        """End the clipped part."""
        self.drawing.close_window()

    def curve(
        self,
        x: npt.ArrayLike,
        y: npt.ArrayLike,
        stroke: str,
        width: float = 1.6,
        dash: str = "",
        opacity: float = 1.0,
    ) -> None:
        """Draw a curve."""
        self.drawing.curve(self.points(x, y), stroke, width, dash, opacity)

    def band(
        self,
        x: Array,
        low: Array,
        high: Array,
        fill: str,
        opacity: float = 1.0,
        stroke: str = "none",
    ) -> None:
        """Fill between two curves over the same x."""
        there = self.points(x, high)
        back = self.points(x[::-1], low[::-1])
        self.drawing.area(np.concatenate((there, back)), fill, stroke, 0.6, opacity)


def axis_range(values: Sequence[float], share: float = 0.06) -> tuple[float, float]:
    """Range of an axis: that of the values, with a margin on either side."""
    low, high = min(values), max(values)
    room = share * (high - low) or 1.0
    return low - room, high + room
