"""From a fitted base to evidence: noise, each run's own deviations, and all candidates' columns.

The model is linearised where each run really is (FOCE): play and friction are not smooth, so a
kink that run-to-run scatter moves cannot be followed from the mean.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from lostmotion.discover import shapes
from lostmotion.discover.base import DEVIATION_MAX, DEVIATIONS, Base, Point
from lostmotion.discover.candidates import Candidate, named_candidates
from lostmotion.discover.conditions import side_by_side
from lostmotion.discover.contest import Contest
from lostmotion.discover.effects import Effect
from lostmotion.discover.evidence import gather
from lostmotion.discover.noise import Noise, fit_noise
from lostmotion.discover.ripples import ripples
from lostmotion.solve import solve_within

FloatArray = npt.NDArray[np.float64]

COMMON = 2
"""Columns beside those of the base: what the half widths and the offsets of all runs share."""

WIDEN_MAX = 0.3
"""Largest relative change of all half widths in a step."""

ROUNDS = 4
"""Most linearisations at the predicted deviations of the runs."""

WORSE = 1.2
"""A step that lets the plain residual grow by more than this has left what is known."""

SETTLED = 0.5
"""Fall of the restricted log likelihood below which the linearisation point stays."""

OUTLIERS_ALONE = 5
"""Outliers that a run may have when the others have none."""

JUMP = 6.0
"""Change of the torque from sample to sample, over the median of the run, that is a jump."""

JUMP_REACH = 2
"""Samples on either side of a jump that belong to it."""

STEP_RIDGE = 1e-9
"""Relative ridge of a step's normal matrix, and least room of a parameter that is at its bound."""

DEVIATION_SHARES = (1.0, 0.4)
"""Shares of their step that the deviations move alone."""

FOLLOW_STEPS = 6
"""Evaluations of the fit that follows a step of the deviations."""

PLAIN_STEPS = 8
"""Evaluations of the fit without deviations."""

OUTLIER = 7.0
"""A single sample that is this many deviations off its neighbours is an outlier."""

CALM_RIDGE = 1e-7
"""Relative ridge of the large least squares whose residual tells the noise."""


@dataclass
class Settled:
    """A base at its own deviations, with the evidence of its columns alone."""

    base: Base
    contest: Contest
    noise: Noise

    @property
    def density(self) -> FloatArray:
        """Leave-one-run-out log predictive density of every run."""
        return self.contest.null_held_out


