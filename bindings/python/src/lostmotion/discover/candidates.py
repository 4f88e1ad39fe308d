"""The effects that compete: those that recordings can show, and why the others cannot be tested."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from lostmotion.discover.base import Base, Point
from lostmotion.discover.conditions import Conditions, side_by_side
from lostmotion.discover.effects import Effect
from lostmotion.discover.tangents import resolved, tangents_of
from lostmotion.units import split_unit

FloatArray = npt.NDArray[np.float64]

LATENT: dict[str, str] = {
    "soft_windup": "the base finds its own characteristic",
    "stiffening": "the base finds its own characteristic",
    "free_play": "the base finds its own characteristic",
    "input_coupling_play": "the base finds its own characteristic",
    "torque_scale": "the base finds its own compliance",
    "input_lock_compliance": "the base finds its own compliance",
}
"""Effects that the base takes up by construction, and why: they are part of what it fits."""

SEEN_BY = {"input_coupling_play": "input_velocity_rad_s"}
"""Columns that tell an effect from the base where they vary: the drag of turning moves the load at
which a coupling falls over."""


LOAD_NEEDS = {"torque_Nm", "elapsed_s"}
LOAD_CHANNELS = {"torque", "torque_rate", "time"}
"""Conditions of effects, and quantities of shapes, that are the torque and its history."""


NO_COLUMN = "not testable with these columns: no "
"""How it begins why an effect is closed whose columns were not recorded."""

KINDS = ("effect", "shape", "ripple", "run")
"""Named effects, smooth shapes, ripples over a torque or an angle, what runs have of their own."""


@dataclass
class Candidate:
    """A block of columns that competes.

    Attributes
    ----------
    name : str
    named : bool
        An effect of the library (or the user's), against a shape without a name.
    columns : ndarray
        Arc seconds per unit.
    covariate, shape : str
        What a shape hangs on, in words.
    starts : list of ndarray
        Values to start a joint refit from.
    start_of : list of int
        The start that each column belongs to.
    trials : int
        How many columns were looked at to find these; their test pays for all of them.
    tests : int
        How many tests it is the answer of.
    also : list of tuple
        Other quantities that would give the same columns, and in what shape.
    kind : str
        Of `KINDS`: with which others it shares a part of the level.
    """

    name: str
    named: bool
    columns: FloatArray
    covariate: str = ""
    shape: str = ""
    effect: Effect | None = None
    starts: list[FloatArray] = field(default_factory=list)
    start_of: list[int] = field(default_factory=list)
    trials: int = 1
    tests: int = 1
    also: list[tuple[str, str]] = field(default_factory=list)
    kind: str = "shape"

    def __post_init__(self) -> None:
        """Effects are a kind of their own."""
        if self.named:
            self.kind = "effect"

    @property
    def hangs_on_load_alone(self) -> bool:
        """Whether it hangs on the torque and its history, as all that the base consists of."""
        if self.effect is not None:
            return self.effect.needs <= LOAD_NEEDS
        return self.covariate in LOAD_CHANNELS


RECORDED_AS = {
    "input_velocity_rad_s": "input_angle_rad",
    "output_acceleration_rad_s2": "output_angle_rad",
}
"""Columns from which conditions are derived that nobody records."""

BY_THE_CLOCK = {"input_velocity_rad_s", "output_acceleration_rad_s2", "elapsed_s"}
"""Conditions that rows without time stamps do not have."""

DERIVED = {
    "input_velocity_rad_s": "speed of the input",
    "output_acceleration_rad_s2": "acceleration of the output",
}
"""What conditions are called that have no column of their own."""


def missing_columns(effect: Effect, conditions: Conditions) -> list[str]:
    """Columns that the effect needs and the recordings lack, by the name they are recorded by."""
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
    """Conditions that the effect needs and that never change, as a reader calls them."""
    flat = []
    for need in sorted(effect.needs - {"elapsed_s"}):
        column = conditions.columns[need]
        if np.ptp(column) <= 1e-12 * max(1.0, float(np.max(np.abs(column)))):
            flat.append(DERIVED.get(need, need))
    return flat


def varies(conditions: Conditions, column: str | None) -> bool:
    """Whether a column was recorded, and moves."""
    return column in conditions.columns and float(np.ptp(conditions.columns[column])) > 0


def tangent(effect: Effect, base: Base, point: Point, ratio: float) -> Candidate:
    """Make the candidate of an effect that is not in the model yet."""
    effect = resolved(effect, base, ratio)
    made = tangents_of(effect, base, point, ratio)
    rows = base.conditions.rows
    matrix = side_by_side(*made.columns) if made.columns else np.zeros((rows, 0))
    return Candidate(
        effect.name, True, matrix, effect=effect, starts=made.starts, start_of=made.start_of
    )


def named_candidates(
    effects: Mapping[str, Effect], base: Base, point: Point, ratio: float
) -> tuple[list[Candidate], dict[str, str]]:
    """Every effect that these recordings can show, and why the others are not testable."""
    c = base.conditions
    present = {term.effect.name for term in base.terms}
    out: list[Candidate] = []
    closed: dict[str, str] = {}
    for name, effect in effects.items():
        if name in present:
            continue
        missing = missing_columns(effect, c)
        if missing:
            closed[name] = NO_COLUMN + ", ".join(missing)
            continue
        if name in LATENT and not varies(c, SEEN_BY.get(name)):
            closed[name] = "not testable: " + LATENT[name]
            continue
        candidate = tangent(effect, base, point, ratio)
        flat = constant_columns(effect, c)
        if candidate.columns.shape[1] == 0 or flat:
            why = f"constant {', '.join(flat)}" if flat else "it does nothing here"
            closed[name] = f"not visible with this plan: {why}"
            continue
        out.append(candidate)
    return out, closed
