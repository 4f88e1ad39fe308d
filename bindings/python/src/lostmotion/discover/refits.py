"""Refits: a candidate is added to a baseline model, and all parameters are fitted together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lostmotion.candidates import shapes as shape_room
from lostmotion.candidates.candidate import LOAD_NEEDS, Candidate
from lostmotion.candidates.forms import form_of
from lostmotion.discover.contest_round import ContestRound, RecordedRound, make_round
from lostmotion.discover.gates import judge, leading
from lostmotion.discover.growing_model import Contender, matched
from lostmotion.discover.linearise import (
    REFIT_STEPS,
    Settled,
    fit_alike,
    plain_rms,
    settle,
)
from lostmotion.effects.effect import Effect
from lostmotion.evidence.contest import Result
from lostmotion.evidence.noise import Noise
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.terms import Additive, Term


def tested_starts(current: ContestRound, result: Result) -> list[tuple[int, Result]]:
    """Starts of an effect, each with its own test.

    If none can be tested alone, the first, with its part of the joint result.
    """
    candidate = current.candidates[result.name]
    numbers = sorted(set(candidate.start_of))
    alone = [(n, judge(current, f"{result.name}#{n}")) for n in numbers]
    seen = [(n, own) for n, own in alone if own is not None]
    if seen:
        return seen
    first = numbers[0]
    mine = np.array(candidate.start_of) == first
    if result.block == result.name and mine.size == result.coefficients.size:
        result = replace(
            result, block=f"{result.name}#{first}", coefficients=result.coefficients[mine]
        )
    return [(first, result)]


def best_start(current: ContestRound, result: Result) -> tuple[int, Result]:
    """Find the single start of an effect that explains most."""
    effect = current.candidates[result.name].effect
    assert effect is not None
    starts = tested_starts(current, result)
    own = leading(current, effect, [own for _, own in starts])
    return next(start for start in starts if start[1] is own)


def term_of(current: ContestRound, result: Result) -> Term:
    """An effect with the values that the contest suggests."""
    return term_of_start(current, current.candidates[result.name], *best_start(current, result))


def term_of_start(current: ContestRound, candidate: Candidate, start: int, own: Result) -> Term:
    """An effect with the values that one of its starts suggests."""
    effect = candidate.effect
    assert effect is not None
    values = form_of(effect).values(effect, candidate, start, current.unscaled(own))
    low = np.array([v.low for v in effect.values])
    high = np.array([v.high for v in effect.values])
    values = np.clip(values, low, high)
    wrong = effect.against_its_name(values)
    if wrong is not None:
        values[wrong] = 0.0
    return Term(effect, values, effect.free())


def put_in(
    base: BaselineModel, current: RecordedRound, candidate: Candidate, start: int, own: Result
) -> None:
    """Add a candidate to a baseline model with the values that the contest suggests."""
    if candidate.effect is not None:
        base.terms.append(term_of_start(current, candidate, start, own))
        return
    base.additives.append(
        Additive(
            candidate.name,
            candidate.columns,
            current.unscaled(own),
            candidate.covariate,
            candidate.shape,
        )
    )


def make_idle(base: BaselineModel, candidate: Candidate) -> None:
    """Set the last candidate that was put into a model to a size of zero.

    Not an effect that is a product of its values: it has no derivative there.
    """
    effect = candidate.effect
    if effect is None:
        base.additives[-1].coefficients = np.zeros_like(base.additives[-1].coefficients)
    elif not any(value.scales for value in effect.values):
        base.terms[-1].values[effect.scaling()] = 0.0


def hold_to_name(term: Term) -> bool:
    """Fix at zero a value that makes an effect equal to another; return whether there was one."""
    wrong = term.effect.against_its_name(term.values)
    if wrong is None:
        return False
    term.values[wrong] = 0.0
    term.free = [place for place in term.free if place != wrong]
    return True


def refit(current: RecordedRound, result: Result) -> Contender | None:
    """Fit baseline and candidate together, from the present model.

    The candidate begins without a size: the fit cannot lose what the present model explains, and
    its first step is that of the contest. Least squares go further, but do not know the form error
    nor the noise: they come first only if the present model has no deviations of its runs, if the
    first fit keeps too little of the gain in the contest (`matched`), or if that gain
    says nothing (`shifts_load`).

    Returns
    -------
    Contender or None
        None if the fit with the candidate is not finite.
    """
    effect = current.candidates[result.name].effect
    first = None
    if np.any(current.settled.base.deviations):
        first = refit_by(settle, current, result)
        enough = first is not None and matched(first.gain, result.gain)
        if enough and (effect is None or not shifts_load(effect)):
            return first
    second = refit_by(refitted, current, result)
    return max(filter(None, (first, second)), key=lambda c: c.gain, default=None)


def refit_by(
    fit: Callable[[BaselineModel, Noise], Settled], current: RecordedRound, result: Result
) -> Contender | None:
    """Fit the present model with a candidate; None if the fit is not finite."""
    settled, candidate = current.settled, current.candidates[result.name]
    base = settled.base.copy()
    try:
        put_in(base, current, candidate, *start_of(current, result))
        make_idle(base, candidate)
        done = fit(base, settled.noise)
        if candidate.effect is not None and hold_to_name(done.base.terms[-1]):
            done = refitted(done.base, settled.noise)
    except np.linalg.LinAlgError:
        return None
    by_run = done.density - settled.density
    return Contender(result, candidate, done, float(by_run.sum()), by_run)


def shifts_load(effect: Effect) -> bool:
    """Whether an effect shifts the load by a constant."""
    return effect.kind == "torque" and effect.needs <= LOAD_NEEDS and not effect.memory


def start_of(current: RecordedRound, result: Result) -> tuple[int, Result]:
    """Start of a candidate that explains most; a shape has one start."""
    shape = current.candidates[result.name].effect is None
    return (0, result) if shape else best_start(current, result)


def without_deviations(
    base: BaselineModel,
    before: BaselineModel | None = None,
    plain: BaselineModel | None = None,
) -> BaselineModel:
    """Refit a baseline model to all runs together, as for a drive file.

    Parameters
    ----------
    before : BaselineModel, optional
        The same for the model that this one extends. If the deviations of the runs led the fit to a
        larger error, it starts there instead.
    plain : BaselineModel, optional
        `fit_alike` of this model, if known.
    """
    plain = plain or fit_alike(base)
    if before is None or plain_rms(plain) <= plain_rms(before) or not grown_from(base, before):
        return plain
    found = [plain]
    # The added terms from the values found, and from zero.
    extended = len(base.terms) > len(before.terms) or len(base.additives) > len(before.additives)
    for share in (1.0, 0.0) if extended else (1.0,):
        again = before.copy()
        added = base.copy()
        again.terms += added.terms[len(before.terms) :]
        again.additives += added.additives[len(before.additives) :]
        for term in again.terms[len(before.terms) :]:
            linear = [value.role == "linear" for value in term.effect.values]
            term.values[linear] *= share
        for shape in again.additives[len(before.additives) :]:
            shape.coefficients *= share
        again.fit(steps=REFIT_STEPS)
        found.append(again)
    return min(found, key=plain_rms)


def grown_from(base: BaselineModel, before: BaselineModel) -> bool:
    """Whether a model extends another one."""
    names = [term.effect.name for term in before.terms]
    shapes = [shape.name for shape in before.additives]
    return (
        names == [t.effect.name for t in base.terms][: len(names)]
        and shapes == [shape.name for shape in base.additives][: len(shapes)]
    )


def refitted(base: BaselineModel, noise: Noise) -> Settled:
    """Fit a baseline model with its present terms, and linearise it."""
    base.fit(noise=float(np.median(noise.sigma)), steps=REFIT_STEPS)
    return settle(base, noise)


def sharpen(current: RecordedRound, winner: Contender) -> Contender | None:
    """Refine the frequency of a selected wave, and refit it."""
    fine = shape_room.finer(current.settled.base, winner.candidate)
    if not fine:
        return None
    scan = make_round(current.settled, fine, {})
    found = [r for r in (scan.contest.test(c.name, refit_scatter=False) for c in fine) if r]
    if not found:
        return None
    best = max(found, key=lambda r: r.wald)
    wide = shape_room.with_neighbours(current.settled.base, scan.candidates[best.name])
    only = make_round(current.settled, [wide], {})
    result = only.contest.test(wide.name)
    return None if result is None else refit(only, result)
