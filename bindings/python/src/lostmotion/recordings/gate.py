"""The gate: refuse recordings and drive file that contradict each other before any fit.

It searches for one error that a single correction repairs: a sign, a factor of the ratio, exchanged
angles, a unit, or a torque of the motor shaft. The files are consistent if the angles turn in the
stated ratio, the lost motion rises with the torque, and its size is about that of the drive file.
They are accepted unless one of the three is clearly violated; then every correction that satisfies
all three is printed, ready to paste.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from lostmotion import units
from lostmotion.arrays import FloatArray, IntArray
from lostmotion.catalogue import WIND_UP_MAX_RAD
from lostmotion.errors import InputError
from lostmotion.recordings.campaign import Campaign, Run
from lostmotion.recordings.columns import ColumnName
from lostmotion.recordings.quantities import QUANTITIES
from lostmotion.recordings.ratio import measured_ratio
from lostmotion.recordings.scale import SCALE_DOUBT, SCALE_SHARE
from lostmotion.recordings.soundness import FROZEN_MAX, STUCK_TURN_RAD, dead_encoders

Curve = Callable[[FloatArray], FloatArray]

SIZE_FACTOR = 3.0
"""Largest ratio of a drive's compliance to its data sheet, either way: worn, printed, preloaded."""

UNIT_FACTOR = 30.0
"""An estimated drive file may be wrong by a factor of ten; larger factors indicate a wrong unit."""

LOADS = (0.02, 6.0)
"""Largest torque of a campaign relative to the rated one: a mesh ratchets at about five times."""

RATIO_TOLERANCE = 5e-3
"""Relative error of the measured ratio of two encoders that is accepted, including kinematic
error."""

RATIO_TIMES = 5.0
"""Factor on the lost motion above which the ratio is wrong."""

ANGLES = ("rad", "mrad", "deg", "arcmin", "arcsec", "rev")
TORQUES = ("Nm", "mNm", "Nmm", "Ncm", "kNm", "lbfin", "lbfft", "ozfin", "kgfm", "kgfcm")
STIFFNESSES = ("Nm_per_rad", "Nm_per_deg", "Nm_per_arcmin", "Nmm_per_rad")
"""Units that are often confused."""


@dataclass(frozen=True)
class Interpretation:
    """One interpretation of the files: the correction and its notation.

    Attributes
    ----------
    what, paste : str
    input_by, output_by, torque_by, curve_by : float
        Factors of the columns, and of the lost motion of the drive file.
    swapped : bool
        Whether the angles are exchanged.
    ratio : float
    """

    what: str
    paste: str
    ratio: float
    input_by: float = 1.0
    output_by: float = 1.0
    torque_by: float = 1.0
    curve_by: float = 1.0
    swapped: bool = False

    @property
    def size(self) -> float:
        """Factor on the ratio of measured lost motion to that of the drive file."""
        factor = self.output_by / (self.torque_by * self.curve_by)
        return max(abs(factor), 1 / abs(factor))


@dataclass(frozen=True)
class Consistency:
    """Consistency of an interpretation.

    Attributes
    ----------
    turning : float or None
        Measured ratio divided by the stated one; None if nothing turns.
    times : float
        Lost motion divided by that of the drive file.
    share : float
        Share of the lost motion that its curve explains, negative where it falls with the torque.
    load : float
        Largest torque divided by the rated torque.
    """

    turning: float | None
    times: float
    share: float
    load: float

    @property
    def turns_right(self) -> bool:
        """Whether the angles turn in the ratio, if they turn."""
        return self.turning is None or abs(self.turning - 1) <= RATIO_TOLERANCE

    @property
    def right(self) -> bool:
        """Whether nothing contradicts the interpretation."""
        if not self.turns_right:
            return False
        if abs(self.share) < SCALE_SHARE:
            return True
        sized = 1 / SIZE_FACTOR <= self.times <= SIZE_FACTOR
        return self.share > 0 and sized and LOADS[0] <= self.load <= LOADS[1]


