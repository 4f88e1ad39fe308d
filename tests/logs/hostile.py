"""Malicious files of up to 5 MB: a result within 10 s and 2 GiB of address space."""

from __future__ import annotations

import gzip
import io
import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

LARGEST_BYTES = 5_000_000
ADDRESSES_BYTES = 2 * 1024**3
PATIENCE_S = 10.0

NAMES = "run,time_s,torque_Nm,lost_motion_rad"

Writer = Callable[[Path], Path]
HOSTILE: dict[str, Writer] = {}


def hostile(name: str, suffix: str = ".csv") -> Callable[[Callable[[], bytes]], Writer]:
    """Add a generator of bytes to the list, with the suffix of its file."""

    def enter(make: Callable[[], bytes]) -> Writer:
        def write(folder: Path) -> Path:
            file = folder / f"log{suffix}"
            content = make()
            assert len(content) <= LARGEST_BYTES, (name, len(content))
            file.write_bytes(content)
            return file

        HOSTILE[name] = write
        return write

    return enter


def _rows(rows: int, run: Callable[[int], str] = lambda i: "1") -> str:
    return "".join(
        f"{run(i)},{0.01 * i:.2f},{10 * np.sin(0.01 * i):.4f},{1e-3 * np.sin(0.01 * i):.7f}\n"
        for i in range(rows)
    )


def _packed(chunk: bytes, times: int, first: bytes = b"") -> bytes:
    """Compress a chunk many times: concatenated gzip files are a gzip file."""
    return gzip.compress(first, mtime=0) + gzip.compress(chunk, mtime=0) * times


# --- text ----------------------------------------------------------------------------------------


@hostile("no byte at all")
def _() -> bytes:
    return b""


@hostile("one byte")
def _() -> bytes:
    return b"7"


for _count in (10**4, 10**5, 5 * 10**5, 10**6):

    def _columns(count: int) -> None:
        @hostile(f"{count} columns without names")
        def _() -> bytes:
            return b"," * count + b"\n" + b"," * count + b"\n"

        if count <= 10**5:

            @hostile(f"{count} columns with names, and those of a recording")
            def _() -> bytes:
                names = ",".join(f"c{i}" for i in range(count))
                rows = "".join(f"1,{i},{i % 7},{i % 7}e-4" + ",1" * count + "\n" for i in range(5))
                return f"{NAMES},{names}\n{rows}".encode()

            @hostile(f"{count} columns of one name")
            def _() -> bytes:
                return (NAMES + ",a" * count + "\n").encode() + b"1,0,1,0\n" * 9

    _columns(_count)


@hostile("10,000 columns and 60 rows")
def _() -> bytes:
    names = ",".join(f"c{i}" for i in range(10_000))
    rows = "".join(f"1,{i},{i % 7},{i % 7}e-4" + ",1" * 10_000 + "\n" for i in range(60))
    return f"{NAMES},{names}\n{rows}".encode()


@hostile("a hundred thousand runs of one sample")
def _() -> bytes:
    return (NAMES + "\n" + _rows(100_000, str)).encode()


@hostile("fifty thousand runs of three samples, by text")
def _() -> bytes:
    return (NAMES + "\n" + _rows(150_000, lambda i: f"r{i // 3}")).encode()[:LARGEST_BYTES]


@hostile("two runs that take turns at every row")
def _() -> bytes:
    return (NAMES + "\n" + _rows(100_000, lambda i: str(i % 2))).encode()


@hostile("a thousand runs that take turns at every row")
def _() -> bytes:
    return (NAMES + "\n" + _rows(100_000, lambda i: str(i % 1000))).encode()


@hostile("one cell of 2 MB of text in the column of runs")
def _() -> bytes:
    return (NAMES + "\n" + _rows(3000)).encode() + b"x" * 2_000_000 + b",99,1,0\n"


@hostile("one cell of 2 MB of digits")
def _() -> bytes:
    return (NAMES + "\n" + _rows(3000)).encode() + b"1,99," + b"1" * 2_000_000 + b",0\n"


@hostile("one cell of 2 MB in an unused column")
def _() -> bytes:
    lines = (NAMES + ",note\n" + _rows(3000).replace("\n", ",\n")).encode()
    return lines + b"1,99,1,0," + b"x" * 2_000_000 + b"\n"


@hostile("a name of 4 MB")
def _() -> bytes:
    return b"n" * 4_000_000 + b"," + NAMES.encode() + b"\n1,1,0,1,0\n"


@hostile("runs with labels of 1000 letters")
def _() -> bytes:
    return (NAMES + "\n" + _rows(4500, lambda i: f"{i:01000d}")).encode()[:LARGEST_BYTES]


