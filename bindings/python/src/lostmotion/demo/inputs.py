"""Input files of the demonstration, copied from the installed package into its folder."""

from __future__ import annotations

from pathlib import Path

from lostmotion.files import read_bytes, write_whole
from lostmotion.shipped import FIRMWARE, find_inputs


def input_names() -> list[str]:
    """List drive files, recordings and specs, relative to their folder."""
    source = find_inputs()
    inside = [file.relative_to(source) for file in sorted(source.rglob("*")) if file.is_file()]
    return [str(name) for name in inside if name.parts[0] != FIRMWARE]


def copy_inputs(folder: Path) -> None:
    """Copy drive files, recordings and specs to a folder in which the user can edit them."""
    source = find_inputs()
    for name in input_names():
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        write_whole(target, read_bytes(source / name, "an input of the demonstration"))
