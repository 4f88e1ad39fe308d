"""Files have a decimal point in every locale, no matter when it is set."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from sound_files import spec

from conftest import DATA, NO_SEARCH
from lostmotion.drives import format_toml

LOCALES = ("de_DE", "tr_TR")
"""A decimal comma, and an i whose capital is not I."""

MAIN = """
import locale, sys
name, when, *words = sys.argv[1:]
def set_it():
    locale.setlocale(locale.LC_ALL, name)
    assert locale.localeconv()["decimal_point"] == ","
if when == "before":
    set_it()
from lostmotion import cli
from lostmotion.design import engine
try:
    engine.engine()
except Exception:
    pass
if when == "after":
    set_it()
sys.exit(cli.main(words))
"""


@pytest.fixture(scope="module")
def locales(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of locales made by the test: the system is not changed."""
    folder = tmp_path_factory.mktemp("locales")
    if shutil.which("localedef") is None:
        pytest.skip("no localedef: apt install libc-bin locales")
    for name in LOCALES:
        command = ["localedef", "-i", name, "-f", "UTF-8", str(folder / f"{name}.UTF-8")]
        if subprocess.run(command, capture_output=True, check=False).returncode != 0:
            pytest.skip(f"no source of the locale {name}: apt install locales")
    return folder


def run(
    locales: Path, name: str, when: str, *words: str | Path
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", MAIN, f"{name}.UTF-8", when, *map(str, words)],
        capture_output=True, text=True, check=False, env={**os.environ, "LOCPATH": str(locales)},
    )  # fmt: skip


@pytest.mark.parametrize("when", ["before", "after"])
@pytest.mark.parametrize("name", LOCALES)
def test_a_search_reads_and_writes_points(
    locales: Path, tmp_path: Path, name: str, when: str
) -> None:
    pytest.importorskip("lostmotion._search", reason=NO_SEARCH)
    file = tmp_path / "spec.toml"
    file.write_text(format_toml(spec()))
    done = run(locales, name, when, "design", file, "-o", tmp_path / "there", "-q")
    assert (done.returncode, done.stderr) == (0, "")
    plain = subprocess.run(
        [sys.executable, "-m", "lostmotion", "design", file, "-o", tmp_path / "here", "-q"],
        capture_output=True, check=True,
    )  # fmt: skip
    assert plain.stderr == b""
    for result in ("best.toml", "front.csv", "history.csv", "combinations.csv", "certificate.json"):
        here, there = ((tmp_path / run / result).read_bytes() for run in ("here", "there"))
        assert here == there, result


@pytest.mark.parametrize("when", ["before", "after"])
@pytest.mark.parametrize("name", LOCALES)
def test_a_prediction_and_parameters_are_the_same_bytes(
    locales: Path, tmp_path: Path, name: str, when: str
) -> None:
    drive = DATA / "drives" / "reference_a.toml"
    for command in (["predict", drive, "--json", "-"], ["export", drive, "--json", "-"]):
        more = ["-o", tmp_path / "params.h"] if command[0] == "export" else []
        there = run(locales, name, when, *command, *more)
        made = (tmp_path / "params.h").read_bytes() if more else b""
        here = subprocess.run(
            [sys.executable, "-m", "lostmotion", *map(str, [*command, *more])],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert (there.returncode, there.stdout) == (here.returncode, here.stdout)
        assert made == ((tmp_path / "params.h").read_bytes() if more else b"")
