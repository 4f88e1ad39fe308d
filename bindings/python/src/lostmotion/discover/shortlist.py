"""The shortlist of a round: candidates that are tried in the model first."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lostmotion import rules
from lostmotion.discover.contest_round import ContestRound
from lostmotion.discover.gates import accepted, corrected_for, large_enough
from lostmotion.discover.growing_model import Lead
from lostmotion.evidence.contest import Result
from lostmotion.evidence.overlap import absorbed_share


@dataclass
class LeastSizes:
    """Least sizes that count in a round.

    Attributes
    ----------
    effect, shape : float
        Least sizes of an effect and of an unnamed shape, arc seconds.
    kept : mapping
        Effects that are in the model, with their sizes.
    """

    effect: float
    shape: float
    kept: Mapping[str, float]

    def meets(self, contest_round: ContestRound, result: Result, size: float) -> bool:
        """Whether a size counts in addition to the effects in the model."""
        least = max(self.effect, least_beside(contest_round, result, self.kept))
        return large_enough(contest_round, result, size, least)


def least_sizes(within: float, kept: Mapping[str, float], largest: float) -> LeastSizes:
    """Least sizes for a noise within runs and the size of the largest effect."""
    effect = least_size(within, largest)
    shape = max(effect, rules.SHAPE_AFTER_NAMED * within) if kept else effect
    return LeastSizes(effect, shape, kept)


def least_size(within: float, largest: float) -> float:
    """Least size that is reported as missing, for the size of the largest effect."""
    return max(rules.SIZE_LEAST * within, rules.LEFTOVER_SHARE * largest)


def least_beside(contest_round: ContestRound, result: Result, kept: Mapping[str, float]) -> float:
    """Least size of an effect in addition to those in the model.

    The residual of an effect of inexact form resembles the effects confounded with it.
    """
    effect = contest_round.candidates[result.name].effect
    if effect is None:
        return 0.0
    contest = contest_round.contest
    least = 0.0
    for other, own in contest_round.effects_within():
        size = kept.get(other.name, 0.0)
        confounded = other.name in effect.confused_with or effect.name in other.confused_with
        if confounded and rules.TWIN_SHARE * size > least:
            share = absorbed_share(
                contest.evidence, contest.null_omega, result.block, result.coefficients, own
            )
            if share >= rules.ALIKE_SHARE:
                least = rules.TWIN_SHARE * size
    return least


def find_leads(
    contest_round: ContestRound, results: list[Result], limits: LeastSizes
) -> list[Lead]:
    """Find the candidates that pass all tests with the present model, strongest first."""
    passed = []
    for result in results:
        candidate = contest_round.candidates[result.name]
        if accepted(result, corrected_for(contest_round, candidate)):
            size = contest_round.size_of(result)
            limit = limits.effect if candidate.named else limits.shape
            if large_enough(contest_round, result, size, limit):
                passed.append(Lead(contest_round, result, size))
            elif candidate.named and large_enough(
                contest_round, result, size, rules.TAKEN_UP * limit
            ):
                passed.append(Lead(contest_round, result, None, absorbed=True))
    return passed


def strongest(leads: list[Lead]) -> list[Lead]:
    """Find the leads with nearly the largest gain, which are tried first."""
    if not leads:
        return []
    near = [lead for lead in leads if lead.result.gain >= rules.REFIT_SHARE * leads[0].result.gain]
    effects = [lead for lead in near if lead.candidate.named][: rules.REFITS_NAMED]
    shapes = [lead for lead in near if not lead.candidate.named][: rules.REFITS_SHAPES]
    if effects and near[0] is effects[0] and shapes:
        shapes = [
            lead
            for lead in shapes[:1]
            if lead.result.gain > rules.CLEAR_SHARE * effects[0].result.gain
        ]
    return [*effects, *shapes]


def without(leads: list[Lead], others: list[Lead]) -> list[Lead]:
    """Leads of other candidates than some."""
    names = {lead.name for lead in others}
    return [lead for lead in leads if lead.name not in names]
