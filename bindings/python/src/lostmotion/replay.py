"""The controller's own code over a recorded log: the float32 build of the library, tick by tick.

Each row of the log is one tick. What the controller would have been told is rounded to its
precision, and every operation after that is the library's, so the numbers are those of the target
bit for bit.
"""

from __future__ import annotations

import csv
import io
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np
import numpy.typing as npt

from lostmotion.core import Core, core
from lostmotion.drives import read_drive
from lostmotion.errors import InputError, LibraryError
from lostmotion.export import Profile, build, known_effects, make_controller
from lostmotion.files import read_bytes
from lostmotion.recordings import Campaign, Run
from lostmotion.units import ARCSEC

if TYPE_CHECKING:
    from lostmotion.effects.effect import Effect

FloatArray = npt.NDArray[np.float64]

STATES = (
    "torque_clipped",
    "input_refused",
    "position_limited",
    "velocity_limited",
    "acceleration_limited",
    "jerk_limited",
    "memory_unknown",
    "holding",
    "resetting",
    "faded",
    "misfit",
    "model_refused",
    "watch_refused",
    "headroom_short",
)
"""Names of the LM_STATE_ bits, lowest first."""

OUTPUTS = ("correction_rad", "velocity_rad_s", "acceleration_rad_s2", "lost_motion_rad")
"""Fields of `lm_correction` that are numbers."""

COLUMNS = {
    "torque": "torque_Nm",
    "output_angle": "output_angle_rad",
    "temperature": "temperature_C",
    "cycles": "cycles",
    "tilt_moment": "tilt_moment_Nm",
    "axial_force": "axial_force_N",
}
"""Quantities of a recording that are conditions as they stand."""

PERIOD_SLACK = 0.02
"""A log whose step differs by more than this share from the parameters' period is reported."""


@dataclass
class Tape:
    """What the controller did in one run.

    Attributes
    ----------
    values : ndarray
        A row a tick, columns as `OUTPUTS`, float32.
    status : ndarray of uint32
    start_bound_rad, end_bound_rad : float
        By how much the lost motion may be wrong because the history before the run is unknown.
    """

    run: Run
    values: npt.NDArray[np.float32]
    status: npt.NDArray[np.uint32]
    start_bound_rad: float
    end_bound_rad: float

    def words(self) -> bytes:
        """All bits that came out: per tick the four numbers and the status, little-endian."""
        words = np.empty((len(self.run), len(OUTPUTS) + 1), dtype="<u4")
        words[:, :-1] = self.values.astype("<f4").view("<u4")
        words[:, -1] = self.status
        return words.tobytes()


