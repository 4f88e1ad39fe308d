"""Campaigns: readings with the noise of a rig, written like recordings."""

from __future__ import annotations

import gzip
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import lfilter

from .bench import COLOUR, COLOURED_SHARE, SIGMA_ARCSEC, Residual, TestBench, stream
from .hidden import HIDDEN, Event, Readings, lagged
from .mechanics import ARCSEC, Array

TORQUE_NOISE = 2e-4
"""Rms noise of the torque, as a share of the rated one."""
COUNT_ARCSEC = 0.3
AXIAL_ARM_M = 0.1

FORMATS = {
    "run": "%d",
    "time_s": "%.4f",
    "torque_Nm": "%.5g",
    "input_angle_rad": "%.6f",
    "output_angle_rad": "%.8f",
    "temperature_C": "%.2f",
    "cycles": "%d",
    "tilt_moment_Nm": "%.4g",
    "axial_force_N": "%.4g",
}
ALWAYS = FORMATS.keys() - {"tilt_moment_Nm", "axial_force_N"}


@dataclass(frozen=True)
class Conditions:
    """Conditions of the measurement; by default the standard ones."""

    noise: float = 1.0
    """Factor of the angle noise."""
    scatter: float = 1.0
    """Factor of the scatter from run to run."""
    sheet_error: float = 0.03
    """Rms error of the stiffnesses on the catalogue sheet."""
    sheet_bias: float = 0.0
    """Common error of the stiffnesses on the catalogue sheet."""
    outliers: float = 0.0
    """Share of samples with an outlier in the output angle."""
    outlier_arcsec: float = 60.0
    dropped_counts: int = 0
    """Counts that the output encoder loses at one moment."""
    remount_arcsec: float = 0.0
    """Rms shift of the zero from run to run."""
    temperature_lag_s: float = 0.0
    """Time constant with which the temperature sensor follows the drive."""
    extra_columns: tuple[str, ...] = ()
    """Tilt moment and axial force, beyond what the hidden effects need."""
    dropped_columns: tuple[str, ...] = ()


STANDARD = Conditions()


def angle_noise(chance: np.random.Generator, lengths: list[int]) -> Array:
    """White noise and a first-order autoregression of unit rms together, run by run."""
    runs = []
    for length in lengths:
        white, driven = chance.standard_normal((2, length))
        driven *= np.sqrt(1 - COLOUR**2)
        driven[0] /= np.sqrt(1 - COLOUR**2)
        coloured = lfilter([1], [1, -COLOUR], driven)
        runs.append(np.sqrt(1 - COLOURED_SHARE) * white + np.sqrt(COLOURED_SHARE) * coloured)
    return np.concatenate(runs)


