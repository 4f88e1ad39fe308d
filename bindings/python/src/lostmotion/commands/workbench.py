"""The command ``lostmotion workbench``."""

from __future__ import annotations

import argparse
import importlib.util

from lostmotion.errors import InputError, LostMotionError
from lostmotion.options import effects_of, whole_number

PORT_MAX = 65535


def run_workbench(arguments: argparse.Namespace) -> None:
    """``lostmotion workbench``."""
    if arguments.json is not None:
        raise InputError(
            "--json", "", f"'{arguments.json}'", "no --json: the workbench writes no JSON answer"
        )
    port = None if arguments.port is None else whole_number("--port", arguments.port, 0, PORT_MAX)
    if importlib.util.find_spec("nicegui") is None:
        raise LostMotionError("the workbench needs NiceGUI: pip install nicegui")
    from lostmotion.workbench.serve import serve

    serve(
        arguments.drive,
        arguments.data,
        arguments.map,
        join=arguments.join,
        effects=effects_of(arguments),
        port=port,
        show=not arguments.no_browser,
        quiet=arguments.quiet,
        roots=arguments.root,
    )