@hostile("quotes alone")
def _() -> bytes:
    return b'"' * 4_900_001


@hostile("a quote that is never closed, then 4 MB of rows")
def _() -> bytes:
    return (NAMES + '\n1,0,"1,0\n' + _rows(130_000)).encode()[:LARGEST_BYTES]


@hostile("every cell in three pairs of quotes")
def _() -> bytes:
    row = '"""1""","""0""","""1""","""0"""\n'
    return (NAMES + "\n" + row * 140_000).encode()[:LARGEST_BYTES]


@hostile("commas alone, one line")
def _() -> bytes:
    return b"," * 4_900_000


@hostile("commas alone, many lines")
def _() -> bytes:
    return (b"," * 9 + b"\n") * 490_000


@hostile("blanks alone")
def _() -> bytes:
    return b" " * 4_900_000


@hostile("line ends alone")
def _() -> bytes:
    return b"\n" * 4_900_000


@hostile("carriage returns alone")
def _() -> bytes:
    return b"\r" * 4_900_000


@hostile("line ends between every two rows, names first")
def _() -> bytes:
    return (NAMES + "\n" + _rows(1000)).replace("\n", "\n" * 4000).encode()[:LARGEST_BYTES]


@hostile("comments alone")
def _() -> bytes:
    return b"# nothing\n" * 490_000


@hostile("names, line after line")
def _() -> bytes:
    return (NAMES + "\n").encode() * 130_000


@hostile("one letter a line")
def _() -> bytes:
    return b"a\n" * 2_400_000


@hostile("4 MB of preamble, then a recording")
def _() -> bytes:
    return b"key = value\n" * 340_000 + (NAMES + "\n" + _rows(3000)).encode()


@hostile("random bytes")
def _() -> bytes:
    return np.random.default_rng(1).bytes(4_900_000)


@hostile("random letters, digits and separators")
def _() -> bytes:
    letters = np.frombuffer(b"0123456789.,;\t\n eE+-abcxyz\"'#", np.uint8)
    return np.random.default_rng(2).choice(letters, 4_900_000).tobytes()


@hostile("random UTF-16 with a mark")
def _() -> bytes:
    return b"\xff\xfe" + np.random.default_rng(3).bytes(4_900_000)


@hostile("UTF-16 with half a character at the end")
def _() -> bytes:
    return (NAMES + "\n" + _rows(50_000)).encode("utf-16")[:-1]


@hostile("NULs alone")
def _() -> bytes:
    return bytes(4_900_000)


@hostile("exponents of billions")
def _() -> bytes:
    return (NAMES + "\n" + "1,1e999999999,-1e-999999999,1e2147483648\n" * 100_000).encode()


@hostile("numbers of a thousand digits")
def _() -> bytes:
    return (NAMES + "\n" + f"1,0.{'3' * 1000},{'7' * 1000},0\n" * 2400).encode()


@hostile("times of 1e300 and their negative")
def _() -> bytes:
    return (NAMES + "\n" + "1,1e300,1,0\n1,-1e300,1,0\n" * 100_000).encode()


@hostile("as long a recording as fits, with a duplicate of every row")
def _() -> bytes:
    rows = _rows(70_000).splitlines()
    return (NAMES + "\n" + "\n".join(row for row in rows for _ in (0, 1))).encode()[:LARGEST_BYTES]


@hostile("every row another number of cells")
def _() -> bytes:
    lines = [NAMES] + ["1," * (i % 90) for i in range(50_000)]
    return "\n".join(lines).encode()[:LARGEST_BYTES]


@hostile("every cell another kind of missing")
def _() -> bytes:
    kinds = ("", "nan", "NA", "#N/A", "ovf", "inf", "-", "1.#IND", "null", "x")
    rows = "".join(f"1,{i},{kinds[i % 10]},{kinds[i // 10 % 10]}\n" for i in range(300_000))
    return (NAMES + "\n" + rows).encode()[:LARGEST_BYTES]


@hostile("dates of the year 999999999")
def _() -> bytes:
    return (
        "time,torque_Nm,lost_motion_rad\n" + "999999999-99-99T99:99:99Z,1,0\n" * 100_000
    ).encode()


@hostile("times of day with a thousand colons")
def _() -> bytes:
    return ("time,torque_Nm,lost_motion_rad\n" + "1:" * 1000 + "1,1,0\n" * 100_000).encode()


@hostile("units of a hundred thousand letters")
def _() -> bytes:
    return (f"time_s,torque_{'N_per_' * 100_000}m,lost_motion_rad\n0,1,0\n").encode()


