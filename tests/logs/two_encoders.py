"""Generated logs of two encoders in which the lost motion is continuous, and the same wrapped.

The seed of a log determines ratio and its sign, sample rate, stations with dwells, continuous
rotation, swinging, moves that were not logged, counts and noise. The lost motion is a spring with a
play operator and noise, far smaller than its change by one turn of an encoder, so that wrapped
readings can be identified from `output - input / ratio` alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .clean import Array

TURN = 2 * np.pi
ARCMIN = TURN / 360 / 60
RATIOS = (30.0, 50.0, 51.0, 80.0, 100.0, 120.5, 160.0, 320.0, 11.0, 3.0)
"""Strain-wave sizes from 30 to 320, a compound ratio that is no integer, and two cycloidal ones."""
STEPS_S = (1e-4, 1e-3, 0.004, 0.02, 0.1, 0.5, 5.0)
LEAST_PER_TURN, MOST_PER_TURN = 12, 24
"""Bits of an encoder."""


@dataclass(frozen=True)
class TwoEncoders:
    """A log of one run or several, as columns."""

    about: str
    ratio: float
    run: Array
    time_s: Array
    torque_Nm: Array
    input_angle_rad: Array
    output_angle_rad: Array
    per_turn: float = 0.0
    """Counts per turn of the input, if the log contains counts."""

    @property
    def lost_motion_rad(self) -> Array:
        """Correct result of reading."""
        lost: Array = self.output_angle_rad - self.input_angle_rad / self.ratio
        return lost

    @property
    def mapping(self) -> dict[str, str]:
        """The user's map of the column of counts."""
        return {"ENC": f"input_angle_rev/{self.per_turn:g}"} if self.per_turn else {}

    def csv(self) -> str:
        """The log as a file with all digits."""
        names = ("run", "time_s", "torque_Nm", "input_angle_rad", "output_angle_rad")
        columns = [getattr(self, name).tolist() for name in names]
        columns[0] = [int(label) for label in columns[0]]
        if self.per_turn:
            names = tuple(name.replace("input_angle_rad", "ENC") for name in names)
            columns[3] = np.rint(self.input_angle_rad * self.per_turn / TURN).astype(int).tolist()
        rows = [",".join(map(repr, row)) for row in zip(*columns, strict=True)]
        return ",".join(names) + "\n" + "\n".join(rows) + "\n"

    def write(self, folder: Path) -> Path:
        """Write the file."""
        file = folder / "log.csv"
        file.write_text(self.csv())
        return file


# --- how the input moves -------------------------------------------------------------------------


def _dwells(chance: np.random.Generator, rows: int, ratio: float, logged: bool) -> Array:
    """Stations with dwells: the moves between them smooth, or not logged at all."""
    stations = int(chance.integers(2, 12))
    part = rows // stations
    # Often a whole number of input turns apart, like the stations of an index plate.
    apart = chance.choice([TURN, TURN * abs(ratio) / 10, chance.uniform(0.1, 30.0)])
    share = 0.0 if not logged else chance.uniform(0.02, 0.5)
    moving = int(share * part)
    angle, at = [], 0.0
    for station in range(stations):
        length = part if station < stations - 1 else rows - part * (stations - 1)
        ramp = at + apart * 0.5 * (1 - np.cos(np.pi * np.arange(moving) / max(moving, 1)))
        moved = ramp[: max(0, min(moving, length))]
        if station == 0:
            moved = moved[:0]
            moving_now = 0
        else:
            moving_now = len(moved)
            at += apart
        angle.append(np.concatenate([moved, np.full(length - moving_now, at)]))
    return np.concatenate(angle)


def _turning(chance: np.random.Generator, rows: int, ratio: float) -> Array:
    """Continuous rotation, slow or by more than a turn per sample."""
    per_sample = chance.choice([1e-4, 1e-2, 0.3, 3.0, 3.2, 6.2, 6.4, 20.0, 700.0])
    return per_sample * chance.uniform(0.9, 1.1) * np.arange(rows)


def _swinging(chance: np.random.Generator, rows: int, ratio: float) -> Array:
    """Forward and back, within a turn or over many."""
    amplitude = chance.choice([0.01, 1.0, 3.0, 30.0, 3000.0])
    return amplitude * np.sin(TURN * chance.uniform(0.5, 8) * np.arange(rows) / rows)


def _still(chance: np.random.Generator, rows: int, ratio: float) -> Array:
    """Locked."""
    return np.zeros(rows)


def _wandering(chance: np.random.Generator, rows: int, ratio: float) -> Array:
    """Motion by hand or by a robot: long rests and sudden fast moves."""
    speed = chance.standard_normal(rows) * (chance.random(rows) < 0.05) * chance.choice([1, 10, 50])
    return np.cumsum(speed)


