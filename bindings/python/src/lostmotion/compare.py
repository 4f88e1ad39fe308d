"""Model against measurement: how well the base model fits, and where it fails.

The base of `lostmotion.discover.base`, the one that `diagnose` starts from, is fitted to a
campaign, tested on runs that the fit has not seen, and set against the repeatability of the
recordings. What is left is
then asked of every recorded quantity: how much of it hangs on that quantity, and could that be
chance?
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.backbone import Backbone, run_plays
from lostmotion.discover.base import Base
from lostmotion.discover.candidates import closed_by_columns
from lostmotion.discover.conditions import Conditions
from lostmotion.discover.drive_base import make_base
from lostmotion.discover.effects import Effect, library
from lostmotion.discover.held_out import CLEARLY_BETTER, Friction, held_out_residual
from lostmotion.discover.threads import one_thread
from lostmotion.drives import Drive
from lostmotion.errors import InputError, given_as
from lostmotion.model import make_backbone
from lostmotion.recordings import Campaign, told
from lostmotion.recordings.scale import TINY
from lostmotion.units import ARCMIN, ARCSEC

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]

REPEATABILITY = "repeatability"
"""What an error is set against here; `lostmotion.discover` has a noise floor instead."""

CALM_SHARE, CALM_VARIANCE = 0.99, 0.92476
"""Share of the second differences that noise is told from, the smallest ones, and the share of the
variance of normal noise that they have."""

STEPS = 25
"""Evaluations of a fit."""

BINS = 16
"""Bins of a covariate; each holds the same number of samples."""

FINE_BINS = 64
"""Bins of the torque and of an angle's turn, in which there may be ripples."""

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
"""Two runs repeat each other when the extremes of their torque and of all else that was recorded
agree within this share of the largest."""

REPEAT_SLACK = {
    "temperature": 2.0,
    "input_angle": np.deg2rad(5.0),
    "output_angle": np.deg2rad(5.0),
}
"""The same for quantities whose zero is arbitrary, in K and rad."""

LOADED_SHARE = 0.1
"""Above this share of the largest torque the drive counts as loaded."""

WIDTH_SHARE = 0.05
"""The width at zero is read from samples within this share of a run's largest torque."""

