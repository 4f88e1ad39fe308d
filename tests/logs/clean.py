"""The clean campaign: nine runs of the demo's joint, thinned, with a hidden effect."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

JOINT = Path(__file__).parents[1] / "data" / "joint"
DRIVE = JOINT / "joint.toml"
RATIO = 100
HIDDEN = "thermal_gap"
"""The effect that the rig put into the joint (`tests/data/joint/SOURCE.md`)."""

RUNS = (2, 3, 6, 9, 13, 14, 15, 19, 28)
"""Loops at three generator angles, at 10, 35 and 50 degrees and after 100,000 cycles, and turning:
few runs with which `diagnose` names the effect with p below 1e-5 even if any one row is missing."""
EVERY = 10
"""Stride of the rows, with which a command takes about a second."""


@dataclass(frozen=True)
class Sheet:
    """A table before it is written: names, and cells of text."""

    names: tuple[str, ...]
    columns: tuple[tuple[str, ...], ...]

    def __len__(self) -> int:
        return len(self.columns[0])

    def cells(self, name: str) -> tuple[str, ...]:
        """Text of a column."""
        return self.columns[self.names.index(name)]

    def values(self, name: str) -> Array:
        """Numbers of a column."""
        return np.array(self.cells(name), float)

    def rows(self) -> list[list[str]]:
        """Cells row by row, without the names."""
        return [list(row) for row in zip(*self.columns, strict=True)]

    def renamed(self, **names: str) -> Sheet:
        """The same table with other names."""
        return replace(self, names=tuple(names.get(name, name) for name in self.names))

    def put(self, name: str, cells: list[str], new_name: str | None = None) -> Sheet:
        """A column replaced by another one."""
        at = self.names.index(name)
        return Sheet(
            (*self.names[:at], new_name or name, *self.names[at + 1 :]),
            (*self.columns[:at], tuple(cells), *self.columns[at + 1 :]),
        )

    def turned_into(
        self, name: str, new_name: str, scale: float, offset: float = 0.0, form: str = "%.11g"
    ) -> Sheet:
        """A column in another unit: value * scale + offset."""
        values = self.values(name) * scale + offset
        return self.put(name, [form % value for value in values], new_name)

    def added(self, name: str, cells: list[str], at: int | None = None) -> Sheet:
        """An added column, at the end or at a place."""
        at = len(self.names) if at is None else at
        return Sheet(
            (*self.names[:at], name, *self.names[at:]),
            (*self.columns[:at], tuple(cells), *self.columns[at:]),
        )

    def without(self, *names: str) -> Sheet:
        """The table without some columns."""
        return self.ordered(*(name for name in self.names if name not in names))

    def ordered(self, *names: str) -> Sheet:
        """These columns, in this order."""
        return Sheet(names, tuple(self.cells(name) for name in names))

    def taken(self, rows: npt.NDArray[np.bool_]) -> Sheet:
        """Some of the rows."""
        kept = np.flatnonzero(rows)
        return replace(self, columns=tuple(tuple(cells[i] for i in kept) for cells in self.columns))

    def by_run(self) -> dict[str, Sheet]:
        """A sheet for each run, without the column of runs."""
        runs = np.array(self.cells("run"))
        return {
            label: self.taken(runs == label).without("run")
            for label in dict.fromkeys(self.cells("run"))
        }

    def text(
        self,
        separator: str = ",",
        end: str = "\n",
        decimal: str = ".",
        cell: Callable[[str], str] = str,
        name: Callable[[str], str] = str,
        top: str = "",
        below_names: str = "",
        bottom: str = "",
    ) -> str:
        """The sheet as text: `top`, the names, `below_names`, the rows, `bottom`.

        The extra lines are written with newlines and get the line end of the rest.
        """
        written = [
            separator.join(cell(value.replace(".", decimal)) for value in row)
            for row in self.rows()
        ]
        head = separator.join(name(label) for label in self.names)
        whole = top + head + "\n" + below_names + "\n".join(written) + "\n" + bottom
        return whole.replace("\n", end)


@cache
def clean() -> Sheet:
    """The campaign as the rig would write it."""
    with gzip.open(JOINT / "joint.csv.gz", "rt") as file:
        names = tuple(next(file).rstrip("\n").split(","))
        rows = [line.rstrip("\n").split(",") for line in file]
    kept = []
    for run in RUNS:
        of_run = [row for row in rows if int(row[0]) == run]
        kept += of_run[::EVERY]
    return Sheet(names, tuple(zip(*kept, strict=True)))
