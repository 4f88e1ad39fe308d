"""Statements for the optimizer, each with its key in the spec.

The optimizer reads one statement per line (``optimizer/spec.h``) and checks them. Its errors are
reported in terms of the file.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from lostmotion.design.engine import c_string, engine
from lostmotion.errors import InputError
from lostmotion.keys import as_in_file


class Statements:
    """Statements for the optimizer, and values assumed for keys that the file does not state.

    Attributes
    ----------
    file : str
    document : mapping
        Tables of the file.
    lines, origins : list of str
        Statements, and the key of each.
    assumed : dict
        By dotted key.
    """

    def __init__(self, file: str, document: Mapping[str, Any]) -> None:
        self.file = file
        self.document = document
        self.lines: list[str] = []
        self.origins: list[str] = []
        self.assumed: dict[str, Any] = {}

    def refuse(self, key: str, found: str, expected: str) -> InputError:
        """Return the error of a key of the file."""
        return InputError(self.file, key, found, expected)

    def say(self, origin: str, *words: object) -> None:
        """Add a statement."""
        shown = [repr(float(w)) if isinstance(w, float) else str(w) for w in words]
        self.lines.append(" ".join(shown))
        self.origins.append(origin)

    def assume(self, key: str, value: Any) -> None:
        """Record a value assumed for a key that the file does not state."""
        self.assumed[key] = value

    def table(self, name: str) -> Mapping[str, Any]:
        """Return a table of [search]; empty if there is none."""
        table = self.document["search"].get(name, {})
        if not isinstance(table, Mapping):
            raise self.refuse(f"search.{name}", as_in_file(table), f"a table [search.{name}]")
        return table

    @property
    def text(self) -> str:
        """Text that the optimizer reads."""
        return "\n".join(self.lines) + "\n"

    def check(self, said: Mapping[str, str]) -> None:
        """Let the optimizer parse the text.

        Parameters
        ----------
        said : mapping
            Place in the file of each dotted key of the search.
        """
        ffi, lib = engine()
        choices = [line.split()[2:] for line in self.lines if line.startswith("choose ")]
        combinations = math.prod(map(len, choices))
        if combinations > lib.LM_COMBINATION_MAX:
            found = f"{combinations} combinations of choices"
            raise self.refuse("search.range", found, f"at most {lib.LM_COMBINATION_MAX}")
        problem = ffi.new("lm_problem *")
        error = ffi.new("lm_spec_error *")
        if lib.lm_read_spec(self.text.encode(), problem, error) == 0:
            return
        refused = c_string(error.text)
        if error.line > 0:
            what, _, word = refused.rpartition(": ")
            found, expected = refused, "what spec.h allows"
            if what.startswith("expected "):
                found, expected = word, what.removeprefix("expected ")
            raise self.refuse(self.origins[error.line - 1], found, expected)
        match = re.fullmatch(r"(\S+): (.*) \(found (\S+), expected (\S+) to (\S+)\)", refused)
        if match is None:
            raise self.refuse("search", refused, "a valid search")
        key, sentence, found, low, high = match.groups()
        places = {name.replace(".0.", "."): place for name, place in said.items()}
        expected = f"{low} to {high}" if low != high else f"a value that fits ({sentence})"
        stated = {
            line.split()[0]: place for line, place in zip(self.lines, self.origins, strict=True)
        }
        place = places.get(key) or stated.get(key.rpartition(".")[2]) or key
        raise self.refuse(place, found, expected)
