"""Run the controller's code over a recorded log: the float32 library, tick by tick.

Each row of the log is one tick, including rows with missing numbers: the compensator receives NaN
and acts as on the target. The inputs of the controller are rounded to its precision, and all
further operations are those of the library, so the results are bit-identical to those of the
target.

Missing ticks are not invented: the compensator is stepped once across a gap, with the gap's length
as `elapsed_s`. They are counted, because a controller that continued to run has a different
friction state.
"""

from __future__ import annotations

import zlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from lostmotion.arrays import FloatArray
from lostmotion.core import NEEDS, Core, core
from lostmotion.drives import read_drive
from lostmotion.errors import InputError, LibraryError
from lostmotion.export import Profile, build, known_effects, make_controller
from lostmotion.files import csv_text, read_bytes
from lostmotion.on_progress import OnProgress
from lostmotion.recordings import QUANTITIES, Campaign, Run
from lostmotion.recordings.findings import RUNS_LISTED
from lostmotion.rms import rms_of
from lostmotion.units import ARCSEC

if TYPE_CHECKING:
    from lostmotion.effects.effect import Effect


def _names_of_bits(prefix: str) -> tuple[str, ...]:
    """Names of the bits of the library that begin with a prefix, lowest first."""
    lib = core(32).lib
    bits = {int(getattr(lib, name)): name for name in dir(lib) if name.startswith(prefix)}
    return tuple(bits[bit].removeprefix(prefix).lower() for bit in sorted(bits))


STATES = _names_of_bits("LM_STATE_")
"""Names of the LM_STATE_ bits, lowest first."""

OUTPUTS = ("correction_rad", "velocity_rad_s", "acceleration_rad_s2", "lost_motion_rad")
"""Fields of `lm_correction` that are numbers."""

COLUMNS = {
    quantity.name: quantity.column
    for quantity in QUANTITIES.values()
    if quantity.column in NEEDS and quantity.name != "input_angle"
}
"""Quantities of a recording that are used unchanged as conditions; the input angle is wrapped."""

GAP_STEPS = 1.5
"""A time step of at least this multiple of the usual one has missing ticks."""

PERIOD_SLACK = 0.02
"""A log whose step differs by more than this share from the parameters' period is reported."""


@dataclass
class Tape:
    """Results of the controller in one run.

    Attributes
    ----------
    told : dict
        Inputs of the compensator, from `conditions`.
    values : ndarray
        One row per tick, columns as `OUTPUTS`, float32.
    status : ndarray of uint32
    start_bound_rad, end_bound_rad : float
        Bound on the error of the lost motion from the unknown history before the run.
    """

    run: Run
    told: dict[str, npt.NDArray[np.float32]]
    values: npt.NDArray[np.float32]
    status: npt.NDArray[np.uint32]
    start_bound_rad: float
    end_bound_rad: float

    def words(self) -> bytes:
        """All output bits: the four numbers and the status of each tick, little-endian."""
        words = np.empty((self.status.size, len(OUTPUTS) + 1), dtype="<u4")
        words[:, :-1] = self.values.astype("<f4").view("<u4")
        words[:, -1] = self.status
        return words.tobytes()


@dataclass
class Replay:
    """Results of the controller over a campaign."""

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
            "samples_compared": sum(len(tape.run) for tape in self.tapes),
            "bits_crc32": f"{zlib.crc32(b''.join(tape.words() for tape in self.tapes)):08x}",
            "rms_uncompensated_arcsec": rms_of(before) / ARCSEC,
            "rms_compensated_arcsec": rms_of(after) / ARCSEC,
            "rms_model_arcsec": rms_of(model) / ARCSEC,
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
                    "samples": int(tape.status.size),
                    "not_a_number": missing_numbers(tape.run),
                    "missing_ticks": lost.ticks,
                    "longest_gap_s": lost.longest_s,
                    "unknown_at_start_arcsec": tape.start_bound_rad / ARCSEC,
                    "unknown_at_end_arcsec": tape.end_bound_rad / ARCSEC,
                }
                for tape, lost in zip(
                    self.tapes, missing_ticks([tape.run for tape in self.tapes]), strict=True
                )
            ],
            "notes": self.notes,
        }

    def table(self) -> str:
        """Every tick as CSV, with enough digits to restore the same float32."""
        head = (
            "run",
            "time_s",
            "torque_Nm",
            "correction_rad",
            "correction_velocity_rad_per_s",
            "correction_acceleration_rad_per_s2",
            "model_rad",
            "status",
        )
        rows = []
        for tape in self.tapes:
            torque = tape.told["torque_Nm"]
            time_s = recorded(tape.run)["time"]
            for k, row in enumerate(tape.values):
                numbers = (str(value) for value in (torque[k], *row))
                rows.append((tape.run.label, time_s[k], *numbers, tape.status[k]))
        return csv_text(head, rows)


