"""The diagnosis: missing effects, confounded effects, and the residual."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from lostmotion.candidates.slipped_teeth import jumping_effect, slipped_teeth
from lostmotion.candidates.tangents import at_base, given_values
from lostmotion.discover.advice import advise
from lostmotion.discover.answer import (
    Diagnosis,
    list_candidates,
    make_ladder,
    of_slip,
    shapes_of,
    told_slips,
    weak_leftovers,
)
from lostmotion.discover.baseline_fit import finish_baseline, form_beside_effects
from lostmotion.discover.conclusion import Conclusion, conclude_rounds
from lostmotion.discover.detectable import detectable
from lostmotion.discover.events import (
    EDGE,
    Event,
    dependence,
    early_events,
    find_events,
    lost_counts,
    with_steps,
)
from lostmotion.discover.few_readings import few_readings_diagnosis
from lostmotion.discover.form_variance import form_error_told
from lostmotion.discover.gates import level_of_answer, runs_separate
from lostmotion.discover.ladder import make_rungs
from lostmotion.discover.linearise import noise_rms
from lostmotion.discover.noise_floor import noise_floor, scatter_of
from lostmotion.discover.outlier_runs import RUN_NEEDS, OutlierRuns, find_outlier_runs
from lostmotion.discover.recorded_model import Selection, select_recorded
from lostmotion.discover.refits import without_deviations
from lostmotion.discover.shortlist import least_size
from lostmotion.discover.stepwise_fit import StepwiseFit, fit_stepwise
from lostmotion.drives import Drive
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.effect import Effect
from lostmotion.effects.library import library
from lostmotion.errors import InputError, given_as
from lostmotion.evidence.sign_flips import runs_least
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.deviations import DEVIATIONS
from lostmotion.fit.drive_file import SAMPLES_LEAST, make_base, require_samples
from lostmotion.fit.few_readings import fit_few_readings
from lostmotion.fit.forms import friction_form
from lostmotion.fit.terms import Term, start_values
from lostmotion.friction import Friction
from lostmotion.hold_against import hold_against
from lostmotion.on_progress import OnProgress
from lostmotion.recordings import Campaign
from lostmotion.threads import both, one_thread
from lostmotion.torsion_curve import TorsionCurve

REFIT_STEPS = 8
"""Evaluations of a refit that starts from an existing fit."""

PIECES = 12
"""Usual number of steps of a diagnosis, of which the last is reported once it has ended."""


def count_pieces(tick: OnProgress) -> Callable[[str], None]:
    """Convert ``progress(done, of, step)`` to a function that receives the name of each step."""
    done = -1

    def piece(step: str) -> None:
        nonlocal done
        done = min(done + 1, PIECES - 1)
        tick(done, PIECES, step)

    return piece


@one_thread()
def diagnose(
    drive: Drive | None,
    campaign: Campaign,
    *,
    ratio: float | None = None,
    rated_torque_Nm: float | None = None,
    torsion_curve: TorsionCurve | None = None,
    effects: Mapping[str, Effect] | None = None,
    base: BaselineModel | None = None,
    friction: Friction | None = None,
    progress: OnProgress | None = None,
) -> Diagnosis:
    """Find the effects that the recordings of a campaign show but the baseline model lacks.

    Parameters
    ----------
    drive : Drive or None
        The drive; a fit and effects in its file become part of the model. None: `ratio` and
        `rated_torque_Nm` must be given.
    campaign : Campaign
        Runs in the order in which they were made.
    ratio, rated_torque_Nm : float, optional
        Ratio and rated torque if no drive is given.
    torsion_curve : TorsionCurve, optional
        Torsion curve of the drive file, used as start and weak prior.
    effects : mapping, optional
        The effects that may be missing; by default those of the library.
    base : BaselineModel, optional
        An existing baseline model, possibly with terms (from a fitted drive file).
    friction : {"inside", "outside", "inside+load", "both", "both+load"}, optional
        Form of the hysteresis, see `lostmotion.friction`; by default by the leave-one-run-out
        error.
    progress : callable, optional
        ``progress(done, of, step)``, see `lostmotion.on_progress`.

    Returns
    -------
    Diagnosis
    """
    given_as("diagnose", "campaign", campaign, Campaign)
    if campaign.rows >= SAMPLES_LEAST:
        require_samples(campaign)
    campaign.require_variation()
    chosen_from = dict(library() if effects is None else effects)
    if drive is not None:
        given_as("diagnose", "drive", drive, Drive)
        ratio = drive.ratio if ratio is None else ratio
        rated_torque_Nm = drive.rated_torque_Nm
        if torsion_curve is None:
            torsion_curve = hold_against(campaign, drive)
        base = base or make_base(drive, campaign, torsion_curve, chosen_from)
    if ratio is None or rated_torque_Nm is None:
        expected = "a Drive, or ratio= and rated_torque_Nm="
        raise InputError("diagnose", "drive", "nothing", expected)
    base = base or BaselineModel(Conditions(campaign), rated_torque_Nm, torsion_curve)
    if campaign.rows < SAMPLES_LEAST:
        few = fit_few_readings(base)
        if few is not None:
            return few_readings_diagnosis(few, chosen_from)
        require_samples(campaign)
    found = _diagnose(
        base, chosen_from, ratio, friction, None if progress is None else count_pieces(progress)
    )
    if progress is not None:
        progress(PIECES, PIECES, "")
    return found


def _diagnose(
    base: BaselineModel,
    chosen_from: dict[str, Effect],
    ratio: float,
    friction: Friction | None,
    progress: Callable[[str], None] | None,
) -> Diagnosis:
    slipped = put_in_slips(base, chosen_from, ratio)
    counts = lost_counts(base, ratio)
    start = with_steps(base, counts)
    start.first_fit()
    early = early_events(start)
    while True:
        body = select_with(start, early, chosen_from, ratio, friction, progress)
        confirmed = beside_what_was_found(body.selection, start, early)
        if len(confirmed) == len(early):
            break
        early = confirmed
    events = counts + early
    selection, stepwise = body.selection, body.stepwise
    found = new_events(selection, body.base, events)
    if found:
        events += found
        again = with_steps(body.base, found)
        again.fit(steps=REFIT_STEPS)
        selection = select_recorded(again, chosen_from, ratio, progress=progress)
        stepwise = add_found(selection, chosen_from, ratio)
        events += new_events(selection, body.base, events)
    diagnosis = conclude(selection, stepwise, events, chosen_from, slipped)
    diagnosis.details["outliers"] = body.outliers
    return diagnosis


@dataclass
class Selected:
    """A selection, its initial baseline model, and the outliers set aside for it.

    `stepwise` has the effects found, added as by `fit`.
    """

    base: BaselineModel
    selection: Selection
    stepwise: StepwiseFit
    outliers: int

    def predicts_better(self, other: Selected) -> bool:
        """Whether left-out runs separate these effects from other ones in the same form."""
        own, others = (
            one.selection.left_out.squares_by_run(one.stepwise.model) for one in (self, other)
        )
        return runs_separate(others, own)


def select_with(
    start: BaselineModel,
    early: list[Event],
    effects: dict[str, Effect],
    ratio: float,
    friction: Friction | None,
    progress: Callable[[str], None] | None,
) -> Selected:
    """Select with early events in the model: outliers, then the form, then effects.

    If the effects that were found call for another form, a selection in that form follows. It may
    lose what the form was chosen beside: an effect that is confounded with the form error there.
    The effects that were found first are kept if they predict left-out runs better, in that form.
    """
    plain = with_steps(start, early)
    if early:
        plain.fit(steps=REFIT_STEPS)
    if progress is not None:
        progress("fitting the baseline model")
    if friction is None and plain.conditions.runs < runs_least():
        friction = friction_form(plain)  # parts of few runs are merged in the same form
    fitted = finish_baseline(plain, effects, ratio, friction)
    first = selected(fitted.base, effects, ratio, fitted.outliers, progress)
    other = form_beside_effects(fitted, first.stepwise.model, effects, ratio)
    if other is None:
        return first
    again = selected(other, effects, ratio, fitted.outliers, progress)
    found, found_again = (effects_found(one.selection) for one in (first, again))
    if [one.name for one in found] == [one.name for one in found_again]:
        return again
    kept = replace(first, base=other, stepwise=fit_stepwise(other, found, effects, ratio))
    return kept if kept.predicts_better(again) else again


def selected(
    base: BaselineModel,
    effects: Mapping[str, Effect],
    ratio: float,
    outliers: int,
    progress: Callable[[str], None] | None,
) -> Selected:
    """Select effects for a fitted baseline model."""
    selection = select_recorded(base, effects, ratio, progress=progress)
    return Selected(base, selection, add_found(selection, effects, ratio), outliers)


def effects_found(selection: Selection) -> list[Effect]:
    """Effects that a selection added to its baseline model."""
    given = len(selection.began_with.terms)
    return [term.effect for term in selection.settled[-1].base.terms[given:]]


def add_found(selection: Selection, effects: Mapping[str, Effect], ratio: float) -> StepwiseFit:
    """Add the effects of a selection to its initial model, as `fit` does."""
    base, found = selection.began_with, effects_found(selection)
    begun = selection.begun.get(tuple(effect.name for effect in found))
    models = begun() if begun else ()
    return fit_stepwise(base, found, effects, ratio, selection.first, models=models)


def beside_what_was_found(
    selection: Selection, start: BaselineModel, early: list[Event]
) -> list[Event]:
    """Keep only the early events that remain steps when the effects are in the model.

    An effect at a reversal looks like a step to a baseline model without it.
    """
    if not early:
        return early
    without = selection.settled[-1].base.copy()
    first = len(start.additives)
    del without.additives[first : first + len(early)]
    without.deviations[:] = 0.0
    without.fit(steps=REFIT_STEPS)
    again = {event.run: event.row for event in early_events(without)}
    return [one for one in early if abs(again.get(one.run, -EDGE - 1) - one.row) <= EDGE]


def new_events(selection: Selection, base: BaselineModel, known: list[Event]) -> list[Event]:
    """Find further events with the selected effects in the model."""
    noise = selection.noise
    found = find_events(selection.settled[-1].base, noise, noise_rms(noise, base))
    return [event for event in found if all(event.row != other.row for other in known)]


def put_in_slips(base: BaselineModel, effects: Mapping[str, Effect], ratio: float) -> int:
    """Add slipped teeth to an unfitted baseline model; returns the number of effects added.

    They would ruin every fit, and evidence by run cannot show them, as they occur in one run.
    """
    effect = jumping_effect(effects)
    if effect is None or any(term.effect.steps for term in base.terms):
        return 0
    values = slipped_teeth(base, effect, start_values(effect, given_values(base, ratio)))
    if values is None:
        return 0
    if base.hysteresis.unfitted:
        base.begin_from(base.measured - at_base(effect, values, base, base.at()))
    base.terms.append(Term(effect, values, effect.free()))
    return 1


def conclude(
    selection: Selection,
    stepwise: StepwiseFit,
    events: list[Event],
    effects: Mapping[str, Effect],
    slipped: int = 0,
) -> Diagnosis:
    """Convert a selection to an answer.

    `put_in_slips` added the last `slipped` effects of the first baseline model.
    """
    steps = selection.steps
    final = selection.settled[-1]
    base = final.base
    c = base.conditions
    # Effects of the drive file are not missing.
    present = [term.effect.name for term in base.terms]
    given = len(selection.settled[0].base.terms) - slipped
    names = present[given:]
    nameless = bool(shapes_of(base) or events)
    within = noise_rms(selection.noise, base)
    found = conclude_rounds(steps, len(selection.settled) - 1, c.runs, present, names, nameless)
    add_unnamed(found, selection, within)
    models = list(stepwise.models)
    if shapes_of(base):
        models.append(without_deviations(base, models[-1], final.alike))
    if slipped:
        models.insert(0, without_slips(models[0], given))

    def yardsticks() -> tuple[float, float]:
        if shapes_of(base):
            return noise_floor(final, within), within
        return stepwise.floor_arcsec, stepwise.within_arcsec

    (floor, within_told), rungs = both(yardsticks, lambda: make_rungs(models, selection.left_out))
    ladder = make_ladder(rungs, found)
    harmful = {rung["effect"]: rung["harms"] for rung in ladder if rung.get("harms")}
    slips = range(given, given + slipped)
    told = [event.told(c.labels) for event in events]
    depends = [*found.depends_on, *(dependence(event, c.rows) for event in told)]
    last_step = steps[-1]
    sizes, unreachable = detectable(last_step.round, within)
    return Diagnosis(
        found.verdict,
        found.shown,
        floor,
        ladder,
        [
            *(of_slip(final, place, ladder[1], selection.steps[-1]) for place in slips),
            *list_candidates(selection, effects, found.rivals, ladder, stepwise),
        ],
        [*(slip for place in slips for slip in told_slips(base, place, within)), *told],
        sizes,
        {"share": found.share(ladder[slipped]["rms_arcsec"]), "depends_on": depends},
        advise(
            found, effects, last_step.round, c.runs, estimated_at_bound(stepwise.model), harmful
        ),
        {
            "noise": {
                "within_runs_arcsec": within_told,
                "scatter": {
                    name: float(value)
                    for name, value in zip(
                        (*DEVIATIONS, "offset_arcsec"), scatter_of(final.contest), strict=True
                    )
                },
            },
            "friction": friction_form(base),
            "runs": c.runs,
            "samples": c.rows,
            "not_testable": dict(sorted(steps[0].round.closed.items())),
            "not_detectable": unreachable,
            "left_over": weak_leftovers(last_step),
            "data_fingerprint": c.campaign.fingerprint(),
        },
        base,
        selection,
        models,
    )


def add_unnamed(found: Conclusion, selection: Selection, within: float) -> None:
    """Add outlier runs and the form error to a conclusion, if they are large enough.

    With an effect found, or one that differs between runs, outlier runs may be due to the inexact
    form of that effect.
    """
    final, base = selection.settled[-1], selection.settled[-1].base
    if found.verdict == "complete" and not any(t.effect.needs & RUN_NEEDS for t in base.terms):
        outliers = find_outlier_runs(final.contest, level_of_answer(selection.steps[-1].round))
        if outliers is not None:
            least, labels = least_size(within, selection.given_arcsec), base.conditions.labels
            found.add_outlier_runs(outliers, size_of_outlier_runs(base, outliers), least, labels)
    chosen = [step.selected.size for step in selection.steps[:-1] if step.selected]
    error = form_error_told(final, within, max([selection.given_arcsec, *chosen]))
    if base.form_error and error:
        found.add_form_error(error, base.form_error.p)


def estimated_at_bound(base: BaselineModel) -> dict[str, list[str]]:
    """Estimated values that are limited by a bound, by effect."""
    return {
        term.effect.name: term.effect.stopped_at_bound(term.values, term.free)
        for term in base.terms
    }


def size_of_outlier_runs(base: BaselineModel, outliers: OutlierRuns) -> float:
    """Root mean square over all samples, arc seconds, of the deviations of outlier runs."""
    columns = base.run_columns(base.at())[:, outliers.place]
    slices = base.conditions.slices()
    total = 0.0
    for run, deviation in zip(outliers.runs, outliers.deviations, strict=True):
        column = columns[slices[run]]
        total += float(np.sum((column - column.mean()) ** 2)) * deviation**2
    return float(np.sqrt(total / base.conditions.rows))


def without_slips(base: BaselineModel, place: int) -> BaselineModel:
    """Refit a baseline model without slipped teeth."""
    plain = base.copy()
    del plain.terms[place]
    plain.fit(steps=REFIT_STEPS)
    return plain
