"""Exports of test benches, historians and controllers with their own clocks."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from .clean import Sheet
from .dress import EITHER, REFUSED, dress, save


def _continuous(sheet: Sheet) -> np.ndarray:
    """Seconds from the first sample of the first run, a minute's rest between runs."""
    runs = np.array(sheet.cells("run"))
    times = sheet.values("time_s")
    offset, out = 0.0, np.empty(len(times))
    for label in dict.fromkeys(runs):
        rows = runs == label
        out[rows] = offset + times[rows]
        offset = float(out[rows][-1]) + 60.0
    return out


def _stamped(sheet: Sheet, start: datetime, form: str, cut: int | None = None) -> list[str]:
    at = [start + timedelta(seconds=float(t)) for t in _continuous(sheet)]
    return [moment.strftime(form)[:cut] for moment in at]


@dress("NI DIAdem, a header of tagged lines, channels named with their group")
def _(folder: Path, sheet: Sheet) -> Path:
    top = (
        "DIADEM-HEADER\nROOT;NAME;bench_2\nROOT;AUTHOR;mk\nGROUP;NAME;Messung\n"
        "CHANNELS;7\nDATA-BEGIN\n"
    )
    return save(folder, sheet.text(";", "\r\n", top=top))


@dress("LabVIEW, TDMS written as text: properties, then channels")
def _(folder: Path, sheet: Sheet) -> Path:
    top = (
        "Root Name\tTitle\tAuthor\tDate/Time\nbench\tloop\tmk\t03.02.2026 10:11:12,345\n\n"
        "Group\tChannels\tDescription\nMeasured\t7\t\n\n"
    )
    return save(folder, sheet.text("\t", "\r\n", top=top), "log.txt")


@dress("imc FAMOS, names and units in two rows, decimal commas")
def _(folder: Path, sheet: Sheet) -> Path:
    units = ";".join(["-", "s", "Nm", "rad", "rad", "°C", "-"]) + "\n"
    names = {name: name.rsplit("_", 1)[0] for name in sheet.names if "_" in name}
    text = sheet.renamed(**names).text(";", "\r\n", ",", below_names=units)
    return save(folder, text, encoding="cp1252")


@dress("a controller's log with a column of quality beside every value (OPC)")
def _(folder: Path, sheet: Sheet) -> Path:
    for name in ("torque_Nm", "output_angle_rad"):
        at = sheet.names.index(name) + 1
        sheet = sheet.added(f"{name} Quality", ["Good"] * len(sheet), at)
    return save(folder, sheet.text(";"))


@dress("a controller's log with a column of states in numbers (192 is good)")
def _(folder: Path, sheet: Sheet) -> Path:
    at = sheet.names.index("torque_Nm") + 1
    return save(folder, sheet.added("torque_Nm.Status", ["192"] * len(sheet), at).text())


@dress("German date and time with a decimal comma")
def _(folder: Path, sheet: Sheet) -> Path:
    stamps = _stamped(sheet, datetime(2026, 2, 3, 10, 11, 12), "%d.%m.%Y %H:%M:%S.%f", -2)
    cells = [stamp[:10] + stamp[10:].replace(".", ",") for stamp in stamps]
    return save(folder, sheet.put("time_s", cells, "time").text(";"))


@dress("local time over the end of summer time: an hour comes twice, between two runs")
def _(folder: Path, sheet: Sheet) -> Path:
    start = datetime(2026, 10, 25, 2, 55, 0)
    runs = np.array(sheet.cells("run"))
    back = np.cumsum(np.diff(runs.astype(int), prepend=int(runs[0])) != 0) >= 4
    at = [
        start + timedelta(seconds=float(t) - 3600.0 * bool(b))
        for t, b in zip(_continuous(sheet), back, strict=True)
    ]
    cells = [moment.strftime("%Y-%m-%d %H:%M:%S.%f")[:-2] for moment in at]
    return save(folder, sheet.put("time_s", cells, "time").text())


@dress("seconds since 1970 in one column, milliseconds beside it", "sec=time_s", "ms=time_ms")
def _(folder: Path, sheet: Sheet) -> Path:
    whole = _continuous(sheet) + 1.77e9
    text = sheet.put("time_s", [f"{int(t)}" for t in np.floor(whole)], "sec")
    return save(folder, text.added("ms", [f"{1e3 * (t % 1):.1f}" for t in whole], 2).text())


@dress(
    "newest row first",
    expected=EITHER,
    reason="friction depends on the order: put into that of the clock, or refused",
)
def _(folder: Path, sheet: Sheet) -> Path:
    rows = [",".join(row) for row in sheet.rows()][::-1]
    return save(folder, ",".join(sheet.names) + "\n" + "\n".join(rows) + "\n")


@dress("every row written twice (a bridge that sends twice)")
def _(folder: Path, sheet: Sheet) -> Path:
    rows = [",".join(row) for row in sheet.rows() for _ in range(2)]
    return save(folder, ",".join(sheet.names) + "\n" + "\n".join(rows) + "\n")


@dress(
    "negative numbers in brackets (accounting format of a spreadsheet)",
    expected=EITHER,
    reason="whether brackets are a sign is a guess",
)
def _(folder: Path, sheet: Sheet) -> Path:
    def cell(text: str) -> str:
        return f"({text[1:]})" if text.startswith("-") else text

    return save(folder, sheet.text(";", cell=cell))


@dress("marks of events between the rows, with a time stamp")
def _(folder: Path, sheet: Sheet) -> Path:
    lines = sheet.text().splitlines()
    for at in (900, 500, 333):
        lines.insert(at, f"{lines[at].split(',')[1]},EVENT,operator opened the door")
    return save(folder, "\n".join(lines) + "\n")


@dress("a comment behind some rows")
def _(folder: Path, sheet: Sheet) -> Path:
    lines = sheet.text().splitlines()
    for at in (900, 500, 333):
        lines[at] += " # touched the table"
    return save(folder, "\n".join(lines) + "\n")


@dress("a column of remarks that is mostly empty")
def _(folder: Path, sheet: Sheet) -> Path:
    remarks = [""] * len(sheet)
    remarks[12], remarks[700] = "start, at last", "door; closed"
    cells = [f'"{remark}"' if remark else "" for remark in remarks]
    return save(folder, sheet.added("remark", cells, 0).text())


@dress("nanoseconds since the start, a sample number before them", "t=time_ns")
def _(folder: Path, sheet: Sheet) -> Path:
    sheet = sheet.turned_into("time_s", "t", 1e9, form="%.0f")
    return save(folder, sheet.added("sample", [str(i) for i in range(len(sheet))], 0).text())


@dress("percent of the rated torque", "M=torque_Nm/2.5")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.turned_into("torque_Nm", "M", 2.5).text())


@dress(
    "the unit changes after a restart: N m, then mN m",
    expected=REFUSED,
    reason="two units in one column",
    says=("torque",),
)
def _(folder: Path, sheet: Sheet) -> Path:
    runs = np.array(sheet.cells("run")).astype(int)
    late = sheet.taken(runs > 13).turned_into("torque_Nm", "torque_mNm", 1e3)
    return save(folder, sheet.taken(runs <= 13).text() + late.text())
