"""Requirements of a test on the machine; if one is missing, the test is skipped with the reason."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from measure import ROOT, Target

TOOLS = ROOT / "build" / "tools"
"""Folder with a separate virtual environment for each tool, because their requirements conflict."""

PACKAGES = {
    "arm-none-eabi-gcc": "gcc-arm-none-eabi libnewlib-arm-none-eabi",
    "riscv64-unknown-elf-gcc": "gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf",
    "arm-linux-gnueabihf-gcc": "gcc-arm-linux-gnueabihf libc6-dev-armhf-cross",
    "powerpc-linux-gnu-gcc": "gcc-powerpc-linux-gnu libc6-dev-powerpc-cross",
    "qemu-system-riscv32": "qemu-system-misc",
    "qemu-arm": "qemu-user",
    "qemu-ppc": "qemu-user",
}
"""Debian's package names that differ from the name of the program."""

UNREACHABLE = r"from versions: none|Temporary failure|[Cc]onnection|[Tt]imed? ?out|ProxyError"
"""Messages of pip if it does not reach an index."""


def need(target: Target) -> Target:
    """Return the target if its compiler and its emulator are installed."""
    missing = target.missing()
    if missing:
        pytest.skip(f"{target.name}: no {missing}: apt install {PACKAGES.get(missing, missing)}")
    return target


def tool(name: str, package: str) -> str:
    """Path of a Python program, installed from the index if it is missing."""
    venv = TOOLS / package
    path = os.pathsep.join(
        [str(Path(sys.executable).parent), str(venv / "bin"), os.environ["PATH"]]
    )
    found = shutil.which(name, path=path)
    if found is None:
        pip_install(venv, package)
        found = shutil.which(name, path=path)
    assert found is not None, f"{package} is installed but has no {name}"
    return found


def pip_install(venv: Path, package: str) -> None:
    """Install a package into a virtual environment."""
    subprocess.run([sys.executable, "-m", "venv", venv], check=True)
    command = [venv / "bin" / "python", "-m", "pip", "--disable-pip-version-check", "-q", "install"]
    done = subprocess.run([*command, package], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        said = [line for line in done.stderr.splitlines() if re.search(UNREACHABLE, line)]
        assert said, done.stderr
        pytest.skip(f"{package} could not be installed: {said[-1].strip()}")
