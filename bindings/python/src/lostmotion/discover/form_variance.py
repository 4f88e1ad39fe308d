"""The form error of the baseline model: its variance and its size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lostmotion import rules
from lostmotion.arrays import FloatArray
from lostmotion.candidates.candidate import Candidate
from lostmotion.discover.contest_round import Projector, RecordedRound, form_size, swing_by_run
from lostmotion.discover.gates import is_of_form
from lostmotion.discover.linearise import Settled, columns_of, form_part, noise_rms
from lostmotion.discover.measurement_noise import LargestModel
from lostmotion.discover.shortlist import least_size
from lostmotion.evidence.contest import FIRST_OMEGA, Result
from lostmotion.evidence.gram import Evidence, gather
from lostmotion.evidence.noise import Noise
from lostmotion.evidence.scatter import RestrictedLikelihood, reduced_total
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.form_error import FormError
from lostmotion.threads import in_parallel

SD_TRIALS = np.geomspace(0.1, 100.0, 7)
"""Standard deviations that are tried, relative to the noise within runs; a parabola interpolates
between them."""

FORM = "form"
"""Name of its columns among those of the effects, which are numbered."""

RANK_MOST = 64
"""Largest number of directions of the form error that are kept: each costs time with every
candidate."""


def with_form(base: BaselineModel, candidates: Sequence[Candidate]) -> list[FloatArray]:
    """Columns of all candidates and of the form error: the largest model."""
    return [*(candidate.columns for candidate in candidates), base.form_basis.columns]


def largest_model(base: BaselineModel, candidates: Sequence[Candidate]) -> LargestModel:
    """The model with all candidates, and the columns of the form error as its last block."""
    return LargestModel.of(base, with_form(base, candidates))


def confounded_effects(largest: LargestModel, candidates: Sequence[Candidate]) -> set[str]:
    """Named candidates of which every column is confounded with the form error."""
    return {
        candidate.name
        for number, candidate in enumerate(candidates)
        if candidate.named
        and candidate.odd
        and all(
            is_of_form(largest.beyond_last(number, unit))
            for unit in np.eye(candidate.columns.shape[1])
        )
    }


def mark_of_form(largest: LargestModel, current: RecordedRound, results: Sequence[Result]) -> None:
    """Mark the candidates whose results are confounded with the form error, if there is one.

    Parameters
    ----------
    largest : LargestModel
        With the candidates of the round in their order, without differences between runs.
    """
    if current.settled.base.form_error is None:
        return
    numbers = {name: number for number, name in enumerate(current.candidates)}
    blocks = current.contest.evidence.blocks
    for result in results:
        number = numbers[result.name]
        coefficients = np.zeros(blocks[result.name].size)
        if largest.width(number) != coefficients.size:
            continue
        coefficients[np.isin(blocks[result.name], blocks[result.block])] = current.unscaled(result)
        share = largest.beyond_last(number, coefficients)
        candidate = current.candidates[result.name]
        candidate.of_form = candidate.odd and is_of_form(share, candidate.named)


def with_form_error(
    base: BaselineModel,
    noise: Noise,
    candidates: Sequence[Candidate],
    largest: LargestModel | None = None,
) -> BaselineModel:
    """Copy a baseline model with its form error, estimated together with the named candidates.

    Without those that are confounded with it: the form error explains the same.

    Parameters
    ----------
    largest : LargestModel, optional
        With these candidates, if known.
    """
    other = base.copy()
    if largest is None:
        candidates = [candidate for candidate in candidates if candidate.named]
        largest = LargestModel.of(base, with_form(base, candidates), wanted=False)
    of_form = confounded_effects(largest, candidates)
    named = [c.columns for c in candidates if c.named and c.name not in of_form]
    other.form_error = estimate_form_error(base, noise, named)
    return other


def estimate_form_error(
    base: BaselineModel, noise: Noise, effects: Sequence[FloatArray]
) -> FormError | None:
    """Form error: standard deviation of its coefficients by REML, and its directions.

    Like the noise, it is estimated together with the largest model, so that it does not include
    what a named effect explains. Only directions that raise the likelihood are kept.

    Parameters
    ----------
    base : BaselineModel
    noise : Noise
    effects : sequence of ndarray
        Columns of the named candidates.

    Returns
    -------
    FormError or None
        None if the gain is below `rules.GAIN_LEAST`.
    """
    basis = base.form_basis.columns
    fixed, precision, scatter, response = columns_of(base, base.at(), form=False)
    blocks = [*((str(number), columns) for number, columns in enumerate(effects)), (FORM, basis)]
    bare = gather(fixed, precision, scatter, blocks, response, noise, base.conditions.starts)
    own, names = bare.blocks[FORM], [name for name, _ in blocks]
    scale, index = bare.scale[own], bare.index(*names)
    omega = np.full(bare.scatter.size, FIRST_OMEGA)
    plain = RestrictedLikelihood(bare, bare.index(*names[:-1])).lowest(omega)
    omega, without = plain.omega, plain.value
    likelihood = RestrictedLikelihood(bare, index)
    flat = bare.ridge(index)

    def objective(log_sd: float) -> float:
        ridge = flat.copy()
        ridge[-own.size :] += np.exp(-2.0 * log_sd) / scale**2
        value = likelihood.with_ridge(ridge).lowest(omega).value
        return value + scale.size * log_sd + float(np.log(scale).sum())

    trials = np.log(noise_rms(noise, base)) + np.log(SD_TRIALS)
    values = in_parallel(objective, trials)
    least = int(np.argmin(values))
    if values[least] >= without - rules.GAIN_LEAST:
        return None
    log_sd = float(trials[least])
    if 0 < least < len(trials) - 1:
        log_sd += lowest_of_parabola(values[least - 1 : least + 2]) * float(trials[1] - trials[0])
    sd = float(np.exp(log_sd))
    # An effect may explain what is really form error, so the directions are found without effects.
    evidence = replace(
        bare,
        fixed=np.append(bare.fixed, own),
        precision=np.append(bare.precision, sd**-2.0 / scale**2),
    )
    omega = RestrictedLikelihood(evidence, evidence.index()).lowest(omega).omega
    turn = form_directions(evidence, omega, scale, sd)
    return FormError(basis @ turn, sd, without - values[least]) if turn.shape[1] else None


def lowest_of_parabola(values: Sequence[float]) -> float:
    """Position of the minimum of a parabola through three values, in steps from the middle."""
    low, middle, high = values
    return 0.5 * (low - high) / max(low - 2.0 * middle + high, 1e-300)


def form_directions(
    evidence: Evidence, omega: FloatArray, scale: FloatArray, sd: float
) -> FloatArray:
    """Directions of the form error that raise the likelihood, strongest first.

    However little each of them raises it: what a covariance leaves out is credited to an effect
    that resembles it, and many weak directions are together as large as a strong one.
    """
    index = evidence.index()
    total = reduced_total(evidence, index, omega)
    first = index.size - 1 - scale.size
    others, own = slice(0, first), slice(first, -1)
    ridge = np.diag(evidence.ridge(index)[others])
    carried = np.linalg.solve(total[others, others] + ridge, total[others, first:])
    left = (total[own, first:] - total[own, others] @ carried) * scale[:, None]
    information, slope = left[:, :-1] * scale, left[:, -1]
    value, vector = np.linalg.eigh(0.5 * (information + information.T))
    value = np.maximum(value, 0.0)
    gain = 0.5 * ((slope @ vector) ** 2 / (value + sd**-2.0) - np.log1p(value * sd**2))
    kept = [place for place in np.argsort(-gain)[:RANK_MOST] if gain[place] > 0.0]
    return np.asarray(vector[:, kept])


def form_error_told(settled: Settled, within: float, largest: float) -> float:
    """Size of the form error, arc seconds, if it counts; otherwise zero.

    It counts as any shape does beside the `largest` effect, because it may be due to the inexact
    form of that.
    """
    base = settled.base
    if base.form_error is None:
        return 0.0
    size, least = form_error_size(settled), least_size(within, largest)
    swing, rows = swing_by_run(base, base.at()), np.diff(base.conditions.starts)
    return size if size >= max(least, form_size(swing, rows)) else 0.0


def form_error_size(settled: Settled) -> float:
    """Root mean square, arc seconds, of the form error that the rest of the model cannot absorb."""
    base = settled.base
    if base.form_error is None:
        return 0.0
    rest = Projector(base.fixed_columns(base.at()))
    return rest.size(form_part(base, settled.contest))
