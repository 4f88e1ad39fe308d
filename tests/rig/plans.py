"""Test plans: the commanded motion, sample by sample, before any measurement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from .mechanics import Array

ROOM_C = 22.0
PLANS = ("standard", "third", "loops", "aliased", "short", "extended")


@dataclass
class Run:
    """One uninterrupted recording; torque as a share of the rated one, loads as the bench reads."""

    kind: str
    time_s: Array
    torque: Array
    input_angle_rad: Array
    temperature_C: Array
    cycles: float = 0.0
    turning: bool = False
    tilt_moment: Array | None = None
    """Moment on the output bearing, as a share of the rated torque."""
    axial_force: Array | None = None
    """Axial force on the output, as a share of the force that makes the rated torque on 0.1 m."""


@dataclass
class Plan:
    """A plan with its runs one after the other."""

    name: str
    kinds: list[str]
    run: npt.NDArray[np.int64]
    """Number of the run of each sample, from 0."""
    time_s: Array
    step_s: Array
    torque: Array
    input_angle_rad: Array
    speed_rad_per_s: Array
    turning: npt.NDArray[np.bool_]
    temperature_C: Array
    cycles: Array
    tilt_moment: Array
    axial_force: Array
    followed_by: int = 0
    """Number of runs at the end that are not the plan's own."""

    @property
    def runs(self) -> int:
        """Number of runs."""
        return len(self.kinds)

    def slices(self) -> list[slice]:
        """Rows of each run."""
        edges = np.concatenate([[0], np.cumsum(np.bincount(self.run, minlength=self.runs))])
        return [slice(int(a), int(b)) for a, b in pairwise(edges)]

    def thinned(self, stride: int) -> Plan:
        """Every n-th row of each run, from its first."""
        rows = np.concatenate([np.arange(s.start, s.stop, stride) for s in self.slices()])
        kept = {
            name: values[rows]
            for name, values in vars(self).items()
            if isinstance(values, np.ndarray)
        }
        first = np.diff(kept["run"], prepend=-1) > 0
        kept["step_s"] = np.where(first, 0.0, np.diff(kept["time_s"], prepend=0.0))
        return Plan(name=self.name, kinds=self.kinds, followed_by=self.followed_by, **kept)


def _triangle(phase: Array) -> Array:
    """One cycle per unit of phase: 0, 1, 0, -1, 0."""
    return 2 / np.pi * np.arcsin(np.sin(2 * np.pi * phase))


def _warming(time_s: Array, rise_K: float = 0.4) -> Array:
    """Small changes of the room temperature during a run."""
    return rise_K * np.sin(time_s / 120.0)


def loop(amplitude: float, angle: float, temperature_C: float, cycles: float = 0.0) -> Run:
    """Two torque cycles of half a minute at a locked generator."""
    time = 0.05 * np.arange(1200)
    return Run(
        kind="loop",
        time_s=time,
        torque=amplitude * _triangle(time / 30),
        input_angle_rad=np.full(1200, angle),
        temperature_C=temperature_C + _warming(time),
        cycles=cycles,
    )


def fast_loop(period_s: float, angle: float) -> Run:
    """Torque cycles at the highest rate of the rig."""
    time = 0.01 * np.arange(3000)
    return Run(
        kind="fast loop",
        time_s=time,
        torque=0.7 * _triangle(time / period_s),
        input_angle_rad=np.full(3000, angle),
        temperature_C=ROOM_C + _warming(time),
    )


def turning(ratio: int, load: float, output_rad_per_s: float, temperature_C: float) -> Run:
    """One turn of the output there and back under a load, with a rounded reversal."""
    duration = 4 * np.pi / output_rad_per_s
    time = duration / 1400 * np.arange(1400)
    half, reversal = duration / 2, 0.02 * duration
    away = np.abs(time - half)
    # Constant deceleration through the reversal, so that speed has no jump.
    gone = np.where(away > reversal, half - away, half - reversal / 2 - away**2 / (2 * reversal))
    return Run(
        kind="turning",
        time_s=time,
        torque=np.full(1400, load),
        input_angle_rad=gone * output_rad_per_s * ratio,
        temperature_C=temperature_C + _warming(time),
        turning=True,
    )


