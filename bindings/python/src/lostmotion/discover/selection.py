"""Forward and backward selection of effects and shapes, with refits of the strongest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from dataclasses import field as made

import numpy as np
import numpy.typing as npt

from lostmotion.discover import shapes as shape_room
from lostmotion.discover.base import TOLERANCE, Additive, Base, Term
from lostmotion.discover.candidates import Candidate, named_candidates
from lostmotion.discover.contest import FLIP_LEVEL, Result
from lostmotion.discover.effects import Effect
from lostmotion.discover.noise import Noise
from lostmotion.discover.run_steps import run_steps
from lostmotion.discover.study import (
    WORSE,
    Field,
    Settled,
    contest_of_term,
    estimate_noise,
    make_candidates,
    make_field,
    plain_of,
    plain_rms,
    settle,
    take_step,
)
from lostmotion.discover.threads import in_parallel

FloatArray = npt.NDArray[np.float64]

P_LIMIT = 0.01
"""Of the F test after Bonferroni; the sign flips have their own level."""

GAIN_LEAST = 2.0
"""Least leave-one-run-out gain, nats."""

SIZE_LEAST = 0.1
"""Least size of what is called missing, rms over the noise: a model that is off by a tenth of the
noise is as good as recordings can tell in practice."""

REFITS_NAMED, REFITS_SHAPES = 3, 2
"""How many of the strongest are refitted."""

STRAYED = 0.1
"""A run whose friction deviates by more than this share may hide an effect in it: candidates are
then judged from the base without deviations as well."""

REFIT_SHARE = 0.25
"""Share of the best gain below which a candidate is not refitted."""

CLEAR_SHARE = 0.6
"""A shape with less than this share of the leading named effect's gain is not refitted."""

SHAPE_AFTER_NAMED = 0.25
"""Least size over the noise of a shape that is called missing beside a named effect: below it the
named effect explains the misfit, only not in every detail."""

LEFTOVER_SHARE = 0.12
"""What is left of a named effect because its form is not exactly right counts as missing from this
share of its size on."""

TWIN_SHARE = 0.3
"""The same share for an effect that is known to be confused with one in the model."""

SIMPLER_SHARE = 0.97
"""An effect with fewer values that reaches this share of the best one's gain is the answer."""

NAMED_SHARE = 0.75
"""A named effect that reaches this share of the best shape's gain is the answer: a real effect
never has exactly the form of the library."""

NESTED_DEG = 5.0
"""A shape within this angle of a named effect contains it."""

HALF_A_TOOTH = 0.5
"""Least multiple of a slipped tooth that is not taken for something else."""

TERMS_MAX = 4
RUNS_PER_TERM = 4

REFIT_STEPS = 12
"""Evaluations of a joint refit."""

APART_STEPS, APART_TOLERANCE = 20, 1e-7
"""A fit without deviations has to come to its end, or what it lacks is taken for deviations."""

PROMISE_KEPT = 0.5
"""Share of the gain in the contest below which a refit has gone astray."""

WANDERING = 2.0
"""Noise whose spread is this many times its innovations wanders so slowly that it may be a
missing effect: the strongest candidates are then refitted before the noise is believed."""

CALMER = 0.9
"""Share of the spread below which the noise after such a refit is the one that is believed."""

PAIRED_T = 2.0
"""Paired t over runs below which two effects are not told apart ..."""

SIGNED_RANK = 2.6
"""... nor by the signed ranks of the runs, in standard deviations: where one run says most, t is
about 1 whatever the others say ..."""

RIVAL_SHARE = 0.5
"""... provided that the weaker one gains this share of the stronger one."""


@dataclass
class Contender:
    """A candidate with its own refit."""

    result: Result
    candidate: Candidate
    settled: Settled | None
    gain: float
    gain_by_run: FloatArray
    size: float = 0.0
    passes: bool = True


