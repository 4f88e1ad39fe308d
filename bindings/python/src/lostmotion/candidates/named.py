"""The effects in the contest, and the reasons why others are not tested."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lostmotion.candidates.candidate import Candidate
from lostmotion.candidates.forms import tangents_of
from lostmotion.candidates.tangents import resolved
from lostmotion.effects.columns import (
    NO_COLUMN,
    absorbed,
    constant_columns,
    missing_columns,
)
from lostmotion.effects.conditions import side_by_side
from lostmotion.effects.effect import Effect
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.point import Point
from lostmotion.threads import in_parallel


def tangent(effect: Effect, base: BaselineModel, point: Point, ratio: float) -> Candidate:
    """Make the candidate of an effect that is not yet in the model."""
    effect = resolved(effect, base, ratio)
    made = tangents_of(effect, base, point, ratio)
    rows = base.conditions.rows
    matrix = side_by_side(*made.columns) if made.columns else np.zeros((rows, 0))
    return Candidate(
        effect.name,
        True,
        matrix,
        effect=effect,
        starts=made.starts,
        start_of=made.start_of,
        odd=effect.turns_with_torque(base.conditions),
    )


GROWS_ALREADY = "not testable: absorbed by the baseline, whose friction grows with the load"


def named_candidates(
    effects: Mapping[str, Effect], base: BaselineModel, point: Point, ratio: float
) -> tuple[list[Candidate], dict[str, str]]:
    """All effects that these recordings can identify, and why others are not testable."""
    c = base.conditions
    present = {term.effect.name for term in base.terms}
    possible: dict[str, Effect] = {}
    closed: dict[str, str] = {}
    for name, effect in effects.items():
        if name in present:
            continue
        missing = missing_columns(effect, c)
        if missing:
            closed[name] = NO_COLUMN + ", ".join(missing)
            continue
        if absorbed(effect, c):
            closed[name] = "not testable: " + effect.absorbed
            continue
        if effect.is_hysteresis and base.hysteresis.widening is not None:
            closed[name] = GROWS_ALREADY
            continue
        possible[name] = effect
    out: list[Candidate] = []
    tangents = in_parallel(
        lambda effect: tangent(effect, base, point, ratio), list(possible.values())
    )
    for (name, effect), candidate in zip(possible.items(), tangents, strict=True):
        flat = constant_columns(effect, c)
        if candidate.columns.shape[1] == 0 or flat:
            why = f"constant {', '.join(flat)}" if flat else "it has no influence here"
            closed[name] = f"not identifiable with this plan: {why}"
            continue
        out.append(candidate)
    return out, closed