@dataclass
class Replay:
    """What the controller did over a campaign."""

    parameters: Any
    tapes: list[Tape]
    notes: list[str] = field(default_factory=list)

    def answer(self) -> dict[str, Any]:
        """Answer of the command."""
        status = np.concatenate([tape.status for tape in self.tapes])
        before, after, model = (
            np.concatenate(part) for part in zip(*map(errors_of, self.tapes), strict=True)
        )
        return {
            "schema": "lostmotion.replay/1",
            "fingerprint": f"{self.parameters.fingerprint:08x}",
            "samples": int(status.size),
            "bits_crc32": f"{zlib.crc32(b''.join(tape.words() for tape in self.tapes)):08x}",
            "rms_uncompensated_arcsec": _rms(before) / ARCSEC,
            "rms_compensated_arcsec": _rms(after) / ARCSEC,
            "rms_model_arcsec": _rms(model) / ARCSEC,
            "largest_correction_arcsec": max(
                float(np.max(np.abs(tape.values[:, 0]))) for tape in self.tapes
            )
            / ARCSEC,
            "states": {
                name: int(np.count_nonzero(status >> bit & 1)) for bit, name in enumerate(STATES)
            },
            "by_run": [
                {
                    "run": tape.run.label,
                    "samples": len(tape.run),
                    "unknown_at_start_arcsec": tape.start_bound_rad / ARCSEC,
                    "unknown_at_end_arcsec": tape.end_bound_rad / ARCSEC,
                }
                for tape in self.tapes
            ],
            "notes": self.notes,
        }

    def table(self) -> str:
        """Every tick as CSV, digits enough to give the same float32 again."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(
            (
                "run",
                "time_s",
                "torque_Nm",
                "correction_rad",
                "correction_velocity_rad_per_s",
                "correction_acceleration_rad_per_s2",
                "model_rad",
                "status",
            )
        )
        for tape in self.tapes:
            torque = tape.run.torque_Nm.astype(np.float32)
            for k, row in enumerate(tape.values):
                numbers = (str(value) for value in (torque[k], *row))
                writer.writerow((tape.run.label, tape.run.time_s[k], *numbers, tape.status[k]))
        return out.getvalue()


def errors_of(tape: Tape) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Error of the output without and with the correction, and of the model.

    The zero of a recorded lost motion is arbitrary: it is taken where the model fits best.
    """
    measured = tape.run.lost_motion_rad
    model = tape.values[:, OUTPUTS.index("lost_motion_rad")].astype(np.float64)
    before = measured - np.mean(measured - model)
    return before, before + tape.values[:, 0], before - model


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def read_parameters(
    file: str | Path,
    settings: Mapping[str, float],
    profile: Profile = "full",
    own: Mapping[str, Effect] | None = None,
) -> tuple[Any, float | None, dict[str, str]]:
    """Read a blob, or a drive file as `make_controller` reduces it.

    Parameters
    ----------
    file : str or Path
    settings : mapping
        From `read_settings`.
    profile : str
    own : mapping, optional
        The user's own effects by name; those at work must be compiled as the controller's.

    Returns
    -------
    parameters : cdata
        An owned, checked ``lm_parameters *`` in float32.
    ratio : float or None
        Of the drive; a blob does not hold it.
    columns : dict
        Column map of the drive file.

    Raises
    ------
    InputError
        When the file is neither, or its parameters are refused.
    """
    path = Path(file)
    if path.suffix != ".bin":
        drive = read_drive(path)
        controller = make_controller(drive, settings, profile=profile, own=own)
        for effect in controller.own.values():
            if effect.controller is None:
                found = "a formula" if effect.formula else "a Python function"
                source = "the file that export writes of it" if effect.formula else "one in C"
                expected = f"a shared object: compile {source} with LM_REAL_BITS=32"
                raise InputError("--effects", effect.name, found, expected)
        return build(controller), drive.ratio, drive.columns
    if settings:
        raise InputError("--set", "", f"it with {path.name}", "a drive file: a blob is complete")
    blob = read_bytes(path, "parameters by lostmotion export")
    return load(blob, str(path), own or {}), None, {}


def load(blob: bytes, file: str = "blob", own: Mapping[str, Effect] | None = None) -> Any:
    """Load the binary form as the controller does.

    Raises
    ------
    InputError
        When the library refuses it.
    """
    c = core(32)
    made = c.ffi.new("lm_parameters *")
    runs = {name: effect for name, effect in (own or {}).items() if effect.controller is not None}
    effects = list(known_effects(c, runs).values())
    table = c.ffi.new("lm_effect *[]", effects)
    fault = c.fault()
    status = c.lib.lm_load_parameters(made, blob, len(blob), table, len(effects), fault)
    try:
        c.check(status, fault)
    except LibraryError as error:
        if error.key == "effect":
            found = "one that is not known here"
            expected = "an effect of the library, or your own by --effects FILE"
            raise InputError(file, error.key, found, expected) from None
        raise InputError(
            file, error.key, f"{error.found:.6g}", f"parameters by lostmotion export: {error}"
        ) from None
    return made


def replay(
    parameters: Any, campaign: Campaign, progress: Callable[[int, int], None] | None = None
) -> Replay:
    """Run the compensator over every run of a campaign, from power-up each.

    Parameters
    ----------
    parameters : cdata
        From `read_parameters`.
    campaign : Campaign
    progress : callable, optional
        Called with the runs done and their number.
    """
    c = core(32)
    result = Replay(parameters, [])
    period = float(parameters.limits.period_s)
    steps = np.concatenate([np.diff(run.time_s) for run in campaign.runs])
    usual = float(np.median(steps)) if steps.size else period
    if abs(usual - period) > PERIOD_SLACK * period:
        result.notes.append(
            f"The log's step is {usual * 1e3:.4g} ms, the parameters are for {period * 1e3:.4g} ms:"
            " velocity and acceleration of the correction are those of the parameters' period."
        )
    for done, run in enumerate(campaign.runs):
        result.tapes.append(_run(c, parameters, run))
        if progress is not None:
            progress(done + 1, len(campaign.runs))
    return result