class Gate:
    """A campaign compared with its drive file."""

    def __init__(
        self,
        campaign: Campaign,
        curve_for: Callable[[float], Curve],
        rated_torque_Nm: float,
        ratio: float,
    ) -> None:
        self.campaign = campaign
        self.curve_for = curve_for
        self.rated_torque_Nm = rated_torque_Nm
        self.ratio = ratio
        self.turns = [measured_ratio(run) for run in campaign.runs]
        self.torque_Nm = np.concatenate([run.torque_Nm for run in campaign.runs])

    def consistency(self, reading: Interpretation) -> Consistency:
        """Evaluate the consistency of an interpretation."""
        turns = self.ratio_by(reading)
        turning = None if turns is None else turns / reading.ratio
        torque = reading.torque_by * self.torque_Nm
        largest = float(np.quantile(np.abs(torque), 0.999))
        curve = reading.curve_by * self.curve_for(largest)(np.clip(torque, -largest, largest))
        lost = np.concatenate([self.lost_motion(run, reading) for run in self.campaign.runs])
        starts = self.campaign.starts
        model = curve - np.repeat(means(curve, starts), np.diff(starts))
        measured = lost - np.repeat(means(lost, starts), np.diff(starts))
        both, across, up = (
            float(a @ b) for a, b in ((model, measured), (model,) * 2, (measured,) * 2)
        )
        share = both * abs(both) / (across * up) if across > 0 and up > 0 else 0.0
        times = both / across if across > 0 else 0.0
        return Consistency(turning, times, share, largest / self.rated_torque_Nm)

    def ratio_by(self, reading: Interpretation) -> float | None:
        """Turns of the input for one of the output, from turning runs; None if there are none."""
        found = []
        for turns in self.turns:
            if turns is None:
                continue
            swing_in, swing_out = (
                turns.swing_in * reading.input_by,
                turns.swing_out * reading.output_by,
            )
            slope = turns.slope * reading.input_by / reading.output_by
            if reading.swapped:
                swing_in, swing_out = turns.swing_out, turns.swing_in
                slope = 1 / turns.slope
            if min(swing_in, swing_out) >= STUCK_TURN_RAD:
                found.append(slope)
        return float(np.median(found)) if found else None

    def lost_motion(self, run: Run, reading: Interpretation) -> FloatArray:
        """Lost motion of a run in an interpretation."""
        if (
            "lost_motion" in run.sources
            or not {"input_angle", "output_angle"} <= run.columns.keys()
        ):
            return reading.output_by * run.lost_motion_rad
        put_in, out = run.columns["input_angle"], run.columns["output_angle"]
        if reading.swapped:
            put_in, out = out, put_in
        return reading.output_by * out - reading.input_by * put_in / reading.ratio


def means(values: FloatArray, starts: IntArray) -> FloatArray:
    """Mean of every run."""
    return np.asarray(np.add.reduceat(values, starts[:-1]) / np.diff(starts))


def check_encoders(campaign: Campaign, ratio: float | None) -> None:
    """Refuse runs in which one of two encoders was dead most of the time.

    Not for a ratio of 1: a locked output is at rest while the input winds up.

    Raises
    ------
    InputError
        Names the encoder and the run.
    """
    check_one_drive(campaign)
    for run in campaign.runs:
        locked = len(recorded_angles(run)) < 2
        for quantity, count in ({} if locked else dead_encoders(run.columns, ratio)).items():
            if count <= FROZEN_MAX * len(run):
                continue
            if quantity == "output_angle" and abs(ratio or 1.0) <= 1:
                continue
            other = "input" if quantity == "output_angle" else "output"
            turned = float(np.ptp(run.columns[f"{other}_angle"]))
            raise InputError(
                run.file,
                QUANTITIES[quantity].column,
                f"a constant reading for {count} of {len(run)} rows of run {run.label}, "
                f"in which the {other} angle moves {turned:.3g} rad",
                f"an encoder that works, or angles in their own unit{in_degrees(run)}; or the "
                "recordings without this run",
            )
        if not locked:
            check_both_turn(run, ratio)
        check_wind_up(run, ratio)


def recorded_angles(run: Run) -> list[str]:
    """Angles that were recorded: that of a locked side was not."""
    return [
        name for name in ("input_angle", "output_angle") if name in (run.sources or run.columns)
    ]


ONE_DRIVE = (
    "both angles of one drive; if the file has the rows of several, a file for each, or "
    "--map COLUMN=run with the column of their names"
)
"""What a campaign must contain."""


def in_two_ratios(campaign: Campaign) -> tuple[tuple[Run, float], tuple[Run, float]] | None:
    """Two runs that turn in different ratios, and these; None if all turn in one."""
    turning = [
        (run, turns)
        for run in campaign.runs
        if (turns := measured_ratio(run)) is not None
        and min(turns.swing_in, turns.swing_out) >= STUCK_TURN_RAD
    ]
    if not turning:
        return None
    longest, usual = max(turning, key=lambda one: one[1].swing_out)
    for run, turns in turning:
        if abs(turns.slope / usual.slope - 1) * turns.swing_out > STUCK_TURN_RAD:
            return (run, turns.slope), (longest, usual.slope)
    return None