def errors_of(tape: Tape) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Error of the output without and with the correction, and of the model.

    Over the ticks with measured lost motion. The zero of a recorded lost motion is arbitrary: the
    one that fits the model best is used.
    """
    measured = tape.run.lost_motion_rad
    values = tape.values if tape.run.log is None else tape.values[tape.run.log.kept]
    model = values[:, OUTPUTS.index("lost_motion_rad")].astype(np.float64)
    before = measured - np.mean(measured - model)
    return before, before + values[:, 0], before - model


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
        User effects by name; active ones must be compiled for the controller.

    Returns
    -------
    parameters : cdata
        An owned, checked ``lm_parameters *`` in float32.
    ratio : float or None
        Ratio of the drive; a blob does not contain it.
    columns : dict
        Column map of the drive file.

    Raises
    ------
    InputError
        If the file is neither, or its parameters are refused.
    """
    path = Path(file)
    if path.suffix != ".bin":
        drive = read_drive(path)
        controller = make_controller(drive, settings, profile=profile, own=own)
        for effect in controller.own.values():
            if effect.controller is None:
                found = "a formula" if effect.formula else "a Python function"
                source = "the C file that export writes for it" if effect.formula else "one in C"
                expected = f"a shared object: compile {source} with LM_REAL_BITS=32"
                raise InputError("--effects", effect.name, found, expected)
        return build(controller), drive.ratio, drive.columns
    if settings:
        raise InputError(
            "--set", "", f"the option together with {path.name}", "a drive file: a blob is complete"
        )
    blob = read_bytes(path, "parameters by lostmotion export", core(32).lib.LM_BLOB_BYTES_MAX)
    return load_parameters(blob, str(path), own or {}), None, {}


def load_parameters(
    blob: bytes, file: str = "blob", own: Mapping[str, Effect] | None = None
) -> Any:
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
    try:
        c.call(c.lib.lm_load_parameters, made, blob, len(blob), table, len(effects))
    except LibraryError as error:
        if error.key == "effect":
            found = "one that is not known here"
            expected = "an effect of the library, or your own by --effects FILE"
            raise InputError(file, error.key, found, expected) from None
        raise InputError(
            file, error.key, f"{error.found:.6g}", f"parameters by lostmotion export: {error}"
        ) from None
    return made


def replay(parameters: Any, campaign: Campaign, progress: OnProgress | None = None) -> Replay:
    """Run the compensator over every run of a campaign, from power-up each.

    Parameters
    ----------
    parameters : cdata
        From `read_parameters`.
    campaign : Campaign
    progress : callable, optional
        ``progress(done, of, step)``, see `lostmotion.on_progress`.
    """
    c = core(32)
    result = Replay(parameters, [], notes_on(campaign.runs, float(parameters.limits.period_s)))
    for done, run in enumerate(campaign.runs):
        if progress is not None:
            progress(done, len(campaign.runs), f"run {run.label}")
        result.tapes.append(_run(c, parameters, run))
    if progress is not None:
        progress(len(campaign.runs), len(campaign.runs), "")
    return result