@dataclass
class Campaign:
    """A campaign with its hidden effects."""

    bench: TestBench
    effects: dict[str, float]
    conditions: Conditions = STANDARD
    kind: str = "single"
    residuals: dict[str, Residual] = field(default_factory=dict)
    """Residual of each effect alone after an ideal refit."""

    @cached_property
    def readings(self) -> Readings:
        """Readings without noise."""
        return self.bench.read(self.effects)

    @cached_property
    def events(self) -> list[Event]:
        """Sudden events, those of the encoder among them."""
        counts = self.conditions.dropped_counts
        if not counts:
            return list(self.readings.events)
        place = self._dropped_at
        plan = self.bench.plan
        return [
            *self.readings.events,
            Event(int(plan.run[place]) + 1, float(plan.time_s[place]), -counts * COUNT_ARCSEC),
        ]

    @cached_property
    def _dropped_at(self) -> int:
        chance = stream(self.bench.seed, "dropped counts")
        rows = self.bench.plan.slices()[int(chance.integers(self.bench.plan.runs))]
        return rows.start + int(chance.uniform(0.2, 0.8) * (rows.stop - rows.start))

    @cached_property
    def measured(self) -> dict[str, Array]:
        """Every column that the rig can write, with noise, before it is rounded for the file."""
        bench, plan, conditions = self.bench, self.bench.plan, self.conditions
        rated = bench.drive.rated_torque_Nm
        lengths = [rows.stop - rows.start for rows in plan.slices()]
        noise = SIGMA_ARCSEC * conditions.noise * angle_noise(stream(bench.seed, "angle"), lengths)
        shift = conditions.remount_arcsec * stream(bench.seed, "mount").standard_normal(plan.runs)
        noise += shift[plan.run]
        if conditions.outliers:
            chance = stream(bench.seed, "outliers")
            hit = chance.random(len(noise)) < conditions.outliers
            size = conditions.outlier_arcsec * chance.uniform(0.3, 1.0, len(noise))
            noise += hit * size * chance.choice((-1.0, 1.0), len(noise))
        lost_motion = self.readings.lost_motion_rad + noise * ARCSEC
        if conditions.dropped_counts:
            lost_motion[self._dropped_at :] -= conditions.dropped_counts * COUNT_ARCSEC * ARCSEC
        step = COUNT_ARCSEC * ARCSEC
        output = lost_motion + plan.input_angle_rad / bench.drive.ratio
        temperature = plan.temperature_C
        if conditions.temperature_lag_s:
            temperature = lagged(temperature, plan.step_s, conditions.temperature_lag_s)
        torque_noise = stream(bench.seed, "torque").standard_normal(len(noise))
        loads = stream(bench.seed, "loads").standard_normal((len(noise), 2)).T * 1e-3
        return {
            "run": plan.run + 1.0,
            "time_s": plan.time_s,
            "torque_Nm": self.readings.torque_Nm + TORQUE_NOISE * rated * torque_noise,
            "input_angle_rad": plan.input_angle_rad,
            "output_angle_rad": step * np.round(output / step),
            "temperature_C": temperature,
            "cycles": plan.cycles,
            "tilt_moment_Nm": (plan.tilt_moment + loads[0]) * rated,
            "axial_force_N": (plan.axial_force + loads[1]) * rated / AXIAL_ARM_M,
        }

    @property
    def columns(self) -> list[str]:
        """Names of the columns that are written, in order."""
        wanted = set(ALWAYS) | set(self.conditions.extra_columns)
        wanted.update(*(HIDDEN[name].columns for name in self.effects))
        return [name for name in FORMATS if name in wanted - set(self.conditions.dropped_columns)]

    def truth(self, twins: Mapping[str, float] | None = None) -> dict[str, Any]:
        """The truth, with everything that an evaluation needs."""
        bench = self.bench
        effects = []
        for name, magnitude in self.effects.items():
            hidden = HIDDEN[name]
            effect: dict[str, Any] = {
                "name": name,
                "magnitude": magnitude,
                "unit": hidden.unit,
                "phases_rad": bench.phases(name)[: hidden.phases].tolist(),
                "in_library": not hidden.outside,
            }
            residual = self.residuals.get(name)
            if residual:
                information = bench.information(residual.left_rad[:, None])
                effect |= {
                    "residual_sigma": residual.arcsec / SIGMA_ARCSEC,
                    "ideal_z": float(np.sqrt(information[0, 0])),
                    "refit_scales": residual.scales,
                }
            if hidden.outside:
                effect["depends_on"] = list(hidden.depends_on)
            effects.append(effect)
        if not effects:
            verdicts = ["complete"]
        elif any(HIDDEN[name].outside for name in self.effects):
            verdicts = ["unexplained"]
        elif not set().union(*(HIDDEN[name].columns for name in self.effects)) <= set(self.columns):
            # An effect that depends on a missing column cannot be named.
            verdicts = ["unexplained", "ambiguous"]
        elif twins:
            verdicts = ["missing-effect", "ambiguous"]
        else:
            verdicts = ["missing-effect"]
        clean = bench.plain
        scatter = clean - bench.unscattered
        answer: dict[str, Any] = {
            "kind": self.kind,
            "effects": {effect["name"]: effect["magnitude"] for effect in effects},
            "hidden": effects,
            "verdicts": verdicts,
            "events": [asdict(event) for event in self.events],
            "seed": bench.seed,
            "drive": bench.drive.name,
            "plan": bench.plan.name,
            "conditions": asdict(self.conditions),
            "rows": len(bench.plan.run),
            "runs": bench.plan.runs,
            "sigma_arcsec": SIGMA_ARCSEC,
            "noise_arcsec_rms": float(
                np.std(self.measured["output_angle_rad"] - self._noiseless) / ARCSEC
            ),
            "torque_noise_Nm_rms": float(
                np.std(self.measured["torque_Nm"] - self.readings.torque_Nm)
            ),
            "run_scatter_arcsec_rms": float(np.sqrt(np.mean(bench.centred(scatter) ** 2)) / ARCSEC),
            "lost_motion_rms_arcsec": float(np.std(self.readings.lost_motion_rad) / ARCSEC),
        }
        if twins:
            answer["twins"] = dict(twins)
        return answer

    @property
    def _noiseless(self) -> Array:
        return self.readings.lost_motion_rad + self.bench.plan.input_angle_rad / (
            self.bench.drive.ratio
        )

    def sheet_text(self, name: str) -> str:
        """The catalogue data of the drive as a drive file."""
        drive = self.bench.drive
        lines = [
            "# The catalogue sheet of the drive.",
            "[drive]",
            f'name = "{name}"',
            f"ratio = {drive.ratio}",
            f"rated_torque_Nm = {drive.rated_torque_Nm:g}",
            "",
            "[catalogue]",
            *(f"{key} = {value:g}" for key, value in drive.sheet.items()),
        ]
        return "\n".join(lines) + "\n"

    def csv_text(self) -> str:
        """The measurement file."""
        names = self.columns
        row = ",".join(FORMATS[name] for name in names)
        columns = zip(*(self.measured[name].tolist() for name in names), strict=True)
        return "\n".join([",".join(names), *(row % values for values in columns), ""])

    def write(
        self, folder: Path, name: str, twins: Mapping[str, float] | None = None
    ) -> dict[str, Any]:
        """Write the measurement file, the sheet and the truth; return the truth."""
        folder.mkdir(parents=True, exist_ok=True)
        truth = self.truth(twins)
        # No time in the header: the same seed gives the same bytes.
        packed = gzip.compress(self.csv_text().encode(), 6, mtime=0)
        (folder / f"{name}.csv.gz").write_bytes(packed)
        (folder / f"{name}.toml").write_text(self.sheet_text(name))
        (folder / f"{name}.truth.json").write_text(json.dumps(truth, indent=1) + "\n")
        return truth


def make_campaign(
    seed: int,
    drive: int,
    sigmas: Mapping[str, float],
    plan: str = "standard",
    conditions: Conditions = STANDARD,
    magnitudes: Mapping[str, float] | None = None,
    kind: str = "single",
) -> Campaign:
    """Hide effects, each of a residual (in sigma, for this effect alone) or a magnitude."""
    named = [*sigmas, *(magnitudes or {})]
    bench = TestBench(
        seed,
        drive,
        plan,
        scatter=conditions.scatter,
        noise=conditions.noise,
        sheet_error=conditions.sheet_error,
        sheet_bias=conditions.sheet_bias,
        spike=plan != "extended" and any(HIDDEN[name].spike for name in named),
    )
    campaign = Campaign(bench, {}, conditions, kind)
    for name in named:
        if magnitudes and name in magnitudes:
            magnitude = magnitudes[name]
            residual = bench.absorb({name: magnitude})
        else:
            magnitude, residual = bench.magnitude_for(name, sigmas[name])
        campaign.effects[name] = magnitude
        campaign.residuals[name] = residual
    return campaign