def columns_of(base: Base, point: Point) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Fixed columns with those common to all runs, their precision, scattering columns, residual.

    The residual has the deviations of the runs put back, so that the scattering columns explain
    them anew. Scatter is about a mean: that of stiffness and gap is in the backbone, that of the
    friction's half widths and of the offset comes last of the fixed columns.
    """
    fixed, _ = base.fixed_columns(point)
    precision = np.append(base.precision(fixed.shape[1]), np.zeros(COMMON))
    scatter = base.run_columns(point)
    fixed = side_by_side(fixed, scatter[:, 1], np.ones(fixed.shape[0]))
    response = base.measured - point.angle
    # Encoder zeros may be far apart; what is common to all is taken off for the digits.
    response = response - float(np.mean(response))
    run_of = base.conditions.run_of
    for k in range(len(DEVIATIONS)):
        response = response + base.deviations[:, k][run_of] * scatter[:, k]
    return fixed, precision, scatter, response


def clean_outliers(base: Base) -> int:
    """Set single wild samples to what their neighbours say; returns their number.

    They are counted and reported. Rows stay in place, because the noise within a run is coloured.
    """
    residual = base.residual()
    found = np.zeros(residual.size, dtype=bool)
    for at in base.conditions.slices():
        x = residual[at]
        if x.size < 5:
            continue
        neighbours = np.empty((4, x.size))
        for row, shift in enumerate((-2, -1, 1, 2)):
            neighbours[row] = np.roll(x, shift)
        off = x - np.median(neighbours, axis=0)
        # The ends of a run have their neighbours on one side.
        for i in (0, 1, -2, -1):
            five = x[:5] if i >= 0 else x[-5:]
            off[i] = x[i] - np.median(np.delete(five, i))
        scale = 1.4826 * float(np.median(np.abs(off))) + 1e-12
        found[at] = (np.abs(off) > OUTLIER * scale) & ~jumping(base.conditions.torque[at])
    # Where many lie side by side it is no outlier but a structure.
    crowd = np.convolve(found, np.ones(7))[3:-3]
    found &= crowd <= 3
    counts = np.array([np.count_nonzero(found[at]) for at in base.conditions.slices()])
    rows = np.diff(base.conditions.starts)
    for r, at in enumerate(base.conditions.slices()):
        # Glitches fall anywhere. Where one run has many more it is something that the model lacks.
        usual = float(np.median(np.delete(counts / rows, r))) if counts.size > 1 else 0.0
        expected = usual * float(rows[r])
        if counts[r] > OUTLIERS_ALONE + expected + 3.0 * np.sqrt(expected):
            found[at] = False
    if found.any():
        point = base.at()
        good = np.flatnonzero(~found)
        bad = np.flatnonzero(found)
        filled = np.interp(bad, good, residual[good])
        level = base.conditions.run_mean(base.measured - point.angle)[base.conditions.run_of]
        base.measured = base.measured.copy()
        base.measured[bad] = point.angle[bad] + level[bad] + filled
    base.outlier |= found
    return int(np.count_nonzero(found))


def jumping(torque_Nm: FloatArray) -> npt.NDArray[np.bool_]:
    """Samples about which the load changes far quicker than usual in the run, or turns round.

    What is measured there tells most of lags and of creep, and no model without them meets it.
    """
    change = np.abs(np.diff(torque_Nm, prepend=torque_Nm[0]))
    bend = np.pad(np.abs(np.diff(torque_Nm, n=2)), 1)
    out = np.zeros(torque_Nm.size, dtype=bool)
    for size in (change, bend):
        out |= size > JUMP * (float(np.median(size)) + 1e-12)
    return np.convolve(out, np.ones(2 * JUMP_REACH + 1), mode="same") > 0


def leftover(base: Base, point: Point, blocks: Sequence[FloatArray]) -> tuple[FloatArray, int]:
    """Residual of the largest linear model, which tells the noise from any effect."""
    fixed, _, scatter, _ = columns_of(base, point)
    residual = base.residual(point)
    parts = [fixed, scatter[:, :3], *blocks]
    total = sum(part.shape[1] for part in parts)
    x = np.empty((residual.size, total), order="F")
    at = 0
    for part in parts:
        x[:, at : at + part.shape[1]] = part
        at += part.shape[1]
    base.conditions.centre(x)
    norm = np.sqrt(np.einsum("ij,ij->j", x, x))
    norm[norm == 0] = 1.0
    x /= norm
    normal = x.T @ x
    normal[np.diag_indices(total)] += CALM_RIDGE
    return residual - x @ np.linalg.solve(normal, x.T @ residual), total


def estimate_noise(base: Base, blocks: Sequence[FloatArray]) -> Noise:
    """Noise model from what the largest model leaves."""
    rest, columns = leftover(base, base.at(), blocks)
    c = base.conditions
    return fit_noise(rest, c.time_s, c.starts, columns)


def noise_rms(noise: Noise, base: Base) -> float:
    """Root mean square of the noise within runs, arc seconds."""
    rows = np.diff(base.conditions.starts)
    spread = np.array([noise.spread(r) for r in range(rows.size)])
    return float(np.sqrt(np.average(spread**2, weights=rows)))


def settle(base: Base, noise: Noise, rounds: int = ROUNDS) -> Settled:
    """Bring base and deviations to where the data with scatter and coloured noise want them.

    A step moves both together; where kinks make that overshoot, the deviations move alone and the
    base is fitted after them. The best point by restricted likelihood is the one that counts.
    """
    current = base.copy()
    current.noise_arcsec = noise_rms(noise, base)
    best = contest_at(current, noise)
    least_rms = plain_rms(current)

    def attempt(step: FloatArray, own: FloatArray, share: float) -> tuple[Base, Contest] | None:
        moved = current.copy()
        take_step(moved, best.evidence.scale, step, own, share)
        if not step.any():
            moved.fit(noise=float(np.median(noise.sigma)), steps=FOLLOW_STEPS)
        if plain_rms(moved) >= WORSE * least_rms:
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


def plain_rms(base: Base) -> float:
    """Root mean square of the residual, arc seconds."""
    return float(np.sqrt(np.mean(base.residual() ** 2)))


def contest_at(base: Base, noise: Noise) -> Contest:
    """Gather the evidence of the base alone, linearised where it stands."""
    fixed, precision, scatter, response = columns_of(base, base.at())
    evidence = gather(fixed, precision, scatter, (), response, noise, base.conditions.starts)
    return Contest(evidence)


def bounded_step(base: Base, contest: Contest) -> tuple[FloatArray, FloatArray]:
    """Gauss-Newton step within the bounds of the base, and the deviations that go with it."""
    evidence = contest.evidence
    index = evidence.index()
    matrix = contest.null.matrix.sum(axis=0)
    normal = matrix[:-1, :-1] + np.diag(contest.ridge(index))
    normal[np.diag_indices_from(normal)] *= 1.0 + STEP_RIDGE
    x, low, high = base.vector()
    scale = evidence.scale[: x.size]
    widen = WIDEN_MAX * evidence.scale[x.size]
    least = np.append(np.minimum((low - x) * scale, -STEP_RIDGE), (-widen, -np.inf))
    most = np.append(np.maximum((high - x) * scale, STEP_RIDGE), (widen, np.inf))
    delta = solve_within(normal, matrix[:-1, -1], least, most)
    return delta, contest.deviations(index, contest.null_omega, delta)


def take_step(
    base: Base, scale: FloatArray, delta: FloatArray, own: FloatArray, share: float = 1.0
) -> None:
    """Move the base by a Gauss-Newton step and every run towards its predicted deviations."""
    x, low, high = base.vector()
    step = delta / scale[: delta.size]
    base.set_vector(np.clip(x + share * step[: x.size], low, high))
    own = own / scale[delta.size : delta.size + own.shape[1]]
    wider = float(np.clip(step[x.size], -WIDEN_MAX, WIDEN_MAX))
    if base.widens:
        base.radius_Nm = base.radius_Nm * (1.0 + share * wider)
    else:
        own[:, 1] += wider
    limit = np.array([DEVIATION_MAX, DEVIATION_MAX, np.inf])
    moved = base.deviations + share * (own[:, : len(DEVIATIONS)] - base.deviations)
    base.deviations = np.clip(moved, -limit, limit)


class Projector:
    """What a model's columns leave of other columns, in plain arc seconds."""

    def __init__(self, fixed: FloatArray) -> None:
        fixed = fixed - fixed.mean(axis=0)
        norm = np.sqrt(np.einsum("ij,ij->j", fixed, fixed))
        norm[norm == 0] = 1.0
        self.fixed = fixed / norm
        self.normal = self.fixed.T @ self.fixed + 1e-9 * np.eye(norm.size)

    def size(self, column: FloatArray) -> float:
        """Root mean square of what is left of a column."""
        column = column - column.mean()
        taken = self.fixed @ np.linalg.solve(self.normal, self.fixed.T @ column)
        return float(np.sqrt(np.mean((column - taken) ** 2)))


