"""The torsion curve of a loop as three straight lines, by least squares.

The angle of a loop at a torque is

    angle = offset + f(T) + s W(|T|),      s = 1 on the falling branch, -1 on the rising one,

with the mean curve ``f``, odd and made of slopes 1/K1 up to T1, 1/K2 up to T2 and 1/K3 above, and
half the width of the loop ``W``, even, straight between nodes. Both are estimated together, so that
a branch recorded on only one side of zero does not shift the mean curve. Torques have equal weight
(`stretches.cell_means`), and every loop has its own offset. With backlash, ``f`` also has a step at
zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache, cached_property, lru_cache
from itertools import combinations, pairwise

import numpy as np
from scipy import optimize, special

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.characterize.loop_regression import (
    ScaledColumns,
    blocks_of,
    covariance_of,
    is_shared,
    shared_rms,
    without_loop_means,
)
from lostmotion.characterize.stretches import CELLS, FEW_READINGS, Samples
from lostmotion.rms import rms_of

VALUES_SHARE = 0.6
"""Largest ratio of values to readings for few readings; the rest determines the errors: five
readings determine an offset, a slope and a width.
"""

WIDTH_NODES = (*np.arange(0.0, 0.9, 0.05), 0.9, 0.925, 0.95, 0.975, 1.0)
"""Nodes of the half width over the amplitude, closer at the tips, where it closes."""

WIDTH_NODES_LEAST = 6
"""Least number of nodes: with fewer, a loop has too few samples to show where it closes."""

NODE_LEVELS = 2
"""Least number of torques per branch between two nodes: a straight line needs two."""

DEVELOPED = 0.9
"""A loop with at least this share of its usual width at `TRANSITION_MOST` is fully developed."""

TRANSITION_MOST = 0.5
"""A loop that is fully developed up to this share of its amplitude has transitions after its tips.
One that closes like an ellipse is developed to a third of it.
"""

CONFIDENCE = 0.95
"""Confidence level of every interval."""

KINKS = np.linspace(0.06, 0.94, 45)
"""Grid of the kink search, relative to the amplitude."""

KINK_APART = 0.06
"""Two kinks, or a kink and an end, are at least this share of the amplitude apart: a slope needs a
range of torque.
"""

KINK_WALD = 8.68
"""Critical Wald statistic of a change of slope at an unknown torque: 5 %
critical value for one parameter, 15 % trimmed at either end (Andrews, Econometrica 71 (2003),
p. 395)."""


@dataclass(frozen=True)
class CurveFit:
    """A torsion curve with one to three slopes, and the loop around it.

    Attributes
    ----------
    kinks_Nm : ndarray
        Torques at which the slope changes, in rising order; at most two.
    slopes_rad_per_Nm : ndarray
        One more than kinks.
    step_rad, takeup_Nm : float
        Step of the curve on either side of zero, and the torque at which it is complete; 0 if none.
    half_width_rad : ndarray
        At `nodes_Nm`; empty if only one branch was recorded.
    covariance : ndarray
        Of slopes, kinks, the step where there is one, and half widths, in this order.
    dof, kink_dof : float
        Degrees of freedom of figures, and of changes of slope, which use all blocks.
    residual_rad : ndarray
    kink_intervals_Nm : list of tuple
        Intervals of kinks from the profile likelihood, for few readings; otherwise empty.
    """

    kinks_Nm: FloatArray
    slopes_rad_per_Nm: FloatArray
    step_rad: float
    takeup_Nm: float
    half_width_rad: FloatArray
    nodes_Nm: FloatArray
    covariance: FloatArray
    dof: float
    kink_dof: float
    residual_rad: FloatArray
    kink_intervals_Nm: list[tuple[float, float]] = field(default_factory=list)
    shared_rad: float = 0.0
    """Common residual of the loops if it is large; else 0."""

    @property
    def rms_rad(self) -> float:
        """Residual of the loop after the lines and the width."""
        return rms_of(self.residual_rad)

    @property
    def critical(self) -> float:
        """Critical value of t for a kink or a step at these degrees of freedom."""
        return -float(special.stdtrit(self.kink_dof, special.ndtr(-np.sqrt(KINK_WALD))))

    def kinks_shown(self) -> bool:
        """Whether every change of slope is significant."""
        c = self.covariance
        for i in range(self.kinks_Nm.size):
            change = self.slopes_rad_per_Nm[i + 1] - self.slopes_rad_per_Nm[i]
            variance = max(c[i, i] + c[i + 1, i + 1] - 2.0 * c[i, i + 1], 0.0)
            if change**2 <= self.critical**2 * variance:
                return False
        return True

    @property
    def step_variance(self) -> float:
        """Variance of the step."""
        at = self.slopes_rad_per_Nm.size + self.kinks_Nm.size
        return float(self.covariance[at, at]) if self.takeup_Nm > 0 else 0.0

    @property
    def width_variance(self) -> float:
        """Variance of the half width at zero torque."""
        at = self.slopes_rad_per_Nm.size + self.kinks_Nm.size + (self.takeup_Nm > 0)
        return float(self.covariance[at, at])

    def angle(self, torque_Nm: FloatArray) -> FloatArray:
        """Mean curve in rad, with the step."""
        columns = curve_columns(torque_Nm, self.kinks_Nm)
        out = columns @ self.slopes_rad_per_Nm
        if self.takeup_Nm > 0:
            out = out + self.step_rad * step_column(torque_Nm, self.takeup_Nm)
        return np.asarray(out)


def curve_columns(torque_Nm: FloatArray, kinks_Nm: FloatArray) -> FloatArray:
    """Columns of the slopes: signed part of a torque in each segment."""
    size = np.abs(torque_Nm)
    ends = np.concatenate(([0.0], kinks_Nm, [np.inf]))
    parts = [np.clip(size, a, b) - a for a, b in pairwise(ends)]
    return np.asarray(np.sign(torque_Nm)[:, None] * np.column_stack(parts))


def kink_columns(torque_Nm: FloatArray, kinks_Nm: FloatArray, slopes: FloatArray) -> FloatArray:
    """Derivatives of the curve by the torques of its kinks."""
    size, sign = np.abs(torque_Nm), np.sign(torque_Nm)
    moved = np.zeros((torque_Nm.size, kinks_Nm.size))
    for i, kink in enumerate(kinks_Nm):
        moved[:, i] = sign * (size > kink) * (slopes[i] - slopes[i + 1])
    return moved


def step_column(torque_Nm: FloatArray, takeup_Nm: float) -> FloatArray:
    """Step about zero that is complete at a torque."""
    return np.asarray(np.clip(torque_Nm / takeup_Nm, -1.0, 1.0))


def hats(values: FloatArray, nodes: FloatArray) -> FloatArray:
    """Columns of a function that is linear between nodes and constant beyond them."""
    return np.column_stack([np.interp(values, nodes, row) for row in np.eye(nodes.size)])


def supported(samples: Samples, nodes: FloatArray) -> FloatArray:
    """Nodes with enough samples between them for a straight line; the first one is kept."""
    sizes = [
        np.sort(np.abs(samples.torque_Nm[at]))
        for at in (samples.falling > 0, samples.falling < 0)
        if np.any(at)
    ]
    cells = [np.cumsum(np.diff(np.floor(size / samples.cell_Nm), prepend=-1) > 0) for size in sizes]

    def levels(low: float, high: float) -> int:
        ends = [np.searchsorted(size, (low, high), "right") for size in sizes]
        return min(
            int(cell[b - 1] - cell[a]) + 1 if b > a else 0
            for cell, (a, b) in zip(cells, ends, strict=True)
        )

    kept = [float(nodes[0])]
    for node in nodes[1:]:
        if levels(kept[-1] if len(kept) > 1 else -1.0, float(node)) >= NODE_LEVELS:
            kept.append(float(node))
    if len(kept) > 1 and levels(kept[-1], np.inf) > 0:
        kept[-1] = float(nodes[-1])  # samples beyond the last node belong to it
    return np.asarray(kept)


@lru_cache(maxsize=2)
def width_columns(samples: Samples) -> tuple[FloatArray, FloatArray]:
    """Columns of the half width of the loop, and their nodes in N m."""
    if not samples.both_branches:
        return np.zeros((samples.torque_Nm.size, 0)), np.zeros(0)
    if samples.readings < FEW_READINGS:
        return samples.falling[:, None], np.zeros(1)
    nodes = supported(samples, np.array(WIDTH_NODES) * samples.amplitude_Nm)
    nodes = nodes[nodes <= samples.width_reach_Nm]
    return samples.falling[:, None] * hats(np.abs(samples.torque_Nm), nodes), nodes


@dataclass(frozen=True)
class FreeLoop:
    """A loop with a mean curve of any shape: offset of every loop, half widths at their nodes."""

    samples: Samples
    design: ScaledColumns
    found: FloatArray
    residual_rad: FloatArray
    offsets_rad: FloatArray
    widths: slice

    @property
    def half_width_rad(self) -> FloatArray:
        """Half widths."""
        return self.found[self.widths]

    def width_errors(self) -> tuple[FloatArray, float]:
        """Variances of the half widths, and their degrees of freedom."""
        fitted = self.design.columns @ self.found
        covariance, dof = covariance_of(self.samples, self.design, self.residual_rad, fitted)
        return np.diag(covariance)[self.widths], dof


@lru_cache(maxsize=2)
def free_loop(samples: Samples) -> FreeLoop:
    """Fit a mean curve of any shape."""
    width, _ = width_columns(samples)
    nodes = supported(samples, np.array(WIDTH_NODES) * samples.amplitude_Nm)
    curve = np.sign(samples.torque_Nm)[:, None] * hats(np.abs(samples.torque_Nm), nodes)
    columns = np.column_stack([curve[:, 1:], width])
    angle = samples.angle_rad
    design = ScaledColumns(without_loop_means(columns, samples.loop))
    target = without_loop_means(angle[:, None], samples.loop)[:, 0]
    found = design.fit(target)
    left = angle - columns @ found
    offsets = np.bincount(samples.loop, left) / np.maximum(np.bincount(samples.loop), 1)
    widths = slice(nodes.size - 1, None)
    return FreeLoop(samples, design, found, target - design.columns @ found, offsets, widths)


def developed(samples: Samples) -> Samples:
    """Leave out the transitions after the tips, where the loop is not fully developed.

    After a tip the drive sticks until friction has reversed, and the middle of the loop bends
    towards the branch that led to the tip. If the loop has constant width outside these
    transitions, the curve at the tips is that of the branch that leads there, half that width
    apart. A transition begins where the width is significantly below the usual one; the rest of it
    would bend the curve. A loop that closes gradually is used as it is.
    """
    _, nodes = width_columns(samples)
    if nodes.size < WIDTH_NODES_LEAST:
        return samples
    loop = free_loop(samples)
    share = nodes / samples.amplitude_Nm
    inside = share <= TRANSITION_MOST
    usual = float(np.median(loop.half_width_rad[inside]))
    if usual <= 0 or np.any(loop.half_width_rad[inside] < DEVELOPED * usual):
        return samples
    variance, dof = loop.width_errors()
    error = np.sqrt(np.maximum(variance, 0.0))
    closed = usual - loop.half_width_rad > special.stdtrit(dof, CONFIDENCE) * error
    closed &= ~inside
    if not np.any(closed):
        return samples
    return samples.without_transitions(float(nodes[int(np.argmax(closed)) - 1]))


def slopes_have_room(kinks: FloatArray) -> bool:
    """Whether every slope has its own range of torque; kinks as shares of the amplitude."""
    return bool(np.all(np.diff([0.0, *kinks, 1.0]) >= KINK_APART - 1e-9))


@cache
def kink_choices(count: int) -> IntArray:
    """Grid positions of a number of kinks, one row per choice."""
    return np.array(
        [k for k in combinations(range(KINKS.size), count) if slopes_have_room(KINKS[list(k)])]
    )


class KinkSearch:
    """Search for the kinks of a curve; all linear parameters are eliminated."""

    def __init__(self, samples: Samples, width: FloatArray, takeup_Nm: float) -> None:
        self.reach_Nm = samples.amplitude_Nm
        # Loops differ by noise and offset only, so their mean has the same kinks.
        if samples.readings < FEW_READINGS:
            group = np.arange(samples.torque_Nm.size)
            angle = without_loop_means(samples.angle_rad[:, None], samples.loop)[:, 0]
        else:
            cell = np.round(samples.torque_Nm / self.reach_Nm * CELLS / 2).astype(np.intp)
            branch = (samples.falling > 0) * (int(np.ptp(cell)) + 1)
            _, group = np.unique(branch + cell, return_inverse=True)
            angle = samples.angle_rad - free_loop(samples).offsets_rad[samples.loop]
        count = np.bincount(group)

        def mean(values: FloatArray) -> FloatArray:
            return np.asarray(np.bincount(group, values) / count)

        self.torque = mean(samples.torque_Nm)
        always = [np.ones(self.torque.size), *(mean(column) for column in width.T)]
        if takeup_Nm > 0:
            always.append(step_column(self.torque, takeup_Nm))
        always = [column / max(float(np.linalg.norm(column)), 1e-300) for column in always]
        left, size, _ = np.linalg.svd(np.column_stack(always), full_matrices=False)
        self.basis = left[:, size > 1e-9 * size[0]]
        self.target = self.rest(mean(angle)[:, None])[:, 0]

    def rest(self, columns: FloatArray) -> FloatArray:
        """Remove what offset, width and step explain."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))

    def hinges(self, kinks_Nm: FloatArray) -> FloatArray:
        """Hinge columns at each torque, and the straight line."""
        size, sign = np.abs(self.torque), np.sign(self.torque)
        starts = np.concatenate(([0.0], kinks_Nm))
        return self.rest(sign[:, None] * np.maximum(size[:, None] - starts, 0.0)) / self.reach_Nm

    def error(self, kinks_Nm: FloatArray) -> float:
        """Sum of squares with kinks at these torques, for the best slopes."""
        columns = self.hinges(kinks_Nm)
        left = self.target - columns @ np.linalg.lstsq(columns, self.target, rcond=1e-10)[0]
        return float(left @ left)

    @cached_property
    def grid(self) -> tuple[FloatArray, FloatArray]:
        """Products of the columns of all grid kinks, with each other and with the angle."""
        columns = self.hinges(KINKS * self.reach_Nm)
        return columns.T @ columns, columns.T @ self.target

    def errors(self, count: int) -> tuple[FloatArray, FloatArray]:
        """Choices of grid kinks, one per row, and their sums of squares."""
        chosen = kink_choices(count)
        index = np.column_stack((np.zeros(len(chosen), dtype=np.intp), chosen + 1))
        products, across = self.grid
        gram = products[index[:, :, None], index[:, None, :]]
        gram = gram + 1e-12 * np.trace(products) * np.eye(count + 1)
        right = across[index]
        explained = np.sum(right * np.linalg.solve(gram, right[:, :, None])[:, :, 0], axis=1)
        return KINKS[chosen], float(self.target @ self.target) - explained

    def best(self, count: int) -> FloatArray:
        """Torques of the kinks with the least error, by a grid and a simplex search."""
        if count == 0:
            return np.zeros(0)
        choices, squares = self.errors(count)
        start = choices[int(np.argmin(squares))]
        scale = self.error(start * self.reach_Nm) or 1.0

        def error(kinks: FloatArray) -> float:
            return self.error(kinks * self.reach_Nm) / scale if slopes_have_room(kinks) else np.inf

        found = optimize.minimize(
            error, start, method="Nelder-Mead", options={"xatol": 1e-5, "fatol": 1e-9}
        )
        return np.asarray(found.x * self.reach_Nm)

    def intervals(
        self, kinks_Nm: FloatArray, dof: float, least: float
    ) -> list[tuple[float, float]]:
        """Intervals of kinks by their profile likelihood, on the grid and rounded outwards.

        Between readings that are far apart the error of a kink is not described by a linear
        estimate.

        Parameters
        ----------
        kinks_Nm : ndarray
            The best ones.
        dof : float
            Degrees of freedom of the error.
        least : float
            Least variance of a reading.
        """
        if kinks_Nm.size == 0:
            return []
        choices, squares = self.errors(kinks_Nm.size)
        best = min(self.error(kinks_Nm), float(squares.min()))
        t = float(special.stdtrit(dof, 0.5 + CONFIDENCE / 2.0))
        within = choices[squares <= best + t**2 * max(best / dof, least)]
        step = float(KINKS[1] - KINKS[0])
        found = []
        for i, kink in enumerate(kinks_Nm / self.reach_Nm):
            low = min([*(within[:, i] - step), kink])
            high = max([*(within[:, i] + step), kink])
            found.append((max(low, 0.0) * self.reach_Nm, min(high, 1.0) * self.reach_Nm))
        return found