def _run(c: Core, parameters: Any, run: Run) -> Tape:
    columns = conditions(run)
    compensator = c.ffi.new("lm_compensator *")
    ticks = columns["torque_Nm"].size
    first = float(columns["torque_Nm"][0])
    c.call(c.lib.lm_start_compensator, compensator, parameters, first)
    start = float(c.lib.lm_bound_uncertainty(compensator))
    at = c.ffi.new("lm_conditions *")
    for name in NEEDS[:-1]:  # all except the time, which counts as one period
        setattr(at, name, c.lib.LM_UNKNOWN)
    values = np.empty((ticks, len(OUTPUTS)), dtype=np.float32)
    status = np.empty(ticks, dtype=np.uint32)
    named = list(columns.items())
    step, numbers = c.lib.lm_step_compensator, attrgetter(*OUTPUTS)
    for k in range(ticks):
        for name, column in named:
            setattr(at, name, column[k])
        now = step(compensator, at)
        values[k] = numbers(now)
        status[k] = now.status
    return Tape(run, columns, values, status, start, float(c.lib.lm_bound_uncertainty(compensator)))


def recorded(run: Run) -> dict[str, FloatArray]:
    """Return every row of a log, with the turns restored by the reader.

    No other repair is applied, because the controller received the raw log.
    """
    if run.log is None:
        return run.columns
    kept = run.log.kept
    columns = dict(run.log.columns)
    rows = np.arange(columns["torque"].size)
    before = np.maximum(np.searchsorted(kept, rows, side="right") - 1, 0)
    after = np.minimum(np.searchsorted(kept, rows), kept.size - 1)
    for name in ("input_angle", "output_angle"):
        if name in columns:
            raw, mended = columns[name], run.columns[name]
            added = mended - raw[kept]
            # A row that is not in the run has the turns of its neighbours; if these differ, the
            # turns for which its angle is between theirs.
            turns = 2 * np.pi * np.round((np.interp(rows, kept, mended) - raw) / (2 * np.pi))
            columns[name] = raw + np.where(added[before] == added[after], added[before], turns)
            columns[name][kept] = mended
    return columns


def conditions(run: Run) -> dict[str, npt.NDArray[np.float32]]:
    """Return the inputs of the controller in each tick, by the field name in C.

    Velocities and accelerations are backward differences and the input angle is wrapped to one
    turn, as on a controller. The motion before the log is unknown: it is assumed equal to that of
    the first step. The time before the first row, and every unknown time, counts as one period of
    the parameters.
    """
    columns = recorded(run)
    found = {
        field: columns[name].astype(np.float32)
        for name, field in COLUMNS.items()
        if name in columns
    }
    elapsed = np.diff(columns["time"], prepend=columns["time"][0])
    elapsed[~np.isfinite(elapsed)] = 0.0  # unknown
    found["elapsed_s"] = elapsed.astype(np.float32)
    inverse = np.divide(1.0, elapsed, out=np.zeros_like(elapsed), where=elapsed > 0)

    def rate(values: FloatArray) -> FloatArray:
        slope = np.diff(values, prepend=values[0]) * inverse
        slope[:1] = slope[1:2] if slope.size > 1 else 0.0
        return slope

    if "input_angle" in columns:
        angle = columns["input_angle"]
        wrapped = np.remainder(angle + np.pi, 2 * np.pi) - np.pi
        found["input_angle_rad"] = wrapped.astype(np.float32)
        found["input_velocity_rad_s"] = rate(angle).astype(np.float32)
    if "output_angle" in columns:
        acceleration = rate(rate(columns["output_angle"]))
        found["output_acceleration_rad_s2"] = acceleration.astype(np.float32)
    return found


@dataclass(frozen=True)
class MissingTicks:
    """Missing ticks of the clock of a run.

    Attributes
    ----------
    ticks, gaps : int
        Number of missing ticks, and of gaps.
    longest_s : float or None
        Longest step of the clock, if there is a gap.
    at_s : float or None
        Time of the tick before this step.
    standing : int
        Ticks whose time does not advance.
    """

    ticks: int = 0
    gaps: int = 0
    longest_s: float | None = None
    at_s: float | None = None
    standing: int = 0


