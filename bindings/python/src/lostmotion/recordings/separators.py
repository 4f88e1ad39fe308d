"""Separators: characters between the fields of a line, and splitting of lines."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass

BLANK_FIELD = re.compile(r'"[^"]*"(?=\s|$)|[0-9]{4}-[0-9]{2}-[0-9]{2} +(?=[0-9]{1,2}:)\S+|\S+')
"""A field between blanks; a date and the time of day after it are one field."""

BLANK_PART = re.compile(r'"[^"]*"(?=\s|$)|\S+')
"""A field between blanks; a date and the time of day are two fields."""

BLANK_NAME = re.compile(r'"[^"]*"|[^\s\[(]+(?:[ \t]*(?:\[[^\]]*\]|\([^)]*\)))?|\S+')
"""A name between blanks, with its unit in brackets after it."""


@dataclass(frozen=True)
class Separator:
    """A field separator: a character, or runs of blanks with dates and times joined or not.

    Attributes
    ----------
    sign : str
        One character; a blank means runs of blanks.
    joined : bool
        Whether a date and a time of day separated by a blank are one field.
    """

    sign: str
    joined: bool = False

    def __str__(self) -> str:
        """Name it in a message."""
        return {"\t": "tabs", " ": "blanks", ",": "commas", ";": "semicolons", "|": "bars"}.get(
            self.sign, f"'{self.sign}'"
        )

    def fields(self, line: str) -> list[str]:
        """Cut a line.

        Raises
        ------
        csv.Error
            For fields larger than the limit of the csv module.
        """
        if self.sign == " ":
            return (BLANK_FIELD if self.joined else BLANK_PART).findall(line)
        if '"' not in line and len(line) < csv.field_size_limit():
            return line.split(self.sign)
        return next(csv.reader([line], delimiter=self.sign, skipinitialspace=True), [])

    def names(self, line: str) -> list[str]:
        """Cut a header line."""
        found = BLANK_NAME.findall(line) if self.sign == " " else self.fields(line)
        return [name.strip().strip('"').strip() for name in found]

    def tabled(self, text: bytes) -> bytes:
        """Return lines with runs of blanks between fields replaced by tabs."""
        if self.sign != " ":
            return text
        cut = [b"\t".join(f.encode() for f in self.fields(s)) for s in text.decode().split("\n")]
        return b"\n".join(cut)

    @property
    def read_as(self) -> str:
        """Sign that separates the fields after `tabled`."""
        return "\t" if self.sign == " " else self.sign


CANDIDATES = (
    Separator(","),
    Separator(";"),
    Separator("\t"),
    Separator("|"),
    Separator(" "),
    Separator(" ", joined=True),
)
"""Separators that are tried, the most usual first."""

STATED = re.compile(r'\s*"?sep=([,;|\t])"?\s*', re.IGNORECASE)
"""A first line that states the separator, for spreadsheets."""
