"""A round of the contest: the evidence of all candidates at a linearised baseline model."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lostmotion import rules
from lostmotion.arrays import FloatArray
from lostmotion.candidates import shapes
from lostmotion.candidates.candidate import Candidate
from lostmotion.candidates.named import named_candidates
from lostmotion.candidates.ripples import ripples
from lostmotion.discover.linearise import (
    Settled,
    columns_of,
)
from lostmotion.effects.effect import Effect
from lostmotion.evidence.contest import Contest, Result
from lostmotion.evidence.gram import gather
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.form_error import FormBasis
from lostmotion.fit.point import Point
from lostmotion.rms import rms_of
from lostmotion.threads import both

PROJECTION_RIDGE = 1e-9
"""Relative ridge of the columns of a model when it is projected out of other columns. Its columns
may be multiples of each other; the ridge is far above the rounding of their products."""


class Projector:
    """Residual of columns after projection on those of a model, unwhitened arc seconds."""

    def __init__(self, fixed: FloatArray) -> None:
        fixed = fixed - fixed.mean(axis=0)
        norm = np.sqrt(np.einsum("ij,ij->j", fixed, fixed))
        norm[norm == 0] = 1.0
        self.fixed = fixed / norm
        self.normal = self.fixed.T @ self.fixed + PROJECTION_RIDGE * np.eye(norm.size)

    def size(self, column: FloatArray) -> float:
        """Root mean square of the residual of a column."""
        column = column - column.mean()
        taken = self.fixed @ np.linalg.solve(self.normal, self.fixed.T @ column)
        return rms_of(column - taken)

    def size_beyond(self, form: FormBasis, column: FloatArray) -> float:
        """The same with all columns of a form error, whose Gram matrix is computed once."""
        column = column - column.mean()
        varies = form.varies
        per_norm = varies / np.sqrt(np.where(varies, np.diag(form.gram), 1.0))
        cross = self.fixed.T @ form.columns * per_norm
        own = form.gram * np.outer(per_norm, per_norm) + PROJECTION_RIDGE * np.eye(per_norm.size)
        right = np.concatenate((self.fixed.T @ column, form.columns.T @ column * per_norm))
        step = np.linalg.solve(np.block([[self.normal, cross], [cross.T, own]]), right)
        model, rest = step[: -per_norm.size], step[-per_norm.size :] * per_norm
        return rms_of(column - self.fixed @ model - (form.columns @ rest - form.mean @ rest))


@dataclass
class ContestRound(ABC):
    """All candidates at a baseline model, with their evidence.

    Attributes
    ----------
    contest : Contest
    candidates : dict
    closed : dict
        Reasons of effects that are not testable, by name.
    form_arcsec : float
        Least form error of the baseline model (`rules.FORM_SHARE`).
    judged : dict
        Results of the blocks that were tested, by their places.
    """

    contest: Contest
    candidates: dict[str, Candidate]
    closed: dict[str, str]
    form_arcsec: float

    def __post_init__(self) -> None:
        """Each start of an effect is also a separate block."""
        self.judged: dict[bytes, Result | None] = {}
        blocks = self.contest.evidence.blocks
        for candidate in self.candidates.values():
            places = blocks[candidate.name]
            for start in sorted(set(candidate.start_of)):
                chosen = [i for i, s in enumerate(candidate.start_of) if s == start]
                blocks[f"{candidate.name}#{start}"] = places[chosen]

    def unscaled(self, result: Result) -> FloatArray:
        """Coefficients of the tested block, per unit of its columns."""
        evidence = self.contest.evidence
        return np.asarray(result.coefficients / evidence.scale[evidence.blocks[result.block]])

    @abstractmethod
    def size_of(self, result: Result) -> float:
        """Root mean square, arc seconds, of what a candidate explains in addition to the model."""

    @property
    @abstractmethod
    def has_effects(self) -> bool:
        """Whether effects are in the model."""


@dataclass
class RecordedRound(ContestRound):
    """A round over recordings, with access to the columns."""

    settled: Settled

    @cached_property
    def projector(self) -> Projector:
        """Projector on the complement of all columns of the model."""
        base = self.settled.base
        return Projector(base.fixed_columns(base.at()))

    def size_of(self, result: Result) -> float:
        """See `ContestRound`."""
        places = self.contest.evidence.blocks
        whole = list(places[result.name])
        judged = [whole.index(place) for place in places[result.block]]
        columns = self.candidates[result.name].columns[:, judged]
        return self.projector.size(columns @ self.unscaled(result))

    @property
    def has_effects(self) -> bool:
        """See `ContestRound`."""
        return self.settled.base.has_effects


def swing_by_run(base: BaselineModel, point: Point) -> FloatArray:
    """Root mean square of the baseline model in every run about its mean, arc seconds."""
    c = base.conditions
    return np.asarray(np.sqrt(c.run_mean(c.centred(point.angle) ** 2)))


def form_size(swing: FloatArray, rows: FloatArray) -> float:
    """Least form error of a baseline model, from its rms in runs of given lengths."""
    return rules.FORM_SHARE * float(np.sqrt(np.average(swing**2, weights=rows)))


def make_candidates(
    base: BaselineModel, effects: Mapping[str, Effect], ratio: float, waves: Sequence[Candidate]
) -> tuple[list[Candidate], dict[str, str]]:
    """Named effects and shapes at the fitted baseline model; the waves depend only on the plan."""
    point = base.at()
    (named, closed), smooth = both(
        lambda: named_candidates(effects, base, point, ratio),
        lambda: shapes.smooth_shapes(base, point),
    )
    return [*named, *smooth, *waves, *ripples(base)], closed


def make_round(
    settled: Settled, candidates: Sequence[Candidate], closed: dict[str, str]
) -> RecordedRound:
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
    form = form_size(swing_by_run(base, point), np.diff(base.conditions.starts))
    return RecordedRound(Contest(evidence), {c.name: c for c in candidates}, closed, form, settled)
