"""Output files are complete or absent."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from lostmotion.errors import InputError
from lostmotion.files import check_place, is_input, read_bytes, write_whole


def test_a_file_is_replaced_whole(tmp_path: Path) -> None:
    path = tmp_path / "answer.json"
    write_whole(path, "old")
    write_whole(path, b"new")
    assert path.read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["answer.json"]


def test_a_failed_write_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "answer.json"
    write_whole(path, "old")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(InputError, match="No space left on device"):
        write_whole(path, "new")
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["answer.json"]


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"missing/answer\.json: found no such folder"):
        write_whole(tmp_path / "missing" / "answer.json", "x")


def test_a_pipe_is_written_to_and_stays_a_pipe(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        check_place("--json", pipe)
        write_whole(pipe, "answer")
        assert os.read(reader, 100) == b"answer"
    finally:
        os.close(reader)
    assert pipe.is_fifo()
    assert [p.name for p in tmp_path.iterdir()] == ["pipe"]


def test_a_device_is_written_to_and_stays_a_device(tmp_path: Path) -> None:
    for number, name in ((3, "null"), (7, "full")):
        try:
            os.mknod(tmp_path / name, 0o666 | stat.S_IFCHR, os.makedev(1, number))
        except OSError:
            pytest.skip("no leave to make devices")
    write_whole(tmp_path / "null", "answer")
    with pytest.raises(InputError, match="No space left on device"):
        write_whole(tmp_path / "full", "answer")
    assert all(path.is_char_device() for path in tmp_path.iterdir())


@pytest.mark.parametrize("there", [True, False])
def test_a_link_stays_and_its_file_is_written_whole(tmp_path: Path, *, there: bool) -> None:
    (tmp_path / "far").mkdir()
    target, link = tmp_path / "far" / "answer.json", tmp_path / "link.json"
    if there:
        target.write_text("old")
    link.symlink_to(target)
    check_place("--json", link)
    write_whole(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"
    assert [p.name for p in (tmp_path / "far").iterdir()] == ["answer.json"]


def test_an_input_is_known_by_any_name(tmp_path: Path) -> None:
    data, run = tmp_path / "data", tmp_path / "data" / "run.csv"
    data.mkdir()
    run.write_text("x")
    (tmp_path / "soft.csv").symlink_to(run)
    (tmp_path / "hard.csv").hardlink_to(run)
    for name in ("data/run.csv", "data/../data/run.csv", "soft.csv", "hard.csv"):
        assert is_input(tmp_path / name, [str(run)]) == str(run)
    assert is_input(run, [str(data)], (".csv",)) == f"{data}/run.csv"
    assert is_input(data / "new.csv", [str(data)], (".csv",)) is None
    assert is_input(data / "fitted.toml", [str(data)], (".csv",)) is None
    assert is_input(tmp_path / "other.csv", [str(run), str(data)]) is None


def test_a_pipe_is_read_to_its_limit(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="found more than 100 bytes, expected a blob"):
        read_bytes("/dev/zero", "a blob", 100)
    file = tmp_path / "file"
    file.write_bytes(b"x" * 100)
    assert read_bytes(file, "a blob", 100) == b"x" * 100
    with pytest.raises(InputError, match="found more than 99 bytes"):
        read_bytes(file, "a blob", 99)
