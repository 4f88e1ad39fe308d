"""Forward and backward selection of effects and shapes, with refits of the strongest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from dataclasses import field as made

import numpy as np

from lostmotion import rules
from lostmotion.candidates import shapes as shape_room
from lostmotion.candidates.between_runs import between_runs
from lostmotion.candidates.candidate import LOAD_NEEDS, Candidate
from lostmotion.candidates.named import named_candidates
from lostmotion.discover.contest_round import Field, make_candidates, make_field
from lostmotion.discover.gates import (
    accepted,
    judge_all,
    large_enough,
    paid_by_kind,
    size_of,
    told_apart,
)
from lostmotion.discover.linearise import Settled, noise_rms, plain_of, plain_rms, settle
from lostmotion.discover.measurement_noise import estimate_noise
from lostmotion.discover.refits import (
    Contender,
    refit,
    refitted,
    sharpen,
    stands,
    term_stands,
    without_deviations,
)
from lostmotion.discover.terms import term_places, term_size
from lostmotion.effects.effect import Effect
from lostmotion.evidence.contest import Result
from lostmotion.evidence.noise import Noise
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.held_out import held_out_rms
from lostmotion.threads import in_parallel


@dataclass
class Lead:
    """A candidate that is worth a refit, and the linearisation that it starts from."""

    stage: Field
    result: Result
    size: float | None
    """Arc seconds; None where the tangent says nothing of it and only the refit tells."""
    taken_up: bool = False
    """Whether it may be larger than it looks (`rules.TAKEN_UP`)."""


@dataclass
class Step:
    """One round of the selection."""

    field: Field
    results: list[Result]
    chosen: Contender | None
    contenders: list[Contender]
    rivals: list[str] = made(default_factory=list)
    least_arcsec: float = 0.0
    """Least size of an effect that counted."""


@dataclass
class Selection:
    """What the selection came to."""

    steps: list[Step]
    settled: list[Settled]
    noise: Noise
    given_arcsec: float
    """Largest size of an effect that the base brought along."""


def choose(
    stage: Field,
    results: list[Result],
    least: float,
    least_shape: float | None = None,
    plain: tuple[Field, list[Result]] | None = None,
    kept: Mapping[str, tuple[Effect, float]] | None = None,
) -> Step:
    """Find the candidate that is missing most, or none.

    Parameters
    ----------
    least : float
        Least size that counts, arc seconds.
    least_shape : float, optional
        The same for shapes without a name.
    plain : tuple, optional
        Named candidates judged where all runs are alike.
    kept : mapping, optional
        Effects that are in the model, with their sizes.
    """
    paid = paid_by_kind(stage)
    passed = find_leads(stage, results, paid, least, least_shape)
    leads = strongest(passed)
    behind = without(passed, leads)
    if plain is not None:
        leads = add_leads(leads, *plain, paid["effect"])

    def counts(lead: Lead, size: float) -> bool:
        limit = max(least, least_beside(lead.stage, lead.result, kept or {}))
        return large_enough(lead.stage, lead.result, size, limit)

    def counting(leads: list[Lead]) -> list[Lead]:
        return [lead for lead in leads if lead.size is None or counts(lead, lead.size)]

    leads, behind = counting(leads), counting(behind)
    leads += far_leads(leads, stage, results)

    def follow(lead: Lead) -> Contender | None:
        contender = refit(lead.stage, lead.result, stage.settled)
        if contender is None:
            return None
        contender.size = fitted_size(stage, contender) if lead.size is None else lead.size
        contender.passes = contender.gain >= rules.GAIN_LEAST and (
            not contender.candidate.named or stands(contender, paid["effect"])
        )
        if contender.passes and lead.taken_up and not counts(lead, contender.size):
            assert contender.settled is not None
            taken = taken_from_all(stage.settled.base, contender.settled.base)
            contender.size = max(contender.size, taken)
        contender.passes = contender.passes and counts(lead, contender.size)
        return contender

    def followed(leads: list[Lead]) -> list[Contender]:
        return [contender for contender in in_parallel(follow, leads) if contender is not None]

    contenders = best_starts(followed(leads))
    fallen: set[str] = set()
    while behind and not any(c.passes for c in contenders):
        # Leads that do not stand after their refits must not hide the weaker ones behind them.
        fallen |= {lead.result.name for lead in leads}
        leads = strongest(behind)
        behind = without(behind, leads)
        contenders = best_starts(contenders + followed(leads))
    fit = [c for c in contenders if c.passes]
    if kept:
        fit, idle = of_use(stage, fit)
        fallen |= {c.result.name for c in idle}
    best_named = simplest([c for c in fit if c.candidate.named])
    best_shape = simplest([c for c in fit if not c.candidate.named])
    if best_shape is not None:
        sharper = sharpen(stage, best_shape)
        if sharper is not None:
            sharper.size = best_shape.size
            contenders.append(sharper)
            best_shape = max(best_shape, sharper, key=lambda c: c.gain)
        # What single runs have of their own can be spelled out by a shape that no other confirms.
        unsure = best_shape.result.p * paid[best_shape.candidate.kind] > rules.P_SURE
        if unsure and held_out_fall(stage, best_shape) < 0:
            best_shape = None
    chosen = best_named or best_shape
    if best_named is not None and best_shape is not None:
        nested = False
        if best_shape.gain > best_named.gain:
            angles = (
                stage.contest.angles(
                    best_named.result.name, best_shape.result.name, best_named.result.omega
                )
                if best_shape.result.name in stage.candidates
                else np.zeros(0)
            )
            nested = angles.size > 0 and float(angles[0]) < rules.NESTED_DEG
        if best_named.gain < rules.NAMED_SHARE * best_shape.gain and not nested:
            chosen = best_shape
    step = Step(stage, results, chosen, contenders, least_arcsec=least)
    if chosen is not None and chosen.candidate.named:
        stand = {c.result.name for c in fit}
        large = [
            result
            for result in results
            if result.name in stand
            or (
                result.name not in fallen
                and counts(Lead(stage, result, None), size_of(stage, result))
            )
        ]
        step.rivals = rivals(stage, large, contenders, chosen)
    return step


def of_use(stage: Field, fit: list[Contender]) -> tuple[list[Contender], list[Contender]]:
    """Take out effects that would be named beside those in the model, and are of no use there.

    What is left of an effect whose form is not exactly right can be spelled out by another one
    within the runs that it is fitted to. Runs that the fit has not seen tell: their error has to
    fall as by an effect of the least size. The one that would be chosen is asked, then the next
    one, until one is of use. Shapes say that something is left, not what: they are asked where an
    effect was of no use, for they may be the same remainder without its name.

    Returns
    -------
    fit, idle : list of Contender
    """
    least = rules.SIZE_LEAST * noise_rms(stage.settled.noise, stage.settled.base)
    left, idle = list(fit), list[Contender]()
    for named in (True, False):
        while best := simplest([c for c in left if c.candidate.named is named]):
            if (not named and not idle) or held_out_fall(stage, best) >= least**2:
                break
            left.remove(best)
            idle.append(best)
    return left, idle


def held_out_fall(stage: Field, contender: Contender) -> float:
    """Fall of the mean square, arc seconds squared, on runs that a fit of all has not seen."""
    assert contender.settled is not None
    before = without_deviations(stage.settled.base)
    after = without_deviations(contender.settled.base, before)
    return held_out_rms(before) ** 2 - held_out_rms(after) ** 2


def taken_from_all(base: BaselineModel, with_effect: BaselineModel) -> float:
    """Root mean square, arc seconds, by which an effect lowers the error of all runs together.

    Where runs differ by what has no exact form in the library, their own stiffness and gap take up
    most of it, and the effect beside them looks small.
    """
    before = without_deviations(base)
    after = without_deviations(with_effect, before)
    return float(np.sqrt(max(0.0, plain_rms(before) ** 2 - plain_rms(after) ** 2)))


def fitted_size(stage: Field, contender: Contender) -> float:
    """Root mean square, arc seconds, of what an effect does in the model fitted with it.

    By its tangent there, as long as that is no more than was to be explained: a load that is off by
    more than a kink is wide has a tangent that goes on beyond the kink, ten times as far as the
    effect. What it takes from the error of all runs together counts then.
    """
    assert contender.settled is not None
    base = contender.settled.base
    size = term_size(base, len(base.terms) - 1)
    if size <= plain_rms(stage.settled.base):
        return size
    return taken_from_all(stage.settled.base, base)


def simplest(contenders: list[Contender]) -> Contender | None:
    """Find the one that gains most, or one with fewer values that does next to as well."""
    best = max(contenders, key=lambda c: c.gain, default=None)
    if best is None:
        return None
    enough = min(best.gain - rules.GAIN_LEAST, rules.SIMPLER_SHARE * best.gain)
    near = [c for c in contenders if c.gain >= enough]
    return min(near, key=lambda c: (free_count(c), -c.gain))


def free_count(contender: Contender) -> int:
    """Number of values that the fit of a candidate may move."""
    effect = contender.candidate.effect
    return contender.candidate.columns.shape[1] if effect is None else len(effect.free())


def least_beside(stage: Field, result: Result, kept: Mapping[str, tuple[Effect, float]]) -> float:
    """Least size of an effect beside those that are in the model.

    What is left of an effect whose form is not exactly right looks like its twins.
    """
    effect = stage.candidates[result.name].effect
    if effect is None:
        return 0.0
    base, contest = stage.settled.base, stage.contest
    least = 0.0
    for place, term in enumerate(base.terms):
        other, size = kept.get(term.effect.name, (term.effect, 0.0))
        twins = other.name in effect.confused_with or effect.name in other.confused_with
        if twins and rules.TWIN_SHARE * size > least:
            own = contest.evidence.fixed[term_places(base, place)]
            if contest.taken_up(result.block, result.coefficients, own) >= rules.ALIKE_SHARE:
                least = rules.TWIN_SHARE * size
    return least


def find_leads(
    stage: Field,
    results: list[Result],
    paid: Mapping[str, int],
    least: float,
    least_shape: float | None,
) -> list[Lead]:
    """Find those that pass all gates where the base stands, strongest first."""
    passed = []
    for result in results:
        candidate = stage.candidates[result.name]
        if accepted(result, paid[candidate.kind]):
            size = size_of(stage, result)
            limit = least_shape if least_shape is not None and not candidate.named else least
            if large_enough(stage, result, size, limit):
                passed.append(Lead(stage, result, size))
            elif candidate.named and large_enough(stage, result, size, rules.TAKEN_UP * limit):
                passed.append(Lead(stage, result, None, taken_up=True))
    return passed


def strongest(passed: list[Lead]) -> list[Lead]:
    """Find the leads whose gain is near the greatest: they are refitted first."""
    if not passed:
        return []
    near = [
        lead for lead in passed if lead.result.gain >= rules.REFIT_SHARE * passed[0].result.gain
    ]
    effects = [x for x in near if x.stage.candidates[x.result.name].named][: rules.REFITS_NAMED]
    shapes = [x for x in near if not x.stage.candidates[x.result.name].named][: rules.REFITS_SHAPES]
    if effects and near[0] is effects[0] and shapes:
        shapes = [
            x for x in shapes[:1] if x.result.gain > rules.CLEAR_SHARE * effects[0].result.gain
        ]
    return [*effects, *shapes]


def without(leads: list[Lead], others: list[Lead]) -> list[Lead]:
    """Leads of other candidates than some."""
    names = {lead.result.name for lead in others}
    return [lead for lead in leads if lead.result.name not in names]


def far_leads(leads: list[Lead], stage: Field, results: list[Result]) -> list[Lead]:
    """Find the effects that move the load by the same everywhere: they are always fitted.

    They move every kink, and a base that was fitted without them is blurred there: the tangent on
    it says next to nothing of a load that is off by more than a kink is wide.
    """
    known = {lead.result.name for lead in leads}
    found = []
    for result in results:
        effect = stage.candidates[result.name].effect
        if effect is None or result.name in known or effect.kind != "torque":
            continue
        if effect.needs <= LOAD_NEEDS and not effect.memory:
            found.append(Lead(stage, result, None))
    return found


def add_leads(leads: list[Lead], plain: Field, results: list[Result], count: int) -> list[Lead]:
    """Add the strongest named ones of the base without deviations; they start from there.

    Whether they stand, and how large they are, is judged later, where the model with them is: this
    only finds them. One that was found already gets a second start.
    """
    strong = sorted(
        (r for r in results if r.p * count <= rules.P_LIMIT), key=lambda r: (-r.wald, r.name)
    )
    known = {lead.result.name for lead in leads}
    found = strong[: rules.REFITS_NAMED] + [
        r for r in strong[rules.REFITS_NAMED :] if r.name in known
    ]
    return leads + [Lead(plain, result, None) for result in found]


def best_starts(contenders: list[Contender]) -> list[Contender]:
    """Of several starts of a candidate the one that came to most, those that stand first."""
    best: dict[str, Contender] = {}
    for contender in contenders:
        name = contender.result.name
        rank = (contender.passes, contender.gain)
        if name not in best or rank > (best[name].passes, best[name].gain):
            best[name] = contender
    return list(best.values())


def rivals(
    stage: Field, results: list[Result], contenders: list[Contender], chosen: Contender
) -> list[str]:
    """Named effects that these data do not tell from the chosen one."""
    own = {c.result.name: c for c in contenders}
    out = []
    for result in results:
        name = result.name
        if name == chosen.result.name or not stage.candidates[name].named:
            continue
        if result.gain < rules.GAIN_LEAST:
            continue
        if name in own:
            gain, by_run = own[name].gain, own[name].gain_by_run
            ahead, ahead_by_run = chosen.gain, chosen.gain_by_run
        else:
            gain, by_run = result.gain, result.gain_by_run
            ahead, ahead_by_run = chosen.result.gain, chosen.result.gain_by_run
            if chosen.gain > rules.FAR * ahead:
                ahead, ahead_by_run = chosen.gain, chosen.gain_by_run
        close = gain >= rules.RIVAL_SHARE * ahead and not told_apart(ahead_by_run, by_run)
        if ahead - gain < rules.GAIN_LEAST or close:
            out.append(name)
    return out


def select(
    base: BaselineModel,
    effects: Mapping[str, Effect],
    ratio: float,
    *,
    progress: Callable[[str], None] | None = None,
) -> Selection:
    """Run the selection over a fitted base."""

    def say(what: str) -> None:
        if progress is not None:
            progress(what)

    runs = base.conditions.runs
    limit = max(1, min(rules.TERMS_MAX, runs // rules.RUNS_PER_TERM))
    waves = shape_room.waves(base)
    candidates, closed = make_candidates(base, effects, ratio, waves)
    noise = estimate_noise(base, [c.columns for c in candidates])
    settled = settle(base, noise)
    given = {
        term.effect.name: (term.effect, term_size(settled.base, place))
        for place, term in enumerate(settled.base.terms)
        if term.free
    }
    steps: list[Step] = []
    trail = [settled]
    say("noise")
    while True:
        candidates, closed = make_candidates(settled.base, effects, ratio, waves)
        if steps:
            noise = estimate_noise(settled.base, [c.columns for c in candidates])
        stage, results = contest_under(settled.base, noise, candidates, closed)
        if noise_rms(noise, base) > rules.WANDERING * float(np.mean(noise.sigma)):
            calmer = calmer_noise(stage, results, effects, ratio, waves)
            if calmer is not None:
                noise = calmer
                stage, results = contest_under(settled.base, noise, candidates, closed)
        settled = stage.settled
        trail[-1] = settled
        say("contest")
        taken = [s.chosen for s in steps if s.chosen is not None]
        kept = given | {
            one.result.name: (one.candidate.effect, one.size)
            for one in taken
            if one.candidate.effect is not None
        }
        sizes = [*(one.size for one in taken), *(size for _, size in given.values())]
        least = least_size(noise_rms(noise, base), max(sizes, default=0.0))
        shape = max(least, rules.SHAPE_AFTER_NAMED * noise_rms(noise, base)) if kept else least
        plain = contest_of_plain(settled, effects, ratio)
        step = choose(stage, results, least, shape, plain, kept)
        steps.append(step)
        if step.chosen is None or len(steps) > limit:
            break
        if not step.chosen.candidate.named and any(
            s.chosen is not None and not s.chosen.candidate.named for s in steps[:-1]
        ):
            break
        assert step.chosen.settled is not None
        settled = without_idle(step.chosen.settled, len(base.terms), paid_by_kind(stage)["effect"])
        trail.append(settled)
        say("refit")
    return Selection(steps, trail, noise, max((size for _, size in given.values()), default=0.0))


def least_size(within: float, largest: float) -> float:
    """Least size of what is called missing, beside effects of which the largest has this size."""
    return max(rules.SIZE_LEAST * within, rules.LEFTOVER_SHARE * largest)


def contest_of_plain(
    settled: Settled, effects: Mapping[str, Effect], ratio: float
) -> tuple[Field, list[Result]] | None:
    """Judge the named candidates where all runs are alike; None where they nearly are."""
    if float(np.max(np.abs(settled.base.deviations[:, :2]))) < rules.STRAYED:
        return None
    plain = plain_of(settled)
    candidates, closed = named_candidates(effects, plain, plain.at(), ratio)
    stage = make_field(Settled(plain, settled.contest, settled.noise), candidates, closed)
    return stage, judge_all(stage)


def without_idle(settled: Settled, given: int, count: int) -> Settled:
    """Drop the effects that no longer pass the gates beside the newest, all fitted together.

    Those that were `given` with the base stay.
    """
    for place in range(len(settled.base.terms) - 2, given - 1, -1):
        if not term_stands(settled, place, count):
            base = settled.base.copy()
            del base.terms[place]
            settled = refitted(base, settled.noise)
    return settled


def contest_under(
    base: BaselineModel, noise: Noise, candidates: list[Candidate], closed: dict[str, str]
) -> tuple[Field, list[Result]]:
    """Settle the base under a noise model and judge every candidate."""
    settled = settle(base, noise)
    # What is left of an effect is often another in quick runs, and is no second cause.
    own = [] if base.has_effects else between_runs(settled.base, settled.contest)
    stage = make_field(settled, [*candidates, *own], closed)
    return stage, judge_all(stage)


def calmer_noise(
    stage: Field,
    results: list[Result],
    effects: Mapping[str, Effect],
    ratio: float,
    waves: list[Candidate],
) -> Noise | None:
    """Noise of the largest model about the refit of a strong candidate, where that is calmer."""
    best: Noise | None = None
    least = rules.CALMER * noise_rms(stage.settled.noise, stage.settled.base)
    named = [r for r in results if stage.candidates[r.name].named and r.gain > 0]
    for result in named[: rules.REFITS_NAMED]:
        contender = refit(stage, result)
        if contender is None:
            continue
        assert contender.settled is not None
        base = contender.settled.base
        candidates, _ = make_candidates(base, effects, ratio, waves)
        noise = estimate_noise(base, [c.columns for c in candidates])
        spread = noise_rms(noise, base)
        if spread < least:
            best, least = noise, spread
    return best
