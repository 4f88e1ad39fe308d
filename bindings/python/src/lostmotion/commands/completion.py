"""The command ``lostmotion completion``: a script that the shell reads once."""

from __future__ import annotations

import argparse

import shtab

from lostmotion.commands.parser import FOLDER, make_parser
from lostmotion.terminal import deliver

FILES = ("DRIVE", "DATA", "LOG", "PLAN", "OPTIONS", "FILE", "FITTED", "SHEET", "SPEC", "EVIDENCE")
"""Beginnings of the names of arguments that are files."""


def run_completion(arguments: argparse.Namespace) -> None:
    """``lostmotion completion``."""
    script = completion_script(make_parser(), arguments.shell)
    answer = {"schema": "lostmotion.completion/1", "shell": arguments.shell, "script": script}
    deliver(answer, arguments, lambda: print(script))


def completion_script(parser: argparse.ArgumentParser, shell: str) -> str:
    """Write the completion script of a parser and all its commands.

    Parameters
    ----------
    parser : ArgumentParser
    shell : str
        One of the parser's `SHELLS`.
    """
    mark_places(parser)
    return str(shtab.complete(parser, shell))


def mark_places(parser: argparse.ArgumentParser) -> None:
    """Mark the arguments of all commands that are files or folders, by their names."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                mark_places(command)
            continue
        name = str(action.metavar)
        if name == FOLDER:
            action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]
        elif name.startswith(FILES):
            action.complete = shtab.FILE  # type: ignore[attr-defined]
