"""Samples of recordings: they contain every run and the reversals, and give the same result."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from distributed import LocalCluster
from small_campaigns import DRIVE, campaign, gap

from lostmotion.cli import main
from lostmotion.cluster import connect
from lostmotion.discover import diagnose
from lostmotion.errors import InputError
from lostmotion.recordings import Campaign, Run, read_campaign
from lostmotion.sample import (
    kept_rows,
    read_or_sample,
    recorded_rows,
    run_pieces,
    sample_campaign,
    strides_for,
    thin_campaign,
)

FloatArray = npt.NDArray[np.float64]
RATIO = 100.0


def write(data: Campaign, folder: Path, group_rows: int = 700, *, wrap: bool = False) -> Path:
    """Write a campaign as a folder of Parquet files with small row groups, four runs a file."""
    folder.mkdir()
    for first in range(0, len(data.runs), 4):
        tables = []
        for run in data.runs[first : first + 4]:
            columns = {"run": np.full(len(run), int(run.label), dtype=np.int32)}
            for name, unit in (
                ("time", "time_s"),
                ("torque", "torque_Nm"),
                ("input_angle", "input_angle_rad"),
                ("temperature", "temperature_C"),
                ("lost_motion", "lost_motion_rad"),
            ):
                columns[unit] = run.columns[name]
            if wrap:
                columns["input_angle_rad"] = np.mod(run.columns["input_angle"], 2 * np.pi)
            tables.append(pa.table(columns))
        name = folder / f"part{first:03d}.parquet"
        pq.write_table(pa.concat_tables(tables), name, row_group_size=group_rows)
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(campaign(add=gap, rows=2000), tmp_path_factory.mktemp("large") / "data")


def test_a_sample_without_thinning_is_what_the_reader_reads(folder: Path) -> None:
    whole = read_campaign(folder, ratio=RATIO)
    sampled = sample_campaign([folder], ratio=RATIO, rows=10**9)
    assert [run.label for run in sampled.runs] == [run.label for run in whole.runs]
    for one, two in zip(sampled.runs, whole.runs, strict=True):
        assert one.columns.keys() == two.columns.keys()
        for name in one.columns:
            np.testing.assert_array_equal(one.columns[name], two.columns[name])
    assert sampled.recorded_rows == whole.rows
    assert not [f for f in sampled.findings if f.kind == "sampled"]


def test_a_sample_stays_within_its_rows_and_states_it(folder: Path) -> None:
    sampled = sample_campaign([folder], ratio=RATIO, rows=4000)
    assert len(sampled.runs) == 12
    assert sampled.recorded_rows == 24000
    # Reversals of the torque are added: a few per batch.
    assert 0.9 * 4000 <= sampled.rows < 1.3 * 4000
    (said,) = [f for f in sampled.findings if f.kind == "sampled"]
    assert said.count == 24000


def test_the_sample_of_files_is_that_of_memory(folder: Path) -> None:
    in_memory = thin_campaign(read_campaign(folder, ratio=RATIO), 4000)
    sampled = sample_campaign([folder], ratio=RATIO, rows=4000)
    for one, two in zip(sampled.runs, in_memory.runs, strict=True):
        # Reversals at the end of a piece may be another row of the same torque.
        assert len(one) == pytest.approx(len(two), rel=0.2)
        common = np.isin(two.time_s, one.time_s)
        assert np.mean(common) > 0.95
        assert one.torque_Nm.max() == two.torque_Nm.max()
        assert one.torque_Nm.min() == two.torque_Nm.min()


def test_where_the_torque_turns_is_kept() -> None:
    torque = np.concatenate([np.linspace(a, b, 997) for a, b in ((0, 9), (9, -7), (-7, 3))])
    keep = kept_rows(torque, 0, 100, 0.5)
    assert keep[np.argmax(torque)]
    assert keep[np.argmin(torque)]
    assert np.count_nonzero(keep) < torque.size / 100 + 8
    # Counting continues from the batch before.
    later = kept_rows(torque, 50, 100, 0.0)
    assert np.flatnonzero(later)[0] == 50
    assert kept_rows(torque, 7, 1, 0.5).all()


@pytest.mark.parametrize(
    ("rows", "budget"), [([10, 10, 10], 30), ([5, 1000, 1000], 105), ([10**8], 1000), ([1] * 9, 3)]
)
def test_short_runs_are_whole_and_long_ones_share(rows: list[int], budget: int) -> None:
    strides = strides_for(rows, budget)
    taken = [-(-count // stride) for count, stride in zip(rows, strides, strict=True)]
    assert all(stride >= 1 for stride in strides)
    assert sum(taken) <= max(budget, len(rows))
    if budget >= sum(rows):
        assert strides == [1] * len(rows)
    if rows[0] == 5:
        assert strides[0] == 1
        assert strides[1] == strides[2] == 20


def test_turns_of_an_encoder_are_put_back_across_pieces(tmp_path: Path) -> None:
    n = 5000
    angle = np.linspace(0, 40 * np.pi, n) - 3.0
    run = {
        "time": np.arange(n) * 0.01,
        "torque": 5 * np.sin(np.arange(n) * 0.01),
        "input_angle": angle,
        "temperature": np.full(n, 20.0),
        "lost_motion": 1e-4 * np.sin(np.arange(n) * 0.01),
    }
    data = write(Campaign([Run(1, "made", run)]), tmp_path / "data", 600, wrap=True)
    sampled = sample_campaign([data], ratio=RATIO, rows=500)
    found = np.interp(run["time"], sampled.runs[0].time_s, sampled.runs[0].columns["input_angle"])
    off = found - angle
    np.testing.assert_allclose(off, off[0], atol=1e-6)
    (wraps,) = [f for f in sampled.findings if f.kind == "wrap"]
    assert wraps.count == 20


def test_rows_without_numbers_are_counted_over_all_rows(tmp_path: Path) -> None:
    data = campaign(rows=3000, runs=2)
    data.runs[0].columns["torque"][5:300] = np.nan
    sampled = sample_campaign([write(data, tmp_path / "data")], ratio=RATIO, rows=400)
    (said,) = [f for f in sampled.findings if f.kind == "nan"]
    assert (said.column, said.run, said.count) == ("torque_Nm", 1, 295)
    assert np.isfinite(sampled.column("torque")).all()


def test_a_dead_sensor_is_dead_in_the_sample_too(tmp_path: Path) -> None:
    data = campaign(add=gap, rows=2000)
    data.runs[3].columns["torque"][400:1200] = data.runs[3].columns["torque"][400]
    sampled = sample_campaign([write(data, tmp_path / "data")], ratio=RATIO, rows=20_000)
    assert sampled.rows < data.rows
    (frozen,) = [finding for finding in sampled.findings if finding.kind == "wild"]
    assert (frozen.column, str(frozen.run)) == ("torque_Nm", str(data.runs[3].label))


def test_small_recordings_are_read_whole(folder: Path) -> None:
    assert recorded_rows(sorted(folder.iterdir())) == 24000
    assert read_or_sample([folder], ratio=RATIO).recorded_rows is None
    assert read_or_sample([folder], ratio=RATIO, rows=5000).recorded_rows == 24000


@contextmanager
def cluster_here(workers: int) -> Iterator[LocalCluster]:
    """Address of a cluster within this process."""
    with LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        if "://" not in cluster.scheduler_address:
            pytest.skip("this Dask has no address to connect to: pip install 'distributed>=2024.1'")
        yield cluster


def test_threads_dask_and_a_cluster_take_the_same_sample(folder: Path) -> None:
    threads = sample_campaign([folder], ratio=RATIO, rows=3000).fingerprint()
    assert sample_campaign([folder], ratio=RATIO, rows=3000, dask="local").fingerprint() == threads
    with cluster_here(workers=1) as cluster:
        again = sample_campaign([folder], ratio=RATIO, rows=3000, dask=cluster.scheduler_address)
    assert again.fingerprint() == threads


def test_a_missing_cluster_is_reported() -> None:
    with pytest.raises(InputError, match="--dask"):
        run_pieces(len, [[1]], "8786")


def test_a_cluster_without_workers_is_reported(caplog: pytest.LogCaptureFixture) -> None:
    with cluster_here(workers=0) as cluster:
        address = cluster.scheduler_address
        with connect(address):
            assert f"{address} has no workers yet; waiting for one" in caplog.text
            cluster.scale(1)
            assert run_pieces(len, [[1], [1, 2]], address) == [1, 2]


def test_a_cluster_that_loses_its_workers_is_reported(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lostmotion.cluster.LOOK_S", 0.1)
    with cluster_here(workers=1) as cluster:
        address = cluster.scheduler_address
        with connect(address):
            time.sleep(0.5)
            assert "no workers" not in caplog.text
            cluster.scale(0)
            until = time.monotonic() + 20
            while "no workers" not in caplog.text and time.monotonic() < until:
                time.sleep(0.1)
            assert f"{address} has no workers any more; waiting for one" in caplog.text


def test_the_verdict_of_a_sample_is_that_of_all_rows(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive = tmp_path / "drive.toml"
    drive.write_text(DRIVE)
    words = ["diagnose", str(drive), str(folder), "--json", "-"]
    assert main(words) == 0
    whole = json.loads(capsys.readouterr().out)
    sampled = sample_campaign([folder], ratio=RATIO, rows=4000)
    assert sampled.rows < 6000
    found = diagnose(None, sampled, ratio=RATIO, rated_torque_Nm=40.0).answer()
    assert found["verdict"] == whole["verdict"] == "missing-effect"
    assert found["effects"] == whole["effects"] == ["thermal_gap"]
    size, true = (
        next(c for c in a["candidates"] if c["name"] == "thermal_gap")["parameters"][
            "gap_rad_per_K"
        ]
        for a in (found, whole)
    )
    assert size == pytest.approx(true, rel=0.1)


def table(**columns: pa.Array) -> pa.Table:
    """A recording of 900 rows, with other columns inserted."""
    n = np.arange(900)
    turn = np.sin(0.01 * n)
    known = {"time_s": n * 0.01, "torque_Nm": turn, "lost_motion_rad": 1e-4 * turn}
    return pa.table({**known, **columns})


@pytest.mark.parametrize("read", [read_campaign, sample_campaign])
def test_nulls_in_parquet_are_rows_without_numbers(
    tmp_path: Path, read: Callable[..., Campaign]
) -> None:
    torque: list[float | None] = np.sin(0.01 * np.arange(900)).tolist()
    torque[7] = torque[700] = None
    cycles = pa.array([None if k == 3 else k for k in range(900)], pa.int32())
    pq.write_table(table(torque_Nm=pa.array(torque), cycles=cycles), tmp_path / "a.parquet", 256)
    found = read([tmp_path / "a.parquet"])
    assert [(f.kind, f.column, f.count) for f in found.findings] == [
        ("nan", "torque_Nm", 2),
        ("nan", "cycles", 1),
    ]
    assert found.rows == 898


@pytest.mark.parametrize("read", [read_campaign, sample_campaign])
@pytest.mark.parametrize("kind", ["timestamp[ns]", "timestamp[us]", "duration[ns]"])
def test_time_stamps_in_parquet_count_from_the_first_without_loss(
    tmp_path: Path, read: Callable[..., Campaign], kind: str
) -> None:
    made = {"timestamp[ns]": pa.timestamp("ns"), "timestamp[us]": pa.timestamp("us")}
    per_second = 1_000_000 if "us" in kind else 1_000_000_000
    ticks = 1_700_000_000_000_000_123 + 10_000_001 * np.arange(900)
    ticks //= 10**9 // per_second
    column = pa.array(ticks, pa.int64()).cast(made.get(kind, pa.duration("ns")))
    pq.write_table(table(time_s=column), tmp_path / "a.parquet", row_group_size=300)
    campaign = read([tmp_path / "a.parquet"])
    np.testing.assert_array_equal(campaign.column("time"), (ticks - ticks[0]) / per_second)


@pytest.mark.parametrize("read", [read_campaign, sample_campaign])
def test_a_parquet_file_without_rows_is_refused(
    tmp_path: Path, read: Callable[..., Campaign]
) -> None:
    pq.write_table(table(), tmp_path / "a.parquet")
    pq.write_table(table().slice(0, 0), tmp_path / "b.parquet")
    with pytest.raises(InputError, match=r"b.parquet: found no rows"):
        read([tmp_path])


def test_a_sample_reports_of_clocks_and_columns_what_the_reader_reports(tmp_path: Path) -> None:
    time = 0.01 * np.arange(900)
    time[[100, 256, 301]] = time[[99, 255, 300]]
    time[512:] -= 1.0
    made = table(time_s=pa.array(time), note=pa.array(["x"] * 900))
    pq.write_table(made, tmp_path / "a.parquet", row_group_size=256)
    told = [str(finding) for finding in read_campaign(tmp_path).findings]
    assert [str(finding) for finding in sample_campaign([tmp_path]).findings] == told
    assert ["note" in one for one in told] == [True, False, False]
    thin = sample_campaign([tmp_path], rows=90).findings
    assert [str(one) for one in thin if one.kind != "sampled"] == told


@pytest.mark.parametrize("read", [read_campaign, sample_campaign])
def test_a_file_that_is_damaged_inside_is_refused_in_one_line(
    tmp_path: Path, read: Callable[..., Campaign]
) -> None:
    table = pa.table({"time_s": np.arange(900.0), "torque_Nm": np.ones(900)})
    table = table.append_column("lost_motion_rad", pa.array(np.zeros(900)))
    file = tmp_path / "damaged.parquet"
    pq.write_table(table, file, compression="none", use_dictionary=False)
    content = bytearray(file.read_bytes())
    # The header of the first page; the end of the file is sound.
    content[4:24] = b"\xff" * 20
    file.write_bytes(content)
    with pytest.raises(InputError, match=r"damaged.parquet: .*unreadable Parquet \(") as caught:
        read([file], ratio=RATIO)
    assert "\n" not in str(caught.value)
