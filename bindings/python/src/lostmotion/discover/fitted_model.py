"""Fit with effects added: errors from the baseline model to the last effect.

The result is written to the drive file as ``[fit]`` (values, standard errors, covariance, data
fingerprint) and ``[[effect]]`` tables, and read back by `fit.drive_file.restore`.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import numpy as np

from lostmotion import rules
from lostmotion.arrays import FloatArray
from lostmotion.discover.answer import not_fitted
from lostmotion.discover.baseline_fit import fit_baseline, form_beside_effects
from lostmotion.discover.ladder import make_rungs, told
from lostmotion.discover.linearise import Settled
from lostmotion.discover.stepwise_fit import EstimatedValues, fit_stepwise
from lostmotion.discover.terms import contest_of_term
from lostmotion.discover.whitened_result import WhitenedResult
from lostmotion.drives import Drive
from lostmotion.effects.columns import absorbed, constant_columns
from lostmotion.effects.effect import Effect, find_effect
from lostmotion.effects.formula import written_formula
from lostmotion.effects.library import library
from lostmotion.errors import InputError, given_as
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.drive_file import (
    SAMPLES_LEAST,
    effect_table,
    make_base,
    require,
    require_samples,
)
from lostmotion.fit.few_readings import fit_few_readings
from lostmotion.fit.fitted_range import fitted_ranges
from lostmotion.fit.forms import friction_form
from lostmotion.friction import Friction
from lostmotion.hold_against import hold_against
from lostmotion.on_progress import OnProgress
from lostmotion.recordings import Campaign
from lostmotion.results import figures
from lostmotion.rms import rms_of
from lostmotion.threads import one_thread
from lostmotion.torsion_curve import TorsionCurve


@dataclass(frozen=True)
class Significance:
    """Test of an effect of a model beside the others.

    Attributes
    ----------
    p : float
        Of the F test.
    significant : bool
        Whether that is below `rules.P_LIMIT`.
    """

    p: float
    significant: bool


@dataclass
class FittedModel(WhitenedResult):
    """A baseline model with effects, fitted to a campaign.

    Attributes
    ----------
    base : BaselineModel
        Without deviations of single runs.
    ladder : list of dict
        One entry (rung) for the baseline model and one for each effect.
    table : EstimatedValues
        Values in the units of the drive file, with their covariance.
    tested : dict
        Significance of each effect beside the others.
    """

    base: BaselineModel
    ladder: list[dict[str, Any]]
    noise_floor_arcsec: float
    within_runs_arcsec: float
    table: EstimatedValues
    tested: dict[str, Significance] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Names of the values."""
        return self.table.names

    @property
    def values(self) -> FloatArray:
        """Values, in the order of `names`."""
        return self.table.values

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors; 0 for values that were not estimated."""
        return self.table.standard_errors

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the values."""
        return self.table.covariance

    @property
    def inseparable(self) -> list[list[str]]:
        """Pairs of values that these recordings do not separate."""
        return self.table.inseparable

    def __repr__(self) -> str:
        """Summarise the result without the samples."""
        names = ", ".join(term.effect.name for term in self.base.terms)
        first, last = self.ladder[0], self.ladder[-1]
        return (
            f"<FittedModel{' with ' + names if names else ''}: leave-one-run-out "
            f"{first['rms_heldout_arcsec']:.3g} to {last['rms_heldout_arcsec']:.3g} arcsec, "
            f"noise floor {self.noise_floor_arcsec:.3g}>"
        )

    def fitted_base(self) -> BaselineModel:
        """Give the model that was fitted."""
        return self.base

    def errors_by_name(self) -> dict[str, float]:
        """Standard errors by the names of the parameters."""
        return dict(zip(self.names, map(float, self.standard_errors), strict=True))

    def plot_correlations(self) -> Any:
        """Plot the correlations of the estimated parameters (Plotly figure)."""
        estimated = [i for i, error in enumerate(self.standard_errors) if error > 0]
        covariance = self.covariance[np.ix_(estimated, estimated)]
        return figures.correlations([self.names[i] for i in estimated], covariance)

    def plot_ladder(self) -> Any:
        """Plot the error after each effect (Plotly figure)."""
        return figures.ladder_of(self.ladder, self.noise_floor_arcsec)

    def answer(self) -> dict[str, Any]:
        """Return the answer of ``fit`` for JSON."""
        return {
            "schema": "lostmotion.fit/1",
            "ladder": self.ladder,
            "noise_floor_arcsec": self.noise_floor_arcsec,
            "noise": {"within_runs_arcsec": self.within_runs_arcsec},
            "values": dict(zip(self.names, map(float, self.values), strict=True)),
            "standard_errors": dict(zip(self.names, map(float, self.standard_errors), strict=True)),
            "effects": [effect_table(term) for term in self.base.terms],
            "at_bound": self.at_bound(),
            "not_fitted": self.not_fitted(),
            "inseparable": self.inseparable,
            "significance": {name: vars(one) for name, one in self.tested.items()},
            "data_fingerprint": self.base.conditions.campaign.fingerprint(),
            "samples": self.base.conditions.rows,
        }

    def at_bound(self) -> dict[str, float]:
        """Values of effects at a bound, named as in `names`, including those not fitted."""
        return {
            f"{table['name']}.{name}": table[name]
            for term, table in ((term, effect_table(term)) for term in self.base.terms)
            for name in term.effect.at_bound(term.values)
        }

    def not_fitted(self) -> dict[str, float]:
        """Values of effects that the fit did not change, by name as in `names`."""
        return {
            f"{table['name']}.{name}": table[name]
            for term, table in ((term, effect_table(term)) for term in self.base.terms)
            for name in not_fitted(term.effect)
        }

    def document(self, drive: Drive) -> dict[str, Any]:
        """Tables of the drive file with the fit in it."""
        document = copy.deepcopy(drive.document)
        last = self.ladder[-1]
        # Values that were chosen and not estimated, such as the knots, have no error.
        estimated = [i for i, error in enumerate(self.standard_errors) if error > 0]
        document["fit"] = {
            "data_fingerprint": self.base.conditions.campaign.fingerprint(),
            "friction": friction_form(self.base),
            "rms_arcsec": last["rms_arcsec"],
            "heldout_rms_arcsec": last["rms_heldout_arcsec"],
            "noise_floor_arcsec": self.noise_floor_arcsec,
            "samples": self.base.conditions.rows,
            "ranges": fitted_ranges(self.base.conditions),
            "covariance": [
                [float(f"{self.covariance[i, j]:.6g}") for j in estimated] for i in estimated
            ],
            "values": dict(zip(self.names, map(float, self.values), strict=True)),
            "standard_errors": {
                self.names[i]: float(f"{self.standard_errors[i]:.6g}") for i in estimated
            },
        }
        document["effect"] = [effect_table(term) for term in self.base.terms]
        if not document["effect"]:
            del document["effect"]
        return document


