"""The base model that recordings are compared with: a backbone and friction with memory.

The backbone is the loss-free characteristic of the drive (from its catalogue or its design). Its
compliance may be scaled in three ranges of torque. Friction is a bank of play operators that sit
outside the elasticity, where they add an angle, or inside it, where they take their part of the
torque before the rest winds the drive up:

    T_e = T + sum w_i (z_i - T),   phi = offset + backbone(T_e) + sum c_i (z_i - T)

The state of the operators goes on from run to run in the order of the campaign: what the previous
recording left behind is where the next one starts. Every run has an offset of its own, because the
zero of an encoder is arbitrary.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from lostmotion.core import core
from lostmotion.recordings import Campaign
from lostmotion.solve import bounded_least_squares

FloatArray = npt.NDArray[np.float64]
Friction = Literal["outside", "inside", "both"]

FRICTIONS: tuple[Friction, ...] = ("outside", "inside", "both")

ZONES = ("low", "middle", "high")
"""Ranges of torque whose compliance is scaled apart: up to T1, up to T2, above."""

RADII = (1 / 64, 1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2)
"""Half widths of the plays over the largest torque of the campaign."""

SCALE_LOW, SCALE_HIGH = 0.02, 50.0
"""Bounds of a compliance scale: beyond them a drive file describes another drive."""

LEAST_COVERAGE = 0.02
"""A range of torque that covers less of the largest torque than this cannot be fitted."""

START_STATES = (0.0, -1.0, 1.0, -0.5, 0.5)
"""Where the plays may stand before the first sample, in half widths from the torque there."""


@dataclass(frozen=True)
class Backbone:
    """A loss-free characteristic as straight lines between knots, and its ranges of torque.

    Attributes
    ----------
    torque_Nm, angle_rad : ndarray
        Knots, rising, through zero; the end segments go on beyond them.
    limits_Nm : tuple
        T1 and T2, where one range of torque ends and the next begins.
    """

    torque_Nm: FloatArray
    angle_rad: FloatArray
    limits_Nm: tuple[float, float]

    def __call__(self, torque_Nm: FloatArray) -> FloatArray:
        """Angle in rad at each torque."""
        slope = np.diff(self.angle_rad) / np.diff(self.torque_Nm)
        inside = np.interp(torque_Nm, self.torque_Nm, self.angle_rad)
        below = np.minimum(torque_Nm - self.torque_Nm[0], 0.0) * slope[0]
        above = np.maximum(torque_Nm - self.torque_Nm[-1], 0.0) * slope[-1]
        return np.asarray(inside + below + above)

    def slope(self, torque_Nm: FloatArray) -> FloatArray:
        """Slope in rad/(N m) at each torque."""
        slope = np.diff(self.angle_rad) / np.diff(self.torque_Nm)
        segment = np.searchsorted(self.torque_Nm, torque_Nm, side="right") - 1
        return np.asarray(slope[np.clip(segment, 0, slope.size - 1)])

    def zones(self, torque_Nm: FloatArray) -> FloatArray:
        """Part of the angle that each range of torque adds; rows of three that add up to it."""
        t1, t2 = self.limits_Nm
        low = self(np.clip(torque_Nm, -t1, t1))
        both = self(np.clip(torque_Nm, -t2, t2))
        return np.column_stack((low, both - low, self(torque_Nm) - both))

    def zone_of(self, torque_Nm: FloatArray) -> npt.NDArray[np.intp]:
        """Index of the range of torque that each torque lies in."""
        return np.searchsorted(self.limits_Nm, np.abs(torque_Nm), side="right")


@dataclass(frozen=True)
class Parameters:
    """What is fitted.

    Attributes
    ----------
    scale : ndarray
        Compliance of the three ranges of torque over that of the backbone.
    outside : ndarray
        Compliance of the plays outside the elasticity, rad/(N m).
    inside : ndarray
        Share of the torque of the plays inside the elasticity; their sum is at most 1.
    """

    scale: FloatArray
    outside: FloatArray
    inside: FloatArray


@dataclass
class Fit:
    """A fitted base model and what it leaves.

    Attributes
    ----------
    friction : str
        Where the friction sits.
    parameters : Parameters
    fitted_zones : tuple of str
        Ranges of torque that the campaign reaches; the others keep the backbone's compliance.
    start_state : float
        State of the plays before the first sample, in half widths from the torque there.
    offset_rad : ndarray
        One a run.
    residual_rad : ndarray
        Measured minus model, all runs joined.
    invertible : bool
        Whether the angle rises with torque while every play sticks.
    """

    friction: Friction
    parameters: Parameters
    fitted_zones: tuple[str, ...]
    start_state: float
    offset_rad: FloatArray
    residual_rad: FloatArray
    invertible: bool
    at_bound: list[str] = field(default_factory=list)

    @property
    def rms_rad(self) -> float:
        """Root mean square of the residual."""
        return float(np.sqrt(np.mean(self.residual_rad**2)))


class BaseModel:
    """The base model over one campaign, ready to be fitted.

    Parameters
    ----------
    backbone : Backbone
    campaign : Campaign
        Runs in the order in which they were made.
    """

    def __init__(self, backbone: Backbone, campaign: Campaign) -> None:
        self.backbone = backbone
        self.starts = campaign.starts
        self.torque = np.ascontiguousarray(campaign.column("torque"))
        self.angle = np.ascontiguousarray(campaign.column("lost_motion"))
        self.run_of = np.repeat(np.arange(len(campaign.runs)), np.diff(self.starts))
        largest = float(np.max(np.abs(self.torque)))
        self.largest_torque_Nm = largest
        self.radius_Nm = np.array(RADII) * largest
        limits = (0.0, *backbone.limits_Nm, np.inf)
        self.reached = np.array(
            [
                min(largest, limits[i + 1]) - limits[i] > LEAST_COVERAGE * largest
                for i in range(len(ZONES))
            ]
        )
        self.start_state = 0.0
        self.set_start_state(0.0)

    def set_start_state(self, state: float) -> None:
        """Run the plays through the campaign from a state before its first sample."""
        self.start_state = state
        self.plays = run_plays(self.radius_Nm, self.torque, state)

    def centre(self, values: FloatArray, rows: npt.NDArray[np.bool_] | None = None) -> FloatArray:
        """Take the mean of each run (over `rows` only) off a column or columns."""
        return values - self.run_means(values, rows)[self.run_of]

    def run_means(
        self, values: FloatArray, rows: npt.NDArray[np.bool_] | None = None
    ) -> FloatArray:
        """Mean of each run; 0 where a run has no rows."""
        first = self.starts[:-1]
        if rows is None:
            count = np.diff(self.starts).astype(np.float64)
        else:
            count = np.maximum(np.add.reduceat(rows.astype(np.float64), first), 1.0)
            values = values * (rows if values.ndim == 1 else rows[:, None])
        sums = np.add.reduceat(values, first, axis=0)
        return np.asarray(sums / (count if values.ndim == 1 else count[:, None]))

    def predict(self, parameters: Parameters) -> FloatArray:
        """Angle in rad without the offsets of the runs."""
        wound = self.torque + self.plays @ parameters.inside
        zones = self.backbone.zones(wound)
        return np.asarray(zones @ parameters.scale + self.plays @ parameters.outside)

    def fit(
        self,
        friction: Friction,
        rows: npt.NDArray[np.bool_] | None = None,
        start: Parameters | None = None,
    ) -> Fit:
        """Fit the base model by least squares.

        Parameters
        ----------
        friction : {"outside", "inside", "both"}
        rows : ndarray of bool, optional
            Samples that count; the memory of the plays runs through all of them.
        start : Parameters, optional
            Where to start; by default the backbone as it stands, with little friction.
        """
        count = self.radius_Nm.size
        use = np.ones(self.torque.size, dtype=bool) if rows is None else rows
        t1 = max(self.backbone.limits_Nm[0], 1e-12)
        soft = float(self.backbone(np.array([t1]))[0]) / t1
        if start is None:
            start = Parameters(np.ones(3), np.full(count, 0.01 * soft), np.full(count, 0.01))
        outside_on = friction != "inside"
        inside_on = friction != "outside"

        def unpack(vector: FloatArray) -> tuple[Parameters, FloatArray]:
            scale = np.ones(3)
            zones = int(np.count_nonzero(self.reached))
            scale[self.reached] = np.exp(vector[:zones])
            rest = vector[zones:]
            outside = rest[:count] * soft if outside_on else np.zeros(count)
            sticks = rest[count if outside_on else 0 :] if inside_on else np.zeros(0)
            return Parameters(scale, outside, break_stick(sticks, count)), sticks

        def evaluate(vector: FloatArray) -> tuple[FloatArray, FloatArray]:
            parameters, sticks = unpack(vector)
            wound = self.torque + self.plays @ parameters.inside
            zones = self.backbone.zones(wound)
            angle = zones @ parameters.scale + self.plays @ parameters.outside
            columns = [(zones * parameters.scale)[:, self.reached]]
            if outside_on:
                columns.append(self.plays * soft)
            if inside_on:
                slope = self.backbone.slope(wound) * parameters.scale[self.backbone.zone_of(wound)]
                columns.append(slope[:, None] * (self.plays @ stick_jacobian(sticks)))
            columns.append((angle - self.angle)[:, None])
            both = self.centre(np.concatenate(columns, axis=1), use)[use] / unit
            return both[:, -1], both[:, :-1]

        names = [f"compliance_{z}" for z, on in zip(ZONES, self.reached, strict=True) if on]
        first = [np.log(start.scale[self.reached])]
        low = [np.full(len(names), np.log(SCALE_LOW))]
        high = [np.full(len(names), np.log(SCALE_HIGH))]
        if outside_on:
            first.append(start.outside / soft)
            low.append(np.zeros(count))
            high.append(np.full(count, SCALE_HIGH))
            names += [f"outside_{i + 1}" for i in range(count)]
        if inside_on:
            first.append(sticks_of(start.inside))
            low.append(np.zeros(count))
            high.append(np.ones(count))
            names += [f"inside_{i + 1}" for i in range(count)]
        unit = max(float(np.std(self.centre(self.angle, use)[use])), 1e-12)
        solution = bounded_least_squares(
            evaluate, np.concatenate(first), np.concatenate(low), np.concatenate(high)
        )
        parameters, _ = unpack(solution.x)
        difference = self.angle - self.predict(parameters)
        offset = self.run_means(difference, use)
        # A run that was held out is placed by its own mean: its zero is not a matter of the model.
        missing = np.bincount(self.run_of, use, self.starts.size - 1) == 0
        offset[missing] = self.run_means(difference)[missing]
        bound = [
            name
            for name, at in zip(names, solution.at_bound, strict=True)
            if at and name.startswith("compliance")
        ]
        return Fit(
            friction,
            parameters,
            tuple(z for z, on in zip(ZONES, self.reached, strict=True) if on),
            self.start_state,
            offset,
            difference - offset[self.run_of],
            self.invertible(parameters),
            bound,
        )

    def invertible(self, parameters: Parameters) -> bool:
        """Whether the angle rises with torque while every play sticks."""
        segments = self.backbone.slope(self.backbone.torque_Nm[:-1])
        middle = (self.backbone.torque_Nm[:-1] + self.backbone.torque_Nm[1:]) / 2
        least = float(np.min(segments * parameters.scale[self.backbone.zone_of(middle)]))
        return bool((1.0 - parameters.inside.sum()) * least > parameters.outside.sum())


def run_plays(radius_Nm: FloatArray, torque_Nm: FloatArray, state: float = 0.0) -> FloatArray:
    """Differences ``z_i - T`` of play operators over a recording, one column an operator.

    Parameters
    ----------
    radius_Nm : ndarray
        Half widths; they do not grow with the torque.
    torque_Nm : ndarray
        The recording.
    state : float
        Where the operators stand before the first sample, in half widths from the torque there.
    """
    c = core(64)
    out = c.zeros(torque_Nm.size, radius_Nm.size)
    z = c.array(torque_Nm[0] + state * radius_Nm)
    c.lib.lm_run_plays(
        c.pointer(c.array(radius_Nm)),
        c.pointer(c.zeros(radius_Nm.size)),
        radius_Nm.size,
        c.pointer(z, write=True),
        c.pointer(c.array(torque_Nm)),
        c.ffi.NULL,
        torque_Nm.size,
        c.pointer(out, write=True),
    )
    return out


def break_stick(sticks: FloatArray, count: int) -> FloatArray:
    """Shares that add up to at most 1, from numbers between 0 and 1.

    Each number is the part that is broken off what the ones before it have left, so box bounds are
    all that a solver has to know.
    """
    if sticks.size == 0:
        return np.zeros(count)
    left = np.concatenate(([1.0], np.cumprod(1.0 - sticks)[:-1]))
    return np.asarray(sticks * left)


def sticks_of(shares: FloatArray) -> FloatArray:
    """Inverse of `break_stick`."""
    left = 1.0 - np.concatenate(([0.0], np.cumsum(shares)[:-1]))
    return np.asarray(np.clip(shares / np.maximum(left, 1e-9), 0.0, 1.0))


def stick_jacobian(sticks: FloatArray) -> FloatArray:
    """Derivatives of the shares by the sticks, ``[share, stick]``."""
    count = sticks.size
    out = np.zeros((count, count))
    for j in range(count):
        for i in range(j, count):
            others = np.prod([1.0 - sticks[k] for k in range(i) if k != j])
            out[i, j] = others if i == j else -sticks[i] * others
    return out