WIDTH_SAMPLES = 5
"""Fewer samples of a branch about zero show no width."""


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
    """The repeatability of the recordings and its parts, in rad.

    The noise floor of `lostmotion.discover` is another: there the model says what scatters between
    runs. The JSON answers of both name it ``noise_floor_arcsec``.

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

    @property
    def parts(self) -> str:
        """Say of what it consists."""
        if self.between_rad is None:
            return "white noise within runs alone: no run repeats another"
        return "white noise within runs, and how far runs that repeat each other differ"


@dataclass
class Comparison:
    """Result of `compare`. Angles in rad; `answer` gives the JSON answer in arc seconds.

    Attributes
    ----------
    base : Base
        As it was fitted.
    friction : {"inside", "both"}
        Where the friction sits: inside the elasticity, or outside as well.
    offset_rad : ndarray
        One a run.
    residual_rad, heldout_rad : ndarray
        Measured minus model of every sample, fitted and held out.
    seen : ndarray of bool
        Runs that were fitted.
    frictions : dict
        Fitted and held-out error of either form.
    """

    campaign: Campaign
    base: Base
    friction: Friction
    offset_rad: FloatArray
    residual_rad: FloatArray
    heldout_rad: FloatArray
    heldout_by: str
    seen: npt.NDArray[np.bool_]
    frictions: dict[str, tuple[float, float]]
    as_it_stands_rms_rad: float
    noise: Noise
    explained_share: float
    failures: list[Failure]
    not_testable: dict[str, list[str]]

    def __repr__(self) -> str:
        """Say what came out; the residuals fill screens."""
        return (
            f"<Comparison of {self.campaign!r}: rms {self.rms_rad / ARCSEC:.3g} arcsec, "
            f"held out {self.heldout_rms_rad / ARCSEC:.3g}>"
        )

    @property
    def starts(self) -> IntArray:
        """Offsets of the runs."""
        return self.base.conditions.starts

    @property
    def run_of(self) -> IntArray:
        """Run of every sample."""
        return self.base.conditions.run_of

    @property
    def torque_Nm(self) -> FloatArray:
        """Torque of every sample."""
        return self.base.conditions.torque

    @property
    def measured_rad(self) -> FloatArray:
        """Lost motion of every sample, each run about its own zero."""
        return self.base.conditions.lost_motion * ARCSEC - self.offset_rad[self.run_of]

    @property
    def rms_rad(self) -> float:
        """Fitted error over the runs that were fitted."""
        return rms_of(self.residual_rad[self.seen[self.run_of]])

    @property
    def heldout_rms_rad(self) -> float:
        """Error over runs that the fit has not seen."""
        unseen = ~self.seen[self.run_of]
        return rms_of(self.heldout_rad[unseen] if unseen.any() else self.heldout_rad)

    def by_run(self) -> list[dict[str, Any]]:
        """Error of each run, fitted and held out, and the width of its loop at zero torque."""
        rows = []
        measured = self.measured_rad
        for i, (run, at) in enumerate(
            zip(self.campaign.runs, self.base.conditions.slices(), strict=True)
        ):
            width = zero_widths(
                self.torque_Nm[at], np.column_stack((measured[at], self.residual_rad[at]))
            )
            rows.append(
                {
                    "run": run.label,
                    "rms_arcsec": rms_of(self.residual_rad[at]) / ARCSEC,
                    "heldout_rms_arcsec": rms_of(self.heldout_rad[at]) / ARCSEC,
                    "samples": len(run),
                    "fitted": bool(self.seen[i]),
                    "width_at_zero_arcmin": None if width is None else float(width[0]) / ARCMIN,
                    "model_width_at_zero_arcmin": None
                    if width is None
                    else float(width[0] - width[1]) / ARCMIN,
                }
            )
        return rows

    def parameters(self) -> dict[str, Any]:
        """Fitted values by name, with their units."""
        base = self.base
        outside = np.zeros(base.shares.size) if base.outside is None else base.outside
        return {
            "knot_Nm": [float(x) for x in base.knots_Nm],
            "slope_rad_per_Nm": [float(x) for x in base.slopes * ARCSEC],
            "play_radius_Nm": [float(x) for x in base.radius_Nm],
            "play_inside_share": [float(x) for x in base.shares],
            "play_outside_rad_per_Nm": [float(x) for x in outside * ARCSEC],
            "start_state": [float(x) for x in base.start[0]],
        }

    @property
    def invertible(self) -> bool:
        """Whether the angle never falls with rising torque while every play sticks."""
        base = self.base
        outside = 0.0 if base.outside is None else float(base.outside.sum())
        return bool((1.0 - base.shares.sum()) * float(base.slopes.min()) >= outside)

    def answer(self) -> dict[str, Any]:
        """Return the answer of the command, ready for JSON."""
        noise = self.noise
        return {
            "schema": "lostmotion.comparison/1",
            "rms_arcsec": self.rms_rad / ARCSEC,
            "heldout_rms_arcsec": self.heldout_rms_rad / ARCSEC,
            "noise_floor_arcsec": noise.floor_rad / ARCSEC,
            "explained_share": self.explained_share,
            "by_run": self.by_run(),
            "where_it_fails": [
                {"covariate": f.covariate, "share": f.share, "p": f.p} for f in self.failures
            ],
            "unfitted_rms_arcsec": self.as_it_stands_rms_rad / ARCSEC,
            "heldout_by": self.heldout_by,
            "friction": self.friction,
            "frictions": {
                name: {"rms_arcsec": rms / ARCSEC, "heldout_rms_arcsec": heldout / ARCSEC}
                for name, (rms, heldout) in self.frictions.items()
            },
            "effects": [term.effect.name for term in self.base.terms],
            "parameters": self.parameters(),
            "invertible": self.invertible,
            "noise": {
                "within_runs_arcsec": noise.within_rad / ARCSEC,
                "between_runs_arcsec": None
                if noise.between_rad is None
                else noise.between_rad / ARCSEC,
                "repeated_runs": noise.repeats,
            },
            "not_testable": self.not_testable,
            "findings": told(self.campaign.findings),
            "samples": self.campaign.rows,
            "data_fingerprint": self.campaign.fingerprint(),
        }


def compare(
    drive: Drive | Backbone,
    campaign: Campaign,
    *,
    base: Base | None = None,
    effects: Mapping[str, Effect] | None = None,
    fit_on: Sequence[int | str] | None = None,
    seed: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Comparison:
    """Fit the base model to a campaign and say where it fails.

    Parameters
    ----------
    drive : Drive or Backbone
        The drive, with the numbers and effects of a fit where its file has them; or its loss-free
        characteristic alone.
    campaign : Campaign
        The recordings.
    base : Base, optional
        A base over this campaign that was made elsewhere.
    effects : mapping, optional
        Those that may be missing, and in which the effects of the drive's file are looked up; by
        default those of the library.
    fit_on : sequence of run labels, optional
        Fit to these runs only and predict the others; by default all are fitted, and each is held
        out once.
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
        When the torque of the recordings does not vary, or a run to fit on does not exist.
    """
    given_as("compare", "drive", drive, Drive, Backbone)
    given_as("compare", "campaign", campaign, Campaign)
    campaign.require_variation()
    known = library() if effects is None else effects
    if isinstance(drive, Backbone):
        backbone = drive
    else:
        backbone = make_backbone(drive, campaign.largest_torque_Nm)
        if base is None and (drive.fit is not None or drive.effects):
            base = make_base(drive, campaign, backbone, known)
    with one_thread():
        return _compare(
            backbone, campaign, base, known, fit_on, seed, progress or (lambda *_: None)
        )


def _compare(
    backbone: Backbone,
    campaign: Campaign,
    given: Base | None,
    effects: Mapping[str, Effect],
    fit_on: Sequence[int | str] | None,
    seed: int,
    progress: Callable[[int, int], None],
) -> Comparison:
    steps = 4
    torque = campaign.column("torque")
    inside = given or Base(Conditions(campaign), float(np.max(np.abs(torque))), backbone)
    c = inside.conditions
    measured = c.lost_motion - c.run_mean(c.lost_motion)[c.run_of]
    stands = inside.at().angle if given is not None else backbone(torque) / ARCSEC
    stands = measured - (stands - c.run_mean(stands)[c.run_of])
    seen = runs_to_fit(campaign, fit_on)
    rows = None if seen.all() else seen[c.run_of]

    inside.first_fit(steps=STEPS, rows=rows)
    progress(1, steps)
    heldout = held_out(inside, rows)
    frictions = {"inside": (rms_of(inside.residual()), rms_of(heldout))}
    best, friction = inside, "inside"
    if inside.outside is None:
        both = inside.copy()
        both.allow_outside_friction()
        both.fit(steps=STEPS, rows=rows)
        progress(2, steps)
        other = held_out(both, rows)
        frictions["both"] = (rms_of(both.residual()), rms_of(other))
        # By error on runs that were fitted, one at a time held out: the others are for the answer.
        judged = slice(None) if rows is None else rows
        if rms_of(other[judged]) < CLEARLY_BETTER * rms_of(heldout[judged]):
            best, friction, heldout = both, "both", other
    else:
        friction = "both"
    progress(3, steps)
    angle = best.at().angle
    residual = best.residual() * ARCSEC
    variance = float(np.sum(measured**2)) * ARCSEC**2
    result = Comparison(
        campaign,
        best,
        "both" if friction == "both" else "inside",
        c.run_mean(best.measured - angle) * ARCSEC,
        residual,
        heldout * ARCSEC,
        held_out_by(campaign, seen),
        seen,
        {name: (a * ARCSEC, b * ARCSEC) for name, (a, b) in frictions.items()},
        rms_of(stands) * ARCSEC,
        noise_floor(c, residual),
        1.0 - float(np.sum(residual**2)) / variance if variance > 0 else 0.0,
        where_it_fails(c, residual, seed),
        closed_by_columns(effects, c),
    )
    progress(steps, steps)
    return result


def runs_to_fit(campaign: Campaign, fit_on: Sequence[int | str] | None) -> npt.NDArray[np.bool_]:
    """Mark the runs that are fitted; labels are compared as text."""
    if fit_on is None:
        return np.ones(len(campaign.runs), dtype=bool)
    labels = [str(run.label) for run in campaign.runs]
    for wanted in fit_on:
        if str(wanted) not in labels:
            raise InputError("--fit-on", str(wanted), "no such run", "one of " + ", ".join(labels))
    if not fit_on:
        raise InputError("--fit-on", "", "no run", "one or more of " + ", ".join(labels))
    wanted_labels = {str(wanted) for wanted in fit_on}
    seen = np.array([label in wanted_labels for label in labels])
    torque = np.concatenate(
        [run.torque_Nm for run, chosen in zip(campaign.runs, seen, strict=True) if chosen]
    )
    if np.ptp(torque) == 0:
        raise InputError("--fit-on", "", "runs of one torque", "runs whose torque varies")
    return seen


def held_out_by(campaign: Campaign, seen: npt.NDArray[np.bool_]) -> str:
    """Say what was held out."""
    if not seen.all():
        return "runs not fitted"
    return "run" if len(campaign.runs) > 1 else "half of the run"


def held_out(base: Base, rows: npt.NDArray[np.bool_] | None) -> FloatArray:
    """Residual of every sample under a fit that has not seen its run, arc seconds.

    With a single run its halves are held out. With `rows` the runs outside of them were not seen.
    """
    c = base.conditions
    starts = c.starts if c.runs > 1 else np.array([0, c.rows // 2, c.rows])
    if c.rows < 2:
        return base.residual()
    if rows is None:
        return held_out_residual(base, starts)
    out = held_out_residual(base, starts, rows)
    out[~rows] = base.residual()[~rows]
    return out


def zero_widths(torque_Nm: FloatArray, angles: FloatArray) -> FloatArray | None:
    """Width of a loop where its torque is zero, for each column of angles.

    On either branch a straight line through the samples about zero is read at zero.

    Returns
    -------
    ndarray or None
        The falling branch minus the rising one; None where a branch does not pass through zero.
    """
    largest = float(np.max(np.abs(torque_Nm)))
    if largest == 0:
        return None
    rising, _ = directions(torque_Nm, largest)
    near = np.abs(torque_Nm) <= WIDTH_SHARE * largest
    at_zero = []
    for branch in (0, 1):
        chosen = near & (rising == branch)
        if np.count_nonzero(chosen) < WIDTH_SAMPLES or np.ptp(torque_Nm[chosen]) == 0:
            return None
        line = np.column_stack((np.ones(int(chosen.sum())), torque_Nm[chosen]))
        at_zero.append(np.linalg.lstsq(line, angles[chosen], rcond=None)[0][0])
    return np.asarray(at_zero[0] - at_zero[1], dtype=np.float64)


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


def noise_floor(c: Conditions, residual: FloatArray) -> Noise:
    """Estimate what no model can explain, by the recordings alone.

    Within runs: white noise, from second differences of the residual, at least the rounding of the
    encoder. Between runs: where runs repeat the same torque path under the same conditions, the
    scatter of their residuals at the same place of the path. Runs at another temperature, angle or
    number of cycles are no repeats: what differs between them may be what the model lacks.
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
    return Noise(within, between, [[c.labels[i] for i in group] for group in groups])