@hostile("a name of brackets within brackets")
def _() -> bytes:
    return ("time_s," + "(" * 2_000_000 + ")" * 2_000_000 + ",lost_motion_rad\n0,1,0\n").encode()


# --- packed --------------------------------------------------------------------------------------


@hostile("gzip of 5 GB of zeros", ".csv.gz")
def _() -> bytes:
    return _packed(bytes(100_000_000), 50)


@hostile("gzip of 3 GB of rows", ".csv.gz")
def _() -> bytes:
    return _packed(b"1,0,1,0\n" * 12_500_000, 15, (NAMES + "\n").encode())


@hostile("gzip of 1 GB of one cell", ".csv.gz")
def _() -> bytes:
    return _packed(b"1" * 100_000_000, 10, (NAMES + "\n1,0,").encode())


@hostile("gzip of gzip", ".csv.gz")
def _() -> bytes:
    return gzip.compress(_packed(bytes(100_000_000), 10))


@hostile("gzip cut in the middle", ".csv.gz")
def _() -> bytes:
    return gzip.compress((NAMES + "\n" + _rows(100_000)).encode())[:400_000]


@hostile("gzip of a hundred thousand empty members", ".csv.gz")
def _() -> bytes:
    return gzip.compress(b"", mtime=0) * 200_000


@hostile("gzip that is none", ".csv.gz")
def _() -> bytes:
    return b"\x1f\x8b" + np.random.default_rng(4).bytes(4_000_000)


def _parquet(table: pa.Table, **how: object) -> bytes:
    memory = io.BytesIO()
    pq.write_table(table, memory, **how)
    return memory.getvalue()


@hostile("Parquet of 100 million zeros", ".parquet")
def _() -> bytes:
    memory = io.BytesIO()
    names = ("time_s", "torque_Nm", "lost_motion_rad")
    zeros = pa.array(np.zeros(10_000_000))
    table = pa.table(dict.fromkeys(names, zeros))
    with pq.ParquetWriter(memory, table.schema, compression="zstd") as writer:
        for _ in range(10):
            writer.write_table(table, row_group_size=10_000_000)
    return memory.getvalue()


@hostile("Parquet with five thousand columns", ".parquet")
def _() -> bytes:
    return _parquet(pa.table({f"c{i}": [1.0] for i in range(5000)}))


@hostile("Parquet with one text of 100 MB", ".parquet")
def _() -> bytes:
    text = "x" * 100_000_000
    table = pa.table({"run": [text], "time_s": [0.0], "torque_Nm": [1.0], "lost_motion_rad": [0.0]})
    return _parquet(table, compression="zstd", use_dictionary=False, write_statistics=False)


@hostile("Parquet cut in the middle", ".parquet")
def _() -> bytes:
    torque = np.random.default_rng(6).random(100_000)
    whole = _parquet(pa.table({"time_s": np.arange(1e5), "torque_Nm": torque}))
    return whole[: len(whole) // 2]


@hostile("Parquet of random bytes between its marks", ".parquet")
def _() -> bytes:
    return b"PAR1" + np.random.default_rng(5).bytes(1_000_000) + b"\xff\xff\x0f\x00PAR1"


@hostile("a zip of 100 MB of zeros under the name .csv")
def _() -> bytes:
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("log.csv", bytes(100_000_000))
    return memory.getvalue()


# --- paths that are not files --------------------------------------------------------------------


def _fifo(folder: Path) -> Path:
    os.mkfifo(folder / "log.csv")
    return folder / "log.csv"


def _zero(folder: Path) -> Path:
    (folder / "log.csv").symlink_to("/dev/zero")
    return folder / "log.csv"


def _loop(folder: Path) -> Path:
    (folder / "log.csv").symlink_to(folder / "log.csv")
    return folder / "log.csv"


def _many(folder: Path) -> Path:
    for i in range(20_000):
        (folder / f"log_{i}.csv").write_text(NAMES + "\n1,0,1,0\n")
    return folder


HOSTILE |= {
    "a named pipe without a writer": _fifo,
    "a link to /dev/zero": _zero,
    "a link to itself": _loop,
    "a folder of twenty thousand files of one row": _many,
}


def evidence(folder: Path) -> Path:
    """Write evidence of a diagnosis (``.npz``) that states an inflated size of 4 GB."""
    file = folder / "one.npz"
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        header, {"descr": "<f8", "fortran_order": False, "shape": (500_000_000,)}
    )
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("gram.npy", header.getvalue() + bytes(100_000_000))
    return file
