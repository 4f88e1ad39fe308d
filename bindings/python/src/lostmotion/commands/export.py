"""The command ``lostmotion export``."""

from __future__ import annotations

import argparse

from lostmotion.drives import read_drive
from lostmotion.export import export, make_controller, read_settings, show_export
from lostmotion.options import own_effects
from lostmotion.terminal import deliver


def run_export(arguments: argparse.Namespace) -> None:
    """``lostmotion export``."""
    settings = read_settings(arguments.set)
    drive = read_drive(arguments.drive)
    controller = make_controller(
        drive, settings, profile=arguments.profile, own=own_effects(arguments)
    )
    answer = export(controller, arguments.output, name=arguments.name, title=drive.name)
    deliver(answer, arguments, lambda out: show_export(answer, out))
