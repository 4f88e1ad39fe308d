"""Exceptions of the package, which state place and reason."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path


class LostMotionError(Exception):
    """Base class of the exceptions of this package.

    They pass through `pickle`, as between processes: `args` are those of the constructor.
    """


class InputError(LostMotionError):
    """An input is invalid.

    Its text is one line: ``FILE: KEY: found FOUND, expected EXPECTED``.

    Parameters
    ----------
    file : str or Path
        File or argument with the error.
    key : str
        Key of a drive file, column of a recording or option of a command; may be empty.
    found, expected : str
        Actual and expected content.
    """

    def __init__(self, file: str | Path, key: str, found: str, expected: str) -> None:
        self.file = str(file)
        self.key = key
        self.found = found
        self.expected = expected
        super().__init__(self.file, key, found, expected)

    def __str__(self) -> str:
        """Return the one line."""
        place = ": ".join(shorten(part) for part in (self.file, self.key) if part)
        return one_line(f"{place}: found {shorten(self.found)}, expected {self.expected}")


class LibraryError(LostMotionError):
    """The C library refused an input or could not finish.

    Parameters
    ----------
    status : int
        The `lm_status` of the call.
    sentence : str
        Description of that status by the library.
    key : str
        Name of the refused input in the library; may be empty.
    found, low, high : float
        Its value and the expected range; ``low == high == 0`` if there is none.
    """

    def __init__(
        self,
        status: int,
        sentence: str,
        key: str = "",
        found: float = 0.0,
        low: float = 0.0,
        high: float = 0.0,
    ) -> None:
        self.status = status
        self.sentence = sentence
        self.key = key
        self.found = found
        self.low = low
        self.high = high
        super().__init__(status, sentence, key, found, low, high)

    def __str__(self) -> str:
        """Return the sentence, with the input and its range."""
        if not self.key:
            return self.sentence
        ranged = (self.low, self.high) != (0.0, 0.0)
        expected = f", expected {self.low:.6g} to {self.high:.6g}" if ranged else ""
        return f"{self.key}: {self.sentence} (found {self.found:.6g}{expected})"


class TerminatedError(KeyboardInterrupt):
    """The system requests termination: handled like Ctrl-C, with the completed work saved.

    Parameters
    ----------
    number : int
        The signal.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def given_as(function: str, argument: str, value: object, *kinds: type) -> None:
    """Refuse an argument of the wrong type, for example if two were exchanged.

    Raises
    ------
    InputError
        When `value` is none of `kinds`.
    """
    if not isinstance(value, kinds):
        found = "nothing" if value is None else f"a {type(value).__name__}"
        raise InputError(function, argument, found, " or ".join(f"a {k.__name__}" for k in kinds))


FOUND_MAX = 200
"""Longest quotation of a found value, in characters."""


def one_line(text: str) -> str:
    """Return `text` on one printable line, with unprintable characters as escapes."""
    line = " ".join(text.split())
    if line.isprintable():
        return line
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)


def shorten(text: str) -> str:
    """Return `text`, shortened in the middle if it is long."""
    if len(text) <= FOUND_MAX:
        return text
    return f"{text[: FOUND_MAX // 2]} ... {text[-FOUND_MAX // 4 :]}"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return `` (did you mean 'x'?)`` for the known name nearest to `name`, or nothing."""
    lower = {candidate.lower(): candidate for candidate in known}
    near = difflib.get_close_matches(name.lower(), lower, n=1, cutoff=0.6)
    return f" (did you mean '{lower[near[0]]}'?)" if near else ""
