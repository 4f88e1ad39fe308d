"""Damaged inputs through every command: a right answer, or status 2 with one clear line.

Each case takes sound files (a bought drive, a drawn one, a recording), damages one of them or an
option, and runs a command on them. What may come of it:

* status 0: an answer in strict JSON whose numbers are finite and consistent, nothing on standard
  error; where the damage is harmless (another line end, a byte order mark, compression, another
  order of keys, columns or tables), the answer of the sound files;
* status 2: one line on standard error with what was found and what was expected, and nothing
  written: no new file, none changed.

Anything else is a failure: a traceback, a warning, another status, a half-written file, more than
`PATIENCE_S` seconds. A case depends on the seed, its number and the commands that there are, so
that ``damaged_inputs.py --seed 1 --only 4711`` repeats it.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import datetime
import gzip
import hashlib
import io
import itertools
import json
import math
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lostmotion import cli
from lostmotion.drives import format_toml
from lostmotion.errors import InputError
from lostmotion.workbench import bench as workbench

PATIENCE_S = 60.0
"""A command on files this small takes a fraction of a second."""

UNCHANGED = "an output that was there before\n"

SKIPPED = {"demo": "reads no file", "completion": "reads no file", "effects": "reads code"}
"""Commands that are left out, and why."""

OUTPUTS = {"export": "params.h", "fit": "fitted.toml", "design": "run"}
"""What a command must be told to write, by ``-o``."""

FILES = {
    "LOG": "DATA",
    "PLAN": "DATA",
    "OPTIONS": "DATA",
    "SPEC.toml": "SPEC",
}
"""Kinds of files by the names of arguments, where these differ."""

NAMES = {"DRIVE": "drive.toml", "DATA": "data.csv", "SPEC": "spec.toml"}

SEARCH_PATIENCE_S = 3.0
"""A damaged spec may ask for a search of a day: it is interrupted."""

SHARES = {"predict": 6, "clearances": 4, "export": 4, "compare": 2, "replay": 3, "workbench": 2}
"""How often a command is tried; the others once, for they may take a thousand times as long."""

DATA = Path(__file__).parents[1] / "data"


# --- sound files ---------------------------------------------------------------------------------


def bought() -> dict[str, Any]:
    """Harmonic Drive size 25, ratio above 50, with a second way to name a column."""
    return {
        "drive": {"name": "joint 2", "ratio": 100, "rated_torque_Nm": 67},
        "catalogue": {
            "T1_Nm": 14,
            "T2_Nm": 48,
            "K1_Nm_per_rad": 31e3,
            "K2_Nm_per_rad": 50e3,
            "K3_Nm_per_rad": 57e3,
            "hysteresis_arcmin": 1,
            "lost_motion_arcmin": 1,
        },
    }


def drawn() -> dict[str, Any]:
    """Reference design A with one member in each chain."""
    return {
        "drive": {"name": "joint 3", "ratio": 100, "rated_torque_Nm": 40},
        "design": {
            "friction_angle_deg": 5.7,
            "axial_sections": 1,
            "teeth": {
                "deformation": "internal",
                "module_mm": 0.25,
                "flexspline_teeth": 200,
                "rigid_teeth": 202,
                "pressure_angle_deg": 20,
                "flexspline_shift": 3.0,
                "rigid_shift": 2.957,
                "tooth_height": 1.75,
                "engagement_depth": 1.2,
                "root_clearance": 0.35,
                "face_width_mm": 10,
            },
            "generator": {"type": "discs", "deflection_mm": 0.2375, "contact_half_angle_deg": 30},
            "flexspline": {"rim_thickness_mm": 0.6, "wall_thickness_mm": 0.35, "length_mm": 25},
            "material": {"youngs_modulus_GPa": 210, "poisson_ratio": 0.3},
            "support": {"foundation_N_per_mm2": 2600},
            "gap": {"generator_um": 2},
            "radial_chain": [
                {"kind": "ball", "ball_diameter_mm": 4, "balls": 21},
                {"kind": "ring", "mean_radius_mm": 29, "thickness_mm": 5, "width_mm": 10},
            ],
            "torsion_chain": [
                {"kind": "shaft", "outer_diameter_mm": 25, "length_mm": 40, "at": "output"},
                {"kind": "stiffness", "stiffness_Nm_per_rad": 4.48e4},
            ],
            "tolerance": [
                {"kind": "hole", "zone": "generator", "lower_um": 0, "upper_um": 5},
                {"kind": "shaft", "zone": "generator", "it_grade": 5, "nominal_mm": 36},
                {
                    "kind": "link",
                    "zone": "teeth",
                    "influence": 1.374,
                    "lower_um": -1,
                    "upper_um": 1,
                },
            ],
        },
    }


def spec() -> dict[str, Any]:
    """A search that takes a moment."""
    return {
        "drive": {"rated_torque_Nm": 40},
        "search": {
            "objectives": ["lost_motion", "cost"],
            "seed": 1,
            "evaluations": 60,
            "workers": 1,
            "fixed": {"teeth.module_mm": 0.25, "teeth.face_width_mm": 10},
            "range": {
                "generator.deflection_mm": [0.22, 0.26],
                "generator.type": {"choose": ["discs", "cosine"]},
            },
            "limits": {"safety_factor_min": 1.0},
        },
    }


def sound_file(kind: str, drive: str) -> str:
    """A file before any damage."""
    if kind == "DRIVE":
        return format_toml({"bought": bought, "drawn": drawn}[drive]())
    return format_toml(spec()) if kind == "SPEC" else csv_text(recording())


RUNS, ROWS = 3, 40


def recording() -> list[list[str]]:
    """Three runs of a torque that swings, with friction and a little noise; the header first."""
    noise = random.Random(0)
    table = [["run", "time_s", "torque_Nm", "lost_motion_rad", "temperature_C"]]
    for run in range(RUNS):
        slip = 0.0
        for i in range(ROWS):
            torque = 12.0 * (1 + run) * math.sin(2 * math.pi * i / (ROWS / 2))
            slip = min(max(slip, torque - 2.0), torque + 2.0)
            angle = torque / 31e3 + (slip - torque) * 2e-6 + noise.gauss(0, 2e-6)
            row = (100.0 * run + 0.01 * i, torque, angle, 20 + 5 * run)
            table.append([str(run), *(f"{value:.7g}" for value in row)])
    return table


def csv_text(table: list[list[str]], delimiter: str = ",", end: str = "\n") -> str:
    return end.join(delimiter.join(row) for row in table) + end


# --- cases ---------------------------------------------------------------------------------------


@dataclass
class Case:
    """One command line with its files.

    Attributes
    ----------
    argv : list of str
        The words of the command line.
    damage : str
        What was done, in a few words.
    harmless : bool
        Whether the answer must be that of the sound files.
    """

    argv: list[str]
    damage: str
    harmless: bool = False


@dataclass
class Kitchen:
    """What a case is made from: dice, and the folder that its files go to."""

    dice: random.Random
    folder: Path
    damage: list[str] = field(default_factory=list)

    def note(self, *words: object) -> None:
        self.damage.append(" ".join(str(word) for word in words))

    def file(self, name: str, content: str | bytes) -> Path:
        path = self.folder / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path


NUMBERS: tuple[Any, ...] = (
    0, 1, -1, 2, 0.5, -0.0, 1e-9, -1e-9, 1e-300, 5e-324, 1e300, -1e300, 1.7e308, 1e9, -1e9, 1e15,
    2**31, 2**31 - 1, -(2**31), 2**53, 2**63, -(2**63), 2**64, 10**30, 10**400, 1e-30, 1e30, 1e6,
    math.inf, -math.inf, math.nan, 89.999, 90, 180, 360, 720, 1001, -1001, 1.0000001,
)  # fmt: skip

TEXTS = (
    "", " ", "0", "nan", "1e5", "internal", "discs", "ring", "ball", "hole", "true", "'", '"', "\\",
    "\u0000", "a" * 5000, "\u202e", "\U0001f600", "ä", "torque_Nm", "-torque_Nm", "\n", "%s",
)  # fmt: skip

UNITS = (
    "", "_Nm", "_mm", "_rad", "_deg", "_arcmin", "_um", "_m", "_Nm_per_rad", "_MPa", "_s", "_C",
    "_F", "_K", "_furlong", "_per", "_Nm_per", "_1_per_s", "_mm2", "_mm_mm", "_N_per_mm", "_rev",
    "_kg_m2_per_s2", "_", "__", "_nm", "_NM", "_1", "_mm4_per_mm4_per_mm4", "_rad_per_rad",
)  # fmt: skip


def odd_value(dice: random.Random, old: Any = None) -> Any:
    """Return a value that may well be wrong; now and then one near the old."""
    number = isinstance(old, (int, float)) and not isinstance(old, bool) and abs(old) < 1e300
    if number and dice.random() < 0.35:
        factor = dice.choice([-1, 0, 0.5, 0.9, 0.99, 1.01, 1.1, 2, 10, 1000, 1e-3])
        return int(old * factor) if isinstance(old, int) else old * factor
    return dice.choice(
        [
            lambda: dice.choice(NUMBERS),
            lambda: dice.choice(NUMBERS),
            lambda: dice.choice(TEXTS),
            lambda: dice.choice([True, False]),
            lambda: [],
            lambda: [dice.choice(NUMBERS)] * dice.choice([1, 3, 1000]),
            lambda: {},
            lambda: {"a": {"b": 1}},
            lambda: [{"kind": "ball"}],
            lambda: [[[[]]]],
            lambda: datetime.datetime(2026, 1, 2, 3, 4, 5),
            lambda: datetime.date(2026, 1, 2),
            lambda: datetime.time(3, 4),
        ]
    )()


def tables(document: dict[str, Any]) -> list[dict[str, Any]]:
    """All tables of a document, the document itself first."""
    found = [document]
    for value in document.values():
        for inner in value if isinstance(value, list) else [value]:
            if isinstance(inner, dict):
                found += tables(inner)
    return found


def toml_text(document: dict[str, Any]) -> str:
    """Format a document of any values, as `format_toml`, which does not know all of them."""
    return format_toml(document)


def damage_document(kitchen: Kitchen, document: dict[str, Any]) -> bool:
    """Damage the meaning of a drive file; return whether it should still mean the same."""
    dice = kitchen.dice
    kind = dice.randrange(10)
    table = dice.choice(tables(document))
    keys = list(table)
    key = dice.choice(keys) if keys else "name"
    if kind <= 4:
        table[key] = odd_value(dice, table.get(key))
        kitchen.note("value of", key, "is", repr(table[key])[:60])
    elif kind == 5:
        table.pop(key, None)
        kitchen.note("without", key)
    elif kind == 6:
        stem = key.split("_")[0] if dice.random() < 0.3 else key.rpartition("_")[0] or key
        new = stem + dice.choice(UNITS)
        table[new] = table.pop(key, 1)
        kitchen.note(key, "renamed to", new)
    elif kind == 7:
        extra = dice.choice([key.upper(), key + "x", key[:-1], "ratio", "kind", "é", "a.b", ""])
        table[extra] = odd_value(dice)
        kitchen.note("one key more:", extra)
    elif kind == 8:
        other = dice.choice(tables(document))
        table[key] = copy.deepcopy(other)
        kitchen.note(key, "is a copy of another table")
    else:
        order = list(table.items())
        dice.shuffle(order)
        table.clear()
        table.update(order)
        kitchen.note("another order of keys")
        return True
    return False


def damage_text(kitchen: Kitchen, text: str) -> tuple[bytes, bool]:
    """Damage the bytes of a text file; return them, and whether they should mean the same."""
    dice = kitchen.dice
    raw = text.encode()
    kind = dice.randrange(22)
    place = dice.randrange(len(raw) + 1)
    if kind == 0:
        kitchen.note("random bytes")
        return dice.randbytes(dice.choice([0, 1, 10, 1000, 100_000])), False
    if kind in (1, 2):
        kitchen.note("cut at byte", place)
        return raw[:place], False
    if kind in (3, 4):
        out = bytearray(raw)
        for _ in range(dice.choice([1, 1, 2, 10, 100])):
            out[dice.randrange(len(out))] = dice.randrange(256)
        kitchen.note("bytes changed")
        return bytes(out), False
    if kind == 5:
        kitchen.note("a byte order mark")
        return b"\xef\xbb\xbf" + raw, True
    if kind == 6:
        coding = dice.choice(["utf-16", "utf-16-le", "utf-32", "utf-8-sig", "cp1252", "latin-1"])
        kitchen.note("written in", coding)
        return (text + "# ä\n").encode(coding), False
    if kind == 7:
        kitchen.note("CRLF")
        return raw.replace(b"\n", b"\r\n"), True
    if kind == 8:
        kitchen.note("CR only")
        return raw.replace(b"\n", b"\r"), False
    if kind == 9:
        kitchen.note("empty")
        return dice.choice(
            [b"", b"\n", b" \n\t\n", b"#\n", b"\x00", b"\xff", b"\xef\xbb\xbf"]
        ), False
    if kind == 10:
        lines = raw.split(b"\n")
        lines.insert(dice.randrange(len(lines)), dice.choice(lines))
        kitchen.note("a line twice")
        return b"\n".join(lines), False
    if kind == 11:
        depth = dice.choice([10, 200, 2000, 100_000])
        opening = dice.choice([b"[", b"{a=", b'"', b"a.", b"[["])
        kitchen.note("nested", depth, "deep")
        return raw + b"\nx = " + opening * depth, False
    if kind == 12:
        depth = dice.choice([10, 200, 2000])
        kitchen.note("a closed nest", depth, "deep")
        return raw + b"\nx = " + b"[" * depth + b"]" * depth, False
    if kind == 13:
        kitchen.note("a header of many parts")
        return raw + b"\n[" + b".".join([b"a"] * dice.choice([10, 2000, 20_000])) + b"]\n", False
    if kind == 14:
        kitchen.note("a line of many characters")
        return raw + dice.choice([b"#", b"x = 1", b"1,"]) * dice.choice([10_000, 200_000]), False
    if kind == 15:
        kitchen.note("a number of many digits")
        return raw[:place] + b"9" * dice.choice([20, 400, 5000]) + raw[place:], False
    if kind == 16:
        kitchen.note("NUL at byte", place)
        return raw[:place] + b"\x00" + raw[place:], False
    if kind == 17:
        lines = raw.split(b"\n")
        dice.shuffle(lines)
        kitchen.note("lines shuffled")
        return b"\n".join(lines), False
    if kind == 18:
        kitchen.note("the file twice")
        return raw + raw, False
    if kind == 19:
        kitchen.note("quotes put in")
        return raw[:place] + dice.choice([b'"', b"'", b'"""', b"\\"]) + raw[place:], False
    if kind == 20:
        kitchen.note("no line end at the end")
        return raw.rstrip(b"\n"), True
    lines = raw.split(b"\n")
    del lines[dice.randrange(len(lines))]
    kitchen.note("a line less")
    return b"\n".join(lines), False


