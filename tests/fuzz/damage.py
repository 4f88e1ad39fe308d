"""Ways to damage a file: its values, its text, its compression, its path."""

from __future__ import annotations

import copy
import datetime
import gzip
import io
import json
import math
import os
import random
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from sound_files import csv_text, made, recording

from lostmotion.drives import format_toml


@dataclass
class Kitchen:
    """Inputs of a case: random generator, and folder of its files."""

    dice: random.Random
    folder: Path
    damage: list[str] = field(default_factory=list)

    def note(self, *words: object) -> None:
        self.damage.append(" ".join(str(word) for word in words))

    def file(self, name: str, content: str | bytes) -> Path:
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
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
    """Return a value that is probably wrong; sometimes one near the old value."""
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


def cut(kitchen: Kitchen, raw: bytes) -> bytes:
    """Give the beginning of a file."""
    place = kitchen.dice.randrange(len(raw))
    kitchen.note("cut at byte", place)
    return raw[:place]


def changed(kitchen: Kitchen, raw: bytes, counts: list[int]) -> bytes:
    """Change one of these counts of bytes."""
    out = bytearray(raw)
    for _ in range(kitchen.dice.choice(counts)):
        out[kitchen.dice.randrange(len(out))] = kitchen.dice.randrange(256)
    kitchen.note("bytes changed")
    return bytes(out)


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
        return changed(kitchen, raw, [1, 1, 2, 10, 100]), False
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
            return kitchen.file("data.csv.gz", cut(kitchen, raw)), False
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
        return kitchen.file("data.parquet", cut(kitchen, raw)), False
    if choice == 1:
        return kitchen.file("data.parquet", changed(kitchen, raw, [1, 5, 50])), False
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


def damage_bytes(kitchen: Kitchen, raw: bytes) -> bytes:
    """Damage a file that is no text."""
    dice = kitchen.dice
    kind = dice.randrange(6)
    place = dice.randrange(len(raw))
    if kind == 0:
        kitchen.note("cut at byte", place)
        return raw[:place]
    if kind in (1, 2):
        out = bytearray(raw)
        for _ in range(dice.choice([1, 1, 10, 1000])):
            out[dice.randrange(len(out))] ^= 1 << dice.randrange(8)
        kitchen.note("bits turned")
        return bytes(out)
    if kind == 3:
        kitchen.note("random bytes")
        return dice.randbytes(dice.choice([0, 1, 100, 10_000]))
    if kind == 4:
        kitchen.note("bytes put in at", place)
        return raw[:place] + dice.randbytes(dice.choice([1, 8, 1000])) + raw[place:]
    kitchen.note("bytes removed at", place)
    return raw[:place] + raw[place + dice.choice([1, 8, 1000]) :]


def archive(arrays: dict[str, Any]) -> bytes:
    """Write arrays as an ``.npz`` file."""
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


def foreign_archive(kitchen: Kitchen) -> bytes:
    """Write an archive that is no evidence."""
    dice = kitchen.dice
    out = io.BytesIO()
    kind = dice.randrange(5)
    kitchen.note("a foreign archive")
    if kind == 0:
        with zipfile.ZipFile(out, "w") as packed:
            packed.writestr("readme.txt", "nothing here")
        return out.getvalue()
    if kind == 1:
        np.save(out, np.zeros(3))
        return out.getvalue()
    if kind == 2:
        return archive({"x": np.zeros(3), "names": np.array(["a"])})
    if kind == 3:
        return archive({"schema": np.array("lostmotion.evidence/1"), "gram": np.zeros((1, 2, 2))})
    with zipfile.ZipFile(out, "w") as packed:
        for name in ("schema.npy", "about.npy", "white.npy"):
            packed.writestr(name, dice.randbytes(200))
    return out.getvalue()


def damage_evidence(kitchen: Kitchen, raw: bytes) -> tuple[bytes, bool]:
    """Damage evidence: its bytes, its arrays, or its own description."""
    dice = kitchen.dice
    kind = dice.randrange(12)
    if kind <= 2:
        return damage_bytes(kitchen, raw), False
    if kind == 3:
        return foreign_archive(kitchen), False
    if kind == 4:
        kitchen.note("evidence of another drive")
        return made("evidence", "fitted")["one.npz"], False
    with np.load(io.BytesIO(raw)) as data:
        arrays = {name: data[name] for name in data.files}
    if kind == 5:
        order = list(arrays)
        dice.shuffle(order)
        kitchen.note("another order of arrays")
        return archive({name: arrays[name] for name in order}), True
    if kind in (6, 7):
        about = json.loads(str(arrays["about"]))
        damage_document(kitchen, about)
        text = json.dumps(about, default=str)
        arrays["about"] = np.array(text if dice.random() < 0.9 else text[: len(text) // 2])
        return archive(arrays), False
    name = dice.choice(sorted(arrays))
    old = arrays[name]
    if kind == 8:
        del arrays[name]
        kitchen.note("without", name)
    elif kind == 9 and old.dtype.kind == "f" and old.size:
        new = old.copy()
        worst = [math.nan, math.inf, -math.inf, 1e300, -1e300, 0.0, -1.0, 1e-300]
        value = dice.choice(worst)
        new.flat[slice(None) if dice.random() < 0.5 else dice.randrange(new.size)] = value
        arrays[name] = new
        kitchen.note(value, "in", name)
    elif kind == 9 and old.dtype.kind in "iu" and old.size:
        new = old.copy()
        new.flat[dice.randrange(new.size)] = dice.choice([-1, 0, 1, 10**6, 2**62])
        arrays[name] = new
        kitchen.note("another place in", name)
    else:
        changes: list[Callable[[], Any]] = [
            lambda: np.zeros(0),
            lambda: np.array(0.0),
            lambda: np.array("x"),
            lambda: np.array(["x"] * 3),
            lambda: old[None],
            lambda: old.ravel()[:-1],
            lambda: np.concatenate((old.ravel(), old.ravel())),
            lambda: old[:1] if old.ndim else old,
            lambda: old.astype("U") if old.size < 100 else old > 0,
            lambda: old + 0j if old.dtype.kind in "fiu" else np.array(1),
            lambda: old.astype(np.float32) * 1.0 if old.dtype.kind in "fiu" else np.array(1),
            lambda: np.array([None]),
            lambda: old.T.copy() if old.ndim > 1 else old[::-1] if old.ndim else np.array(-1),
        ]
        arrays[name] = dice.choice(changes)()
        kitchen.note(name, "of another shape or type")
    return archive(arrays), False


def damage_search(kitchen: Kitchen, files: dict[str, bytes]) -> None:
    """Damage the folder of a search that a resumption continues with."""
    dice = kitchen.dice
    name = dice.choice(["journal.bin"] * 6 + sorted(files))
    kind = dice.randrange(7)
    if kind == 0:
        kitchen.note("the folder without", name)
        del files[name]
    elif kind == 1:
        kitchen.note("an empty folder")
        files.clear()
    elif kind == 2:
        kitchen.note("a folder in the place of", name)
        del files[name]
        (kitchen.folder / "run" / name).mkdir(parents=True)
    else:
        kitchen.note("in", name)
        files[name] = damage_bytes(kitchen, files[name])
