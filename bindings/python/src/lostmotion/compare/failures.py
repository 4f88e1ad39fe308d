"""Where the model fails: the share of the residual that depends on each recorded quantity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.branches import directions
from lostmotion.compare.chance import TINY, common_part, explained_apart, variance_explained
from lostmotion.compare.loops import BLOCKS_LEAST, branch_blocks, time_under_load
from lostmotion.effects.conditions import Conditions

BINS = 16
"""Bins of a covariate; each contains the same number of samples."""

FINE_BINS = 64
"""Bins of the torque and of an angle's turn, in which there may be ripples."""

TORQUE_RANGES = 6
"""Ranges of torque in which differences between runs and quantities that are constant within a run
are examined separately.
"""


@dataclass(frozen=True)
class Failure:
    """How much of the residual depends on one covariate.

    Attributes
    ----------
    covariate : str
    share : float
        Share of the residual variance that bins of the covariate explain, minus the share for
        random signs.
    p : float
        Fraction of random sign patterns of whole blocks that explain as much.
    """

    covariate: str
    share: float
    p: float


def where_it_fails(c: Conditions, residual: FloatArray, seed: int) -> list[Failure]:
    """Rank the recorded quantities by the share of the residual that each explains."""
    torque_bins = quantile_bins(c.torque, FINE_BINS)
    coarse_torque = quantile_bins(c.torque, TORQUE_RANGES)
    turns, travels = _branches(c)
    direction, travel = np.concatenate(turns), np.concatenate(travels)
    stretches = branch_blocks(c.starts, direction)
    runs = c.runs
    blocks = c.run_of if runs >= BLOCKS_LEAST else stretches
    generator = np.random.default_rng(seed)
    failures = []

    def judge(name: str, cells: IntArray, by: IntArray) -> None:
        failures.append(Failure(name, *variance_explained(residual, cells, by, generator)))

    judge("torque", torque_bins, blocks)
    judge("direction", direction, blocks)
    judge("load_history", quantile_bins(travel, BINS), blocks)
    peak = np.maximum.accumulate(np.abs(c.torque))
    judge("largest_torque_before", quantile_bins(peak, BINS), blocks)
    judge("time_in_run", quantile_bins(c.time_s - c.time_s[c.starts[:-1]][c.run_of], BINS), blocks)
    judge("time_under_load", quantile_bins(time_under_load(c), BINS), blocks)
    speed = c.columns.get("input_velocity_rad_s")
    if speed is not None and np.ptp(speed) > 0:
        judge("speed", quantile_bins(speed, BINS), blocks)
    if runs > 1:
        left = residual - common_part(residual, c.run_of, torque_bins)
        share, p = explained_apart(left, c.run_of, coarse_torque, stretches, generator)
        share *= float(np.sum(left**2)) / max(float(np.sum(residual**2)), TINY)
        failures.append(Failure("run", share, p))
    for name in c.campaign.quantities():
        if name in ("run", "time", "torque", "lost_motion"):
            continue
        values = c.campaign.column(name)
        known = np.isfinite(values)
        if not known.any() or np.ptp(values[known]) == 0:
            continue
        values = np.where(known, values, np.mean(values[known]))
        if name in ("input_angle", "output_angle"):
            turn = np.mod(values, 2 * np.pi)
            cells = np.minimum((turn / (2 * np.pi) * FINE_BINS).astype(np.intp), FINE_BINS - 1)
            judge(name, cells, blocks)
        elif np.var(c.run_mean(values)[c.run_of]) > 0.5 * np.var(values):
            # It is constant within a run, so an offset would absorb it. Find the part proportional
            # to it, separately for each range of torque.
            failures.append(
                Failure(
                    name, *variance_explained(residual, coarse_torque, blocks, generator, values)
                )
            )
        else:
            judge(name, quantile_bins(values, BINS), blocks)
    return sorted(failures, key=lambda failure: -failure.share)


def _branches(c: Conditions) -> tuple[list[IntArray], list[FloatArray]]:
    largest = float(np.max(np.abs(c.torque)))
    found = [directions(c.torque[at], largest) for at in c.slices()]
    return [turn for turn, _ in found], [travel for _, travel in found]


def quantile_bins(values: FloatArray, bins: int) -> IntArray:
    """Assign values to bins of equal count; few distinct values get one bin each."""
    levels = np.unique(values)
    if levels.size <= bins:
        return np.searchsorted(levels, values).astype(np.intp)
    edges = np.unique(np.quantile(values, np.linspace(0, 1, bins + 1)[1:-1]))
    return np.searchsorted(edges, values, "right").astype(np.intp)
