"""Compressed recordings, inflated up to a known bound."""

from __future__ import annotations

import gzip
import io
import zlib
from pathlib import Path

from lostmotion.errors import InputError

GZIP = b"\x1f\x8b"
"""First bytes of a gzip file."""

INFLATED_LEAST = 1 << 25
"""Content up to which no compressed file is refused, however small the file: 32 MiB, as text about
half a million rows."""

INFLATION_MAX = 16
"""Largest ratio of content to size beyond that. Sensor data compress to a fifth or a tenth; zeros
to a thousandth.
"""


def inflation_bound(size: int) -> int:
    """Largest inflated size in bytes of compressed recordings of this compressed size."""
    return max(INFLATED_LEAST, INFLATION_MAX * size)


def inflate(file: str | Path, packed: bytes, most: int | None = None) -> bytes:
    """Inflate a gzip of one or more members.

    Parameters
    ----------
    file : str or Path
        For messages.
    packed : bytes
    most : int, optional
        Return at most this number of bytes from the beginning.

    Raises
    ------
    InputError
        If it is damaged, or larger than the bound.
    """
    bound = inflation_bound(len(packed))
    size = bound + 1 if most is None else min(most, bound + 1)
    try:
        with gzip.open(io.BytesIO(packed)) as members:
            found = members.read(size)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(
            file, "", f"unreadable gzip ({error})", "a complete .csv.gz file"
        ) from None
    if len(found) > bound:
        raise InputError(
            file,
            "",
            f"a gzip that contains more than {bound >> 20} MiB",
            f"at most {INFLATED_LEAST >> 20} MiB, or {INFLATION_MAX} times the "
            "file; Parquet for more",
        )
    return found
