"""Linearisation of the baseline model at the deviations of each run, and its optimum.

The model is linearised at the deviations of each run (FOCE): hysteresis operators are not smooth,
so a kink that is shifted by run-to-run scatter cannot be represented from the mean.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lostmotion import rules
from lostmotion.arrays import FloatArray
from lostmotion.evidence.contest import Contest
from lostmotion.evidence.gram import gather
from lostmotion.evidence.noise import Noise
from lostmotion.evidence.scatter import deviations
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.deviations import DEVIATION_MAX, DEVIATIONS
from lostmotion.fit.least_squares import moved_within, solve_within
from lostmotion.fit.point import Point
from lostmotion.rms import rms_of

COMMON = 3
"""Columns in addition to those of the baseline model: the part of half widths and offsets that is
common to all runs, and what a smoothed torque changes.
"""

SMOOTHED_PRECISION = 1.0
"""Prior precision of the share of the torque that is smoothed: it is of the order of one."""

WIDEN_MAX = 0.3
"""Largest change of the logarithm of all half widths in a step."""

ROUNDS = 8
"""Largest number of linearisations at the predicted deviations of the runs."""

SETTLED = 0.5
"""Decrease of the restricted log likelihood below which the linearisation point is kept."""

STEP_RIDGE = 1e-9
"""Relative ridge of a step's normal matrix, and least room of a parameter that is at its bound."""

DAMPINGS = (STEP_RIDGE, 0.1, 1.0, 10.0, 1.0 / STEP_RIDGE)
"""Relative dampings of the step of the parameters, tried in order until the misfit falls: kinks
make a step overshoot, most of all along the parameters that the recordings hardly determine, and
these are damped first. Tenfold from one to the next, as by Marquardt (Journal of SIAM 11, 1963),
about the one at which the damping equals the evidence. The last one moves the deviations alone."""

OWN_SHARES = (1.0, 0.4, 0.0)
"""Fractions of the step of the deviations; each run takes the one with its least misfit.
The next linearisation continues from where a run stopped."""

REFIT_STEPS = 12
"""Evaluations of a joint refit. Chosen: by the time of a diagnosis; `settle` continues from there.
"""


@dataclass
class Settled:
    """A baseline model at its deviations, with the evidence of only its columns."""

    base: BaselineModel
    contest: Contest
    noise: Noise
    beyond_linear: FloatArray | float = 0.0
    """Misfit of every run beyond that of the linearisation, nats: what the model does not keep."""

    @property
    def density(self) -> FloatArray:
        """Leave-one-run-out log predictive density of every run."""
        return self.contest.null_density

    @cached_property
    def alike(self) -> BaselineModel:
        """The model fitted to all runs together, without deviations."""
        return fit_alike(self.base)


