"""A search writes the same bytes with threads, clusters, stops, kills and damaged journals."""

from __future__ import annotations

import itertools
import json
import math
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time
import zlib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from small_search import Write, left_by

from conftest import NO_DASK, NO_SEARCH
from lostmotion import design
from lostmotion.cli import main
from lostmotion.errors import InputError

pytest.importorskip("lostmotion._search", reason=NO_SEARCH)


def test_progress_reports_the_state_of_the_search(
    write_spec: Write, small_spec: dict[str, Any], tmp_path: Path
) -> None:
    seen: list[dict[str, Any]] = []
    design.search(write_spec(small_spec), tmp_path / "run", workers=1, watch=seen.append)
    last = seen[-1]
    assert last["stage"] == "done"
    assert last["evaluations"] <= last["budget"] == 2500
    assert last["best"]["drive"]["rated_torque_Nm"] == 40
    assert last["combinations"]["total"] == 4
    assert len(last["front"][0]) == 2
    assert last["best_value"] == pytest.approx(last["front"][0][0])
    assert 0 < last["feasible_share"] < 1
    assert all(a["evaluations"] <= b["evaluations"] for a, b in itertools.pairwise(seen))


def test_an_error_in_progress_ends_the_search_and_is_raised(
    write_spec: Write, small_spec: dict[str, Any], tmp_path: Path
) -> None:
    def fails(_: dict[str, Any]) -> None:
        raise ZeroDivisionError("in the caller's own code")

    with pytest.raises(ZeroDivisionError):
        design.search(write_spec(small_spec), tmp_path / "run", watch=fails)
    assert (tmp_path / "run" / "front.csv").exists()


# --- the same bytes ---


def test_two_threads_give_the_same_bytes(
    searched: tuple[Path, Path, dict[str, bytes]], tmp_path: Path
) -> None:
    spec, _, expected = searched
    design.search(spec, tmp_path / "run", workers=2)
    assert left_by(tmp_path / "run") == expected


def test_any_executor_gives_the_same_bytes(
    searched: tuple[Path, Path, dict[str, bytes]], tmp_path: Path
) -> None:
    spec, _, expected = searched
    with ThreadPoolExecutor(2) as pool:
        design.search(spec, tmp_path / "run", executor=pool)
    assert left_by(tmp_path / "run") == expected


def test_a_stopped_search_continues_to_the_same_bytes(
    searched: tuple[Path, Path, dict[str, bytes]], tmp_path: Path
) -> None:
    spec, _, expected = searched
    stop = threading.Event()
    calls = 0

    def watch(seen: dict[str, Any]) -> None:
        nonlocal calls
        calls += 1
        if seen["evaluations"] > 300:
            stop.set()

    result = design.search(spec, tmp_path / "run", workers=1, watch=watch, stop=stop)
    if not result.finished:
        assert (tmp_path / "run" / "front.csv").exists()
    result = design.search(spec, tmp_path / "run", resume=True)
    assert result.finished
    assert left_by(tmp_path / "run") == expected


def test_a_search_stopped_at_once_can_be_resumed(
    searched: tuple[Path, Path, dict[str, bytes]], tmp_path: Path
) -> None:
    spec, _, expected = searched
    stop = threading.Event()
    stop.set()
    result = design.search(spec, tmp_path / "run", workers=1, stop=stop)
    assert not result.finished
    with ThreadPoolExecutor(1) as pool:
        result = design.search(spec, tmp_path / "run", resume=True, executor=pool, stop=stop)
    assert not result.finished
    assert design.search(spec, tmp_path / "run", resume=True).finished
    assert left_by(tmp_path / "run") == expected


