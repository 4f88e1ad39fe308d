"""Evaluation over whole recordings: torsion curve, 8 operators, 3 effects; rows/s on one core.

    python tests/benchmarks/bench_evaluation.py [--rows 2000000]     # pip install numba first

It is compared with the same model as a good NumPy user writes it: operators in a loop compiled by
Numba, the torsion curve by np.interp, the effects in array expressions. The angles agree.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lostmotion.core import core
from lostmotion.export import Controller, Envelope, Limits, Play, Watch, build

NO_ENVELOPE = Envelope()

try:
    from numba import njit
except ImportError:  # only the comparison needs Numba
    njit = None

Array = NDArray[np.float64]

KNOTS = 28
RADII_NM = 40 * np.geomspace(1 / 200, 0.6, 8)
SHARES = np.full(8, 0.06)
KINEMATIC = (4e-5, 1e-5, 8e-6, -3e-6)
THERMAL = (5e-6, 0.05, 0.4)
STIFFNESS = 1e-3
ROUNDS = 5


def torsion_curve() -> tuple[Array, Array]:
    """Return knots of an odd torsion curve that stiffens."""
    knots = 40 * np.geomspace(1e-3, 1.2, KNOTS)
    angle = knots / 25e3 + 2e-4 * np.tanh(knots / 8)
    return (
        np.concatenate((-knots[::-1], [0.0], knots)),
        np.concatenate((-angle[::-1], [0.0], angle)),
    )


def recording(rows: int) -> dict[str, Array]:
    """Make torque loops with noise, a turning wave generator and a warming drive."""
    chance = np.random.default_rng(1)
    t = np.arange(rows) * 1e-3
    return {
        "torque_Nm": 36 * np.sin(0.3 * t) + 0.01 * chance.standard_normal(rows),
        "input_angle_rad": np.remainder(7.0 * t + np.pi, 2 * np.pi) - np.pi,
        "temperature_C": 22 + 20 * (1 - np.exp(-t / 600)),
    }


def plays(torque: Array, radius: Array, share: Array) -> Array:  # pragma: no cover
    """Add up the operators of each sample, in N m."""
    z = np.zeros(radius.size)
    out = np.empty(torque.size)
    for k in range(torque.size):
        total = 0.0
        for i in range(radius.size):
            z[i] = max(torque[k] - radius[i], min(torque[k] + radius[i], z[i]))
            total += share[i] * (z[i] - torque[k])
        out[k] = total
    return out


compiled_plays = plays if njit is None else njit(plays)


def in_numpy(run: dict[str, Array], knots: Array, angle: Array) -> Array:
    """Evaluate the model with NumPy and Numba."""
    torque = run["torque_Nm"]
    wound = torque + compiled_plays(torque, RADII_NM, SHARES)
    elastic = np.interp(wound, knots, angle)
    turn = run["input_angle_rad"]
    out = elastic + KINEMATIC[0] * np.cos(2 * turn) + KINEMATIC[1] * np.sin(2 * turn)
    out += KINEMATIC[2] * np.cos(4 * turn) + KINEMATIC[3] * np.sin(4 * turn)
    warmer = run["temperature_C"] - 20.0
    closed = np.clip(wound / THERMAL[2], -1, 1)
    out += np.maximum(THERMAL[0] * warmer, -THERMAL[1]) * closed
    out += STIFFNESS * warmer * elastic
    return np.asarray(out)


def best_of(call: Callable[[], object]) -> float:
    """Least processor time of a few rounds, s."""
    times = []
    for _ in range(ROUNDS):
        begin = time.process_time()
        call()
        times.append(time.process_time() - begin)
    return min(times)


def main() -> None:
    """Time both and print rows a second."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=2_000_000)
    rows = parser.parse_args().rows
    knots, angle = torsion_curve()
    run = recording(rows)
    inside = [Play(float(r), 0.0, float(s)) for r, s in zip(RADII_NM, SHARES, strict=True)]
    effects = [
        ("kinematic_error", list(KINEMATIC)),
        ("thermal_gap", list(THERMAL)),
        ("thermal_stiffness", [STIFFNESS]),
    ]
    c = core(64)
    found: dict[str, Array] = {}

    def library(
        name: str, some: list[tuple[str, list[float]]], envelope: Envelope = NO_ENVELOPE
    ) -> Callable[[], object]:
        limits = Limits(1e-3, 1e-3, 1e-2, 1.0, 100.0, 50.0)
        watch = Watch(1.0, 1.0, 1e-5, 1e-4)
        made = Controller(
            48.0, knots, angle, limits, watch, [], inside, some, [], envelope=envelope
        )
        parameters = build(made, c)
        record = c.ffi.new("lm_recording *")
        record.count = rows
        keep = [c.pointer(c.array(values)) for values in run.values()]
        for column, pointer in zip(run, keep, strict=True):
            setattr(record, column, pointer)
        out = c.zeros(rows)
        memory = c.ffi.new("lm_memory *")

        def call() -> None:
            c.lib.lm_start_model(memory, 0.0)
            c.lib.lm_run_model(parameters, memory, record, c.pointer(out, write=True))
            found[name] = np.asarray(out)
            _ = keep

        return call

    plain = best_of(library("plain", []))
    one = best_of(library("one", effects[:1]))
    full = best_of(library("full", effects))
    followed = best_of(library("followed", effects, Envelope(3.0, 12.0)))
    times = {
        "library, baseline": plain,
        "library, baseline and kinematic error": one,
        "library, baseline and 3 effects": full,
        "library, the same in an envelope": followed,
    }
    if njit is not None:
        in_numpy(run, knots, angle)  # compiles
        times["NumPy with Numba, the same"] = best_of(lambda: in_numpy(run, knots, angle))
        off = np.max(np.abs(found["full"] - in_numpy(run, knots, angle)))
        print(f"largest difference {off:.2g} rad")
    for name, seconds in times.items():
        print(f"{name:<38} {rows / seconds / 1e6:7.1f} million rows a second")


if __name__ == "__main__":
    main()
