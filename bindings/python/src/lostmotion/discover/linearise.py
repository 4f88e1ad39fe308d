"""The baseline model linearised where each run really is, and brought to where the data want it.

The model is linearised at each run's own deviations (FOCE): hysteresis operators and friction are
not smooth, so a kink that run-to-run scatter moves cannot be followed from the mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lostmotion import rules
from lostmotion.effects.conditions import side_by_side
from lostmotion.evidence.contest import Contest
from lostmotion.evidence.gram import gather
from lostmotion.evidence.noise import Noise
from lostmotion.evidence.scatter import deviations
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.deviations import DEVIATION_MAX, DEVIATIONS
from lostmotion.fit.least_squares import solve_within
from lostmotion.fit.point import Point

FloatArray = npt.NDArray[np.float64]

COMMON = 2
"""Columns beside those of the base: what the half widths and the offsets of all runs share."""

WIDEN_MAX = 0.3
"""Largest relative change of all half widths in a step."""

ROUNDS = 4
"""Most linearisations at the predicted deviations of the runs."""

SETTLED = 0.5
"""Fall of the restricted log likelihood below which the linearisation point stays."""

STEP_RIDGE = 1e-9
"""Relative ridge of a step's normal matrix, and least room of a parameter that is at its bound."""

DEVIATION_SHARES = (1.0, 0.4)
"""Shares of their step that the deviations move alone."""

FOLLOW_STEPS = 6
"""Evaluations of the fit that follows a step of the deviations."""

PLAIN_STEPS = 8
"""Evaluations of the fit without deviations."""


@dataclass
class Settled:
    """A base at its own deviations, with the evidence of its columns alone."""

    base: BaselineModel
    contest: Contest
    noise: Noise

    @property
    def density(self) -> FloatArray:
        """Leave-one-run-out log predictive density of every run."""
        return self.contest.null_density


def columns_of(
    base: BaselineModel, point: Point
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Fixed columns with those common to all runs, their precision, scattering columns, residual.

    The residual has the deviations of the runs put back, so that the scattering columns explain
    them anew. Scatter is about a mean: that of stiffness and gap is in the backbone, that of the
    friction's half widths and of the offset comes last of the fixed columns.
    """
    fixed = base.fixed_columns(point)
    precision = np.append(base.precision(), np.zeros(COMMON))
    scatter = base.run_columns(point)
    fixed = side_by_side(fixed, scatter[:, 1], np.ones(fixed.shape[0]))
    response = base.measured - point.angle
    # Encoder zeros may be far apart; what is common to all is taken off for the digits.
    response = response - float(np.mean(response))
    run_of = base.conditions.run_of
    for k in range(len(DEVIATIONS)):
        response = response + base.deviations[:, k][run_of] * scatter[:, k]
    return fixed, precision, scatter, response


def noise_rms(noise: Noise, base: BaselineModel) -> float:
    """Root mean square of the noise within runs, arc seconds."""
    rows = np.diff(base.conditions.starts)
    spread = np.array([noise.spread(r) for r in range(rows.size)])
    return float(np.sqrt(np.average(spread**2, weights=rows)))


def settle(base: BaselineModel, noise: Noise, rounds: int = ROUNDS) -> Settled:
    """Bring base and deviations to where the data with scatter and coloured noise want them.

    A step moves both together; where kinks make that overshoot, the deviations move alone and the
    base is fitted after them. The best point by restricted likelihood is the one that counts.
    """
    current = base.copy()
    current.noise_arcsec = noise_rms(noise, base)
    best = contest_at(current, noise)
    least_rms = plain_rms(current)

    def attempt(
        step: FloatArray, own: FloatArray, share: float
    ) -> tuple[BaselineModel, Contest] | None:
        moved = current.copy()
        take_step(moved, best.evidence.scale, step, own, share)
        if not step.any():
            moved.fit(noise=float(np.median(noise.sigma)), steps=FOLLOW_STEPS)
        if plain_rms(moved) >= rules.WORSE * least_rms:
            return None
        contest = contest_at(moved, noise)
        return (moved, contest) if contest.null_objective < best.null_objective else None

    for _ in range(rounds):
        step, own = bounded_step(current, best)
        found = attempt(step, own, 1.0)
        for share in DEVIATION_SHARES:
            found = found or attempt(np.zeros_like(step), own, share)
        if found is None:
            break
        fall = best.null_objective - found[1].null_objective
        current, best = found
        least_rms = min(least_rms, plain_rms(current))
        if fall < SETTLED:
            break
    return Settled(current, best, noise)


def plain_rms(base: BaselineModel) -> float:
    """Root mean square of the residual, arc seconds."""
    return float(np.sqrt(np.mean(base.residual() ** 2)))


def contest_at(base: BaselineModel, noise: Noise) -> Contest:
    """Gather the evidence of the base alone, linearised where it stands."""
    fixed, precision, scatter, response = columns_of(base, base.at())
    evidence = gather(fixed, precision, scatter, (), response, noise, base.conditions.starts)
    return Contest(evidence)


def bounded_step(base: BaselineModel, contest: Contest) -> tuple[FloatArray, FloatArray]:
    """Gauss-Newton step within the bounds of the base, and the deviations that go with it."""
    evidence = contest.evidence
    index = evidence.index()
    matrix = contest.null.matrix.sum(axis=0)
    normal = matrix[:-1, :-1] + np.diag(evidence.ridge(index))
    normal[np.diag_indices_from(normal)] *= 1.0 + STEP_RIDGE
    x, low, high = base.vector()
    scale = evidence.scale[: x.size]
    widen = WIDEN_MAX * evidence.scale[x.size]
    least = np.append(np.minimum((low - x) * scale, -STEP_RIDGE), (-widen, -np.inf))
    most = np.append(np.maximum((high - x) * scale, STEP_RIDGE), (widen, np.inf))
    delta = solve_within(normal, matrix[:-1, -1], least, most)
    return delta, deviations(evidence, index, contest.null_omega, delta)


def take_step(
    base: BaselineModel, scale: FloatArray, delta: FloatArray, own: FloatArray, share: float = 1.0
) -> None:
    """Move the base by a Gauss-Newton step and every run towards its predicted deviations."""
    x, low, high = base.vector()
    step = delta / scale[: delta.size]
    base.set_vector(np.clip(x + share * step[: x.size], low, high))
    own = own / scale[delta.size : delta.size + own.shape[1]]
    wider = float(np.clip(step[x.size], -WIDEN_MAX, WIDEN_MAX))
    if base.widens:
        base.hysteresis.radius_Nm = base.hysteresis.radius_Nm * (1.0 + share * wider)
    else:
        own[:, 1] += wider
    limit = np.array([DEVIATION_MAX, DEVIATION_MAX, np.inf])
    moved = base.deviations + share * (own[:, : len(DEVIATIONS)] - base.deviations)
    base.deviations = np.clip(moved, -limit, limit)


def plain_of(settled: Settled) -> BaselineModel:
    """The base fitted with every run alike: where deviations have not taken up anything yet."""
    base = settled.base.copy()
    base.deviations[:] = 0.0
    base.fit(noise=float(np.median(settled.noise.sigma)), steps=PLAIN_STEPS)
    return base
