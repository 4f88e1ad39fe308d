"""The contest of a diagnosis on evidence alone: effects are refitted by one step, in Gram matrices.

The gates and sizes are those of `diagnose`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion import rules
from lostmotion.candidates.candidate import KINDS, Candidate
from lostmotion.discover.contest_round import Field, form_size
from lostmotion.discover.gates import accepted, judge_all, large_enough, paid_by_kind
from lostmotion.discover.refits import Contender, term_of
from lostmotion.discover.selection import Step, least_size, rivals
from lostmotion.effects.effect import Effect
from lostmotion.errors import InputError
from lostmotion.evidence.contest import Contest, Result
from lostmotion.evidence.file import Body
from lostmotion.evidence.gram import Evidence

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]


def centred(plain: Evidence) -> FloatArray:
    """Plain Gram matrices with the mean of each run taken off; the last scatter column is ones."""
    ones = plain.scatter[-1]
    gram = plain.gram
    count = np.maximum(gram[:, ones, ones], 1e-300)
    return np.asarray(gram - gram[:, :, ones, None] * gram[:, None, ones, :] / count[:, None, None])


def errors(body: Body, more: IntArray) -> tuple[float, float]:
    """Fitted and held-out rms of the base with more columns, arc seconds."""
    plain = body.plain
    index = np.concatenate((plain.fixed, more)).astype(np.intp)
    gram = centred(plain)
    h, g = gram[:, index[:, None], index], gram[:, index, plain.response]
    own = gram[:, plain.response, plain.response]
    ridge = np.zeros(index.size)
    ridge[: plain.precision.size] = plain.precision
    total = h.sum(axis=0)
    ridge = np.diag(ridge + 1e-9 * np.maximum(np.diag(total), 1.0))
    delta = np.linalg.solve(total + ridge, g.sum(axis=0))
    fitted = own.sum() - 2 * delta @ g.sum(axis=0) + delta @ total @ delta
    apart = np.linalg.solve(total - h + ridge, (g.sum(axis=0) - g)[:, :, None])[:, :, 0]
    held = own - 2 * np.einsum("ri,ri->r", apart, g)
    held = held + np.einsum("ri,rij,rj->r", apart, h, apart, optimize=True)
    rows = float(body.rows.sum())
    return float(np.sqrt(max(fitted, 0.0) / rows)), float(np.sqrt(max(held.sum(), 0.0) / rows))


def size_beside_base(body: Body, block: IntArray, result: Result) -> float:
    """Root mean square of what a candidate explains beside the base, arc seconds."""
    plain = body.plain
    own = result.coefficients / body.white.scale[block] * plain.scale[block]
    gram = centred(plain).sum(axis=0)
    f = plain.fixed
    cross = gram[np.ix_(f, block)] @ own
    h = gram[np.ix_(f, f)]
    left = own @ gram[np.ix_(block, block)] @ own
    left -= cross @ np.linalg.solve(h + 1e-9 * np.diag(np.maximum(np.diag(h), 1.0)), cross)
    return float(np.sqrt(max(left, 0.0) / body.rows.sum()))


def stage_of(body: Body, white: Evidence, left: Sequence[Candidate]) -> Field:
    """Make a round of the contest from evidence alone."""
    for candidate in left:
        block = white.blocks[candidate.name]
        for start in sorted(set(candidate.start_of)):
            chosen = [i for i, s in enumerate(candidate.start_of) if s == start]
            white.blocks[f"{candidate.name}#{start}"] = block[chosen]
    nothing: Any = None
    form = form_size(np.array(body.about["swing_arcsec"]), body.rows)
    closed = dict(body.about["closed"])
    return Field(nothing, Contest(white), {c.name: c for c in left}, closed, form)


@dataclass
class Rounds:
    """What the contest came to.

    Attributes
    ----------
    steps : list of Step
        One a round; the last may have found nothing, or hit the limit.
    chosen : list of Contender
        What was taken into the model, in order.
    ladder : list of dict
    within : float
        Noise within runs, arc seconds.
    """

    steps: list[Step]
    chosen: list[Contender]
    ladder: list[dict[str, Any]]
    within: float


def candidates_of(body: Body, effects: Mapping[str, Effect]) -> list[Candidate]:
    """Effects and shapes of evidence; each column is one row, its root mean square."""
    for k in body.about["candidates"]:
        if k["name"] in effects and not fits(effects[k["name"]], k):
            found = "values that are not those of this effect"
            raise InputError("evidence", k["name"], found, "the same effect: --effects, or anew")
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
        )
        for k in body.about["candidates"]
    ]


def fits(effect: Effect, told: Mapping[str, Any]) -> bool:
    """Whether evidence of a candidate can be of an effect: its values, and the columns of each."""
    counts = [told["start_of"].count(start) for start in range(len(told["starts"]))]
    most = max(len(effect.indices("linear")), len(effect.inner()))
    return all(len(start) == len(effect.values) for start in told["starts"]) and all(
        count <= most for count in counts
    )


def contest_of(body: Body, candidates: Sequence[Candidate]) -> Rounds:
    """Take in what is missing most, round by round."""
    left = list(candidates)
    within = float(np.sqrt(np.average(body.spread**2, weights=body.rows)))
    white = copy_of(body.white)
    taken: list[IntArray] = []
    chosen: list[Contender] = []
    steps: list[Step] = []
    ladder = [rung([], errors(body, np.zeros(0, dtype=np.intp)))]
    limit = max(1, min(rules.TERMS_MAX, body.white.runs // rules.RUNS_PER_TERM))
    while True:
        stage = stage_of(body, white, left)
        step = choose(body, stage, judge_all(stage), within, steps)
        steps.append(step)
        if step.chosen is None or len(taken) >= limit:
            return Rounds(steps, chosen, ladder, within)
        best = step.chosen
        block = white.blocks[best.result.block]
        chosen.append(best)
        taken.append(block)
        left = [candidate for candidate in left if candidate.name != best.candidate.name]
        white = promoted(white, block, [candidate.name for candidate in left])
        names = [*ladder[-1]["effects"], best.candidate.name]
        ladder.append(rung(names, errors(body, np.concatenate(taken))))


def estimate(stage: Field, result: Result) -> tuple[dict[str, float], dict[str, float]]:
    """Values of an effect by the one step, and the standard errors of those that it estimates."""
    candidate = stage.candidates[result.name]
    effect = candidate.effect
    assert effect is not None
    values = term_of(stage, result).values
    evidence = stage.contest.evidence
    tests = [stage.contest.test(f"{result.name}#{n}") for n in sorted(set(candidate.start_of))]
    best = max((t for t in tests if t is not None), key=lambda t: t.wald, default=None)
    sizes: dict[str, float] = {}
    if best is not None:
        found = best.coefficients / evidence.scale[evidence.blocks[best.name]]
        error = np.sqrt(np.diag(best.covariance)) / evidence.scale[evidence.blocks[best.name]]
        for value, x in zip(effect.values, values, strict=True):
            place = np.flatnonzero(np.isclose(found, x, rtol=1e-9, atol=0.0))
            if x != 0 and place.size == 1 and value.role != "given":
                sizes[value.name] = float(error[place[0]])
    return {v.name: float(x) for v, x in zip(effect.values, values, strict=True)}, sizes


def estimate_beside(
    body: Body, one: Contender, others: Sequence[Contender]
) -> tuple[dict[str, float], dict[str, float]]:
    """The same of a chosen effect, with all others that were chosen in the model."""
    white = copy_of(body.white)
    for other in others:
        block = one_start(body.white, other)
        white = promoted(white, block, list(white.blocks))
    stage = stage_of(body, white, [one.candidate])
    result = stage.contest.test(one.candidate.name)
    return estimate(stage, one.result if result is None else result)


def one_start(white: Evidence, chosen: Contender) -> IntArray:
    """Places of the columns that a chosen candidate brought into the model."""
    name, _, start = chosen.result.block.partition("#")
    block = white.blocks[name]
    if not start:
        return block
    return block[[i for i, s in enumerate(chosen.candidate.start_of) if s == int(start)]]


def copy_of(evidence: Evidence) -> Evidence:
    """Copy evidence whose blocks are going to change."""
    return Evidence(
        evidence.gram,
        evidence.scale,
        evidence.fixed,
        evidence.scatter,
        dict(evidence.blocks),
        evidence.response,
        evidence.precision,
    )


def promoted(white: Evidence, block: IntArray, names: Sequence[str]) -> Evidence:
    """Take a block into the base."""
    other = copy_of(white)
    other.fixed = np.concatenate((white.fixed, block)).astype(np.intp)
    other.precision = np.concatenate((white.precision, np.zeros(block.size)))
    other.blocks = {name: white.blocks[name] for name in names}
    return other


def rung(effects: list[str], found: tuple[float, float]) -> dict[str, Any]:
    """Make a rung of the ladder."""
    return {"effects": effects, "rms_arcsec": found[0], "rms_heldout_arcsec": found[1]}


def choose(
    body: Body, stage: Field, results: list[Result], within: float, before: Sequence[Step]
) -> Step:
    """Find what is missing most, by the gates and sizes of a diagnosis."""
    paid = paid_by_kind(stage)
    earlier = [s.chosen for s in before if s.chosen is not None]
    given = body.about["given_arcsec"].values()
    least = least_size(within, max([*given, *(c.size for c in earlier)], default=0.0))
    named_before = bool(given) or any(c.candidate.named for c in earlier)
    contenders = []
    for result in results:
        candidate = stage.candidates[result.name]
        if not accepted(result, paid[candidate.kind]):
            continue
        size = size_beside_base(body, stage.contest.evidence.blocks[result.block], result)
        limit = max(least, rules.SHAPE_AFTER_NAMED * within) if named_before else least
        if large_enough(stage, result, size, least if candidate.named else limit):
            contenders.append(
                Contender(result, candidate, None, result.gain, result.gain_by_run, size)
            )
    named = next((c for c in contenders if c.candidate.named), None)
    shape = next((c for c in contenders if not c.candidate.named), None)
    chosen = named or shape
    if named is not None and shape is not None and named.gain < rules.NAMED_SHARE * shape.gain:
        angles = stage.contest.angles(named.result.name, shape.result.name, named.result.omega)
        if not (angles.size and float(angles[0]) < rules.NESTED_DEG):
            chosen = shape
    step = Step(stage, results, chosen, contenders)
    if chosen is not None and chosen.candidate.named:
        alike = rivals(stage, results, contenders, chosen)
        step.rivals = [name for name in alike if not needed_beside(stage, chosen, name, results)]
    return step


def needed_beside(stage: Field, chosen: Contender, rival: str, results: Sequence[Result]) -> bool:
    """Whether the chosen effect is needed with a rival in the model: then that is no substitute.

    Without a refit in the recordings the gain of an effect that is far from its tangent falls
    behind, and others come close to it that explain something else.
    """
    white = stage.contest.evidence
    other = next(result for result in results if result.name == rival)
    left = promoted(white, white.blocks[other.block], list(white.blocks))
    beside = Contest(left).test(chosen.result.block)
    return (
        beside is not None
        and accepted(beside, paid_by_kind(stage)["effect"])
        and beside.gain >= rules.RIVAL_SHARE * chosen.gain
    )
