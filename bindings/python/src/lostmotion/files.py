"""File access: all errors are reported, files are written atomically.

Commands and workbench use these functions to check that a file is readable, not too large, not an
input, and that its target is writable.
"""

from __future__ import annotations

import contextlib
import csv
import io
import logging
import os
import stat
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path

from lostmotion.errors import InputError

LOG = logging.getLogger(__name__)


def reason(error: Exception) -> str:
    """Return the reason why a file could not be used."""
    if isinstance(error, FileNotFoundError):
        return "no such file"
    if isinstance(error, IsADirectoryError):
        return "a folder"
    if isinstance(error, MemoryError):
        return "not enough memory"
    return (error.strerror if isinstance(error, OSError) else str(error)) or "an error"


TEXT_BYTES_MAX = 1 << 24
"""Largest size of a drive file or a search spec: 16 MiB, chosen. The largest that a command
writes, a fit with many effects and their covariance, has 0.1 MiB."""

PIPE_BYTES_MAX = 1 << 28
"""Largest size read from a pipe or a device: 256 MiB, chosen. Their size is unknown, and
``/dev/zero`` is endless.
"""


def read_bytes(path: str | Path, expected: str, most: int | None = None) -> bytes:
    """Read a file, or a pipe to its end.

    Parameters
    ----------
    path : str or Path
    expected : str
        What the file should be, for messages.
    most : int, optional
        Largest size in bytes; by default unlimited for a file, `PIPE_BYTES_MAX` for a pipe.

    Raises
    ------
    InputError
        If it does not exist, cannot be read, or is larger.
    """
    try:
        with open(path, "rb") as stream:
            mode = os.fstat(stream.fileno())
            if most is None and not stat.S_ISREG(mode.st_mode):
                most = PIPE_BYTES_MAX
            if most is None:
                return stream.read()
            data = b"" if mode.st_size > most else stream.read(most + 1)
            if mode.st_size <= most and len(data) <= most:
                return data
    except (OSError, ValueError, MemoryError) as error:  # ValueError: an invalid path
        raise InputError(path, "", reason(error), expected) from None
    raise InputError(path, "", f"more than {most} bytes", expected)


def check_place(option: str, path: str | Path) -> None:
    """Refuse a path that cannot be written, before any work.

    Raises
    ------
    InputError
        Names the option and the path.
    """
    try:
        if "\0" in str(path):
            found = "a path that contains a NUL"
        elif is_stream(path):
            return
        elif (place := Path(os.path.realpath(path))).is_dir():
            found = f"the folder '{path}'"
        elif not place.parent.is_dir():
            found = f"'{path}', whose folder does not exist"
        elif not os.access(place.parent, os.W_OK):
            found = f"'{path}', whose folder cannot be written to"
        else:
            return
    except (OSError, ValueError) as error:
        found = f"'{path}' ({reason(error)})"
    raise InputError(option, "", found, "a file in a folder that exists")


def check_plain(path: str | Path, expected: str) -> None:
    """Refuse a pipe or a device: opening one may block.

    Raises
    ------
    InputError
        `expected` describes the required input.
    """
    if is_stream(path):
        raise InputError(path, "", "a pipe or a device", expected)


def is_inside(path: str | Path, roots: Iterable[str | Path]) -> bool:
    """Whether a path is inside one of several folders, after resolving links."""
    place = Path(os.path.realpath(path))
    return any(place.is_relative_to(os.path.realpath(root)) for root in roots)


def is_input(
    path: str | Path, inputs: Iterable[str], suffixes: tuple[str, ...] = ("",)
) -> str | None:
    """Return the input that a path refers to, by any name, or None.

    Parameters
    ----------
    path : str or Path
        Place of a result.
    inputs : iterable of str
        Files and folders that are read.
    suffixes : tuple of str
        Suffixes of the files that are read in a folder.
    """
    place = Path(os.path.realpath(path))
    for name in inputs:
        other = Path(os.path.realpath(name))
        try:
            if place == other or (place.exists() and place.samefile(other)):
                return name
            inside = other.is_dir() and place.parent == other and place.exists()
        except (OSError, ValueError):  # not accessible: neither an input nor a target
            continue
        if inside and place.name.lower().endswith(suffixes):
            return f"{name}/{place.name}".replace("//", "/")
    return None


def is_stream(path: str | Path) -> bool:
    """Whether a path is a pipe or a device: written to, never replaced."""
    path = Path(path)
    try:
        return path.exists() and not (path.is_file() or path.is_dir())
    except (OSError, ValueError):  # an invalid path: opening it reports the error
        return False


REPLACE_TRIES = 20
"""Number of attempts to rename a file that Windows reports as open in another program: virus
scanners and indexers open new files briefly. Chosen: one second, as in the C part.
"""

REPLACE_WAIT_S = 0.05
"""Time between two attempts."""


def csv_text(head: Iterable[object], rows: Iterable[Iterable[object]]) -> str:
    """Write a table as CSV."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([head, *rows])
    return stream.getvalue()


def replace(beside: str | Path, place: str | Path) -> None:
    """Rename a file to its target atomically."""
    for _ in range(REPLACE_TRIES - 1):
        try:
            os.replace(beside, place)
            return
        except PermissionError:
            if os.name != "nt":
                raise
        time.sleep(REPLACE_WAIT_S)
    os.replace(beside, place)


def write_whole(path: str | Path, content: str | bytes) -> None:
    """Write a temporary file next to the target and rename it, so that no partial file is visible.

    Links are followed; pipes and devices are written directly.

    Raises
    ------
    InputError
        If the folder does not exist or is not writable.
    """
    path = Path(path)
    # A file name may contain bytes that are not text; they are shown, not lost.
    data = content.encode(errors="backslashreplace") if isinstance(content, str) else content
    try:
        if is_stream(path):
            path.write_bytes(data)
            return
        place = Path(os.path.realpath(path))
        handle, beside = tempfile.mkstemp(prefix=f".{place.name}.", dir=place.parent)
    except (OSError, ValueError) as error:
        found = "no such folder" if isinstance(error, FileNotFoundError) else reason(error)
        raise InputError(path, "", found, "a place to write to") from None
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(beside, 0o666 & ~mask)
        replace(beside, place)
        LOG.info("wrote %s, %d bytes", path, len(data))
    except OSError as error:
        raise InputError(path, "", reason(error), "a place to write to") from None
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(beside)