def columns_of(
    base: BaselineModel, point: Point, form: bool = True
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Fixed columns with those common to all runs, their precision, scattering columns, residual.

    The deviations of the runs are added back to the residual, so that the scattering columns
    explain them again. Scatter is relative to a mean: for stiffness and gap it is in the torsion
    curve, for the half widths and the offset it comes after the fixed columns. The form error comes
    last (`BaselineModel.form_error`), with the precision from its variance.
    """
    precision = np.append(base.precision(), [0.0, 0.0, SMOOTHED_PRECISION])
    scatter = base.run_columns(point)
    own = precision.size
    error = base.form_error if form else None
    width = 0 if error is None else error.columns.shape[1]
    fixed = base.fixed_columns(point, beside=COMMON + width)
    fixed[:, own - 3] = scatter[:, 1]
    fixed[:, own - 2] = 1.0
    fixed[:, own - 1] = smoothed_torque(base, point)
    if error is not None:
        fixed[:, own:] = error.columns
        precision = np.append(precision, error.precision)
    response = base.measured - point.angle
    # Encoder zeros may be large; the common part is subtracted to keep digits.
    response = response - float(np.mean(response))
    run_of = base.conditions.run_of
    for k in range(len(DEVIATIONS)):
        response = response + base.deviations[:, k][run_of] * scatter[:, k]
    return fixed, precision, scatter, response


def smoothed_torque(base: BaselineModel, point: Point) -> FloatArray:
    """Change of the angle by the mean of the neighbouring torques in place of each, arc seconds.

    The model contains the noise of the torque. An effect that smooths the torque, as a lag does,
    removes a part of this noise, but explains nothing: beside this column it is not credited.
    """
    c = base.conditions
    torque = c.torque.copy()
    torque[1:-1] = 0.5 * (c.torque[:-2] + c.torque[2:])
    ends = np.concatenate((c.starts[:-1], c.starts[1:] - 1))
    torque[ends] = c.torque[ends]
    smooth = copy.copy(base)
    smooth.conditions = c.with_torque(torque)
    return np.asarray(smooth.angle() - point.angle)


def noise_rms(noise: Noise, base: BaselineModel) -> float:
    """Root mean square of the noise within runs, arc seconds."""
    rows = np.diff(base.conditions.starts)
    spread = np.array([noise.spread(r) for r in range(rows.size)])
    return float(np.sqrt(np.average(spread**2, weights=rows)))


def settle(base: BaselineModel, noise: Noise, rounds: int = ROUNDS) -> Settled:
    """Optimise baseline model and deviations for data with scatter and coloured noise.

    Penalised, damped Gauss-Newton steps (FOCE, `move`); the model is linearised again at the new
    point, with new variances, as long as the restricted likelihood increases, and the residual
    without the form error does not (`rules.WORSE`).
    """
    current = base.copy()
    current.noise_arcsec = noise_rms(noise, base)
    misfit = Misfit(current, noise)
    point = current.at()
    residual = current.residual(point)
    best = contest_at(current, noise, point=point)
    objective = objective_at(misfit, current, residual, best)
    least_rms = misfit.unexplained(current, residual, best)
    for _ in range(rounds):
        found = move(misfit, current, residual, best)
        if found is None:
            break
        moved, rest, point = found
        rms = misfit.unexplained(moved, rest, best)
        if rms >= rules.WORSE * least_rms:
            break
        contest = contest_at(moved, noise, best, point)
        value = objective_at(misfit, moved, rest, contest)
        if value >= objective:
            break
        fall = objective - value
        current, residual, best, objective = moved, rest, contest, value
        least_rms = min(least_rms, rms)
        if fall < SETTLED:
            break
    step, _ = bounded_step(current, best)
    beyond = misfit.by_run(current, residual, best) - linear_misfit(best, step)
    return Settled(current, best, noise, beyond)


def linear_misfit(contest: Contest, step: FloatArray) -> FloatArray:
    """Minus the log likelihood of every run by the linearisation after a step, as `Misfit`."""
    own = contest.null.matrix
    evidence = contest.evidence
    prior = float(step**2 @ evidence.ridge(evidence.index())) / evidence.runs
    cross = own[:, -1, :-1] @ step
    square = np.einsum("i,rij,j->r", step, own[:, :-1, :-1], step, optimize=True)
    return np.asarray(0.5 * (own[:, -1, -1] - 2.0 * cross + square + prior))


def objective_at(
    misfit: Misfit, base: BaselineModel, residual: FloatArray, contest: Contest
) -> float:
    """Minus the restricted log likelihood of a model at its deviations, nats and a constant.

    With the misfit of the model: that of its linearisation is too low far from the deviations at
    which it was linearised, and equal to it at their optimum.
    """
    linear = float(linear_misfit(contest, contest.null_step()).sum())
    return contest.null_objective - linear + misfit(base, residual, contest)


def move(
    misfit: Misfit,
    current: BaselineModel,
    residual: FloatArray,
    contest: Contest,
) -> tuple[BaselineModel, FloatArray, Point] | None:
    """Move a model by the least damped step that lowers its misfit, if any (`DAMPINGS`).

    A kink may be passed in one run only, so each run takes its own part of its deviations' step.
    Returns the model with its residual and its point.

    Parameters
    ----------
    misfit : Misfit
    current : BaselineModel
    residual : ndarray
        Of the model, arc seconds, (rows,).
    contest : Contest
        Its evidence, linearised at its deviations.
    """
    before = misfit.by_run(current, residual, contest)

    def after(
        step: FloatArray, own: FloatArray, own_shares: FloatArray
    ) -> tuple[BaselineModel, FloatArray, Point, FloatArray]:
        moved = current.copy()
        take_step(moved, contest.evidence.scale, step, own, own_shares)
        point = moved.at()
        rest = moved.residual(point)
        return moved, rest, point, misfit.by_run(moved, rest, contest)

    for damping in DAMPINGS:
        step, own = bounded_step(current, contest, damping)
        own_shares, least = np.zeros(before.size), np.full(before.size, np.inf)
        for trial in OWN_SHARES:
            moved, rest, point, by_run = after(step, own, np.full(before.size, trial))
            own_shares[by_run < least] = trial
            least = np.minimum(least, by_run)
            if np.all(least <= before):
                break
        if np.any(own_shares != trial):
            moved, rest, point, by_run = after(step, own, own_shares)
        if float(by_run.sum()) < before.sum():
            return moved, rest, point
    return None


class Misfit:
    """Minus the log likelihood of models at their deviations, nats and a constant.

    The models share recordings, noise, and the columns that are not among their parameters: form
    error and `smoothed_torque`. These are whitened once.
    """

    def __init__(self, base: BaselineModel, noise: Noise) -> None:
        c, error = base.conditions, base.form_error
        self.noise, self.starts = noise, c.starts
        self.level, self.begins = noise.whiten_runs(np.ones(c.rows), c.starts)
        self.ones = np.add.reduceat(self.level**2, self.begins)
        self.beside = smoothed_torque(base, base.at())[:, None]
        self.precision = np.array([SMOOTHED_PRECISION])
        if error is not None:
            self.beside = np.hstack((self.beside, error.columns))
            self.precision = np.append(self.precision, error.precision)
        runs = enumerate(c.slices())
        self.white = np.concatenate([noise.whiten(self.beside[at], run) for run, at in runs])
        self.offsets = np.add.reduceat(self.white * self.level[:, None], self.begins)
        self.normal = np.diag(self.precision) + self.white.T @ self.white

    def __call__(self, base: BaselineModel, residual: FloatArray, contest: Contest) -> float:
        """Misfit of a model of this residual and of its deviations, at a contest's variances."""
        return float(self.by_run(base, residual, contest).sum())

    def by_run(self, base: BaselineModel, residual: FloatArray, contest: Contest) -> FloatArray:
        """The same by run; offsets and columns beside the parameters have their best values."""
        variance = self.variance(contest)
        white, _ = self.noise.whiten_runs(residual, self.starts)
        step = self.step(white, variance)
        white -= self.white @ step
        square, cross = (
            np.add.reduceat(product, self.begins) for product in (white**2, white * self.level)
        )
        own = base.deviations**2 / variance[: len(DEVIATIONS)]
        prior = float(step**2 @ self.precision) / self.ones.size
        free = self.ones + 1.0 / variance[-1]
        return np.asarray(0.5 * (own.sum(axis=1) + square - cross**2 / free + prior))

    def unexplained(self, base: BaselineModel, residual: FloatArray, contest: Contest) -> float:
        """Root mean square of a residual minus what these columns explain, arc seconds."""
        white, _ = self.noise.whiten_runs(residual, self.starts)
        step = self.step(white, self.variance(contest))
        return rms_of(base.conditions.centred(residual - self.beside @ step))

    def variance(self, contest: Contest) -> FloatArray:
        """Variances of the deviations and of the offset, in the units of the model."""
        e = contest.evidence
        return np.asarray(contest.null_omega / e.scale[e.scatter] ** 2)

    def step(self, white: FloatArray, variance: FloatArray) -> FloatArray:
        """Best coefficients of the columns beside the parameters, for a whitened residual."""
        free = self.ones + 1.0 / variance[-1]
        cross = np.add.reduceat(white * self.level, self.begins)
        normal = self.normal - (self.offsets.T / free) @ self.offsets
        along = self.white.T @ white - self.offsets.T @ (cross / free)
        return np.asarray(np.linalg.solve(normal, along))


def plain_rms(base: BaselineModel) -> float:
    """Root mean square of the residual, arc seconds."""
    return rms_of(base.residual())


def contest_at(
    base: BaselineModel, noise: Noise, near: Contest | None = None, point: Point | None = None
) -> Contest:
    """Collect the evidence of the baseline model alone, linearised at its present `point`.

    The search for its variances starts from those of the contest `near`.
    """
    fixed, precision, scatter, response = columns_of(base, base.at() if point is None else point)
    evidence = gather(fixed, precision, scatter, (), response, noise, base.conditions.starts)
    if near is None:
        return Contest(evidence)
    return Contest(evidence, near.omega_of(evidence))


def form_part(base: BaselineModel, contest: Contest) -> FloatArray:
    """Form error of a model in each row, arc seconds, as estimated from its evidence."""
    assert base.form_error is not None
    columns, e = base.form_error.columns, contest.evidence
    step = contest.null_step() / e.scale[e.fixed]
    return np.asarray(columns @ step[-columns.shape[1] :])


def bounded_step(
    base: BaselineModel, contest: Contest, damping: float = STEP_RIDGE
) -> tuple[FloatArray, FloatArray]:
    """Gauss-Newton step within the bounds of the baseline model, and its deviations, scaled.

    The `damping` is relative to the diagonal of the normal matrix.
    """
    evidence = contest.evidence
    index = evidence.index()
    matrix = contest.null.total
    normal = matrix[:-1, :-1] + np.diag(evidence.ridge(index))
    normal[np.diag_indices_from(normal)] *= 1.0 + damping
    x, low, high = base.vector()
    scale = evidence.scale[: x.size]
    widen = WIDEN_MAX * evidence.scale[x.size]
    unbound = np.full(evidence.fixed.size - x.size - 1, np.inf)
    least = np.concatenate((np.minimum((low - x) * scale, -STEP_RIDGE), [-widen], -unbound))
    most = np.concatenate((np.maximum((high - x) * scale, STEP_RIDGE), [widen], unbound))
    # In units in which the diagonal is one: the prior of a value that changes almost nothing, such
    # as a start state of an operator of almost no share, would be larger than all other numbers.
    # Of a column that is a sum of others, rounding may leave less than nothing.
    diagonal = np.diag(normal)
    unit = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    normal *= np.outer(unit, unit)
    delta = unit * solve_within(normal, matrix[:-1, -1] * unit, least / unit, most / unit)
    return delta, deviations(evidence, index, contest.null_omega, delta)


def take_step(
    base: BaselineModel,
    scale: FloatArray,
    delta: FloatArray,
    own: FloatArray,
    own_shares: FloatArray | float = 1.0,
) -> None:
    """Move the baseline by a Gauss-Newton step and every run towards its predicted deviations.

    Parameters
    ----------
    base : BaselineModel
    scale : ndarray
        Of the columns.
    delta, own : ndarray
        Step of the fixed columns, and deviations, scaled.
    own_shares : float or ndarray
        Fraction of the step of the deviations, of all runs or of each.
    """
    blocks = base.blocks()
    x, low, high = base.vector(blocks)
    step = delta / scale[: delta.size]
    base.set_vector(moved_within(x, step[: x.size], low, high), blocks)
    own = own / scale[delta.size : delta.size + own.shape[1]]
    wider = float(np.clip(step[x.size], -WIDEN_MAX, WIDEN_MAX))
    if base.widens:
        base.hysteresis.radius_Nm = base.hysteresis.radius_Nm * np.exp(wider)
    else:
        own[:, 1] += wider
    limit = np.array([DEVIATION_MAX, DEVIATION_MAX, np.inf])
    part = np.reshape(own_shares, (-1, 1))
    moved = base.deviations + part * (own[:, : len(DEVIATIONS)] - base.deviations)
    base.deviations = np.clip(moved, -limit, limit)


def fit_alike(base: BaselineModel) -> BaselineModel:
    """Refit a baseline model to all runs together, without deviations."""
    plain = base.copy()
    plain.deviations[:] = 0.0
    plain.fit(steps=REFIT_STEPS)
    return plain
