"""Options that several commands have, and how their values are read."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from typing import Any

from lostmotion.discover.effects import Effect, library, load
from lostmotion.errors import InputError

Command = Callable[[str, Callable[[Any], None], str, str], argparse.ArgumentParser]
"""Adds a command: its name, what runs it, what it does, an example."""


def add_drive(parser: argparse.ArgumentParser, what: str = "drive file") -> None:
    """Add the drive file."""
    parser.add_argument("drive", metavar="DRIVE", help=what)


def add_data(
    parser: argparse.ArgumentParser,
    metavar: str = "DATA",
    what: str = "recordings, or folders of them",
) -> None:
    """Add recordings, and the option that reads foreign column names."""
    parser.add_argument("data", metavar=metavar, nargs="+", help=what)
    add_map(parser)


def add_inputs(parser: argparse.ArgumentParser) -> None:
    """Add drive and recordings, which may be large."""
    add_drive(parser)
    add_data(parser)
    add_dask(parser)


def add_dask(parser: argparse.ArgumentParser) -> None:
    """Add the option that reads large recordings through Dask."""
    parser.add_argument(
        "--dask",
        nargs="?",
        const="local",
        metavar="ADDRESS",
        help="read large Parquet recordings through Dask, here or on the cluster at tcp://...",
    )


def add_effects(parser: argparse.ArgumentParser) -> None:
    """Add the option for the user's own effects."""
    parser.add_argument(
        "--effects",
        action="append",
        default=[],
        metavar="FILE",
        help="your own effects: a Python file, or a shared object made from C",
    )


def add_report(parser: argparse.ArgumentParser) -> None:
    """Add the option that writes a report."""
    parser.add_argument(
        "--report",
        metavar="FILE.html",
        help="write a page with pictures and the numbers behind them",
    )


def add_map(parser: argparse.ArgumentParser) -> None:
    """Add the option that reads foreign column names."""
    parser.add_argument(
        "--map",
        action="append",
        default=[],
        metavar="COLUMN=NAME_UNIT",
        help="what a foreign column is, with its unit; -NAME_UNIT turns its sign round",
    )


def add_phase(parser: argparse.ArgumentParser) -> None:
    """Add the tooth phase."""
    parser.add_argument("--phase-deg", default="0", help="tooth phase of the generator")


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Add the option that states what a drive file does not say of the controller."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY_UNIT=NUMBER",
        help="period, torque_limit, a limit of the correction or of the watch",
    )


def effects_of(arguments: argparse.Namespace) -> dict[str, Effect]:
    """Return the library's effects and the user's own."""
    found = dict(library())
    for file in arguments.effects:
        for name, effect in load(file).items():
            if name in found:
                raise InputError(file, name, "the name of another effect", "a name of its own")
            found[name] = effect
    return found


def number(option: str, text: str, limit: float) -> float:
    """Read a number of the command line whose size is at most `limit`."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(option, "", f"'{text}'", "a number")
    if abs(value) > limit:
        raise InputError(option, "", f"'{text}'", f"a number from {-limit:g} to {limit:g}")
    return value


def whole_number(option: str, text: str, low: int, high: int) -> int:
    """Read an integer of the command line."""
    digits = text.isascii() and text.isdecimal() and len(text) <= len(str(high))
    if not digits or not low <= int(text) <= high:
        raise InputError(option, "", f"'{text}'", f"an integer from {low} to {high}")
    return int(text)
