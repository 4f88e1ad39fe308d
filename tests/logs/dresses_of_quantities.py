"""Units, signs, encoders, clocks and runs: the same motion in other numbers."""

from __future__ import annotations

import math
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np

from .clean import RATIO, Array, Sheet
from .dress import EITHER, REFUSED, dress, save

TURN = 2 * math.pi
INCH_M, POUND_N, OUNCE_N, GRAVITY = 0.0254, 4.4482216152605, 0.27801385095378, 9.80665
"""International inch, avoirdupois pound and ounce of force, standard gravity."""
START = datetime(2026, 3, 2, 9, 13, 22, tzinfo=timezone.utc)
BETWEEN_RUNS_S = 600.0
"""A stamp of the day continues from run to run."""


# --- units ---------------------------------------------------------------------------------------

TORQUES = {
    "torque_N.m": 1.0,
    "torque_N-m": 1.0,
    "Torque [N·m]": 1.0,
    "Torque (N m)": 1.0,
    "torque_mNm": 1e3,
    "Torque [N*cm]": 1e2,
    "Torque (in-lb)": 1 / (INCH_M * POUND_N),
    "Torque [lbf·in]": 1 / (INCH_M * POUND_N),
    "Torque (ft-lb)": 1 / (12 * INCH_M * POUND_N),
    "Torque (oz-in)": 1 / (INCH_M * OUNCE_N),
    "Torque (kgf·cm)": 100 / GRAVITY,
}
ANGLES = {
    "deg": 180 / math.pi,
    "°": 180 / math.pi,
    "degrees": 180 / math.pi,
    "mdeg": 180e3 / math.pi,
    "arcmin": 10_800 / math.pi,
    "arcsec": 648_000 / math.pi,
    "mrad": 1e3,
    "µrad": 1e6,
    "rev": 1 / TURN,
    "turns": 1 / TURN,
}


def _torque_in(name: str, scale: float) -> None:
    @dress(f"torque as '{name}'")
    def _(folder: Path, sheet: Sheet) -> Path:
        return save(folder, sheet.turned_into("torque_Nm", name, scale).text(";"))


def _angles_in(unit: str, scale: float) -> None:
    @dress(f"both angles in '{unit}'")
    def _(folder: Path, sheet: Sheet) -> Path:
        for side in ("input", "output"):
            name = f"{side}_angle_rad"
            sheet = sheet.turned_into(name, f"{side.title()} angle [{unit}]", scale, form="%.13g")
        return save(folder, sheet.text())


for _name, _scale in TORQUES.items():
    _torque_in(_name, _scale)
for _unit, _scale in ANGLES.items():
    _angles_in(_unit, _scale)


@dress("every column in a unit of its own")
def _(folder: Path, sheet: Sheet) -> Path:
    sheet = sheet.turned_into("time_s", "time_ms", 1e3)
    sheet = sheet.turned_into("torque_Nm", "torque_kgfm", 1 / GRAVITY)
    sheet = sheet.turned_into("input_angle_rad", "input_angle_rev", 1 / TURN, form="%.13g")
    sheet = sheet.turned_into("output_angle_rad", "output_angle_arcmin", 10_800 / math.pi)
    return save(folder, sheet.turned_into("temperature_C", "temperature_F", 1.8, 32.0).text())


@dress("temperature in kelvin, time in minutes")
def _(folder: Path, sheet: Sheet) -> Path:
    sheet = sheet.turned_into("temperature_C", "temperature_K", 1.0, 273.15)
    return save(folder, sheet.turned_into("time_s", "time_min", 1 / 60, form="%.12g").text())


@dress(
    "counts of both encoders", "ENC_IN=input_angle_rev/65536", "ENC_OUT=output_angle_rev/16777216"
)
def _(folder: Path, sheet: Sheet) -> Path:
    sheet = sheet.turned_into("input_angle_rad", "ENC_IN", 65_536 / TURN, form="%.0f")
    return save(
        folder, sheet.turned_into("output_angle_rad", "ENC_OUT", 2**24 / TURN, form="%.0f").text()
    )


@dress("torque as volts of an amplifier", "U=torque_Nm/0.125")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.turned_into("torque_Nm", "U", 0.125, form="%.9f").text())


