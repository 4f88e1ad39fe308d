"""From a fitted base to evidence: noise, each run's own deviations, and all candidates' columns.

The model is linearised where each run really is (FOCE): play and friction are not smooth, so a
kink that run-to-run scatter moves cannot be followed from the mean.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.discover import shapes
from lostmotion.discover.backbone import DEVIATION_MAX, DEVIATIONS, Base, Point
from lostmotion.discover.candidates import Candidate, named_candidates
from lostmotion.discover.contest import Contest
from lostmotion.discover.effects import Effect
from lostmotion.discover.evidence import gather
from lostmotion.discover.noise import Noise, fit_noise

FloatArray = npt.NDArray[np.float64]

ROUNDS = 4
"""Most linearisations at the predicted deviations of the runs."""

WORSE = 1.2
"""A step that lets the plain residual grow by more than this has left what is known."""

SETTLED = 0.5
"""Fall of the restricted log likelihood below which the linearisation point stays."""

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
    """Fixed columns with a common offset, their precision, scattering columns, and the residual.

    The residual has the deviations of the runs put back, so that the scattering columns explain
    them anew.
    """
    fixed, _ = base.fixed_columns(point)
    precision = np.append(base.precision(fixed.shape[1]), 0.0)
    fixed = np.column_stack((fixed, np.ones(fixed.shape[0])))
    scatter = base.run_columns(point)
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
        scale = 1.4826 * float(np.median(np.abs(off))) + 1e-12
        found[at] = np.abs(off) > OUTLIER * scale
        found[at][[0, 1, -1, -2]] = False
    # Where many lie side by side it is no outlier but a structure.
    crowd = np.convolve(found, np.ones(7))[3:-3]
    found &= crowd <= 3
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
    x -= base.conditions.run_mean(x)[base.conditions.run_of]
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


def settle(base: Base, noise: Noise, rounds: int = ROUNDS) -> Settled:
    """Bring base and deviations to where the data with scatter and coloured noise want them.

    Steps are halved where a kink makes them overshoot; the best point by restricted likelihood is
    the one that counts.
    """
    best: tuple[float, Base, Contest] | None = None
    target: tuple[FloatArray, FloatArray] | None = None
    share = 1.0
    least_rms = np.inf
    current = base.copy()
    for _ in range(rounds + 1):
        fixed, precision, scatter, response = columns_of(current, current.at())
        evidence = gather(fixed, precision, scatter, (), response, noise, current.conditions.starts)
        contest = Contest(evidence)
        rms = float(np.sqrt(np.mean(current.residual() ** 2)))
        better = best is None or (contest.null_objective < best[0] and rms < WORSE * least_rms)
        least_rms = rms if best is None else min(least_rms, rms)
        if best is None or better:
            close = best is not None and best[0] - contest.null_objective < SETTLED
            best = (contest.null_objective, current, contest)
            if close:
                break
            index = evidence.index()
            delta, _ = contest.solve(contest.null.matrix.sum(axis=0), index)
            target = (delta, contest.deviations(index, contest.null_omega, delta))
            share = 1.0
        else:
            share *= 0.4
        assert target is not None
        current = best[1].copy()
        take_step(current, best[2].evidence.scale, target[0], target[1], share)
    assert best is not None
    return Settled(best[1], best[2], noise)


def take_step(
    base: Base, scale: FloatArray, delta: FloatArray, own: FloatArray, share: float = 1.0
) -> None:
    """Move the base by a Gauss-Newton step and every run towards its predicted deviations."""
    x, low, high = base.vector()
    step = (delta / scale[: delta.size])[: x.size]
    base.set_vector(np.clip(x + share * step, low, high))
    own = own / scale[delta.size : delta.size + own.shape[1]]
    limit = np.array([DEVIATION_MAX, DEVIATION_MAX, np.inf])
    moved = base.deviations + share * (own[:, : len(DEVIATIONS)] - base.deviations)
    base.deviations = np.clip(moved, -limit, limit)


@dataclass
class Field:
    """All candidates over a settled base."""

    settled: Settled
    contest: Contest
    candidates: dict[str, Candidate]
    closed: dict[str, str]
    projector: Any = None


def make_candidates(
    base: Base, effects: Mapping[str, Effect], ratio: float
) -> tuple[list[Candidate], dict[str, str]]:
    """Named effects and shapes at the base as it stands."""
    point = base.at()
    named, closed = named_candidates(effects, base, point, ratio)
    return [*named, *shapes.smooth_shapes(base, point), *shapes.waves(base)], closed


def make_field(settled: Settled, candidates: Sequence[Candidate], closed: dict[str, str]) -> Field:
    """Gather the evidence of all candidates."""
    base = settled.base
    fixed, precision, scatter, response = columns_of(base, base.at())
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
    return Field(settled, Contest(evidence), {c.name: c for c in candidates}, closed)
