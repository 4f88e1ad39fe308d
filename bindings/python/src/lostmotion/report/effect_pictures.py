"""Pictures of the effects: the contribution of each over its conditions, by its own function.

An effect of an angle, a speed or a condition alone is drawn over that condition; any other over the
torque of a loop, one curve for each end of its condition. The values are the typical ones of the
effect's card.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.condition_cards import CARDS, NEUTRAL
from lostmotion.core import NEEDS
from lostmotion.effects.effect import Effect
from lostmotion.report.maps import name_of
from lostmotion.report.svg import Drawing, signs
from lostmotion.report.wording import split_quantity, written
from lostmotion.results.colours import INK, SOFT
from lostmotion.units import ARCSEC, plain_number

WIDTH, HEIGHT = 148.0, 66.0
"""Size of a picture, px."""

MARGIN, LINE_PX, TEXT_PX = 3.0, 13.0, 10.0
"""Margin of the curves, height of a line of text, and size of its letters, px."""

SAMPLES = 241
"""Number of samples of a curve."""

STIFFNESS_NM_PER_RAD = 25_000.0
"""Stiffness of that drive in its middle range."""

BEYOND_LIMIT = 1.1
"""Largest torque over the largest limit of an effect, so that its other branch is seen."""

LOOP_S = 20.0
"""Duration of the loop, s."""

COLOURS = ("#0077bb", "#cc3311")
"""Of the curves at the lower and upper end; distinct for all types of colour vision."""


LOAD_NM = CARDS["torque_Nm"].usual[1]
"""Rated torque of the drive for which the typical values of the effects' cards are stated, N m."""


@dataclass(frozen=True)
class Contribution:
    """Contribution of an effect over one condition.

    Attributes
    ----------
    axis : str
        The condition.
    values : ndarray
        Of the condition.
    curves : list of ndarray
        Arc seconds, N m or a factor on the width.
    between : str
        The condition whose two ends the curves are for, if there are two.
    """

    axis: str
    values: FloatArray
    curves: list[FloatArray]
    between: str = ""


def contribution_of(effect: Effect) -> Contribution:
    """Evaluate an effect with its typical values."""
    needed = [name for name in NEEDS if CARDS[name].drawn and name in effect.needs]
    others = [name for name in needed if name != "torque_Nm"]
    load = max(
        [LOAD_NM]
        + [BEYOND_LIMIT * v.typical for v in effect.values if v.role == "fixed" and "_Nm" in v.name]
    )
    axis = next((name for name in others if CARDS[name].turns), "")
    axis = axis or (others[0] if others and "torque_Nm" not in needed else "torque_Nm")
    between = next((name for name in needed if name != axis), "")
    loop = axis == "torque_Nm"
    along = loop_of(load) if loop else np.linspace(*CARDS[axis].usual, SAMPLES)
    curves = []
    for end in CARDS[between].compared if between else (0.0,):
        run = {name: np.full(along.size, NEUTRAL[name]) for name in NEEDS}
        run["elapsed_s"][:] = LOOP_S / along.size
        run["torque_Nm"] = np.full(along.size, 0.0)
        if between:
            run[between] = np.full(along.size, end)
        run[axis] = along
        run["elastic_rad"] = run["torque_Nm"] / STIFFNESS_NM_PER_RAD
        run["wound_Nm"] = run["torque_Nm"]
        run["time_s"] = np.arange(along.size) * LOOP_S / along.size
        run["run_number"] = np.ones(along.size)
        memory = np.zeros(max(effect.memory, 1))
        result = np.array(effect.function(effect.typical, run, memory), dtype=np.float64)
        if effect.kind == "compliance":
            result *= run["elastic_rad"]
        curves.append(result / ARCSEC if effect.kind in ("angle", "compliance") else result)
    return Contribution(axis, along, curves, between)


def loop_of(load_Nm: float) -> FloatArray:
    """Torques of a loop from rest: up, down, and up again."""
    phase = np.linspace(0.0, 1.5, SAMPLES)
    return np.asarray(load_Nm * np.interp(phase, [0.0, 0.25, 0.75, 1.25, 1.5], [0, 1, -1, 1, 0]))


def between_ends(condition: str, ends: tuple[float, float], between: str) -> str:
    """Write two values of a condition with their unit."""
    _, factor, unit = split_quantity(condition, ends[1])
    low, high = (written(factor * end) for end in ends)
    return f"±{high} {unit}" if ends[0] == -ends[1] else f"{low}{between}{high} {unit}".rstrip()


def ends_of(condition: str) -> str:
    """Write the two values of a condition at which an effect is drawn."""
    return between_ends(condition, CARDS[condition].compared, " and ")


def describe_picture(effect: Effect) -> str:
    """Describe the picture of an effect in words."""
    data = contribution_of(effect)
    text = f"contribution over {name_of(data.axis)[0]}"
    if data.between:
        text += f", at {name_of(data.between)[0]} {ends_of(data.between)}"
    return text


def draw_effect(effect: Effect) -> str:
    """Draw the contribution of an effect as SVG."""
    data = contribution_of(effect)
    drawing = Drawing(WIDTH, HEIGHT, describe_picture(effect))
    low = min(0.0, *(float(curve.min()) for curve in data.curves))
    high = max(0.0, *(float(curve.max()) for curve in data.curves))
    room = HEIGHT - 2 * LINE_PX
    left, right = float(data.values.min()), float(data.values.max())

    def across(values: FloatArray) -> FloatArray:
        return np.asarray(MARGIN + (values - left) / (right - left) * (WIDTH - 2 * MARGIN))

    def down(values: FloatArray) -> FloatArray:
        return np.asarray(LINE_PX + (high - values) / ((high - low) or 1.0) * room)

    drawing.rectangle(0, 0, WIDTH, HEIGHT, "#fff")
    zero = float(down(np.zeros(1))[0])
    drawing.line((MARGIN, zero, WIDTH - MARGIN, zero), SOFT, 0.7)
    if left < 0.0 < right:
        middle = float(across(np.zeros(1))[0])
        drawing.line((middle, LINE_PX, middle, HEIGHT - LINE_PX), SOFT, 0.7)
    for curve, colour in zip(data.curves, COLOURS, strict=False):
        drawing.curve(np.column_stack((across(data.values), down(curve))), colour, 1.6)
    unit = {"torque": " N·m", "width": " × width"}.get(effect.kind, "″")
    largest = plain_number(max((abs(low), low), (abs(high), high))[1], 2)
    drawing.text(MARGIN, LINE_PX - 3, signs(largest + unit), size=TEXT_PX, fill=INK)
    reach = between_ends(data.axis, (left, right), " to ")
    drawing.text(MARGIN, HEIGHT - 3, f"{name_of(data.axis)[0]}, {reach}", size=TEXT_PX, fill=INK)
    if data.between:
        at = f"at {ends_of(data.between)}"
        drawing.text(WIDTH - MARGIN, LINE_PX - 3, at, size=TEXT_PX, fill=INK, anchor="end")
    return drawing.render()