@dress("the lost motion in place of the angles, in arcmin")
def _(folder: Path, sheet: Sheet) -> Path:
    lost = sheet.values("output_angle_rad") - sheet.values("input_angle_rad") / RATIO
    cells = [f"{10_800 / math.pi * value:.6f}" for value in lost]
    sheet = sheet.put("output_angle_rad", cells, "lost_motion_arcmin")
    return save(folder, sheet.text())


# --- signs and zeros -----------------------------------------------------------------------------


@dress("the torque counted the other way", "T=-torque_Nm")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.turned_into("torque_Nm", "T", -1.0).text())


@dress("both angles counted the other way", "IN=-input_angle_rad", "OUT=-output_angle_deg")
def _(folder: Path, sheet: Sheet) -> Path:
    sheet = sheet.turned_into("input_angle_rad", "IN", -1.0, form="%.12g")
    return save(
        folder, sheet.turned_into("output_angle_rad", "OUT", -180 / math.pi, form="%.12g").text()
    )


@dress("absolute encoders with zeros anywhere")
def _(folder: Path, sheet: Sheet) -> Path:
    sheet = sheet.turned_into("output_angle_rad", "output_angle_rad", 1.0, 2.5, "%.9f")
    return save(
        folder, sheet.turned_into("input_angle_rad", "input_angle_rad", 1.0, 3.1e3, "%.7f").text()
    )


@dress(
    "the torque of the wrong sign, nothing said",
    expected=EITHER,
    reason="the lost motion falls with the torque: refused with the map that turns it, or turned",
    says=("torque",),
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.turned_into("torque_Nm", "torque_Nm", -1.0).text())


@dress(
    "input and output angle under each other's name",
    expected=EITHER,
    reason="output - input/ratio moves by turns: refused with the maps that swap them",
    says=("input_angle",),
)
def _(folder: Path, sheet: Sheet) -> Path:
    swapped = sheet.renamed(input_angle_rad="output_angle_rad", output_angle_rad="input_angle_rad")
    return save(folder, swapped.text())


@dress(
    "degrees under the name of radians",
    expected=EITHER,
    reason="the stiffness is a sixtieth of the sheet's: refused with the unit that fits",
)
def _(folder: Path, sheet: Sheet) -> Path:
    for name in ("input_angle_rad", "output_angle_rad"):
        sheet = sheet.turned_into(name, name, 180 / math.pi, form="%.12g")
    return save(folder, sheet.text())


