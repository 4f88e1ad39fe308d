"""A table in memory is read like a file, with the same findings."""

from __future__ import annotations

import datetime
import subprocess
import sys
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

from lostmotion.errors import InputError
from lostmotion.recordings import Campaign, Protocol, read_campaign, say_findings

ROWS = 60
COLUMNS: dict[str, list[Any]] = {
    "run": [1 + i // 30 for i in range(ROWS)],
    "time_s": [0.1 * (i % 30) for i in range(ROWS)],
    "torque_Nm": [float(20 * np.sin(0.3 * i)) for i in range(ROWS)],
    "lost_motion_arcmin": [float(1.5 * np.sin(0.3 * i)) for i in range(ROWS)],
    "temperature_C": [20.0 + i // 30 for i in range(ROWS)],
    "note": ["x"] * ROWS,
}


def as_structured(columns: dict[str, list[Any]]) -> np.ndarray:
    """Make a structured array."""
    kinds = [(name, "U8" if isinstance(v[0], str) else "f8") for name, v in columns.items()]
    return np.array(list(zip(*columns.values(), strict=True)), dtype=kinds)


KINDS: dict[str, Callable[[dict[str, list[Any]]], Any]] = {
    "lists": dict,
    "tuples": lambda c: {name: tuple(values) for name, values in c.items()},
    "arrays": lambda c: {name: np.array(values) for name, values in c.items()},
    "pandas": pd.DataFrame,
    "pandas with an index": lambda c: pd.DataFrame(c).set_index(np.arange(100, 100 + ROWS)),
    "pandas of Arrow": lambda c: pd.DataFrame(c).convert_dtypes(dtype_backend="pyarrow"),
    "pandas of objects": lambda c: pd.DataFrame(c).astype(object),
    "pandas with categories": lambda c: pd.DataFrame(c).astype({"run": "category"}),
    "series": lambda c: {name: pd.Series(values) for name, values in c.items()},
    "polars": pl.DataFrame,
    "polars series": lambda c: {name: pl.Series(values) for name, values in c.items()},
    "Arrow table": pa.table,
    "Arrow batch": pa.RecordBatch.from_pydict,
    "structured": as_structured,
    "double precision": lambda c: {
        name: np.array(v, dtype=np.float64) if name != "note" else v for name, v in c.items()
    },
    "decimals": lambda c: {**c, "torque_Nm": [Decimal(repr(v)) for v in c["torque_Nm"]]},
    "text": lambda c: {**c, "torque_Nm": [repr(v) for v in c["torque_Nm"]]},
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_table_is_read_as_a_file(tmp_path: Path, kind: str) -> None:
    file = tmp_path / "a.csv"
    pd.DataFrame(COLUMNS).to_csv(file, index=False)
    whole = read_campaign(file)
    campaign = Campaign.from_table(KINDS[kind](COLUMNS), name=str(file))
    assert campaign.fingerprint() == whole.fingerprint()
    assert [run.label for run in campaign.runs] == [1, 2]
    assert say_findings(campaign.findings) == say_findings(whole.findings)


@pytest.mark.parametrize("none", [None, float("nan"), np.nan, pd.NA, pd.NaT, "", "NaN", "#N/A"])
@pytest.mark.parametrize("kind", ["lists", "pandas"])
def test_what_is_missing_is_counted(none: object, kind: str) -> None:
    torque: list[Any] = list(COLUMNS["torque_Nm"])
    torque[7] = none
    campaign = Campaign.from_table(KINDS[kind]({**COLUMNS, "torque_Nm": torque}))
    assert campaign.rows == ROWS - 1
    assert [f.count for f in campaign.findings if f.kind == "nan"] == [1]


@pytest.mark.parametrize("kind", ["lists", "pandas", "polars"])
def test_columns_of_date_and_time_are_stamps(kind: str) -> None:
    first = datetime.datetime(2025, 4, 17, 17, 0, 8, 100)
    stamps = [first + datetime.timedelta(milliseconds=100 * i) for i in range(ROWS)]
    columns = {name: values for name, values in COLUMNS.items() if name not in ("run", "time_s")}
    campaign = Campaign.from_table(KINDS[kind]({**columns, "timestamp": stamps}))
    np.testing.assert_array_equal(campaign.column("time"), np.arange(ROWS) * 100 / 1000)


def test_stamps_of_nanoseconds_lose_nothing() -> None:
    ticks = 1_744_700_000_000_000_123 + 1_000_001 * np.arange(ROWS)
    columns = {name: values for name, values in COLUMNS.items() if name not in ("run", "time_s")}
    for stamps in (ticks, ticks.tolist(), ticks.astype("M8[ns]")):
        campaign = Campaign.from_table({**columns, "stamp": stamps}, mapping={"stamp": "time_ns"})
        np.testing.assert_array_equal(campaign.column("time"), (ticks - ticks[0]) / 1e9)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"torque_Nm": [1.0, 2.0]}, "table: torque_Nm: found 2 values, expected 60, as in run"),
        ({"torque_Nm": [[1.0]] * ROWS}, "torque_Nm: found values of type list"),
        ({"torque_Nm": np.zeros((ROWS, 2))}, "torque_Nm: found an array of 2 dimensions"),
        ({"torque_Nm": np.zeros(ROWS, complex)}, "torque_Nm: found complex numbers"),
        ({"torque_Nm": 3.0}, "torque_Nm: found a float, expected a value for every row"),
        ({"torque_Nm": "abc"}, "torque_Nm: found a str, expected a value for every row"),
        ({"torque_Nm": ["x"] * ROWS}, "torque_Nm: found 'x' in row 1, expected a number"),
        ({"torque_Nm": [1.0, [2.0]] * (ROWS // 2)}, "torque_Nm: found a list in row 2"),
        ({"torque_Nm": [1e300] * ROWS}, r"torque_Nm: found 1e\+300 Nm in row 1"),
        ({"run": [1, None] * (ROWS // 2)}, "run: found no label in row 2"),
        ({"torque_kg": [1.0] * ROWS}, "torque_kg: found unit 'kg'"),
    ],
)
def test_what_is_no_table_is_refused(change: dict[str, Any], says: str) -> None:
    columns: dict[str, Any] = {**COLUMNS, **change}
    if "torque_kg" in change:
        del columns["torque_Nm"]
    with pytest.raises(InputError, match=says):
        Campaign.from_table(columns)


@pytest.mark.parametrize("data", [None, 3, "a.csv", [1, 2], np.zeros((3, 3)), object()])
def test_what_has_no_columns_is_refused(data: object) -> None:
    with pytest.raises(InputError, match=r"table: found an? .*, which has no columns, expected"):
        Campaign.from_table(data)


def test_nothing_in_a_table_is_refused() -> None:
    with pytest.raises(InputError, match=r"table: .* no such column"):
        Campaign.from_table({})
    with pytest.raises(InputError, match="table: found no rows"):
        Campaign.from_table({name: [] for name in ("time_s", "torque_Nm", "lost_motion_rad")})


def test_names_twice_in_a_frame_are_refused_where_they_are_used() -> None:
    frame = pd.DataFrame(COLUMNS)
    assert Campaign.from_table(pd.concat([frame, frame[["note"]]], axis=1)).rows == ROWS
    with pytest.raises(InputError, match="torque_Nm: found the column twice"):
        Campaign.from_table(pd.concat([frame, frame[["torque_Nm"]]], axis=1))


def test_ratio_map_and_protocol_count_as_for_files() -> None:
    columns = {
        "t": COLUMNS["time_s"][:30],
        "M": COLUMNS["torque_Nm"][:30],
        "enc": [100 * a for a in COLUMNS["lost_motion_arcmin"][:30]],
    }
    mapping = {"t": "time_s", "M": "torque_Nm", "enc": "-input_angle_arcmin"}
    campaign = Campaign.from_table(
        columns, ratio=100, mapping=mapping, protocol=Protocol("output"), name="bench"
    )
    assert [run.label for run in campaign.runs] == ["bench"]
    with pytest.raises(InputError, match="table: T: found no such column"):
        Campaign.from_table(columns, ratio=100, mapping={"T": "time_s"})


@pytest.mark.parametrize("read", [read_campaign, Campaign.from_table])
def test_channels_in_rows_of_their_own_are_joined_on_request(read: Callable[..., Campaign]) -> None:
    time_s = np.arange(60) * 0.1
    apart = np.where(np.arange(60) % 2 == 0, 1.0, np.nan)
    table = {
        "time_s": time_s,
        "torque_Nm": 10.0 * np.sin(time_s) * apart,
        "lost_motion_arcmin": np.sin(time_s) * apart[::-1],
    }
    with pytest.raises(InputError, match=r"different rows .*--join linear"):
        read(table)
    joined = read(table, join="linear")
    assert joined.rows == 29
    (run,) = joined.runs
    assert run.columns["torque"] == pytest.approx(10.0 * np.sin(run.time_s), abs=0.06)


@pytest.mark.parametrize("home", ["lostmotion", "lostmotion.recordings"])
def test_a_process_that_imports_nothing_else_reads_a_table(home: str) -> None:
    table = "{'time_s': [0, 1, 2], 'torque_Nm': [0, 5, 9], 'lost_motion_rad': [0, 1e-4, 2e-4]}"
    program = f"from {home} import Campaign; print(Campaign.from_table({table}).rows)"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (ran.stdout, ran.returncode) == ("3\n", 0), ran.stderr


@pytest.mark.parametrize("stamp", [1e30, -1e12, 10**15])
def test_a_stamp_beyond_what_a_clock_holds_is_counted(stamp: float) -> None:
    count = 200
    step = 10 * np.arange(count)
    torque = 30 * np.sin(step / 300)
    seconds = (1_700_000_000 + step // 1000).astype(type(stamp))
    seconds[77] = stamp
    columns = {
        "sec": seconds,
        "ms": step % 1000,
        "torque_Nm": torque,
        "input_angle_rad": np.full(count, 0.5),
        "output_angle_rad": 0.005 + torque / 2e4,
    }
    names = {"sec": "time_s", "ms": "time_ms"}
    read = Campaign.from_table(columns, ratio=100, mapping=names)
    assert read.rows == count - 1
    assert [one.count for one in read.findings if "sec" in str(one)] == [1]