@dataclass(frozen=True)
class Lines:
    """Lines of a curve by least squares, without errors."""

    samples: Samples
    kinks_Nm: FloatArray
    takeup_Nm: float
    linear: FloatArray
    found: FloatArray
    residual_rad: FloatArray
    search: KinkSearch

    def with_errors(self) -> CurveFit:
        """Return the curve with its errors."""
        samples, kinks = self.samples, self.kinks_Nm
        found, residual = self.found, self.residual_rad
        slopes, step = kinks.size + 1, int(self.takeup_Nm > 0)
        moved = without_loop_means(
            kink_columns(samples.torque_Nm, kinks, found[:slopes]), samples.loop
        )
        design = ScaledColumns(
            np.column_stack([self.linear[:, :slopes], moved, self.linear[:, slopes:]])
        )
        fitted = self.linear @ found
        covariance, dof = covariance_of(samples, design, residual, fitted)
        many = samples.readings >= FEW_READINGS
        least = samples.resolution_rad**2 / 12.0
        return CurveFit(
            kinks,
            found[:slopes],
            float(found[slopes]) if step else 0.0,
            self.takeup_Nm,
            found[slopes + step :],
            width_columns(samples)[1],
            covariance,
            dof,
            max(dof, float(np.unique(blocks_of(samples)).size - 1)) if many else dof,
            residual,
            [] if many else self.search.intervals(kinks, dof, least),
            shared_rms(samples, residual) if is_shared(samples, residual, fitted) else 0.0,
        )


