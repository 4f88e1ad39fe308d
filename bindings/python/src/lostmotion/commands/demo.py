"""The command ``lostmotion demo``."""

from __future__ import annotations

import argparse

from lostmotion.demo import demonstrate, show_demonstration
from lostmotion.terminal import Progress, deliver


def run_demo(arguments: argparse.Namespace) -> None:
    """``lostmotion demo``."""
    with Progress("demonstrating", quiet=arguments.quiet) as progress:
        found = demonstrate(arguments.output, arguments.command_line, progress)
    deliver(found.answer(), arguments, lambda: show_demonstration(found))
