"""The diagnosis: which effect is missing, which cannot be told apart, and what is left."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import special
from scipy.optimize import brentq

from lostmotion.backbone import Backbone
from lostmotion.discover.base import DEVIATIONS, Additive, Base, Term, start_values
from lostmotion.discover.candidates import KINDS, NO_COLUMN
from lostmotion.discover.conditions import Conditions
from lostmotion.discover.contest import Contest, without_scatter
from lostmotion.discover.drive_base import make_base, require_samples
from lostmotion.discover.effects import Effect, library
from lostmotion.discover.events import (
    EVENT_NAME,
    Event,
    dependence,
    find_events,
    lost_counts,
    with_steps,
)
from lostmotion.discover.held_out import held_out_rms
from lostmotion.discover.judging import (
    P_LIMIT,
    accepted,
    count_tests,
    family_p,
    large_enough,
    paid_by_kind,
    size_of,
)
from lostmotion.discover.odd_runs import RUN_NEEDS, OddRuns, find_odd_runs
from lostmotion.discover.refits import term_of, without_deviations
from lostmotion.discover.selection import SIZE_LEAST, Selection, Step, least_size, select
from lostmotion.discover.slipped_teeth import RATCHETING, slipped_teeth, slips_of
from lostmotion.discover.study import (
    Field,
    Settled,
    clean_outliers,
    contest_of_term,
    noise_rms,
    swing_by_run,
    term_size,
)
from lostmotion.discover.tangents import at_base, given_values
from lostmotion.discover.threads import one_thread
from lostmotion.drives import Drive
from lostmotion.errors import InputError, given_as
from lostmotion.model import make_backbone
from lostmotion.recordings import Campaign
from lostmotion.units import ARCSEC, split_unit

FloatArray = npt.NDArray[np.float64]

RUNS_LEAST = 6
"""With fewer runs the smallest p of sign flips is above 0.05: no names."""

POWER = 0.8
"""Chance with which the smallest detectable size would be found."""

TWIN_DEG = 10.0
"""Effects within this angle look alike with this plan."""

REFIT_STEPS = 8
"""Evaluations of a refit from where a fit stands already."""

IMPLAUSIBLE = 100.0
"""A value this many times the typical one is marked."""

PIECES = 12
"""Pieces of work that a diagnosis usually has, for a progress bar."""

ASK_WHAT_DIFFERED = (
    "Find out what was different in these runs (temperature, cycles, mounting), record it as a "
    "column, and diagnose again."
)


@dataclass
class Diagnosis:
    """The answer of `diagnose`; `answer` gives it ready for JSON."""

    verdict: str
    effects: list[str]
    noise_floor_arcsec: float
    ladder: list[dict[str, Any]]
    candidates: list[dict[str, Any]]
    events: list[dict[str, Any]]
    smallest_detectable: dict[str, Any]
    unexplained: dict[str, Any]
    next_experiment: str
    details: dict[str, Any] = field(default_factory=dict)
    base: Base | None = None
    selection: Selection | None = None
    models: list[Base] = field(default_factory=list)
    """The base and the model after each term, fitted for all runs together: the ladder's."""

    def __repr__(self) -> str:
        """Say what came out; what it was found with fills screens."""
        names = f" {', '.join(self.effects)}" if self.effects else ""
        first, last = self.ladder[0], self.ladder[-1]
        return (
            f"<Diagnosis: {self.verdict}{names}; held out {first['rms_heldout_arcsec']:.3g} to "
            f"{last['rms_heldout_arcsec']:.3g} arcsec, noise floor {self.noise_floor_arcsec:.3g}>"
        )

    def answer(self) -> dict[str, Any]:
        """Return the answer, ready for JSON."""
        return {
            "schema": "lostmotion.diagnosis/1",
            "verdict": self.verdict,
            "noise_floor_arcsec": self.noise_floor_arcsec,
            "effects": self.effects,
            "ladder": self.ladder,
            "candidates": self.candidates,
            "events": self.events,
            "smallest_detectable": self.smallest_detectable,
            "unexplained": self.unexplained,
            "next_experiment": self.next_experiment,
            **self.details,
        }


def count_pieces(tick: Callable[[int, int], None]) -> Callable[[str], None]:
    """Make a progress bar's ``tick(done, of)`` what `diagnose` calls with each piece of work."""
    done = 0

    def piece(_: str) -> None:
        nonlocal done
        done = min(done + 1, PIECES - 1)
        tick(done, PIECES)

    return piece


