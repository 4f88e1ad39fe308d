"""A dress: files as a program writes them, and the expected result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from .clean import Sheet

SAME = "same"
"""The answer of the clean copy."""
REFUSED = "refused"
"""Exit status 2 with one line on standard error."""
EITHER = "same or refused"
"""One of these two; no other answer is permitted."""

Writer = Callable[[Path, Sheet], "Path | list[Path]"]


@dataclass(frozen=True)
class Dress:
    """A format in which the campaign may be given.

    Attributes
    ----------
    name : str
        Program that writes this format.
    write : callable
        Writes the files into a folder; returns the paths for the command line.
    maps : tuple of str
        The ``--map`` options that a user would give.
    expected : str
        `SAME`, `REFUSED` or `EITHER`.
    reason : str
        Why it is not `SAME`.
    says : tuple of str
        Words that the refusal must contain.
    """

    name: str
    write: Writer
    maps: tuple[str, ...] = ()
    expected: str = SAME
    reason: str = ""
    says: tuple[str, ...] = ()


DRESSES: dict[str, Dress] = {}


def dress(
    name: str,
    *maps: str,
    expected: str = SAME,
    reason: str = "",
    says: tuple[str, ...] = (),
) -> Callable[[Writer], Writer]:
    """Add a writer to the list."""
    assert name not in DRESSES, name
    assert (expected == SAME) == (not reason), name

    def enter(write: Writer) -> Writer:
        DRESSES[name] = Dress(name, write, maps, expected, reason, says)
        return write

    return enter


def save(
    folder: Path, text: str, name: str = "log.csv", encoding: str = "utf-8", mark: bytes = b""
) -> Path:
    """Write text as bytes of an encoding, after a byte order mark."""
    file = folder / name
    file.write_bytes(mark + text.encode(encoding))
    return file


def quoted(text: str) -> str:
    """Put double quotes around a cell."""
    return f'"{text}"'
