"""Logs in which a run, or the form of every line, differs from what the names say."""

from __future__ import annotations

import bz2
import json
import lzma
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from .clean import RATIO, Sheet
from .dress import EITHER, REFUSED, dress, save

ODD = "14"
"""Run that was logged with other settings than the others."""

RAD_PER_GON = np.pi / 200


def _other(sheet: Sheet, name: str, scale: float, offset: float = 0.0) -> Sheet:
    """The sheet with one column of one run in another unit or sign."""
    values = sheet.values(name)
    odd = np.array(sheet.cells("run")) == ODD
    values[odd] = scale * values[odd] + offset
    return sheet.put(name, [f"{value:.11g}" for value in values])


def _magnitudes(cells: tuple[str, ...]) -> list[str]:
    return [cell.removeprefix("-") for cell in cells]


@dress(
    "one run with the torque reversed",
    expected=REFUSED,
    reason="torque or angles of one run have the other sign: the drive would be a negative spring",
    says=("falls", f"run {ODD}"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, _other(sheet, "torque_Nm", -1.0).text())


@dress(
    "one run with the output angle reversed",
    expected=REFUSED,
    reason="as with the torque reversed",
    says=("falls", f"run {ODD}"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, _other(sheet, "output_angle_rad", -1.0).text())


@dress(
    "one run with the torque in mN m",
    expected=REFUSED,
    reason="a thousand times the torque of the other runs, and the same lost motion",
    says=("torque in mNm", "stiffness", f"run {ODD}"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, _other(sheet, "torque_Nm", 1000.0).text())


@dress(
    "one run with the torque in lbf in",
    expected=REFUSED,
    reason="no drive is nine times as stiff in one run, and in lbf in it is as the others",
    says=("torque in lbfin", "stiffness", f"run {ODD}"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, _other(sheet, "torque_Nm", 1 / (0.0254 * 4.4482216152605)).text())


@dress(
    "one run with both angles in degrees",
    expected=REFUSED,
    reason="no drive is a sixtieth as stiff in one run, and in degrees it is as the others",
    says=("angles in deg", "stiffness", f"run {ODD}"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    sheet = _other(sheet, "input_angle_rad", 180 / np.pi)
    return save(folder, _other(sheet, "output_angle_rad", 180 / np.pi).text())


TURNING = "19"
"""Run that turns by about one turn of the output."""


def _second_joint(sheet: Sheet) -> Sheet:
    """The turning run of a joint of half the ratio, at another angle."""
    turning = sheet.taken(np.array(sheet.cells("run")) == TURNING)
    half = turning.turned_into("input_angle_rad", "input_angle_rad", 0.5)
    half = half.turned_into("torque_Nm", "torque_Nm", 0.7)
    return half.turned_into("output_angle_rad", "output_angle_rad", 1.0, 1.5)


@dress(
    "two joints, each a run",
    expected=REFUSED,
    reason="no drive has two ratios",
    says=("50", "100", "both angles of one drive", "a file for each"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    other = _second_joint(sheet).put("run", ["20"] * sheet.cells("run").count(TURNING))
    return save(folder, sheet.text() + other.text().partition("\n")[2])


@dress(
    "two joints, row by row, their names in an unused column",
    expected=REFUSED,
    reason="the output leaves the input by more than a drive winds up",
    says=("wind-up", "--map COLUMN=run"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    one = sheet.taken(np.array(sheet.cells("run")) == TURNING)
    both = zip(one.rows(), _second_joint(sheet).rows(), strict=True)
    rows = [[name, *row[1:]] for pair in both for name, row in zip("AB", pair, strict=True)]
    return save(folder, Sheet(("joint", *sheet.names[1:]), tuple(zip(*rows, strict=True))).text())


@dress("a file of the motor's encoder and one of the output's")
def _(folder: Path, sheet: Sheet) -> list[Path]:
    motor = save(folder, sheet.without("output_angle_rad").text(), "motor.csv")
    output = sheet.without("input_angle_rad", "torque_Nm")
    return [motor, save(folder, output.text(), "output.csv")]


@dress(
    "torque as a magnitude",
    expected=REFUSED,
    reason="the direction of the load is not in the file",
    says=("torque_Nm", "without sign"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.put("torque_Nm", _magnitudes(sheet.cells("torque_Nm"))).text())


@dress(
    "lost motion as a magnitude",
    expected=REFUSED,
    reason="the direction of the lost motion is not in the file",
    says=("lost_motion_rad", "without sign"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    lost = sheet.values("output_angle_rad") - sheet.values("input_angle_rad") / RATIO
    runs = np.array(sheet.cells("run"))
    for run in np.unique(runs):
        torque = sheet.values("torque_Nm")[runs == run]
        lost[runs == run] -= lost[runs == run][np.argmin(np.abs(torque))]
    bare = sheet.without("input_angle_rad", "output_angle_rad")
    return save(folder, bare.added("lost_motion_rad", [f"{abs(x):.9f}" for x in lost]).text())


def _dropped(sheet: Sheet, again: bool) -> str:
    """The sheet with one column fewer from a run on, as after a restart with other settings."""
    lines = sheet.text().splitlines()
    at = sheet.cells("run").index(ODD) + 1
    fewer = sheet.without("cycles").text().splitlines()
    return "\n".join([*lines[:at], *fewer[:again], *fewer[at:]]) + "\n"


@dress(
    "a column fewer after a restart, the names again",
    expected=REFUSED,
    reason="the rows below have another meaning",
    says=("6 columns of numbers from line 603", "split"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, _dropped(sheet, again=True))


@dress(
    "a column fewer after a restart, no names",
    expected=REFUSED,
    reason="it is not in the file which column is missing",
    says=("6 columns of numbers from line 602", "split"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, _dropped(sheet, again=False))


@dress(
    "the lost motion under the name of the output angle",
    expected=REFUSED,
    reason="the output does not turn with the input",
    says=("output_angle_rad", "run 19", "lost_motion_rad"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    lost = sheet.values("output_angle_rad") - sheet.values("input_angle_rad") / RATIO
    return save(folder, sheet.put("output_angle_rad", [f"{x:.8f}" for x in lost]).text())


@dress("zeros of all channels before the field bus is connected")
def _(folder: Path, sheet: Sheet) -> Path:
    lines = sheet.text().splitlines()
    at = sheet.cells("run").index(ODD) + 1
    zeros = [f"{ODD},{0.5 * i - 60:.1f},0,0,0,0,0" for i in range(100)]
    return save(folder, "\n".join([*lines[:at], *zeros, *lines[at:]]) + "\n")


@dress(
    "one run with the temperature in kelvin",
    expected=REFUSED,
    reason="no drive has 300 degrees Celsius",
    says=("temperature_K", f"run {ODD}"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, _other(sheet, "temperature_C", 1.0, 273.15).text())


@dress("rows sorted by the torque")
def _(folder: Path, sheet: Sheet) -> Path:
    rows = sorted(sheet.rows(), key=lambda row: float(row[sheet.names.index("torque_Nm")]))
    return save(folder, Sheet(sheet.names, tuple(zip(*rows, strict=True))).text())


@dress("rows in no order, as a database returns them")
def _(folder: Path, sheet: Sheet) -> Path:
    order = np.random.default_rng(5).permutation(len(sheet))
    every = sheet.rows()
    rows = [every[i] for i in order]
    return save(folder, Sheet(sheet.names, tuple(zip(*rows, strict=True))).text())


@dress("JSON lines, blanks after colon and comma, as Python writes them")
def _(folder: Path, sheet: Sheet) -> Path:
    rows = [dict(zip(sheet.names, map(float, row), strict=True)) for row in sheet.rows()]
    return save(folder, "".join(json.dumps(row) + "\n" for row in rows), "log.jsonl")


@dress("names over two lines in quotes, as spreadsheets wrap them")
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.renamed(
        time_s='"Time\n[s]"',
        torque_Nm='"Torque\n[Nm]"',
        input_angle_rad='"Input angle\n[rad]"',
        output_angle_rad='"Output angle\n[rad]"',
        temperature_C='"Temperature\n[°C]"',
    )
    return save(folder, named.text(end="\r\n"))


@dress("input angle in gon")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(
        folder, sheet.turned_into("input_angle_rad", "input_angle_gon", 1 / RAD_PER_GON).text()
    )


@dress("Rockwell trend: date, time and Millitm in three columns")
def _(folder: Path, sheet: Sheet) -> Path:
    start = datetime(2026, 3, 2, 23, 58, 30)
    clock = [start + timedelta(seconds=float(t)) for t in sheet.values("time_s")]
    rows = sheet.without("time_s")
    for name, form in (("Millitm", ""), ("Time", "%H:%M:%S"), ("Date", "%m/%d/%Y")):
        cells = [f"{c:{form}}" if form else str(c.microsecond // 1000) for c in clock]
        rows = rows.added(name, cells, 0)
    return save(folder, rows.text(top='"Controller Name:","PLC 4"\n"Trend Name:","joint"\n'))


@dress(
    "bzip2",
    expected=REFUSED,
    reason="an archive that is not read",
    says=("bzip2", "unpacked"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    file = folder / "log.csv.bz2"
    file.write_bytes(bz2.compress(sheet.text().encode()))
    return file


@dress("xz", expected=REFUSED, reason="an archive that is not read", says=("xz", "unpacked"))
def _(folder: Path, sheet: Sheet) -> Path:
    file = folder / "log.csv.xz"
    file.write_bytes(lzma.compress(sheet.text().encode()))
    return file


@dress(
    "doubles of a logger without names",
    expected=REFUSED,
    reason="binary numbers without any description",
    says=("binary",),
)
def _(folder: Path, sheet: Sheet) -> Path:
    file = folder / "log.dat"
    file.write_bytes(np.array(sheet.rows(), dtype=float).tobytes())
    return file


@dress(
    "torque in percent, no map",
    expected=REFUSED,
    reason="the torque that is 100 percent is not in the file",
    says=("torque_%=torque_Nm/NUMBER",),
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.turned_into("torque_Nm", "torque_%", 1 / 0.67).text())


@dress("no column of runs, a clock that restarts with every run")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.without("run").text())


@dress("an index of dates without a name (pandas)")
def _(folder: Path, sheet: Sheet) -> Path:
    begin = datetime(2026, 3, 2, 9, 13, 22)
    cells = [str(begin + timedelta(seconds=float(t))) for t in sheet.values("time_s")]
    return save(folder, sheet.put("time_s", cells, "").text())


@dress("temperature at every tenth row, empty cells between")
def _(folder: Path, sheet: Sheet) -> Path:
    cells = [cell if i % 10 == 0 else "" for i, cell in enumerate(sheet.cells("temperature_C"))]
    return save(folder, sheet.put("temperature_C", cells).text())


def channel_a_row(sheet: Sheet, late_s: float = 0.0) -> str:
    """A row for every channel, with empty cells for the others; each later than the one before."""
    lines = [",".join(sheet.names)]
    for row in sheet.rows():
        cell = dict(zip(sheet.names, row, strict=True))
        for late, own in enumerate(sheet.names[2:]):
            one = {name: cell[name] if name in ("run", own) else "" for name in sheet.names}
            one["time_s"] = f"{float(cell['time_s']) + late * late_s:.4f}"
            lines.append(",".join(one.values()))
    return "\n".join(lines) + "\n"


@dress("a row for every channel, with the same times (an outer join of data frames)")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, channel_a_row(sheet))


@dress(
    "a lost motion of the other sign beside both angles",
    expected=EITHER,
    reason="the recorded one is used: refused with the sign to turn, where there is a drive",
    says=("lost_motion",),
)
def _(folder: Path, sheet: Sheet) -> Path:
    lost = sheet.values("input_angle_rad") / RATIO - sheet.values("output_angle_rad")
    return save(folder, sheet.added("lost_motion_rad", [f"{x:.9f}" for x in lost]).text())
