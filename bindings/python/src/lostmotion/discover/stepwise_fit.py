"""The stepwise fit: the baseline model, then each effect on top, all refitted at each rung.

`diagnose` and `fit` share it: the same recordings, form and effects give the same numbers in both.
All runs are equal in it, as in a drive file; standard errors include the coloured noise within runs
and the run-to-run scatter.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.candidates import shapes
from lostmotion.candidates.named import tangent
from lostmotion.candidates.tangents import given_values, grid
from lostmotion.discover.contest_round import make_candidates, make_round
from lostmotion.discover.form_variance import largest_model, with_form_error
from lostmotion.discover.linearise import Settled, contest_at, noise_rms, plain_rms, settle
from lostmotion.discover.noise_floor import noise_floor
from lostmotion.discover.refits import term_of_start, tested_starts, without_deviations
from lostmotion.effects.effect import Effect
from lostmotion.errors import InputError
from lostmotion.evidence.noise import Noise
from lostmotion.fit.baseline import FILED, BaselineModel
from lostmotion.fit.parameters import placed
from lostmotion.fit.terms import Term, start_values
from lostmotion.threads import begin, in_parallel

STEPS = 12
"""Evaluations of a fit before the runs have their own deviations."""

SCAN_BEYOND, SCAN_STEP = 10.0, 10.0**0.1
"""Inner values at which the error is computed: from a decade below the first start of the value to
a decade above the last, and their ratio."""

CORRELATED = 0.99
"""Correlation of two estimates above which the recordings do not separate the values."""


@dataclass
class EstimatedValues:
    """Values of a model in the units of the drive file.

    Attributes
    ----------
    names : list of str
    values : ndarray
    covariance : ndarray
        Covariance from scatter and noise; zero for values that were not estimated.
    inseparable : list of list of str
        Pairs that these recordings do not separate.
    """

    names: list[str]
    values: FloatArray
    covariance: FloatArray
    inseparable: list[list[str]]

    @property
    def standard_errors(self) -> FloatArray:
        """Standard error of every value; zero if it was not estimated."""
        return np.asarray(np.sqrt(np.maximum(np.diag(self.covariance), 0.0)))

    def error_of(self, effect: Effect) -> dict[str, float]:
        """Standard errors of the estimated values of an effect, by name."""
        errors = dict(zip(self.names, map(float, self.standard_errors), strict=True))
        keys = {value.name: f"{effect.name}.{value.name}" for value in effect.values}
        return {name: errors[key] for name, key in keys.items() if errors.get(key, 0.0) > 0.0}


@dataclass
class StepwiseFit:
    """The baseline model and the model after each effect, without deviations of single runs.

    Attributes
    ----------
    models : list of BaselineModel
    first : Settled
        The first model at the deviations of its runs, with the evidence of its columns.
    effects : mapping
        That may be missing.
    ratio : float
        Of the drive.
    """

    models: list[BaselineModel]
    first: Settled
    effects: Mapping[str, Effect]
    ratio: float
    measured: Callable[[], Settled] = field(init=False, repr=False)
    """Result of `measure_noise` for the last model, begun with this object."""

    def __post_init__(self) -> None:
        if len(self.models) > 1:
            self.measured = begin(lambda: measure_noise(self.models[-1], self.effects, self.ratio))

    @cached_property
    def settled(self) -> Settled:
        """The last model at the deviations of its runs, with its own noise estimate."""
        return self.first if len(self.models) == 1 else self.measured()

    @property
    def model(self) -> BaselineModel:
        """The model with all effects."""
        return self.models[-1]

    @cached_property
    def within_arcsec(self) -> float:
        """Noise within runs."""
        return noise_rms(self.settled.noise, self.model)

    @cached_property
    def floor_arcsec(self) -> float:
        """Noise within runs and run-to-run scatter."""
        return noise_floor(self.settled, self.within_arcsec)

    @cached_property
    def table(self) -> EstimatedValues:
        """Values with their covariance."""
        return table_of(self.model, self.settled)


def fit_stepwise(
    base: BaselineModel,
    add: Sequence[Effect],
    effects: Mapping[str, Effect],
    ratio: float,
    known: Settled | None = None,
    progress: Callable[[int], None] = lambda _: None,
    models: Sequence[BaselineModel] = (),
) -> StepwiseFit:
    """Add effects to a fitted baseline model, in order.

    Parameters
    ----------
    base : BaselineModel
        Fitted, in the form that was chosen.
    add : sequence of Effect
    effects : mapping
        Effects that may be missing: the part that none of them explains is noise.
    ratio : float
        Of the drive.
    known : Settled, optional
        Result of `measure_noise` for the baseline model, if available.
    progress : callable, optional
        Called with the number of each effect before it is fitted.
    models : sequence of BaselineModel, optional
        The baseline model and those after the first effects, if they are fitted already.
    """
    first = known or measure_noise(base, effects, ratio)
    fitted = fit_models(base, first, add, ratio, models, progress)
    return StepwiseFit(fitted, first, effects, ratio)


def fit_models(
    base: BaselineModel,
    first: Settled,
    add: Sequence[Effect],
    ratio: float,
    known: Sequence[BaselineModel] = (),
    progress: Callable[[int], None] = lambda _: None,
) -> list[BaselineModel]:
    """The baseline model and that after each effect, of which the first may be `known`."""
    models = list(known) or [base]
    for number in range(len(models) - 1, len(add)):
        progress(number)
        models.append(with_effect(models[-1], first, add[number], ratio))
    return models


def with_effect(base: BaselineModel, first: Settled, effect: Effect, ratio: float) -> BaselineModel:
    """Refit a model with one more effect.

    From each start of the effect, of which the fit with the least error counts: which one leads
    there does not follow from its tangent. During the fit the runs have their own deviations:
    otherwise run-to-run scatter biases the effect, and convergence through kinks is slow. If these
    led to a larger error, the fit without them counts. A fit from `scanned` values may be better.
    """
    plain, noise = base.copy(), first.noise
    plain.noise_arcsec, plain.form_error = noise_rms(noise, base), first.base.form_error

    def fitted(term: Term) -> BaselineModel:
        model = plain.copy()
        model.terms.append(term)
        model.fit(noise=float(np.median(noise.sigma)), steps=STEPS)
        return model

    models = in_parallel(fitted, first_terms(plain, noise, effect, ratio))
    found = min(models, key=plain_rms)
    apart = without_deviations(settle(found, noise).base, base)
    best = min(apart, found, key=plain_rms)
    again = scanned(best)
    again.fit(steps=STEPS)
    return min(best, again, key=plain_rms)


def scanned(model: BaselineModel) -> BaselineModel:
    """A model with the best of many inner values of its last effect, all others kept.

    Where no sample lies at a kink of an effect, the error does not depend on an inner value, and
    least squares do not leave such a range.
    """
    moved = model.copy()
    term = moved.terms[-1]
    for place in term.effect.indices("shape"):
        value = term.effect.values[place]
        if value.low <= 0.0 or place not in term.free:
            continue
        starts = grid(term.effect, place, model)
        low, high = min(starts) / SCAN_BEYOND, max(starts) * SCAN_BEYOND
        trials = np.geomspace(low, high, 1 + round(np.log(high / low) / np.log(SCAN_STEP)))
        least, present = plain_rms(moved), term.values[place]
        for trial in np.clip(trials, value.low, value.high):
            term.values[place] = trial
            if (error := plain_rms(moved)) < least:
                least, present = error, trial
        term.values[place] = present
    return moved


def measure_noise(base: BaselineModel, effects: Mapping[str, Effect], ratio: float) -> Settled:
    """Estimate the noise for a model, and the deviations of the runs for that noise."""
    candidates, _ = make_candidates(base, effects, ratio, shapes.waves(base))
    largest = largest_model(base, candidates)
    noise = largest.noise()
    return settle(with_form_error(base, noise, candidates, largest), noise)


def first_terms(base: BaselineModel, noise: Noise, effect: Effect, ratio: float) -> list[Term]:
    """An effect with the values that the linearised evidence suggests, for each of its starts."""
    candidate = tangent(effect, base, base.at(), ratio)
    if candidate.columns.shape[1] == 0:
        return [Term(effect, start_values(effect, given_values(base, ratio)), effect.free())]
    alone = make_round(Settled(base, contest_at(base, noise), noise), [candidate], {})
    result = alone.contest.test(effect.name)
    if result is None:
        raise InputError(
            "--add",
            effect.name,
            "an effect that the baseline model absorbs completely",
            "an effect that these recordings identify",
        )
    return [term_of_start(alone, candidate, *start) for start in tested_starts(alone, result)]


def table_of(base: BaselineModel, settled: Settled) -> EstimatedValues:
    """Values in the units of the drive file, with the covariance from scatter and noise."""
    contest = settled.contest
    evidence = contest.evidence
    index = evidence.index()
    total = contest.null.total
    n = index.size - 1
    inverse = np.linalg.inv(total[:n, :n] + np.diag(evidence.ridge(index)))
    scale = evidence.scale[evidence.fixed]
    small = inverse / np.outer(scale, scale)
    # Start states and the common offset belong to these recordings, not to the drive.
    kept = [(block, places) for block, places in placed(base.blocks()) if block.file_keys]
    keep = np.concatenate([np.arange(places.start, places.stop) for _, places in kept])
    names = [name for block, _ in kept for name in block.file_keys]
    unit = np.concatenate([np.full(block.size, block.unit) for block, _ in kept])
    values = np.concatenate([block.value * block.unit for block, _ in kept])
    covariance = small[np.ix_(keep, keep)] * np.outer(unit, unit)
    deviation = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    correlation = covariance / np.outer(deviation, deviation)
    close = np.argwhere(np.triu(np.abs(correlation), 1) > CORRELATED)
    inseparable = [[names[i], names[j]] for i, j in close]
    # The grid was chosen and not estimated.
    estimated = {block.filed for block, _ in kept}
    grid = [filed for filed in FILED if filed not in estimated and filed.of(base).size]
    fixed = np.concatenate([filed.of(base) for filed in grid])
    fixed_names = [name for filed in grid for name in filed.keys(filed.of(base).size)]
    whole = np.zeros((len(names) + fixed.size,) * 2)
    whole[: len(names), : len(names)] = covariance
    return EstimatedValues(
        [*names, *fixed_names], np.concatenate((values, fixed)), whole, inseparable
    )