@one_thread()
def fit_model(
    drive: Drive,
    campaign: Campaign,
    add: str | Sequence[str] = (),
    *,
    torsion_curve: TorsionCurve | None = None,
    effects: Mapping[str, Effect] | None = None,
    friction: Friction | None = None,
    progress: OnProgress | None = None,
) -> FittedModel:
    """Fit the baseline model, then each effect on top, all refitted together at each rung.

    Parameters
    ----------
    drive : Drive
    campaign : Campaign
    add : str or sequence of str
        Effects to add, in this order: names, or formulas such as
        ``"size_rad * cos(2*pi*0.43*input_turns)"``, see `effects.formula.written_formula`.
    torsion_curve : TorsionCurve, optional
        Torsion curve of the drive; by default from its file.
    effects : mapping, optional
        Effects by name; by default those of the library.
    friction : {"inside", "outside", "inside+load", "both", "both+load"}, optional
        Form of the hysteresis, see `lostmotion.friction`. By default that of a fitted drive file,
        else selected by the leave-one-run-out errors (`baseline_form`).
    """
    given_as("fit", "drive", drive, Drive)
    given_as("fit", "campaign", campaign, Campaign)
    effects = library() if effects is None else effects
    if torsion_curve is None:
        torsion_curve = hold_against(campaign, drive)
    base = make_base(drive, campaign, torsion_curve, effects)
    chosen = effects_to_add([add] if isinstance(add, str) else add, effects, base)
    if campaign.rows < SAMPLES_LEAST:
        return few_readings_model(base, chosen)
    require_addable(base, chosen)
    base.rises = True
    steps = 2 + len(chosen)
    say = progress or (lambda *_: None)
    say(0, steps, "fitting the baseline model")
    baseline = fit_baseline(base, effects, drive.ratio, friction)
    fitted = fit_stepwise(
        baseline.base,
        chosen,
        effects,
        drive.ratio,
        progress=lambda number: say(number + 1, steps, f"fitting {chosen[number].name}"),
    )
    if chosen:
        other = form_beside_effects(baseline, fitted.model, effects, drive.ratio)
        if other is not None:
            say(steps - 1, steps, "refitting with another form of the hysteresis")
            fitted = fit_stepwise(other, chosen, effects, drive.ratio)
    say(steps, steps, "")
    return FittedModel(
        fitted.model,
        ladder_of_fit(fitted.models),
        fitted.floor_arcsec,
        fitted.within_arcsec,
        fitted.table,
        significance(fitted.settled),
    )