@one_thread()
def diagnose(
    campaign: Campaign,
    drive: Drive | None = None,
    *,
    ratio: float | None = None,
    rated_torque_Nm: float | None = None,
    backbone: Backbone | None = None,
    effects: Mapping[str, Effect] | None = None,
    base: Base | None = None,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Find the effects that a campaign's recordings show and the base lacks.

    Parameters
    ----------
    campaign : Campaign
        Runs in the order in which they were made.
    drive : Drive, optional
        The drive; what follows need not be given then, and what its file says of a fit and of
        effects is in the model.
    ratio, rated_torque_Nm : float, optional
        Of the drive.
    backbone : Backbone, optional
        What the drive file says of the characteristic: the start and a weak prior.
    effects : mapping, optional
        The effects that may be missing; by default those of the library.
    base : Base, optional
        A base made elsewhere, with terms in it already (of a fitted drive file).
    progress : callable, optional
        Called with the name of each piece of work when it is done.

    Returns
    -------
    Diagnosis
    """
    given_as("diagnose", "campaign", campaign, Campaign)
    require_samples(campaign)
    chosen_from = dict(library() if effects is None else effects)
    if drive is not None:
        given_as("diagnose", "drive", drive, Drive)
        ratio = drive.ratio if ratio is None else ratio
        rated_torque_Nm = drive.rated_torque_Nm
        if backbone is None:
            backbone = make_backbone(drive, campaign.largest_torque_Nm)
        base = base or make_base(drive, campaign, backbone, chosen_from)
    if ratio is None or rated_torque_Nm is None:
        expected = "a Drive, or ratio= and rated_torque_Nm="
        raise InputError("diagnose", "drive", "nothing", expected)
    base = base or Base(Conditions(campaign), rated_torque_Nm, backbone)
    return _diagnose(base, chosen_from, ratio, progress)


def _diagnose(
    base: Base,
    chosen_from: dict[str, Effect],
    ratio: float,
    progress: Callable[[str], None] | None,
) -> Diagnosis:
    slipped = put_in_slips(base, chosen_from, ratio)
    events = lost_counts(base, ratio)
    base = with_steps(base, events)
    base.first_fit()
    outliers = clean_outliers(base)
    if outliers:
        base.fit(steps=REFIT_STEPS)
    if progress is not None:
        progress("base")
    selection = select(base, chosen_from, ratio, progress=progress)
    found = new_events(selection, base, events)
    if found:
        events += found
        again = with_steps(base, found)
        again.fit(steps=REFIT_STEPS)
        selection = select(again, chosen_from, ratio, progress=progress)
        events += new_events(selection, base, events)
    diagnosis = conclude(selection, events, chosen_from, ratio, slipped)
    diagnosis.details["outliers"] = outliers
    return diagnosis


def new_events(selection: Selection, base: Base, known: list[Event]) -> list[Event]:
    """Find events that are not known yet beside what was selected."""
    noise = selection.noise
    found = find_events(selection.settled[-1].base, noise, noise_rms(noise, base))
    return [event for event in found if all(event.row != other.row for other in known)]


def put_in_slips(base: Base, effects: Mapping[str, Effect], ratio: float) -> int:
    """Put teeth that slipped into a base before it is fitted; returns how many effects that took.

    They would spoil every fit, and no unit of evidence shows them: they stand in one run.
    """
    effect = effects.get(RATCHETING)
    if effect is None or any(term.effect.name == RATCHETING for term in base.terms):
        return 0
    values = slipped_teeth(base, effect, start_values(effect, given_values(base, ratio)))
    if values is None:
        return 0
    if base.fresh:
        base.begin_from(base.measured - at_base(effect, values, base, base.at()))
    base.terms.append(Term(effect, values, effect.free()))
    return 1


def conclude(
    selection: Selection,
    events: list[Event],
    effects: Mapping[str, Effect],
    ratio: float,
    slipped: int = 0,
) -> Diagnosis:
    """Turn a selection into an answer.

    The last `slipped` effects that the base had at the start were put in by `put_in_slips`.
    """
    steps = selection.steps
    final = selection.settled[-1]
    base = final.base
    c = base.conditions
    found = [step for step in steps if step.chosen is not None]
    # Only what was taken into the model counts; a last round that hit the limit is left over.
    taken = found[: len(selection.settled) - 1]
    left_over = steps[-1:] if steps[-1].chosen is not None and len(taken) < len(found) else []
    # What the drive file brought along is not missing.
    present = [term.effect.name for term in base.terms]
    given = len(selection.settled[0].base.terms) - slipped
    names = present[given:]
    nameless = bool(shapes_of(base) or events)
    within = noise_rms(selection.noise, base)
    models = for_all_runs(selection)
    if slipped:
        models.insert(0, without_slips(models[0], given))
    ladder = make_ladder(models)
    floor = noise_floor(final, within, ladder[-1]["rms_heldout_arcsec"])
    rivals = sorted({name for step in taken for name in step.rivals if name not in present})
    depends = [what for step in (*taken, *left_over) for what in describe(step)]
    verdict, shown = decide(c.runs, names, rivals, nameless)
    # Beside an effect that was found, or one that differs between runs, it may be what the form
    # of that does not meet.
    meets = verdict == "complete" and not any(t.effect.needs & RUN_NEEDS for t in base.terms)
    odd = find_odd_runs(final.contest, swing_by_run(base, base.at())) if meets else None
    odd_size = 0.0 if odd is None else size_of_odd(base, odd)
    if odd is not None and odd_size >= least_size(within, selection.given_arcsec):
        verdict = "unexplained"
        depends.append(odd.told(c.labels, odd_size))
    else:
        odd, odd_size = None, 0.0
    slips = range(given, given + slipped)
    before = ladder[slipped]["rms_arcsec"] ** 2
    unnamed = sum(
        s.chosen.size**2 for s in taken if s.chosen is not None and not s.chosen.candidate.named
    )
    unnamed += odd_size**2
    share = float(np.clip(unnamed / before, 0.0, 1.0)) if before > 0 else 0.0
    told = [event.told(c.labels) for event in events]
    depends += [dependence(event, c.rows) for event in told]
    last_step = steps[-1]
    return Diagnosis(
        verdict,
        shown,
        floor,
        ladder,
        [
            *(of_slip(final, place, ladder[1], selection.steps[-1]) for place in slips),
            *list_candidates(selection, effects, rivals, ladder),
        ],
        [*(slip for place in slips for slip in told_slips(base, place, within)), *told],
        detectable(last_step.field, within, last_step.field.form_arcsec),
        {"share": share, "depends_on": depends},
        advise(verdict, names, rivals, effects, last_step.field, c.runs, odd),
        {
            "noise": {
                "within_runs_arcsec": within,
                "scatter": {
                    name: float(value)
                    for name, value in zip(
                        (*DEVIATIONS, "offset_arcsec"), scatter_of(final.contest), strict=True
                    )
                },
            },
            "runs": c.runs,
            "samples": c.rows,
            "not_testable": dict(sorted(steps[0].field.closed.items())),
            "left_over": weak_leftovers(last_step),
            "data_fingerprint": c.campaign.fingerprint(),
        },
        base,
        selection,
        models,
    )


def decide(runs: int, names: list[str], rivals: list[str], nameless: bool) -> tuple[str, list[str]]:
    """Decide the verdict, and the effects that it shows.

    Parameters
    ----------
    runs : int
        Runs that were judged.
    names, rivals : list of str
        Effects that were found, and those that do as well as one of them.
    nameless : bool
        Whether a shape or an event without a name was found, too.
    """
    if runs < RUNS_LEAST:
        return ("unexplained" if names or nameless else "complete"), []
    if nameless:
        return "unexplained", names
    if names and rivals:
        return "ambiguous", names + rivals
    return ("missing-effect" if names else "complete"), names


def shapes_of(base: Base) -> list[Additive]:
    """Shapes without a name in a base, events left out."""
    return [added for added in base.additives if not added.name.startswith(EVENT_NAME)]


def count_runs(runs: int) -> str:
    """Say how many runs there are."""
    return "1 run" if runs == 1 else f"{runs} runs"


def size_of_odd(base: Base, odd: OddRuns) -> float:
    """Root mean square over all samples, arc seconds, of what odd runs do."""
    columns = base.run_columns(base.at())[:, odd.place]
    slices = base.conditions.slices()
    total = 0.0
    for run, deviation in zip(odd.runs, odd.deviations, strict=True):
        column = columns[slices[run]]
        total += float(np.sum((column - column.mean()) ** 2)) * deviation**2
    return float(np.sqrt(total / base.conditions.rows))


def scatter_of(contest: Contest) -> FloatArray:
    """Standard deviations of stiffness, friction (relative), gap and offset (arc seconds)."""
    e = contest.evidence
    return np.asarray(np.sqrt(contest.null_omega) / e.scale[e.scatter])


def noise_floor(settled: Settled, within: float, held_out: float) -> float:
    """Noise within runs and scatter between them, as one rms in arc seconds.

    Every run counts with the deviations that it has, not with those that its like might have: one
    odd run may have little that they act on. What a fit leaves of runs that it has not seen holds
    both, so the floor is not above it: deviations that only make up for an effect whose form is not
    exactly right are no scatter.

    Parameters
    ----------
    settled : Settled
        The model at the deviations of the runs.
    within, held_out : float
        Noise within runs, and the held-out error of the model.
    """
    base = settled.base
    scatter = base.run_columns(base.at())[:, : len(DEVIATIONS)]
    total = 0.0
    for at, moment in zip(base.conditions.slices(), second_moments(settled.contest), strict=True):
        columns = scatter[at] - scatter[at].mean(axis=0)
        total += float(np.sum((columns @ moment[: len(DEVIATIONS), : len(DEVIATIONS)]) * columns))
    return min(float(np.sqrt(within**2 + total / base.conditions.rows)), held_out)


def second_moments(contest: Contest) -> FloatArray:
    """Expected squares and products of every run's deviations, given its recordings."""
    e = contest.evidence
    index, omega = e.index(), contest.null_omega
    delta, _ = contest.solve(contest.null.matrix.sum(axis=0), index)
    own = contest.deviations(index, omega, delta)
    gram = e.gram[:, e.scatter[:, None], e.scatter]
    left = omega[:, None] * without_scatter(gram, omega, np.eye(omega.size))[0]
    scale = e.scale[e.scatter]
    moment = own[:, :, None] * own[:, None, :] + left
    return np.asarray(moment / np.outer(scale, scale))


def for_all_runs(selection: Selection) -> list[Base]:
    """Refit the base, and the model after each term, for all runs together."""
    models: list[Base] = []
    for settled in selection.settled:
        models.append(without_deviations(settled.base, models[-1] if models else None))
    return models


def without_slips(base: Base, place: int) -> Base:
    """Refit a base without the teeth that slipped."""
    plain = base.copy()
    del plain.terms[place]
    plain.fit(steps=REFIT_STEPS)
    return plain


def of_slip(settled: Settled, place: int, rung: Mapping[str, Any], step: Step) -> dict[str, Any]:
    """Make the entry of teeth that slipped among the candidates."""
    term = settled.base.terms[place]
    contest, name = contest_of_term(settled, place)
    result = contest.test(name)
    paid = paid_by_kind(step.field)["effect"]
    values = {v.name: float(x) for v, x in zip(term.effect.values, term.values, strict=True)}
    return {
        "name": name,
        "heldout_rms_arcsec": rung["rms_heldout_arcsec"],
        "evidence": 0.0 if result is None else result.gain,
        "parameters": values,
        "at_bound": [],
        "not_fitted": not_fitted(term.effect),
        "confused_with": [],
        "plausible": plausible(term.effect, term.values),
        "testable": True,
        "p": 1.0 if result is None else min(1.0, result.p * paid),
        "size_arcsec": term_size(settled.base, place),
    }


def told_slips(base: Base, place: int, within: float) -> list[dict[str, Any]]:
    """Say in which runs and at which moments teeth slipped."""
    c, term = base.conditions, base.terms[place]
    found = []
    for row, size_rad in slips_of(c, term.effect, term.values).items():
        size, run = size_rad / ARCSEC, int(c.run_of[row])
        event = Event(run, row, float(c.time_s[row]), size, abs(size) / within)
        found.append({**event.told(c.labels), "teeth": 1 if size > 0 else -1})
    return found


def make_ladder(models: list[Base]) -> list[dict[str, Any]]:
    """Fitted and held-out error of the base and after each term."""
    rungs = []
    for base in models:
        rungs.append(
            {
                "effects": [t.effect.name for t in base.terms]
                + [shape.name for shape in shapes_of(base)],
                "rms_arcsec": float(np.sqrt(np.mean(base.residual() ** 2))),
                "rms_heldout_arcsec": held_out_rms(base),
            }
        )
    return rungs


def describe(step: Step) -> list[dict[str, Any]]:
    """Say on what a shape without a name hangs; on several things, where they look alike."""
    assert step.chosen is not None
    candidate, result = step.chosen.candidate, step.chosen.result
    if candidate.named:
        return []
    return [
        {
            "covariate": covariate,
            "shape": shape,
            "p": family_p(step.field, candidate, result),
            "rms_arcsec": step.chosen.size,
        }
        for covariate, shape in ((candidate.covariate, candidate.shape), *candidate.also)
    ]


def weak_leftovers(step: Step) -> list[dict[str, Any]]:
    """What passes the gates but is too small to count."""
    paid = paid_by_kind(step.field)
    out = []
    for result in step.results[:10]:
        candidate = step.field.candidates[result.name]
        if accepted(result, paid[candidate.kind]):
            out.append(
                {
                    "covariate": candidate.covariate or candidate.name,
                    "shape": candidate.shape or "the effect's own",
                    "gain_nats": result.gain,
                }
            )
    return out


def list_candidates(
    selection: Selection,
    effects: Mapping[str, Effect],
    rivals: list[str],
    ladder: list[dict[str, Any]],
) -> list[dict[str, Any]]:
    """List every effect: strongest first, then those that are not testable."""
    out: list[dict[str, Any]] = []
    final = selection.settled[-1].base
    present = {term.effect.name: term for term in final.terms}
    first = selection.steps[0]
    shown: set[str] = set()
    for number, step in enumerate(selection.steps):
        if step.chosen is not None and step.chosen.result.name in present:
            name = step.chosen.result.name
            if name in shown:
                continue
            shown.add(name)
            term = present[name]
            rung = next(r for r in ladder[number + 1 :] if name in r["effects"])
            values = {
                v.name: float(x) for v, x in zip(term.effect.values, term.values, strict=True)
            }
            out.append(
                {
                    "name": name,
                    "heldout_rms_arcsec": rung["rms_heldout_arcsec"],
                    "evidence": step.chosen.gain,
                    "parameters": values,
                    "at_bound": term.effect.at_bound(term.values),
                    "not_fitted": not_fitted(term.effect),
                    "confused_with": sorted(step.rivals),
                    "plausible": plausible(term.effect, term.values),
                    "testable": True,
                    "p": family_p(step.field, step.chosen.candidate, step.chosen.result),
                    "size_arcsec": step.chosen.size,
                }
            )
    stage = selection.steps[-1]
    judged = {r.name: (r, stage) for r in stage.results}
    for result in first.results:
        # A rival of a chosen effect is judged where it competed.
        if result.name in rivals:
            judged[result.name] = (result, first)
    order = sorted(judged.values(), key=lambda pair: (-pair[0].gain, pair[0].name))
    held = ladder[-1]["rms_heldout_arcsec"]
    for result, where in order:
        candidate = where.field.candidates[result.name]
        if not candidate.named or result.name in shown:
            continue
        shown.add(result.name)
        effect = candidate.effect
        assert effect is not None
        values_array = term_of(where.field, result).values
        fitted = [c.size for c in where.contenders if c.result.name == result.name]
        size = fitted[0] if fitted else size_of(where.field, result)
        stands_out = accepted(result, paid_by_kind(where.field)["effect"])
        large = large_enough(where.field, result, size, where.least_arcsec)
        out.append(
            {
                "name": result.name,
                "heldout_rms_arcsec": held,
                "evidence": result.gain,
                "parameters": {
                    v.name: float(x) for v, x in zip(effect.values, values_array, strict=True)
                },
                "at_bound": effect.at_bound(values_array),
                "not_fitted": not_fitted(effect),
                "confused_with": sorted(present) if result.name in rivals else [],
                "plausible": plausible(effect, values_array),
                "testable": True,
                "p": family_p(where.field, candidate, result),
                "size_arcsec": size,
                "too_small": stands_out and not large,
            }
        )
    closed = {**selection.steps[0].field.closed, **stage.field.closed}
    for name in effects:
        if name not in shown and (name != RATCHETING or name not in present):
            out.append(
                {
                    "name": name,
                    "heldout_rms_arcsec": None,
                    "evidence": 0.0,
                    "parameters": {},
                    "confused_with": list(effects[name].confused_with),
                    "plausible": True,
                    "testable": False,
                    "reason": closed.get(name, "not visible with this plan"),
                }
            )
    return out


def not_fitted(effect: Effect) -> list[str]:
    """Names of the values that a fit leaves as they are, but for those that are given."""
    free = effect.free()
    return [v.name for i, v in enumerate(effect.values) if v.role != "given" and i not in free]


def plausible(effect: Effect, values: FloatArray) -> bool:
    """Whether the values are such as drives have: within bounds, and not far beyond typical."""
    if effect.against_its_name(values) is not None:
        return False
    for value, x in zip(effect.values, values, strict=True):
        if value.role == "given":
            continue
        at_bound = value.role == "linear" and (x <= value.low or x >= value.high)
        far = value.role == "linear" and value.typical and abs(x) > IMPLAUSIBLE * abs(value.typical)
        if at_bound or far:
            return False
    return True


def detectable(stage: Field, within: float, form: float = 0.0) -> dict[str, Any]:
    """Smallest size of each effect that would be found with probability `POWER`.

    Parameters
    ----------
    within, form : float
        Noise within runs, and what the form of the base is wrong by, arc seconds.
    """
    out: dict[str, Any] = {}
    contest = stage.contest
    count = len(KINDS) * count_tests(stage)["effect"]  # as in a diagnosis, also where none is held
    for name, candidate in stage.candidates.items():
        if not candidate.named or candidate.effect is None:
            continue
        block = f"{name}#0" if f"{name}#0" in contest.evidence.blocks else name
        information = contest.projected([block])
        scale = contest.evidence.scale[contest.evidence.blocks[block]]
        rank = information.shape[0]
        needed = noncentrality(rank, max(contest.runs - 2 - rank, 1), P_LIMIT / count)
        info = float(np.mean(np.diag(information)))
        if not info > 1e-12:
            continue
        amplitude = math.sqrt(needed / info)
        columns = candidate.columns[:, : min(rank, candidate.columns.shape[1])]
        rms = amplitude * float(
            np.mean(np.sqrt(np.mean(columns**2, axis=0)) / scale[: columns.shape[1]])
        )
        least = SIZE_LEAST * within
        if candidate.hangs_on_load_alone:
            least = max(least, form)
        if rms < least:
            amplitude *= least / max(rms, 1e-300)
            rms = least
        places = candidate.effect.indices("linear") or candidate.effect.indices("shape")
        value = candidate.effect.values[places[0]]
        size = amplitude / float(np.mean(scale))
        parameter, unit = split_unit(value.name)
        if not candidate.effect.free():  # what slips by a tooth has the size of a tooth
            parameter, unit = "teeth", None
        symbol = unit.symbol if unit is not None else "-"
        if symbol.startswith("rad"):
            size, symbol = size / ARCSEC, "arcsec" + symbol.removeprefix("rad")
        out[name] = {
            "value": size,
            "unit": symbol.replace("_", " "),
            "parameter": parameter,
            "rms_arcsec": rms,
        }
    return out


def noncentrality(rank: int, freedom: int, alpha: float) -> float:
    """Noncentrality at which the F test at level alpha has the wanted power."""
    limit = float(special.fdtri(rank, freedom, 1.0 - alpha))

    def lacking(log_size: float) -> float:
        power = 1.0 - special.ncfdtr(rank, freedom, math.exp(log_size), limit)
        return float(power) - POWER

    low, high = math.log(1e-2), math.log(1e-1)
    while lacking(high) < 0 and high < 20:
        high += 1.0
    return math.exp(brentq(lacking, low, high, xtol=1e-3)) if lacking(low) < 0 else 1e-2


def advise(
    verdict: str,
    names: list[str],
    rivals: list[str],
    effects: Mapping[str, Effect],
    stage: Field,
    runs: int,
    odd: OddRuns | None,
) -> str:
    """Say what to do next."""
    if runs < RUNS_LEAST:
        return (
            f"{count_runs(runs)} cannot carry a name: repeat the plan, {RUNS_LEAST} runs or more."
        )
    if odd is not None:
        return ASK_WHAT_DIFFERED
    if verdict == "ambiguous":
        first = [effects[name].experiment for name in (*names, *rivals) if effects[name].experiment]
        pair = " and ".join((*names[:1], *rivals))
        return f"To tell {pair} apart: " + "; ".join(dict.fromkeys(first)) + "."
    if verdict == "unexplained":
        return (
            "Repeat runs in which what it depends on is changed alone, "
            "and look at the rig: no effect of the library does this."
        )
    what = "Nothing is left above the noise."
    if names:
        add = " ".join(f"--add {name}" for name in names)
        it = "it" if len(names) == 1 else "them"
        what = f"Add {it}: fit {add}. Nothing else is left above the noise."
    blind = sorted(name for name, why in stage.closed.items() if why.startswith("not visible"))
    if blind:
        what += f" This plan could not have shown: {', '.join(blind)}."
    lacking = sorted(name for name, why in stage.closed.items() if NO_COLUMN in why)
    if lacking:
        what += f" Without their columns nothing is known of: {', '.join(lacking)}."
    return what
