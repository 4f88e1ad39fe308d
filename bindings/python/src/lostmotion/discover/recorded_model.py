"""The model of a selection over recordings: candidates are confirmed by refits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lostmotion import rules
from lostmotion.arrays import FloatArray
from lostmotion.candidates import shapes
from lostmotion.candidates.between_runs import between_runs
from lostmotion.candidates.candidate import Candidate
from lostmotion.candidates.named import named_candidates
from lostmotion.discover.baseline_form import better_than_forms
from lostmotion.discover.choice import Step
from lostmotion.discover.contest_round import (
    ContestRound,
    RecordedRound,
    make_candidates,
    make_round,
)
from lostmotion.discover.form_variance import (
    form_error_size,
    largest_model,
    mark_of_form,
    with_form_error,
)
from lostmotion.discover.gates import (
    accepted,
    corrected_for,
    family_p,
    is_of_form,
    judge_all,
    runs_separate,
    share_at,
)
from lostmotion.discover.growing_model import Contender, GrowingModel, Lead
from lostmotion.discover.linearise import Settled, noise_rms, plain_rms, settle
from lostmotion.discover.refits import refit, refitted, sharpen, shifts_load, without_deviations
from lostmotion.discover.selection import select
from lostmotion.discover.shortlist import without
from lostmotion.discover.stepwise_fit import fit_models
from lostmotion.discover.terms import beyond_form, term_angle, term_size, term_tested
from lostmotion.effects.effect import Effect
from lostmotion.evidence.contest import Result
from lostmotion.evidence.noise import Noise
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.held_out import LeftOutResiduals
from lostmotion.rms import rms_of
from lostmotion.threads import begin, both


@dataclass
class Selection:
    """Result of a selection over recordings.

    Attributes
    ----------
    steps : list of Step
    settled : list of Settled
        The model at the start, and after each selected candidate.
    noise : Noise
    given_arcsec : float
        Largest size of an initial effect of the model.
    began_with : BaselineModel
        Fitted to all runs together, before deviations.
    first : Settled
        First estimate of the noise for it, and the deviations of the runs for that noise.
    begun : dict
        Fits to all runs together that were begun, by the names of the effects that are added to
        `began_with`: results are models, see `StepwiseFit`.
    left_out : LeftOutResiduals
        Of models of the answer.
    """

    steps: list[Step]
    settled: list[Settled]
    noise: Noise
    given_arcsec: float
    began_with: BaselineModel
    first: Settled
    begun: dict[tuple[str, ...], Callable[[], list[BaselineModel]]]
    left_out: LeftOutResiduals


def select_recorded(
    base: BaselineModel,
    effects: Mapping[str, Effect],
    ratio: float,
    *,
    progress: Callable[[str], None] | None = None,
) -> Selection:
    """Select effects for recordings, starting from a fitted baseline model."""
    say = progress or (lambda _: None)
    say("estimating the measurement noise")
    model = RecordedModel(base, effects, ratio)
    steps = select(model, say)
    given = max(model.given.values(), default=0.0)
    return Selection(
        steps,
        model.settled,
        model.noise,
        given,
        base,
        model.first,
        model.begun,
        model.left_out,
    )


class RecordedModel(GrowingModel):
    """A baseline model for recordings, and the candidates added to it.

    Parameters
    ----------
    base : BaselineModel
        Fitted.
    effects : mapping
        Those that may be missing.
    ratio : float
        Of the drive.

    Attributes
    ----------
    noise : Noise
    settled : list of Settled
        The model at the start, and after each selected candidate.
    taking : set of str
        Candidates of the present round that explain, refitted, only what the form error did.
    """

    def __init__(self, base: BaselineModel, effects: Mapping[str, Effect], ratio: float) -> None:
        base = base.with_present_form()
        self.effects, self.ratio = effects, ratio
        self.began_with = base
        self.runs = base.conditions.runs
        self.given_terms = len(base.terms)
        self.waves = shapes.waves(base)
        candidates, _ = self.candidates(base)
        self.largest = largest_model(base, candidates)
        self.noise = self.largest.noise()
        self.within = noise_rms(self.noise, base)
        first = with_form_error(base, self.noise, candidates, self.largest)
        self.first = settle(first, self.noise)
        self.settled = [self.first]
        self.rounds = 0
        self.counts: dict[str, int] = {}
        self.begun: dict[tuple[str, ...], Callable[[], list[BaselineModel]]] = {}
        self.tried: dict[tuple[int, str], tuple[RecordedRound, Contender | None]] = {}
        self.present: tuple[Settled, FloatArray] | None = None
        self.left_out = LeftOutResiduals()
        self.beating: dict[int, tuple[Settled, bool]] = {}
        self.formless: RecordedRound | None = None
        self.taking: set[str] = set()
        self.replaced = set()
        first = self.settled[0].base
        self.given = {
            term.effect.name: term_size(first, place)
            for place, term in enumerate(first.terms)
            if term.free
        }

    @property
    def now(self) -> Settled:
        """The present model."""
        return self.settled[-1]

    def candidates(self, base: BaselineModel) -> tuple[list[Candidate], dict[str, str]]:
        """Named effects and shapes for a model, and why other effects are not testable."""
        return make_candidates(base, self.effects, self.ratio, self.waves)

    def compete(self) -> tuple[RecordedRound, list[Result]]:
        """See `GrowingModel`; the noise is estimated again, and the model is linearised for it."""
        base = self.now.base
        candidates, closed = self.candidates(base)
        self.tried, self.taking = {}, set()
        now = self.now
        if self.rounds:
            base = base.with_present_form()
            self.largest = largest_model(base, candidates)
            self.noise = self.largest.noise()
            base = with_form_error(base, self.noise, candidates, self.largest)
        self.rounds += 1
        settled = now
        if now.noise is not self.noise:
            settled = settle(base, self.noise)
            candidates, closed = self.candidates(settled.base)
        self.within = noise_rms(self.noise, base)
        self.settled[-1] = settled
        # The residual of an effect often differs in fast runs; this is not a second cause.
        own = [] if base.has_effects else between_runs(settled.base, settled.contest)
        current = make_round(settled, [*candidates, *own], closed)
        results = judge_all(current)
        mark_of_form(self.largest, current, results)
        return current, results

    def with_candidate(self, lead: Lead) -> Contender | None:
        """See `GrowingModel`: a joint refit, once for each lead of a round."""
        assert isinstance(lead.round, RecordedRound)
        key = (id(lead.round), lead.name)
        if key not in self.tried:
            self.tried[key] = (lead.round, self.refit(lead, lead.round))
        return self.tried[key][1]

    def refit(self, lead: Lead, start: RecordedRound) -> Contender | None:
        """Fit a lead and the model together, from the round in which it was found."""
        found = refit(start, lead.result)
        if found is None:
            return None
        if start is self.formless:
            return self.beside_form_error(found)
        if self.takes_from_form(found):
            self.taking.add(found.name)
            return None
        return found

    def mark_rejected(self, current: ContestRound) -> None:
        """See `GrowingModel`."""
        for name in self.taking & current.candidates.keys():
            current.candidates[name].of_form = True

    def takes_from_form(self, found: Contender) -> bool:
        """Whether a candidate explains only what the form error explained before.

        The columns of a candidate may become confounded with the form error by the refit.
        """
        named = found.candidate.named
        if self.now.base.form_error is None or not found.candidate.may_be_form:
            return False
        base = model_of(found)
        added = (base.terms if named else base.additives)[-1]
        return is_of_form(beyond_form(base, added), named)

    def beside_form_error(self, found: Contender) -> Contender | None:
        """Estimate the form error together with an effect that was fitted without it.

        None if the effect explains less of the form error than a named effect must explain of what
        a shape does (`rules.WARN_DEG`): then it may imitate a part of that.
        """
        base, noise = model_of(found), self.noise
        effects, _ = named_candidates(self.effects, base, base.at(), self.ratio)
        settled = settle(with_form_error(base, noise, effects), noise)
        left = form_error_size(settled) ** 2
        if left > (1.0 - share_at(rules.WARN_DEG)) * form_error_size(self.now) ** 2:
            return None
        by_run = settled.density - self.now.density
        return replace(
            found,
            settled=settled,
            gain=float(by_run.sum()),
            gain_by_run=by_run,
            formless=found.settled,
        )

    def beats_forms(self, contender: Contender) -> bool:
        """See `GrowingModel`."""
        alone = contender.formless
        if alone is None:
            return True
        if id(alone) not in self.beating:
            self.beating[id(alone)] = (alone, better_than_forms(alone, self.ratio))
        return self.beating[id(alone)][1]

    def tested(self, contender: Contender) -> Result | None:
        """See `GrowingModel`: linearised at the model with it."""
        assert contender.settled is not None
        return term_tested(contender.settled, len(contender.settled.base.terms) - 1)

    def size_within(self, contender: Contender) -> float:
        """See `GrowingModel`.

        From its tangent, as long as that does not exceed what was to be explained and the effect
        does not shift the load: if the load is wrong by more than the width of a kink, the tangent
        continues beyond the kink and overestimates the effect tenfold. Then the decrease of the
        common error of all runs counts.
        """
        base, effect = model_of(contender), contender.candidate.effect
        size = term_size(base, len(base.terms) - 1)
        shifted = effect is not None and shifts_load(effect)
        if size <= plain_rms(self.now.base) and not (
            shifted and contender.gain >= rules.GAIN_LEAST
        ):
            return size
        assert contender.settled is not None
        return fall_of_error(self.now, contender.settled)

    def not_kept(self, contender: Contender) -> float:
        """See `GrowingModel`."""
        assert contender.settled is not None
        beyond = np.sum(self.now.beyond_linear) - np.sum(contender.settled.beyond_linear)
        return max(0.0, float(beyond))

    def fall_of_left_out(self, contender: Contender) -> float:
        """See `GrowingModel`."""
        assert contender.settled is not None
        answer = self.in_answer(contender.settled)
        if contender.candidate.named and not np.any(term_angle(answer, len(answer.terms) - 1)):
            return 0.0  # the answer is the present model, fitted from another start
        before, after = self.left_out_beside(contender)
        return rms_of(before) ** 2 - rms_of(after) ** 2

    def left_out_beside(self, contender: Contender) -> tuple[FloatArray, FloatArray]:
        """Leave-one-run-out residual of the present model, and of the one with a contender."""
        settled = contender.settled
        assert settled is not None
        return both(self.left_out_present, lambda: self.left_out_residual(settled))

    def left_out_residual(self, settled: Settled) -> FloatArray:
        """Leave-one-run-out residual of a model in the answer, arc seconds."""
        return self.left_out.of(self.in_answer(settled))

    def left_out_present(self) -> FloatArray:
        """The same of the present model, or of a longer fit of it if that predicts better.

        A candidate is not credited for the convergence of the rest.
        """
        if self.present is None or self.present[0] is not self.now:
            longer = without_deviations(self.now.base, self.in_answer(self.now), self.now.alike)
            fits = (self.left_out_residual(self.now), self.left_out.of(longer))
            self.present = (self.now, min(fits, key=rms_of))
        return self.present[1]

    def in_answer(self, settled: Settled) -> BaselineModel:
        """A model as the answer has it: fitted to all runs together, effect by effect."""
        models = self.begin_fits([term.effect for term in settled.base.terms[self.given_terms :]])()
        if len(settled.base.additives) == len(self.began_with.additives):
            return models[-1]
        return without_deviations(settled.base, models[-1], settled.alike)

    def take(self, contender: Contender, current: ContestRound) -> None:
        """See `GrowingModel`; effects of the drive file are kept."""
        assert contender.settled is not None
        self.counts[contender.name] = corrected_for(current, contender.candidate)
        self.settled.append(self.without_idle(contender))
        self.begin_fits([term.effect for term in self.now.base.terms[self.given_terms :]])

    def without_idle(self, newest: Contender) -> Settled:
        """The model with the newest candidate, without the effects that are dropped (`to_drop`).

        Effects given with the baseline model are kept. Each of the others is corrected for as many
        tests as when it was selected.
        """
        settled = newest.settled
        assert settled is not None
        for place in range(len(settled.base.terms) - 2, self.given_terms - 1, -1):
            name = settled.base.terms[place].effect.name
            before, beside = term_tested(self.now, place), term_tested(settled, place)
            if self.to_drop(name, newest, self.counts[name], before, beside):
                base = settled.base.copy()
                del base.terms[place]
                settled = refitted(base, settled.noise)
        return settled

    def begin_fits(self, found: Sequence[Effect]) -> Callable[[], list[BaselineModel]]:
        """Begin to fit effects to all runs together, while the next are looked for."""
        names = tuple(effect.name for effect in found)
        if names in self.begun:
            return self.begun[names]
        before = self.begun.get(names[:-1])

        def models() -> list[BaselineModel]:
            known = before() if before else ()
            base, first = self.began_with, self.first
            return fit_models(base, first, found, self.ratio, known)

        self.begun[names] = begin(models)
        return self.begun[names]

    def substitutes(
        self, current: ContestRound, selected: Contender, rivals: Sequence[Result]
    ) -> list[str]:
        """See `GrowingModel`: those whose models predict the left-out runs as well."""
        found = [contender for _, contender in self.tried.values() if contender]
        fitted = {one.name: one for one in sorted(found, key=lambda one: one.gain)}

        def squares(contender: Contender) -> FloatArray:
            assert contender.settled is not None
            return self.left_out.squares_by_run(self.in_answer(contender.settled))

        return [
            result.name
            for result in rivals
            if result.name not in fitted
            or not runs_separate(squares(fitted[result.name]), squares(selected))
        ]

    def beside(self, contender: Contender, other: Contender) -> Result | None:
        """See `GrowingModel`: by its tangent at the model with the other."""
        settled, name = other.settled, contender.name
        assert settled is not None
        base = settled.base
        alone, _ = named_candidates({name: self.effects[name]}, base, base.at(), self.ratio)
        return next(iter(judge_all(make_round(settled, alone, {}))), None)

    def more_starts(self, current: ContestRound, leads: list[Lead]) -> list[Lead]:
        """Add effects that are confounded with the form error, judged without a form error.

        Together with a form error such effects explain almost nothing. One of them is found if it
        explains enough of the form error (`beside_form_error`).
        """
        if self.now.base.form_error is None:
            return leads
        base = self.now.base.copy()
        base.form_error = None
        formless = settle(base, self.noise)
        effects = {
            name: self.effects[name]
            for name, candidate in current.candidates.items()
            if candidate.named and (candidate.may_be_form or candidate.of_form)
        }
        alone, closed = named_candidates(effects, formless.base, formless.base.at(), self.ratio)
        self.formless = make_round(formless, alone, closed)
        found = [
            result
            for result in judge_all(self.formless)
            if accepted(result, corrected_for(current, self.formless.candidates[result.name]))
        ]
        # All of them imitate each other: a tangent does not tell which one explains most.
        strong = found[: rules.REFITS_MOST]
        return leads + [Lead(self.formless, result, None) for result in strong]

    def with_equal_runs(self, current: ContestRound) -> list[Lead]:
        """See `GrowingModel`: effects that the deviations of the runs hide.

        An effect that differs between runs may be absorbed by their deviations, as a delay of the
        torque by wider loops of the fast runs. Near these, its tangent is not that of the effect.
        Without deviations, the other differences between runs count as noise, so significance alone
        makes a lead; all tests follow in the model with it.
        """
        alike = replace(self.now, base=self.now.alike)
        effects, closed = named_candidates(self.effects, alike.base, alike.base.at(), self.ratio)
        equal = make_round(alike, effects, closed)
        found = [
            result
            for result in judge_all(equal)
            if family_p(current, equal.candidates[result.name], result) <= rules.P_LIMIT
        ]
        found.sort(key=lambda result: (-result.wald, result.name))
        return [Lead(equal, result, None) for result in found[: rules.REFITS_MOST]]

    def in_place_of(
        self, selected: Contender, current: ContestRound, results: Sequence[Result]
    ) -> list[Lead]:
        """See `GrowingModel`: from the model with the selected effect, without that.

        There the values of the model are those beside an effect, and its contribution is missing.
        In the present model they may imitate a part of it, and a tangent show little.
        """
        base = model_of(selected).copy()
        del base.terms[-1]
        effects = {result.name: self.effects[result.name] for result in results}
        candidates, _ = named_candidates(effects, base, base.at(), self.ratio)
        there = make_round(replace(self.now, base=base), candidates, {})
        return [Lead(there, result, None) for result in judge_all(there)]

    def with_unjudged(
        self, current: ContestRound, results: list[Result], leads: list[Lead]
    ) -> list[Lead]:
        """Add effects that shift the load by a constant, or leave them without a size.

        They shift every kink, and a model fitted without them is smeared there: its tangent is of
        little use if the load is wrong by more than the width of a kink.
        """
        found = []
        for result in results:
            effect = current.candidates[result.name].effect
            if effect is not None and shifts_load(effect):
                found.append(Lead(current, result, None))
        return without(leads, found) + found

    def sharpened(self, current: ContestRound, shape: Contender) -> Contender | None:
        """See `GrowingModel`."""
        assert isinstance(current, RecordedRound)
        return sharpen(current, shape)


def model_of(contender: Contender) -> BaselineModel:
    """The model with a candidate in it."""
    assert contender.settled is not None
    return contender.settled.base


def fall_of_error(now: Settled, with_effect: Settled) -> float:
    """Root mean square, arc seconds, of the decrease of the common error by an effect."""
    before = now.alike
    after = without_deviations(with_effect.base, before, with_effect.alike)
    return float(np.sqrt(max(0.0, plain_rms(before) ** 2 - plain_rms(after) ** 2)))