FORM_SHARE = 0.0025
"""How exactly the base has the form of a drive, over the rms of its lost motion: a characteristic
of straight pieces and a few plays on the torque are no drive's springs and friction. What hangs on
the load alone and is smaller is not told from that."""


@dataclass
class Field:
    """All candidates over a settled base."""

    settled: Settled
    contest: Contest
    candidates: dict[str, Candidate]
    closed: dict[str, str]
    form_arcsec: float
    """What the form of the base is wrong by at best (`FORM_SHARE`)."""

    @cached_property
    def projector(self) -> Projector:
        """What the base, with all that is in it, leaves of other columns."""
        base = self.settled.base
        return Projector(base.fixed_columns(base.at())[0])


def swing_by_run(base: Base, point: Point) -> FloatArray:
    """Root mean square in every run, arc seconds, of what the base does there about its mean."""
    c = base.conditions
    swing = point.angle - c.run_mean(point.angle)[c.run_of]
    return np.asarray(np.sqrt(c.run_mean(swing**2)))


def form_size(swing: FloatArray, rows: FloatArray) -> float:
    """What the form of a base is wrong by at best, from its swing in runs of so many samples."""
    return FORM_SHARE * float(np.sqrt(np.average(swing**2, weights=rows)))


def make_candidates(
    base: Base, effects: Mapping[str, Effect], ratio: float, waves: Sequence[Candidate]
) -> tuple[list[Candidate], dict[str, str]]:
    """Named effects and shapes at the base as it stands; the waves hang on the plan alone."""
    point = base.at()
    named, closed = named_candidates(effects, base, point, ratio)
    return [*named, *shapes.smooth_shapes(base, point), *waves, *ripples(base)], closed


