"""Build backend: scikit-build-core, with sdists that contain the C library.

In a checkout the package builds the library two folders up. An sdist has no such folder, so it
contains the parts of the checkout that a build reads under ``checkout/``, and the one path in
pyproject.toml out of this folder is changed to them. Sdist and wheel contain a list of their
components (CycloneDX), and the same sources give the same bytes. scikit-build-core does everything
else.
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
import re
import shutil
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Any

from scikit_build_core import build as backend
from scikit_build_core.build import (
    build_editable,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
    "prepare_metadata_for_build_editable",
    "prepare_metadata_for_build_wheel",
]

PACKAGE = (
    "CMakeLists.txt",
    "LICENSE",
    "LICENSES",
    "README.md",
    "build_backend.py",
    "docs",
    "generate_bindings.py",
    "pyproject.toml",
    "src",
)
"""Contents of this folder that an sdist contains."""

CHECKOUT = ("CMakeLists.txt", "LICENSE", "lib", "optimizer", "tests/data", "firmware_examples")
"""Contents of the checkout that an sdist contains."""

LEFT_OUT = shutil.ignore_patterns(
    "__pycache__", "*.pyc", "*.so", "*.pyd", "demo_inputs", "generated", "_build", ".*"
)


EPOCH = "315532800"
"""Time of every file in an archive, unless SOURCE_DATE_EPOCH states another: 1980-01-01, the first
date of ZIP. The time of packing does not belong to the contents."""

SBOM = "lostmotion.cdx.json"
"""The list of an archive's components."""

SYSTEM_TAG = "0systemnlopt"
"""Build tag of a wheel whose design search loads the NLopt of the machine that built it: such a
wheel runs only there, and must not be released."""

SYSTEM_NLOPT = re.compile(rb"libnlopt[.\w]*\.(?:so|dylib)|nlopt\.dll")
"""How a library states that it loads NLopt from the system."""


def build_wheel(
    wheel_directory: str,
    config_settings: dict[str, Any] | None = None,
    metadata_directory: str | None = None,
) -> str:
    """Build a wheel, and add the list of its components (PEP 770)."""
    os.environ.setdefault("SOURCE_DATE_EPOCH", EPOCH)
    name: str = backend.build_wheel(wheel_directory, config_settings, metadata_directory)
    wheel = Path(wheel_directory) / name
    with zipfile.ZipFile(wheel) as archive:
        entries = [(info, archive.read(info)) for info in archive.infolist()]
    # The stub _search.pyi is beside the extension.
    search = [
        data
        for info, data in entries
        if "/_search." in info.filename and not info.filename.endswith(".pyi")
    ]
    loads = [bool(SYSTEM_NLOPT.search(data)) for data in search]
    record = next(info for info, _ in entries if info.filename.endswith(".dist-info/RECORD"))
    about = record.filename.removesuffix("RECORD")
    version = nlopt_version(config_settings or {}) if loads == [False] else None
    changed = {f"{about}sboms/{SBOM}": sbom(version, any(loads))}
    if any(loads):
        wheel.unlink()
        project, number, rest = name.split("-", 2)
        name = f"{project}-{number}-{SYSTEM_TAG}-{rest}"
        wheel = Path(wheel_directory) / name
        written = next(data for info, data in entries if info.filename == f"{about}WHEEL")
        changed[f"{about}WHEEL"] = written.rstrip(b"\n") + f"\nBuild: {SYSTEM_TAG}\n".encode()
        print(
            f"lostmotion: the design search loads this machine's NLopt, so {name} is for this "
            "machine only. To build a wheel for release, with NLopt without its LGPL part: "
            "-C cmake.define.LM_BUNDLE_NLOPT=ON",
            file=sys.stderr,
        )
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for info, data in entries:
            if info is record:
                for place in changed.keys() - {entry.filename for entry, _ in entries}:
                    added = zipfile.ZipInfo(place, record.date_time)
                    added.compress_type, added.external_attr = (
                        record.compress_type,
                        record.external_attr,
                    )
                    archive.writestr(added, changed[place])
                data = with_hashes(data, changed)
            archive.writestr(info, changed.get(info.filename, data))
    return name


def with_hashes(record: bytes, changed: dict[str, bytes]) -> bytes:
    """RECORD with the lines of files that are new or changed."""
    lines = record.decode().splitlines()
    kept = [line for line in lines if line.split(",")[0] not in changed]
    for place, data in changed.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        kept.append(f"{place},sha256={digest},{len(data)}")
    return ("\n".join(kept) + "\n").encode()


