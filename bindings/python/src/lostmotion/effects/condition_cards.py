"""What is stated about each condition for people: meaning, cause of effects, and usual range.

The interface of an FMU, the pictures of effects and the groups of the workbench follow from these
rows; `tests/python/test_cards.py` tests that every condition has one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LOAD_NM = 40.0
"""Largest torque, N m: the rated torque of the drive of size 20 for which the typical values of the
effects' cards are stated."""

PI = float(np.pi)


@dataclass(frozen=True)
class Span:
    """Usual range of a condition in a joint of size 20, and two values at which effects differ.

    Attributes
    ----------
    low, high : float
        In the unit of the condition.
    reach : str
        The range in words.
    ends : tuple of float
    at : str
        The two values in words.
    """

    low: float
    high: float
    reach: str
    ends: tuple[float, float]
    at: str


@dataclass(frozen=True)
class ConditionCard:
    """Description of a condition.

    Attributes
    ----------
    meaning : str
    cause : str
        Group of the effects that depend on it.
    span : Span or None
        None if it is no axis of a picture.
    turning : bool
        Whether effects are drawn over it even if they need the torque too.
    """

    meaning: str
    cause: str
    span: Span | None
    turning: bool = False


ANGLES, MOTION = "Angles of wave generator and output", "Speed and acceleration"
FORCES, LOAD_ALONE = "Moments and forces on the output", "Load"

CARDS = {
    "temperature_C": ConditionCard(
        "of the drive", "Temperature", Span(0.0, 60.0, "0 to 60 °C", (0.0, 60.0), "0 and 60 °C")
    ),
    "cycles": ConditionCard(
        "load cycles so far", "Wear", Span(0.0, 1e6, "0 to 10⁶", (0.0, 1e6), "0 and 10⁶")
    ),
    "tilt_moment_Nm": ConditionCard(
        "on the output bearing", FORCES, Span(-50.0, 50.0, "±50 N·m", (0.0, 50.0), "0 and 50 N·m")
    ),
    "axial_force_N": ConditionCard(
        "on the output bearing", FORCES, Span(-500.0, 500.0, "±500 N", (-500.0, 500.0), "±500 N")
    ),
    "elapsed_s": ConditionCard("since the previous sample", "Time", None),
    "input_velocity_rad_s": ConditionCard(
        "velocity of the wave generator",
        MOTION,
        Span(-30.0, 30.0, "±30 rad/s", (0.0, 30.0), "0 and 30"),
        turning=True,
    ),
    "output_acceleration_rad_s2": ConditionCard(
        "of the output shaft",
        MOTION,
        Span(-20.0, 20.0, "±20 rad/s²", (0.0, 20.0), "0 and 20"),
        turning=True,
    ),
    "input_angle_rad": ConditionCard(
        "angle of the wave generator",
        ANGLES,
        Span(-PI, PI, "one turn", (0.0, PI / 2), "0 and 90°"),
        turning=True,
    ),
    "output_angle_rad": ConditionCard(
        "angle of the output shaft; whole turns do not matter",
        ANGLES,
        Span(-PI, PI, "one turn", (0.0, PI / 2), "0 and 90°"),
        turning=True,
    ),
    "torque_Nm": ConditionCard(
        "external torque on the output shaft, positive in the direction of a positive output angle",
        LOAD_ALONE,
        Span(-LOAD_NM, LOAD_NM, "", (-LOAD_NM, LOAD_NM), f"±{LOAD_NM:g} N·m"),
    ),
}
"""One row per condition of `lostmotion.core.NEEDS`. The cause of an effect is that of the first row
that it needs."""


def cause_of(needs: frozenset[str]) -> str:
    """Name the group of an effect by the conditions that it needs; `LOAD_ALONE` without any."""
    return next((card.cause for name, card in CARDS.items() if name in needs), LOAD_ALONE)