def usual_step(runs: Sequence[Run]) -> float | None:
    """Median step of the clocks of runs; None if no clock advances."""
    steps = np.concatenate([np.diff(recorded(run)["time"]) for run in runs])
    steps = steps[steps > 0]
    return float(np.median(steps)) if steps.size else None


def missing_ticks(runs: Sequence[Run]) -> list[MissingTicks]:
    """Count the missing ticks of each run relative to a clock with the usual step."""
    usual = usual_step(runs)
    found = []
    for run in runs:
        time_s = recorded(run)["time"]
        time_s = time_s[np.isfinite(time_s)]
        steps = np.diff(time_s)
        standing = int(np.count_nonzero(steps <= 0))
        wide = steps >= GAP_STEPS * usual if usual else np.zeros(steps.size, dtype=bool)
        if usual is None or not wide.any():
            found.append(MissingTicks(standing=standing))
            continue
        place = int(np.argmax(steps))
        ticks = int(np.sum(np.round(steps[wide] / usual) - 1))
        found.append(
            MissingTicks(
                ticks,
                int(np.count_nonzero(wide)),
                float(steps[place]),
                float(time_s[place]),
                standing,
            )
        )
    return found


def missing_numbers(run: Run) -> dict[str, int]:
    """Count the ticks of a run in which an input of the controller is not a number."""
    columns = recorded(run)
    told = {**COLUMNS, "input_angle": "input_angle_rad", "time": "time_s"}
    counts = {
        column: int(np.count_nonzero(~np.isfinite(columns[name])))
        for name, column in told.items()
        if name in columns
    }
    return {column: count for column, count in counts.items() if count}


NOT_A_NUMBER = {
    "torque_Nm": "the compensator keeps the previous torque",
    "time_s": "each counts as one period",
}
"""Action in a tick without the number.

The compensator treats other conditions in the same way.
"""


def notes_on(runs: Sequence[Run], period_s: float) -> list[str]:
    """Describe where a log differs from the clock and sensors of the controller."""
    notes = []
    usual = usual_step(runs)
    if usual is not None and abs(usual - period_s) > PERIOD_SLACK * period_s:
        notes.append(
            f"The log's step is {usual * 1e3:.4g} ms, the parameters are for "
            f"{period_s * 1e3:.4g} ms: velocity and acceleration of the correction are those of "
            "the parameters' period."
        )
    numbers: dict[str, dict[int | str, int]] = {}
    for run in runs:
        for name, count in missing_numbers(run).items():
            numbers.setdefault(name, {})[run.label] = count
    for name, by_run in numbers.items():
        done = NOT_A_NUMBER.get(name, "it counts as unknown (model.h)")
        notes.append(
            f"{name} is not a number in {_ticks(sum(by_run.values()))} ({_runs(by_run)}): {done}."
        )
    lost = dict(zip((run.label for run in runs), missing_ticks(runs), strict=True))
    gaps = {label: one for label, one in lost.items() if one.gaps}
    if gaps:
        label, longest = max(gaps.items(), key=lambda item: item[1].longest_s or 0.0)
        places = sum(one.gaps for one in gaps.values())
        notes.append(
            f"{_ticks(sum(one.ticks for one in gaps.values()))} missing in {places} "
            f"gap{'s' * (places > 1)} of the clock ({_runs(gaps)}; longest {longest.longest_s:.4g} "
            f"s, run {label} at {longest.at_s:.6g} s): the compensator is stepped once across each "
            "gap, with its length as elapsed_s, and does not see the loads in it."
        )
    standing = {label: one.standing for label, one in lost.items() if one.standing}
    if standing:
        notes.append(
            f"The time does not advance in {_ticks(sum(standing.values()))} ({_runs(standing)}): "
            "each counts as one period."
        )
    return notes


def _ticks(count: int) -> str:
    return f"{count} tick{'s' * (count != 1)}"


def _runs(labels: Collection[int | str]) -> str:
    shown = [str(label) for label in labels][:RUNS_LISTED]
    more = ", ..." * (len(labels) > RUNS_LISTED)
    return f"run{'s' * (len(labels) > 1)} {', '.join(shown)}{more}"