def in_degrees(run: Run) -> str:
    """Write the map with which the angles of a run are in degrees, if they are stated in rad."""
    angles = recorded_angles(run)
    chosen: dict[str, tuple[str, ColumnName]] = {
        name: run.sources[name] for name in angles if name in run.sources
    }
    if len(chosen) < 2 or any(meaning.unit != units.unit("rad") for _, meaning in chosen.values()):
        return ""
    return f" (degrees: {' '.join(as_map(chosen, name, unit='deg') for name in angles)})"


def check_one_drive(campaign: Campaign) -> None:
    """Refuse runs that turn in different ratios: they are of different drives, or lost turns."""
    found = in_two_ratios(campaign)
    if found is not None:
        (run, ratio), (longest, usual) = found
        raise InputError(
            run.file,
            "input_angle_rad",
            f"{ratio:.4g} input turns for one output turn in run {run.label}, {usual:.4g} in run "
            f"{longest.label}",
            f"{ONE_DRIVE}; or the recordings without a run that lost turns",
        )


def check_wind_up(run: Run, ratio: float | None) -> None:
    """Refuse a run whose lost motion is larger than a drive winds up."""
    if ratio is None and "input_angle" in run.columns and np.ptp(run.columns["input_angle"]) > 0:
        return
    wound = float(np.ptp(run.lost_motion_rad))
    if wound <= WIND_UP_MAX_RAD:
        return
    limit = f"less than {WIND_UP_MAX_RAD:g} rad of wind-up"
    angles = recorded_angles(run)
    if len(angles) == 1:
        side = "input" if angles == ["output_angle"] else "output"
        raise InputError(
            run.file,
            QUANTITIES[angles[0]].column,
            f"{wound:.3g} rad of lost motion in run {run.label}",
            f"{limit}: recordings with the {side} locked, or with both angles",
        )
    if len(angles) == 0:
        raise InputError(
            run.file,
            "lost_motion_rad",
            f"{wound:.3g} rad in run {run.label}",
            f"{limit}: output angle - input angle / ratio, in its unit",
        )
    turns = measured_ratio(run)
    together = "" if turns is None else "the ratio, units and signs in which they turn "
    if turns is not None:
        together += f"together ({turns.slope:.4g} input turns for one output turn); or "
    by = "ratio" if ratio is None else f"{ratio:g}"
    raise InputError(
        run.file,
        "output_angle_rad",
        f"{wound:.3g} rad between output and input / {by} in run {run.label}",
        f"{together}{limit}: {ONE_DRIVE}",
    )


def check_both_turn(run: Run, ratio: float | None) -> None:
    """Refuse a run in which one shaft turns farther than a drive winds up, and the other does not.

    The column of the other is no angle of that shaft, or its encoder is loose.
    """
    if ratio is None or not math.isfinite(ratio) or measured_ratio(run) is not None:
        return
    if not {"input_angle", "output_angle"} <= run.columns.keys():
        return
    turned = {
        "input_angle": float(np.ptp(run.columns["input_angle"] / ratio)),
        "output_angle": float(np.ptp(run.columns["output_angle"])),
    }
    least, most = sorted(turned, key=lambda name: turned[name])
    if turned[least] >= STUCK_TURN_RAD or turned[most] < 2 * STUCK_TURN_RAD:
        return
    by = {"input_angle": abs(ratio), "output_angle": 1.0}
    raise InputError(
        run.file,
        QUANTITIES[least].column,
        f"{turned[least] * by[least]:.3g} rad of motion in run {run.label}, in which the "
        f"{most.replace('_', ' ')} moves {turned[most] * by[most]:.3g} rad",
        "the angle of a shaft that turns with the other; lost_motion_rad if the column is the "
        "difference of both; or the recordings without this run",
    )


def check_gate(
    campaign: Campaign,
    curve_for: Callable[[float], Curve],
    *,
    drive_file: str,
    ratio: float,
    rated_torque_Nm: float,
    catalogue: Mapping[str, object],
) -> None:
    """Refuse recordings that contradict the drive file or each other, with possible corrections.

    Parameters
    ----------
    campaign : Campaign
    curve_for : callable
        Returns, for a largest torque in N m, a function from torques to lost motion in rad.
    drive_file : str
        Its name.
    ratio, rated_torque_Nm : float
        Values of the drive file.
    catalogue : mapping
        Keys and values of the drive file whose stiffnesses may have a wrong unit.

    Raises
    ------
    InputError
        Names the contradiction and every correction that resolves it.
    """
    refuse_contradiction(Gate(campaign, curve_for, rated_torque_Nm, ratio), drive_file, catalogue)
    check_encoders(campaign, ratio)


