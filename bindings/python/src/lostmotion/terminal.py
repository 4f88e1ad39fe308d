"""Output of commands: tables, JSON, a progress bar, and handling of signals."""

from __future__ import annotations

import argparse
import contextlib
import json
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from lostmotion.errors import TerminatedError, one_line
from lostmotion.files import write_whole


def deliver(
    answer: dict[str, Any], arguments: argparse.Namespace, show: Callable[[], None]
) -> None:
    """Print the answer as text, or write it as JSON, or both if the JSON goes to a file."""
    to = arguments.json
    if to == "-":
        print(json.dumps(answer, indent=1, allow_nan=False))
        return
    if to is not None:
        write_whole(to, json.dumps(answer, indent=1, allow_nan=False) + "\n")
    if arguments.quiet:
        return
    show()
    made = [file for file in (getattr(arguments, "report", None), to) if file is not None]
    if made:
        print(f"\nwritten: {', '.join(map(one_line, made))}")


@contextlib.contextmanager
def ending_in_order() -> Iterator[None]:
    """Convert SIGTERM and SIGHUP to `TerminatedError`; an ignored signal (nohup) stays ignored."""
    names = [name for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    numbers = [getattr(signal, name) for name in names]
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, _: object) -> None:
        raise TerminatedError(number)

    before = {n: signal.getsignal(n) for n in numbers}
    taken = [n for n in numbers if before[n] == signal.SIG_DFL]
    for n in taken:
        signal.signal(n, end)
    try:
        yield
    finally:
        for n in taken:
            signal.signal(n, before[n])


class Progress:
    """A progress bar on a terminal; nothing in a pipe, and nothing with ``--quiet``."""

    WIDTH = 30

    def __init__(self, label: str, *, quiet: bool = False) -> None:
        self.label = label
        self.shown = sys.stderr.isatty() and not quiet

    def __enter__(self) -> Progress:
        return self

    def __call__(self, done: int, steps: int, step: str = "") -> None:
        """Draw the bar at `done` of `steps`, and name the current step."""
        if self.shown:
            full = self.WIDTH * done // max(steps, 1)
            bar = "#" * full + "." * (self.WIDTH - full)
            line = f"\r\033[K{self.label} [{bar}] {done}/{steps} {step}".rstrip()
            print(line, end="", file=sys.stderr, flush=True)

    def __exit__(self, *_: object) -> None:
        if self.shown:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


def show_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print columns aligned to the right."""
    widths = [max(len(line[i]) for line in (head, *rows)) for i in range(len(head))]
    for line in (head, *rows):
        cells = (cell.rjust(width) for cell, width in zip(line, widths, strict=True))
        print("  ".join(cells))


def fixed(value: float | None, digits: int = 3) -> str:
    """Format a number, or a dash for none; zero has no sign."""
    return "-" if value is None else f"{round(value, digits) + 0.0:.{digits}f}"


def show_list(heading: str, lines: Iterable[str], *, before: str = "\n") -> None:
    """Print lines under a heading; nothing if there are none."""
    text = "".join(f"  {line}\n" for line in lines)
    if text:
        print(f"{before}{heading}:\n{text}", end="")


def show_findings(findings: Sequence[str]) -> None:
    """Print findings about the data before the results."""
    if findings:
        show_list("about the data", findings, before="")
        print()