def begin(spec: Path, run: Path, *options: str) -> subprocess.Popen[bytes]:
    """Begin a search in a separate process and wait until it has written some answers."""
    command = [sys.executable, "-m", "lostmotion", "design", str(spec), "-o", str(run), *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    journal = run / "journal.bin"
    for _ in range(3000):
        if process.poll() is not None or (journal.exists() and journal.stat().st_size > 60_000):
            break
        time.sleep(0.005)
    return process


def test_a_killed_search_continues_to_the_same_bytes(
    searched: tuple[Path, Path, dict[str, bytes]], tmp_path: Path
) -> None:
    spec, _, expected = searched
    process = begin(spec, tmp_path / "run", "--workers", "1")
    process.send_signal(signal.SIGKILL)
    process.communicate(timeout=60)
    assert process.returncode == -signal.SIGKILL, "it was done before it could be killed"
    assert not (tmp_path / "run" / "best.toml").exists()
    assert main(["design", str(spec), "-o", str(tmp_path / "run"), "--resume", "-q"]) == 0
    assert left_by(tmp_path / "run") == expected


IN_USE = "found a running search, expected a finished search, or another folder"


def test_a_second_process_is_refused_and_the_first_loses_nothing(
    searched: tuple[Path, Path, dict[str, bytes]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    spec, _, expected = searched
    process = begin(spec, tmp_path / "run", "--workers", "1")
    process.send_signal(signal.SIGSTOP)  # and keeps its lock
    try:
        assert process.poll() is None, "it was done before the second one began"
        before = {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()}
        assert main(["design", str(spec), "-o", str(tmp_path / "run"), "--resume", "-q"]) == 2
        assert f"journal.bin: {IN_USE}\n" in capsys.readouterr().err
        assert main(["design", str(spec), "-o", str(tmp_path / "run"), "-q"]) == 2
        assert "found an existing search, expected --resume" in capsys.readouterr().err
        assert {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()} == before
    finally:
        process.send_signal(signal.SIGCONT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 0, errors
    assert left_by(tmp_path / "run") == expected


def test_a_process_that_searches_in_a_folder_is_refused_it_once_more(
    searched: tuple[Path, Path, dict[str, bytes]], tmp_path: Path
) -> None:
    spec, _, expected = searched
    (tmp_path / "name").symlink_to(tmp_path / "run")
    codes = []

    def again(_: dict[str, Any]) -> None:
        if not codes:
            for name in ("run", "name"):
                with pytest.raises(InputError, match=IN_USE):
                    design.search(spec, tmp_path / name, resume=True)
            # the refused search has not unlocked the folder for another process
            command = [sys.executable, "-m", "lostmotion", "design", str(spec), "--resume"]
            done = subprocess.run([*command, "-o", str(tmp_path / "run")], capture_output=True)
            assert IN_USE.encode() in done.stderr
            codes.append(done.returncode)

    design.search(spec, tmp_path / "run", workers=1, watch=again)
    assert codes == [2]
    assert left_by(tmp_path / "run") == expected
    assert design.search(spec, tmp_path / "run", resume=True).finished


def test_an_interrupt_saves_the_best_so_far_and_exits_130(
    searched: tuple[Path, Path, dict[str, bytes]], tmp_path: Path
) -> None:
    spec, _, expected = searched
    process = begin(spec, tmp_path / "run", "--workers", "1")
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert b"--resume continues" in errors
    assert (tmp_path / "run" / "front.csv").exists()
    assert (tmp_path / "run" / "report.html").exists()
    assert main(["design", str(spec), "-o", str(tmp_path / "run"), "--resume", "-q"]) == 0
    assert left_by(tmp_path / "run") == expected


@pytest.fixture
def dask_cluster() -> Iterator[Any]:
    distributed = pytest.importorskip("distributed", reason=NO_DASK)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        yield cluster


def test_a_dask_cluster_gives_the_same_bytes_also_when_a_worker_is_killed(
    searched: tuple[Path, Path, dict[str, bytes]], tmp_path: Path, dask_cluster: Any
) -> None:
    spec, _, expected = searched
    address = dask_cluster.scheduler_address
    assert main(["design", str(spec), "-o", str(tmp_path / "whole"), "--dask", address, "-q"]) == 0
    assert left_by(tmp_path / "whole") == expected
    workers = [worker.pid for worker in dask_cluster.workers.values()]
    killed = threading.Event()

    def kill_one(seen: dict[str, Any]) -> None:
        if seen["evaluations"] > 200 and not killed.is_set():
            os.kill(workers[0], signal.SIGKILL)
            killed.set()

    from distributed import Client

    with Client(address, set_as_default=False) as client:
        design.search(spec, tmp_path / "hurt", executor=client, watch=kill_one)
    assert killed.is_set()
    assert left_by(tmp_path / "hurt") == expected


def test_a_cluster_that_does_not_answer_is_reported_in_one_line(
    searched: tuple[Path, Path, dict[str, bytes]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("distributed", reason=NO_DASK)
    run = ["design", str(searched[0]), "-o", str(tmp_path / "run")]
    assert main([*run, "--dask", "tcp://127.0.0.1:1"]) == 2
    assert "--dask: found 'tcp://127.0.0.1:1'" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


# --- what goes wrong ---


def test_damaged_evaluations_are_counted_and_ignored(
    write_spec: Write,
    small_spec: dict[str, Any],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    small_spec["search"]["damaged_share"] = 0.05
    assert main(["design", str(write_spec(small_spec)), "-o", str(tmp_path / "run")]) == 0
    told = capsys.readouterr().out
    count = re.search(
        r"(\d+) evaluations that the model refused or that gave no finite result", told
    )
    assert count is not None
    assert 20 < int(count[1]) < 300
    certificate = json.loads((tmp_path / "run" / "certificate.json").read_text())
    assert certificate["holds"]
    assert math.isfinite(certificate["figures"]["lost_motion_arcmin"])


def test_an_incomplete_journal_is_repaired_and_reported(
    searched: tuple[Path, Path, dict[str, bytes]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    spec, run, expected = searched
    shutil.copytree(run, tmp_path / "run")
    journal = tmp_path / "run" / "journal.bin"
    os.truncate(journal, journal.stat().st_size - 11)
    assert main(["design", str(spec), "-o", str(tmp_path / "run"), "--resume"]) == 0
    assert "; the tasks that follow are repeated" in capsys.readouterr().err
    assert left_by(tmp_path / "run") == expected


def test_a_damaged_journal_is_saved_reported_and_continued(
    searched: tuple[Path, Path, dict[str, bytes]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    spec, run, expected = searched
    shutil.copytree(run, tmp_path / "run")
    journal = tmp_path / "run" / "journal.bin"
    data = bytearray(journal.read_bytes())
    data[len(data) // 2] ^= 1
    journal.write_bytes(data)
    assert main(["design", str(spec), "-o", str(tmp_path / "run"), "--resume"]) == 0
    said = capsys.readouterr().err
    assert re.search(r"damaged after \d+ answers; \d+ complete ones after the damage", said)
    kept = tmp_path / "run" / "journal.bin.damaged"
    assert kept.read_bytes() == bytes(data)
    kept.unlink()
    assert left_by(tmp_path / "run") == expected


def test_the_journal_of_another_spec_is_refused(
    searched: tuple[Path, Path, dict[str, bytes]],
    write_spec: Write,
    small_spec: dict[str, Any],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shutil.copytree(searched[1], tmp_path / "run")
    before = {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()}
    small_spec["search"]["seed"] = 4
    assert (
        main(["design", str(write_spec(small_spec)), "-o", str(tmp_path / "run"), "--resume"]) == 2
    )
    told = capsys.readouterr().err
    assert "found the journal of another spec" in told
    assert "start_from in [search] starts a new search from its designs" in told
    assert {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()} == before


RECORD = struct.Struct("<III")
"""Head of a journal's record: its mark, length and CRC."""


@pytest.mark.parametrize(
    ("place", "value"),
    [(0, -1), (4, 2**31 - 1), (8, 7), (12, -5), (28, 2**31 - 1)],
    ids=["id", "combination", "computed", "plain", "feasible"],
)
def test_a_foreign_journal_is_refused_in_one_line(
    searched: tuple[Path, Path, dict[str, bytes]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    place: int,
    value: int,
) -> None:
    spec, run, _ = searched
    shutil.copytree(run, tmp_path / "run")
    file = tmp_path / "run" / "journal.bin"
    journal = bytearray(file.read_bytes())
    at = journal.index(b"NAML")
    mark, length, crc = RECORD.unpack_from(journal, at)
    body = memoryview(journal)[at + RECORD.size : at + RECORD.size + length]
    assert zlib.crc32(body) == crc
    struct.pack_into("<i", body, place, value)
    RECORD.pack_into(journal, at, mark, length, zlib.crc32(body))
    file.write_bytes(journal)
    before = {path.name: path.read_bytes() for path in file.parent.iterdir()}
    status = main(["design", str(spec), "-o", str(file.parent), "--resume", "-q"])
    error = capsys.readouterr().err
    assert (status, error.count("\n")) == (2, 1)
    assert "journal.bin: found an answer that no task of this search has (number 1)" in error
    assert {path.name: path.read_bytes() for path in file.parent.iterdir()} == before


def test_a_folder_with_a_search_is_not_overwritten(
    searched: tuple[Path, Path, dict[str, bytes]], capsys: pytest.CaptureFixture[str]
) -> None:
    spec, run, expected = searched
    assert main(["design", str(spec), "-o", str(run)]) == 2
    assert "expected --resume" in capsys.readouterr().err
    assert left_by(run) == expected


def test_resuming_without_a_journal_writes_nothing(
    searched: tuple[Path, Path, dict[str, bytes]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["design", str(searched[0]), "-o", str(tmp_path / "run"), "--resume"]) == 2
    assert "expected the journal of a search" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_json_lines_of_progress_are_json(
    searched: tuple[Path, Path, dict[str, bytes]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    run = ["design", str(searched[0]), "-o", str(tmp_path / "run"), "--progress", "json"]
    assert main([*run, "--json", "-"]) == 2
    assert main(run) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert lines[-1]["stage"] == "done"
    assert {line["schema"] for line in lines} == {"lostmotion.progress/1"}