@dataclass
class Lead:
    """A candidate that is worth a refit, and the linearisation that it starts from."""

    stage: Field
    result: Result
    size: float


@dataclass
class Step:
    """One round of the selection."""

    field: Field
    results: list[Result]
    chosen: Contender | None
    contenders: list[Contender]
    rivals: list[str] = made(default_factory=list)


@dataclass
class Selection:
    """What the selection came to."""

    steps: list[Step]
    settled: list[Settled]
    noise: Noise


def judge_all(stage: Field) -> list[Result]:
    """Judge every candidate; a failed one never stops the others."""
    results = []
    for name, candidate in stage.candidates.items():
        result = judge(stage, name)
        numbers = sorted(set(candidate.start_of))
        for number in numbers if len(numbers) > 1 and result is not None else []:
            # All starts together have more directions than few runs can carry.
            one = judge(stage, f"{name}#{number}")
            if one is not None and result is not None and one.gain > result.gain:
                result = replace(one, name=name)
        if result is not None and candidate.trials > 1:
            result = replace(result, p=min(1.0, result.p * candidate.trials))
        if name == "ratcheting" and result is not None and not whole_tooth(stage, result):
            result = None
        if result is None:
            if stage.candidates[name].named:
                stage.closed[name] = "not visible with this plan: the base takes it up"
            continue
        results.append(result)
    results.sort(key=lambda r: (-r.gain, r.name))
    return results


def whole_tooth(stage: Field, result: Result) -> bool:
    """Whether teeth slipped: the column is that of whole teeth, and there is no part of one."""
    evidence = stage.contest.evidence
    teeth = result.coefficients / evidence.scale[evidence.blocks[result.block]]
    return float(np.max(np.abs(teeth))) >= HALF_A_TOOTH


def judge(stage: Field, block: str) -> Result | None:
    """Judge one block; None where it cannot be seen."""
    try:
        return stage.contest.test(block)
    except np.linalg.LinAlgError:
        return None


def accepted(result: Result, count: int) -> bool:
    """All three gates; where the plan lets few runs show it, the F test makes up for the flips."""
    share = FLIP_LEVEL / result.flip_limit
    spread = result.flip_p <= FLIP_LEVEL and result.p * count <= P_LIMIT
    few = result.flip_p <= result.flip_limit and result.p * count <= P_LIMIT * share
    return (spread or few) and result.gain >= GAIN_LEAST


def size_of(stage: Field, result: Result) -> float:
    """Root mean square, arc seconds, of what a candidate explains beside the model as it stands."""
    evidence = stage.contest.evidence
    coefficients = result.coefficients / evidence.scale[evidence.blocks[result.block]]
    return stage.projector.size(columns_judged(stage, result) @ coefficients)


def columns_judged(stage: Field, result: Result) -> FloatArray:
    """Columns of the block that was judged."""
    columns = stage.candidates[result.name].columns
    evidence = stage.contest.evidence
    whole = list(evidence.blocks[result.name])
    return columns[:, [whole.index(place) for place in evidence.blocks[result.block]]]


def best_start(stage: Field, result: Result) -> tuple[int, Result]:
    """Find the start of an effect that explains most, judged alone."""
    candidate = stage.candidates[result.name]
    numbers = sorted(set(candidate.start_of))
    best: tuple[bool, float] = (False, -np.inf)
    start, chosen = numbers[0], result
    for number in numbers:
        own = stage.contest.test(f"{result.name}#{number}")
        if own is None:
            continue
        # One lobe leads and the other lags: a size below nothing is that of lobes a quarter turn
        # on, which have a start of their own.
        right_way = result.name != "lobe_eccentricity" or own.coefficients[-1] > 0
        if (right_way, own.wald) > best:
            best, start, chosen = (right_way, own.wald), number, own
    return start, chosen


def term_of(stage: Field, result: Result) -> Term:
    """An effect with the values that the contest suggests."""
    return term_of_start(stage, stage.candidates[result.name], *best_start(stage, result))


