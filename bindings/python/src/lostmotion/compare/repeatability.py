"""Repeatability: what no model can explain, from the recordings alone."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.branches import directions
from lostmotion.effects.conditions import Conditions

REPEATABILITY = "repeatability"
"""Reference of an error here; `lostmotion.discover` uses the noise floor instead."""

CALM_SHARE, CALM_VARIANCE = 0.99, 0.92476
"""Share of the smallest second differences from which noise is estimated, and their share of the
variance of normal noise.
"""

PATH_CELLS = 16
"""Cells of a torque path, on either branch, in which runs that repeat each other are compared."""

PATH_CELLS = 16
"""Cells of a torque path, on either branch, in which runs that repeat each other are compared."""

REPEAT_TOLERANCE = 0.05
"""Two runs repeat each other when the extremes of their torque and of all else that was recorded
agree within this share of the largest."""

REPEAT_SLACK = {
    "temperature": 2.0,
    "input_angle": np.deg2rad(5.0),
    "output_angle": np.deg2rad(5.0),
}
"""The same for quantities whose zero is arbitrary, in K and rad."""


@dataclass
class Repeatability:
    """The repeatability of the recordings and its parts, in rad.

    It differs from the noise floor of `lostmotion.discover`, which uses the scatter between runs in
    the model. The JSON answers of both name it ``noise_floor_arcsec``.

    Attributes
    ----------
    within_rad : float
        White noise within runs, from second differences of the residual.
    between_rad : float or None
        Scatter between runs that repeat each other; None if there are none.
    """

    within_rad: float
    between_rad: float | None
    repeats: list[list[int | str]] = field(default_factory=list)

    @property
    def floor_rad(self) -> float:
        """What no model can explain."""
        return float(np.hypot(self.within_rad, self.between_rad or 0.0))

    @property
    def parts(self) -> str:
        """Describe its parts."""
        if self.between_rad is None:
            return "white noise within runs only: no run repeats another"
        return "white noise within runs and differences between runs that repeat each other"


def repeatability_of(c: Conditions, residual: FloatArray) -> Repeatability:
    """Estimate what no model can explain, from the recordings alone.

    Within runs: white noise, from second differences of the residual, at least the rounding of the
    encoder. Between runs: where runs repeat the same torque path under the same conditions, the
    scatter of their residuals at the same point of the path. Runs at a different temperature, angle
    or number of cycles are not repeats: their differences may be what the model lacks.
    """
    second = np.concatenate(
        [np.diff(residual[a:b], 2) for a, b in zip(c.starts[:-1], c.starts[1:], strict=True)]
    )
    within = 0.0
    if second.size:
        # The largest hundredth may hold slips and stick-slip jumps, which are not noise.
        calm = np.sort(np.abs(second))[: max(1, int(CALM_SHARE * second.size))]
        within = float(np.sqrt(np.mean(calm**2) / CALM_VARIANCE / 6.0))
    levels = np.unique(c.campaign.column("lost_motion"))
    if levels.size > 1:
        within = max(within, float(np.min(np.diff(levels))) / np.sqrt(12.0))

    groups: list[list[int]] = []
    lows, highs, slack = _extremes(c)
    for i in range(lows.shape[0]):
        for group in groups:
            first = group[0]
            if np.all(np.abs(lows[i] - lows[first]) <= slack) and np.all(
                np.abs(highs[i] - highs[first]) <= slack
            ):
                group.append(i)
                break
        else:
            groups.append([i])
    groups = [group for group in groups if len(group) > 1]
    squares, weights = [], []
    for group in groups:
        means, counts = _repeat_cells(c, group, residual)
        common = np.all(counts > 0, axis=0)
        if np.any(common):
            means = means[:, common]
            means = means - means.mean(axis=1, keepdims=True)
            squares.append(np.var(means, axis=0, ddof=1))
            weights.append(counts[:, common].sum(axis=0))
    between = None
    if squares:
        between = float(
            np.sqrt(np.average(np.concatenate(squares), weights=np.concatenate(weights)))
        )
    return Repeatability(within, between, [[c.labels[i] for i in group] for group in groups])


def _extremes(c: Conditions) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Range of each recorded quantity in each run, and the tolerance for a repeat."""
    names = [n for n in c.campaign.quantities() if n not in ("run", "time", "lost_motion")]
    values = [[run.columns[name] for name in names] for run in c.campaign.runs]
    # Runs in which a quantity is unknown count as equal in this quantity.
    known = [[v[np.isfinite(v)] for v in run] for run in values]
    lows = np.array([[float(v.min()) if v.size else 0.0 for v in run] for run in known])
    highs = np.array([[float(v.max()) if v.size else 0.0 for v in run] for run in known])
    largest = np.maximum(np.abs(lows).max(axis=0), np.abs(highs).max(axis=0))
    slack = [
        REPEAT_SLACK.get(name, REPEAT_TOLERANCE * top)
        for name, top in zip(names, largest, strict=True)
    ]
    return lows, highs, np.array(slack)


def _repeat_cells(
    c: Conditions, group: list[int], residual: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean residual of each run in cells of torque and direction."""
    slices, largest = c.slices(), float(np.max(np.abs(c.torque)))
    pieces = [slices[i] for i in group]
    edges = np.quantile(
        np.concatenate([c.torque[p] for p in pieces]), np.linspace(0, 1, PATH_CELLS + 1)
    )
    means = np.zeros((len(group), 2 * PATH_CELLS))
    counts = np.zeros((len(group), 2 * PATH_CELLS))
    for row, piece in enumerate(pieces):
        torque = c.torque[piece]
        direction, _ = directions(torque, largest)
        cell = (
            np.clip(np.searchsorted(edges, torque, "right") - 1, 0, PATH_CELLS - 1) * 2 + direction
        )
        counts[row] = np.bincount(cell, minlength=2 * PATH_CELLS)
        sums = np.bincount(cell, residual[piece], 2 * PATH_CELLS)
        means[row] = sums / np.maximum(counts[row], 1)
    return means, counts
