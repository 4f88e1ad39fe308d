"""An output folder in which a command replaces only its own files.

A list in the folder has the SHA-256 of each file, or none while a command is running, so that a
killed command can start again.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from pathlib import Path

from lostmotion.errors import InputError
from lostmotion.files import read_bytes, reason, write_whole

LIST = ".lostmotion-files"
"""Name of the list; its lines are those of ``sha256sum``: checksum, then file name."""

AT_WORK = "-" * 64
"""Replaces a checksum while a command is running."""


def claim(folder: str | Path, names: Iterable[str]) -> None:
    """Make a folder; refuse one with files that the command did not write.

    Parameters
    ----------
    folder : str or Path
    names : iterable of str
        Files to be written, relative to the folder.

    Raises
    ------
    InputError
        If the folder cannot be created or written to, or has such a file; the message names it.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise InputError(folder, "", reason(error), "a folder to write to") from None
    known = read_list(folder)
    names = sorted(Path(name).as_posix() for name in names)
    for name in names:
        file = folder / name
        if os.path.lexists(file) and not is_own(file, known.get(name)):
            found = "a file that this command did not write, or that was changed since"
            raise InputError(file, "", found, "another folder, or a file of another name")
    write_list(folder, {**known, **dict.fromkeys(names, AT_WORK)})


def release(folder: str | Path) -> None:
    """Record the checksums of the written files, so that later changes are detected."""
    folder = Path(folder)
    known = read_list(folder)
    kept = (name for name in known if (folder / name).is_file())
    write_list(folder, {name: sum_of(folder / name) for name in kept})


def is_own(file: Path, known: str | None) -> bool:
    """Whether the command wrote a file: not a link, and with the recorded checksum."""
    if file.is_symlink() or not file.is_file():
        return False
    return known == AT_WORK or known == sum_of(file)


def sum_of(file: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(read_bytes(file, "a file")).hexdigest()


def read_list(folder: Path) -> dict[str, str]:
    """Checksum of each file by its name; empty if there is no list."""
    if not (folder / LIST).is_file():
        return {}
    text = read_bytes(folder / LIST, "a list of files").decode(errors="replace")
    lines = (line.partition("  ") for line in text.splitlines())
    return {name: known for known, _, name in lines if name}


def write_list(folder: Path, known: dict[str, str]) -> None:
    """Write the complete list."""
    lines = [f"{known[name]}  {name}\n" for name in sorted(known)]
    write_whole(folder / LIST, "".join(lines))
