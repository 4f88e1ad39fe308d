"""Parameters for the controller as files: a drive file becomes a C header or a binary blob."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from lostmotion.controller.effects import known_effects
from lostmotion.controller.from_drive import (
    PROFILES,
    SETTINGS,
    Controller,
    Envelope,
    Limits,
    Play,
    Profile,
    Validity,
    Watch,
    make_controller,
    read_settings,
)
from lostmotion.controller.header import format_header
from lostmotion.controller.parameters import build, format_blob
from lostmotion.errors import InputError
from lostmotion.files import write_whole

__all__ = [
    "PROFILES",
    "SETTINGS",
    "Controller",
    "Envelope",
    "Limits",
    "Play",
    "Profile",
    "Validity",
    "Watch",
    "build",
    "describe_export",
    "export",
    "format_blob",
    "format_header",
    "known_effects",
    "make_controller",
    "read_settings",
]


def export(controller: Controller, file: str | Path, *, name: str, title: str) -> dict[str, Any]:
    """Write ``.h`` or ``.bin`` atomically, and return the answer of the command.

    Raises
    ------
    InputError
        When the file has another suffix, or the library refuses the parameters.
    """
    path = Path(file)
    if path.suffix not in (".h", ".bin"):
        raise InputError("--output", "", f"'{path.name}'", "a name that ends in .h, .bin or .fmu")
    content = (
        format_blob(controller) if path.suffix == ".bin" else format_header(controller, name, title)
    )
    sources = _own_sources(controller, path.parent)
    write_whole(path, content)
    for source, text in sources.items():
        write_whole(source, text)
    return describe_export(controller, path, [str(source) for source in sources])


def describe_export(
    controller: Controller, path: Path, sources: Sequence[str] = ()
) -> dict[str, Any]:
    """Return the answer of the command."""
    blob = format_blob(controller)
    return {
        "schema": "lostmotion.export/1",
        "file": str(path),
        "fingerprint": f"{int.from_bytes(blob[-4:], 'little'):08x}",
        "blob_bytes": len(blob),
        "knots": int(controller.torque_Nm.size),
        "plays_outside": len(controller.outside),
        "plays_inside": len(controller.inside),
        "effects": [effect for effect, _ in controller.effects],
        "sources": list(sources),
        "torque_limit_Nm": controller.torque_limit_Nm,
        "dead_band_rad": controller.dead_band_rad,
        "limits": asdict(controller.limits),
        "watch": asdict(controller.watch),
        "valid": asdict(controller.valid),
        "notes": list(controller.notes),
    }


def _own_sources(controller: Controller, folder: Path) -> dict[Path, str]:
    """C files of user effects; effects from C already have a file.

    Raises
    ------
    InputError
        When an effect is a Python function.
    """
    from lostmotion.effects.formula import write_c

    made = {
        folder / f"{effect.name}.c": write_c(effect)
        for effect in controller.own.values()
        if not effect.symbol
    }
    for file, text in made.items():
        if file.exists() and file.read_text(encoding="utf-8") != text:
            raise InputError(file, "", "an existing, different file", "an unused name")
    return made