def plain_of(settled: Settled) -> Base:
    """The base fitted with every run alike: where deviations have not taken up anything yet."""
    base = settled.base.copy()
    base.deviations[:] = 0.0
    base.fit(noise=float(np.median(settled.noise.sigma)), steps=PLAIN_STEPS)
    return base


def contest_of_term(settled: Settled, place: int) -> tuple[Contest, str]:
    """Evidence for a term that is in the model, linearised where the model with it stands.

    What the term does is put back into the residual; its free values are the block of that name, or
    all that it does where it has none.
    """
    base = settled.base
    point = base.at()
    fixed, precision, scatter, response = columns_of(base, point)
    name, own = base.terms[place].effect.name, term_places(base, place)
    done = term_angle(base, place, fixed)
    response = response + done
    evidence = gather(
        np.delete(fixed, own, axis=1),
        np.delete(precision, own),
        scatter,
        [(name, fixed[:, own] if own.size else done[:, None])],
        response - float(np.mean(response)),
        settled.noise,
        base.conditions.starts,
    )
    return Contest(evidence), name


def term_places(base: Base, place: int) -> npt.NDArray[np.intp]:
    """Places of a term's free values among the fixed columns."""
    first = base.first_term + sum(len(term.free) for term in base.terms[:place])
    return np.arange(first, first + len(base.terms[place].free))


def term_angle(base: Base, place: int, fixed: FloatArray) -> FloatArray:
    """What a term adds to the model, arc seconds, as far as it scales with its values (Euler).

    One without free values, as a tooth that has slipped, adds what the model lacks without it.
    """
    term = base.terms[place]
    if not term.free:
        without = base.copy()
        del without.terms[place]
        return base.angle() - without.angle()
    scaling = term.effect.scaling()
    carries = [k for k, i in enumerate(term.free) if i in scaling]
    columns = fixed[:, term_places(base, place)[carries]]
    return np.asarray(columns @ term.values[[term.free[k] for k in carries]])


def term_size(base: Base, place: int) -> float:
    """Root mean square, arc seconds, of what the rest of the model leaves of a term."""
    fixed = base.fixed_columns(base.at())[0]
    rest = Projector(np.delete(fixed, term_places(base, place), axis=1))
    return rest.size(term_angle(base, place, fixed))


def make_field(settled: Settled, candidates: Sequence[Candidate], closed: dict[str, str]) -> Field:
    """Gather the evidence of all candidates."""
    base = settled.base
    point = base.at()
    fixed, precision, scatter, response = columns_of(base, point)
    evidence = gather(
        fixed,
        precision,
        scatter,
        [(candidate.name, candidate.columns) for candidate in candidates],
        response,
        settled.noise,
        base.conditions.starts,
    )
    for candidate in candidates:
        places = evidence.blocks[candidate.name]
        for start in sorted(set(candidate.start_of)):
            chosen = [i for i, s in enumerate(candidate.start_of) if s == start]
            evidence.blocks[f"{candidate.name}#{start}"] = places[chosen]
    form = form_size(swing_by_run(base, point), np.diff(base.conditions.starts))
    return Field(settled, Contest(evidence), {c.name: c for c in candidates}, closed, form)
