"""The command ``lostmotion workbench``."""

from __future__ import annotations

import argparse
import importlib.util

from lostmotion.errors import InputError, LostMotionError
from lostmotion.options import Command, add_map

PORT_MAX = 65535


def add_command(command: Command) -> None:
    """Add the command to the parser."""
    added = command(
        "workbench",
        run_workbench,
        "The same things in a local web page.",
        "lostmotion workbench drive.toml recordings/",
    )
    added.add_argument("drive", metavar="DRIVE", nargs="?", help="drive file")
    added.add_argument("data", metavar="DATA", nargs="*", help="recordings, or folders of them")
    added.add_argument("--port", metavar="N", help="of the page (default: a free one)")
    added.add_argument("--no-browser", action="store_true", help="print the address only")
    add_map(added)


def run_workbench(arguments: argparse.Namespace) -> None:
    """``lostmotion workbench``."""
    if arguments.json is not None:
        raise InputError("--json", "", f"'{arguments.json}'", "no --json: a page has no answer")
    port = arguments.port
    if port is not None and not (port.isascii() and port.isdecimal() and int(port) <= PORT_MAX):
        raise InputError("--port", "", f"'{port}'", f"an integer from 0 to {PORT_MAX}")
    if importlib.util.find_spec("nicegui") is None:
        raise LostMotionError("the workbench needs NiceGUI: pip install 'lostmotion[workbench]'")
    from lostmotion.workbench.serve import serve

    serve(
        arguments.drive,
        arguments.data,
        arguments.map,
        port=None if port is None else int(port),
        show=not arguments.no_browser,
        quiet=arguments.quiet,
    )
