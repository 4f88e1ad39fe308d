"""Single faults: one error in one column or one line of the clean campaign."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .clean import Sheet, clean
from .dress import EITHER, SAME

RUN_OF = {
    "run": "14",
    "time_s": "14",
    "torque_Nm": "14",
    "input_angle_rad": "14",
    "output_angle_rad": "14",
    "temperature_C": "15",
    "cycles": "28",
}
"""Row at which each column is damaged: its value is far from zero there."""
PLACE = 70
"""Row within the run, where the torque is neither zero nor at its ends."""
STUCK = 60
"""Number of rows for which a channel repeats a value."""

LONG = 12
"""Number of rows for which an amplifier or a converter is saturated: longer than a burst."""

FULL_SCALE = {
    "run": "32767",
    "time_s": "4294967.2950",
    "torque_Nm": "1024",
    "input_angle_rad": "65535",
    "output_angle_rad": "65535",
    "temperature_C": "850",
    "cycles": "4294967295",
}
"""Readings of a channel at the end of its range: integers of 16 and 32 bits, an amplifier of 10 V
at 25 times the rated torque, a PT100 with an open wire."""

HELD = 4
"""Rows for which a slower channel is repeated by its logger."""

LEAST_COUNT = {
    "run": 1,
    "time_s": 1e-4,
    "torque_Nm": 1e-3,
    "input_angle_rad": 1e-6,
    "output_angle_rad": 1e-8,
    "temperature_C": 0.01,
    "cycles": 1,
}
"""Value of one count of a column, for faults of its bits."""


@dataclass(frozen=True)
class Fault:
    """One fault and its required outcome.

    Attributes
    ----------
    name : str
        The fault and its place.
    text : str
        The file.
    expected, reason : str
        As in `dress.Dress`.
    finding : tuple of str
        Words in a finding of ``check``; empty if the fault cannot be detected.
    less : Sheet, optional
        The clean copy without the unusable rows.
    twice : bool
        Whether the file is given twice.
    """

    name: str
    text: str
    expected: str = SAME
    reason: str = ""
    finding: tuple[str, ...] = ()
    less: Sheet | None = None
    twice: bool = False


def _rows(run: str) -> np.ndarray:
    return np.flatnonzero(np.array(clean().cells("run")) == run)


def _with(sheet: Sheet, name: str, places: list[int], values: list[str]) -> Sheet:
    cells = list(sheet.cells(name))
    for place, value in zip(places, values, strict=True):
        cells[place] = value
    return sheet.put(name, cells)


def _without(places: list[int]) -> Sheet:
    kept = np.ones(len(clean()), bool)
    kept[places] = False
    return clean().taken(kept)


VALUES: dict[str, Callable[[str, str], str]] = {
    "0": lambda name, cell: "0",
    "full scale": lambda name, cell: FULL_SCALE[name],
    "the wrong sign": lambda name, cell: cell[1:] if cell.startswith("-") else "-" + cell,
    "85": lambda name, cell: "85",
    "-127": lambda name, cell: "-127",
    "1e30": lambda name, cell: "1e30",
    "-999": lambda name, cell: "-999",
    "9999": lambda name, cell: "9999",
    "NaN": lambda name, cell: "NaN",
    "inf": lambda name, cell: "inf",
    "-1.#IND": lambda name, cell: "-1.#IND",
    "1.#INF": lambda name, cell: "1.#INF",
    "ovf": lambda name, cell: "ovf",
    "#N/A": lambda name, cell: "#N/A",
    "OVERLOAD": lambda name, cell: "OVERLOAD",
    "---": lambda name, cell: "---",
    "nothing": lambda name, cell: "",
    "a blank": lambda name, cell: " ",
    "two decimal points": lambda name, cell: f"{cell}.5" if "." in cell else f"{cell}.5.5",
    "a digit that is a letter": lambda name, cell: cell[:-1] + "O",
    "a lost decimal point": lambda name, cell: (
        cell.replace(".", "") + ("" if "." in cell else "00")
    ),
    "ten times too much": lambda name, cell: f"{10 * float(cell):.9g}",
    "bit 14 turned": lambda name, cell: _flipped(name, cell),
    "a NUL in the cell": lambda name, cell: cell[:1] + "\0" + cell[1:],
    "two cells run together": lambda name, cell: cell + cell,
}
"""Contents of a damaged cell."""


NEEDED = ("time_s", "torque_Nm", "input_angle_rad", "output_angle_rad")
"""Columns without which a row cannot be used."""

BELOW_NOISE = {("input_angle_rad", "bit 14 turned"), ("output_angle_rad", "bit 14 turned")}
"""Faults that cannot be detected: 34 arcsec at one sample are ten standard deviations of the noise
there, and estimated torques of motor drives reach the same. The answer must still be correct."""


def _flipped(name: str, cell: str) -> str:
    count = LEAST_COUNT[name]
    return f"{(round(float(cell) / count) ^ 1 << 14) * count:.9g}"


def _spelling(name: str) -> str:
    others = {"run": "|line", "input_angle_rad": "|lost_motion", "output_angle_rad": "|lost_motion"}
    return name.rsplit("_", 1)[0] + others.get(name, "")


def cell_faults(name: str) -> list[Fault]:
    """Faults of one cell of a column."""
    run = RUN_OF[name]
    place = int(_rows(run)[PLACE])
    cell = clean().cells(name)[place]
    faults = []
    for what, value in VALUES.items():
        damaged = _with(clean(), name, [place], [value(name, cell)])
        seen = () if (name, what) in BELOW_NOISE else (_spelling(name), run)
        less = _without([place]) if name in NEEDED else None
        faults.append(Fault(f"{name}: {what}", damaged.text(), finding=seen, less=less))
    return faults


def stretch_faults(name: str) -> list[Fault]:
    """Faults of several cells of a column."""
    run = RUN_OF[name]
    rows = [int(i) for i in _rows(run)]
    at = rows[PLACE]
    cells = clean().cells(name)
    found = (_spelling(name), run)
    # Another label at the end of a run is a separate run: the file contains no further information.
    found_at_end = () if name == "run" else found
    chance = np.random.default_rng(31)
    burst = rows[PLACE : PLACE + 5]
    span = np.ptp(clean().values(name)) or 1.0
    wild = [f"{value:.6g}" for value in 30 * span * chance.uniform(-1, 1, len(burst))]
    held = rows[40 : 40 + STUCK]
    other = int(_rows("19")[PLACE])
    large = f"{1e3 * max(1.0, float(cells[at])):.6g}"
    faults = [
        Fault(
            f"{name}: a burst of five wild values",
            _with(clean(), name, burst, wild).text(),
            finding=found,
            less=_without(burst),
        ),
        Fault(
            f"{name}: stuck for {STUCK} samples",
            _with(clean(), name, held, [cells[held[0]]] * STUCK).text(),
            finding=found if name in ("torque_Nm", "output_angle_rad") else (),
            less=_without(held),
        ),
        Fault(
            f"{name}: full scale for {LONG} samples",
            _with(clean(), name, held[:LONG], [FULL_SCALE[name]] * LONG).text(),
            finding=found,
            less=_without(held[:LONG]),
        ),
        Fault(
            f"{name}: a stale value, once",
            _with(clean(), name, [at], [cells[at - 1]]).text(),
            finding=found if name == "torque_Nm" else (),
            less=_without([at]),
        ),
        Fault(
            f"{name}: missing for {STUCK // 2} samples",
            _with(clean(), name, held[: STUCK // 2], [""] * (STUCK // 2)).text(),
            finding=found,
            less=_without(held[: STUCK // 2]),
        ),
        Fault(
            f"{name}: the first sample of a run is wild",
            _with(clean(), name, rows[:1], [large]).text(),
            finding=found_at_end,
            less=_without(rows[:1]),
        ),
        Fault(
            f"{name}: the last sample of a run is wild",
            _with(clean(), name, rows[-1:], [large]).text(),
            finding=found_at_end,
            less=_without(rows[-1:]),
        ),
        Fault(
            f"{name}: the first sample of the file is wild",
            _with(clean(), name, [0], [large]).text(),
            finding=found_at_end[:1],
            less=_without([0]),
        ),
        Fault(
            f"{name}: wild in two runs",
            _with(clean(), name, [at, other], [large, large]).text(),
            finding=found,
            less=_without([at, other]),
        ),
        Fault(
            f"{name}: every twentieth sample of a run is 0",
            _with(clean(), name, rows[10::20], ["0"] * len(rows[10::20])).text(),
            finding=found,
            less=_without(rows[10::20]),
        ),
    ]
    return faults


# --- faults of lines -----------------------------------------------------------------------------


def _lines() -> list[str]:
    return clean().text().splitlines()


def _joined(lines: list[str]) -> str:
    return "\n".join(lines) + "\n"


def line_faults() -> list[Fault]:
    """Faults of lines, of the clock, and of the file as a whole."""
    rows = [int(i) for i in _rows("14")]
    at = rows[PLACE]
    line = at + 1  # below the names
    head, whole = _lines()[0], _lines()
    faults: list[Fault] = []

    def add(
        name: str,
        lines: list[str] | str,
        *finding: str,
        less: list[int] | None = None,
        expected: str = SAME,
        reason: str = "",
        twice: bool = False,
    ) -> None:
        text = lines if isinstance(lines, str) else _joined(lines)
        kept = None if less is None else _without(less)
        faults.append(Fault(name, text, expected, reason, finding, kept, twice))

    def put(*new: str, drop: int = 0) -> list[str]:
        return [*whole[:line], *new, *whole[line + drop :]]

    add("a row twice", put(whole[line]), "time|row", "14")
    add("twenty rows twice", put(*whole[line - 20 : line]), "time|row", "14")
    add("two rows swapped", put(whole[line + 1], whole[line], drop=2), "time", "14")
    add("thirty rows missing", put(drop=30), less=rows[PLACE : PLACE + 30])
    add("a line torn in the middle", put(whole[line][:17], drop=1), "fields|line|torn", less=[at])
    add(
        "a line torn within its last number",
        put(whole[line][:-2], drop=1),
        "fields|line|torn",
        less=[at],
        expected=EITHER,
        reason="a row without its last cells, or of another meaning",
    )
    add("the last line torn", _joined(whole)[:-30], "fields|line|torn", less=[len(clean()) - 1])
    add(
        "a line end lost: two rows in one line",
        put(whole[line] + whole[line + 1], drop=2),
        "fields|line|torn",
        less=[at, at + 1],
    )
    add(
        "a line begun within another",
        put(whole[line][:20] + whole[line + 1], drop=2),
        "fields|line|torn",
        less=[at, at + 1],
    )
    add("text of the logger between two rows", put("ESP_ERROR: brownout detected"), "line|text")
    add("a comment between two rows", put("# paused"))
    add("a line with commas between two rows", put("WARN,adc,timeout,3,retry,,"), "line|text|row")
    add("blank lines between rows", put("", "", ""))
    add("lines of blanks and of commas between rows", put("   ", ",,,,,,"))
    add("the names in the middle", put(head))
    add("preamble and names in the middle", put("Logger 3000 start", "", head))
    add("a comma more behind one row", put(whole[line] + ",", drop=1))
    add("a cell more in one row", put(whole[line] + ",17", drop=1), "fields|line|cell", less=[at])
    add(
        "a cell lost in one row",
        put(whole[line].replace(",", "", 1), drop=1),
        "fields|line|cell",
        less=[at],
    )
    add("four thousand NULs between two rows", put("\0" * 4096), "NUL|line|bytes")
    add(
        "NULs in the place of the end of a row",
        put(whole[line][:25] + "\0" * 50, drop=1),
        "NUL|line|fields|torn",
        less=[at],
    )
    add(
        "bytes that are no text in one row",
        put(whole[line][:12] + "\ufffd\u0007\u001b" + whole[line][15:], drop=1),
        "line|fields|torque|text",
        less=[at],
    )
    add(
        "a quote that is never closed",
        put('"' + whole[line], drop=1),
        expected=EITHER,
        reason="the rest of the file is one cell: refused, or the row set aside",
    )
    doubled = "the same rows twice: a slip, to be left out or refused"
    again = "twice|duplicate|repeat|again|same|split|identical"
    add(
        "the file twice, without the second header",
        whole + whole[1:],
        again,
        expected=EITHER,
        reason=doubled,
    )
    add(
        "the file twice, with both headers",
        whole + whole,
        again,
        expected=EITHER,
        reason=doubled,
    )
    add("the file given twice", whole, again, twice=True, expected=EITHER, reason=doubled)
    add(
        "a run of three samples more",
        [*whole, *(f"99,{row.split(',', 1)[1]}" for row in whole[line : line + 3])],
    )
    add("a run of one sample of zeros at the end", [*whole, "0,0,0,0,0,0,0"], "run|zero|row|0")

    times = clean().values("time_s")

    def clock(name: str, new: np.ndarray, *finding: str, **how: object) -> None:
        cells = [f"{t:.4f}" for t in new]
        add(name, clean().put("time_s", cells).text(), *finding, **how)  # type: ignore[arg-type]

    after = np.arange(len(times)) >= at
    of_run = np.isin(np.arange(len(times)), rows)
    clock(
        "the clock goes back by an hour (summer time)",
        times - 3600 * (after & of_run),
        "time",
        "14",
    )
    clock("the clock jumps ahead by an hour", times + 3600 * (after & of_run), "time", "14")
    clock("the clock is set by -0.3 s", times - 0.3 * (after & of_run), "time", "14")
    clock(
        "the clock begins anew in a run",
        np.where(after & of_run, times - times[at], times),
        "time",
        "14",
    )
    micro = np.where(of_run, times + 4294.967296 - times[at] + 0.2, times)
    clock(
        "microseconds of 32 bits pass their end",
        np.where(of_run, micro % 4294.967296, times),
        "time",
        "14",
    )
    clock("times rounded to whole seconds", np.round(times), "time")
    clock("times rounded to 0.5 s, some twice", np.round(2 * times) / 2, "time")
    return faults


def lasting_faults() -> list[Fault]:
    """Faults that last: an offset, a marker within the range, saturation, a dead sensor."""
    rows = [int(i) for i in _rows(RUN_OF["torque_Nm"])]
    some = rows[33:43]
    every = rows[3::8]
    torque, temperature = clean().values("torque_Nm"), clean().values("temperature_C")
    most = 0.8 * float(np.max(np.abs(torque[rows])))
    over = [i for i in rows if abs(torque[i]) > most]
    warm = [int(i) for i in _rows(RUN_OF["temperature_C"])]
    faults = []
    for what, name, places, values in (
        ("30 N m too much for 10 samples", "torque_Nm", some, torque[some] + 30.0),
        ("0 for 10 samples", "torque_Nm", some, 0.0 * torque[some]),
        ("every eighth sample of a run is 0", "torque_Nm", every, 0.0 * torque[every]),
        ("cut off at 80 % of its range", "torque_Nm", over, most * np.sign(torque[over])),
        ("0 from the middle of a run on", "temperature_C", warm[60:], 0.0 * temperature[warm[60:]]),
    ):
        damaged = _with(clean(), name, places, [f"{value:.6g}" for value in values])
        less = _without(places) if name in NEEDED else None
        finding = (name.rsplit("_", 1)[0], RUN_OF[name])
        faults.append(Fault(f"{name}: {what}", damaged.text(), finding=finding, less=less))
    for name in ("torque_Nm", "output_angle_rad"):
        cells, first = clean().cells(name), rows[0]
        held = [at for at in rows if (at - first) % HELD]
        damaged = _with(clean(), name, held, [cells[at - (at - first) % HELD] for at in held])
        finding = (name, "repeats", RUN_OF["torque_Nm"])
        what = f"{name}: a run with a new value every {HELD} rows"
        faults.append(Fault(what, damaged.text(), finding=finding, less=_without(held)))
    return faults


def all_faults() -> list[Fault]:
    """Every fault, those of cells first, column by column; replacing zero by zero is not one."""
    faults = []
    for name in clean().names:
        faults += cell_faults(name) + stretch_faults(name)
    faults = [_judged(fault) for fault in faults if fault.text != clean().text()]
    return faults + lasting_faults() + line_faults()


EXPECTED: dict[str, tuple[str, str]] = {
    "run: missing for 30 samples": (
        EITHER, "rows without a run between rows of one run: of that run, or refused"),
}  # fmt: skip
"""Faults whose correct outcome is not the answer of the clean copy, with the reason."""


def _judged(fault: Fault) -> Fault:
    expected, reason = EXPECTED.get(fault.name, (fault.expected, fault.reason))
    return replace(fault, expected=expected, reason=reason)
