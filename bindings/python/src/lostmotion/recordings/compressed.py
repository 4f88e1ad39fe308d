"""Compressed recordings, inflated up to a known bound."""

from __future__ import annotations

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

STEP = 1 << 20
"""Bytes that are inflated at a time."""

AROUND_GZIP = 31
"""Window bits by which zlib reads gzip (zlib.h: 15, and 16 for the gzip header)."""


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
    found: list[bytes] = []
    size = 0
    try:
        while packed:
            if found and not packed.startswith(GZIP):
                if packed.strip(b"\0"):
                    raise zlib.error("other data after it")
                break
            member = zlib.decompressobj(AROUND_GZIP)
            while not member.eof:
                piece = member.decompress(packed, STEP)
                packed = member.unconsumed_tail or member.unused_data
                if not piece and not packed and not member.eof:
                    raise zlib.error("cut off")
                found.append(piece)
                size += len(piece)
                if size > bound:
                    raise InputError(
                        file,
                        "",
                        f"a gzip that contains more than {bound >> 20} MiB",
                        f"at most {INFLATED_LEAST >> 20} MiB, or {INFLATION_MAX} times the "
                        "file; Parquet for more",
                    )
                if most is not None and size >= most:
                    return b"".join(found)[:most]
    except zlib.error as error:
        raise InputError(
            file, "", f"unreadable gzip ({error})", "a complete .csv.gz file"
        ) from None
    return b"".join(found)
