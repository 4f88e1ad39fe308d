"""The command ``lostmotion``."""

from __future__ import annotations

import argparse
import atexit
import contextlib
import errno
import gc
import importlib
import io
import logging
import os
import re
import shlex
import sys
from collections.abc import Iterator, Sequence
from types import ModuleType

from lostmotion.commands.parser import BAD_INPUT, make_parser
from lostmotion.errors import InputError, LostMotionError, TerminatedError, one_line
from lostmotion.files import check_place, is_input, reason

DONE, FAILED, INTERRUPTED = 0, 1, 130
"""Exit statuses other than that of bad input."""

SIGNALLED = 128
"""Added to the number of the signal that ended a command, as shells do."""

PLACES = ("output", "json", "report", "table", "save-evidence")
"""Options for output files."""

RECORDINGS = (".csv", ".csv.gz", ".gz", ".parquet", ".tsv", ".txt", ".npz", ".npy", ".log")
"""Suffixes of files in a folder that may be read as recordings."""

SIGNED_OPTIONS = (
    "--torque",
    "--phase-deg",
    "--angles-deg",
    "--ratio",
    "--torque-constant-Nm-per-A",
)
"""Options whose value may begin with a minus sign."""


REPEATED_OPTIONS = {
    "--add": re.compile(r"\w+"),
    "--map": re.compile(r".+=.+"),
    "--set": re.compile(r".+=.+"),
}
"""Options that accept several values at once, and the pattern of such a value."""

ALLOCATOR = ("ARROW_DEFAULT_MEMORY_POOL", "system")
"""Setting of Arrow, whose own allocator reserves a gigabyte of addresses at the first array: half
of what a process limited to two may use."""

SPINNING = ("OPENBLAS_THREAD_TIMEOUT", "4")
"""Setting of OpenBLAS, whose idle threads otherwise occupy a core for 0.05 s when NumPy is loaded
and after each product."""

# The memory of a command ends with its process: it is not searched for garbage at the end.
atexit.register(gc.freeze)


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status."""
    os.environ.setdefault(*ALLOCATOR)
    os.environ.setdefault(*SPINNING)
    open_standard_streams()
    parser = make_parser()
    words = sys.argv[1:] if argv is None else argv
    arguments = argparse.Namespace()
    try:
        arguments = parser.parse_args(join_signed(repeat_options(words)))
        arguments.command_line = shlex.join(["lostmotion", *words])
        if arguments.command is None:
            parser.print_help()
            sys.stdout.flush()
            raise InputError("COMMAND", "", "none", "one of those above, e.g. lostmotion predict")
        check_places(arguments)
        from lostmotion.terminal import ending_in_order  # help and usage errors do not need it

        name, _, function = arguments.run.partition(":")
        with ending_in_order(), loudness(arguments), loaded(name) as module:
            getattr(module, function)(arguments)
        sys.stdout.flush()
    except SystemExit as stop:  # help, the version, and usage errors of argparse
        try:
            sys.stdout.flush()
        except OSError as error:
            return give_up_output(error)
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
    except MemoryError:
        largest = max(
            filter(os.path.isfile, input_files(arguments)), key=os.path.getsize, default=""
        )
        expected = "a smaller input, or --dask if the command has it"
        full = InputError(largest or "memory", "", "not enough memory to process it", expected)
        print(f"lostmotion: {full}", file=sys.stderr)
        return BAD_INPUT if largest else FAILED
    except OSError as error:
        return give_up_output(error)
    return DONE


@contextlib.contextmanager
def loaded(name: str) -> Iterator[ModuleType]:
    """Import a module. What it loads is not garbage: none is looked for there."""
    collects = gc.isenabled()
    gc.disable()
    try:
        module = importlib.import_module(name)
    finally:
        if collects:
            gc.enable()
    gc.freeze()
    try:
        yield module
    finally:
        gc.unfreeze()


def give_up_output(error: OSError) -> int:
    """Describe an output error, usually of standard output; not if its reader has closed the pipe.

    Output that the interpreter still writes at exit is discarded.
    """
    if error.filename is not None or isinstance(error, FileNotFoundError):
        # Errors of the system, not of an input: inputs are checked when they are opened.
        print(f"lostmotion: {one_line(str(error))}", file=sys.stderr)
        return FAILED
    if not isinstance(error, BrokenPipeError):
        closed = error.errno == errno.EBADF
        said = "standard output is closed" if closed else one_line(reason(error))
        print(f"lostmotion: {said}", file=sys.stderr)
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return FAILED


def open_standard_streams() -> None:
    """Open standard streams that the caller closed, so that no file gets their numbers.

    Writing to a closed standard output fails, as it should; messages for a closed standard error
    are lost. Pipes on Windows use UTF-8 like files.
    """
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        if getattr(sys, name) is not None:
            continue
        try:
            os.fstat(number)
        except OSError:
            opened = os.open(os.devnull, os.O_WRONLY if number == 2 else os.O_RDONLY)
            if opened != number:
                os.dup2(opened, number)
                os.close(opened)
        setattr(sys, name, os.fdopen(number, mode, closefd=False))
    if sys.platform == "win32":
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper) and not stream.isatty():
                stream.reconfigure(encoding="utf-8")


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

    A following word that is a file is not a value: ``--add wear recordings`` ends with the
    recordings.
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
    """Refuse output files that cannot be written or are inputs, before any work."""
    if getattr(arguments, "output", None) == "":  # an unset shell variable, not the current folder
        raise InputError("--output", "", "''", "the name of a file or folder")
    inputs = input_files(arguments)
    taken: dict[str, str] = {}
    for option in PLACES:
        file = getattr(arguments, option.replace("-", "_"), None)
        if file is None or (option, file) == ("json", "-"):
            continue
        if option == "output" and arguments.writes_folder:
            continue  # checked by the command, which knows the files of the folder
        check_place(f"--{option}", file)
        read = is_input(file, inputs, RECORDINGS)
        if read is not None:
            raise InputError(f"--{option}", "", f"the input '{read}'", "a separate file")
        other = is_input(file, taken)
        if other is not None:
            found = f"the file of --{taken[other]}, '{other}'"
            raise InputError(f"--{option}", "", found, "a separate file")
        taken[file] = option


def input_files(arguments: argparse.Namespace) -> list[str]:
    """Files and folders that a command line names as inputs."""
    places = {option.replace("-", "_") for option in PLACES}
    found: list[str] = []
    for name, value in vars(arguments).items():
        words = value if isinstance(value, list) else [value]
        if name not in places:
            found += [w for w in words if isinstance(w, str) and "\0" not in w and is_there(w)]
    return found


def is_there(name: str) -> bool:
    """Whether there is a file or a folder of this name."""
    try:
        return bool(name) and os.path.exists(name)
    except OSError:
        return False


@contextlib.contextmanager
def loudness(arguments: argparse.Namespace) -> Iterator[None]:
    """With ``--verbose``, show the log of the library on standard error while a command runs."""
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