def refuse_contradiction(gate: Gate, drive_file: str, catalogue: Mapping[str, object]) -> None:
    """Refuse recordings that contradict the drive file if a single correction resolves it."""
    campaign, ratio = gate.campaign, gate.ratio
    stated = Interpretation("", "", ratio)
    stands = gate.consistency(stated)
    found = contradiction(gate, stands)
    if found is None:
        return
    column, text, decisive = found
    run = campaign.runs[0]
    chosen = run.sources or si_columns(run)
    judged = [(r, gate.consistency(r)) for r in readings(gate, drive_file, chosen, catalogue)]
    judged = [(reading, how) for reading, how in judged if how.right]
    # If the drive turns in its ratio in one interpretation, another in which it is at rest is a
    # coincidence. So is one without a torsion curve if another has one, or two drives may be mixed.
    turning = any(how.turning is not None for _, how in judged)
    curved = not decisive or in_two_ratios(campaign) is not None
    curved = curved or any(how.share >= SCALE_SHARE for _, how in judged)
    fitting = [
        reading
        for reading, how in judged
        if (how.turning is not None or not turning) and (how.share >= SCALE_SHARE or not curved)
    ]
    if not decisive:
        surely = not LOADS[0] <= stands.load <= LOADS[1]
        fitting = [r for r in fitting if r.size >= UNIT_FACTOR or (surely and r.torque_by != 1.0)]
        if not fitting:
            return
    if stands.turns_right or any(abs(r.ratio - ratio) == 0 for r in fitting):
        # A different ratio would fit any angles: it is suggested only if nothing else fits.
        fitting = [r for r in fitting if r.ratio in (ratio, -ratio)] or fitting
    if not fitting:
        return
    expected = "; or, ".join(f"{reading.what}: {reading.paste}" for reading in fitting)
    raise InputError(run.file, column, text, expected)


def si_columns(run: Run) -> dict[str, tuple[str, ColumnName]]:
    """Columns of a run with the names of a file in SI units."""
    named = [QUANTITIES[name] for name in run.columns]
    return {q.name: (q.column, ColumnName(q, units.parse_unit(q.unit))) for q in named}


def contradiction(gate: Gate, stands: Consistency) -> tuple[str, str, bool] | None:
    """Describe the contradiction: column, found, and whether it is decisive."""
    if not stands.turns_right and stands.turning is not None:
        curve = gate.curve_for(gate.campaign.largest_torque_Nm)(gate.torque_Nm)
        out = max(
            float(np.ptp(run.columns.get("output_angle", np.zeros(1))))
            for run in gate.campaign.runs
        )
        if abs(stands.turning - 1) * out > RATIO_TIMES * float(np.ptp(curve)):
            turns = (
                f"{stands.turning * gate.ratio:.6g} input turns for one output turn by the angles"
            )
            return "input_angle_rad", f"{turns}, {gate.ratio:.6g} by the drive file", True
        return None
    if stands.share <= -SCALE_SHARE:
        return "lost_motion_rad", "a lost motion that falls with increasing torque", True
    sized = 1 / SCALE_DOUBT < stands.times < SCALE_DOUBT and stands.load <= LOADS[1]
    if stands.share >= SCALE_SHARE and not sized:
        text = (
            f"a lost motion {stands.times:.3g} times the model's, at torques up to "
            f"{stands.load:.3g} times the rated one"
        )
        return "lost_motion_rad", text, False
    return None


