"""Model against measurement: how well the base model fits, and where it fails.

The base model of `lostmotion.base` is fitted to a campaign, tested on runs that the fit has not
seen, and set against the noise floor. What is left is then asked of every recorded quantity: how
much of it hangs on that quantity, and could that be chance?
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.base import (
    FRICTIONS,
    START_STATES,
    Backbone,
    BaseModel,
    Fit,
    Friction,
    Parameters,
    run_plays,
)
from lostmotion.errors import InputError
from lostmotion.recordings import Campaign
from lostmotion.units import ARCSEC

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]

FOLDS_MAX = 8
"""Largest number of fits that leave runs out."""

CLEARLY_BETTER = 0.98
"""A model with more parameters must bring the held-out error below this share of the simpler's."""

BINS = 16
"""Bins of a covariate; each holds the same number of samples."""

TORQUE_RANGES = 6
"""Ranges of torque in which runs, and what stands still within a run, are looked at apart."""

REVERSAL_SHARE = 0.02
"""A turn of the torque counts as a reversal when it goes back by this share of the largest torque,
on either side of the noise."""

FLIPS = 2047
"""Random sign patterns of the test for chance."""

FULL_FLIPS_BLOCKS = 11
"""With no more blocks than this all sign patterns are tried."""

BLOCKS_LEAST = 6
"""Fewer blocks cannot show anything: the smallest p is 2 / 2^blocks."""

REPEAT_TOLERANCE = 0.05
"""Two runs repeat each other when their extreme torques agree within this share of the largest."""

NEEDS: dict[str, tuple[str, ...]] = {
    "temperature": ("thermal_gap", "thermal_stiffness", "thermal_drift", "thermal_friction"),
    "cycles": ("wear",),
    "input_angle": (
        "kinematic_error",
        "kinematic_sideband",
        "stiffness_modulation",
        "lobe_eccentricity",
        "viscous_friction",
        "stribeck_friction",
    ),
    "output_angle": ("output_eccentricity", "kinematic_sideband", "inertia"),
    "tilt_moment": ("output_tilt",),
    "axial_force": ("axial_shift",),
}
"""Effects that cannot be tested without a column."""


@dataclass(frozen=True)
class Failure:
    """How much of the residual hangs on one covariate.

    Attributes
    ----------
    covariate : str
    share : float
        Share of the residual variance that bins of the covariate explain, less what chance gives.
    p : float
        How often random signs of whole blocks of the residual explain as much.
    """

    covariate: str
    share: float
    p: float


@dataclass
class Noise:
    """The noise floor and its parts, in rad.

    Attributes
    ----------
    within_rad : float
        White noise within runs, from second differences of the residual.
    between_rad : float or None
        Scatter between runs that repeat each other; None where none does.
    """

    within_rad: float
    between_rad: float | None
    repeats: list[list[int | str]] = field(default_factory=list)

    @property
    def floor_rad(self) -> float:
        """What no model can explain."""
        return float(np.hypot(self.within_rad, self.between_rad or 0.0))


