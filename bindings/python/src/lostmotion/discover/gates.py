"""Judging: the gates that a candidate must pass, its size, and whether two are told apart."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from lostmotion import rules
from lostmotion.candidates.candidate import KINDS, Candidate
from lostmotion.candidates.forms import form_of
from lostmotion.discover.contest_round import Field
from lostmotion.effects.effect import Effect
from lostmotion.evidence.contest import Result

FloatArray = npt.NDArray[np.float64]


def judge_all(stage: Field) -> list[Result]:
    """Judge every candidate; a failed one never stops the others."""
    results = []
    for name, candidate in stage.candidates.items():
        result = judge(stage, name)
        numbers = sorted(set(candidate.start_of))
        alone = [] if result is None else [result]
        if len(numbers) > 1 and result is not None:
            # All starts together have more directions than few runs can carry.
            alone = [one for n in numbers if (one := judge(stage, f"{name}#{n}")) is not None]
            strongest = max([result, *alone], key=lambda one: one.gain)
            result = replace(strongest, name=name)
        if result is not None and candidate.trials > 1:
            result = replace(result, p=min(1.0, result.p * candidate.trials))
        if candidate.effect is not None and not (
            alone and possible(stage, candidate.effect, alone)
        ):
            result = None  # at work it has one start
        if result is None:
            if stage.candidates[name].named:
                stage.closed[name] = "not visible with this plan: the base takes it up"
            continue
        results.append(result)
    results.sort(key=lambda r: (-r.gain, r.name))
    return results


def possible(stage: Field, effect: Effect, alone: Sequence[Result]) -> bool:
    """Whether an effect can have the values that explain most, by its starts judged alone."""
    own = leading(effect, alone)
    evidence = stage.contest.evidence
    coefficients = own.coefficients / evidence.scale[evidence.blocks[own.block]]
    return form_of(effect).possible(effect, coefficients)


def leading(effect: Effect, alone: Sequence[Result]) -> Result:
    """Of the starts of an effect, judged alone, the one that explains most the right way round."""
    form = form_of(effect)
    return max(alone, key=lambda own: (form.right_way(effect, own.coefficients), own.wald))


def judge(stage: Field, block: str) -> Result | None:
    """Judge one block; None where it cannot be seen."""
    try:
        return stage.contest.test(block)
    except np.linalg.LinAlgError:
        return None


def accepted(result: Result, count: int) -> bool:
    """All three gates; where the plan lets few runs show it, the F test makes up for the flips.

    `count` is how many tests the candidate pays for (`paid_by_kind`).
    """
    share = rules.FLIP_LEVEL / result.flip_limit
    spread = result.flip_p <= rules.FLIP_LEVEL and result.p * count <= rules.P_LIMIT
    few = result.flip_p <= result.flip_limit and result.p * count <= rules.P_LIMIT * share
    return (spread or few) and result.gain >= rules.GAIN_LEAST


def count_tests(stage: Field) -> Counter[str]:
    """Number of tests of each kind of candidate."""
    made: Counter[str] = Counter()
    for candidate in stage.candidates.values():
        starts = len(set(candidate.start_of))
        made[candidate.kind] += candidate.tests + (starts if starts > 1 else 0)
    return made


def paid_by_kind(stage: Field) -> dict[str, int]:
    """For each kind of candidate how many tests one of them pays for."""
    made = count_tests(stage)
    return {kind: len(made) * max(made[kind], 1) for kind in KINDS}


def family_p(stage: Field, candidate: Candidate, result: Result) -> float:
    """Chance that any candidate does as well where there is nothing."""
    return min(1.0, result.p * paid_by_kind(stage)[candidate.kind])


def size_of(stage: Field, result: Result) -> float:
    """Root mean square, arc seconds, of what a candidate explains beside the model as it stands."""
    evidence = stage.contest.evidence
    coefficients = result.coefficients / evidence.scale[evidence.blocks[result.block]]
    return stage.projector.size(columns_judged(stage, result) @ coefficients)


def large_enough(stage: Field, result: Result, size: float, least: float) -> bool:
    """Whether a size counts: what hangs on the load alone must stand out from the base's form."""
    if stage.candidates[result.name].hangs_on_load_alone:
        least = max(least, stage.form_arcsec)
    return size >= least


def columns_judged(stage: Field, result: Result) -> FloatArray:
    """Columns of the block that was judged."""
    columns = stage.candidates[result.name].columns
    evidence = stage.contest.evidence
    whole = list(evidence.blocks[result.name])
    return columns[:, [whole.index(place) for place in evidence.blocks[result.block]]]


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


def told_apart(a: FloatArray, b: FloatArray) -> bool:
    """Whether the runs tell the first of two candidates from the second."""
    return paired_t(a, b) >= rules.PAIRED_T or signed_rank(a, b) >= rules.SIGNED_RANK
