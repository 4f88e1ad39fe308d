"""Independent laboratories: every friction law under every protocol, with one effect or none.

    lab = Laboratory(seed, law="dahl", protocol="arm")
    lab.write(folder, effect="thermal_gap", noises=1.0)

The size of a hidden effect is its residual after an ideal refit, which has the law, fits all its
parameters (`laws.SCALED`) and the zero of each run, and uses the recorded torque.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .bench import TANGENT_STEP, TooSmallError, stream
from .campaign import FORMATS, TORQUE_NOISE, angle_noise
from .hidden import HIDDEN, Readings
from .laws import LawDrive, LawMemory, LawSamples, make_law_drive, sheet_of, turn_law
from .mechanics import ARCSEC, Array, Turned
from .plans import ROOM_C, Plan, Run, lay

SCATTER = {"stiffness": 0.003, "friction": 0.02, "gap": 0.01}
"""Rms scatter from run to run, as shares."""
SIZE_TOLERANCE = 0.03
SEARCHES = 12
EXERCISE_SAMPLES = 40
"""Samples of torque that are not recorded, before the first run and between runs of `strangers`."""


@dataclass(frozen=True)
class Sensing:
    """How a protocol's angles and times are read."""

    noise_arcsec: float
    output_bits: float
    input_bits: float
    division_counts: float = 0.1
    """Amplitude of the sub-divisional error, once and twice a count of 64."""
    jitter: float = 0.0
    """Rms error of the clock, in sample periods."""


FINE = Sensing(1.5, 22, 18)
JOINT = Sensing(6.0, 17, 14, jitter=0.1)
COARSE = Sensing(6.0, 14, 14, jitter=0.1)
TABLE = Sensing(1.5, 20, 14, jitter=0.1)

LINES = 64
"""Counts between two lines of an encoder's scale, within which it interpolates."""


def wave(time: Array, period_s: float) -> Array:
    """Torque cycles between -1 and 1 that begin at zero, of rounded triangles."""
    return np.arcsin(0.97 * np.sin(2 * np.pi * time / period_s)) / np.arcsin(0.97)


def loop_run(
    amplitude: float, angle: float, temperature_C: float, samples: int, cycles: float = 0.0
) -> Run:
    """Two torque cycles at a locked generator."""
    time = 60.0 / samples * np.arange(samples)
    warm = temperature_C + 0.3 * np.sin(time / 40.0)
    at = np.full(samples, angle)
    return Run("loop", time, amplitude * wave(time, 30.0), at, warm, cycles)


