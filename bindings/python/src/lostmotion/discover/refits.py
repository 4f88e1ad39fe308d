"""Refits: a candidate is added to a baseline model, and all parameters are fitted together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lostmotion import rules
from lostmotion.candidates import shapes as shape_room
from lostmotion.candidates.candidate import Candidate
from lostmotion.candidates.forms import form_of
from lostmotion.discover.contest_round import ContestRound, RecordedRound, make_round
from lostmotion.discover.gates import judge, leading
from lostmotion.discover.growing_model import Contender
from lostmotion.discover.linearise import (
    REFIT_STEPS,
    Settled,
    fit_alike,
    plain_rms,
    settle,
    take_step,
)
from lostmotion.evidence.contest import Result
from lostmotion.evidence.noise import Noise
from lostmotion.evidence.scatter import deviations
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.terms import Additive, Term

FIT_NATS = 0.1
"""Decrease of half the sum of squares, relative to the noise variance, below which a fit ends: a
twentieth of the least gain that counts (`rules.GAIN_LEAST`)."""

BASE_STEPS = 20
"""Evaluations of a joint refit that starts at the present model, which is further from the optimum
than the prediction of a hypothesis. Chosen by the time of a diagnosis, as `REFIT_STEPS`."""


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


def step_to(base: BaselineModel, current: RecordedRound, result: Result) -> None:
    """Move a baseline model and the deviations of its runs to the optimum of a hypothesis."""
    evidence = current.contest.evidence
    delta = np.concatenate((result.fixed_step, result.coefficients))
    own = deviations(evidence, evidence.index(result.block), result.omega, delta)
    moved = np.concatenate((evidence.fixed, evidence.scatter))
    take_step(base, evidence.scale[moved], result.fixed_step, own)


def hold_to_name(term: Term) -> bool:
    """Fix at zero a value that makes an effect equal to another; return whether there was one."""
    wrong = term.effect.against_its_name(term.values)
    if wrong is None:
        return False
    term.values[wrong] = 0.0
    term.free = [place for place in term.free if place != wrong]
    return True


def refit(current: RecordedRound, result: Result) -> Contender | None:
    """Fit baseline and candidate together, from the deviations that this hypothesis predicts.

    If the model so found keeps too little of the gain in the contest (`rules.RIVAL_SHARE`), that
    step was too long: the fit then starts from the present model. Least squares do not know the
    form error: beside one, the present model with the candidate is settled without them as well.
    The model that gains most counts.

    Returns
    -------
    Contender or None
        None if the fit with the candidate is not finite.
    """
    found = refit_from(current, result, step=True, fit=REFIT_STEPS)
    enough = found is not None and found.gain >= rules.RIVAL_SHARE * result.gain
    others: list[Contender | None] = []
    if not enough:
        others.append(refit_from(current, result, step=False, fit=BASE_STEPS))
    if current.settled.base.form_error is not None:
        others.append(refit_from(current, result, step=False, fit=0))
    return max(filter(None, (found, *others)), key=lambda c: c.gain, default=None)


def refit_from(current: RecordedRound, result: Result, *, step: bool, fit: int) -> Contender | None:
    """Optimise baseline and candidate together from one start; None if the model is not finite.

    Parameters
    ----------
    step : bool
        Whether it starts at the optimum that the hypothesis predicts, or at the present model.
    fit : int
        Evaluations by least squares before the model is settled; 0: none.
    """
    settled, candidate = current.settled, current.candidates[result.name]
    base = settled.base.copy()
    try:
        if step:
            step_to(base, current, result)
        put_in(base, current, candidate, *start_of(current, result))
        if fit:
            noise = float(np.median(settled.noise.sigma))
            base.fit(noise=noise, steps=fit, tolerance=close_enough(base))
        done = settle(base, settled.noise)
        if candidate.effect is not None and hold_to_name(done.base.terms[-1]):
            done = refitted(done.base, settled.noise)
    except np.linalg.LinAlgError:
        return None
    by_run = done.density - settled.density
    return Contender(result, candidate, done, float(by_run.sum()), by_run)


def start_of(current: RecordedRound, result: Result) -> tuple[int, Result]:
    """Start of a candidate that explains most; a shape has one start."""
    shape = current.candidates[result.name].effect is None
    return (0, result) if shape else best_start(current, result)


def close_enough(base: BaselineModel) -> float:
    """Relative decrease of the cost equivalent to `FIT_NATS`; later steps continue from there."""
    return 2.0 * FIT_NATS / base.conditions.rows


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