@dataclass
class Comparison:
    """Result of `compare`. Angles in rad; `answer` gives the JSON answer in arc seconds."""

    campaign: Campaign
    model: BaseModel
    fit: Fit
    heldout_rms_rad: float
    heldout_rad: FloatArray
    heldout_by: str
    frictions: dict[str, tuple[float, float]]
    as_it_stands_rms_rad: float
    noise: Noise
    explained_share: float
    failures: list[Failure]
    not_testable: dict[str, list[str]]

    def by_run(self) -> list[dict[str, Any]]:
        """Error of each run, fitted and held out."""
        rows = []
        for i, run in enumerate(self.campaign.runs):
            at = slice(self.model.starts[i], self.model.starts[i + 1])
            rows.append(
                {
                    "run": run.label,
                    "rms_arcsec": _rms(self.fit.residual_rad[at]) / ARCSEC,
                    "heldout_rms_arcsec": _rms(self.heldout_rad[at]) / ARCSEC,
                    "samples": len(run),
                }
            )
        return rows

    def parameters(self) -> dict[str, Any]:
        """Fitted values by name, with their units."""
        fit = self.fit
        values: dict[str, Any] = {
            f"compliance_{zone}": float(scale)
            for zone, scale in zip(("low", "middle", "high"), fit.parameters.scale, strict=True)
            if zone in fit.fitted_zones
        }
        values["play_radius_Nm"] = [float(r) for r in self.model.radius_Nm]
        values["play_outside_rad_per_Nm"] = [float(w) for w in fit.parameters.outside]
        values["play_inside_share"] = [float(w) for w in fit.parameters.inside]
        values["start_state"] = fit.start_state
        return values

    def answer(self) -> dict[str, Any]:
        """Return the answer of the command, ready for JSON."""
        noise = self.noise
        return {
            "schema": "lostmotion.comparison/1",
            "rms_arcsec": self.fit.rms_rad / ARCSEC,
            "heldout_rms_arcsec": self.heldout_rms_rad / ARCSEC,
            "noise_floor_arcsec": noise.floor_rad / ARCSEC,
            "explained_share": self.explained_share,
            "by_run": self.by_run(),
            "where_it_fails": [
                {"covariate": f.covariate, "share": f.share, "p": f.p} for f in self.failures
            ],
            "unfitted_rms_arcsec": self.as_it_stands_rms_rad / ARCSEC,
            "heldout_by": self.heldout_by,
            "friction": self.fit.friction,
            "frictions": {
                name: {"rms_arcsec": rms / ARCSEC, "heldout_rms_arcsec": heldout / ARCSEC}
                for name, (rms, heldout) in self.frictions.items()
            },
            "parameters": self.parameters(),
            "at_bound": self.fit.at_bound,
            "invertible": self.fit.invertible,
            "noise": {
                "within_runs_arcsec": noise.within_rad / ARCSEC,
                "between_runs_arcsec": None
                if noise.between_rad is None
                else noise.between_rad / ARCSEC,
                "repeated_runs": noise.repeats,
            },
            "not_testable": self.not_testable,
            "findings": [str(finding) for finding in self.campaign.findings],
            "samples": self.campaign.rows,
            "data_fingerprint": self.campaign.fingerprint(),
        }


def compare(
    backbone: Backbone,
    campaign: Campaign,
    *,
    seed: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Comparison:
    """Fit the base model to a campaign and say where it fails.

    Parameters
    ----------
    backbone : Backbone
        The loss-free characteristic of the drive.
    campaign : Campaign
        The recordings.
    seed : int
        Of the random signs in the tests for chance.
    progress : callable, optional
        Called with steps done and steps in all.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        When the torque of the recordings does not vary.
    """
    torque = campaign.column("torque")
    if np.ptp(torque) == 0:
        raise InputError(
            campaign.runs[0].file,
            "torque_Nm",
            f"a constant {torque[0]:.6g} Nm",
            "a torque that varies",
        )
    model = BaseModel(backbone, campaign)
    labels = fold_labels(model)
    folds = list(split_folds(labels, model))
    steps = len(FRICTIONS) * (len(folds) + 1) + 1
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, steps)

    measured = model.centre(model.angle)
    as_it_stands = model.centre(
        model.angle
        - model.predict(Parameters(np.ones(3), *(np.zeros(model.radius_Nm.size) for _ in "oi")))
    )
    model.set_start_state(best_start_state(model))
    step()

    best: tuple[Fit, float, FloatArray] | None = None
    frictions: dict[str, tuple[float, float]] = {}
    for friction in FRICTIONS:
        fit = model.fit(friction)
        step()
        heldout = held_out(model, friction, folds, fit, step)
        rms = _rms(heldout)
        frictions[friction] = (fit.rms_rad, rms)
        if best is None or rms < CLEARLY_BETTER * best[1]:
            best = (fit, rms, heldout)
    assert best is not None
    fit, heldout_rms, heldout = best
    residual = fit.residual_rad
    variance = float(np.sum(measured**2))
    return Comparison(
        campaign,
        model,
        fit,
        heldout_rms,
        heldout,
        "run" if len(campaign.runs) > 1 else "half of the run",
        frictions,
        _rms(as_it_stands),
        noise_floor(model, campaign, residual),
        1.0 - float(np.sum(residual**2)) / variance if variance > 0 else 0.0,
        where_it_fails(model, campaign, residual, seed),
        {
            column: list(effects)
            for column, effects in NEEDS.items()
            if column not in campaign.quantities()
        },
    )


