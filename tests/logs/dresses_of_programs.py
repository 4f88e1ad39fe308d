"""Files in the formats of instruments and programs: text around the table, and file names."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .clean import Sheet
from .dress import EITHER, REFUSED, dress, quoted, save

PLAIN = {
    "time_s": "Time",
    "torque_Nm": "Torque",
    "input_angle_rad": "Input angle",
    "output_angle_rad": "Output angle",
    "temperature_C": "Temperature",
}
"""Names of the quantities without units, which are in a separate row."""

CHANNELS = (
    "AI0=torque_Nm",
    "ENC0=input_angle_rad",
    "ENC1=output_angle_rad",
    "TC0=temperature_C",
)


def _channels(sheet: Sheet) -> Sheet:
    return sheet.renamed(
        torque_Nm="AI0", input_angle_rad="ENC0", output_angle_rad="ENC1", temperature_C="TC0"
    )


@dress("LabVIEW measurement file (.lvm)", "X_Value=time_s", *CHANNELS)
def _(folder: Path, sheet: Sheet) -> Path:
    top = (
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\n"
        "Decimal_Separator\t.\nMulti_Headings\tNo\nX_Columns\tOne\nTime_Pref\tRelative\n"
        "Operator\tlab\nDate\t2026/03/02\nTime\t09:13:22.1234567\n***End_of_Header***\t\n\t\n"
        "Channels\t6\t\t\t\t\t\t\nSamples\t1250\t1250\t1250\t1250\t1250\t1250\t\n"
        "Date\t2026/03/02\t2026/03/02\t2026/03/02\t2026/03/02\t2026/03/02\t2026/03/02\t\n"
        "Y_Unit_Label\tNm\trad\trad\tC\t\t\t\n"
        "X_Dimension\tTime\tTime\tTime\tTime\tTime\tTime\t\n"
        "X0\t0.0000000000000000E+0\t0.0000000000000000E+0\t0.0000000000000000E+0\t\t\t\t\n"
        "Delta_X\t0.400000\t0.400000\t0.400000\t0.400000\t0.400000\t0.400000\t\n"
        "***End_of_Header***\t\t\t\t\t\t\t\n"
    )
    lvm = _channels(sheet).renamed(time_s="X_Value")
    order = ("X_Value", "AI0", "ENC0", "ENC1", "TC0", "run", "cycles")
    return save(folder, lvm.ordered(*order).text("\t", "\r\n", top=top, name=str), "log.lvm")


@dress("NI-DAQmx logger, metadata with commas", *CHANNELS)
def _(folder: Path, sheet: Sheet) -> Path:
    top = (
        'FlexLogger\nTest name,Torsion 12\nOperator,"Meier, A."\n'
        "Start time,3/2/2026 9:13:22 AM\nSample rate (Hz),2.5,2.5,2.5\nChannels,7\n\n"
    )
    return save(folder, _channels(sheet).text(top=top, end="\r\n"))


@dress("HBM catman, a block of text for every channel, units in their row")
def _(folder: Path, sheet: Sheet) -> Path:
    top = (
        "CATMAN V5.4 ASCII export\t\nT0 = 02.03.2026 09:13:22\t\nFile: joint_12.bin\t\n"
        "Amplifier\tMX840B\tMX840B\tMX460B\tMX460B\tMX1609\tMX840B\n"
        "Serial no.\t9E5\t9E5\t71A\t71A\t13C\t9E5\n"
        "Sampling rate\t2.5 Hz\t2.5 Hz\t2.5 Hz\t2.5 Hz\t2.5 Hz\t2.5 Hz\n\n"
    )
    units = "\ts\tNm\trad\trad\t°C\t\n"
    named = sheet.renamed(**PLAIN)
    text = named.text("\t", "\r\n", top=top, below_names=units)
    return save(folder, text, "log.asc", "cp1252")


@dress("HBM catman in German, decimal commas", "Zeit=time_s", "Mz=torque_Nm")
def _(folder: Path, sheet: Sheet) -> Path:
    top = "Exportiert mit catman\nDatum:;02.03.2026\nAbtastrate:;2,5 Hz\nKommentar:;;;\n\n"
    units = ";[s];[Nm];[rad];[rad];[°C];\n"
    named = sheet.renamed(**PLAIN).renamed(Time="Zeit", Torque="Mz")
    text = named.text(";", "\r\n", ",", top=top, below_names=units)
    return save(folder, text, "log.asc", "cp1252")


@dress("Kistler, colons in the preamble, N·m in the row of units")
def _(folder: Path, sheet: Sheet) -> Path:
    top = (
        "File name:\tjoint.dwd\nDate:\tMonday, March 02, 2026\nSampling rate [Hz]:\t2.500000\n"
        "Measuring time [s]:\t59.600000\nDelay time [s]:\t0.000000\nCycle No:\t1\n"
        "Samples per channel:\t150\n"
    )
    named = sheet.renamed(**PLAIN)
    return save(
        folder, named.text("\t", "\r\n", top=top, below_names="\ts\tN·m\trad\trad\t°C\t\n"),
        "log.txt",
    )  # fmt: skip


@dress("Yokogawa recorder, quoted metadata, quoted units")
def _(folder: Path, sheet: Sheet) -> Path:
    top = '"Model","MX100"\n"Sampling Interval","400ms"\n"Data Count",1250\n'
    units = '"","s","Nm","rad","rad","C",""\n'
    return save(folder, sheet.renamed(**PLAIN).text(top=top, below_names=units, name=quoted))


@dress(
    "Yokogawa scope, a block without a column of time",
    expected=REFUSED,
    reason="the preamble states a time step, and there is no time column",
    says=("time",),
)
def _(folder: Path, sheet: Sheet) -> Path:
    top = (
        '"//YOKOGAWA ASCII FILE FORMAT"\n"FormatVersion","1.11"\n"Model","DL850"\n'
        '"BlockNumber",1\n"HResolution",4.0E-1\n"HUnit","s"\n"Date","2026/03/02"\n'
    )
    return save(folder, sheet.without("time_s").text(top=top))


@dress(
    "Keysight scope, columns named by numbers, volts",
    "x-axis=time_s",
    "1=torque_Nm/0.1",
    "2=input_angle_rad",
    "3=output_angle_rad",
    "4=temperature_C",
)
def _(folder: Path, sheet: Sheet) -> Path:
    sheet = sheet.turned_into("torque_Nm", "1", 0.1)
    sheet = sheet.renamed(time_s="x-axis", input_angle_rad="2", output_angle_rad="3")
    sheet = sheet.renamed(temperature_C="4")
    order = ("x-axis", "1", "2", "3", "4", "run", "cycles")
    return save(
        folder,
        sheet.ordered(*order).text(end="\r\n", below_names="second,Volt,Volt,Volt,Volt,,\n"),
    )


@dress(
    "Tektronix scope, a preamble with as many commas",
    "TIME=time_s",
    "CH1=torque_Nm",
    "CH2=input_angle_rad",
    "CH3=output_angle_rad",
    "CH4=temperature_C",
)
def _(folder: Path, sheet: Sheet) -> Path:
    top = (
        "Model,MSO54B,,,,,\nFirmware Version,1.30,,,,,\n,,,,,,\nWaveform Type,ANALOG,,,,,\n"
        "Point Format,Y,,,,,\nHorizontal Units,s,,,,,\nHorizontal Scale,4,,,,,\n"
        "Sample Interval,0.4,,,,,\nRecord Length,1250,,,,,\n"
        "Probe Attenuation,1,1,1,1,,\nVertical Units,V,V,V,V,,\n,,,,,,\n"
    )
    named = sheet.renamed(
        time_s="TIME", torque_Nm="CH1", input_angle_rad="CH2", output_angle_rad="CH3",
        temperature_C="CH4",
    )  # fmt: skip
    order = ("TIME", "CH1", "CH2", "CH3", "CH4", "run", "cycles")
    return save(folder, named.ordered(*order).text(top=top, end="\r\n"))


@dress(
    "PicoScope, units in brackets and a blank line below the names",
    "Channel A=torque_Nm",
    "Channel B=input_angle_rad",
    "Channel C=output_angle_rad",
    "Channel D=temperature_C",
)
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.turned_into("time_s", "Time", 1e3).renamed(
        torque_Nm="Channel A", input_angle_rad="Channel B", output_angle_rad="Channel C",
        temperature_C="Channel D",
    )  # fmt: skip
    order = ("Time", "Channel A", "Channel B", "Channel C", "Channel D", "run", "cycles")
    units = "(ms),(V),(V),(V),(V),,\n\n"
    return save(folder, named.ordered(*order).text(below_names=units, end="\r\n"))


@dress(
    "Saleae Logic",
    "Channel 0=torque_Nm",
    "Channel 1=input_angle_rad",
    "Channel 2=output_angle_rad",
    "Channel 3=temperature_C",
)
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.renamed(
        time_s="Time [s]", torque_Nm="Channel 0", input_angle_rad="Channel 1",
        output_angle_rad="Channel 2", temperature_C="Channel 3",
    )  # fmt: skip
    return save(folder, named.text(name=quoted))


@dress(
    "dSPACE ControlDesk",
    "xAxis=time_s",
    "Model Root/Torque/Out1=torque_Nm",
    "Model Root/EncIn/Out1=input_angle_rad",
    "Model Root/EncOut/Out1=output_angle_rad",
)
def _(folder: Path, sheet: Sheet) -> Path:
    top = (
        '"type","csv"\n"version","2.0"\n"title","Recorder 3"\n"author","lab"\n'
        '"creation date","2026-03-02 09:13:22"\n"description",""\n"raster","HostService"\n\n'
    )
    named = sheet.renamed(
        time_s="xAxis", torque_Nm="Model Root/Torque/Out1",
        input_angle_rad="Model Root/EncIn/Out1", output_angle_rad="Model Root/EncOut/Out1",
    )  # fmt: skip
    return save(folder, named.text(top=top, name=quoted))


@dress("LabJack stream, tabs and a count of samples", "AIN0=torque_Nm")
def _(folder: Path, sheet: Sheet) -> Path:
    count = [str(i) for i in range(len(sheet))]
    named = sheet.renamed(torque_Nm="AIN0").added("Scan", count, at=0)
    top = "LJStreamM log\nCh 0:\tAIN0\tRange 10\nScan rate:\t2.5\n\n"
    return save(folder, named.text("\t", top=top, end="\r\n"), "log.dat")


@dress("MATLAB writetable of a timetable, durations with sec")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.put("time_s", [f"{cell} sec" for cell in sheet.cells("time_s")],
                                  "Time").text())  # fmt: skip


@dress("a percent sign before the comment and the names (MATLAB, Octave)")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text("\t", top="% written by bench.m, 02-Mar-2026\n% "), "log.txt")


@dress("numpy.savetxt, the names in a comment")
def _(folder: Path, sheet: Sheet) -> Path:
    values = np.column_stack([sheet.values(name) for name in sheet.names])
    file = folder / "log.csv"
    np.savetxt(file, values, delimiter=",", header=",".join(sheet.names))
    return file


@dress("numpy.savetxt with blanks, a comment before the names")
def _(folder: Path, sheet: Sheet) -> Path:
    values = np.column_stack([sheet.values(name) for name in sheet.names])
    file = folder / "log.txt"
    np.savetxt(file, values, header="torsion bench, joint 2\n" + " ".join(sheet.names))
    return file


@dress("names behind # without a blank (Klipper, gnuplot)")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, "#" + sheet.text())


@dress("comments with ; and //")
def _(folder: Path, sheet: Sheet) -> Path:
    top = "; torsion bench\n; firmware 1.2, gain=4, offset=0\n// channel order as wired\n"
    return save(folder, sheet.text(top=top))


@dress("comments between the rows")
def _(folder: Path, sheet: Sheet) -> Path:
    lines = sheet.text(top="# bench 2\n").splitlines()
    for at in (900, 500, 40):
        lines.insert(at, "# operator paused, resumed")
    return save(folder, "\n".join(lines) + "\n")


@dress("key = value and a blank line before the names")
def _(folder: Path, sheet: Sheet) -> Path:
    top = "[header]\nserial = 1234\nrate_Hz = 2.5\ndate = 2026-03-02 10:11:12\n\n[data]\n"
    return save(folder, sheet.text(top=top))


@dress("pandas, with its index")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.added("", [str(i) for i in range(len(sheet))], at=0).text())


@dress("R write.csv, with names of rows")
def _(folder: Path, sheet: Sheet) -> Path:
    count = [quoted(str(1 + i)) for i in range(len(sheet))]
    return save(folder, sheet.added("", count, at=0).text(name=quoted))


@dress("R write.table, one name fewer than there are columns")
def _(folder: Path, sheet: Sheet) -> Path:
    names, *rows = sheet.text(" ", name=quoted).splitlines()
    lines = [f'"{1 + i}" {row}' for i, row in enumerate(rows)]
    return save(folder, "\n".join([names, *lines]) + "\n", "log.txt")


@dress("Igor Pro text, waves between BEGIN and END")
def _(folder: Path, sheet: Sheet) -> Path:
    lines = sheet.text("\t", cell=str).splitlines()
    text = ["IGOR", "WAVES/D\t" + lines[0], "BEGIN", *("\t" + line for line in lines[1:]), "END"]
    return save(folder, "\r".join(text) + "\r", "log.itx")


@dress("Origin: long names, units, comments")
def _(folder: Path, sheet: Sheet) -> Path:
    below = "\ts\tN m\trad\trad\t°C\t\n\t\tT40B\tRCN\tRCN\tPT100\t\n"
    return save(folder, sheet.renamed(**PLAIN).text("\t", "\r\n", below_names=below), "log.dat")


@dress("a row of units in square brackets")
def _(folder: Path, sheet: Sheet) -> Path:
    below = "[-];[s];[N.m];[rad];[rad];[degC];[-]\n"
    return save(folder, sheet.renamed(**PLAIN).text(";", below_names=below))


@dress("a row of units written out")
def _(folder: Path, sheet: Sheet) -> Path:
    below = ",seconds,N-m,radians,radians,deg C,\n"
    return save(folder, sheet.renamed(**PLAIN).text(below_names=below))


@dress("a row of units that agrees with the names")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(below_names="-,s,Nm,rad,rad,C,-\n"))


@dress(
    "a row of units that contradicts the names",
    expected=REFUSED,
    reason="N m by the name, mN m by the row of units",
    says=("torque_Nm", "mNm"),
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(below_names="-,s,mNm,rad,rad,C,-\n"))


@dress("a row of units above the names")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.renamed(**PLAIN).text(top=",s,Nm,rad,rad,C,\n"))


@dress(
    "rostopic echo -p",
    "field.header.stamp=time_ns",
    "field.torque=torque_Nm",
    "field.position0=input_angle_rad",
    "field.position1=output_angle_rad",
)
def _(folder: Path, sheet: Sheet) -> Path:
    start = 1_772_442_802_000_000_000
    stamps = [str(start + round(1e9 * t)) for t in sheet.values("time_s")]
    late = [str(int(stamp) + 1_234_567) for stamp in stamps]
    ros = sheet.put("time_s", stamps, "field.header.stamp").added("%time", late, at=0)
    ros = ros.added("field.header.seq", [str(i) for i in range(len(sheet))], at=1)
    ros = ros.added("field.header.frame_id", ["base_link"] * len(sheet))
    ros = ros.renamed(
        torque_Nm="field.torque", input_angle_rad="field.position0",
        output_angle_rad="field.position1",
    )  # fmt: skip
    return save(folder, ros.text())


@dress(
    "PlotJuggler",
    "__time=time_s",
    "/joint_states/j2/effort=torque_Nm",
    "/joint_states/j2/position=output_angle_rad",
    "/motor/position=input_angle_rad",
)
def _(folder: Path, sheet: Sheet) -> Path:
    start = 1_772_442_802.25
    stamps = [f"{start + t:.6f}" for t in sheet.values("time_s")]
    named = sheet.put("time_s", stamps, "__time").renamed(
        torque_Nm="/joint_states/j2/effort", output_angle_rad="/joint_states/j2/position",
        input_angle_rad="/motor/position",
    )  # fmt: skip
    return save(folder, named.text())


@dress(
    "candump, frames in hexadecimal digits",
    expected=REFUSED,
    reason="the meaning of the bytes is in another file",
)
def _(folder: Path, sheet: Sheet) -> Path:
    torque = (1e3 * sheet.values("torque_Nm")).astype(int) & 0xFFFF
    lines = [
        f"({1_772_442_802 + t:.6f}) can0 0{44 + i % 3}#{int(value):04X}0000"
        for i, (t, value) in enumerate(zip(sheet.values("time_s"), torque, strict=True))
    ]
    return save(folder, "\n".join(lines) + "\n", "candump.log")


@dress(
    "TwinCAT Scope, a preamble with tabs, time in ms",
    "Torque=torque_Nm",
    "EncIn=input_angle_rad",
    "EncOut=output_angle_rad",
    "Temp=temperature_C",
)
def _(folder: Path, sheet: Sheet) -> Path:
    top = (
        "Name\tYT Scope Project\nFile\tD:\\bench\\joint.svdx\n"
        "Starttime of export\t134169596020000000\tMonday, 2 March 2026\t09:13:22.000\n"
        "Endtime of export\t134169596616000000\tMonday, 2 March 2026\t09:14:21.600\n\n"
    )
    named = sheet.turned_into("time_s", "Time [ms]", 1e3).renamed(
        torque_Nm="Torque", input_angle_rad="EncIn", output_angle_rad="EncOut",
        temperature_C="Temp",
    )  # fmt: skip
    order = ("Time [ms]", "Torque", "EncIn", "EncOut", "Temp", "run", "cycles")
    return save(folder, named.ordered(*order).text("\t", "\r\n", top=top))


@dress(
    "CODESYS trace, micro in the unit of time",
    "PLC_PRG.rTorque=torque_Nm",
    "PLC_PRG.lrIn=input_angle_rad",
    "PLC_PRG.lrOut=output_angle_rad",
)
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.turned_into("time_s", "Time (µs)", 1e6, form="%d").renamed(
        torque_Nm="PLC_PRG.rTorque", input_angle_rad="PLC_PRG.lrIn",
        output_angle_rad="PLC_PRG.lrOut",
    )  # fmt: skip
    return save(folder, named.text(";", "\r\n"))


@dress("summary lines below the table (minimum, maximum, mean)")
def _(folder: Path, sheet: Sheet) -> Path:
    bottom = "\n"
    for word, function in (("Min", np.min), ("Max", np.max), ("Mean", np.mean)):
        values = [f"{function(sheet.values(name)):.5g}" for name in sheet.names[1:]]
        bottom += ",".join([word, *values]) + "\n"
    return save(folder, sheet.text(bottom=bottom))


@dress("remarks below the table")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(";", bottom="\nEnd of measurement\nSigned: A. Meier\n"))


@dress(
    "a serial monitor: a time of day and an arrow before every line",
    expected=EITHER,
    reason="the stamp of the monitor is no column of the table",
)
def _(folder: Path, sheet: Sheet) -> Path:
    lines = sheet.text().splitlines()
    return save(
        folder, "".join(f"09:13:{i % 60:02d}.123 -> {line}\n" for i, line in enumerate(lines))
    )


@dress(
    "text in a spreadsheet's file (.xlsx under the name .csv)",
    expected=REFUSED,
    reason="a packed file of another kind",
)
def _(folder: Path, sheet: Sheet) -> Path:
    import zipfile

    file = folder / "log.csv"
    with zipfile.ZipFile(file, "w") as packed:
        packed.writestr("xl/worksheets/sheet1.xml", "<worksheet/>")
    return file


@dress("JSON, one object a line", expected=EITHER, reason="no table of columns")
def _(folder: Path, sheet: Sheet) -> Path:
    import json

    lines = [
        json.dumps({name: float(cell) for name, cell in zip(sheet.names, row, strict=True)})
        for row in sheet.rows()
    ]
    return save(folder, "\n".join(lines) + "\n", "log.jsonl")


@dress(
    "a page of HTML under the name .csv (a download that failed)",
    expected=REFUSED,
    reason="no recording at all",
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(
        folder,
        "<!DOCTYPE html>\n<html><head><title>Sign in</title></head>\n"
        "<body>Session expired, please sign in.</body></html>\n",
    )