def damage_table(kitchen: Kitchen, table: list[list[str]]) -> bool:
    """Damage the cells of a recording; return whether it should still mean the same."""
    dice = kitchen.dice
    width = len(table[0])
    column = dice.randrange(width)
    name = table[0][column]
    row = dice.randrange(1, len(table))
    kind = dice.randrange(15)
    if kind <= 3:
        cell = str(odd_value(dice, 1.0))[:6000]
        rows = dice.choice([[row], range(1, len(table)), range(1, row + 1)])
        for i in rows:
            table[i][column] = cell
        kitchen.note(name, "is", cell[:40].encode("ascii", "backslashreplace").decode(), "in rows")
    elif kind == 4:
        for line in table:
            del line[column]
        kitchen.note("without", name)
    elif kind in (5, 6):
        table[0][column] = name.rpartition("_")[0] + dice.choice(UNITS) if column else "run_s"
        kitchen.note(name, "renamed to", table[0][column])
    elif kind == 7:
        table[0][column] = dice.choice([*table[0], "", " ", "x" * 200_000, name.upper(), "é"])
        kitchen.note(name, "renamed to", table[0][column][:30])
    elif kind == 8:
        count = dice.choice([1, -1, 3])
        table[row] = table[row][:count] if count < 0 else table[row] + ["1"] * count
        kitchen.note("another number of fields in row", row)
    elif kind == 9:
        power = dice.choice([5, 12, 20, 150, 300, -20, -300])
        for line in table[1:]:
            line[column] += f"e{power}"
        kitchen.note(name, "times 10 to the", power)
    elif kind == 10:
        del table[dice.choice([1, 2, 3, 5]) :]
        kitchen.note(len(table) - 1, "rows")
    elif kind == 11:
        rows = table[1:]
        dice.shuffle(rows)
        table[1:] = rows
        kitchen.note("rows shuffled")
    elif kind == 12:
        order = list(range(width))
        dice.shuffle(order)
        table[:] = [[line[i] for i in order] for line in table]
        kitchen.note("another order of columns")
        return True
    elif kind == 13:
        for line in table[1:]:
            line[column] = line[column].replace(".", ",")
        kitchen.note("decimal commas in", name)
    else:
        for line in table[1:]:
            line[column] = f' "{line[column]}"' if dice.random() < 0.3 else f" {line[column]} "
        kitchen.note("blanks or quotes round", name)
    return False


