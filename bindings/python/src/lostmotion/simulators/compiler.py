"""The machine's C compiler: C sources become a shared object."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import lostmotion
from lostmotion.errors import InputError

SOURCES = "simulators/c"
"""Folder of the package with the C sources of the simulators, and the library as two files."""

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-fvisibility=hidden")
"""Without contraction the results are bit-identical to those of every other target
(lostmotion/real.h)."""

SECONDS_MAX = 120
"""A compiler that takes longer hangs: the sources take 1 s."""


def read_source(name: str) -> str:
    """Read one of the C sources that come with the package.

    Raises
    ------
    InputError
        When the package was installed without it.
    """
    for place in lostmotion.__path__:
        file = Path(place) / SOURCES / name
        if file.is_file():
            return file.read_text(encoding="utf-8")
    raise InputError("lostmotion", f"{SOURCES}/{name}", "no such file", "a complete installation")


def find_compiler() -> list[str] | None:
    """Command of the C compiler: the variable CC, else cc, gcc or clang; None if there is none.

    Raises
    ------
    InputError
        If CC names a compiler that does not exist.
    """
    stated = os.environ.get("CC", "").strip()
    if stated:
        words = shlex.split(stated)
        if shutil.which(words[0]) is None:
            raise InputError("CC", "", f"'{stated}'", "a C compiler that is installed")
        return words
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return [name]
    return None


def shared_suffix() -> str:
    """Suffix of a shared object on this machine, as FMI and MuJoCo require it."""
    return {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")


def compile_shared(
    compiler: Sequence[str],
    texts: Mapping[str, str],
    units: Sequence[str],
    extra: Sequence[str] = (),
    linked: Sequence[str] = (),
) -> bytes:
    """Compile sources to a shared object and return its bytes.

    Parameters
    ----------
    compiler : sequence of str
        From `find_compiler`.
    texts : mapping
        Every file by its name.
    units : sequence of str
        Compiled files; the others are included.
    extra : sequence of str
        More options: include folders, sanitizers.
    linked : sequence of str
        What it is linked with: libraries and their options.

    Raises
    ------
    InputError
        If the compiler refuses them, with its first message.
    """
    with tempfile.TemporaryDirectory(prefix="lostmotion-") as folder:
        place = Path(folder)
        for name, text in texts.items():
            (place / name).write_text(text, encoding="utf-8")
        objects = []
        for unit in units:
            made = place / f"{unit}.o"
            known = _library_object(tuple(compiler), unit, tuple(texts.items()), tuple(extra))
            if known is None:
                _run([*compiler, *FLAGS, *extra, "-I.", "-c", unit, "-o", made.name], place)
            else:
                made.write_bytes(known)
            objects.append(made.name)
        _run([*compiler, "-shared", *extra, *objects, *linked, "-o", "made"], place)
        return (place / "made").read_bytes()


LIBRARY = "runtime.c"
"""Translation unit with the library itself, the same for every drive: compiled once per process."""


def _library_object(
    compiler: tuple[str, ...],
    unit: str,
    texts: tuple[tuple[str, str], ...],
    extra: tuple[str, ...],
) -> bytes | None:
    if unit != LIBRARY:
        return None
    needed = (LIBRARY, "lostmotion.c", "lostmotion.h", "library_config.h")
    return _compile_library(compiler, tuple(entry for entry in texts if entry[0] in needed), extra)


@cache
def _compile_library(
    compiler: tuple[str, ...], texts: tuple[tuple[str, str], ...], extra: tuple[str, ...]
) -> bytes:
    with tempfile.TemporaryDirectory(prefix="lostmotion-") as folder:
        place = Path(folder)
        for name, text in texts:
            (place / name).write_text(text, encoding="utf-8")
        _run([*compiler, *FLAGS, *extra, "-I.", "-c", LIBRARY, "-o", "made.o"], place)
        return (place / "made.o").read_bytes()


def _run(command: Sequence[str], folder: Path) -> None:
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=SECONDS_MAX,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise InputError("CC", "", f"{error}", "a C99 compiler") from None
    if done.returncode != 0:
        said = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr)
        found = said.strip()[:200] or f"exit status {done.returncode}"
        raise InputError("CC", command[0], found, "a C99 compiler that makes shared objects")
