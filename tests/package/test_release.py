"""The release: an sdist of reproducible bytes, and the versions of its dependencies."""

from __future__ import annotations

import re
import sys
import tarfile
from pathlib import Path

import pytest
from test_wheel import (
    PACKAGE,
    ROOT,
    build,
    build_environment,
    components,
    needed,
    only_before_a_release,
    pip,
    run,
)


def test_an_sdist_has_the_same_bytes_twice_and_states_what_it_is_made_of(tmp_path: Path) -> None:
    environment = build_environment(tmp_path / "backend")
    first, second = (build("sdist", tmp_path / name, environment) for name in ("one", "two"))
    assert first.read_bytes() == second.read_bytes()
    with tarfile.open(first) as archive:
        names = {name.partition("/")[2]: name for name in archive.getnames()}
        listed = archive.extractfile(names["lostmotion.cdx.json"])
        assert listed is not None
        assert set(components(listed.read())) == needed()
    assert {"LICENSE", "LICENSES/NLopt.txt", "checkout/optimizer/NLopt.cmake"} <= set(names)
    assert not [name for name in names if "luksan" in name.lower()]


@only_before_a_release
@pytest.mark.parametrize("which", ["oldest", "newest"])
def test_the_package_runs_with_the_oldest_and_the_newest_of_what_it_needs(
    which: str, tmp_path: Path
) -> None:
    venv = tmp_path / "venv"
    run(sys.executable, "-m", "venv", venv)
    text = (PACKAGE / "pyproject.toml").read_text()
    bounds = re.findall(r'^  "([\w.-]+)>=([\d.]+)"', text.partition("[project.optional")[0], re.M)
    assert {name for name, _ in bounds} >= {"numpy", "scipy", "cffi"}
    wanted = [f"{name}{'~=' if which == 'oldest' else '>='}{low}" for name, low in bounds]
    if which == "oldest":  # the oldest that has a wheel for this Python, of the stated line
        wanted = [f"{name}>={low},<{after(low)}" for name, low in bounds]
    pip("install", "--only-binary", ":all:", *wanted, python=venv / "bin" / "python")
    environment = {
        "PYTHONPATH": installed(tmp_path),
        "PATH": "/usr/bin:/bin",
        "HOME": str(tmp_path),
    }
    drive = ROOT / "tests" / "data" / "drives" / "reference_a.toml"
    joint = ROOT / "tests" / "data" / "joint"
    for words in (
        ["predict", drive],
        ["compare", joint / "joint.toml", joint / "joint.csv.gz"],
        ["fit", joint / "joint.toml", joint / "joint.csv.gz", "-o", tmp_path / "fitted.toml"],
        ["export", tmp_path / "fitted.toml", "-o", tmp_path / "params.h"],
    ):
        run(
            venv / "bin" / "python", "-W", "error::DeprecationWarning:lostmotion", "-m",
            "lostmotion", *words, "--quiet", env=environment,
        )  # fmt: skip


def after(version: str) -> str:
    """Give the minor release that follows: 1.24 is followed by 1.25, 3 by 4."""
    *front, last = version.split(".")
    return ".".join([*front, str(int(last) + 1)])


def installed(folder: Path) -> str:
    """Put the package that the tests run with, and nothing else, into a folder."""
    import lostmotion
    from lostmotion import _core32, _core64

    place = folder / "package" / "lostmotion"
    source = Path(lostmotion.__file__).parent
    place.parent.mkdir()
    place.symlink_to(source) if not is_editable(source) else copy(source, place)
    for module in (_core32, _core64):
        target = place / Path(str(module.__file__)).name
        if not target.exists():
            target.symlink_to(str(module.__file__))
    return str(place.parent)


def is_editable(source: Path) -> bool:
    """Whether the extensions lie elsewhere than the sources."""
    return not list(source.glob("_core64*.so"))


def copy(source: Path, place: Path) -> None:
    """Copy a package without Python's compiled files."""
    import shutil

    shutil.copytree(source, place, ignore=shutil.ignore_patterns("__pycache__"))