MOTIONS: dict[str, Callable[[np.random.Generator, int, float], Array]] = {
    "stations, moves logged": lambda chance, rows, ratio: _dwells(chance, rows, ratio, True),
    "stations, moves not logged": lambda chance, rows, ratio: _dwells(chance, rows, ratio, False),
    "turning": _turning,
    "swinging": _swinging,
    "still": _still,
    "wandering": _wandering,
}


# --- a log ---------------------------------------------------------------------------------------


def _run(chance: np.random.Generator, ratio: float, motion: str) -> tuple[Array, Array, Array]:
    """Torque, input and output of one run."""
    rows = int(chance.integers(60, 500))
    swing = chance.uniform(5, 100)
    torque = swing * np.sin(TURN * chance.uniform(0.5, 5) * np.arange(rows) / rows)
    torque += chance.normal(0, 1e-4 * swing, rows)
    # At most a tenth of one input turn at the output, or 10 arcmin.
    reach = min(10 * ARCMIN, 0.1 * TURN / abs(ratio)) * chance.uniform(0.05, 1.0)
    slack = 0.1 * swing
    follows, at = np.empty(rows), 0.0
    for i, value in enumerate(torque):
        at = min(max(at, value - slack), value + slack)
        follows[i] = at
    noise = chance.normal(0, reach * chance.choice([1e-4, 1e-3, 1e-2]), rows)
    lost = reach * follows / swing + noise
    angle = chance.choice([-1, 1]) * MOTIONS[motion](chance, rows, ratio)
    angle = angle + chance.choice([0.0, 0.7, chance.uniform(-1e4, 1e4)])
    if chance.random() < 0.5:
        count = TURN / 2 ** chance.integers(LEAST_PER_TURN, MOST_PER_TURN)
        angle = count * np.round(angle / count)
    output = angle / ratio + lost
    if chance.random() < 0.5:
        output = np.round(output, 7)
    return torque, angle, output


def continuous(seed: int) -> TwoEncoders:
    """Generate a log in which no reading is wrapped."""
    chance = np.random.default_rng([31, seed])
    ratio = float(chance.choice(RATIOS) * chance.choice([-1, 1]))
    motion = str(chance.choice(list(MOTIONS)))
    step = float(chance.choice(STEPS_S))
    start = float(chance.choice([0.0, 12.5, 1.7e9]))
    parts = [_run(chance, ratio, motion) for _ in range(int(chance.integers(1, 4)))]
    lengths = [len(part[0]) for part in parts]
    torque, angle, output = (np.concatenate(column) for column in zip(*parts, strict=True))
    if chance.random() < 0.3:  # one mounting, one zero
        output = output + chance.uniform(-3, 3)
    time = start + step * np.arange(sum(lengths))
    return TwoEncoders(
        f"seed {seed}: {motion}, ratio {ratio:g}, {step:g} s, {len(parts)} runs",
        ratio,
        np.repeat(np.arange(len(parts)), lengths) + 1.0,
        time,
        torque,
        angle,
        output,
    )


def wrapped(seed: int) -> TwoEncoders:
    """Generate the same log with encoders that wrap at a turn, or counters that overflow.

    Counters are logged as counts; the user states the counts per turn, not the overflow.
    """
    log = continuous(seed)
    chance = np.random.default_rng([32, seed])
    kind = str(chance.choice(["input turn", "output turn", "both turns", "input counter"]))
    low = float(chance.choice([0.0, -np.pi]))
    angle, output, per_turn = log.input_angle_rad, log.output_angle_rad, 0.0
    if kind in ("input turn", "both turns"):
        angle = low + np.mod(angle - low, TURN)
    if kind in ("output turn", "both turns"):
        output = low + np.mod(output - low, TURN)
    if kind == "input counter":
        bits = int(chance.choice([16, 24]))
        per_turn = float(chance.choice([400, 1000, 4000, 4096]) * (1 if bits == 16 else 64))
        counts = np.round(angle / TURN * per_turn)
        kind = f"counter of {bits} bits, {per_turn:g} counts a turn"
        angle = (np.mod(counts + 2.0 ** (bits - 1), 2.0**bits) - 2.0 ** (bits - 1)) * TURN
        angle = angle / per_turn
    return replace(
        log,
        about=f"{log.about}; {kind}",
        input_angle_rad=angle,
        output_angle_rad=output,
        per_turn=per_turn,
    )


def is_wrapped(log: TwoEncoders, clean: TwoEncoders) -> bool:
    """Whether any reading passed the end of its range: the lost motion jumps within a run."""
    shift = log.lost_motion_rad - clean.lost_motion_rad
    rounded = TURN / log.per_turn / abs(log.ratio) if log.per_turn else 0.0
    return any(np.ptp(shift[log.run == label]) > 1e-3 + rounded for label in np.unique(log.run))
