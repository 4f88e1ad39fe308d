"""Results of a search: designs, figures and certificates."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lostmotion.design.drive_document import drive_document
from lostmotion.design.drive_tolerances import kept_tolerances
from lostmotion.design.engine import c_string, engine, figure_value, figures, limit_names
from lostmotion.design.spec import Spec
from lostmotion.results import data_frame
from lostmotion.results.figures import points
from lostmotion.results.html_table import html_table
from lostmotion.structs import unused_keys
from lostmotion.units import split_unit

MARGIN_UNITS = {
    "gap_min_arcmin": "arcmin",
    "form_radius": "modules",
    "flexspline_tip_thickness": "modules",
    "rigid_tip_thickness": "modules",
    "flexspline_root_clearance": "modules",
    "rigid_root_clearance": "modules",
    "disengagement": "modules",
    "free_assembly": "modules",
    "interference_max_mm": "modules",
}
"""Units of the margins; the others are shares of the limit."""


@dataclass
class SearchResult:
    """The result of a search, finished or not.

    Attributes
    ----------
    best : dict or None
        Drive file of the design with the best first objective; None when there is none.
    front : list of dict
        Pareto-optimal designs, in the order of the first objective, best first. Each has
        ``objectives`` (list, in the order of `objectives`), ``figures`` (all that was computed, by
        name), ``margins`` (by limit; below zero it is broken), ``variables`` (by dotted key),
        ``drive`` (a drive file's tables), ``verified`` (whole grades, checked between the angles).
    objectives, units : tuple of str
        Objectives that were minimised, or maximised if `larger_is_better`.
    larger_is_better : tuple of bool
    finished : bool
        False when it was stopped; ``resume`` continues.
    certificate : dict or None
        The best design, evaluated again on a finer grid: ``holds``, ``limit_names``, ``checks``,
        ``lost_motion_arcmin`` and so on.
    infeasible : dict or None
        If no design exists: the limits to relax, and by how much.
    note : str
        One line for the user, or empty.
    combinations : dict
        Numbers of combinations by result.
    refused : int
        Evaluations that the model refused or without a finite result; they were skipped.
    folder : Path
    start : dict
        Figures of the textbook drive with the teeth and the wave generator of the best one and its
        smallest gap closed; empty if there is none.
    """

    best: dict[str, Any] | None
    front: list[dict[str, Any]]
    objectives: tuple[str, ...]
    units: tuple[str, ...]
    larger_is_better: tuple[bool, ...]
    finished: bool
    certificate: dict[str, Any] | None
    infeasible: dict[str, Any] | None
    note: str
    combinations: dict[str, int]
    refused: int
    folder: Path
    assumed: dict[str, Any] = field(default_factory=dict)
    start: dict[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Summarise the search."""
        state = "finished" if self.finished else "not finished"
        return (
            f"<SearchResult: {len(self.front)} designs of {', '.join(self.objectives)}, {state}, "
            f"in {self.folder}>"
        )

    def _repr_html_(self) -> str:
        head = [f"{n}, {u}" for n, u in zip(self.objectives, self.units, strict=True)]
        rows = ([f"{value:.6g}" for value in one["objectives"]] for one in self.front)
        return html_table(head, rows, repr(self))

    def to_dataframe(self) -> Any:
        """Return a pandas data frame with one row per design of the front."""
        rows = [
            {
                **dict(zip(self.objectives, one["objectives"], strict=True)),
                **one["variables"],
                "verified": one["verified"],
            }
            for one in self.front
        ]
        names = list(dict.fromkeys(name for row in rows for name in row))
        return data_frame({name: [row.get(name) for row in rows] for name in names})

    def plot(self) -> Any:
        """Plot the front over the first two objectives (Plotly figure)."""
        axes = [f"{n}, {u}" for n, u in zip(self.objectives, self.units, strict=True)]
        places = [one["objectives"] for one in self.front]
        x = [place[0] for place in places]
        if len(axes) == 1:
            return points(list(range(1, len(x) + 1)), x, "Designs", ("design", axes[0]))
        return points(x, [place[1] for place in places], "Front", (axes[0], axes[1]))

    def answer(self) -> dict[str, Any]:
        """Return the result for JSON."""
        return {
            "schema": "lostmotion.design/1",
            "folder": str(self.folder),
            "finished": self.finished,
            "objectives": list(self.objectives),
            "units": list(self.units),
            "larger_is_better": list(self.larger_is_better),
            "best": self.best,
            "front": self.front,
            "certificate": self.certificate,
            "infeasible": self.infeasible,
            "combinations": self.combinations,
            "refused": self.refused,
            "assumed": self.assumed,
            "start": self.start,
            "note": self.note,
        }


def relaxation(limit: Mapping[str, Any]) -> tuple[float, str]:
    """Required relaxation of a limit of ``infeasible.json``, and its unit for display.

    Shares become percent.
    """
    by, unit = float(limit["by"]), str(limit["unit"])
    return (100.0 * by, "% of the limit") if unit == "share of the limit" else (by, unit)


def margin_unit(name: str) -> str:
    """Name the unit of a limit's margin."""
    return MARGIN_UNITS.get(name, "share of the limit")


def rounded_up(by: float) -> str:
    """Write four digits, rounded up, so that a limit relaxed by the printed amount is satisfied."""
    unit = 10.0 ** (math.floor(math.log10(by)) - 3)
    return f"{math.ceil(by / unit - 1e-9) * unit:.4g}"


class Designs:
    """Converts designs of one search from the optimizer's structs to drive files and numbers."""

    def __init__(self, problem: Any, spec: Spec) -> None:
        self.ffi, self.lib = engine()
        self.problem = problem
        self.spec = spec
        self.names = tuple(figures()[i][0] for i in spec.objectives)
        self.units = tuple(figures()[i][1] for i in spec.objectives)
        stiffness = self.lib.LM_FIGURE_COMPLIANCE
        self.larger = tuple(i == stiffness for i in spec.objectives)
        self.key_names = [self.key_name(i) for i in range(self.lib.LM_KEY_COUNT)]
        self.scan = self.ffi.new("lm_scan *")
        self.layout = self.ffi.new("lm_layout *")
        self.lib.lm_default_scan(self.scan)
        self.lib.lm_lay_out(problem, self.scan, self.layout)
        self.result = self.ffi.new("double[]", self.layout.count)
        self.workspace = self.ffi.gc(self.lib.lm_create_workspace(), self.lib.lm_free_workspace)

    def key_name(self, key: int) -> str:
        """Dotted key of a number of `lm_key`."""
        text = self.ffi.new("char[]", self.lib.LM_KEY_NAME_MAX)
        self.lib.lm_write_key(key, text)
        return c_string(text)

    def values(self, combination: int, unit: Any) -> dict[str, float]:
        """Values of all keys at a point; 0 where the default of the model applies."""
        value = self.ffi.new("double[]", self.lib.LM_KEY_COUNT)
        self.lib.lm_point_values(self.problem, combination, unit, value)
        return dict(zip(self.key_names, value, strict=True))

    def varied(self, combination: int, unit: Any) -> dict[str, float]:
        """Values of the variables with a range, by dotted key of the search."""
        value = self.ffi.new("double[]", self.lib.LM_KEY_COUNT)
        self.lib.lm_point_values(self.problem, combination, unit, value)
        ranged = [self.problem.range[i].key for i in range(self.problem.range_count)]
        return {self.key_names[key]: value[key] for key in ranged}

    def objectives(self, found: Any) -> list[float]:
        """Objectives of an `lm_solution` in the units of `figures`."""
        return [figure_value(f, found.objective[i]) for i, f in enumerate(self.spec.objectives)]

    def drive(self, combination: int, unit: Any, name: str = "") -> dict[str, Any]:
        """Drive file of a point; ValueError if it has none."""
        drive = self._drive(combination, unit, name)
        if drive is None:
            raise ValueError("no drive at this point")
        return drive

    def _drive(self, combination: int, unit: Any, name: str) -> dict[str, Any] | None:
        drive = self.ffi.new("lm_drive *")
        if self.lib.lm_point_drive(self.problem, combination, unit, drive, self.ffi.NULL) != 0:
            return None
        document = drive_document(drive)
        document["drive"]["name"] = name or self.spec.name
        hidden = unused_keys(document["design"])
        table = document["design"]["generator"]
        for key in [key for key in table if f"generator.{split_unit(key)[0]}" in hidden]:
            del table[key]
        if self.spec.links:
            values = self.values(combination, unit)
            grades = [values[f"tolerance.{i}.grade"] for i in range(len(self.spec.links))]
            document["design"]["tolerance"] = kept_tolerances(self.spec, grades, document["design"])
        return document

    def measure(self, combination: int, unit: Any) -> tuple[dict[str, float], dict[str, float]]:
        """Figures and margins of a point as in the search; ValueError if it has none."""
        lib = self.lib
        status = lib.lm_evaluate_point(
            self.problem,
            self.scan,
            self.layout,
            combination,
            unit,
            self.result,
            self.workspace,
            self.ffi.NULL,
        )
        if status != 0:
            raise ValueError("the model refuses this point")
        values = {
            name: figure_value(i, lib.lm_figure_of(self.layout, self.result, i))
            for i, (name, _) in enumerate(figures())
        }
        margins = {
            name: lib.lm_margin_of(self.problem, self.layout, self.result, i)
            for i, name in enumerate(limit_names())
        }
        return values, margins

    def drives(self, search: Any) -> list[dict[str, Any] | None]:
        """Drive files of the front; None at a point that has none."""
        count = self.lib.lm_read_front(search, self.ffi.NULL, 0)
        found = self.ffi.new("lm_solution[]", max(count, 1))
        self.lib.lm_read_front(search, found, count)
        return [
            self._drive(found[i].combination, found[i].unit, f"{self.spec.name}, {i + 1}")
            for i in range(count)
        ]

    def front(self, run: Any, drives: list[dict[str, Any] | None]) -> list[dict[str, Any]]:
        """Read the front of a finished `lm_run`; `drives` are its drive files."""
        count = self.ffi.new("int *")
        front = self.lib.lm_run_front(run, count)
        out = []
        for i, drive in zip(range(count[0]), drives, strict=False):
            one = front[i].design
            if not front[i].computed or drive is None:  # a point that a test has made invalid
                continue
            values, margins = figures_and_margins(front[i])
            out.append(
                {
                    "objectives": [values[name] for name in self.names],
                    "figures": values,
                    "margins": margins,
                    "variables": self.varied(one.combination, one.unit),
                    "drive": drive,
                    "verified": bool(one.verified),
                    "combination": int(one.combination),
                }
            )
        return out


def figures_and_margins(one: Any) -> tuple[dict[str, float], dict[str, float]]:
    """Figures and margins of an `lm_measured` by name."""
    values = {
        name: figure_value(i, value)
        for i, ((name, _), value) in enumerate(zip(figures(), one.figure, strict=True))
    }
    return values, dict(zip(limit_names(), one.margin, strict=True))
