"""The answer of a diagnosis: its parts, for JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from lostmotion.arrays import FloatArray
from lostmotion.candidates.slipped_teeth import slips_of
from lostmotion.discover.choice import Step
from lostmotion.discover.conclusion import Conclusion
from lostmotion.discover.events import (
    EVENT_NAME,
    Event,
)
from lostmotion.discover.gates import (
    accepted,
    corrected_for,
    count_answers,
    family_p,
    large_enough,
)
from lostmotion.discover.ladder import Rung, told
from lostmotion.discover.linearise import Settled
from lostmotion.discover.recorded_model import Selection
from lostmotion.discover.refits import term_of
from lostmotion.discover.stepwise_fit import StepwiseFit
from lostmotion.discover.terms import contest_of_term, term_size
from lostmotion.discover.whitened_result import WhitenedResult
from lostmotion.effects.effect import Effect
from lostmotion.errors import InputError
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.drive_file import SAMPLES_LEAST
from lostmotion.fit.terms import Additive
from lostmotion.results import figures
from lostmotion.units import ARCSEC

IMPLAUSIBLE = 100.0
"""A value this many times the typical one is marked: two powers of ten."""


@dataclass
class Diagnosis(WhitenedResult):
    """The result of `diagnose`; `answer` returns it for JSON."""

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
    base: BaselineModel | None = None
    selection: Selection | None = None
    models: list[BaselineModel] = field(default_factory=list)
    """The baseline model and the model after each term, fitted for all runs together.

    The steps of the ladder.
    """

    def need_selection(self, option: str = "") -> Selection:
        """Return the test of the effects, which an option may need.

        Raises
        ------
        InputError
            If there were too few readings for one.
        """
        if self.selection is None:
            raise InputError(
                "recordings",
                option,
                f"{self.details['samples']} readings, too few to test an effect",
                f"a log of {SAMPLES_LEAST} samples or more",
            )
        return self.selection

    def __repr__(self) -> str:
        """Summarise the result without the underlying data."""
        names = f" {', '.join(self.effects)}" if self.effects else ""
        first, last = self.ladder[0], self.ladder[-1]
        return (
            f"<Diagnosis: {self.verdict}{names}; cross-validated "
            f"{first['rms_heldout_arcsec']:.3g} to "
            f"{last['rms_heldout_arcsec']:.3g} arcsec, noise floor {self.noise_floor_arcsec:.3g}>"
        )

    def fitted_base(self) -> BaselineModel:
        """Return the model with all effects found, fitted to all runs together."""
        if not self.models:
            raise InputError(
                "diagnosis", "", "no model: it was made from saved evidence", "recordings"
            )
        return self.models[-1]

    def errors_by_name(self) -> dict[str, float]:
        """Standard errors of the values of the effects found, by name."""
        return {
            f"{candidate['name']}.{name}": error
            for candidate in self.candidates
            if candidate["name"] in self.effects
            for name, error in candidate.get("standard_errors", {}).items()
        }

    def plot_ladder(self) -> Any:
        """Plot the error after each effect (Plotly figure)."""
        return figures.ladder_of(self.ladder, self.noise_floor_arcsec)

    def answer(self) -> dict[str, Any]:
        """Return the answer for JSON."""
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


def shapes_of(base: BaselineModel) -> list[Additive]:
    """Unnamed shapes in a baseline model, without events."""
    return [added for added in base.additives if not added.name.startswith(EVENT_NAME)]


def of_slip(settled: Settled, place: int, rung: Mapping[str, Any], step: Step) -> dict[str, Any]:
    """Make the candidate entry of slipped teeth."""
    term = settled.base.terms[place]
    contest, name = contest_of_term(settled, place)
    result = contest.test(name)
    paid = count_answers(step.round)  # one start
    gain, p = (0.0, 1.0) if result is None else (result.gain, min(1.0, result.p * paid))
    held, size = rung["rms_heldout_arcsec"], term_size(settled.base, place)
    return entry(term.effect, term.values, held, gain, p, [], size)


def told_slips(base: BaselineModel, place: int, within: float) -> list[dict[str, Any]]:
    """List runs and times at which teeth slipped."""
    c, term = base.conditions, base.terms[place]
    found = []
    for row, size_rad in slips_of(c, term.effect, term.values).items():
        size, run = size_rad / ARCSEC, int(c.run_of[row])
        event = Event(run, row, float(c.time_s[row]), size, abs(size) / within)
        found.append({**event.told(c.labels), "teeth": 1 if size > 0 else -1})
    return found


def make_ladder(rungs: Sequence[Rung], found: Conclusion) -> list[dict[str, Any]]:
    """Errors of the baseline model and after each term, with the verdict on each effect."""
    ladder = told(
        rungs,
        [
            [t.effect.name for t in base.terms] + [shape.name for shape in shapes_of(base)]
            for base in (rung.model for rung in rungs)
        ],
    )
    for before, rung in pairwise(ladder):
        new = [name for name in rung["effects"] if name not in before["effects"]]
        if new:
            rung |= {"effect": new[0], **found.by_effect.get(new[0], {})}
    return ladder


def weak_leftovers(step: Step) -> list[dict[str, Any]]:
    """Effects that pass the gates but are too small to count."""
    out = []
    for result in step.results[:10]:
        candidate = step.round.candidates[result.name]
        if accepted(result, corrected_for(step.round, candidate)):
            out.append(
                {
                    "covariate": candidate.covariate or candidate.name,
                    "shape": candidate.shape or "the effect's own",
                    "gain_nats": result.gain,
                }
            )
    return out


def entry(
    effect: Effect,
    values: FloatArray,
    heldout_rms_arcsec: float,
    gain: float,
    p: float,
    confused_with: Sequence[str],
    size_arcsec: float,
) -> dict[str, Any]:
    """Make the entry of an effect among the candidates.

    Parameters
    ----------
    effect : Effect
    values : ndarray
    heldout_rms_arcsec : float
        Leave-one-run-out error of the model with it, or of the last model.
    gain : float
        Leave-one-run-out gain, nats.
    p : float
        Over all answers.
    confused_with : sequence of str
    size_arcsec : float
    """
    return {
        "name": effect.name,
        "heldout_rms_arcsec": heldout_rms_arcsec,
        "evidence": gain,
        "parameters": {v.name: float(x) for v, x in zip(effect.values, values, strict=True)},
        "at_bound": effect.at_bound(values),
        "not_fitted": not_fitted(effect),
        "confused_with": sorted(confused_with),
        "plausible": plausible(effect, values),
        "testable": True,
        "p": p,
        "size_arcsec": size_arcsec,
    }


def list_candidates(
    selection: Selection,
    effects: Mapping[str, Effect],
    rivals: list[str],
    ladder: list[dict[str, Any]],
    stepwise: StepwiseFit,
) -> list[dict[str, Any]]:
    """List every effect: strongest first, then those that are not testable.

    The values of the effects found are those of the stepwise fit, as printed by `fit`.
    """
    out: list[dict[str, Any]] = []
    present = {term.effect.name: term for term in stepwise.model.terms}
    first = selection.steps[0]
    shown: set[str] = set()
    for step in selection.steps:
        if step.selected is not None and step.selected.result.name in present:
            name = step.selected.result.name
            if name in shown:
                continue
            shown.add(name)
            term = present[name]
            rung = next(r for r in ladder if name in r["effects"])
            made = entry(
                term.effect,
                term.values,
                rung["rms_heldout_arcsec"],
                step.selected.gain,
                family_p(step.round, step.selected.candidate, step.selected.tested),
                step.rivals,
                step.selected.size,
            )
            out.append({**made, "standard_errors": stepwise.table.error_of(term.effect)})
    last = selection.steps[-1]
    judged = {r.name: (r, last) for r in last.results}
    for result in first.results:
        # A rival of a chosen effect is judged in the round in which it competed.
        if result.name in rivals:
            judged[result.name] = (result, first)
    order = sorted(judged.values(), key=lambda pair: (-pair[0].gain, pair[0].name))
    held = ladder[-1]["rms_heldout_arcsec"]
    for result, where in order:
        candidate = where.round.candidates[result.name]
        if not candidate.named or result.name in shown:
            continue
        shown.add(result.name)
        effect = candidate.effect
        assert effect is not None
        values_array = term_of(where.round, result).values
        fitted = [c.size for c in where.contenders if c.result.name == result.name]
        size = fitted[0] if fitted else where.round.size_of(result)
        stands_out = accepted(result, corrected_for(where.round, candidate))
        large = large_enough(where.round, result, size, where.least_arcsec)
        too_small = stands_out and size < where.least_arcsec
        of_form = candidate.of_form or (stands_out and not large and not too_small)
        confused = sorted(present) if result.name in rivals else []
        p = family_p(where.round, candidate, result)
        made = entry(effect, values_array, held, result.gain, p, confused, size)
        out.append({**made, "too_small": too_small, "of_form": of_form})
    closed = {**selection.steps[0].round.closed, **last.round.closed}
    for name in effects:
        if name not in shown and not (effects[name].steps and name in present):
            out.append(
                {
                    "name": name,
                    "heldout_rms_arcsec": None,
                    "evidence": 0.0,
                    "parameters": {},
                    "confused_with": list(effects[name].confused_with),
                    "plausible": True,
                    "testable": False,
                    "reason": closed.get(name, "not identifiable with this plan"),
                }
            )
    return out


def not_fitted(effect: Effect) -> list[str]:
    """Names of the values that a fit does not change, except those that are given."""
    free = effect.free()
    return [v.name for i, v in enumerate(effect.values) if v.role != "given" and i not in free]


def plausible(effect: Effect, values: FloatArray) -> bool:
    """Whether the values are plausible: within bounds, and not far beyond typical values."""
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
