"""Compressed files, Parquet, file names."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from .clean import Sheet
from .dress import dress, save


@dress("gzip")
def _(folder: Path, sheet: Sheet) -> Path:
    file = folder / "log.csv.gz"
    file.write_bytes(gzip.compress(sheet.text().encode()))
    return file


@dress("gzip of UTF-16 with semicolons")
def _(folder: Path, sheet: Sheet) -> Path:
    file = folder / "log.csv.gz"
    file.write_bytes(gzip.compress(sheet.text(";", decimal=",").encode("utf-16")))
    return file


@dress("gzip in two members, one behind the other")
def _(folder: Path, sheet: Sheet) -> Path:
    file, text = folder / "log.csv.gz", sheet.text().encode()
    file.write_bytes(gzip.compress(text[:30_000]) + gzip.compress(text[30_000:]))
    return file


for _name in ("log.CSV", "log.txt", "log.dat", "log.asc", "log.log", "log", "log 1 (copy).csv"):

    def _under(name: str) -> None:
        @dress(f"under the name '{name}'")
        def _(folder: Path, sheet: Sheet) -> Path:
            return save(folder, sheet.text(), name)

    _under(_name)


def _table(sheet: Sheet) -> dict[str, object]:
    whole = {"run": np.int64, "cycles": np.int64}
    return {name: sheet.values(name).astype(whole.get(name, np.float64)) for name in sheet.names}


@dress("Parquet")
def _(folder: Path, sheet: Sheet) -> Path:
    pq.write_table(pa.table(_table(sheet)), folder / "log.parquet")
    return folder / "log.parquet"


@dress("Parquet with a stamp of nanoseconds, runs as coded text, small integers")
def _(folder: Path, sheet: Sheet) -> Path:
    table = _table(sheet)
    begin = np.datetime64("2026-03-02T09:13:22", "ns")
    runs = np.array(sheet.cells("run"))
    later = np.unique(runs, return_inverse=True)[1] * 600.0
    steps = np.round(1e9 * (later + sheet.values("time_s"))).astype("timedelta64[ns]")
    del table["time_s"]
    table["time"] = pa.array(begin + steps)
    table["run"] = pa.array(list(sheet.cells("run"))).dictionary_encode()
    table["cycles"] = pa.array(sheet.values("cycles").astype(np.int32))
    pq.write_table(pa.table(table), folder / "log.parquet")
    return folder / "log.parquet"


@dress(
    "Parquet with empty cells and an unused list",
)
def _(folder: Path, sheet: Sheet) -> Path:
    table = _table(sheet)
    table["extra"] = pa.array([[1.0, 2.0]] * len(sheet))
    table["note"] = pa.array([None if i % 2 else "x" for i in range(len(sheet))])
    pq.write_table(pa.table(table), folder / "log.parquet")
    return folder / "log.parquet"