def hold(load: float, angle: float) -> Run:
    """A load applied, kept for three minutes and removed."""
    time = 0.2 * np.arange(2000)
    return Run(
        kind="hold",
        time_s=time,
        torque=np.where((time > 20) & (time < 210), load, 0.0),
        input_angle_rad=np.full(2000, angle),
        temperature_C=ROOM_C + _warming(time),
    )


def warming_loop(angle: float, low_C: float, high_C: float) -> Run:
    """Slow torque cycles while the housing warms up."""
    time = 0.2 * np.arange(2000)
    run = loop(0.6, angle, ROOM_C)
    return replace(
        run,
        kind="warming loop",
        time_s=time,
        torque=0.6 * _triangle(time / 50),
        input_angle_rad=np.full(2000, angle),
        temperature_C=high_C - (high_C - low_C) * np.exp(-time / 150),
    )


def swinging(ratio: int, output_rad_per_s: float) -> Run:
    """Turning while the load swings slowly between both directions."""
    run = turning(ratio, 0.0, output_rad_per_s, ROOM_C)
    return replace(run, kind="swinging", torque=0.5 * _triangle(2.25 * run.time_s / run.time_s[-1]))


def overload(angle: float) -> Run:
    """One cycle of three times the rated torque, then two ordinary ones."""
    time = 0.05 * np.arange(1800)
    return Run(
        kind="overload",
        time_s=time,
        torque=np.where((time < 15), 3.0, 0.8) * _triangle(time / 30),
        input_angle_rad=np.full(1800, angle),
        temperature_C=ROOM_C + _warming(time),
    )


def _standard(ratio: int, chance: np.random.Generator) -> list[Run]:
    angles = chance.uniform(0, 2 * np.pi, 4)
    angles[1] = (angles[0] + chance.uniform(0.3, 0.7) * np.pi) % (2 * np.pi)

    def room() -> float:
        return ROOM_C + chance.uniform(-1, 1)

    runs = [loop(amplitude, angle, room()) for angle in angles for amplitude in (0.25, 0.6, 1.0)]
    runs += [loop(1.0, 1.3, temperature_C) for temperature_C in (10.0, 35.0, 50.0)]
    runs += [
        turning(ratio, load, speed, room())
        for speed in (0.05, 0.2, 0.6)
        for load in (0.0, 0.3, -0.3)
    ]
    runs += [hold(0.8, 0.4), hold(-0.8, 0.4)]
    runs += [loop(1.0, 2.2, room(), cycles) for cycles in (2e4, 1e5, 3e5)]
    return [*runs, fast_loop(2.0, 3.1), fast_loop(6.0, 3.1)]


def _third(ratio: int, chance: np.random.Generator) -> list[Run]:
    runs = _standard(ratio, chance)
    return [runs[i] for i in (0, 5, 8, 12, 14, 15, 19, 23, 24, 28, 29)]


def _loops(ratio: int, chance: np.random.Generator) -> list[Run]:
    return [run for run in _standard(ratio, chance) if run.kind == "loop"]


