"""What the demonstration reads: in the installed package, copied to where the reader can see it."""

from __future__ import annotations

from pathlib import Path

import lostmotion
from lostmotion.errors import InputError
from lostmotion.files import write_whole

INPUTS = "demo_inputs"
"""Folder of the package that holds what the demonstration reads."""

FIRMWARE = "firmware"
"""Folder within it with the controller's sources, which are not copied."""


def find_inputs() -> Path:
    """Find the folder with the inputs in the installed package.

    Raises
    ------
    InputError
        When the package was installed without it.
    """
    for place in lostmotion.__path__:
        if (Path(place) / INPUTS).is_dir():
            return Path(place) / INPUTS
    raise InputError("lostmotion", INPUTS, "no such folder", "a complete installation")


def copy_inputs(folder: Path) -> None:
    """Copy drive files, recordings and specs to where the reader can look at and change them."""
    source = find_inputs()
    for file in sorted(source.rglob("*")):
        inside = file.relative_to(source)
        if file.is_file() and inside.parts[0] != FIRMWARE:
            target = folder / inside
            target.parent.mkdir(parents=True, exist_ok=True)
            write_whole(target, file.read_bytes())
