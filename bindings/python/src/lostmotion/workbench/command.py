"""The command ``lostmotion workbench``."""

from __future__ import annotations

import argparse
import importlib.util

from lostmotion.errors import InputError, LostMotionError

PORT_MAX = 65535


def run_workbench(arguments: argparse.Namespace) -> None:
    """``lostmotion workbench``."""
    if arguments.json is not None:
        raise InputError("--json", "", f"'{arguments.json}'", "no --json: a page has no answer")
    port = arguments.port
    if port is not None and not (port.isascii() and port.isdecimal() and int(port) <= PORT_MAX):
        raise InputError("--port", "", f"'{port}'", f"an integer from 0 to {PORT_MAX}")
    if importlib.util.find_spec("nicegui") is None:
        raise LostMotionError("the workbench needs NiceGUI: pip install nicegui")
    from lostmotion.workbench.serve import serve

    serve(
        arguments.drive,
        arguments.data,
        arguments.map,
        port=None if port is None else int(port),
        show=not arguments.no_browser,
        quiet=arguments.quiet,
    )
