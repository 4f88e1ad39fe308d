"""Tests that a candidate must pass, its size, and whether two candidates are confounded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from statistics import NormalDist

import numpy as np

from lostmotion import rules
from lostmotion.arrays import FloatArray
from lostmotion.candidates.candidate import KINDS, Candidate
from lostmotion.candidates.forms import form_of
from lostmotion.discover.contest_round import ContestRound
from lostmotion.effects.effect import Effect
from lostmotion.evidence.contest import Result


def judge_all(contest_round: ContestRound) -> list[Result]:
    """Test every candidate; a failure does not stop the others."""
    results = []
    for name, candidate in contest_round.candidates.items():
        result = judge(contest_round, name)
        numbers = sorted(set(candidate.start_of))
        alone = [] if result is None else [result]
        if len(numbers) > 1 and result is not None:
            # All starts together have more directions than a few runs can determine.
            every = (judge(contest_round, f"{name}#{n}") for n in numbers)
            alone = [one for one in every if one is not None]
            strongest = max([result, *alone], key=lambda one: one.gain)
            result = replace(strongest, name=name)
        if result is not None and candidate.trials > 1:
            result = replace(result, p=min(1.0, result.p * candidate.trials))
        if candidate.effect is not None and not (
            alone and possible(contest_round, candidate.effect, alone)
        ):
            result = None  # in use it has one start
        if result is None:
            if candidate.named:
                contest_round.closed[name] = (
                    "not identifiable with this plan: absorbed by the baseline"
                )
            continue
        results.append(result)
    results.sort(key=lambda r: (-r.gain, r.name))
    return results


def possible(contest_round: ContestRound, effect: Effect, alone: Sequence[Result]) -> bool:
    """Whether the values that explain most are possible for an effect, from its single starts."""
    own = leading(contest_round, effect, alone)
    return form_of(effect).possible(effect, contest_round.unscaled(own))


def leading(contest_round: ContestRound, effect: Effect, alone: Sequence[Result]) -> Result:
    """Of the single starts of an effect, the one that explains most with the right sign."""
    form, unscaled = form_of(effect), contest_round.unscaled
    return max(alone, key=lambda own: (form.right_way(effect, unscaled(own)), own.wald))


def judge(contest_round: ContestRound, block: str) -> Result | None:
    """Test one block, once per round; None if it is not visible."""
    places = contest_round.contest.evidence.blocks[block].tobytes()
    if places not in contest_round.judged:
        try:
            contest_round.judged[places] = contest_round.contest.test(block)
        except np.linalg.LinAlgError:
            contest_round.judged[places] = None
    result = contest_round.judged[places]
    return None if result is None else replace(result, name=block, block=block)


def accepted(result: Result, count: int) -> bool:
    """Whether all three tests pass; the F test compensates a sign-flip test of few runs.

    The level is corrected for `count` tests (`corrected_for`).
    """
    share = rules.RUN_LEVEL / result.flip_limit
    spread = result.flip_p <= rules.RUN_LEVEL and result.p * count <= rules.P_LIMIT
    few = result.flip_p <= result.flip_limit and result.p * count <= rules.P_LIMIT * share
    return (spread or few) and result.gain >= rules.GAIN_LEAST


def count_tests(candidate: Candidate) -> int:
    """Number of tests of a candidate: its starts are tested one by one and together."""
    starts = len(set(candidate.start_of))
    return candidate.tests + (starts if starts > 1 else 0)


def count_answers(contest_round: ContestRound) -> int:
    """Number of answers that a round may give: the name of each effect, and each unnamed kind."""
    names = sum(candidate.named for candidate in contest_round.candidates.values())
    return names + len(KINDS) - 1


def level_of_answer(contest_round: ContestRound) -> float:
    """Probability with which each answer of a round may be given if nothing is missing."""
    return rules.P_LIMIT / count_answers(contest_round)


def corrected_for(contest_round: ContestRound, candidate: Candidate) -> int:
    """Number of tests for which a candidate is corrected.

    If nothing is missing, every answer is given with a probability of at most the level over the
    number of answers, because its own tests share that (Bonferroni). So any answer is given with a
    probability of at most the level, whatever the dependence of the tests.
    """
    answer = [candidate]
    if not candidate.named:
        kind = candidate.kind
        answer = [one for one in contest_round.candidates.values() if one.kind == kind]
    return count_answers(contest_round) * sum(map(count_tests, answer))


def family_p(contest_round: ContestRound, candidate: Candidate, result: Result) -> float:
    """Bound of the probability of any answer with such a p if nothing is missing."""
    return min(1.0, result.p * corrected_for(contest_round, candidate))


def large_enough(contest_round: ContestRound, result: Result, size: float, least: float) -> bool:
    """Whether a size counts.

    A candidate that depends only on the load must exceed the form error of the baseline model.
    """
    if contest_round.candidates[result.name].hangs_on_load_alone:
        least = max(least, contest_round.form_arcsec)
    return size >= least


def is_of_form(share_beyond: float, named: bool = True) -> bool:
    """Whether a contribution is confounded with another form of the hysteresis.

    Then it is a function of the torque and its history with this plan, as creep is if all runs have
    the same loading rate. For an unnamed shape it is sufficient to be hard to separate from it.
    """
    return bool(share_beyond <= 1.0 - share_at(rules.TWIN_DEG if named else rules.WARN_DEG))


def share_at(angle_deg: float) -> float:
    """Share of the sum of squares of a column that another column at an angle to it explains."""
    return float(np.cos(np.radians(angle_deg)) ** 2)


def paired_t(a: FloatArray, b: FloatArray) -> float:
    """Paired t of two candidates' gains over the runs."""
    difference = a - b
    spread = float(np.std(difference, ddof=1)) if difference.size > 1 else 0.0
    if spread == 0:
        return 0.0 if difference.sum() == 0 else float("inf")
    return float(difference.mean() / spread * np.sqrt(difference.size))


def signed_rank(a: FloatArray, b: FloatArray) -> float:
    """Wilcoxon's signed-rank statistic of two candidates' gains, in standard deviations."""
    difference = a - b
    difference = difference[difference != 0]
    n = difference.size
    if n == 0:
        return 0.0
    rank = np.empty(n)
    rank[np.argsort(np.abs(difference), kind="stable")] = np.arange(1, n + 1)
    total = float(rank[difference > 0].sum())
    return float((total - n * (n + 1) / 4) / np.sqrt(n * (n + 1) * (2 * n + 1) / 24))


def deviations_least() -> float:
    """Standard deviations by which a difference between two effects is significant, two-sided."""
    return NormalDist().inv_cdf(1.0 - float(rules.RUN_LEVEL) / 2.0)


def runs_separate(a: FloatArray, b: FloatArray) -> bool:
    """Whether the runs separate the first of two candidates from the second."""
    return max(paired_t(a, b), signed_rank(a, b)) >= deviations_least()
