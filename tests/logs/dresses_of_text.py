"""Encodings, separators, quotes, numbers: the same table, other bytes."""

from __future__ import annotations

import codecs
from pathlib import Path

import numpy as np

from .clean import Sheet
from .dress import EITHER, REFUSED, dress, quoted, save

NAMED = {
    "run": "Run",
    "time_s": "Time (s)",
    "torque_Nm": "Torque (Nm)",
    "input_angle_rad": "Input angle (rad)",
    "output_angle_rad": "Output angle (rad)",
    "temperature_C": "Temperature (°C)",
    "cycles": "Cycles",
}
GERMAN = {
    "run": "Lauf",
    "time_s": "Zeit [s]",
    "torque_Nm": "Drehmoment [Nm]",
    "input_angle_rad": "Antriebswinkel [rad]",
    "output_angle_rad": "Abtriebswinkel [rad]",
    "temperature_C": "Gehäusetemperatur [°C]",
    "cycles": "Zyklen",
}
GERMAN_MAPS = (
    "Lauf=run",
    "Zeit [s]=time_s",
    "Drehmoment [Nm]=torque_Nm",
    "Antriebswinkel [rad]=input_angle_rad",
    "Abtriebswinkel [rad]=output_angle_rad",
    "Gehäusetemperatur [°C]=temperature_C",
    "Zyklen=cycles",
)
THOUSANDS = "grouping in thousands"


# --- encodings -----------------------------------------------------------------------------------


@dress("UTF-8 with a byte order mark (Excel, CSV UTF-8)")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(end="\r\n"), mark=codecs.BOM_UTF8)


@dress("UTF-16 little endian with mark, tabs (Excel, Unicode text)")
def _(folder: Path, sheet: Sheet) -> Path:
    text = sheet.text("\t", end="\r\n")
    return save(folder, text, "log.txt", "utf-16-le", codecs.BOM_UTF16_LE)


@dress("UTF-16 big endian with mark")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(), encoding="utf-16-be", mark=codecs.BOM_UTF16_BE)


@dress("UTF-16 little endian without mark")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(), encoding="utf-16-le")


@dress("UTF-32 with mark")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(), encoding="utf-32-le", mark=codecs.BOM_UTF32_LE)


@dress("cp1252, degree sign in the unit of a used column")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.renamed(**NAMED).text(), encoding="cp1252")


@dress("cp1252, German names, semicolons, decimal commas", *GERMAN_MAPS)
def _(folder: Path, sheet: Sheet) -> Path:
    text = sheet.renamed(**GERMAN).text(";", "\r\n", ",")
    return save(folder, text, encoding="cp1252")


@dress("UTF-8, German names, semicolons, decimal commas", *GERMAN_MAPS)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.renamed(**GERMAN).text(";", "\r\n", ","))


@dress("Shift-JIS in the name and the cells of an unused column")
def _(folder: Path, sheet: Sheet) -> Path:
    noted = sheet.added("備考", ["正常"] * len(sheet))
    return save(folder, noted.text(end="\r\n"), encoding="shift-jis")


@dress("Cyrillic names in UTF-8", "Момент, Н·м=torque_Nm", "Время, с=time_s")
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.renamed(torque_Nm="Момент, Н·м", time_s="Время, с")
    return save(folder, named.text(";"))


@dress("carriage returns alone (old Macintosh programs)")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text("\t", end="\r"), "log.txt")


@dress("line ends of both kinds")
def _(folder: Path, sheet: Sheet) -> Path:
    lines = sheet.text().splitlines()
    return save(folder, "".join(line + ("\r\n" if i % 3 else "\n") for i, line in enumerate(lines)))


@dress("CR CR LF (text mode written twice)")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(end="\r\r\n"))


@dress("no line end at the end")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text().rstrip("\n"))


@dress("NUL bytes behind the last line (a file of fixed size)")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text() + "\0" * 4096)


@dress("Ctrl-Z at the end (DOS)")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(end="\r\n") + "\x1a")


# --- separators ----------------------------------------------------------------------------------


@dress("semicolons and decimal points")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(";"))


@dress("sep=; before the names (Excel)")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(";", decimal=",", top="sep=;\n"))


@dress("tabs and decimal commas")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text("\t", decimal=","), "log.tsv")


@dress("pipes")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text("|"))


@dress("pipes with blanks round them and at both ends (Markdown)")
def _(folder: Path, sheet: Sheet) -> Path:
    rule = "|" + "|".join([" --- "] * len(sheet.names)) + "|\n"
    lines = sheet.text(" | ").splitlines()
    table = [f"| {line} |" for line in lines]
    return save(folder, table[0] + "\n" + rule + "\n".join(table[1:]) + "\n", "log.md")


@dress("psql, with a rule below the names and the count of rows at the end")
def _(folder: Path, sheet: Sheet) -> Path:
    lines = [" " + line for line in sheet.text(" | ").splitlines()]
    rule = "+".join("-" * (len(name) + 2) for name in sheet.names)
    text = "\n".join([lines[0], rule, *lines[1:], f"({len(sheet)} rows)", "", ""])
    return save(folder, text, "log.txt")


