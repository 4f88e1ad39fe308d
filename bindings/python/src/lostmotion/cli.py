"""The command ``lostmotion``."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import logging
import os
import re
import shlex
import sys
from collections.abc import Iterator, Sequence

from lostmotion.commands.parser import BAD_INPUT, make_parser
from lostmotion.errors import InputError, LostMotionError, one_line
from lostmotion.files import check_place, reason
from lostmotion.terminal import TerminatedError, ending_in_order

DONE, FAILED, INTERRUPTED = 0, 1, 130
"""Exit statuses beside that of bad input."""

SIGNALLED = 128
"""Added to the number of the signal that ended a command, as shells do."""

WRITERS = ("fit", "export")
"""Commands whose output is one file, not a folder."""

SIGNED_OPTIONS = ("--torque", "--phase-deg", "--angles-deg", "--ratio")
"""Options whose value may begin with a minus sign."""


REPEATED_OPTIONS = {"--add": re.compile(r"\w+"), "--map": re.compile(r".+=.+")}
"""Options that may be given several values at once, and what such a value looks like."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status."""
    parser = make_parser()
    words = sys.argv[1:] if argv is None else argv
    try:
        arguments = parser.parse_args(join_signed(repeat_options(words)))
        arguments.command_line = shlex.join(["lostmotion", *words])
        if arguments.command is None:
            parser.print_help()
            sys.stdout.flush()
            raise InputError("COMMAND", "", "none", "one of those above, e.g. lostmotion predict")
        check_places(arguments)
        with ending_in_order(), loudness(arguments):
            module, _, function = arguments.run.partition(":")
            getattr(importlib.import_module(module), function)(arguments)
        sys.stdout.flush()
    except SystemExit as stop:
        return int(stop.code or 0)
    except InputError as error:
        print(f"lostmotion: {error}", file=sys.stderr)
        return BAD_INPUT
    except LostMotionError as error:
        print(f"lostmotion: {one_line(str(error))}", file=sys.stderr)
        return FAILED
    except TerminatedError as signalled:
        print(f"lostmotion: ended by signal {signalled.number}", file=sys.stderr)
        return SIGNALLED + signalled.number
    except KeyboardInterrupt:
        print("lostmotion: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # Nobody reads any more; keep the interpreter from complaining about it on its way out.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except (OSError, MemoryError) as error:
        # A full disk behind standard output, a machine that is too small: no fault of the input.
        print(f"lostmotion: {one_line(reason(error))}", file=sys.stderr)
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    return DONE


def join_signed(argv: Sequence[str]) -> list[str]:
    """Join options to values that begin with a minus sign, which argparse takes for options."""
    joined: list[str] = []
    for word in argv:
        if joined and joined[-1] in SIGNED_OPTIONS and word.startswith("-"):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def repeat_options(argv: Sequence[str]) -> list[str]:
    """Put an option before each of several values: ``--add wear creep`` is two ``--add``.

    What follows and is a file is none: ``--add wear recordings`` ends with the recordings.
    """
    repeated: list[str] = []
    option = ""
    for before, word in zip(("", *argv), argv, strict=False):
        if word.startswith("-") and before not in REPEATED_OPTIONS:
            option = word.partition("=")[0]
        elif option in REPEATED_OPTIONS and before != option:
            if REPEATED_OPTIONS[option].fullmatch(word) and not os.path.lexists(word):
                repeated.append(option)
            else:
                option = ""
        repeated.append(word)
    return repeated


def check_places(arguments: argparse.Namespace) -> None:
    """Refuse places that cannot be written to, or that hold an input, before any work."""
    if getattr(arguments, "output", None) == "":  # an unset variable, not the folder at hand
        raise InputError("--output", "", "''", "the name of a file or folder")
    taken = {name: f"the input '{name}'" for name in input_files(arguments)}
    options = ["json", "report", "table", "save-evidence"]
    if arguments.command in WRITERS:
        options.insert(0, "output")
    for option in options:
        file = getattr(arguments, option.replace("-", "_"), None)
        if file is None or (option, file) == ("json", "-"):
            continue
        check_place(f"--{option}", file)
        place = os.path.realpath(file)
        for other, what in taken.items():
            if os.path.realpath(other) == place:
                raise InputError(f"--{option}", "", what, "a file of its own")
        taken[file] = f"the place of --{option}, '{file}'"


def input_files(arguments: argparse.Namespace) -> list[str]:
    """Files that a command line names for reading."""
    several = ("data", "evidence", "plan", "effects")
    data = [file for name in several for file in getattr(arguments, name, None) or []]
    named = [getattr(arguments, name, None) for name in ("drive", "spec")]
    return [name for name in [*named, *data] if name and "\0" not in name]


@contextlib.contextmanager
def loudness(arguments: argparse.Namespace) -> Iterator[None]:
    """Let ``--verbose`` show on standard error what the library logs, while a command runs."""
    if not getattr(arguments, "verbose", False):
        yield
        return
    log = logging.getLogger("lostmotion")
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("lostmotion: %(relativeCreated)6.0f ms: %(message)s"))
    level = log.level
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(level)