def term_of_start(stage: Field, candidate: Candidate, start: int, own: Result) -> Term:
    """An effect with the values that one of its starts suggests."""
    effect = candidate.effect
    assert effect is not None
    evidence = stage.contest.evidence
    coefficients = own.coefficients / evidence.scale[evidence.blocks[own.block]]
    places = [i for i, s in enumerate(candidate.start_of) if s == start]
    values = candidate.starts[start].copy()
    linear = effect.indices("linear")
    if effect.name == "lobe_eccentricity":
        # Run-out and compliance together: the effect keeps its shape over the torque.
        size = coefficients[0]
        if start == 0:
            values[:2] = coefficients[:2]
            size = coefficients[2] if coefficients.size > 2 else np.hypot(values[2], values[3])
        values[2:5] *= abs(size) / np.hypot(values[2], values[3])
    elif linear:
        # Columns of a start follow the linear values in order; multiples of earlier ones are gone.
        first = sum(1 for s in candidate.start_of if s == 0)
        if len(places) == len(linear):
            values[linear] = coefficients
        elif first == len(linear):
            values[linear[-coefficients.size :]] = coefficients
    elif effect.name != "ratcheting":
        shape = effect.indices("shape")
        values[shape] = 0.0
        values[shape[: coefficients.size]] = coefficients
    low = np.array([v.low for v in effect.values])
    high = np.array([v.high for v in effect.values])
    values = np.clip(values, low, high)
    wrong = effect.against_its_name(values)
    if wrong is not None:
        values[wrong] = 0.0
    return Term(effect, values, free_values(effect))


def free_values(effect: Effect) -> list[int]:
    """Values that a fit may move: not what is given, nor what only picks a branch."""
    held = {"gap_rad", "blend_rad_s", "threshold_Nm"}
    return [
        i
        for i, value in enumerate(effect.values)
        if value.role == "linear" or (value.role == "shape" and value.name not in held)
    ]


def refit(stage: Field, result: Result, reference: Settled | None = None) -> Contender:
    """Fit base and candidate together, from the deviations that this hypothesis predicts.

    A step that leads astray, or to much less than the contest has promised, is not taken: the fit
    then starts from where the base stands.

    Parameters
    ----------
    reference : Settled, optional
        Against which the gain counts, where the stage is that of a base without deviations: then
        they stay at nothing until the candidate has had its fit.
    """
    settled = stage.settled
    candidate = stage.candidates[result.name]
    start, own = (0, result) if candidate.effect is None else best_start(stage, result)
    sigma = float(np.median(settled.noise.sigma))

    def settled_from(base: Base) -> Contender:
        done = settle(base, settled.noise)
        if candidate.effect is not None and hold_to_name(done.base.terms[-1]):
            done.base.fit(noise=sigma, steps=REFIT_STEPS)
            done = settle(done.base, settled.noise)
        by_run = done.density - (reference or settled).density
        return Contender(result, candidate, done, float(by_run.sum()), by_run)

    def from_base(tolerance: float = TOLERANCE) -> Contender:
        base = settled.base.copy()
        put_in(base, stage, candidate, start, own)
        base.fit(noise=sigma, steps=APART_STEPS, tolerance=tolerance)
        return settled_from(base)

    if reference is not None and reference.base is not settled.base:
        return from_base(APART_TOLERANCE)
    base = settled.base.copy()
    step_to(base, stage, result)
    put_in(base, stage, candidate, start, own)
    base.fit(noise=sigma, steps=REFIT_STEPS)
    if plain_rms(base) > WORSE * plain_rms(settled.base):
        return from_base()
    stepped = settled_from(base)
    if stepped.gain >= PROMISE_KEPT * result.gain:
        return stepped
    return max(stepped, from_base(), key=lambda c: c.gain)


