"""Build backend: scikit-build-core, with sdists that carry the C library.

In a checkout the package builds the library two folders up. An sdist has no such place, so the
parts of the checkout that a build reads go into it under ``checkout/``, and the one path in
pyproject.toml that points out of this folder is turned to them. Everything else is left to
scikit-build-core.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

from scikit_build_core import build as backend
from scikit_build_core.build import (
    build_editable,
    build_wheel,
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
    "README.md",
    "build_backend.py",
    "docs",
    "generate_bindings.py",
    "pyproject.toml",
    "src",
)
"""What of this folder goes into an sdist."""

CHECKOUT = ("CMakeLists.txt", "LICENSE", "lib", "optimizer", "tests/data", "firmware_examples")
"""What of the checkout goes along."""

LEFT_OUT = shutil.ignore_patterns(
    "__pycache__", "*.pyc", "*.so", "*.pyd", "demo_inputs", "generated", "_build", ".*"
)


def build_sdist(sdist_directory: str, config_settings: dict[str, Any] | None = None) -> str:
    """Make an sdist from a copy of this folder that holds the library too."""
    here = Path.cwd()
    checkout = here / "checkout"  # an sdist that was unpacked, and now is packed again
    if not checkout.is_dir():
        checkout = here.parents[1]
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder)
        for name in PACKAGE:
            copy(here / name, stage / name)
        for name in CHECKOUT:
            copy(checkout / name, stage / "checkout" / name)
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
    """Copy a file or a folder; what is not there is left out."""
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.is_dir():
        shutil.copytree(source, target, ignore=LEFT_OUT)
    elif source.is_file():
        shutil.copyfile(source, target)