def _extremes(c: Conditions) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Least and largest of each recorded quantity in each run, and the slack of a repeat."""
    names = [n for n in c.campaign.quantities() if n not in ("run", "time", "lost_motion")]
    values = [[run.columns[name] for name in names] for run in c.campaign.runs]
    # A quantity that is not known in a run is the same wherever it is not known.
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
    edges = np.quantile(np.concatenate([c.torque[p] for p in pieces]), np.linspace(0, 1, BINS + 1))
    means = np.zeros((len(group), 2 * BINS))
    counts = np.zeros((len(group), 2 * BINS))
    for row, piece in enumerate(pieces):
        torque = c.torque[piece]
        direction, _ = directions(torque, largest)
        cell = np.clip(np.searchsorted(edges, torque, "right") - 1, 0, BINS - 1) * 2 + direction
        counts[row] = np.bincount(cell, minlength=2 * BINS)
        sums = np.bincount(cell, residual[piece], 2 * BINS)
        means[row] = sums / np.maximum(counts[row], 1)
    return means, counts


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
        failures.append(Failure(name, *explained(residual, cells, by, generator)))

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
            # It stands still within a run, where an offset would swallow it: look for what grows
            # with it in proportion, apart for each range of torque.
            failures.append(
                Failure(name, *explained(residual, coarse_torque, blocks, generator, values))
            )
        else:
            judge(name, quantile_bins(values, BINS), blocks)
    return sorted(failures, key=lambda failure: -failure.share)


def _branches(c: Conditions) -> tuple[list[IntArray], list[FloatArray]]:
    largest = float(np.max(np.abs(c.torque)))
    found = [directions(c.torque[at], largest) for at in c.slices()]
    return [turn for turn, _ in found], [travel for _, travel in found]


def time_under_load(c: Conditions) -> FloatArray:
    """Seconds since the drive was last unloaded; 0 where it is, or since the start of the run."""
    loaded = np.abs(c.torque) > LOADED_SHARE * float(np.max(np.abs(c.torque)))
    rest = np.where(loaded, -np.inf, c.time_s)
    rest[c.starts[:-1]] = c.time_s[c.starts[:-1]]
    out = np.empty(c.rows)
    for at in c.slices():
        out[at] = c.time_s[at] - np.maximum.accumulate(rest[at])
    return np.maximum(out, 0.0)


def branch_blocks(starts: IntArray, direction: IntArray) -> IntArray:
    """Number the stretches between reversals; long ones are cut until there are enough."""
    change = np.diff(direction, prepend=direction[0]) != 0
    change[starts[1:-1]] = True
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
    shares = np.sum((random_signs(height, generator) @ scaled) ** 2, axis=1) / total
    return beyond_chance(shares[0], float(np.mean(shares))), chance_of(shares)


def random_signs(blocks: int, generator: np.random.Generator) -> FloatArray:
    """Patterns of signs of blocks, all of them where they are few; the first is as measured."""
    if blocks <= FULL_FLIPS_BLOCKS:
        patterns = (np.arange(2 ** (blocks - 1))[:, None] >> np.arange(blocks)) & 1
    else:
        patterns = generator.integers(0, 2, (FLIPS, blocks))
        patterns[0] = 0
    return np.asarray(1.0 - 2.0 * patterns)


def chance_of(statistics: FloatArray) -> float:
    """How often random signs give as much as was measured."""
    return float(np.mean(statistics >= statistics[0] * (1 - 1e-12)))


def beyond_chance(observed: float, chance: float) -> float:
    """Share of what chance leaves."""
    return max(0.0, float((observed - chance) / (1.0 - chance))) if chance < 1 else 0.0


def common_part(residual: FloatArray, runs: IntArray, bins: IntArray) -> FloatArray:
    """What a zero of each run and a curve that all runs share explain, sample by sample."""
    (many, few), cells = np.unique((runs, bins), axis=1, return_inverse=True)
    cells = np.ravel(cells)
    size = np.bincount(cells)
    scaled = np.bincount(cells, residual) / np.sqrt(size)
    whole = scaled - without_groups(scaled[None], size, many, few)[0]
    return np.asarray((whole / np.sqrt(size))[cells])


def explained_apart(
    residual: FloatArray,
    runs: IntArray,
    ranges: IntArray,
    blocks: IntArray,
    generator: np.random.Generator,
) -> tuple[float, float]:
    """Share of the variance by which runs differ beyond chance, and its p.

    The zero of a run is its encoder's and arbitrary, and what all runs have in common hangs on the
    torque: neither is a difference between runs. What counts is how the means of a run in ranges of
    torque differ from those of the others beyond a constant, against what the blocks of a run
    differ from each other. `residual` is without `common_part`.
    """
    total = float(np.sum(residual**2))
    if total == 0:
        return 0.0, 1.0
    (many, few), cells = np.unique((runs, ranges), axis=1, return_inverse=True)
    cells = np.ravel(cells)
    _, blocks = np.unique(blocks, return_inverse=True)
    width, height = many.size, int(blocks.max()) + 1
    place = blocks * width + cells
    sums = np.bincount(place, residual, width * height).reshape(height, width)
    counts = np.bincount(place, minlength=width * height).reshape(height, width)
    size = counts.sum(axis=0)
    scaled = sums / np.sqrt(size)
    signs = random_signs(height, generator)
    within = float(np.sum(sums**2 / np.maximum(counts, 1)))
    flipped = signs @ scaled
    apart = np.sum(without_groups(flipped, size, many, few) ** 2, axis=1)
    alike = np.sum(flipped**2, axis=1) - apart
    # Random signs bring back zeros and a curve in common: they take from what can differ.
    parts = apart / np.maximum(within - alike, TINY)
    chance = float(np.mean(parts)) * within
    return beyond_chance(float(apart[0]) / total, chance / total), chance_of(parts)


def without_groups(
    scaled: FloatArray, size: npt.NDArray[Any], many: IntArray, few: IntArray
) -> FloatArray:
    """Take off what a constant for each group of cells explains.

    Parameters
    ----------
    scaled : ndarray
        Rows of sums of the cells, over the roots of their `size`.
    size : ndarray
        Samples of each cell.
    many, few : ndarray
        The two groups of each cell: of one kind that has many, and of one that has few.
    """
    root = np.sqrt(size)
    groups = (few[:, None] == np.unique(few)) * root[:, None]
    order = np.unique(many, return_inverse=True)[1]
    inside = np.bincount(order, size)
    # Groups of one kind share no cell, so each is taken off by itself; those of the other follow.
    rows = np.vstack((scaled, groups.T))
    for row in rows:
        row -= root * (np.bincount(order, root * row) / inside)[order]
    rest, groups = rows[: scaled.shape[0]], rows[scaled.shape[0] :].T
    left, values, _ = np.linalg.svd(groups, full_matrices=False)
    left = left[:, values > 1e-9 * float(root.max())]
    return np.asarray(rest - (rest @ left) @ left.T)


def rms_of(values: FloatArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))