@dress("columns aligned with blanks (numpy.savetxt, Fortran)")
def _(folder: Path, sheet: Sheet) -> Path:
    width = 1 + max(len(cell) for cells in (sheet.names, *sheet.columns) for cell in cells)
    text = sheet.text("", cell=lambda cell: cell.rjust(width), name=lambda n: n.rjust(width))
    return save(folder, text, "log.dat")


@dress("comma and blank")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(", "))


@dress("a separator behind every last cell, names included")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(";", end=";\n"))


@dress("a comma behind every row but not behind the names")
def _(folder: Path, sheet: Sheet) -> Path:
    names, *rows = sheet.text().splitlines()
    return save(folder, names + "\n" + "".join(f"{row},\n" for row in rows))


@dress("semicolons, and a comma in the name of an unused column")
def _(folder: Path, sheet: Sheet) -> Path:
    noted = sheet.added("note, free text", ["ok, warm"] * len(sheet))
    return save(folder, noted.text(";", decimal=","))


@dress("commas, and a semicolon in the name of an unused column")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.added("remarks; by hand", ["a;b"] * len(sheet)).text())


@dress("an unused column with line ends, commas and quotes in its quoted cells")
def _(folder: Path, sheet: Sheet) -> Path:
    cells = ['"two\nlines, ""quoted"""' if i % 50 == 7 else "" for i in range(len(sheet))]
    return save(folder, sheet.added("note", cells).text())


@dress("everything in quotes")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(cell=quoted, name=quoted))


@dress("commas, and decimal commas in quotes")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(decimal=",", cell=quoted, name=quoted))


@dress("whole rows in quotes (a CSV file saved again as CSV)")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, "".join(quoted(line) + "\n" for line in sheet.text().splitlines()))


# --- numbers -------------------------------------------------------------------------------------


def _grouped(value: float, group: str, decimal: str, places: int = 1) -> str:
    text = f"{value:,.{places}f}"
    return text.replace(",", "\0").replace(".", decimal).replace("\0", group)


def _milli(sheet: Sheet, group: str, decimal: str, places: int = 1) -> Sheet:
    values = 1e3 * sheet.values("torque_Nm")
    cells = [_grouped(value, group, decimal, places) for value in values]
    return sheet.put("torque_Nm", cells, "torque_mNm")


@dress("thousands 37,995.2 in quotes")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, _milli(sheet, ",", ".").text(cell=quoted))


@dress("thousands 37,995.2 with tabs")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, _milli(sheet, ",", ".").text("\t"), "log.txt")


@dress("thousands 37.995,2 with semicolons")
def _(folder: Path, sheet: Sheet) -> Path:
    angles = ("input_angle_rad", "output_angle_rad", "time_s", "temperature_C")
    for name in angles:
        sheet = sheet.put(name, [cell.replace(".", ",") for cell in sheet.cells(name)])
    return save(folder, _milli(sheet, ".", ",").text(";"))


@dress("thousands 37'995.2 (Swiss)")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, _milli(sheet, "'", ".").text(";"))


@dress("thousands 37 995,2 with narrow blanks (French)")
def _(folder: Path, sheet: Sheet) -> Path:
    for name in ("input_angle_rad", "output_angle_rad", "time_s", "temperature_C"):
        sheet = sheet.put(name, [cell.replace(".", ",") for cell in sheet.cells(name)])
    return save(folder, _milli(sheet, "\u202f", ",").text(";"))


@dress(
    "thousands 37,995 of whole mN m, with tabs",
    expected=EITHER,
    reason=f"a comma before three digits is {THOUSANDS} or a decimal comma; 717 beside 3,767 tells",
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, _milli(sheet, ",", ".", 0).text("\t"), "log.txt")


@dress(
    "thousands 37.995 of whole mN m, with semicolons",
    expected=EITHER,
    reason=f"a point before three digits is {THOUSANDS} or a decimal point; 717 beside 3.767 "
    "and decimal commas beside them tell",
)
def _(folder: Path, sheet: Sheet) -> Path:
    for name in ("input_angle_rad", "output_angle_rad", "time_s", "temperature_C"):
        sheet = sheet.put(name, [cell.replace(".", ",") for cell in sheet.cells(name)])
    return save(folder, _milli(sheet, ".", ",", 0).text(";"))


@dress("plus signs, leading zeros, exponents")
def _(folder: Path, sheet: Sheet) -> Path:
    sheet = sheet.turned_into("torque_Nm", "torque_Nm", 1.0, form="%+.6E")
    sheet = sheet.turned_into("time_s", "time_s", 1.0, form="%012.4f")
    return save(folder, sheet.turned_into("cycles", "cycles", 1.0, form="%.3e").text())


