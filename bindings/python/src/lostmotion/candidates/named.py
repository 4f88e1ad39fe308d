"""The effects that compete: those that recordings can show, and why the others cannot be tested."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lostmotion.candidates.candidate import Candidate
from lostmotion.candidates.tangents import resolved, tangents_of
from lostmotion.effects.columns import (
    NO_COLUMN,
    constant_columns,
    missing_columns,
    varies,
)
from lostmotion.effects.conditions import side_by_side
from lostmotion.effects.effect import Effect
from lostmotion.fit.baseline import Base, Point

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
