"""Contents of the release: only code under the stated licences, notices, reproducible bytes."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tarfile
import zipfile
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from test_wheel import PACKAGE, ROOT, build_environment, pip, run

from lostmotion import __version__

BUILD = """
import json, sys
import build_backend
kind, folder, settings = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
print(getattr(build_backend, f"build_{kind}")(folder, settings))
"""


def build(kind: str, folder: Path, environment: dict[str, str], **settings: str) -> Path:
    """Build an sdist or a wheel; its file."""
    folder.mkdir(exist_ok=True)
    said = run(
        sys.executable,
        "-c",
        BUILD,
        kind,
        folder,
        json.dumps(settings),
        cwd=PACKAGE,
        env=environment,
    )
    return folder / said.strip().splitlines()[-1]


@cache
def nlopt_source(folder: Path) -> Path:
    """NLopt's source out of Debian's package, or why the test is left out."""
    script = ROOT / "optimizer" / "nlopt_from_debian.sh"
    done = subprocess.run(["sh", script, folder], capture_output=True, text=True, check=False)
    if done.returncode != 0 or not done.stdout.strip():
        pytest.skip("no source of NLopt: it comes from Debian's mirror through apt-get")
    return Path(done.stdout.strip())


def components(sbom: bytes) -> dict[str, dict[str, Any]]:
    """Components of a CycloneDX document by name."""
    document = json.loads(sbom)
    assert document["bomFormat"] == "CycloneDX"
    assert document["metadata"]["component"]["version"] == __version__
    listed = {one["name"]: one for one in document["components"]}
    references = [one["bom-ref"] for one in document["components"]]
    assert document["dependencies"] == [
        {"ref": f"pkg:pypi/lostmotion@{__version__}", "dependsOn": references}
    ]
    return listed


def needed() -> set[str]:
    """Names of the packages that the package needs."""
    text = (PACKAGE / "pyproject.toml").read_text()
    found = re.search(r"^dependencies = \[(.*?)^\]", text, re.DOTALL | re.MULTILINE)
    assert found is not None
    return set(re.findall(r'^  "([\w.-]+)', found[1], re.MULTILINE))


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


def test_a_release_wheel_carries_nlopt_without_its_part_under_the_lgpl(tmp_path: Path) -> None:
    source = nlopt_source(tmp_path / "nlopt")
    environment = build_environment(tmp_path / "backend")
    made = []
    for name in ("one", "two"):
        settings = {
            "build-dir": str(tmp_path / f"build_{name}"),
            "cmake.define.LM_BUNDLE_NLOPT": "ON",
            "cmake.define.FETCHCONTENT_SOURCE_DIR_NLOPT": str(source),
        }
        made.append(build("wheel", tmp_path / name, environment, **settings))
    assert made[0].read_bytes() == made[1].read_bytes()
    with zipfile.ZipFile(made[0]) as archive:
        inside = {name: archive.read(name) for name in archive.namelist()}
    search = inside["lostmotion/_search.abi3.so"]
    assert b"SLSQP" in search
    for foreign in (b"luksan", b"libnlopt.so", str(tmp_path).encode()):
        assert foreign not in search, foreign
    about = f"lostmotion-{__version__}.dist-info"
    notices = inside[f"{about}/licenses/LICENSES/NLopt.txt"].decode()
    for holder in ("Massachusetts Institute of Technology", "Dieter Kraft", "M. J. D. Powell"):
        assert holder in notices, holder
    listed = components(inside[f"{about}/sboms/lostmotion.cdx.json"])
    assert set(listed) == {*needed(), "nlopt"}
    assert listed["nlopt"]["version"] == source.name.removeprefix("nlopt-")
    record = inside[f"{about}/RECORD"].decode()
    assert all(name in record for name in inside)


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