def nlopt_version(config_settings: dict[str, Any]) -> str:
    """Version of the NLopt that is built into a wheel: of a stated source, or the pinned one."""
    stated = config_settings.get("cmake.define.FETCHCONTENT_SOURCE_DIR_NLOPT")
    if stated:
        text = (Path(stated) / "CMakeLists.txt").read_text(encoding="utf-8")
        parts = [
            re.search(rf'NLOPT_{part}_VERSION "?(\d+)', text)
            for part in ("MAJOR", "MINOR", "BUGFIX")
        ]
        return ".".join(part[1] for part in parts if part)
    text = (sources() / "optimizer" / "NLopt.cmake").read_text(encoding="utf-8")
    found = re.search(r"tags/v([\d.]+)\.tar", text)
    return found[1] if found else ""


def sources() -> Path:
    """Find the folder with the library, in an unpacked sdist or in the checkout."""
    inside = Path.cwd() / "checkout"
    return inside if inside.is_dir() else Path.cwd().parents[1]


def sbom(nlopt: str | None, loads_nlopt: bool = False) -> bytes:
    """List the components and requirements of an archive as CycloneDX 1.5.

    Parameters
    ----------
    nlopt : str, optional
        Version of the NLopt that is part of it.
    loads_nlopt : bool
        Whether it loads the NLopt of the machine that built it, which it does not contain.
    """
    project = Path("pyproject.toml").read_text(encoding="utf-8")
    listed = re.search(r"^dependencies = \[(.*?)^\]", project, re.DOTALL | re.MULTILINE)
    needed = (
        re.findall(r'^\s*"([A-Za-z0-9_.-]+)([^"]*)"', listed[1], re.MULTILINE) if listed else []
    )
    stated = (sources() / "CMakeLists.txt").read_text(encoding="utf-8")
    found = re.search(r"project\(\s*lostmotion\s+VERSION\s+([0-9.]+)", stated)
    version = found[1] if found else ""
    own = f"pkg:pypi/lostmotion@{version}"
    components: list[dict[str, Any]] = []
    for name, bound in needed:
        components.append(
            {
                "type": "library",
                "bom-ref": f"pkg:pypi/{name}",
                "name": name,
                "purl": f"pkg:pypi/{name}",
                "scope": "required",
                "properties": [{"name": "lostmotion:required", "value": bound.strip()}],
            }
        )
    if nlopt is not None:
        components.append(
            {
                "type": "library",
                "bom-ref": f"pkg:github/stevengj/nlopt@v{nlopt}",
                "name": "nlopt",
                "version": nlopt,
                "purl": f"pkg:github/stevengj/nlopt@v{nlopt}",
                "licenses": [{"license": {"name": "permissive, see LICENSES/NLopt.txt"}}],
                "description": "built in, without its directory luksan (LGPL)",
            }
        )
    if loads_nlopt:
        components.append(
            {
                "type": "library",
                "bom-ref": "pkg:github/stevengj/nlopt",
                "name": "nlopt",
                "purl": "pkg:github/stevengj/nlopt",
                "scope": "excluded",
                "licenses": [{"license": {"name": "that of the system's package"}}],
                "description": "loaded from the machine that built this wheel, no part of it",
            }
        )
    document = {
        "$schema": "http://cyclonedx.org/schema/bom-1.5.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "component": {
                "type": "library",
                "bom-ref": own,
                "name": "lostmotion",
                "version": version,
                "purl": own,
                "licenses": [{"license": {"id": "MIT"}}],
            }
        },
        "components": components,
        "dependencies": [{"ref": own, "dependsOn": [one["bom-ref"] for one in components]}],
    }
    return (json.dumps(document, indent=1) + "\n").encode()


def build_sdist(sdist_directory: str, config_settings: dict[str, Any] | None = None) -> str:
    """Make an sdist from a copy of this folder with the library."""
    os.environ.setdefault("SOURCE_DATE_EPOCH", EPOCH)
    here = Path.cwd()
    checkout = sources()
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder)
        for name in PACKAGE:
            copy(here / name, stage / name)
        for name in CHECKOUT:
            copy(checkout / name, stage / "checkout" / name)
        (stage / SBOM).write_bytes(sbom(None))
        project = stage / "pyproject.toml"
        text = project.read_text(encoding="utf-8")
        project.write_text(text.replace("../../", "checkout/"), encoding="utf-8")
        target = Path(sdist_directory).resolve()
        os.chdir(stage)
        try:
            name: str = backend.build_sdist(str(target), config_settings)
        finally:
            os.chdir(here)
    return name


def copy(source: Path, target: Path) -> None:
    """Copy a file or a folder; missing ones are left out."""
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.is_dir():
        shutil.copytree(source, target, ignore=LEFT_OUT)
    elif source.is_file():
        shutil.copyfile(source, target)
