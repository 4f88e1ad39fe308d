"""The shortlist of a round: candidates that are tried in the model first."""

from __future__ import annotations

from lostmotion import rules
from lostmotion.discover.contest_round import ContestRound
from lostmotion.discover.gates import accepted, corrected_for, large_enough
from lostmotion.discover.growing_model import Lead
from lostmotion.evidence.contest import Result


def least_size(within: float, largest: float) -> float:
    """Least size that is reported as missing, arc seconds.

    Parameters
    ----------
    within : float
        Noise within runs.
    largest : float
        Size of the largest effect in the model.
    """
    return max(rules.SIZE_LEAST * within, rules.LEFTOVER_SHARE * largest)


def find_leads(contest_round: ContestRound, results: list[Result], least: float) -> list[Lead]:
    """Find the candidates that pass all tests with the present model, strongest first.

    Parameters
    ----------
    least : float
        Least size that counts, arc seconds.
    """
    passed = []
    for result in results:
        candidate = contest_round.candidates[result.name]
        if accepted(result, corrected_for(contest_round, candidate)):
            size = contest_round.size_of(result)
            if large_enough(contest_round, result, size, least):
                passed.append(Lead(contest_round, result, size))
    return passed


def strongest(leads: list[Lead]) -> list[Lead]:
    """Find the leads with nearly the largest gain among their kind, which are tried first.

    Effects compete with effects, and shapes with shapes: the tangent of an effect of inexact form
    may explain less than a shape that imitates it, and only the refits decide between the two.
    """
    effects = nearly_first([lead for lead in leads if lead.candidate.named])
    shapes = nearly_first([lead for lead in leads if not lead.candidate.named])
    if leads and leads[0].candidate.named:
        shapes = shapes[:1]
    return [*effects, *shapes]


def nearly_first(leads: list[Lead]) -> list[Lead]:
    """Of leads of one kind, strongest first, those that are refitted."""
    near = [lead for lead in leads if lead.result.gain >= rules.RIVAL_SHARE * leads[0].result.gain]
    return near[: rules.REFITS_MOST]


def without(leads: list[Lead], others: list[Lead]) -> list[Lead]:
    """Leads of other candidates than some."""
    names = {lead.name for lead in others}
    return [lead for lead in leads if lead.name not in names]
