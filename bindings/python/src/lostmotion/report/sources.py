"""Sources of a report: files and their fingerprints."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

from lostmotion.drives import Drive

CHUNK = 1 << 20
"""Number of bytes that are read at a time."""


def file_fingerprint(path: str | Path) -> str:
    """SHA-256 of a file."""
    digest = hashlib.sha256()
    with open(path, "rb") as stream:
        while piece := stream.read(CHUNK):
            digest.update(piece)
    return "sha256:" + digest.hexdigest()


def sources_of(
    drive: Drive, files: Sequence[str | Path], data_fingerprint: str
) -> list[tuple[str, str]]:
    """List drive file and recordings."""
    return [
        (f"drive file {drive.file}", file_fingerprint(drive.file)),
        *((f"recording {path}", file_fingerprint(path)) for path in files),
        ("numbers of the recordings as they are used", data_fingerprint),
    ]