@dress("exponents with D (Fortran)")
def _(folder: Path, sheet: Sheet) -> Path:
    for name in ("torque_Nm", "input_angle_rad", "output_angle_rad"):
        cells = [f"{value:.9E}".replace("E", "D") for value in sheet.values(name)]
        sheet = sheet.put(name, cells)
    return save(folder, sheet.text("  "), "log.dat")


@dress("no digit before the point")
def _(folder: Path, sheet: Sheet) -> Path:
    for name in ("torque_Nm", "input_angle_rad", "output_angle_rad"):
        cells = [cell.replace("-0.", "-.") for cell in sheet.cells(name)]
        cells = [cell[1:] if cell.startswith("0.") else cell for cell in cells]
        sheet = sheet.put(name, cells)
    return save(folder, sheet.text())


@dress("a true minus sign (pasted from a text program)")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(";", cell=lambda cell: cell.replace("-", "\u2212")))


@dress("the unit behind every number")
def _(folder: Path, sheet: Sheet) -> Path:
    sheet = sheet.put("torque_Nm", [f"{cell} Nm" for cell in sheet.cells("torque_Nm")])
    return save(folder, sheet.text())


@dress("numbers with 17 digits")
def _(folder: Path, sheet: Sheet) -> Path:
    for name in ("torque_Nm", "input_angle_rad", "output_angle_rad"):
        sheet = sheet.turned_into(name, name, 1.0, form="%.17g")
    return save(folder, sheet.text())


@dress(
    "numbers in engineering notation with prefixes (SPICE, oscilloscopes)",
    "torque=torque_Nm",
    expected=EITHER,
    reason="m is milli or a unit: 250m may be read or refused",
)
def _(folder: Path, sheet: Sheet) -> Path:
    cells = [f"{1e3 * value:.6g}m" for value in sheet.values("torque_Nm")]
    return save(folder, sheet.put("torque_Nm", cells, "torque").text())


# --- names ---------------------------------------------------------------------------------------


@dress("names in capitals")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(name=str.upper))


@dress("names with units in brackets, as loggers write them")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.renamed(**NAMED).text())


@dress("names with blanks round them")
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(name=lambda name: f"  {name} "))


@dress("names with blanks for underscores and the unit behind a comma")
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.renamed(
        time_s="Time, s",
        torque_Nm="Torque, Nm",
        input_angle_rad="Input Angle, rad",
        output_angle_rad="Output Angle, rad",
        temperature_C="Temperature, degC",
    )
    return save(folder, named.text(";"))


@dress("names in two rows (pandas, columns of two levels)")
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.renamed(
        time_s="time",
        torque_Nm="torque",
        input_angle_rad="input_angle",
        output_angle_rad="output_angle",
        temperature_C="temperature",
    )
    return save(folder, named.text(below_names=",s,Nm,rad,rad,C,\n"))


@dress("unused columns of one name, and without any")
def _(folder: Path, sheet: Sheet) -> Path:
    for name in ("spare", "spare", "", "", "Unnamed: 3"):
        sheet = sheet.added(name, ["0"] * len(sheet), at=3)
    return save(folder, sheet.text())


@dress("sixty unused columns of every kind")
def _(folder: Path, sheet: Sheet) -> Path:
    kinds = ["", "ok", "12:30", "1,5", "NaN", "#REF!", "-", "0x1F", "TRUE", "2026-03-02"]
    for i in range(60):
        kind = kinds[i % len(kinds)]
        sheet = sheet.added(f"ch{i}", [kind] * len(sheet), at=(7 * i) % len(sheet.names))
    return save(folder, sheet.text(";"))


@dress(
    "two columns of the name of a used quantity, not the same numbers",
    expected=REFUSED,
    reason="either may be the torque",
    says=("torque_Nm",),
)
def _(folder: Path, sheet: Sheet) -> Path:
    other = [f"{value:.5g}" for value in 0.5 * sheet.values("torque_Nm")]
    return save(folder, sheet.added("torque_Nm", other).text())


@dress(
    "no unit anywhere",
    expected=REFUSED,
    reason="a unit is never guessed",
    says=("torque",),
)
def _(folder: Path, sheet: Sheet) -> Path:
    named = sheet.renamed(time_s="time", torque_Nm="torque", input_angle_rad="input_angle")
    return save(folder, named.renamed(output_angle_rad="output_angle").text())


@dress(
    "numbers alone, no names (save -ascii, halsampler)",
    expected=REFUSED,
    reason="which column is which stands nowhere",
)
def _(folder: Path, sheet: Sheet) -> Path:
    return save(folder, sheet.text(" ").partition("\n")[2], "log.dat")


@dress(
    "the columns of two tables beside each other",
    expected=EITHER,
    reason="each half has its own time: two recordings in one file",
)
def _(folder: Path, sheet: Sheet) -> Path:
    half = len(sheet) // 2
    first, second = (sheet.taken(np.arange(len(sheet)) // half == i).rows() for i in (0, 1))
    names = ",".join((*sheet.names, "", *sheet.names))
    lines = [",".join([*a, "", *b]) for a, b in zip(first, second, strict=True)]
    return save(folder, "\n".join([names, *lines]) + "\n")
