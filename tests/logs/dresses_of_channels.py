"""Logs of programs that write one value in a row, and of those that describe every channel."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

from .clean import Sheet
from .dress import dress, save
from .dresses_of_programs import PLAIN

BEGIN = datetime(2026, 3, 2, 9, 13, 22)

TAGS = {"torque_Nm": "M1.TRQ", "input_angle_rad": "G1.POS", "output_angle_rad": "G2.POS"}
UNITS = {"torque_Nm": "Nm", "input_angle_rad": "rad", "output_angle_rad": "rad"}


def channels(sheet: Sheet) -> list[str]:
    """Names of the columns that are channels."""
    return [name for name in sheet.names if name not in ("run", "time_s")]


def stamp(time_s: str) -> str:
    """Time of a row as databases write it."""
    moment = BEGIN + timedelta(seconds=float(time_s))
    return moment.isoformat(timespec="microseconds") + "Z"


@dress("long form: time, channel and value (pandas melt)")
def _(folder: Path, sheet: Sheet) -> Path:
    lines = ["run,time_s,variable,value"]
    for row in sheet.rows():
        cell = dict(zip(sheet.names, row, strict=True))
        begin = f"{cell['run']},{cell['time_s']}"
        lines += [f"{begin},{name},{cell[name]}" for name in channels(sheet)]
    return save(folder, "\n".join(lines) + "\n")


@dress("InfluxDB, annotated: a table for every channel, with its names again")
def _(folder: Path, sheet: Sheet) -> Path:
    text = ""
    for number, name in enumerate(channels(sheet)):
        text += (
            "#group,false,false,true,true,false,false,true,true\n"
            "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,"
            "string,string\n#default,mean,,,,,,,\n"
            ",result,table,_start,_stop,_time,_value,_field,run\n"
        )
        rows = zip(sheet.cells("time_s"), sheet.cells(name), sheet.cells("run"), strict=True)
        for time, value, run in rows:
            text += (
                f",,{number},{stamp('-60')},{stamp('3600')},{stamp(time)},{value},{name},{run}\n"
            )
        text += "\n"
    return save(folder, text.replace("\n", "\r\n"))


@dress(
    "a historian (WinCC): tag, value and unit, semicolons and decimal commas",
    *(f"{TAGS[name]}={name}" for name in TAGS),
)
def _(folder: Path, sheet: Sheet) -> Path:
    lines = ["VarName;TimeString;VarValue;Unit;Validity;run"]
    for row in sheet.rows():
        cell = dict(zip(sheet.names, row, strict=True))
        time = stamp(cell["time_s"])
        for name, tag in TAGS.items():
            value = cell[name].replace(".", ",")
            lines.append(f"{tag};{time};{value};{UNITS[name]};1;{cell['run']}")
        lines.append(f"temperature_C;{time};{cell['temperature_C']};°C;1;{cell['run']}")
    return save(folder, "\n".join(lines) + "\n", encoding="cp1252")


@dress("three lines of names: of the quantity, of the channel, of the unit")
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.renamed(**PLAIN)
    units = {"Time": "s", "Torque": "Nm", "Input angle": "rad", "Output angle": "rad"}
    units |= {"Temperature": "°C"}
    below = ",".join(f"Ch {i}" for i in range(len(named.names))) + "\n"
    below += ",".join(units.get(name, "") for name in named.names) + "\n"
    return save(folder, named.text(below_names=below))
