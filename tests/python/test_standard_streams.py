"""Standard streams that are closed, full or endless, and the messages about them."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import DATA
from lostmotion.files import TEXT_BYTES_MAX

DRIVE = DATA / "drives" / "reference_a.toml"


def run(redirect: str, *words: str | Path) -> tuple[int, str, str]:
    """Run a command in a shell with redirection; return status, standard output and standard
    error."""
    command = '"$0" -m lostmotion "$@" ' + redirect
    done = subprocess.run(
        ["sh", "-c", command, sys.executable, *map(str, words)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr


BAD = "lostmotion: standard output is closed\n"


@pytest.mark.parametrize(
    ("redirect", "words", "expected"),
    [
        (">&-", ["predict", DRIVE], (1, "", BAD)),
        (">&-", ["predict", DRIVE, "--json", "-"], (1, "", BAD)),
        (">&-", ["predict", DRIVE, "--quiet"], (0, "", "")),
        (">&-", ["predict", "--help"], (1, "", BAD)),
        (">&-", ["--version"], (1, "", BAD)),
        ("2>&-", ["predict", "none.toml"], (2, "", "")),
        (">&- 2>&-", ["predict", "none.toml"], (2, "", "")),
        ("<&- >&- 2>&-", ["predict", DRIVE], (1, "", "")),
    ],
)
def test_a_closed_stream_is_no_traceback_and_no_other_stream(
    redirect: str, words: list[str], expected: tuple[int, str, str]
) -> None:
    assert run(redirect, *words) == expected


def test_no_result_lands_in_a_closed_stream(tmp_path: Path) -> None:
    place = tmp_path / "out.json"
    assert run("<&- >&- 2>&-", "predict", DRIVE, "--json", place, "--quiet")[0] == 0
    assert place.read_text().startswith("{")


def test_a_drive_file_without_an_end_is_refused_by_its_size() -> None:
    status, out, error = run("", "predict", "/dev/zero")
    assert (status, out) == (2, "")
    found = f"/dev/zero: found more than {TEXT_BYTES_MAX} bytes, expected a drive file"
    assert error == f"lostmotion: {found}\n"


def test_too_little_memory_names_the_file_and_is_bad_input(tmp_path: Path) -> None:
    file = tmp_path / "large.csv"
    with file.open("wb") as stream:
        stream.truncate(1 << 31)

    def small() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (1 << 30, 1 << 30))

    done = subprocess.run(
        [sys.executable, "-m", "lostmotion", "check", str(file)],
        capture_output=True, text=True, check=False, preexec_fn=small,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"lostmotion: {file}: found ")
    assert "memory" in done.stderr
    assert done.stderr.count("\n") == 1