def bench_runs(
    count: int, samples: int, chance: np.random.Generator, amplitudes: tuple[float, ...]
) -> list[Run]:
    """Loops at a locked generator: amplitude, temperature, cycles and angle dealt apart."""
    order = chance.permutation(count)
    warm = np.linspace(10.0, 50.0, 5)[order % 5]
    worn = np.round(3e5 * np.linspace(0, 1, 4)[np.sort(chance.integers(0, 4, count))] ** 2)
    angles = chance.uniform(0, 2 * np.pi, max(4, count // 4))
    return [
        loop_run(
            amplitudes[i % len(amplitudes)],
            float(angles[chance.integers(len(angles))]),
            float(warm[i] + chance.uniform(-1, 1)),
            samples,
            float(worn[i]),
        )
        for i in range(count)
    ]


def arm_runs(ratio: int, chance: np.random.Generator) -> list[Run]:
    """An arm that swings under its weight and a payload, at several speeds, while it warms up."""
    runs = []
    for i in range(16):
        payload = (0.0, 0.2, 0.4, 0.6)[i % 4]
        duration = (12.0, 25.0)[i // 4 % 2]
        time = duration / 500 * np.arange(500)
        swing = chance.uniform(1.0, 1.5) * np.sin(2 * np.pi * time / (0.5 * duration))
        lean = chance.uniform(-0.4, 0.4)
        warm = 18.0 + 22.0 * (1 - np.exp(-i / 5.0)) + 1.0 * chance.standard_normal()
        runs.append(
            Run(
                "arm",
                time,
                (0.25 + payload) * np.sin(swing + lean),
                swing * ratio,
                warm + 0.2 * np.sin(time / 9.0),
                float(20 * i),
                True,
            )
        )
    return runs


def table_runs(ratio: int, chance: np.random.Generator) -> list[Run]:
    """A turntable with a mass off its axis, which never stops: the output's angle only rises."""
    runs, angle = [], chance.uniform(0, 6.0)
    for i in range(12):
        speed = (0.4, 1.2, 2.5)[i % 3]
        duration = 3.2 * 2 * np.pi / speed
        time = duration / 700 * np.arange(700)
        output = angle + speed * time
        angle = output[-1] + speed * 5.0
        load = (0.3, 0.6, 0.9)[i // 3 % 3]
        warm = 20.0 + 25.0 * chance.random()
        runs.append(
            Run(
                "turning",
                time,
                load * np.sin(output),
                output * ratio,
                warm + 0.3 * np.sin(time / 11.0),
                float(3e4 * i),
                True,
            )
        )
    return runs


LOOPS = (0.15, 0.35, 0.7, 1.0)

PROTOCOLS: dict[str, tuple[Callable[[int, np.random.Generator], list[Run]], Sensing]] = {
    "bench": (lambda _, chance: bench_runs(20, 300, chance, LOOPS), FINE),
    "8 runs": (lambda _, chance: bench_runs(8, 400, chance, (0.35, 1.0)), FINE),
    "60 runs": (lambda _, chance: bench_runs(60, 150, chance, LOOPS), FINE),
    "strangers": (lambda _, chance: bench_runs(12, 300, chance, LOOPS), FINE),
    "arm": (arm_runs, JOINT),
    "14 bits": (arm_runs, COARSE),
    "turntable": (table_runs, TABLE),
}
"""Bench loops (20, 8 and 60 runs; strangers: files of one run each, with a history before it that
was not recorded), an arm under gravity, the same read by encoders of 14 bits, a turntable."""

HIDEABLE = {
    "bench": ("thermal_gap", "thermal_stiffness", "wear", "stiffness_modulation", "creep"),
    "8 runs": ("thermal_gap", "thermal_stiffness", "asymmetric_stiffness"),
    "60 runs": ("thermal_gap", "thermal_stiffness", "wear", "stiffness_modulation", "creep"),
    "strangers": ("thermal_gap", "thermal_stiffness", "stiffness_modulation"),
    "arm": ("thermal_gap", "kinematic_error", "output_eccentricity", "stiffness_modulation"),
    "14 bits": ("kinematic_error", "output_eccentricity"),
    "turntable": ("kinematic_error", "thermal_gap", "stiffness_modulation", "thermal_stiffness"),
}
"""Effects that each protocol can identify."""


@dataclass
class LawBench:
    """A drive before it is turned, as `hidden` changes it."""

    plan: Plan
    drive: LawDrive
    samples: LawSamples
    warmer_K: Array


class Laboratory:
    """One specimen of a drive with a law of friction, under one protocol."""

    def __init__(self, seed: int, law: str, protocol: str, scatter: float = 1.0) -> None:
        self.seed, self.law, self.protocol = seed, law, protocol
        self.drive = make_law_drive(law, stream(seed, f"drive {law}"))
        make, self.sensing = PROTOCOLS[protocol]
        runs = make(self.drive.ratio, stream(seed, f"plan {protocol}"))
        nothing = [replace_loads(run) for run in runs]
        self.plan = lay(protocol, nothing)
        chance = stream(seed, "scatter")
        self.scattered = {
            name: 1 + scatter * rms * chance.standard_normal(self.plan.runs)
            for name, rms in SCATTER.items()
        }

    # --- turning ---------------------------------------------------------------------------------

    def phases(self, name: str) -> Array:
        """Random phases of an effect."""
        return stream(self.seed, f"phase {name}").uniform(0, 2 * np.pi, 2)

    def turn(self, drive: LawDrive, samples: LawSamples) -> tuple[Array, Array]:
        """Turn a drive through the plan, after a history that was not recorded."""
        chance = stream(self.seed, "history")
        memory = LawMemory()
        angle, elastic = np.empty((2, len(self.plan.run)))
        for i, rows in enumerate(self.plan.slices()):
            if i == 0 or self.protocol == "strangers":
                ends = self.drive.rated_torque_Nm * chance.uniform(-0.8, 0.8, 4)
                torque = np.interp(np.linspace(0, 3, EXERCISE_SAMPLES), np.arange(4), ends)
                first = samples.part(slice(rows.start, rows.start + 1))
                one = np.ones(EXERCISE_SAMPLES)
                before = LawSamples(
                    torque,
                    first.gap_rad * one,
                    first.compliance * one,
                    first.friction * one,
                    0 * one,
                )
                turn_law(drive, before, memory)
            angle[rows], elastic[rows] = turn_law(drive, samples.part(rows), memory)
        return angle, elastic

    def read(self, effects: Mapping[str, float], drive: LawDrive | None = None) -> Readings:
        """Readings without noise."""
        drive, plan = drive or self.drive, self.plan
        one = np.ones(len(plan.run))
        samples = LawSamples(
            plan.torque * drive.rated_torque_Nm,
            drive.gap_rad * self.scattered["gap"][plan.run],
            one / self.scattered["stiffness"][plan.run],
            one * self.scattered["friction"][plan.run],
            plan.step_s.copy(),
        )
        bench = LawBench(plan, drive, samples, plan.temperature_C - ROOM_C)
        acting = samples.torque_Nm.copy()
        for name, magnitude in effects.items():
            before = HIDDEN[name].before
            if before:
                before(bench, magnitude, self.phases(name))  # type: ignore[arg-type]
        angle, elastic = self.turn(bench.drive, bench.samples)
        readings = Readings(Turned(angle, angle.copy(), elastic), angle.copy(), acting)
        for name, magnitude in effects.items():
            after = HIDDEN[name].after
            if after:
                after(bench, readings, magnitude, self.phases(name))  # type: ignore[arg-type]
        return readings

    # --- the size of an effect -------------------------------------------------------------------

    def centred(self, columns: Array) -> Array:
        """Remove the zero of each run."""
        out = np.array(columns, dtype=np.float64)
        for rows in self.plan.slices():
            out[rows] -= out[rows].mean(axis=0)
        return out

    @cached_property
    def plain(self) -> Array:
        """Lost motion without hidden effects."""
        return self.read({}).lost_motion_rad

    @cached_property
    def tangents(self) -> Array:
        """Derivative of the lost motion with respect to each parameter of the law."""
        columns = [
            self.read({}, self.drive.scaled(name, 1 + TANGENT_STEP)).lost_motion_rad - self.plain
            for name in self.drive.free
        ]
        return self.centred(np.column_stack(columns)) / TANGENT_STEP

    def left(self, name: str, magnitude: float) -> float:
        """Rms residual of an effect after an ideal refit, arc seconds."""
        change = self.centred(self.read({name: magnitude}).lost_motion_rad - self.plain)
        taken = self.tangents @ np.linalg.lstsq(self.tangents, change, rcond=None)[0]
        return float(np.sqrt(np.mean((change - taken) ** 2)) / ARCSEC)

    def magnitude_for(self, name: str, noises: float) -> float:
        """The magnitude with a residual of so many noises."""
        wanted = noises * self.noise_arcsec
        limit = HIDDEN[name].limit * HIDDEN[name].scale(self.drive)  # type: ignore[arg-type]
        magnitude = min(HIDDEN[name].typical, limit)
        for _ in range(SEARCHES):
            found = self.left(name, magnitude)
            if abs(found / wanted - 1) <= SIZE_TOLERANCE:
                return magnitude
            if magnitude >= limit and found < wanted:
                break
            magnitude = min(limit, magnitude * float(np.clip(wanted / found, 0.2, 5.0)))
        if found < 0.8 * wanted:
            raise TooSmallError(f"{name}: {found:.2f} arcsec of {wanted:.2f} in {self.protocol}")
        return magnitude

    # --- reading ---------------------------------------------------------------------------------

    @property
    def noise_arcsec(self) -> float:
        """Noise of one reading of the lost motion: angle noise and counts of both encoders."""
        s, turn = self.sensing, 360 * 3600.0
        out = turn / 2**s.output_bits
        # If the input is at rest, its count is an offset of the run.
        into = turn / 2**s.input_bits / self.drive.ratio if self.plan.turning.any() else 0.0
        return float(np.sqrt(s.noise_arcsec**2 + (out**2 + into**2) / 12))

    def encoder(self, angle: Array, bits: float) -> Array:
        """Angle in counts, with the error of interpolation between two lines."""
        count = 2 * np.pi / 2**bits
        phase = 2 * np.pi * angle / (count * LINES)
        error = self.sensing.division_counts * (np.sin(phase) + 0.5 * np.sin(2 * phase + 1.0))
        return count * np.round(angle / count + error)

    def measured(self, readings: Readings) -> dict[str, Array]:
        """Columns as they are written."""
        plan, sensing, drive = self.plan, self.sensing, self.drive
        lengths = [rows.stop - rows.start for rows in plan.slices()]
        noise = sensing.noise_arcsec * angle_noise(stream(self.seed, "angle"), lengths)
        shake = stream(self.seed, "clock").standard_normal(len(plan.run))
        period = np.repeat([plan.time_s[rows][1] for rows in plan.slices()], lengths)
        time = plan.time_s + sensing.jitter * period * np.clip(shake, -2.5, 2.5)
        for rows in plan.slices():
            time[rows] -= time[rows.start]
        output = plan.input_angle_rad / drive.ratio + readings.lost_motion_rad + noise * ARCSEC
        torque = readings.torque_Nm + TORQUE_NOISE * drive.rated_torque_Nm * stream(
            self.seed, "torque"
        ).standard_normal(len(noise))
        return {
            "run": plan.run + 1.0,
            "time_s": time,
            "torque_Nm": torque,
            "input_angle_rad": self.encoder(plan.input_angle_rad, sensing.input_bits),
            "output_angle_rad": self.encoder(output, sensing.output_bits),
            "temperature_C": plan.temperature_C,
            "cycles": plan.cycles,
        }

    def write(self, folder: Path, effect: str = "", noises: float = 1.0) -> dict[str, Any]:
        """Write recordings, sheet and truth into a folder; return the truth."""
        effects = {effect: self.magnitude_for(effect, noises)} if effect else {}
        readings = self.read(effects)
        columns = self.measured(readings)
        folder.mkdir(parents=True, exist_ok=True)
        strangers = self.protocol == "strangers"
        parts = self.plan.slices() if strangers else [slice(None)]
        row = ",".join(FORMATS[name] for name in columns)
        for number, rows in enumerate(parts):
            own = {name: values[rows] for name, values in columns.items()}
            if strangers:
                own["run"] = np.ones(len(own["run"]))
            lines = [
                row % values for values in zip(*map(np.ndarray.tolist, own.values()), strict=True)
            ]
            text = "\n".join([",".join(columns), *lines, ""])
            name = f"recording_{number:02d}.csv.gz" if strangers else "recording.csv.gz"
            (folder / name).write_bytes(gzip.compress(text.encode(), 6, mtime=0))
        sheet = sheet_of(self.drive, stream(self.seed, "sheet"))
        head = ['name = "drive"', f"ratio = {self.drive.ratio}"]
        head.append(f"rated_torque_Nm = {self.drive.rated_torque_Nm:g}")
        lines = ["[drive]", *head, "", "[catalogue]", *(f"{k} = {v:g}" for k, v in sheet.items())]
        (folder / "drive.toml").write_text("\n".join(lines) + "\n")
        lost = columns["output_angle_rad"] - columns["input_angle_rad"] / self.drive.ratio
        error = self.centred(lost - readings.lost_motion_rad) / ARCSEC
        clean = self.centred(readings.lost_motion_rad)
        same = Laboratory(self.seed, self.law, self.protocol, scatter=0.0)
        scatter = self.centred(
            self.read(effects).lost_motion_rad - same.read(effects).lost_motion_rad
        )
        truth = {
            "seed": self.seed,
            "law": self.law,
            "protocol": self.protocol,
            "effects": effects,
            "noises": noises if effect else 0.0,
            "noise_arcsec_rms": float(np.sqrt(np.mean(error**2))),
            "run_scatter_arcsec_rms": float(np.sqrt(np.mean(scatter**2)) / ARCSEC),
            "lost_motion_rms_arcsec": float(np.sqrt(np.mean(clean**2)) / ARCSEC),
            "rows": len(self.plan.run),
            "runs": self.plan.runs,
        }
        (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")
        return truth


def replace_loads(run: Run) -> Run:
    """A run without load on its bearing."""
    zero = np.zeros(len(run.time_s))
    return replace(run, tilt_moment=zero, axial_force=zero)
