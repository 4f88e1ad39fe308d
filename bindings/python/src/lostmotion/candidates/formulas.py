"""Unnamed shapes as formulas for ``fit --add``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

TURNS = {"input_angle": "input_turns", "output_angle": "output_turns"}
"""Words of a formula for angles in turns."""

OF_PART = {"lost motion": ("rad", ""), "stiffness": ("share", "elastic_rad * ")}
"""Unit of the values of a shape, and what they multiply; other parts are not written."""


def wave_over_angle(channel: str, orders: Sequence[float], part: str = "lost motion") -> str:
    """Waves of some orders over an angle."""
    return sum_of_waves(
        {f"{order:.6g}": f"2*pi*{order:.6g}*{TURNS[channel]}" for order in orders}, part
    )


def wave_over_torque(period_Nm: float) -> str:
    """A ripple over the torque."""
    return sum_of_waves({"": f"2*pi*torque_Nm/{period_Nm:.6g}"}, "lost motion")


def sum_of_waves(phases: Mapping[str, str], part: str) -> str:
    """A cosine and a sine of each phase; empty for parts that no formula can express."""
    if part not in OF_PART:
        return ""
    unit, factor = OF_PART[part]
    terms = []
    for order, phase in phases.items():
        number = f"_{order.replace('.', '_')}" if len(phases) > 1 else ""
        for word, function in (("cosine", "cos"), ("sine", "sin")):
            terms.append(f"{word}{number}_{unit} * {function}({phase})")
    whole = " + ".join(terms)
    return f"{factor}({whole})" if factor else whole


def step(event: Mapping[str, Any]) -> str:
    """A step from the time of an event to the end of its run."""
    number, time_s = event["run_number"], event["time_s"]
    return (
        f"step_rad * max(0, 1 - abs(run_number - {number})) "
        f"* min(1, max(0, 1 + sign(time_s - {time_s:.10g})))"
    )