def hold_to_name(term: Term) -> bool:
    """Keep a value at nothing that makes an effect another one; whether there was one."""
    wrong = term.effect.against_its_name(term.values)
    if wrong is None:
        return False
    term.values[wrong] = 0.0
    term.free = [place for place in term.free if place != wrong]
    return True


def step_to(base: Base, stage: Field, result: Result) -> None:
    """Move a base and the deviations of its runs to where a hypothesis wants them."""
    evidence = stage.contest.evidence
    delta = np.concatenate((result.fixed_step, result.coefficients))
    own = stage.contest.deviations(evidence.index(result.block), result.omega, delta)
    moved = np.concatenate((evidence.fixed, evidence.scatter))
    take_step(base, evidence.scale[moved], result.fixed_step, own)


def put_in(base: Base, stage: Field, candidate: Candidate, start: int, own: Result) -> None:
    """Add a candidate to a base with the values that the contest suggests."""
    if candidate.effect is not None:
        base.terms.append(term_of_start(stage, candidate, start, own))
        return
    evidence = stage.contest.evidence
    base.additives.append(
        Additive(
            candidate.name,
            candidate.columns,
            own.coefficients / evidence.scale[evidence.blocks[own.block]],
            candidate.covariate,
            candidate.shape,
        )
    )