def readings(
    gate: Gate,
    drive_file: str,
    chosen: Mapping[str, tuple[str, ColumnName]],
    catalogue: Mapping[str, object],
) -> Iterator[Interpretation]:
    """List the possible corrections of one error."""
    stated = Interpretation("", "", gate.ratio)
    recorded = any("lost_motion" in run.sources for run in gate.campaign.runs)
    if {"input_angle", "output_angle"} <= chosen.keys() and not recorded:
        yield replace(
            stated,
            what="the sign of the ratio",
            paste=f"ratio = {-gate.ratio:.6g} in {drive_file}",
            ratio=-gate.ratio,
        )
        yield replace(
            stated,
            what="input and output angle are exchanged",
            paste=" ".join(
                as_map(chosen, one, to=other)
                for one, other in (("input_angle", "output_angle"), ("output_angle", "input_angle"))
            ),
            swapped=True,
        )
        for names in (("input_angle",), ("output_angle",), ("input_angle", "output_angle")):
            for unit, by in other_units(chosen, names, ANGLES):
                yield replace(
                    stated,
                    what=f"the angles are in {unit}",
                    paste=" ".join(as_map(chosen, name, unit=unit) for name in names),
                    input_by=by if "input_angle" in names else 1.0,
                    output_by=by if "output_angle" in names else 1.0,
                )
    else:
        angle = "lost_motion" if "lost_motion" in chosen else "output_angle"
        for unit, by in other_units(chosen, (angle,), ANGLES):
            paste = as_map(chosen, angle, unit=unit)
            yield replace(stated, what=f"the angle is in {unit}", paste=paste, curve_by=1 / by)
        if recorded:
            paste = as_map(chosen, angle, by=-1.0)
            yield replace(stated, what="the sign of the lost motion", paste=paste, curve_by=-1.0)
    turns = gate.ratio_by(stated)
    if turns is not None and abs(turns) >= 1 and in_two_ratios(gate.campaign) is None:
        ratio = whole_ratio(turns)
        paste = f"ratio = {ratio:.7g} in {drive_file}"
        yield replace(stated, what="another ratio", paste=paste, ratio=ratio)
    if "torque" in chosen:
        paste = as_map(chosen, "torque", by=-1.0)
        yield replace(stated, what="the sign of the torque", paste=paste, torque_by=-1.0)
        for unit, by in other_units(chosen, ("torque",), TORQUES):
            paste = as_map(chosen, "torque", unit=unit)
            yield replace(stated, what=f"the torque is in {unit}", paste=paste, torque_by=by)
        for by in (gate.ratio, -gate.ratio):
            paste = as_map(chosen, "torque", by=by)
            yield replace(stated, what="the torque is the motor's", paste=paste, torque_by=by)
    rated = gate.rated_torque_Nm
    wound = float(gate.curve_for(rated)(np.array([rated]))[0])
    for unit, by in stiffness_units(catalogue):
        if wound * by > WIND_UP_MAX_RAD:
            continue
        keys = ", ".join(
            f"{key.split('_')[0]}_{unit} = {value:.6g}"
            for key, value in catalogue.items()
            if isinstance(value, (int, float)) and stiffness_unit(key) is not None
        )
        paste = f"{keys} in [catalogue] of {drive_file}"
        yield replace(stated, what=f"the stiffness is in {unit}", paste=paste, curve_by=by)


def whole_ratio(ratio: float) -> float:
    """Integer ratio within the accuracy of the angles, else as measured."""
    whole = round(ratio)
    return float(whole) if abs(ratio / whole - 1) <= 0.2 * RATIO_TOLERANCE else ratio


def as_map(
    chosen: Mapping[str, tuple[str, ColumnName]],
    name: str,
    *,
    to: str | None = None,
    unit: str | None = None,
    by: float = 1.0,
) -> str:
    """Write the map option that corrects a column."""
    column, meaning = chosen[name]
    symbol = unit or (meaning.unit.symbol if meaning.unit else meaning.quantity.unit)
    factor = meaning.factor * by
    sign = "-" if factor < 0 else ""
    divided = "" if abs(factor) == 1.0 else f"/{1 / abs(factor):.10g}"
    option = f"--map {column}={sign}{to or name}_{symbol}{divided}"
    return option if " " not in column else f"--map '{option.removeprefix('--map ')}'"


def other_units(
    chosen: Mapping[str, tuple[str, ColumnName]], names: tuple[str, ...], symbols: tuple[str, ...]
) -> Iterator[tuple[str, float]]:
    """Yield the units that columns of one unit may have instead, with the factor."""
    read = [unit for name in names if (unit := chosen[name][1].unit) is not None]
    if len({unit.symbol for unit in read}) != 1:
        return
    for symbol in symbols:
        by = units.unit(symbol).scale / read[0].scale
        if not math.isclose(by, 1.0):
            yield symbol, by


def stiffness_unit(key: str) -> units.Unit | None:
    """Unit of a catalogue key that is a torsional stiffness; None for other keys."""
    _, unit = units.split_unit(key)
    return unit if unit is not None and unit.dimension == units.TORSIONAL_STIFFNESS else None


def stiffness_units(catalogue: Mapping[str, object]) -> Iterator[tuple[str, float]]:
    """Yield possible units of data sheet stiffnesses, with the factor of the lost motion."""
    written = [unit for key in catalogue if (unit := stiffness_unit(key)) is not None]
    if len({unit.symbol for unit in written}) != 1:
        return
    for symbol in STIFFNESSES:
        by = written[0].scale / units.unit(symbol).scale
        if not math.isclose(by, 1.0):
            yield symbol, by
