"""Files in the package: inputs of the demo, the C headers, the controller's sources."""

from __future__ import annotations

from pathlib import Path

import lostmotion
from lostmotion.errors import InputError

INPUTS = "demo_inputs"
"""Folder of the package with the input files of the demonstration."""

FIRMWARE = "firmware"
"""Folder within it with the controller's sources, which are not copied."""


def find_inputs() -> Path:
    """Find the folder with the inputs in the installed package.

    Raises
    ------
    InputError
        If the package was installed without it.
    """
    for place in lostmotion.__path__:
        if (Path(place) / INPUTS).is_dir():
            return Path(place) / INPUTS
    raise InputError("lostmotion", INPUTS, "no such folder", "a complete installation")


def include_folder() -> Path:
    """Find the folder with the C headers in the installed package: `-I` of an effect in C."""
    return find_inputs() / FIRMWARE / "lib" / "include"
