"""Logs of motor controllers, robots and data loggers, as their own programs write them."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from .clean import Sheet
from .dress import REFUSED, dress, quoted, save

START = datetime(2026, 3, 2, 9, 13, 22)


def _clock(sheet: Sheet) -> list[datetime]:
    """Time of every sample; every run begins two minutes after the start of the one before."""
    runs = np.array(sheet.cells("run"))
    number = np.cumsum(runs != np.roll(runs, 1)) - (runs[0] != runs[-1])
    return [
        START + timedelta(seconds=float(t) + 120.0 * int(k))
        for t, k in zip(sheet.values("time_s"), number, strict=True)
    ]


@dress(
    "Universal Robots RTDE recorder, blanks, joints numbered",
    "timestamp=time_s",
    "actual_ext_torque_2=torque_Nm",
    "actual_q_2=output_angle_rad",
    "motor_q_2=input_angle_rad",
    "joint_temperatures_2=temperature_C",
)
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.renamed(
        time_s="timestamp", torque_Nm="actual_ext_torque_2", output_angle_rad="actual_q_2",
        input_angle_rad="motor_q_2",
        temperature_C="joint_temperatures_2",
    )  # fmt: skip
    for joint in (0, 1):
        named = named.added(f"actual_q_{joint}", ["0.7853981"] * len(sheet), 2)
    return save(folder, named.text(" "))


@dress(
    "ODrive, positions in turns",
    "axis0.pos_estimate=input_angle_rev",
    "axis1.pos_estimate=output_angle_turns",
    "load_cell=torque_Nm",
)
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.turned_into(
        "input_angle_rad", "axis0.pos_estimate", 1 / (2 * np.pi), form="%.15g"
    )
    named = named.turned_into(
        "output_angle_rad", "axis1.pos_estimate", 1 / (2 * np.pi), form="%.15g"
    )
    named = named.renamed(torque_Nm="load_cell")
    return save(folder, named.text())


@dress("Arduino serial plotter, the name before every value")
def _(folder: Path, sheet: Sheet) -> Path:
    lines = [
        ",".join(f"{name}:{cell}" for name, cell in zip(sheet.names, row, strict=True))
        for row in sheet.rows()
    ]
    return save(folder, "\n".join(lines) + "\n", "putty.log")


@dress("rows of Python lists, names in a list before them")
def _(folder: Path, sheet: Sheet) -> Path:
    lines = [str(list(sheet.names))]
    lines += [f"[{', '.join(row)}]" for row in sheet.rows()]
    return save(folder, "\n".join(lines) + "\n", "log.txt")


@dress("Graphtec logger, the sign apart from the digits, milliseconds in a column of their own")
def _(folder: Path, sheet: Sheet) -> Path:
    def apart(text: str) -> str:
        return f"{'-' if text.startswith('-') else '+'}  {text.lstrip('-+')}"

    clock = _clock(sheet)
    named = sheet.put("time_s", [f"{at:%Y/%m/%d %H:%M:%S}" for at in clock], "Date&Time")
    named = named.added("ms", [f"{at.microsecond // 1000}" for at in clock], 2)
    for name in ("torque_Nm", "input_angle_rad", "output_angle_rad", "temperature_C"):
        named = named.put(name, [apart(cell) for cell in named.cells(name)])
    named = named.added("Number", [str(i + 1) for i in range(len(sheet))], 0)
    top = "Vendor,GRAPHTEC Corporation\nModel,GL840\nVersion,Ver1.12\nSampling interval,400ms\n"
    return save(folder, named.text(top=top, end="\r\n"))


@dress(
    "Keysight BenchVue, a colon before the milliseconds, channels in angle brackets",
    "101 <TORQUE> (N.m)=torque_Nm",
    "102 <ENC IN> (rad)=input_angle_rad",
    "103 <ENC OUT> (rad)=output_angle_rad",
    "104 <T> (C)=temperature_C",
)
def _(folder: Path, sheet: Sheet) -> Path:
    cells = [f"{at:%m/%d/%Y %H:%M:%S}:{at.microsecond // 1000:03d}" for at in _clock(sheet)]
    named = sheet.put("time_s", cells, "Time").renamed(
        torque_Nm="101 <TORQUE> (N.m)", input_angle_rad="102 <ENC IN> (rad)",
        output_angle_rad="103 <ENC OUT> (rad)", temperature_C="104 <T> (C)",
    )  # fmt: skip
    named = named.added("Scan", [str(i + 1) for i in range(len(sheet))], 0)
    top = "Name:,joint 2\nOwner:,lab\nTotal Channels:,4\n\n"
    return save(folder, named.text(top=top, end="\r\n"), encoding="utf-16")


@dress(
    "TwinCAT Scope, a column of time in ms for every channel",
    "Time=time_ms",
    "Torque=torque_Nm",
    "EncIn=input_angle_rad",
    "EncOut=output_angle_rad",
)
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.turned_into("time_s", "Time", 1e3).ordered(
        "Time", "torque_Nm", "input_angle_rad", "output_angle_rad", "temperature_C", "run"
    )
    for at in (2, 4):
        named = named.added("Time", list(named.cells("Time")), at)
    named = named.renamed(torque_Nm="Torque", input_angle_rad="EncIn", output_angle_rad="EncOut")
    top = "Name;Scope\nFile;D:\\joint.svdx\n\n" + 3 * "SampleTime[ms];400;" + "\n"
    return save(folder, named.text(";", "\r\n", ",", top=top))


@dress("quantity / unit, as DIN 1313 has it (Sinamics Startdrive trace)")
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.turned_into("time_s", "Time / ms", 1e3).renamed(
        torque_Nm="torque / N m", input_angle_rad="input angle / rad",
        output_angle_rad="output angle / rad", temperature_C="temperature / °C",
    )  # fmt: skip
    return save(folder, named.text(";", "\r\n", ","))


@dress("the unit behind 'in', as spreadsheets of people have it")
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.renamed(
        time_s="time in s", torque_Nm="torque in Nm", input_angle_rad="input angle in rad",
        output_angle_rad="output angle in rad", temperature_C="temperature in °C",
    )  # fmt: skip
    return save(folder, named.text(";", "\r\n"))


@dress(
    "Chinese names in GBK, units in brackets of full width",
    "时间（s）=time_s",
    "扭矩（N·m）=torque_Nm",
    "输入角（rad）=input_angle_rad",
    "输出角（rad）=output_angle_rad",
    "温度（℃）=temperature_C",
)
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.renamed(
        time_s="时间（s）", torque_Nm="扭矩（N·m）", input_angle_rad="输入角（rad）",
        output_angle_rad="输出角（rad）", temperature_C="温度（℃）",
    )  # fmt: skip
    return save(folder, named.text(end="\r\n"), encoding="gbk")


@dress("Grafana, the unit behind every value, a stamp without a name of a unit")
def _(folder: Path, sheet: Sheet) -> Path:
    cells = [f"{at:%Y-%m-%d %H:%M:%S}.{at.microsecond // 1000:03d}" for at in _clock(sheet)]
    named = sheet.put("time_s", cells, "Time")
    named = named.put("torque_Nm", [f"{cell} N⋅m" for cell in sheet.cells("torque_Nm")], "torque")
    named = named.put(
        "temperature_C", [f"{cell} °C" for cell in sheet.cells("temperature_C")], "temperature"
    )
    return save(folder, "sep=,\n" + named.text(name=quoted))


@dress("InfluxDB, annotated CSV with columns of the query before the stamp")
def _(folder: Path, sheet: Sheet) -> Path:
    cells = [f"{at:%Y-%m-%dT%H:%M:%S}.{at.microsecond // 1000:03d}Z" for at in _clock(sheet)]
    named = sheet.put("time_s", cells, "_time")
    for place, (name, cell) in enumerate((("", ""), ("result", "_result"), ("table", "0"))):
        named = named.added(name, [cell] * len(sheet), place)
    more = len(named.names) - 3
    kinds = "#datatype,string,long" + more * ",double"
    top = f"#group{(more + 2) * ',false'}\n{kinds}\n#default,_result{(more + 1) * ','}\n"
    return save(folder, named.text(top=top, end="\r\n"))


@dress("exponents with a decimal comma")
def _(folder: Path, sheet: Sheet) -> Path:
    for name in ("time_s", "torque_Nm", "input_angle_rad", "output_angle_rad", "temperature_C"):
        sheet = sheet.turned_into(name, name, 1.0, form="%.12E")
    return save(folder, sheet.text(";", "\r\n", ","))


@dress("a minus sign behind the digits (SAP)")
def _(folder: Path, sheet: Sheet) -> Path:
    def behind(text: str) -> str:
        return f"{text[1:]}-" if text.startswith("-") else text

    return save(folder, sheet.text(";", cell=behind))


@dress(
    "topics at their own rates in one table, empty cells between (PlotJuggler, foxglove)",
    expected=REFUSED,
    reason="no row has torque and angle: which of them to interpolate is the owner's choice",
    says=("different rows",),
)
def _(folder: Path, sheet: Sheet) -> Path:
    lines = [",".join(sheet.names)]
    for row in sheet.rows():
        cell = dict(zip(sheet.names, row, strict=True))
        for late, own in enumerate((("torque_Nm",), ("input_angle_rad",), ("output_angle_rad",))):
            kept = {"run", *own}
            one = {name: text if name in kept else "" for name, text in cell.items()}
            one["time_s"] = f"{float(cell['time_s']) + 0.01 * late:.4f}"
            lines.append(",".join(one[name] for name in sheet.names))
    return save(folder, "\n".join(lines) + "\n")