def fit_lines(samples: Samples, slopes: int, takeup_Nm: float = 0.0) -> Lines:
    """Fit a curve of one to three slopes to the loops, with or without a step at zero.

    Parameters
    ----------
    samples : Samples
    slopes : int
    takeup_Nm : float
        Torque at which the step is complete; 0 for no step.
    """
    width, _ = width_columns(samples)
    search = KinkSearch(samples, width, takeup_Nm)
    kinks = search.best(slopes - 1)
    torque, loop = samples.torque_Nm, samples.loop
    step = [step_column(torque, takeup_Nm)] if takeup_Nm > 0 else []
    linear = without_loop_means(np.column_stack([curve_columns(torque, kinks), *step, width]), loop)
    angle = without_loop_means(samples.angle_rad[:, None], loop)[:, 0]
    found = ScaledColumns(linear).fit(angle)
    return Lines(samples, kinks, takeup_Nm, linear, found, angle - linear @ found, search)


def fit_slopes(samples: Samples, slopes: int, takeup_Nm: float = 0.0) -> CurveFit:
    """Fit a curve as `fit_lines` does, with errors."""
    return fit_lines(samples, slopes, takeup_Nm).with_errors()


FEW_KINK_WALD = 11.72
"""The same for a slope and its torque together, two parameters: for few readings the decrease of
the sum of squares is tested, because the error of a kink between readings is not linear.
"""


