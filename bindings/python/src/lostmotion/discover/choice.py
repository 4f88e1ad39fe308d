"""The choice of a round: the strongest missing candidate, or none, and its rivals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lostmotion import rules
from lostmotion.discover.contest_round import ContestRound
from lostmotion.discover.gates import (
    accepted,
    corrected_for,
    large_enough,
    runs_separate,
    share_at,
)
from lostmotion.discover.growing_model import Contender, GrowingModel, Lead
from lostmotion.discover.shortlist import find_leads, strongest, without
from lostmotion.evidence.contest import Result
from lostmotion.evidence.overlap import principal_angles
from lostmotion.threads import in_parallel


@dataclass
class Step:
    """One round of the selection.

    Attributes
    ----------
    round : ContestRound
    results : list of Result
        Of every candidate, strongest first.
    selected : Contender or None
    contenders : list of Contender
        Candidates that were tried in the model.
    rivals : list of str
        Effects that these data do not separate from the selected one.
    least_arcsec : float
        Least size at which an effect counts.
    """

    round: ContestRound
    results: list[Result]
    selected: Contender | None
    contenders: list[Contender]
    rivals: list[str] = field(default_factory=list)
    least_arcsec: float = 0.0


def choose(model: GrowingModel, current: ContestRound, results: list[Result], least: float) -> Step:
    """Find the strongest missing candidate, or none.

    A candidate that is confounded with the form error counts as one, unless a model without form
    error finds it (`GrowingModel.more_starts`): then it is selected first, as a form would be,
    and only such candidates are its rivals. Every alternative to the selected effect is tried in
    place of it: by tangents alone, effects may seem to be confounded that their models separate. If
    one of these is selected in turn, so are its alternatives. One that was tried must pass as the
    selected one does.
    """
    apart = [result for result in results if not current.candidates[result.name].of_form]
    contenders, rejected = try_shortlist(model, current, apart, least)
    tried: set[str] = set()
    while True:
        step = choose_among(model, current, results, least, contenders, rejected)
        selected = step.selected
        if selected is None or not selected.candidate.named:
            return step
        tried.add(selected.name)
        names = alternatives(current, apart, step, selected) - tried
        if not names:
            return step
        tried |= names
        untried = [result for result in apart if result.name in names]
        leads = [
            lead
            for lead in model.in_place_of(selected, current, untried)
            if selected.matched_by(lead.result) or imitates_law(current, lead.name)
        ]
        contenders = best_starts(model, contenders + try_leads(model, leads, least, current))
        rejected = rejected | names - {c.name for c in contenders}


def alternatives(
    current: ContestRound, apart: list[Result], step: Step, selected: Contender
) -> set[str]:
    """Effects that may explain what the selected one does.

    Its rivals, what its card names, and all that explain enough, whatever their size: one that is
    too small to count may be the best explanation.
    """
    named = {*step.rivals, *confused_with(selected)}
    return {
        result.name
        for result in apart
        if current.candidates[result.name].named
        and (result.name in named or selected.matched_by(result))
    }


def choose_among(
    model: GrowingModel,
    current: ContestRound,
    results: list[Result],
    least: float,
    tried: list[Contender],
    rejected: set[str],
) -> Step:
    """Choose among the candidates that were tried in the model, and find the rivals."""
    apart = [result for result in results if not current.candidates[result.name].of_form]
    contenders = as_kept(tried)
    confirmed = [c for c in contenders if c.passes]
    confirmed, idle = of_use(model, current, confirmed)
    rejected = rejected | {c.name for c in idle}
    effects = [c for c in confirmed if c.candidate.named]
    shape = simplest([c for c in confirmed if not c.candidate.named])
    if shape is not None:
        sharper = model.sharpened(current, shape)
        if sharper is not None:
            sharper.size = shape.size
            contenders.append(sharper)
            shape = max(shape, sharper, key=lambda c: c.gain)
    forms = replace_form(current, effects)
    selected = best_of(current, effects, shape, forms)
    while selected is not None and explained_by_less(model, selected, contenders):
        rejected = rejected | {selected.name}
        confirmed.remove(selected)
        effects.remove(selected)
        selected = best_of(current, effects, shape, forms)
    step = Step(current, results, selected, contenders, least_arcsec=least)
    if selected is not None and selected.candidate.named:
        names = {c.name for c in confirmed}
        first = selected.name in forms
        known = {c.name for c in contenders}
        large = [
            result
            for result in results
            if may_be_rival(current, result, selected)
            and (
                (result.name in names and (result.name in forms) is first)
                or (
                    result in apart
                    and not first
                    and result.name not in rejected | known
                    and (
                        result.name in confused_with(selected)
                        or large_enough(current, result, current.size_of(result), least)
                    )
                )
            )
        ]
        # One that was found in another model is compared with these by its result in this one.
        here = next((one for one in results if one.name == selected.name), selected.result)
        alike = rivals(current, large, contenders, selected, here)
        step.rivals = model.substitutes(current, selected, alike)
    return step


def explained_by_less(model: GrowingModel, selected: Contender, others: list[Contender]) -> bool:
    """Whether an effect that is too small to count explains better what the selected one does.

    What is missing has the size of its best explanation.
    """
    return selected.candidate.named and any(
        one.candidate.named
        and one.explains
        and not one.passes
        and one.gain > selected.gain
        and not model.keeps_beside(selected, one)
        for one in others
    )


def replace_form(current: ContestRound, effects: Sequence[Contender]) -> set[str]:
    """Names of the effects that explain what the form error does, if any is confounded with it.

    Those that were found without form error are compared with it, whatever their tangents, and so
    are other laws of friction.
    """
    if not any(of_form(current, c.name) for c in effects):
        return set()
    return {
        c.name
        for c in effects
        if of_form(current, c.name) or c.formless is not None or imitates_law(current, c.name)
    }


def of_form(current: ContestRound, name: str) -> bool:
    """Whether a candidate is confounded with the form error."""
    candidate = current.candidates.get(name)
    return candidate is not None and candidate.of_form


def confused_with(contender: Contender) -> tuple[str, ...]:
    """Effects that the card of a selected effect names as confounded with it."""
    effect = contender.candidate.effect
    return () if effect is None else effect.confused_with


def imitates_law(current: ContestRound, name: str) -> bool:
    """Whether an effect is another law of friction, or depends on the load alone as such a law."""
    candidate = current.candidates.get(name)
    return candidate is not None and candidate.named and candidate.may_be_form


def try_shortlist(
    model: GrowingModel,
    current: ContestRound,
    results: list[Result],
    least: float,
) -> tuple[list[Contender], set[str]]:
    """Try the shortlist in the model, then the reserve until one passes and is of use.

    The shortlist contains starts from other models: without form error, and with equal runs. An
    effect on it is tried from all its starts.

    Returns
    -------
    contenders : list of Contender
    rejected : set of str
        Candidates that did not pass, so that they do not hide weaker ones.
    """
    passed = find_leads(current, results, least)
    shortlist = model.with_unjudged(current, results, strongest(passed))
    reserve = without(passed, shortlist)
    shortlist = model.more_starts(current, shortlist)
    shortlist += model.with_equal_runs(current)
    listed = {lead.name for lead in shortlist}
    shortlist += [lead for lead in reserve if lead.name in listed]
    reserve = without(reserve, shortlist)

    def tried(leads: list[Lead]) -> list[Contender]:
        return try_leads(model, leads, least, current)

    def useful(contenders: list[Contender]) -> list[Contender]:
        return of_use(model, current, [c for c in as_kept(contenders) if c.passes])[0]

    contenders = best_starts(model, tried(shortlist))
    rejected: set[str] = set()
    while reserve and not useful(contenders):
        rejected |= {lead.name for lead in shortlist}
        shortlist = strongest(reserve)
        reserve = without(reserve, shortlist)
        contenders = best_starts(model, contenders + tried(shortlist))
    return contenders, rejected


def try_leads(
    model: GrowingModel, leads: list[Lead], least: float, current: ContestRound
) -> list[Contender]:
    """Put candidates into the model, each apart; those that have no finite fit are left out."""
    found = in_parallel(lambda lead: try_lead(model, lead, least, current), leads)
    return [contender for contender in found if contender is not None]


def try_lead(
    model: GrowingModel, lead: Lead, least: float, current: ContestRound
) -> Contender | None:
    """Put a candidate into the model, and return whether it passes, with the level of a round.

    None if it has no finite fit, or is not kept beside the form error.
    """
    contender = model.with_candidate(lead)
    if contender is None:
        return None

    count = corrected_for(current, lead.candidate)
    contender.size = model.size_within(contender) if lead.size is None else lead.size
    gain = contender.gain + model.not_kept(contender)
    enough = large_enough(lead.round, lead.result, contender.size, least)
    contender.explains = gain >= rules.GAIN_LEAST
    if contender.explains and contender.candidate.named:
        contender.in_model = model.tested(contender)
        contender.explains = contender.in_model is not None and accepted(contender.in_model, count)
    contender.passes = contender.explains and enough
    return contender


def best_starts(model: GrowingModel, contenders: list[Contender]) -> list[Contender]:
    """Of several starts of a candidate, the one that explains most; passing starts first.

    One that passes but does not beat the forms of the hysteresis is left out. These are fitted
    only where the answer depends on them.
    """
    starts: dict[str, list[Contender]] = {}
    for contender in contenders:
        starts.setdefault(contender.name, []).append(contender)

    def best(own: list[Contender]) -> Contender | None:
        ranked = sorted(own, key=lambda c: (c.passes, c.gain), reverse=True)
        kept = (c for c in ranked if not c.passes or model.beats_forms(c))
        return next(kept, None)

    found = in_parallel(best, list(starts.values()))
    return [contender for contender in found if contender is not None]


def as_kept(contenders: Sequence[Contender]) -> list[Contender]:
    """Contenders with the gains that their models keep, where several pass.

    Between kinks a linearisation may promise more than its model follows. Less than the contender
    that keeps most, because all start from the same fit and stop equally far from their optimum.
    """
    beyond = {
        contender.name: contender.settled.beyond_linear
        for contender in contenders
        if contender.passes and contender.settled is not None
    }
    least = min(beyond.values(), key=np.sum, default=0.0)
    kept = []
    for contender in contenders:
        by_run = contender.gain_by_run - (beyond.get(contender.name, least) - least)
        kept.append(replace(contender, gain=float(np.sum(by_run)), gain_by_run=by_run))
    return kept


def of_use(
    model: GrowingModel, current: ContestRound, confirmed: list[Contender]
) -> tuple[list[Contender], list[Contender]]:
    """Remove candidates that do not improve the prediction of the present model.

    What is missing must be confirmed by the models of the answer (`GrowingModel.confirms`). The
    strongest effect is tested first, then the next one, until one improves the prediction. A shape
    can displace an effect, one that passes or one of the model, only if it improves the prediction
    as well; where there is none, a shape says that something remains, and is not tested.

    Returns
    -------
    confirmed, idle : list of Contender
    """
    left, idle = list(confirmed), list[Contender]()
    beside_effect = current.has_effects or any(c.candidate.named for c in confirmed)
    for named in (True, False):
        while best := simplest([c for c in left if c.candidate.named is named]):
            if not beside_effect or model.confirms(best):
                break
            left.remove(best)
            idle.append(best)
    return left, idle


def simplest(contenders: list[Contender]) -> Contender | None:
    """Find the candidate with the largest gain, or one with fewer values that is nearly as good."""
    best = max(contenders, key=lambda c: c.gain, default=None)
    if best is None:
        return None
    enough = min(best.gain - rules.GAIN_LEAST, share_at(rules.TWIN_DEG) * best.gain)
    near = [c for c in contenders if c.gain >= enough]
    return min(near, key=lambda c: (free_count(c), -c.gain))


def free_count(contender: Contender) -> int:
    """Number of values that the fit of a candidate estimates."""
    effect = contender.candidate.effect
    return contender.candidate.columns.shape[1] if effect is None else len(effect.free())


def best_of(
    current: ContestRound, effects: list[Contender], shape: Contender | None, forms: set[str]
) -> Contender | None:
    """Choose between effects and a shape: effects that explain the form error first (`forms`).

    A shape that is clearly better than these competes with the other effects.
    """
    for first in (True, False):
        group = [c for c in effects if (c.name in forms) is first]
        selected = effect_or_shape(current, simplest(group), shape)
        if selected is not None and selected.candidate.named:
            return selected
    return shape


def effect_or_shape(
    current: ContestRound, effect: Contender | None, shape: Contender | None
) -> Contender | None:
    """Choose between effect and shape: a clearly better shape, unless it contains the effect."""
    if effect is None or shape is None or effect.gain >= share_at(rules.WARN_DEG) * shape.gain:
        return effect or shape
    if shape.name in current.candidates:
        omega = effect.result.omega
        angles = principal_angles(current.contest.evidence, omega, effect.name, shape.name)
        if angles.size and float(angles[0]) < rules.TWIN_DEG:
            return effect
    return shape


def may_be_rival(current: ContestRound, result: Result, selected: Contender) -> bool:
    """Whether a result is that of another named effect with a gain that counts."""
    named = current.candidates[result.name].named
    return named and result.name != selected.name and result.gain >= rules.GAIN_LEAST


def rivals(
    current: ContestRound,
    results: Sequence[Result],
    contenders: Sequence[Contender],
    selected: Contender,
    here: Result,
) -> list[Result]:
    """Named effects that these data do not separate from the selected one.

    Those that were tried are compared with it in the model, the others by their results in the
    round, in which that of the selected one is `here`.
    """
    own = {c.name: c for c in contenders}
    out = []
    for result in results:
        name = result.name
        if not may_be_rival(current, result, selected):
            continue
        if name in own:
            gain, by_run = own[name].gain, own[name].gain_by_run
            ahead, ahead_by_run = selected.gain, selected.gain_by_run
        else:
            gain, by_run = result.gain, result.gain_by_run
            ahead, ahead_by_run = here.gain, here.gain_by_run
        close = gain >= rules.RIVAL_SHARE * ahead and not runs_separate(ahead_by_run, by_run)
        if ahead - gain < rules.GAIN_LEAST or close:
            out.append(result)
    return out