def parquet_bytes(kitchen: Kitchen, table: list[list[str]]) -> tuple[bytes, bool]:
    """Write a recording as Parquet, sound or with wrong types."""
    import pyarrow
    import pyarrow.parquet

    dice = kitchen.dice
    columns: dict[str, Any] = {}
    for i, name in enumerate(table[0]):
        values = [row[i] for row in table[1:]]
        columns[name] = pyarrow.array(
            [int(v) for v in values] if name == "run" else [float(v) for v in values]
        )
    harmless = True
    if dice.random() < 0.7:
        name = dice.choice(table[0])
        rows = len(table) - 1
        make: Callable[[], Any] = dice.choice(
            [
                lambda: pyarrow.array([[1.0]] * rows),
                lambda: pyarrow.array([{"a": 1}] * rows),
                lambda: pyarrow.array(["x"] * rows),
                lambda: pyarrow.array(["1"] * rows),
                lambda: pyarrow.array([b"\xff"] * rows),
                lambda: pyarrow.array([None] * rows),
                lambda: pyarrow.array([None] * rows, pyarrow.float64()),
                lambda: pyarrow.array([None, *[1] * (rows - 1)], pyarrow.int64()),
                lambda: pyarrow.array([True] * rows),
                lambda: pyarrow.array([2**63] * rows, pyarrow.uint64()),
                lambda: pyarrow.array([datetime.datetime(2026, 1, 2)] * rows),
                lambda: pyarrow.array([datetime.timedelta(seconds=1)] * rows),
                lambda: pyarrow.array(columns[name].to_pylist(), pyarrow.float32()),
                lambda: pyarrow.array([1] * rows, pyarrow.decimal128(10, 2)),
                lambda: columns[name].dictionary_encode(),
                lambda: pyarrow.array([math.nan, math.inf] * (rows // 2)),
                lambda: pyarrow.array([1e300, -1e300] * (rows // 2)),
            ]
        )
        columns[name] = make()
        harmless = False
        kitchen.note(name, "is", columns[name].type)
    names = list(columns)
    arrays = list(columns.values())
    if dice.random() < 0.1:
        names[-1] = names[0]
        harmless = False
        kitchen.note("the column", names[0], "twice")
    arrow = pyarrow.table(arrays, names=names)
    if dice.random() < 0.1:
        arrow = arrow.slice(0, dice.choice([0, 1]))
        harmless = False
        kitchen.note(arrow.num_rows, "rows")
    if dice.random() < 0.05:
        arrow = arrow.select([])
        harmless = False
        kitchen.note("no columns")
    buffer = io.BytesIO()
    pyarrow.parquet.write_table(arrow, buffer)
    return buffer.getvalue(), harmless


def make_recording(kitchen: Kitchen) -> tuple[Path, bool]:
    """Write a recording, damaged in its meaning, its text or its packing."""
    dice = kitchen.dice
    table = recording()
    kind = dice.randrange(10)
    if kind <= 3:
        harmless = damage_table(kitchen, table)
        return kitchen.file("data.csv", csv_text(table)), harmless
    if kind <= 6:
        raw, harmless = damage_text(kitchen, csv_text(table))
        return kitchen.file("data.csv", raw), harmless
    if kind == 7:
        delimiter = dice.choice(";\t|: ")
        kitchen.note("fields separated by", repr(delimiter))
        return kitchen.file("data.csv", csv_text(table, delimiter)), delimiter in ";\t"
    if kind == 8:
        raw = gzip.compress(csv_text(table).encode(), mtime=0)
        choice = dice.randrange(5)
        if choice == 0:
            place = dice.randrange(len(raw))
            kitchen.note("gzip cut at byte", place)
            return kitchen.file("data.csv.gz", raw[:place]), False
        if choice == 1:
            out = bytearray(raw)
            out[dice.randrange(len(out))] ^= 1 << dice.randrange(8)
            kitchen.note("a bit of a gzip turned")
            return kitchen.file("data.csv.gz", bytes(out)), False
        if choice == 2:
            kitchen.note("gzip with something behind it")
            return kitchen.file("data.csv.gz", raw + dice.randbytes(20)), False
        if choice == 3:
            kitchen.note("a gzip that is none")
            return kitchen.file("data.csv.gz", csv_text(table)), False
        kitchen.note("gzip")
        return kitchen.file("data.csv.gz", raw), True
    raw, harmless = parquet_bytes(kitchen, table)
    choice = dice.randrange(4)
    if choice == 0:
        place = dice.randrange(len(raw))
        kitchen.note("Parquet cut at byte", place)
        return kitchen.file("data.parquet", raw[:place]), False
    if choice == 1:
        out = bytearray(raw)
        for _ in range(dice.choice([1, 5, 50])):
            out[dice.randrange(len(out))] = dice.randrange(256)
        kitchen.note("bytes of a Parquet file changed")
        return kitchen.file("data.parquet", bytes(out)), False
    if choice == 2:
        kitchen.note("Parquet under a CSV's name")
        return kitchen.file("data.csv", raw), False
    kitchen.note("Parquet")
    return kitchen.file("data.parquet", raw), harmless


def make_toml(kitchen: Kitchen, name: str, document: dict[str, Any]) -> tuple[Path, bool]:
    """Write a drive file or a spec, damaged in its meaning or its text."""
    if kitchen.dice.random() < 0.6:
        harmless = damage_document(kitchen, document)
        if not harmless and kitchen.dice.random() < 0.2:
            damage_document(kitchen, document)
        return kitchen.file(name, format_toml(document)), harmless
    raw, harmless = damage_text(kitchen, format_toml(document))
    return kitchen.file(name, raw), harmless


def odd_path(kitchen: Kitchen, suffix: str) -> str:
    """Return a path that is no sound file."""
    dice, folder = kitchen.dice, kitchen.folder
    choice = dice.randrange(12)
    if choice == 0:
        path = folder / f"folder{suffix}"
        path.mkdir()
    elif choice == 1:
        path = folder / f"loop{suffix}"
        path.symlink_to(path)
    elif choice == 2:
        path = folder / f"dangling{suffix}"
        path.symlink_to(folder / "nowhere")
    elif choice == 3:
        path = folder / ("n" * 300 + suffix)
    elif choice == 4:
        kitchen.note("a path with NUL")
        return f"{folder}/a\0{suffix}"
    elif choice == 5:
        path = folder / "file" / f"below{suffix}"
        (folder / "file").write_text("")
    elif choice == 6:
        kitchen.note("an empty path")
        return ""
    elif choice == 7:
        path = Path(os.devnull)
    elif choice == 8:
        path = folder / f"unreadable{suffix}"
        path.write_text("")
        path.chmod(0)
    elif choice == 9:
        path = folder / f"in\udcffvalid{suffix}"
        if dice.random() < 0.5:
            path.write_text("x")
    elif choice == 10:
        path = folder / f"two\nlines{suffix}"
    else:
        path = folder / f"none{suffix}"
    kitchen.note("path", repr(str(path.name))[:60])
    return str(path)


def odd_option(kitchen: Kitchen, command: str) -> list[str]:
    """Return an option with a value that may well be wrong."""
    dice = kitchen.dice
    numbers = [str(odd_value(dice, 1.0))[:50].replace("\0", "") for _ in range(3)]
    options = {
        "--torque": [
            ":".join(numbers[:2]) + f":{dice.choice([0, 1, 2, 33, 1026, -1, 'x', '1e3'])}"
        ],
        "--phase-deg": [numbers[0]],
        "--angles-deg": [",".join(numbers), ",".join(["1"] * 5000), ","],
        "--seed": [str(dice.choice([-1, 0, 2**32, 2**64, 10**400, "x", 1.5]))],
        "--map": [
            dice.choice(["torque_Nm", "run", "x", "", "time_s"])
            + dice.choice(["=", "", "=="])
            + dice.choice(["torque_Nm", "-torque_kNm", "lost_motion", "run", "x_Nm", "", "time_h"])
        ],
        "--json": [str(kitchen.folder / "none" / "a.json"), str(kitchen.folder), "", "a\0b", "/"],
        "--report": [str(kitchen.folder / "none" / "a.html"), str(kitchen.folder), "", "a\0b", "/"],
        "--nonsense": [""],
    }
    known = {word for action in commands()[command]._actions for word in action.option_strings} | {
        "--nonsense"
    }
    option = dice.choice(sorted(known & set(options)))
    value = dice.choice(options[option])
    kitchen.note("option", option, repr(value)[:60])
    return [f"{option}={value}"] if option != "--nonsense" else [option]


def commands() -> dict[str, argparse.ArgumentParser]:
    """All commands by name."""
    for action in cli.make_parser()._actions:
        if isinstance(action, argparse._SubParsersAction):
            return dict(action.choices)
    raise AssertionError("the parser has no commands")


def command_files(command: str) -> list[str]:
    """Kinds of files that a command is given, by the names of its arguments."""
    if command == "workbench":
        return ["DRIVE", "DATA"]
    return [
        FILES.get(str(action.metavar), str(action.metavar))
        for action in commands()[command]._actions
        if (not action.option_strings and action.nargs not in ("?", "*"))
        or (action.required and action.dest != "output")
    ]


def written(command: str, files: list[str]) -> list[str]:
    """Words of a command line that name its files; options where it wants options."""
    required = [a for a in commands()[command]._actions if a.option_strings and a.required]
    options = [a.option_strings[0] for a in required if a.dest != "output"]
    first = len(files) - len(options)
    words = list(files[:first])
    for option, file in zip(options, files[first:], strict=True):
        words.append(f"{option}={file}")
    return words


def testable() -> list[str]:
    """Commands that need a drive file, recordings, a place to write to, and nothing else."""
    found = []
    for name, parser in commands().items():
        kinds = command_files(name)
        needed = {a.dest for a in parser._actions if a.required and a.dest == "output"}
        if needed and name not in OUTPUTS:
            continue
        if name not in SKIPPED and kinds and set(kinds) <= set(NAMES):
            found.append(name)
    return found


@dataclass(frozen=True)
class Sound:
    """The files and the answer of a command that is given nothing damaged."""

    argv: tuple[str, ...]
    answer: dict[str, Any]


def drive_kinds(command: str) -> tuple[str, ...]:
    """Kinds of drives that a command takes."""
    return ("drawn",) if command == "clearances" else ("bought", "drawn")


def make_case(seed: int, number: int, folder: Path) -> tuple[Case, str, str]:
    """Make a case; return it with its command and its kind of drive."""
    kitchen = Kitchen(random.Random(f"{seed}:{number}"), folder)
    dice = kitchen.dice
    names = testable()
    command = dice.choices(names, [SHARES.get(name, 1) for name in names])[0]
    kind = dice.choice(drive_kinds(command))
    document = {"bought": bought, "drawn": drawn}[kind]()
    kinds = command_files(command)
    target = dice.choice([*kinds, *kinds, *kinds, "option", "path"])
    harmless = target in kinds
    words, options = [command], ["--json", str(folder / "answer.json")]
    odd = dice.choice(kinds) if target == "path" else ""
    files = []
    for place, file in enumerate(kinds):
        name = NAMES[file]
        if kinds.index(file) != place:  # a second one, as of `next`
            files.append(str(kitchen.file(f"more_{name}", sound_file(file, kind))))
        elif file == odd:
            files.append(odd_path(kitchen, Path(name).suffix))
        elif file == target and file == "DATA":
            path, harmless = make_recording(kitchen)
            files.append(str(path))
        elif file == target:
            path, harmless = make_toml(kitchen, name, document if file == "DRIVE" else spec())
            files.append(str(path))
        else:
            files.append(str(kitchen.file(name, sound_file(file, kind))))
    words += written(command, files)
    if command in OUTPUTS:
        options += ["-o", str(folder / OUTPUTS[command])]
    if target == "option":
        options += odd_option(kitchen, command)
    elif dice.random() < 0.02 and "--report" in commands()[command].format_help():
        options += ["--report", str(folder / "report.html")]
    if dice.random() < 0.5:
        # What was there must stay as it is when the command refuses its input.
        for option in ("answer.json", "report.html", "params.h", "fitted.toml"):
            kitchen.file(option, UNCHANGED)
    return Case([*words, *options], "; ".join(kitchen.damage), harmless), command, kind


# --- judgement -----------------------------------------------------------------------------------


class Impatience(Exception):
    """A command took too long."""


@dataclass
class Outcome:
    """What a command did."""

    status: int | str
    error: str
    warnings: list[str]
    trace: str = ""


def run_here(argv: list[str]) -> Outcome:
    """Run a command in this process."""
    out, error = io.StringIO(), io.StringIO()

    def too_long(*_: object) -> None:
        raise KeyboardInterrupt if argv[0] == "design" else Impatience

    old = signal.signal(signal.SIGALRM, too_long)
    patience = SEARCH_PATIENCE_S if argv[0] == "design" else PATIENCE_S
    signal.setitimer(signal.ITIMER_REAL, patience)
    try:
        with (
            warnings.catch_warnings(record=True) as caught,
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(error),
        ):
            warnings.simplefilter("always")
            try:
                status: int | str = load_bench(argv) if argv[0] == "workbench" else cli.main(argv)
                trace = ""
            except BaseException as failure:
                if isinstance(failure, KeyboardInterrupt):
                    raise
                status, trace = type(failure).__name__, traceback.format_exc()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, old)
    said = [f"{w.category.__name__}: {w.message} ({w.filename}:{w.lineno})" for w in caught]
    return Outcome(status, error.getvalue(), said, trace)


def load_bench(argv: list[str]) -> int:
    """Load a drive and recordings as the workbench does, and say what it would say."""
    drive, data, _, answer, *rest = argv[1:]
    if rest:
        return cli.main([*argv, "--port=x"])  # an option: it ends before any page is shown
    bench = workbench.Bench()
    try:
        bench.load_drive(drive)
        bench.load_recordings([data], [], lambda done, steps: None)
        assert bench.comparison is not None
        Path(answer).write_text(json.dumps(bench.comparison.answer(), allow_nan=False))
    except InputError as error:
        print(f"lostmotion: {error}", file=sys.stderr)
        return 2
    finally:
        bench.close()
    return 0


def run_process(argv: list[str]) -> Outcome:
    """Run a command as a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", "lostmotion", *argv],
        capture_output=True,
        timeout=PATIENCE_S,
        check=False,
    )
    return Outcome(done.returncode, done.stderr.decode("utf-8", "replace"), [])


def snapshot(folder: Path) -> dict[str, str]:
    """Names and contents of everything in a folder."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder)).encode("utf-8", "surrogateescape").hex()
        if path.is_file() and not path.is_symlink():
            with contextlib.suppress(OSError):
                found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
                continue
        found[name] = "other"
    return found


def finite(value: Any) -> bool:
    """Whether all numbers of an answer are finite (JSON itself allows nothing else)."""
    if isinstance(value, dict):
        return all(finite(inner) for inner in value.values())
    if isinstance(value, list):
        return all(finite(inner) for inner in value)
    return not isinstance(value, float) or math.isfinite(value)


def refuse_constant(name: str) -> Any:
    raise ValueError(f"{name} in an answer")


def read_answer(text: str) -> dict[str, Any]:
    """Read strict JSON: no NaN, no Infinity."""
    answer: dict[str, Any] = json.loads(text, parse_constant=refuse_constant)
    return answer


def judge_prediction(answer: dict[str, Any]) -> str:
    total = answer["total_arcmin"]
    if None in total:
        return "no number in the total"
    for i, whole in enumerate(total):
        parts = [part[i] for part in answer["parts_arcmin"].values()]
        largest = max(1e-9, *(abs(part) for part in parts))
        if abs(sum(parts) - whole) > 1e-9 * largest:
            return f"parts {parts} do not add up to {whole}"
    slack = 1e-9 * max(1e-9, *(abs(value) for value in total))
    if any(b < a - slack for a, b in itertools.pairwise(total)):
        return "the characteristic falls"
    return ""


def judge_clearances(answer: dict[str, Any]) -> str:
    for forward, backward, overlap in zip(
        answer["forward_arcmin"], answer["backward_arcmin"], answer["overlap"], strict=True
    ):
        if overlap != (forward is not None or backward is not None):
            return "overlap does not agree with the clearances"
    return ""


def judge_comparison(answer: dict[str, Any]) -> str:
    for name in ("rms_arcsec", "heldout_rms_arcsec", "noise_floor_arcsec"):
        if not answer[name] >= 0:
            return f"{name} is {answer[name]}"
    # Far below 0 where the recordings are of another unit and every fitted value at its bound.
    if not answer["explained_share"] <= 1:
        return f"explained_share is {answer['explained_share']}"
    return ""


JUDGES: dict[str, Callable[[dict[str, Any]], str]] = {
    "predict": judge_prediction,
    "clearances": judge_clearances,
    "compare": judge_comparison,
}


def same(answer: dict[str, Any], sound: dict[str, Any]) -> bool:
    """Whether two answers are the same but for what names files."""

    def bare(value: dict[str, Any]) -> str:
        kept = {key: inner for key, inner in value.items() if key not in ("findings", "folder")}
        return re.sub(r"/[^\"]*/(case\d+|sound)/", "", json.dumps(kept, sort_keys=True))

    return bare(answer) == bare(sound)


def judge(
    case: Case,
    command: str,
    outcome: Outcome,
    before: dict[str, str],
    folder: Path,
    sound: dict[str, Any],
) -> str:
    """Say what is wrong with an outcome; nothing when all is well."""
    if outcome.trace or "Traceback" in outcome.error:
        return (outcome.trace or outcome.error).strip()
    if outcome.warnings:
        return outcome.warnings[0]
    if outcome.status == 2:
        lines = outcome.error.splitlines()
        if len(lines) != 1:
            return f"{len(lines)} lines on standard error: {outcome.error[:300]!r}"
        clear = (": found " in lines[0] and ", expected " in lines[0]) or "--help" in lines[0]
        if not lines[0].startswith("lostmotion") or not clear:
            return f"not a clear line: {lines[0][:300]}"
        if len(lines[0]) > 2000:
            return f"a line of {len(lines[0])} characters: {lines[0][:200]}"
        if not lines[0].isprintable():
            return f"a line that cannot be printed: {lines[0][:200]!r}"
        if snapshot(folder) != before:
            return "status 2, but files were written"
        return "harmless, but refused: " + lines[0] if case.harmless else ""
    if command == "design" and outcome.status in (1, 130):
        # No design is feasible, or the search that the spec asks for takes too long.
        return (
            "" if outcome.error.startswith("lostmotion: ") or outcome.status == 130 else "no line"
        )
    if outcome.status != 0:
        return f"status {outcome.status}: {outcome.error[:300]}"
    if outcome.error:
        return f"status 0 with an error: {outcome.error[:300]}"
    file = folder / "answer.json"
    if not file.is_file():
        return "" if any(word.startswith("--json=") for word in case.argv) else "no answer"
    try:
        answer = read_answer(file.read_text())
        if not finite(answer):
            return "a number that is not finite"
        complaint = JUDGES[command](answer) if command in JUDGES else ""
    except (ValueError, KeyError, TypeError) as error:
        return f"an answer that cannot be understood: {error!r}"
    if complaint:
        return complaint
    return "harmless, but another answer" if case.harmless and not same(answer, sound) else ""


class Bench:
    """Runs cases, each in a folder of its own that is thrown away."""

    def __init__(self, seed: int, root: Path) -> None:
        self.seed = seed
        self.root = root
        self.sound: dict[tuple[str, str], dict[str, Any]] = {}

    def sound_answer(self, command: str, kind: str) -> dict[str, Any]:
        """Answer to the files before any damage."""
        if (command, kind) not in self.sound:
            folder = self.root / "sound"
            folder.mkdir()
            kitchen = Kitchen(random.Random(0), folder)
            words: list[str] = [command]
            files: list[str] = []
            for file in command_files(command):
                files.append(str(kitchen.file(NAMES[file], sound_file(file, kind))))
            words += written(command, files)
            if command in OUTPUTS:
                words += ["-o", str(folder / OUTPUTS[command])]
            outcome = run_here([*words, "--json", str(folder / "answer.json")])
            assert outcome.status == 0, (words, outcome)
            self.sound[command, kind] = read_answer((folder / "answer.json").read_text())
            shutil.rmtree(folder)
        return self.sound[command, kind]

    def run(
        self, number: int, *, process: bool = False, keep: bool = False
    ) -> tuple[Case, str, Any]:
        """Run one case; return it, what is wrong with it, and its status."""
        folder = self.root / f"case{number}"
        folder.mkdir()
        try:
            case, command, kind = make_case(self.seed, number, folder)
            sound = self.sound_answer(command, kind)
            before = snapshot(folder)
            runnable = all("\0" not in word for word in case.argv)
            here = os.getcwd()
            os.chdir(folder)
            try:
                alone = process and runnable and command not in ("design", "workbench")
                outcome = (run_process if alone else run_here)(case.argv)
            finally:
                os.chdir(here)
            return case, judge(case, command, outcome, before, folder, sound), outcome
        finally:
            if not keep:
                shutil.rmtree(folder, ignore_errors=True)


def failures(
    seed: int, numbers: Iterator[int] | range, root: Path, process_every: int = 0
) -> Iterator[tuple[int, Case, str, Outcome]]:
    """Run cases and yield each with what is wrong with it, which is nothing when all is well."""
    bench = Bench(seed, root)
    for number in numbers:
        process = bool(process_every) and number % process_every == 0
        case, wrong, outcome = bench.run(number, process=process)
        yield number, case, wrong, outcome


def main() -> int:
    """Run cases and print what fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="run this case and keep its files")
    parser.add_argument("--process-every", type=int, default=50, help="0: none as a process")
    parser.add_argument("--show", type=int, default=40, help="kinds of failures to show")
    arguments = parser.parse_args()
    root = Path(tempfile.mkdtemp(prefix="damaged-"))
    if arguments.only is not None:
        case, wrong, outcome = Bench(arguments.seed, root).run(arguments.only, keep=True)
        print(f"{case}\n{outcome}\n{wrong or 'all is well'}\nfiles: {root}")
        return int(bool(wrong))
    begin = time.monotonic()
    statuses: Counter[str] = Counter()
    kinds: dict[str, list[tuple[int, Case, str]]] = {}
    numbers = range(arguments.first, arguments.first + arguments.cases)
    for number, case, wrong, outcome in failures(
        arguments.seed, numbers, root, arguments.process_every
    ):
        statuses[f"{case.argv[0]} {outcome.status}"] += 1
        if wrong:
            where = re.findall(r'File ".*/(\w+\.py)", line (\d+)', wrong)
            last = re.sub(r"/\S+|\d+", "*", wrong.splitlines()[-1])[:120]
            kind = f"{last} {':'.join(where[-1]) if where else ''}"
            kinds.setdefault(kind, []).append((number, case, wrong))
    shutil.rmtree(root)
    for kind, cases in sorted(kinds.items(), key=lambda item: -len(item[1]))[: arguments.show]:
        number, case, wrong = cases[0]
        print(f"\n{len(cases)} x {kind}\n  case {number}: {case.argv[0]}, {case.damage[:200]}")
        print("  also", [n for n, _, _ in cases[1:6]])
    failed = sum(len(cases) for cases in kinds.values())
    left_out = sorted(set(commands()) - set(testable()))
    print(f"\nstatuses: {dict(sorted(statuses.items()))}\nnot run: {', '.join(left_out)}")
    print(f"{arguments.cases} cases, {failed} failed, {time.monotonic() - begin:.0f} s")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