def best_start_state(model: BaseModel) -> float:
    """Find the state of the plays before the first sample that fits best."""
    scores = []
    for state in START_STATES:
        model.set_start_state(state)
        scores.append(model.fit("outside").rms_rad)
    return START_STATES[int(np.argmin(scores))]


def fold_labels(model: BaseModel) -> IntArray:
    """Number the pieces that are left out together: runs, or halves of a single run."""
    if model.starts.size > 2:
        return model.run_of
    return (np.arange(model.torque.size) * 2 // model.torque.size).astype(np.intp)


def split_folds(labels: IntArray, model: BaseModel) -> Iterator[npt.NDArray[np.bool_]]:
    """Yield the samples that each fit may see; at most `FOLDS_MAX` splits."""
    pieces = int(labels[-1]) + 1
    folds = min(pieces, FOLDS_MAX)
    group = labels * folds // pieces
    for fold in range(folds):
        yield group != fold


def held_out(
    model: BaseModel,
    friction: Friction,
    folds: list[npt.NDArray[np.bool_]],
    whole: Fit,
    step: Callable[[], None],
) -> FloatArray:
    """Residual of every sample under a fit without its run; offsets are each run's own."""
    residual = np.zeros(model.torque.size)
    for seen in folds:
        fit = model.fit(friction, seen, whole.parameters)
        unseen = ~seen
        difference = model.angle - model.predict(fit.parameters)
        offset = model.run_means(difference, unseen)
        residual[unseen] = (difference - offset[model.run_of])[unseen]
        step()
    return residual


def directions(torque: FloatArray, largest: float) -> tuple[IntArray, FloatArray]:
    """Direction of the torque and how far it has gone since its last reversal.

    Returns
    -------
    direction : ndarray of int
        1 rising, 0 falling; noise below `REVERSAL_SHARE` of the largest torque does not turn it.
    travel : ndarray
        Torque covered since the last reversal, signed by the direction.
    """
    play = torque + run_plays(np.array([REVERSAL_SHARE * largest]), torque)[:, 0]
    move = np.sign(np.diff(play, prepend=play[0]))
    last = np.maximum.accumulate(np.where(move != 0, np.arange(move.size), 0))
    sign = move[last]
    if np.any(sign != 0):
        sign[sign == 0] = sign[np.flatnonzero(sign)[0]]
    turned = np.flatnonzero(np.diff(sign) != 0) + 1
    begin = np.zeros(sign.size, dtype=np.intp)
    begin[turned] = turned
    begin = np.maximum.accumulate(begin)
    return (sign > 0).astype(np.intp), torque - torque[begin]


def noise_floor(model: BaseModel, campaign: Campaign, residual: FloatArray) -> Noise:
    """Estimate what no model can explain.

    Within runs: white noise, from second differences of the residual, at least the rounding of the
    encoder. Between runs: where runs repeat the same torque path, the scatter of their residuals at
    the same place of the path.
    """
    second = np.concatenate(
        [
            np.diff(residual[a:b], 2)
            for a, b in zip(model.starts[:-1], model.starts[1:], strict=True)
        ]
    )
    within = 0.0
    if second.size:
        # The largest hundredth may hold slips and stick-slip jumps, which are not noise.
        calm = np.sort(np.abs(second))[: max(1, int(0.99 * second.size))]
        within = float(np.sqrt(np.mean(calm**2) / 6.0))
    levels = np.unique(model.angle)
    if levels.size > 1:
        within = max(within, float(np.min(np.diff(levels))) / np.sqrt(12.0))

    groups: list[list[int]] = []
    extremes = [(float(run.torque_Nm.min()), float(run.torque_Nm.max())) for run in campaign.runs]
    slack = REPEAT_TOLERANCE * model.largest_torque_Nm
    for i, pair in enumerate(extremes):
        for group in groups:
            if np.allclose(pair, extremes[group[0]], rtol=0, atol=slack):
                group.append(i)
                break
        else:
            groups.append([i])
    groups = [group for group in groups if len(group) > 1]
    squares, weights = [], []
    for group in groups:
        means, counts = _repeat_cells(model, group, residual)
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
    return Noise(within, between, [[campaign.runs[i].label for i in group] for group in groups])


def _repeat_cells(
    model: BaseModel, group: list[int], residual: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean residual of each run in cells of torque and direction."""
    pieces = [slice(model.starts[i], model.starts[i + 1]) for i in group]
    edges = np.quantile(
        np.concatenate([model.torque[p] for p in pieces]), np.linspace(0, 1, BINS + 1)
    )
    means = np.zeros((len(group), 2 * BINS))
    counts = np.zeros((len(group), 2 * BINS))
    for row, piece in enumerate(pieces):
        torque = model.torque[piece]
        direction, _ = directions(torque, model.largest_torque_Nm)
        cell = np.clip(np.searchsorted(edges, torque, "right") - 1, 0, BINS - 1) * 2 + direction
        counts[row] = np.bincount(cell, minlength=2 * BINS)
        sums = np.bincount(cell, residual[piece], 2 * BINS)
        means[row] = sums / np.maximum(counts[row], 1)
    return means, counts


def where_it_fails(
    model: BaseModel, campaign: Campaign, residual: FloatArray, seed: int
) -> list[Failure]:
    """Rank the recorded quantities by the share of the residual that each explains."""
    torque_bins = quantile_bins(model.torque, BINS)
    coarse_torque = quantile_bins(model.torque, TORQUE_RANGES)
    turns, travels = _branches(model)
    direction, travel = np.concatenate(turns), np.concatenate(travels)
    stretches = branch_blocks(model, direction)
    runs = model.starts.size - 1
    blocks = model.run_of if runs >= BLOCKS_LEAST else stretches
    generator = np.random.default_rng(seed)
    failures = []

    def judge(name: str, cells: IntArray, by: IntArray) -> None:
        failures.append(Failure(name, *explained(residual, cells, by, generator)))

    judge("torque", torque_bins, blocks)
    judge("direction", direction, blocks)
    judge("load_history", quantile_bins(travel, BINS), blocks)
    peak = np.maximum.accumulate(np.abs(model.torque))
    judge("largest_torque_before", quantile_bins(peak, BINS), blocks)
    judge("time_in_run", quantile_bins(_time_in_run(campaign), BINS), blocks)
    if runs > 1:
        judge("run", model.run_of * TORQUE_RANGES + coarse_torque, stretches)
    for name in campaign.quantities():
        if name in ("run", "time", "torque", "lost_motion"):
            continue
        values = campaign.column(name)
        known = np.isfinite(values)
        if not known.any() or np.ptp(values[known]) == 0:
            continue
        values = np.where(known, values, np.mean(values[known]))
        if name in ("input_angle", "output_angle"):
            turn = np.mod(values, 2 * np.pi)
            cells = np.minimum((turn / (2 * np.pi) * BINS).astype(np.intp), BINS - 1)
            judge(name, cells, blocks)
        elif np.var(model.run_means(values)[model.run_of]) > 0.5 * np.var(values):
            # It stands still within a run, where an offset would swallow it: look for what grows
            # with it in proportion, apart for each range of torque.
            failures.append(
                Failure(name, *explained(residual, coarse_torque, blocks, generator, values))
            )
        else:
            judge(name, quantile_bins(values, BINS), blocks)
    return sorted(failures, key=lambda failure: -failure.share)


def _branches(model: BaseModel) -> tuple[list[IntArray], list[FloatArray]]:
    turns, travels = [], []
    for a, b in zip(model.starts[:-1], model.starts[1:], strict=True):
        turn, travel = directions(model.torque[a:b], model.largest_torque_Nm)
        turns.append(turn)
        travels.append(travel)
    return turns, travels


def _time_in_run(campaign: Campaign) -> FloatArray:
    return np.concatenate([run.time_s - run.time_s[0] for run in campaign.runs])


def branch_blocks(model: BaseModel, direction: IntArray) -> IntArray:
    """Number the stretches between reversals; long ones are cut until there are enough."""
    change = np.diff(direction, prepend=direction[0]) != 0
    change[model.starts[1:-1]] = True
    blocks = np.cumsum(change)
    pieces = int(blocks[-1]) + 1
    if pieces < BLOCKS_LEAST:
        cut = -(-BLOCKS_LEAST // pieces)
        size = np.bincount(blocks)
        first = np.concatenate(([0], np.cumsum(size)[:-1]))
        inside = (np.arange(blocks.size) - first[blocks]) * cut // size[blocks]
        blocks = blocks * cut + inside
    return blocks.astype(np.intp)


def quantile_bins(values: FloatArray, bins: int) -> IntArray:
    """Number the bins of equal count that values fall into; few distinct values keep their own."""
    levels = np.unique(values)
    if levels.size <= bins:
        return np.searchsorted(levels, values).astype(np.intp)
    edges = np.unique(np.quantile(values, np.linspace(0, 1, bins + 1)[1:-1]))
    return np.searchsorted(edges, values, "right").astype(np.intp)


def explained(
    residual: FloatArray,
    cells: IntArray,
    blocks: IntArray,
    generator: np.random.Generator,
    covariate: FloatArray | None = None,
) -> tuple[float, float]:
    """Share of the variance that cells explain beyond chance, and its p.

    A cell explains its mean, or, with a covariate, what grows with it in proportion.

    Chance is what remains when whole blocks of the residual get random signs: their inner
    correlation stays, their agreement with each other goes.

    Returns
    -------
    share : float
        0 to 1.
    p : float
        The pattern as measured counts as one of the patterns.
    """
    _, cells = np.unique(cells, return_inverse=True)
    _, blocks = np.unique(blocks, return_inverse=True)
    width = int(cells.max()) + 1
    height = int(blocks.max()) + 1
    weight = np.ones(residual.size)
    if covariate is not None:
        weight = covariate - (np.bincount(cells, covariate) / np.bincount(cells))[cells]
    size = np.bincount(cells, weight**2)
    sums = np.bincount(blocks * width + cells, weight * residual, width * height)
    scaled = sums.reshape(height, width) / np.sqrt(np.where(size > 0, size, 1.0))
    total = float(np.sum(residual**2))
    if total == 0:
        return 0.0, 1.0
    if height <= FULL_FLIPS_BLOCKS:
        patterns = (np.arange(2 ** (height - 1))[:, None] >> np.arange(height)) & 1
    else:
        patterns = generator.integers(0, 2, (FLIPS, height))
        patterns[0] = 0
    signs = 1.0 - 2.0 * patterns
    shares = np.sum((signs @ scaled) ** 2, axis=1) / total
    observed = shares[0]
    p = float(np.mean(shares >= observed * (1 - 1e-12)))
    chance = float(np.mean(shares))
    return max(0.0, float((observed - chance) / (1.0 - chance))) if chance < 1 else 0.0, p


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
