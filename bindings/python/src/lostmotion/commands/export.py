"""The command ``lostmotion export``."""

from __future__ import annotations

import argparse
from pathlib import Path

from lostmotion.drives import read_drive
from lostmotion.effects.library import library
from lostmotion.errors import InputError
from lostmotion.export import Profile, export, make_controller, read_settings, show_export
from lostmotion.fit.drive_file import require_within_bounds, written_effects
from lostmotion.options import own_effects
from lostmotion.terminal import deliver


def run_export(arguments: argparse.Namespace) -> None:
    """``lostmotion export``."""
    settings = read_settings(arguments.set)
    drive = read_drive(arguments.drive)
    own = {**own_effects(arguments), **written_effects(drive)}
    if not arguments.force:
        require_within_bounds(drive, {**library(), **own})
    if Path(arguments.output).suffix == ".fmu":
        from lostmotion.simulators.fmu import export_fmu

        profile: Profile = arguments.profile or "full"
        if profile == "gap":
            raise InputError("--profile", "", "gap", "standard or full: an FMU has a torque")
        answer = export_fmu(
            make_controller(drive, settings, profile=profile, own=own),
            arguments.output,
            kind=arguments.fmu or "torque",
            version=3 if arguments.fmi == "3" else 2,
            ratio=drive.ratio,
            title=drive.name,
        )
    else:
        for option in ("fmu", "fmi"):
            if getattr(arguments, option) is not None:
                found = f"it with {Path(arguments.output).name}"
                raise InputError(f"--{option}", "", found, "a name that ends in .fmu")
        profile = arguments.profile or "standard"
        controller = make_controller(drive, settings, profile=profile, own=own)
        answer = export(controller, arguments.output, name=arguments.name, title=drive.name)
    deliver(answer, arguments, lambda out: show_export(answer, out))