def _run(c: Core, parameters: Any, run: Run) -> Tape:
    columns = conditions(run)
    compensator = c.ffi.new("lm_compensator *")
    fault = c.fault()
    first = float(columns["torque_Nm"][0])
    c.check(c.lib.lm_start_compensator(compensator, parameters, first, fault), fault)
    start = float(c.lib.lm_bound_uncertainty(compensator))
    at = c.ffi.new("lm_conditions *")
    at.temperature_C = c.lib.LM_REFERENCE_TEMPERATURE_C
    values = np.empty((len(run), len(OUTPUTS)), dtype=np.float32)
    status = np.empty(len(run), dtype=np.uint32)
    named = list(columns.items())
    step = c.lib.lm_step_compensator
    for k in range(len(run)):
        for name, column in named:
            setattr(at, name, column[k])
        now = step(compensator, at)
        values[k] = (
            now.correction_rad,
            now.velocity_rad_s,
            now.acceleration_rad_s2,
            now.lost_motion_rad,
        )
        status[k] = now.status
    return Tape(run, values, status, start, float(c.lib.lm_bound_uncertainty(compensator)))


def conditions(run: Run) -> dict[str, npt.NDArray[np.float32]]:
    """Return what the controller is told in each tick, by the name of the field in C.

    Velocities and accelerations are backward differences, the input angle is wrapped to one turn,
    as a controller has them. What was before the log is not known: the drive is taken to have moved
    on as in its first step, and the time before its first row counts, as every time that is not
    told, as one period of the parameters.
    """
    found = {
        field: run.columns[name].astype(np.float32)
        for name, field in COLUMNS.items()
        if name in run.columns
    }
    elapsed = np.diff(run.time_s, prepend=run.time_s[0])
    found["elapsed_s"] = elapsed.astype(np.float32)
    inverse = np.divide(1.0, elapsed, out=np.zeros_like(elapsed), where=elapsed > 0)

    def rate(values: FloatArray) -> FloatArray:
        slope = np.diff(values, prepend=values[0]) * inverse
        slope[:1] = slope[1:2] if slope.size > 1 else 0.0
        return slope

    if "input_angle" in run.columns:
        angle = run.columns["input_angle"]
        wrapped = np.remainder(angle + np.pi, 2 * np.pi) - np.pi
        found["input_angle_rad"] = wrapped.astype(np.float32)
        found["input_velocity_rad_s"] = rate(angle).astype(np.float32)
    if "output_angle" in run.columns:
        acceleration = rate(rate(run.columns["output_angle"]))
        found["output_acceleration_rad_s2"] = acceleration.astype(np.float32)
    return found


def show_replay(result: Replay, out: TextIO) -> None:
    """Print the answer of the command."""
    answer = result.answer()
    print(f"{answer['samples']} ticks, bits {answer['bits_crc32']}\n", file=out)
    print("rms error of the output, its zero taken where the model fits best:", file=out)
    for name in ("uncompensated", "compensated"):
        print(f"  {name:14}{answer[f'rms_{name}_arcsec']:9.2f} arcsec", file=out)
    print(f"  {'model alone':14}{answer['rms_model_arcsec']:9.2f} arcsec", file=out)
    print(f"largest correction {answer['largest_correction_arcsec']:.2f} arcsec", file=out)
    print("\nunknown by the history before the log, at its start and end:", file=out)
    for run in answer["by_run"]:
        start, end = run["unknown_at_start_arcsec"], run["unknown_at_end_arcsec"]
        print(f"  run {run['run']}: {start:.2f} and {end:.2f} arcsec", file=out)
    seen = {name: count for name, count in answer["states"].items() if count}
    if seen:
        print("\nstatus bits, ticks:", file=out)
        for name, count in seen.items():
            print(f"  {name.replace('_', ' ')}: {count}", file=out)
    for note in answer["notes"]:
        print(f"\n{note}", file=out)