def sharpen(stage: Field, winner: Contender) -> Contender | None:
    """Find the frequency of a winning wave more closely, and refit it."""
    fine = shape_room.finer(stage.settled.base, winner.candidate)
    if not fine:
        return None
    scan = make_field(stage.settled, fine, {})
    found = [r for r in (scan.contest.test(c.name, refit_scatter=False) for c in fine) if r]
    if not found:
        return None
    best = max(found, key=lambda r: r.wald)
    wide = shape_room.with_neighbours(stage.settled.base, scan.candidates[best.name])
    only = make_field(stage.settled, [wide], {})
    result = only.contest.test(wide.name)
    return None if result is None else refit(only, result)


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
    return paired_t(a, b) >= PAIRED_T or signed_rank(a, b) >= SIGNED_RANK


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
        Effects that this selection has put into the model, with their sizes.
    """
    count = tests_made(stage)
    leads = find_leads(stage, results, count, least, least_shape)
    if plain is not None:
        leads = add_leads(leads, *plain, count, least)
    beside = kept or {}
    leads = [
        lead
        for lead in leads
        if lead.size >= least_beside(lead.stage.candidates[lead.result.name].effect, beside)
    ]
    if not leads:
        return Step(stage, results, None, [])

    def follow(lead: Lead) -> Contender:
        contender = refit(lead.stage, lead.result, stage.settled)
        contender.size = lead.size
        contender.passes = contender.gain >= GAIN_LEAST and (
            not contender.candidate.named or stands(contender, count)
        )
        return contender

    contenders = best_starts(in_parallel(follow, leads))
    fit = [c for c in contenders if c.passes]
    best_named = simplest([c for c in fit if c.candidate.named])
    best_shape = max((c for c in fit if not c.candidate.named), key=lambda c: c.gain, default=None)
    if best_shape is not None:
        sharper = sharpen(stage, best_shape)
        if sharper is not None:
            sharper.size = best_shape.size
            contenders.append(sharper)
            best_shape = max(best_shape, sharper, key=lambda c: c.gain)
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
            nested = angles.size > 0 and float(angles[0]) < NESTED_DEG
        if best_named.gain < NAMED_SHARE * best_shape.gain and not nested:
            chosen = best_shape
    step = Step(stage, results, chosen, contenders)
    if chosen is not None and chosen.candidate.named:
        step.rivals = rivals(stage, results, contenders, chosen)
    return step


def simplest(contenders: list[Contender]) -> Contender | None:
    """Find the effect that gains most, or one with fewer values that does next to as well."""
    best = max(contenders, key=lambda c: c.gain, default=None)
    if best is None:
        return None
    enough = min(best.gain - GAIN_LEAST, SIMPLER_SHARE * best.gain)
    near = [c for c in contenders if c.gain >= enough]
    return min(near, key=lambda c: (free_count(c), -c.gain))


def free_count(contender: Contender) -> int:
    """Number of values that the fit of an effect may move."""
    assert contender.candidate.effect is not None
    return len(free_values(contender.candidate.effect))


def least_beside(effect: Effect | None, kept: Mapping[str, tuple[Effect, float]]) -> float:
    """Least size of an effect beside those that are in the model.

    What is left of an effect whose form is not exactly right looks like its twins.
    """
    if effect is None:
        return 0.0
    return max(
        (
            TWIN_SHARE * size
            for name, (other, size) in kept.items()
            if name in effect.confused_with or effect.name in other.confused_with
        ),
        default=0.0,
    )


def find_leads(
    stage: Field, results: list[Result], count: int, least: float, least_shape: float | None
) -> list[Lead]:
    """Find the strongest of those that pass all gates where the base stands."""
    passed = []
    for result in results:
        if accepted(result, count):
            size = size_of(stage, result)
            named = stage.candidates[result.name].named
            if size >= (least_shape if least_shape is not None and not named else least):
                passed.append(Lead(stage, result, size))
    if not passed:
        return []
    near = [lead for lead in passed if lead.result.gain >= REFIT_SHARE * passed[0].result.gain]
    effects = [x for x in near if stage.candidates[x.result.name].named][:REFITS_NAMED]
    shapes = [x for x in near if not stage.candidates[x.result.name].named][:REFITS_SHAPES]
    if effects and near[0] is effects[0] and shapes:
        shapes = [x for x in shapes[:1] if x.result.gain > CLEAR_SHARE * effects[0].result.gain]
    return [*effects, *shapes]


def add_leads(
    leads: list[Lead], plain: Field, results: list[Result], count: int, least: float
) -> list[Lead]:
    """Add the strongest named ones of the base without deviations; they start from there.

    Whether they stand is judged later, where the model with them is: this only finds them. One that
    was found already gets a second start.
    """
    strong = sorted((r for r in results if r.p * count <= P_LIMIT), key=lambda r: (-r.wald, r.name))
    known = {lead.result.name for lead in leads}
    found = strong[:REFITS_NAMED] + [r for r in strong[REFITS_NAMED:] if r.name in known]
    more = [Lead(plain, result, size_of(plain, result)) for result in found]
    return leads + [lead for lead in more if lead.size >= least]


def best_starts(contenders: list[Contender]) -> list[Contender]:
    """Of several starts of a candidate the one that came to most, those that stand first."""
    best: dict[str, Contender] = {}
    for contender in contenders:
        name = contender.result.name
        rank = (contender.passes, contender.gain)
        if name not in best or rank > (best[name].passes, best[name].gain):
            best[name] = contender
    return list(best.values())


def stands(contender: Contender, count: int) -> bool:
    """Whether an effect passes the gates where the model with it stands."""
    assert contender.settled is not None
    return term_stands(contender.settled, len(contender.settled.base.terms) - 1, count)


def term_stands(settled: Settled, place: int, count: int) -> bool:
    """Whether a term of a model passes the gates beside the others."""
    contest, name = contest_of_term(settled, place)
    try:
        result = contest.test(name)
    except np.linalg.LinAlgError:
        return False
    return result is not None and accepted(result, count)


def tests_made(stage: Field) -> int:
    """Number of tests of a round, for Bonferroni."""
    return sum(
        1 + len(set(c.start_of)) * (len(set(c.start_of)) > 1) for c in stage.candidates.values()
    )


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
        if result.gain < GAIN_LEAST:
            continue
        if name in own:
            gain, by_run = own[name].gain, own[name].gain_by_run
            ahead, ahead_by_run = chosen.gain, chosen.gain_by_run
        else:
            gain, by_run = result.gain, result.gain_by_run
            ahead, ahead_by_run = chosen.result.gain, chosen.result.gain_by_run
        close = gain >= RIVAL_SHARE * ahead and not told_apart(ahead_by_run, by_run)
        if ahead - gain < GAIN_LEAST or close:
            out.append(name)
    return out


def select(
    base: Base,
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
    limit = max(1, min(TERMS_MAX, runs // RUNS_PER_TERM))
    waves = shape_room.waves(base)
    candidates, closed = make_candidates(base, effects, ratio, waves)
    noise = estimate_noise(base, [c.columns for c in candidates])
    settled = settle(base, noise)
    steps: list[Step] = []
    trail = [settled]
    say("noise")
    while True:
        candidates, closed = make_candidates(settled.base, effects, ratio, waves)
        if steps:
            noise = estimate_noise(settled.base, [c.columns for c in candidates])
        stage, results = contest_under(settled.base, noise, candidates, closed)
        if noise_rms(noise, base) > WANDERING * float(np.mean(noise.sigma)):
            calmer = calmer_noise(stage, results, effects, ratio, waves)
            if calmer is not None:
                noise = calmer
                stage, results = contest_under(settled.base, noise, candidates, closed)
        settled = stage.settled
        trail[-1] = settled
        say("contest")
        largest = max((s.chosen.size for s in steps if s.chosen is not None), default=0.0)
        least = max(SIZE_LEAST * noise_rms(noise, base), LEFTOVER_SHARE * largest)
        named_before = any(s.chosen is not None and s.chosen.candidate.named for s in steps)
        shape = max(least, SHAPE_AFTER_NAMED * noise_rms(noise, base)) if named_before else least
        kept = {
            s.chosen.result.name: (s.chosen.candidate.effect, s.chosen.size)
            for s in steps
            if s.chosen is not None and s.chosen.candidate.effect is not None
        }
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
        settled = without_idle(step.chosen.settled, len(base.terms), tests_made(stage))
        trail.append(settled)
        say("refit")
    return Selection(steps, trail, noise)


def contest_of_plain(
    settled: Settled, effects: Mapping[str, Effect], ratio: float
) -> tuple[Field, list[Result]] | None:
    """Judge the named candidates where all runs are alike; None where they nearly are."""
    if float(np.max(np.abs(settled.base.deviations[:, :2]))) < STRAYED:
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


def refitted(base: Base, noise: Noise) -> Settled:
    """Fit a base with its terms as they are, and settle it."""
    base.fit(noise=float(np.median(noise.sigma)), steps=REFIT_STEPS)
    return settle(base, noise)


def contest_under(
    base: Base, noise: Noise, candidates: list[Candidate], closed: dict[str, str]
) -> tuple[Field, list[Result]]:
    """Settle the base under a noise model and judge every candidate."""
    settled = settle(base, noise)
    # What is left of an effect is often another in quick runs, and is no second cause.
    steps = [] if base.terms else run_steps(settled.base, settled.contest)
    stage = make_field(settled, [*candidates, *steps], closed)
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
    least = CALMER * noise_rms(stage.settled.noise, stage.settled.base)
    named = [r for r in results if stage.candidates[r.name].named and r.gain > 0]
    for result in named[:REFITS_NAMED]:
        contender = refit(stage, result)
        assert contender.settled is not None
        base = contender.settled.base
        candidates, _ = make_candidates(base, effects, ratio, waves)
        noise = estimate_noise(base, [c.columns for c in candidates])
        spread = noise_rms(noise, base)
        if spread < least:
            best, least = noise, spread
    return best


def noise_rms(noise: Noise, base: Base) -> float:
    """Root mean square of the noise within runs, arc seconds."""
    rows = np.diff(base.conditions.starts)
    spread = np.array([noise.spread(r) for r in range(rows.size)])
    return float(np.sqrt(np.average(spread**2, weights=rows)))
