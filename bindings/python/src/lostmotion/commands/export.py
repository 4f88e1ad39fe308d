"""The command ``lostmotion export``."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.drives import read_drive
from lostmotion.effects.library import library
from lostmotion.errors import InputError
from lostmotion.export import Profile, export, make_controller, read_settings
from lostmotion.fit.drive_file import require_within_bounds, written_effects
from lostmotion.options import own_effects
from lostmotion.terminal import deliver, show_list


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
                found = f"the option together with {Path(arguments.output).name}"
                raise InputError(f"--{option}", "", found, "a name that ends in .fmu")
        profile = arguments.profile or "standard"
        controller = make_controller(drive, settings, profile=profile, own=own)
        answer = export(controller, arguments.output, name=arguments.name, title=drive.name)
    deliver(answer, arguments, lambda: show_export(answer))


def show_export(answer: Mapping[str, Any]) -> None:
    """Print the answer of the command."""
    plays = answer["plays_outside"] + answer["plays_inside"]
    count = len(answer["effects"])
    effects = "1 effect" if count == 1 else f"{count} effects"
    print(f"written: {answer['file']} (fingerprint {answer['fingerprint']})\n")
    print(
        f"{answer['knots']} knots, {plays} operators, {effects}; "
        f"{answer['blob_bytes']} bytes as a blob"
    )
    for effect in answer["effects"]:
        print(f"  effect {effect}")
    for source in answer["sources"]:
        print(f"written: {source}, to be compiled with the library")
    if "fmi" in answer:
        binary = answer["binary"] or "none, sources only"
        print(f"\nFMI {answer['fmi']}, co-simulation; binary: {binary}")
        print(f"  inputs: {', '.join(answer['inputs'])}")
        print(f"  outputs: {', '.join(answer['outputs'])}")
        print(f"  parameters that may be tuned: {answer['tunable']}")
    if answer.get("kind", "compensator") == "compensator":
        limits = {**answer["limits"], **answer["watch"]}.items()
        show_list("limits of the correction", (f"{n} = {v:.6g}" for n, v in limits))
    ranges = (
        f"{name} = {' to '.join(f'{end:.6g}' for end in np.atleast_1d(value))}"
        for name, value in answer["valid"].items()
        if np.any(value)
    )
    show_list("fitted range", ranges)
    show_list("assumed", answer["notes"])