def _aliased(ratio: int, chance: np.random.Generator) -> list[Run]:
    """The drive becomes warmer as it wears: the loops show when something changed, not why."""
    angles = chance.uniform(0, 2 * np.pi, 3)
    share = np.linspace(0, 1, 15)
    runs = [
        loop(
            (0.25, 0.6, 1.0)[i % 3],
            float(angles[i // 3 % 3]),
            float(15 + 30 * share[i] + chance.uniform(-0.3, 0.3)),
            float(np.round(3e5 * share[i] ** 2)),
        )
        for i in range(15)
    ]
    return runs + [
        turning(ratio, load, speed, 45.0) for speed in (0.05, 0.6) for load in (0.0, 0.3, -0.3)
    ]


def _short(ratio: int, chance: np.random.Generator) -> list[Run]:
    """A short plan: two wave generator angles, one speed, the drive warm at the end."""
    angles = chance.uniform(0, 2 * np.pi, 2)
    runs = [
        loop(amplitude, float(angle), ROOM_C + chance.uniform(-1, 1))
        for angle in angles
        for amplitude in (0.25, 0.6, 1.0)
    ]
    runs += [turning(ratio, load, 0.2, ROOM_C + chance.uniform(-1, 1)) for load in (0.0, 0.3, -0.3)]
    return runs + [
        loop(amplitude, float(angles[0]), 40.0 + chance.uniform(-0.3, 0.3), 1e5)
        for amplitude in (0.6, 1.0)
    ]


def _extended(ratio: int, chance: np.random.Generator) -> list[Run]:
    """The standard plan and further runs that separate confounded effects."""
    runs = _standard(ratio, chance)
    runs += [loop(0.04, 0.9, ROOM_C), loop(0.04, 4.0, ROOM_C)]
    runs += [warming_loop(0.9, 15.0, 45.0), warming_loop(4.0, 15.0, 45.0)]
    runs += [swinging(ratio, 0.05), swinging(ratio, 0.2)]
    for moment in (0.5, -0.5):
        run = loop(0.6, 0.9, ROOM_C)
        runs.append(replace(run, kind="tilt loop", tilt_moment=moment * _triangle(run.time_s / 40)))
    for force in (0.5, -0.5):
        run = loop(0.6, 0.9, ROOM_C)
        runs.append(replace(run, kind="axial loop", axial_force=force * _triangle(run.time_s / 40)))
    return [*runs, overload(0.9)]


_MAKERS: dict[str, Callable[[int, np.random.Generator], list[Run]]] = {
    "standard": _standard,
    "third": _third,
    "loops": _loops,
    "aliased": _aliased,
    "short": _short,
    "extended": _extended,
}


def _load_bearing(runs: list[Run], ratio: int, chance: np.random.Generator) -> None:
    """Give runs the small moment and axial force that depend on load and pose on any bench."""
    share = chance.uniform(0.05, 0.15, 2)
    phase = chance.uniform(0, 2 * np.pi, 2)
    level = chance.uniform(0.15, 0.35, (len(runs), 2)) * chance.choice((-1, 1), (len(runs), 2))
    for run, (moment, force) in zip(runs, level, strict=True):
        output = run.input_angle_rad / ratio
        sway = 2 * np.pi * run.time_s / (0.37 * run.time_s[-1])
        if run.tilt_moment is None:
            run.tilt_moment = (
                share[0] * run.torque + moment * np.cos(output + phase[0]) + 0.08 * np.sin(sway)
            )
        if run.axial_force is None:
            run.axial_force = share[1] * run.torque + force + 0.1 * np.sin(0.7 * sway + phase[1])


def make_plan(
    name: str,
    ratio: int,
    chance: np.random.Generator,
    spike: bool = False,
    then: Callable[[list[Run], int], list[Run]] | None = None,
) -> Plan:
    """Make a plan; a spike overloads one cycle of its last full loop three times.

    `then` makes runs that follow those of the plan; the runs of the plan are the same without them.
    """
    runs = _MAKERS[name](ratio, chance)
    if spike:
        last = max(i for i, run in enumerate(runs) if run.kind == "loop" and max(run.torque) > 0.9)
        peak = (runs[last].time_s >= 30) & (runs[last].time_s < 45)
        runs[last].torque = np.where(peak, 3.0, 1.0) * runs[last].torque
    _load_bearing(runs, ratio, chance)
    if then is not None:
        more = then(runs, ratio)
        _load_bearing(more, ratio, chance)
        return lay(name, [*runs, *more], len(more))
    return lay(name, runs)


def lay(name: str, runs: list[Run], followed_by: int = 0) -> Plan:
    """Join runs."""

    def laid(get: Callable[[Run], Array]) -> Array:
        return np.concatenate([get(run) for run in runs])

    return Plan(
        name=name,
        kinds=[run.kind for run in runs],
        run=np.repeat(np.arange(len(runs)), [len(run.time_s) for run in runs]),
        time_s=laid(lambda run: run.time_s),
        step_s=laid(lambda run: np.diff(run.time_s, prepend=run.time_s[0])),
        torque=laid(lambda run: run.torque),
        input_angle_rad=laid(lambda run: run.input_angle_rad),
        speed_rad_per_s=laid(lambda run: np.gradient(run.input_angle_rad, run.time_s)),
        turning=laid(lambda run: np.full(len(run.time_s), run.turning)).astype(bool),
        temperature_C=laid(lambda run: run.temperature_C),
        cycles=laid(lambda run: np.full(len(run.time_s), run.cycles)),
        tilt_moment=laid(lambda run: run.tilt_moment),  # type: ignore[arg-type,return-value]
        axial_force=laid(lambda run: run.axial_force),  # type: ignore[arg-type,return-value]
        followed_by=followed_by,
    )