def falls_enough(samples: Samples, fewer: CurveFit, more: CurveFit) -> bool:
    """Whether another slope significantly lowers the error of few readings."""
    before, after = (float(fit.residual_rad @ fit.residual_rad) for fit in (fewer, more))
    variance = max(after / more.dof, samples.resolution_rad**2 / 12.0)
    limit = float(special.fdtri(2, more.dof, special.chdtr(2, FEW_KINK_WALD)))
    return before - after > 2.0 * limit * variance


def left_out(samples: Samples, fit: CurveFit) -> FloatArray:
    """Residual of every sample for a linearised fit without it, in rad."""
    width, _ = width_columns(samples)
    torque = samples.torque_Nm
    offsets = np.eye(int(samples.loop.max()) + 1)[samples.loop]
    curve = curve_columns(torque, fit.kinks_Nm)
    moved = kink_columns(torque, fit.kinks_Nm, fit.slopes_rad_per_Nm)
    columns = np.column_stack([offsets, curve, moved, width])
    vectors, size, _ = np.linalg.svd(ScaledColumns(columns).scaled, full_matrices=False)
    vectors = vectors[:, size > 1e-9 * size[0]]
    weight = np.sum(vectors**2, axis=1)
    return np.asarray(fit.residual_rad / np.maximum(1.0 - weight, 1e-9))


def values_carried(samples: Samples) -> int:
    """Largest number of slopes that the readings determine: three, or fewer for few readings."""
    if samples.readings >= FEW_READINGS:
        return 3
    flat = int(np.unique(samples.loop).size) + int(samples.both_branches)
    spare = VALUES_SHARE * samples.torque_Nm.size - flat
    return max(0, min(3, int((spare + 1.0) // 2.0)))