@dress(
    "the torque of the whole file in kgf cm, under the name of N m",
    expected=EITHER,
    reason="ten times the rated torque: refused with the unit that fits, where there is a drive",
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(
        folder, sheet.turned_into("torque_Nm", "torque_Nm", TORQUES["Torque (kgf·cm)"]).text()
    )


# --- encoders that wrap --------------------------------------------------------------------------


def _wrapped(values: Array, turn: float, low: float = 0.0) -> Array:
    return low + np.mod(values - low, turn)


@dress("a single-turn encoder at the input, 0 to 2 pi")
def _(folder: Path, sheet: Sheet) -> Path:
    values = _wrapped(sheet.values("input_angle_rad"), TURN)
    return save(folder, sheet.put("input_angle_rad", [f"{v:.7f}" for v in values]).text())


@dress("single-turn encoders at both ends, -180 to 180 degrees, zeros anywhere")
def _(folder: Path, sheet: Sheet) -> Path:
    for name, zero in (("input_angle_rad", 100.0), ("output_angle_rad", 3.1)):
        values = np.degrees(_wrapped(sheet.values(name) + zero, TURN, -math.pi))
        sheet = sheet.put(name, [f"{v:.8f}" for v in values], name.replace("rad", "deg"))
    return save(folder, sheet.text())


@dress("counts of a single-turn encoder, 0 to 131071", "ENC=input_angle_rev/131072")
def _(folder: Path, sheet: Sheet) -> Path:
    counts = np.round(sheet.values("input_angle_rad") / TURN * 131_072) % 131_072
    return save(folder, sheet.put("input_angle_rad", [f"{c:.0f}" for c in counts], "ENC").text())


@dress("a counter of 16 bits with sign, 36000 counts a turn", "ENC=input_angle_rev/36000")
def _(folder: Path, sheet: Sheet) -> Path:
    counts = np.round(sheet.values("input_angle_rad") / TURN * 36_000)
    counts = _wrapped(counts, 65_536.0, -32_768.0)
    return save(folder, sheet.put("input_angle_rad", [f"{c:.0f}" for c in counts], "ENC").text())


@dress("a counter of 24 bits without sign, 2^20 counts a turn", "ENC=input_angle_rev/1048576")
def _(folder: Path, sheet: Sheet) -> Path:
    counts = np.round(sheet.values("input_angle_rad") / TURN * 2**20 + 16_700_000) % 2**24
    return save(folder, sheet.put("input_angle_rad", [f"{c:.0f}" for c in counts], "ENC").text())


@dress("a counter of 32 bits that overflows", "ENC=input_angle_rev/4194304")
def _(folder: Path, sheet: Sheet) -> Path:
    counts = np.round(sheet.values("input_angle_rad") / TURN * 2**22 + 2**31 - 1_000_000)
    counts = _wrapped(counts, 2.0**32, -(2.0**31))
    return save(folder, sheet.put("input_angle_rad", [f"{c:.0f}" for c in counts], "ENC").text())


# --- clocks --------------------------------------------------------------------------------------


def _seconds(sheet: Sheet) -> Array:
    """Seconds from the start of the campaign: the runs one after the other."""
    runs = np.array(sheet.cells("run"))
    order = {label: i for i, label in enumerate(dict.fromkeys(runs))}
    begin = np.array([BETWEEN_RUNS_S * order[label] for label in runs])
    return np.round(begin + sheet.values("time_s"), 4)


def _moments(sheet: Sheet) -> list[datetime]:
    return [START + timedelta(seconds=float(t)) for t in _seconds(sheet)]


for _unit, _per_s in {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}.items():

    def _epoch(unit: str, per_s: int) -> None:
        @dress(f"epoch in {unit}")
        def _(folder: Path, sheet: Sheet) -> Path:
            start = int(START.timestamp()) * 10_000
            ticks = [start + round(1e4 * t) for t in _seconds(sheet)]
            cells = (
                [f"{tick / 1e4:.4f}" for tick in ticks]
                if per_s == 1
                else [str(tick * per_s // 10_000) for tick in ticks]
            )
            return save(folder, sheet.put("time_s", cells, f"time_{unit}").text())

    _epoch(_unit, _per_s)


def _stamps(name: str, form: str, column: str = "Time", *maps: str) -> None:
    @dress(name, *maps)
    def _(folder: Path, sheet: Sheet) -> Path:
        cells = [moment.strftime(form)[: -3 or None] for moment in _moments(sheet)]
        return save(folder, sheet.put("time_s", cells, column).text(";"))


_stamps("ISO dates with T", "%Y-%m-%dT%H:%M:%S.%f")
_stamps("ISO dates with a blank", "%Y-%m-%d %H:%M:%S.%f", "time")
_stamps("dates with slashes", "%Y/%m/%d %H:%M:%S.%f", "Timestamp", "Timestamp=time")
_stamps("German dates", "%d.%m.%Y %H:%M:%S.%f", "Zeitstempel", "Zeitstempel=time")
_stamps("hours, minutes, seconds", "%H:%M:%S.%f")


@dress("ISO dates with a zone")
def _(folder: Path, sheet: Sheet) -> Path:
    cells = [m.strftime("%Y-%m-%dT%H:%M:%S.%f") + "+01:00" for m in _moments(sheet)]
    return save(folder, sheet.put("time_s", cells, "Time").text())


@dress("ISO dates with Z, nine digits behind the second", "stamp=time")
def _(folder: Path, sheet: Sheet) -> Path:
    cells = [m.strftime("%Y-%m-%dT%H:%M:%S.%f") + "000Z" for m in _moments(sheet)]
    return save(folder, sheet.put("time_s", cells, "stamp").text())


@dress("American dates with AM and PM")
def _(folder: Path, sheet: Sheet) -> Path:
    cells = [m.strftime("%m/%d/%Y %I:%M:%S.%f %p") for m in _moments(sheet)]
    return save(folder, sheet.put("time_s", cells, "Time").text())


@dress("hours:minutes:seconds with a decimal comma")
def _(folder: Path, sheet: Sheet) -> Path:
    cells = [m.strftime("%H:%M:%S,%f")[:-3] for m in _moments(sheet)]
    return save(folder, sheet.put("time_s", cells, "Time").text(";", decimal=","))


@dress("minutes:seconds since the start of each run")
def _(folder: Path, sheet: Sheet) -> Path:
    cells = [f"{int(t // 60):02d}:{t % 60:07.4f}" for t in sheet.values("time_s")]
    return save(folder, sheet.put("time_s", cells, "Time").text())


@dress("a night: the time of day passes midnight")
def _(folder: Path, sheet: Sheet) -> Path:
    late = timedelta(hours=14, minutes=46, seconds=10)
    cells = [(m + late).strftime("%H:%M:%S.%f") for m in _moments(sheet)]
    return save(folder, sheet.put("time_s", cells, "Time").text())


@dress("days since 1900 (Excel)", "Time=time_d")
def _(folder: Path, sheet: Sheet) -> Path:
    days = 46_083 + (9 * 3600 + 13 * 60 + 22 + _seconds(sheet)) / 86_400
    return save(folder, sheet.put("time_s", [f"{day:.11f}" for day in days], "Time").text(";"))


@dress("date and time of day in two columns", "Time=time")
def _(folder: Path, sheet: Sheet) -> Path:
    moments = _moments(sheet)
    sheet = sheet.put("time_s", [m.strftime("%H:%M:%S.%f") for m in moments], "Time")
    return save(folder, sheet.added("Date", [m.strftime("%Y-%m-%d") for m in moments], 1).text())


@dress(
    "sec and nanosec in two columns (ROS 2)",
    "header.stamp.sec=time_s",
    "header.stamp.nanosec=time_ns",
)
def _(folder: Path, sheet: Sheet) -> Path:
    ticks = [round(1e4 * t) for t in _seconds(sheet)]
    seconds = [str(int(START.timestamp()) + tick // 10_000) for tick in ticks]
    rest = [str(tick % 10_000 * 100_000) for tick in ticks]
    sheet = sheet.put("time_s", seconds, "header.stamp.sec")
    return save(folder, sheet.added("header.stamp.nanosec", rest, 2).text())


# --- runs ----------------------------------------------------------------------------------------


@dress("runs named by text")
def _(folder: Path, sheet: Sheet) -> Path:
    cells = [f"loop {'ABCDEFGHIJ'[int(run) % 10]} no. {run}" for run in sheet.cells("run")]
    return save(folder, sheet.put("run", cells).text())


@dress("runs as 3.0, 6.0")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.put("run", [f"{run}.0" for run in sheet.cells("run")]).text())


@dress("one file a run, in a folder")
def _(folder: Path, sheet: Sheet) -> Path:
    for label, run in sheet.by_run().items():
        save(folder, run.text(), f"run_{label}.csv")
    return folder


@dress("one file a run, each of another program", "Zeit [s]=time_s", "Drehmoment [Nm]=torque_Nm")
def _(folder: Path, sheet: Sheet) -> Path:
    for i, (label, run) in enumerate(sheet.by_run().items()):
        name = f"run_{label}.csv"
        if i % 4 == 0:
            save(folder, run.text(), name)
        elif i % 4 == 1:
            german = run.renamed(time_s="Zeit [s]", torque_Nm="Drehmoment [Nm]")
            save(folder, german.text(";", "\r\n", ",", top="Bank 2\n\n"), name, "cp1252")
        elif i % 4 == 2:
            save(folder, run.text("\t"), name, "utf-16")
        else:
            milli = run.turned_into("torque_Nm", "Torque [mNm]", 1e3)
            save(folder, milli.text(", ", top="# bench 2\n"), name)
    return folder


@dress("the names again before every run (a logger that starts anew)")
def _(folder: Path, sheet: Sheet) -> Path:
    runs = np.array(sheet.cells("run"))
    parts = [sheet.taken(runs == label).text() for label in dict.fromkeys(runs)]
    return save(folder, "".join(parts))


@dress(
    "runs separated by blank lines alone",
    expected=EITHER,
    reason="whether a blank line ends a run is a guess: the time goes back there",
)
def _(folder: Path, sheet: Sheet) -> Path:
    parts = [run.text().partition("\n") for run in sheet.by_run().values()]
    return save(folder, parts[0][0] + "\n" + "\n".join(part[2] for part in parts))


@dress(
    "a torque that is the motor's, 1/100 of the output's",
    expected=EITHER,
    reason="the stiffness is 100 times the sheet's: refused with the factor",
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.turned_into("torque_Nm", "torque_Nm", 1 / RATIO).text())


@dress(
    "an encoder of the input that never moves though the output turns",
    expected=REFUSED,
    reason="one of the two encoders is dead",
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.put("input_angle_rad", ["0.0"] * len(sheet)).text())