def effects_to_add(
    add: Sequence[str], effects: Mapping[str, Effect], base: BaselineModel
) -> list[Effect]:
    """Effects by name or formula."""
    taken = {term.effect.name for term in base.terms}
    numbers = (n for n in count(1) if f"formula_{n}" not in taken)
    return [
        written_formula(one, f"formula_{next(numbers)}")
        if "*" in one
        else find_effect(one, effects)
        for one in add
    ]


def significance(settled: Settled) -> dict[str, Significance]:
    """Test every effect of a model that has estimated values."""
    found = {}
    for place, term in enumerate(settled.base.terms):
        if term.free:
            contest, name = contest_of_term(settled, place)
            result = contest.test(name)
            p = 1.0 if result is None else result.p
            found[name] = Significance(p, p <= rules.P_LIMIT)
    return found


def require_addable(base: BaselineModel, add: Sequence[Effect]) -> None:
    """Refuse effects that are not testable with these recordings or are already in the model."""
    present = {term.effect.name for term in base.terms}
    for effect in add:
        require(effect, base.conditions)
        if absorbed(effect, base.conditions):
            expected = "an effect that the baseline model does not contain"
            raise InputError("--add", effect.name, effect.absorbed, expected)
        flat = constant_columns(effect, base.conditions)
        if flat:
            file = base.conditions.campaign.runs[0].file
            raise InputError(
                file, flat[0], "a constant", f"a column that varies, for the effect {effect.name}"
            )
        if effect.name in present:
            raise InputError(
                "--add", effect.name, "an effect that is already in the file", "others"
            )
        present.add(effect.name)


def ladder_of_fit(models: Sequence[BaselineModel]) -> list[dict[str, Any]]:
    """Errors of the baseline model and after each effect."""
    return told(make_rungs(models), [[t.effect.name for t in model.terms] for model in models])


def few_readings_model(base: BaselineModel, add: Sequence[Effect]) -> FittedModel:
    """Fit as many values as few readings determine; they do not identify an effect."""
    campaign = base.conditions.campaign
    few = None if add else fit_few_readings(base)
    if few is None:
        require_samples(campaign)
        raise AssertionError("a campaign of few readings has at least SAMPLES_LEAST samples")
    table = EstimatedValues(*few.table(), [])
    heldout = few.heldout()
    rung = {
        "effects": [],
        "rms_arcsec": rms_of(base.residual()),
        "rms_heldout_arcsec": rms_of(heldout),
    }
    error = few.error_arcsec
    return FittedModel(base, [rung], error, error, table)
