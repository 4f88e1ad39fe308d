"""Disclosure: the page never quotes files other than drive files, specs and recordings."""

from __future__ import annotations

import re
import zlib
from pathlib import Path

from lostmotion.errors import InputError, LostMotionError, one_line
from lostmotion.files import is_stream
from lostmotion.recordings.quantities import QUANTITIES

HEAD_BYTES = 65_536
"""Number of bytes of a file that are examined; a header line is shorter."""

TABLE = re.compile(rb"^\s*\[\[?\s*(drive|search)\s*\]", re.MULTILINE)
"""A table that drive files and search specs have."""

COLUMN = re.compile(rf"(?:^|[^a-z])(?:{'|'.join(sorted(QUANTITIES))})_[a-z]", re.IGNORECASE)
"""A column of a recording, with its unit."""


def public_message(error: LostMotionError) -> str:
    """Return the message of an error, or a neutral one if it would quote a file of another kind.

    A page can be made to name any file that its user can read, such as a key or a password list.
    The answer must not depend on its content.
    """
    if isinstance(error, InputError) and not is_known(error.file):
        expected = "a drive file, a search spec or a recording"
        error = InputError(error.file, "", "a file of another kind", expected)
    return one_line(str(error))


def is_known(file: str) -> bool:
    """Whether a name is that of a drive file, a search spec, a recording, or no file."""
    path = Path(file)
    try:
        if is_stream(path) or not path.is_file():
            return True
        with path.open("rb") as stream:
            head = stream.read(HEAD_BYTES)
    except (OSError, ValueError):
        return True
    if head.startswith(b"\x1f\x8b"):
        try:
            head = zlib.decompressobj(wbits=31).decompress(head, HEAD_BYTES)
        except zlib.error:
            return False
    if head.startswith(b"PAR1") or TABLE.search(head.removeprefix(b"\xef\xbb\xbf")):
        return True
    return is_recording(head.decode("utf-8", errors="replace"))


def is_recording(text: str) -> bool:
    """Whether a text starts like a table of measured values."""
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")][:2]
    if lines and COLUMN.search(lines[0]):
        return True
    if len(lines) < 2:
        return False
    fields = re.split(r"[,;\t]", lines[1])
    return len(fields) > 1 and sum(map(is_number, fields)) > len(fields) / 2


def is_number(text: str) -> bool:
    """Whether a field of a table is a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True
