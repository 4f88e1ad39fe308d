"""What the demonstration reads: in the installed package, copied to where the reader can see it."""

from __future__ import annotations

from pathlib import Path

from lostmotion.files import write_whole
from lostmotion.shipped import FIRMWARE, find_inputs


def copy_inputs(folder: Path) -> None:
    """Copy drive files, recordings and specs to where the reader can look at and change them."""
    source = find_inputs()
    for file in sorted(source.rglob("*")):
        inside = file.relative_to(source)
        if file.is_file() and inside.parts[0] != FIRMWARE:
            target = folder / inside
            target.parent.mkdir(parents=True, exist_ok=True)
            write_whole(target, file.read_bytes())
