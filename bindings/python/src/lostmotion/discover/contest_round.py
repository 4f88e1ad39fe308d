"""A round of the contest: the evidence of all candidates over a baseline model that is settled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from lostmotion import rules
from lostmotion.candidates import shapes
from lostmotion.candidates.candidate import Candidate
from lostmotion.candidates.named import named_candidates
from lostmotion.candidates.ripples import ripples
from lostmotion.discover.linearise import (
    Settled,
    columns_of,
)
from lostmotion.effects.effect import Effect
from lostmotion.evidence.contest import Contest
from lostmotion.evidence.gram import gather
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.point import Point

FloatArray = npt.NDArray[np.float64]


class Projector:
    """What a model's columns leave of other columns, in plain arc seconds."""

    def __init__(self, fixed: FloatArray) -> None:
        fixed = fixed - fixed.mean(axis=0)
        norm = np.sqrt(np.einsum("ij,ij->j", fixed, fixed))
        norm[norm == 0] = 1.0
        self.fixed = fixed / norm
        self.normal = self.fixed.T @ self.fixed + 1e-9 * np.eye(norm.size)

    def size(self, column: FloatArray) -> float:
        """Root mean square of what is left of a column."""
        column = column - column.mean()
        taken = self.fixed @ np.linalg.solve(self.normal, self.fixed.T @ column)
        return float(np.sqrt(np.mean((column - taken) ** 2)))


@dataclass
class Field:
    """All candidates over a settled base."""

    settled: Settled
    contest: Contest
    candidates: dict[str, Candidate]
    closed: dict[str, str]
    form_arcsec: float
    """What the form of the base is wrong by at best (`rules.FORM_SHARE`)."""

    @cached_property
    def projector(self) -> Projector:
        """What the base, with all that is in it, leaves of other columns."""
        base = self.settled.base
        return Projector(base.fixed_columns(base.at()))


def swing_by_run(base: BaselineModel, point: Point) -> FloatArray:
    """Root mean square in every run, arc seconds, of what the base does there about its mean."""
    c = base.conditions
    swing = point.angle - c.run_mean(point.angle)[c.run_of]
    return np.asarray(np.sqrt(c.run_mean(swing**2)))


def form_size(swing: FloatArray, rows: FloatArray) -> float:
    """What the form of a base is wrong by at best, from its swing in runs of so many samples."""
    return rules.FORM_SHARE * float(np.sqrt(np.average(swing**2, weights=rows)))


def make_candidates(
    base: BaselineModel, effects: Mapping[str, Effect], ratio: float, waves: Sequence[Candidate]
) -> tuple[list[Candidate], dict[str, str]]:
    """Named effects and shapes at the base as it stands; the waves hang on the plan alone."""
    point = base.at()
    named, closed = named_candidates(effects, base, point, ratio)
    return [*named, *shapes.smooth_shapes(base, point), *waves, *ripples(base)], closed


def make_field(settled: Settled, candidates: Sequence[Candidate], closed: dict[str, str]) -> Field:
    """Gather the evidence of all candidates."""
    base = settled.base
    point = base.at()
    fixed, precision, scatter, response = columns_of(base, point)
    evidence = gather(
        fixed,
        precision,
        scatter,
        [(candidate.name, candidate.columns) for candidate in candidates],
        response,
        settled.noise,
        base.conditions.starts,
    )
    for candidate in candidates:
        places = evidence.blocks[candidate.name]
        for start in sorted(set(candidate.start_of)):
            chosen = [i for i, s in enumerate(candidate.start_of) if s == start]
            evidence.blocks[f"{candidate.name}#{start}"] = places[chosen]
    form = form_size(swing_by_run(base, point), np.diff(base.conditions.starts))
    return Field(settled, Contest(evidence), {c.name: c for c in candidates}, closed, form)
