"""Runs that can follow those of a plan, to separate effects that it leaves undecided.

The number of cycles never decreases, so a following run is made at the last cycles of the plan.
Temperature, load, speed and wave generator angle can be chosen.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from .bench import TestBench, stream
from .campaign import FORMATS, Campaign, Conditions
from .drives import SIZES
from .plans import ROOM_C, Run, hold, lay, loop, turning

LOOPS = ((0.25, ROOM_C), (1.0, 10.0), (1.0, ROOM_C), (0.6, ROOM_C), (1.0, 45.0))
"""Amplitude over rated torque and temperature of the loops that are offered."""
TURNS = ((0.0, 0.05), (0.3, 0.05), (-0.3, 0.05), (0.0, 0.6), (0.3, 0.6), (-0.3, 0.6))
"""Load over rated torque and speed of the output, rad / s."""


def offered(runs: Sequence[Run], ratio: int) -> dict[str, Run]:
    """Runs that a bench could do next, by their names in its plan of options."""
    cycles = max(run.cycles for run in runs)
    here = next(float(run.input_angle_rad[0]) for run in runs if run.kind == "loop")
    made: dict[str, Run] = {}
    for amplitude, temperature_C in LOOPS:
        for where, angle in (("here", here), ("elsewhere", here + np.pi / 4)):
            label = f"loop {amplitude:g} at {temperature_C:g} C {where}"
            made[label] = loop(amplitude, angle, temperature_C, cycles)
    for load, speed in TURNS:
        run = turning(ratio, load, speed, ROOM_C)
        made[f"turning {load:g} at {speed:g} rad/s"] = replace(run, cycles=cycles)
    made["hold"] = replace(hold(0.8, here), cycles=cycles)
    return made


def repeated(runs: Sequence[Run], seed: int) -> Run:
    """A random run of the plan, repeated after the end of the plan.

    Of every kind of run and torque the last one counts, because the rig does not become colder
    or less worn by itself.
    """
    last: dict[tuple[str, float, float], Run] = {}
    for run in runs:
        speed = float(np.ptp(run.input_angle_rad) / run.time_s[-1])
        last[run.kind, round(float(np.max(run.torque)), 3), round(speed, 3)] = run
    chosen = list(last.values())[int(stream(seed, "repeat").integers(len(last)))]
    cycles = max(run.cycles for run in runs)
    return replace(chosen, cycles=cycles, tilt_moment=None, axial_force=None)


def followed(
    truth: Mapping[str, Any], drive: int, then: Callable[[list[Run], int], list[Run]]
) -> Campaign:
    """Make the campaign of a truth again, with runs after those of its plan."""
    how = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in truth["conditions"].items()
    }
    conditions = Conditions(**how)
    bench = TestBench(
        truth["seed"],
        drive,
        truth["plan"],
        scatter=conditions.scatter,
        noise=conditions.noise,
        sheet_error=conditions.sheet_error,
        sheet_bias=conditions.sheet_bias,
        then=then,
    )
    return Campaign(bench, dict(truth["effects"]), conditions, truth["kind"])


def drive_number(truth: Mapping[str, Any]) -> int:
    """Find the drive of a truth."""
    words = str(truth["drive"]).split()
    size, ratio = int(words[1]), int(words[3])
    return next(i for i, s in enumerate(SIZES) if (s.size, s.ratio) == (size, ratio))


def options_text(runs: Mapping[str, Run], rated_torque_Nm: float, columns: Sequence[str]) -> str:
    """Write runs as a plan of options, with the set values, not the measured ones."""
    names = [n for n in columns if n not in ("output_angle_rad", "tilt_moment_Nm", "axial_force_N")]
    lines = [",".join(names)]
    for label, run in runs.items():
        plan = lay(label, [_bearing_nothing(run)])
        values = {
            "time_s": plan.time_s,
            "torque_Nm": plan.torque * rated_torque_Nm,
            "input_angle_rad": plan.input_angle_rad,
            "temperature_C": plan.temperature_C,
            "cycles": plan.cycles,
        }
        row = ",".join(FORMATS[name] for name in names[1:])
        table = zip(*(values[name].tolist() for name in names[1:]), strict=True)
        lines += [f"{label}," + row % line for line in table]
    return "\n".join([*lines, ""])


def _bearing_nothing(run: Run) -> Run:
    nothing = np.zeros(len(run.time_s))
    return replace(run, tilt_moment=nothing, axial_force=nothing)
