"""The model of a selection on saved evidence: candidates are confirmed by one linear step.

Columns of the Gram matrices are added to the model; nothing is linearised again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lostmotion.arrays import IntArray
from lostmotion.candidates.candidate import KINDS, Candidate
from lostmotion.candidates.forms import Linear, form_of
from lostmotion.discover.contest_round import PROJECTION_RIDGE, ContestRound, form_size
from lostmotion.discover.gates import accepted, corrected_for, judge, judge_all
from lostmotion.discover.growing_model import Contender, GrowingModel, Lead
from lostmotion.effects.effect import Effect
from lostmotion.errors import InputError
from lostmotion.evidence.contest import Contest, Result
from lostmotion.evidence.file import Body
from lostmotion.evidence.gram import Evidence
from lostmotion.evidence.left_out import errors


@dataclass
class EvidenceRound(ContestRound):
    """A round on saved evidence.

    Attributes
    ----------
    plain : Evidence
        The same columns, not whitened.
    taken : list of Contender
        Candidates in the model.
    rows : float
        Samples.
    given : bool
        Whether the drive file has effects.
    """

    plain: Evidence
    taken: list[Contender]
    rows: float
    given: bool

    def size_of(self, result: Result) -> float:
        """See `ContestRound`; the mean over all samples is subtracted, as for columns."""
        block = self.contest.evidence.blocks[result.block]
        own = self.unscaled(result) * self.plain.scale[block]
        gram, ones = self.plain.total, self.plain.scatter[-1]
        gram = gram - np.outer(gram[:, ones], gram[ones]) / gram[ones, ones]
        f = self.contest.evidence.fixed
        h = gram[np.ix_(f, f)]
        cross = gram[np.ix_(f, block)] @ own
        left = own @ gram[np.ix_(block, block)] @ own
        ridge = PROJECTION_RIDGE * np.diag(np.where(np.diag(h) > 0, np.diag(h), 1.0))
        left -= cross @ np.linalg.solve(h + ridge, cross)
        return float(np.sqrt(max(left, 0.0) / self.rows))

    @property
    def has_effects(self) -> bool:
        """See `ContestRound`."""
        return self.given or any(one.candidate.named for one in self.taken)


class EvidenceModel(GrowingModel):
    """A baseline model in Gram matrices, and the candidates added to it.

    Parameters
    ----------
    body : Body
        Evidence of one or several campaigns.
    effects : mapping
        Effects by name.

    Attributes
    ----------
    taken : list of Contender
        Candidates added to the model and kept, in order.
    trail : list of list of Contender
        The candidates in the model at the start and after each round.
    """

    def __init__(self, body: Body, effects: Mapping[str, Effect]) -> None:
        self.body = body
        self.runs = body.white.runs
        self.within = float(np.sqrt(np.average(body.spread**2, weights=body.rows)))
        self.rows = float(body.rows.sum())
        self.candidates = candidates_of(body, effects)
        self.given = dict(body.about["given_arcsec"])
        self.taken: list[Contender] = []
        self.trail: list[list[Contender]] = [[]]
        self.replaced = set()

    def round_with(self, taken: Sequence[Contender]) -> EvidenceRound:
        """A round at a model with some candidates in it."""
        names = {one.name for one in taken}
        left = [c for c in self.candidates if c.name not in names]
        white = with_columns(
            self.body.white,
            [places_of(self.body.white, one) for one in taken],
            [candidate.name for candidate in left],
        )
        form = form_size(np.array(self.body.about["swing_arcsec"]), self.body.rows)
        return EvidenceRound(
            Contest(white),
            {candidate.name: candidate for candidate in left},
            dict(self.body.about["closed"]),
            form,
            self.body.plain,
            list(taken),
            self.rows,
            bool(self.given),
        )

    def compete(self) -> tuple[EvidenceRound, list[Result]]:
        """See `GrowingModel`."""
        current = self.round_with(self.taken)
        return current, judge_all(current)

    def with_candidate(self, lead: Lead) -> Contender:
        """See `GrowingModel`: from the result of the contest."""
        result = lead.result
        return Contender(result, lead.candidate, None, result.gain, result.gain_by_run)

    def tested(self, contender: Contender) -> Result:
        """See `GrowingModel`."""
        return contender.result

    def size_within(self, contender: Contender) -> float:
        """See `GrowingModel`."""
        return self.round_with(self.taken).size_of(contender.result)

    def errors(self, taken: Sequence[Contender]) -> tuple[float, float]:
        """Fitted and leave-one-run-out rms with some candidates in the model, arc seconds."""
        more = [places_of(self.body.plain, one) for one in taken]
        columns = np.concatenate([np.zeros(0, dtype=np.intp), *more])
        return errors(self.body.plain, columns, self.rows)

    def fall_of_left_out(self, contender: Contender) -> float:
        """See `GrowingModel`."""
        before, after = (self.errors(all_)[1] for all_ in (self.taken, [*self.taken, contender]))
        return before**2 - after**2

    def take(self, contender: Contender, current: ContestRound) -> None:
        """See `GrowingModel`."""
        for one in reversed([c for c in self.taken if c.candidate.named]):
            others = [c for c in self.taken if c is not one]
            before, beside = (self.beside_all(one, all_) for all_ in (others, [*others, contender]))
            count = corrected_for(current, one.candidate)
            if self.to_drop(one.name, contender, count, before, beside):
                self.taken = others
        self.taken = [*self.taken, contender]
        self.trail.append(self.taken)

    def beside_all(self, one: Contender, others: Sequence[Contender]) -> Result | None:
        """Test a candidate with others in the model."""
        return judge(self.round_with(others), one.result.block)

    def substitutes(
        self, current: ContestRound, selected: Contender, rivals: Sequence[Result]
    ) -> list[str]:
        """See `GrowingModel`: those that make the selected candidate unnecessary.

        Without a refit to recordings, the gain of an effect far from its tangent is underestimated,
        and other effects seem close to it.
        """
        count = corrected_for(current, selected.candidate)
        names = []
        for rival in rivals:
            candidate = current.candidates[rival.name]
            other = Contender(rival, candidate, None, rival.gain, rival.gain_by_run)
            beside = self.beside(selected, other)
            needed = beside is not None and accepted(beside, count) and selected.matched_by(beside)
            if not needed:
                names.append(rival.name)
        return names

    def beside(self, contender: Contender, other: Contender) -> Result | None:
        """See `GrowingModel`."""
        return self.beside_all(contender, [*self.taken, other])


def candidates_of(body: Body, effects: Mapping[str, Effect]) -> list[Candidate]:
    """Effects and shapes of saved evidence; each column is one row with its root mean square."""
    for k in body.about["candidates"]:
        if k["name"] in effects and not fits(effects[k["name"]], k):
            found = "values that are not those of this effect"
            raise InputError(
                "evidence", k["name"], found, "the same effect (--effects), or new evidence"
            )
        if k["kind"] not in KINDS:
            raise InputError("evidence", k["name"], f"kind '{k['kind']}'", " or ".join(KINDS))
    plain = body.plain
    squares = np.einsum("rii->i", plain.gram) * plain.scale**2 / body.rows.sum()
    return [
        Candidate(
            k["name"],
            k["named"],
            np.sqrt(squares[plain.blocks[k["name"]]])[None, :],
            k["covariate"],
            k["shape"],
            effects.get(k["name"]),
            [np.array(s) for s in k["starts"]],
            list(k["start_of"]),
            kind=k["kind"],
            of_form=k["of_form"],
        )
        for k in body.about["candidates"]
    ]


def fits(effect: Effect, told: Mapping[str, Any]) -> bool:
    """Whether evidence of a candidate matches an effect: its values, and the columns of each."""
    counts = [told["start_of"].count(start) for start in range(len(told["starts"]))]
    linear = len(effect.indices("linear"))
    most = linear if isinstance(form_of(effect), Linear) else max(linear, len(effect.inner()))
    return all(len(start) == len(effect.values) for start in told["starts"]) and all(
        count <= most for count in counts
    )


def places_of(evidence: Evidence, one: Contender) -> IntArray:
    """Places of the columns that a candidate adds to the model: all, or those of a start."""
    name, _, start = one.result.block.partition("#")
    block = evidence.blocks[name]
    if not start:
        return block
    return block[[i for i, s in enumerate(one.candidate.start_of) if s == int(start)]]


def with_columns(white: Evidence, taken: Sequence[IntArray], names: Sequence[str]) -> Evidence:
    """Evidence with some columns moved to the baseline model, and the blocks of some names."""
    return replace(
        white,
        fixed=np.concatenate((white.fixed, *taken)).astype(np.intp),
        precision=np.concatenate((white.precision, *(np.zeros(block.size) for block in taken))),
        blocks={name: white.blocks[name] for name in names},
    )
