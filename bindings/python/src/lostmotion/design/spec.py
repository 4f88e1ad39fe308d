"""Search specs: TOML that says what may vary and what must hold, as the text of the optimizer.

The optimizer reads one statement a line (``optimizer/spec.h``). Every line remembers the key that
it came from, so that what the optimizer refuses is told in the words of the file.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lostmotion import structs, units
from lostmotion.core import core
from lostmotion.design.engine import c_string, engine, figures, keys, limit_names
from lostmotion.design.textbook import SECTIONS as SECTIONS_OF_FACE
from lostmotion.design.textbook import TORQUE_PER_D3, WIDTH_PER_D
from lostmotion.drives import parse_drive, read_toml
from lostmotion.errors import InputError, did_you_mean
from lostmotion.files import read_bytes
from lostmotion.keys import Key, TableEntry, as_in_file, read_keys
from lostmotion.structs import DEFORMATIONS, DISTRIBUTIONS, GENERATORS, ZONES, make_drive

SECTIONS = ("drive", "design", "search")
TABLES = ("fixed", "range", "limits", "cost", "start")

FRONT = "front.csv"
"""The designs that a search leaves."""

NEAREST = "nearest.csv"
"""The one that it leaves where none keeps all limits."""

ROUNDING = 1e-9
"""Share of a range by which a written end of it may be off."""

LEVELS = ("worst", "probable", "quantile")
"""Where in production the tolerance figure is taken."""

SEARCH_KEYS = (
    Key("seed", kind="integer", low=0, high=2**31 - 1),
    Key("evaluations", kind="integer", low=10, high=10**9),
    Key("workers", kind="integer", low=1, high=256),
    Key("dask", kind="text"),
    Key("torque", "Nm", above=0, high=5e5),
    Key("phases", kind="integer", low=1, high=8),
    Key("level", kind="choice", choices=LEVELS),
    Key("rigid_gear_turns", kind="switch"),
    Key("start_from", kind="text"),
    Key("damaged_share", low=0, high=1),
)
"""Keys of [search] besides its tables and the list of objectives."""

LEAST_RATED_NM, MOST_RATED_NM = 1e-4, 1e6

DRIVE_KEYS = (
    Key("name", kind="text"),
    Key("ratio", low=-1000, high=1000),
    Key("rated_torque", "Nm", low=LEAST_RATED_NM, high=MOST_RATED_NM),
)

COST_KEYS = (
    Key("tolerance_exponent", above=0, high=10),
    Key("size", low=0, high=1e6),
    *(Key(name, low=0, high=1e6) for name in GENERATORS),
)

SWITCH_LIMITS = ("free_assembly", "gap_at_worst_corner")
"""Limits that are on or off."""

TEETH, MODULE, WIDTH = "teeth.flexspline_teeth", "teeth.module_mm", "teeth.face_width_mm"
RIGID, DIFFERENCE = "teeth.rigid_shift", "teeth.shift_difference"
RIGID_TEETH = "teeth.rigid_teeth"
AXIAL_SECTIONS = "axial_sections"
PLANAR_ONLY = "planar_only"
DEPTH = "teeth.engagement_depth"
DEFLECTION, DEFLECTION_MODULES = "generator.deflection_mm", "generator.deflection_modules"

RIVALS = {
    RIGID: DIFFERENCE,
    DIFFERENCE: RIGID,
    DEFLECTION: DEFLECTION_MODULES,
    DEFLECTION_MODULES: DEFLECTION,
}
"""Keys that state the same quantity."""

NEVER = {
    RIGID_TEETH: "it follows from teeth.flexspline_teeth, two more or two fewer",
    "generator.floating": "the generator of a search floats",
    "generator.eccentricity": "the generator of a search runs true",
    "generator.eccentricity_angle": "the generator of a search runs true",
}

ASSUMED = {"generator.floating": True, "generator.eccentricity": 0}
"""What the search does with them: they may be fixed to that."""

DEFORMATION = "teeth.deformation"

NAMED = {
    structs.field_path(key.section, key): key.choices
    for key in structs.design_keys()
    if key.kind == "choice"
}
"""Keys whose values are names."""

SWITCHES = {
    structs.field_path(key.section, key) for key in structs.design_keys() if key.kind == "switch"
}
"""Keys that are true or false."""

FIXED_ONLY = (AXIAL_SECTIONS, PLANAR_ONLY)
"""Keys that say how a drive is looked at: the same for all drives of a search."""

WHOLE = {TEETH: ("an even number", 2), AXIAL_SECTIONS: ("a whole number", 1)}
"""Keys between whose values nothing lies."""

DEFAULT_TEETH = 200
DEFAULT_DEPTH = (0.6, 1.2)
"""Range of the engagement depth, in modules: what a short cup leaves at its edges, to the book's.
"""
DEFAULT_DIFFERENCE = (-0.4, 0.6)
"""Range of x2 - x1 that holds every interference-free pair from w0/m = 0.85 to 1.2."""


@dataclass
class Spec:
    """A search spec.

    Attributes
    ----------
    file : str
    name : str
        Of the drives that the search finds.
    text : str
        What the optimizer reads.
    objectives : tuple of int
        By `lm_figure`.
    workers, dask
        As the file says; None where it does not.
    assumed : dict
        What the file leaves open, by dotted key, and what was taken for it.
    link_names : list of str
        Names of the tolerances, where they have one.
    start : dict
        [search.start], in the units of the search.
    document : dict
        The file itself.
    """

    file: str
    name: str
    text: str = ""
    objectives: tuple[int, ...] = ()
    workers: int | None = None
    dask: str | None = None
    assumed: dict[str, Any] = field(default_factory=dict)
    link_names: list[str] = field(default_factory=list)
    start: dict[str, float] = field(default_factory=dict)
    document: dict[str, Any] = field(default_factory=dict)


def read_spec(file: str | Path) -> Spec:
    """Read a search spec.

    Raises
    ------
    InputError
        Unknown keys, wrong units, impossible values: file, key, found, expected.
    """
    return parse_spec(read_toml(file, "a search spec"), str(file))


def parse_spec(document: Mapping[str, Any], file: str = "spec") -> Spec:
    """Understand the tables of a search spec; `file` is for messages."""
    return _Reader(file, document).read()


def tooth_counts() -> tuple[int, int]:
    """Fewest and most teeth that a flexspline may have."""
    lib = core().lib
    return int(lib.LM_FLEXSPLINE_TEETH_MIN), int(lib.LM_FLEXSPLINE_TEETH_MAX)


class _Reader:
    """One reading of a spec."""

    def __init__(self, file: str, document: Mapping[str, Any]) -> None:
        self.file = file
        self.document = document
        self.lines: list[str] = []
        self.origins: list[str] = []
        self.values: dict[str, float] = {}  # of one drive of the search, for what is derived
        self.said: dict[str, str] = {}  # dotted key of the search: place in the file
        self.spec = Spec(file, Path(file).stem, document=dict(document))

    def refuse(self, key: str, found: str, expected: str) -> InputError:
        return InputError(self.file, key, found, expected)

    def say(self, origin: str, *words: object) -> None:
        """Add a statement."""
        shown = [repr(float(w)) if isinstance(w, float) else str(w) for w in words]
        self.lines.append(" ".join(shown))
        self.origins.append(origin)

    def table(self, name: str) -> Mapping[str, Any]:
        table = self.search.get(name, {})
        if not isinstance(table, Mapping):
            raise self.refuse(f"search.{name}", as_in_file(table), f"a table [search.{name}]")
        return table

    def read(self) -> Spec:
        for section in self.document:
            if section not in SECTIONS:
                hint = did_you_mean(section, SECTIONS)
                expected = "one of the tables " + ", ".join(SECTIONS) + hint
                raise self.refuse(section, "an unknown table", expected)
        if not isinstance(self.document.get("search"), Mapping):
            raise self.refuse("search", "no such table", "[search] with objectives")
        self.search: Mapping[str, Any] = self.document["search"]
        numbers = {k: v for k, v in self.search.items() if k != "objectives"}
        head = read_keys(self.file, "search", numbers, SEARCH_KEYS, tables=TABLES)
        drive = read_keys(self.file, "drive", self.document.get("drive", {}), DRIVE_KEYS)
        self.read_objectives()
        self.read_head(head, drive)
        self.check_turning()
        for name in ("fixed", "range"):
            for key, value in self.table(name).items():
                if name != "fixed" or not self.is_assumed(key, value):
                    self.read_variable(name, key, value)
        self.fill_open(drive)
        self.check_rigid_teeth()
        self.read_tolerances()
        self.read_limits()
        self.read_cost()
        self.read_chains()
        self.read_start()
        if "start_from" in head:
            self.begin_with(head["start_from"].value)
        self.spec.text = "\n".join(self.lines) + "\n"
        self.check()
        return self.spec

    # --- [search] and [drive] ---

    def read_objectives(self) -> None:
        names = [name for name, _ in figures()]
        expected = f"a list of one to four of {', '.join(names)}"
        found = self.search.get("objectives")
        if found is None:
            raise self.refuse("search.objectives", "nothing", expected)
        if (
            not isinstance(found, list)
            or not 1 <= len(found) <= 4
            or len(set(map(repr, found))) < len(found)
        ):
            raise self.refuse("search.objectives", as_in_file(found), expected)
        for name in found:
            if name not in names:
                hint = did_you_mean(name, names) if isinstance(name, str) else ""
                raise self.refuse("search.objectives", as_in_file(name), expected + hint)
        self.spec.objectives = tuple(names.index(name) for name in found)
        for name in found:
            self.say("search.objectives", "objective", name)

    def read_head(self, head: Mapping[str, TableEntry], drive: Mapping[str, TableEntry]) -> None:
        names = {"torque": "torque_Nm", "rigid_gear_turns": "rigid_gear_turns"}
        for name in ("seed", "evaluations", "torque", "phases", "level", "rigid_gear_turns"):
            if name in head:
                value = head[name].value
                value = int(value) if isinstance(value, bool) else value
                self.say(f"search.{name}", names.get(name, name), value)
        if "damaged_share" in head:
            self.say("search.damaged_share", "damaged_share", head["damaged_share"].value)
        if "phases" not in head and "kinematic_error" in self.search["objectives"]:
            self.assume("search.phases", 4)
            self.say("search.phases", "phases", 4)
        self.turns = bool(head["rigid_gear_turns"].value) if "rigid_gear_turns" in head else False
        self.spec.workers = head["workers"].value if "workers" in head else None
        self.spec.dask = head["dask"].value if "dask" in head else None
        if "name" in drive:
            self.spec.name = drive["name"].value
        self.sign = 1
        if "ratio" in drive:
            self.sign = -1 if drive["ratio"].value < 0 else 1
            self.ratio: tuple[float, float] | None = (abs(drive["ratio"].value),) * 2
        else:
            self.ratio = None
        if "ratio" in self.table("limits"):
            self.ratio = self.read_ratio(self.table("limits")["ratio"])
        if self.sign < 0:
            self.say("drive.ratio", "ratio_sign", -1)

    def read_ratio(self, value: Any) -> tuple[float, float]:
        fewest, most = tooth_counts()
        window = f"between {fewest // 2} and {most // 2 + 1} turns"
        expected = f"[lowest, highest], both of one sign, {window}"
        if not _is_pair(value) or not value[0] <= value[1] or value[0] * value[1] <= 0:
            raise self.refuse("search.limits.ratio", as_in_file(value), expected)
        low, high = sorted(abs(float(v)) for v in value)
        self.sign = -1 if value[0] < 0 else 1
        return low, high

    def assume(self, key: str, value: Any) -> None:
        self.spec.assumed[key] = value

    # --- variables ---

    def find_key(self, table: str, written: str) -> tuple[str, float]:
        """Name of a key as the search counts it, and its unit in the file's unit."""
        place = f"search.{table}.{written}"
        if re.fullmatch(r"tolerance\.\d+\.(it_)?grade", written):
            return written.replace("it_grade", "grade"), 1.0
        base, unit = units.split_unit(written)
        for bare, why in NEVER.items():
            if base == bare:
                raise self.refuse(place, "a key that cannot be set", f"none ({why})")
        for name in keys():
            if name == written:
                return name, 1.0
            known, kept = units.split_unit(name)
            if kept is not None and known == base and unit is not None:
                if unit.dimension != kept.dimension:
                    found = f"unit '{unit.symbol}', {units.dimension_name(unit.dimension)}"
                    raise self.refuse(place, found, units.dimension_name(kept.dimension))
                return name, unit.scale / kept.scale
            if kept is not None and written == known:
                found = units.dimension_name(kept.dimension)
                raise self.refuse(place, "no unit", f"{found} as a suffix, e.g. {name}")
        hint = did_you_mean(written, keys())
        expected = f"a dotted key of a drive file's [design], such as {MODULE}{hint}"
        raise self.refuse(place, "an unknown key", expected)

    def is_assumed(self, written: str, value: Any) -> bool:
        """Whether a fixed value is one that every drive of a search has."""
        if written == RIGID_TEETH:
            return True
        base = units.split_unit(written)[0]
        return base in ASSUMED and value is not None and value == ASSUMED[base]

    def check_rigid_teeth(self) -> None:
        """Refuse a number of teeth of the rigid gear that the flexspline's does not give."""
        found = self.table("fixed").get(RIGID_TEETH)
        if found is None:
            return
        place = f"search.fixed.{RIGID_TEETH}"
        if self.said.get(TEETH) != f"search.fixed.{TEETH}":
            raise self.refuse(place, f"no {TEETH} beside it", "both in [search.fixed]")
        wanted = int(self.values[TEETH]) + (-2 if self.external() else 2)
        if found != wanted:
            raise self.refuse(place, as_in_file(found), f"{wanted}, by {TEETH}")

    def number(self, place: str, name: str, scale: float, value: Any) -> float:
        if name in NAMED:
            names = NAMED[name]
            if value not in names:
                hint = did_you_mean(value, names) if isinstance(value, str) else ""
                raise self.refuse(place, as_in_file(value), f"one of {', '.join(names)}{hint}")
            return float(names.index(value))
        if name in SWITCHES:
            if not isinstance(value, bool):
                raise self.refuse(place, as_in_file(value), "true or false")
            return float(value)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.refuse(place, as_in_file(value), "a number")
        if not math.isfinite(value):
            raise self.refuse(place, as_in_file(value), "a finite number")
        return float(value) if scale == 1.0 else float(value) * scale

    def one_value(self, place: str, name: str, scale: float, value: Any) -> float:
        """Read a value that is not the end of a range."""
        number = self.number(place, name, scale, value)
        if name in WHOLE and number % WHOLE[name][1] != 0:
            raise self.refuse(place, as_in_file(value), WHOLE[name][0])
        return number

    def word(self, name: str, value: float) -> object:
        """Write a value as the optimizer reads it."""
        if name in NAMED:
            return NAMED[name][int(value)]
        return int(value) if value == int(value) and abs(value) < 1e9 else value

    def read_variable(self, table: str, written: str, value: Any) -> None:
        name, scale = self.find_key(table, written)
        place = f"search.{table}.{written}"
        for stated in (name, RIVALS.get(name, name)):
            if stated in self.said:
                raise self.refuse(place, "a second value", f"one of this and {self.said[stated]}")
        self.said[name] = place
        if table == "range" and name in FIXED_ONLY:
            raise self.refuse(place, as_in_file(value), "it in [search.fixed], for it cannot vary")
        if table == "fixed":
            number = self.one_value(place, name, scale, value)
            self.values[name] = number
            self.say(place, "fixed", name, self.word(name, number))
        elif isinstance(value, Mapping):
            self.read_choice(place, name, scale, value)
        else:
            self.read_range(place, name, scale, value)

    def read_choice(self, place: str, name: str, scale: float, value: Mapping[str, Any]) -> None:
        found = value.get("choose")
        if set(value) != {"choose"} or not isinstance(found, list) or not found:
            raise self.refuse(place, as_in_file(found if found is not None else value), _CHOICE)
        numbers = [self.one_value(place, name, scale, each) for each in found]
        if len(set(numbers)) < len(numbers):
            raise self.refuse(place, as_in_file(found), "each value once")
        if name == TEETH:
            numbers = self.teeth_in_window(place, numbers)
        self.choose(place, name, numbers)

    def choose(self, place: str, name: str, numbers: Sequence[float]) -> None:
        most = engine()[1].LM_CHOICE_VALUES_MAX
        if len(numbers) > most:
            raise self.refuse(place, f"{len(numbers)} values", f"at most {most}")
        self.values[name] = numbers[len(numbers) // 2]
        self.say(place, "choose", name, *(self.word(name, number) for number in numbers))

    def read_range(self, place: str, name: str, scale: float, value: Any) -> None:
        if name in NAMED or not _is_pair(value):
            raise self.refuse(place, as_in_file(value), _RANGE if name not in NAMED else _CHOICE)
        low, high = (self.number(place, name, scale, each) for each in value)
        if not low < high:
            raise self.refuse(place, as_in_file(value), _WIDE)
        if name == TEETH:
            numbers = [float(z) for z in range(math.ceil(low), math.floor(high) + 1) if z % 2 == 0]
            self.choose(place, name, self.teeth_in_window(place, numbers))
            return
        whole = ".grade" in name and all(isinstance(each, int) for each in value)
        self.values[name] = (low + high) / 2
        kind = "whole" if whole else "range"
        self.say(place, kind, name, self.word(name, low), self.word(name, high))

    def teeth_in_window(self, place: str, numbers: Sequence[float]) -> list[float]:
        """Keep the numbers of teeth whose ratio lies in the window."""
        if self.ratio is None:
            kept = list(numbers)
        else:
            low, high = self.ratio
            kept = [z for z in numbers if low <= self.turning(z) / 2 <= high]
        if not kept:
            window = "" if self.ratio is None else " with a ratio in the window"
            raise self.refuse(place, "no number of teeth", f"an even number of teeth{window}")
        return kept

    def turning(self, teeth: float) -> float:
        """Teeth of the gear that is the output."""
        external = self.external()
        return teeth + (-2 if external else 2) if self.turns else teeth

    def deformations(self) -> list[Any]:
        """Return the deformations that the drives of the search may have."""
        table = {**self.table("fixed"), **self.table("range")}
        value = table.get(DEFORMATION, DEFORMATIONS[0])
        found = value.get("choose") if isinstance(value, Mapping) else None
        return found if isinstance(found, list) else [value]

    def external(self) -> bool:
        return self.deformations() == ["external"]

    def check_turning(self) -> None:
        """Refuse a window of ratios where the same teeth have two of them."""
        if self.turns and self.ratio is not None and len(self.deformations()) > 1:
            place = f"search.range.{DEFORMATION}"
            expected = "one: where the rigid gear turns, its teeth and the ratio follow from it"
            raise self.refuse(place, "both deformations and a ratio", expected)

    def fill_open(self, drive: Mapping[str, TableEntry]) -> None:
        """State what the file leaves open and the search cannot do without."""
        if MODULE not in self.values:
            expected = "it in [search.fixed] or [search.range]"
            raise self.refuse(f"search.fixed.{MODULE}", "nothing", expected)
        if TEETH not in self.values:
            if self.ratio is None:
                self.assume(TEETH, DEFAULT_TEETH)
                self.choose("search.fixed", TEETH, [float(DEFAULT_TEETH)])
            else:
                fewest, most = tooth_counts()
                numbers = [float(z) for z in range(fewest, most + 1, 2)]
                place = "search.limits.ratio" if "ratio" in self.table("limits") else "drive.ratio"
                self.choose(place, TEETH, self.teeth_in_window(place, numbers))
        if AXIAL_SECTIONS not in self.values and not self.values.get(PLANAR_ONLY):
            self.assume(AXIAL_SECTIONS, SECTIONS_OF_FACE)
            self.say("search.fixed", "fixed", AXIAL_SECTIONS, SECTIONS_OF_FACE)
            self.values[AXIAL_SECTIONS] = float(SECTIONS_OF_FACE)
        if RIGID not in self.values and DIFFERENCE not in self.values:
            self.assume(DIFFERENCE, list(DEFAULT_DIFFERENCE))
            self.say("search.range", "range", DIFFERENCE, *DEFAULT_DIFFERENCE)
            self.values[DIFFERENCE] = 0.0
        if DEPTH not in self.values:
            self.assume(DEPTH, list(DEFAULT_DEPTH))
            self.say("search.range", "range", DEPTH, *DEFAULT_DEPTH)
            self.values[DEPTH] = sum(DEFAULT_DEPTH) / 2
        diameter = self.values[MODULE] * self.values[TEETH]
        if WIDTH not in self.values:
            width = WIDTH_PER_D * diameter
            self.assume(WIDTH, width)
            self.say("search.fixed", "fixed", WIDTH, width)
            self.values[WIDTH] = width
        if DEFLECTION not in self.values and DEFLECTION_MODULES not in self.values:
            self.assume(DEFLECTION_MODULES, 1.0)
            self.say("search.fixed", "fixed", DEFLECTION_MODULES, 1)
            self.values[DEFLECTION_MODULES] = 1.0
        if "rated_torque" in drive:
            rated = drive["rated_torque"].value
        else:
            # A size that no gear has is refused by its own key, not by the torque of it.
            rated = min(max(TORQUE_PER_D3 * diameter**3, LEAST_RATED_NM), MOST_RATED_NM)
            self.assume("drive.rated_torque_Nm", rated)
        self.say("drive.rated_torque_Nm", "rated_torque_Nm", rated)
        self.rated_Nm = rated

    # --- limits, cost ---

    def read_limits(self) -> None:
        _, lib = engine()
        names = list(limit_names()[lib.LM_LIMIT_SAFETY :])
        for written, value in self.table("limits").items():
            place = f"search.limits.{written}"
            if written == "ratio":
                continue
            if written in SWITCH_LIMITS:
                if not isinstance(value, bool):
                    raise self.refuse(place, as_in_file(value), "true or false")
                self.say(place, "limit", written, int(value))
                continue
            name, scale = self.find_limit(place, written, names)
            self.say(place, "limit", name, self.number(place, "", scale, value))
        given = self.table("limits")
        for name, value in (("safety_factor_min", 1.5), ("gap_min_arcmin", 0.0)):
            base = split_limit(name)[0]
            if not any(split_limit(written)[0] == base for written in given):
                self.assume(f"search.limits.{name}", value)

    def find_limit(self, place: str, written: str, names: Sequence[str]) -> tuple[str, float]:
        """Name of a limit, and the file's unit in the limit's own."""
        base, suffix = split_limit(written)
        unit = units.parse_unit(suffix)
        for name in names:
            known, kept_suffix = split_limit(name)
            kept = units.parse_unit(kept_suffix)
            if name == written:
                return name, 1.0
            if kept is not None and unit is not None and known == base:
                if unit.dimension != kept.dimension:
                    found = f"unit '{unit.symbol}', {units.dimension_name(unit.dimension)}"
                    raise self.refuse(place, found, units.dimension_name(kept.dimension))
                return name, unit.scale / kept.scale
        every = [*names, *SWITCH_LIMITS, "ratio"]
        hint = did_you_mean(written, every)
        raise self.refuse(place, "an unknown limit", f"one of {', '.join(every)}{hint}")

    def read_cost(self) -> None:
        place = "search.cost"
        for name, value in read_keys(self.file, place, self.table("cost"), COST_KEYS).items():
            self.say(f"{place}.{name}", "cost", name, value.value)

    # --- tolerances and chains ---

    def read_tolerances(self) -> None:
        design = self.document.get("design", {})
        known = ("tolerance", "radial_chain", "torsion_chain")
        if not isinstance(design, Mapping):
            raise self.refuse("design", as_in_file(design), "a table [design]")
        for name in design:
            if name not in known:
                expected = f"[[design.{name}]] only for {', '.join(known)}; other values stand in "
                raise self.refuse(f"design.{name}", "a key", expected + "[search.fixed]")
        entries = design.get("tolerance", [])
        if not isinstance(entries, list) or not all(isinstance(e, Mapping) for e in entries):
            raise self.refuse(
                "design.tolerance", as_in_file(entries), "tables [[design.tolerance]]"
            )
        for index, entry in enumerate(entries):
            self.read_tolerance(index, entry)
        for name, place in self.said.items():
            match = re.fullmatch(r"tolerance\.(\d+)\.grade", name)
            if match and int(match[1]) >= len(entries):
                expected = f"one of the {len(entries)} tables [[design.tolerance]], counted from 0"
                raise self.refuse(place, f"tolerance {match[1]}", expected)

    def read_tolerance(self, index: int, entry: Mapping[str, Any]) -> None:
        place = f"design.tolerance[{index}]"
        values = read_keys(self.file, place, entry, TOLERANCE_KEYS)
        given = {name: value.value for name, value in values.items()}
        self.spec.link_names.append(given.get("name", ""))
        kind = given.get("kind")
        if kind not in POSITIONS:
            expected = "one of " + ", ".join(POSITIONS)
            raise self.refuse(f"{place}.kind", as_in_file(kind) if kind else "nothing", expected)
        sign, position = POSITIONS[kind]
        half = 0.5 if kind != "link" and given.get("diameter", True) else 1.0
        if kind == "link" and "influence" not in given:
            raise self.refuse(f"{place}.influence", "nothing", "this key, a number")
        nominal = given.get("nominal", 0.0)
        offset = given.get("fundamental_deviation", 0.0)
        position = given.get("position", position)
        grade = f"tolerance.{index}.grade"
        if "it_grade" in given and grade in self.said:
            raise self.refuse(f"{place}.it_grade", "a second value", f"one of this and {grade}")
        if "it_grade" in given:
            self.say(f"{place}.it_grade", "fixed", grade, given["it_grade"])
        elif "lower" in given and "upper" in given:
            width = given["upper"] - given["lower"]
            if not width > 0 or not nominal > 0:
                raise self.refuse(place, "lower and upper", "lower below upper, and nominal_mm")
            self.say(place, "fixed", grade, self.continuous_grade(place, nominal, width))
            offset, position = (given["lower"] + given["upper"]) / 2, 0.0
        elif grade not in self.said:
            expected = f'it_grade here, or "tolerance.{index}.it_grade" in [search.range]'
            raise self.refuse(place, "no grade", expected)
        self.say(
            place,
            "link",
            float(given.get("influence", sign * half)),
            float(nominal),
            position,
            float(offset),
            float(given.get("cost_weight", 1.0)),
            given.get("distribution", "normal"),
            given["zone"],
        )

    def continuous_grade(self, place: str, nominal: float, width: float) -> float:
        """Grade whose field has a given width; fields grow with the grade."""
        ffi, lib = engine()
        one = ffi.new("double *")

        def field(grade: float) -> float:
            if lib.lm_it_tolerance_continuous(nominal, grade, one, ffi.NULL) != 0:
                raise self.refuse(
                    f"{place}.nominal_mm", as_in_file(nominal), "from 0.001 to 500 mm"
                )
            return float(one[0])

        low, high = map(float, GRADES)
        if not field(low) <= width <= field(high):
            least, most = f"IT {low:g} ({field(low):.4g} mm)", f"IT {high:g} ({field(high):.4g} mm)"
            expected = f"from {least} to {most}"
            raise self.refuse(place, f"a field of {width:.4g} mm", expected)
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (low, middle) if field(middle) >= width else (middle, high)
        return high

    def read_chains(self) -> None:
        """Members of the chains, as numbers of the drive in the middle of the ranges."""
        design = self.document.get("design", {})
        chains = {n: design[n] for n in ("radial_chain", "torsion_chain") if n in design}
        if not chains:
            return
        drive = make_drive(parse_drive(self.middle(chains), self.file).design)  # type: ignore[arg-type]
        for i in range(drive.radial_law_count if "radial_chain" in chains else 0):
            law = drive.radial_laws[i]
            numbers = (law.coefficient_mm_per_Nn, law.exponent, law.share, law.preload_N)
            self.say(f"design.radial_chain[{i}]", "radial", *numbers)
        for i in range(drive.torsion_count if "torsion_chain" in chains else 0):
            element = drive.torsion[i]
            origin = f"design.torsion_chain[{i}]"
            self.say(origin, "torsion", element.stiffness_Nm_per_rad, element.ratio)

    def middle(self, chains: Mapping[str, Any]) -> dict[str, Any]:
        """A drive file of the drive in the middle of all ranges."""
        v = self.values
        module, teeth = v[MODULE], int(v[TEETH])
        x1 = v.get("teeth.flexspline_shift", 3.0)
        deflection = v.get(DEFLECTION, module * v.get(DEFLECTION_MODULES, 1.0))
        design: dict[str, Any] = {
            "teeth": {
                "deformation": "external" if self.external() else "internal",
                "module_mm": module,
                "flexspline_teeth": teeth,
                "rigid_teeth": teeth + (-2 if self.external() else 2),
                "flexspline_shift": x1,
                "rigid_shift": v.get(RIGID, x1 + v.get(DIFFERENCE, 0.0)),
                "tooth_height": v.get("teeth.tooth_height", 1.75),
                "engagement_depth": v.get("teeth.engagement_depth", 1.2),
                "face_width_mm": v[WIDTH],
            },
            "generator": {
                "type": GENERATORS[int(v.get("generator.type", 0))],
                "deflection_mm": deflection,
                "contact_half_angle_deg": v.get("generator.contact_half_angle_deg", 30.0),
            },
            **chains,
        }
        for section in ("material",):
            found = {k.partition(".")[2]: x for k, x in v.items() if k.startswith(f"{section}.")}
            if found:
                design[section] = found
        ratio = self.sign * self.turning(teeth) / 2
        return {"drive": {"ratio": ratio, "rated_torque_Nm": self.rated_Nm}, "design": design}

    # --- the start, and the whole ---

    def read_start(self) -> None:
        for written, value in self.table("start").items():
            name, scale = self.find_key("start", written)
            place = f"search.start.{written}"
            self.spec.start[name] = self.number(place, name, scale, value)

    def begin_with(self, folder: str) -> None:
        """Begin with the front of an earlier search, as far as it lies in this one's ranges.

        Where that search found nothing, with the design that came nearest.
        """
        place = "search.start_from"
        front = Path(self.file).parent / folder / FRONT
        columns, rows = self.read_front(place, front)
        nearest = front.with_name(NEAREST)
        if not rows and nearest.is_file():
            columns, rows = self.read_front(place, nearest)
        statements = [line.split() for line in self.lines]
        choices = [words[1:] for words in statements if words[0] == "choose"]
        ranges = [words[1:] for words in statements if words[0] in ("range", "whole")]
        for name, *_ in choices + ranges:
            if name not in columns:
                raise self.refuse(place, f"{front} without a column {name}", "the same variables")
        starts = []
        for row in rows:
            words = [chosen(row[name], values) for name, *values in choices]
            words += [inside(row[name], low, high) for name, low, high in ranges]
            if None not in words:
                starts.append(words)
        if not starts:
            found = f"no design of {front} in the ranges and choices"
            raise self.refuse(place, found, "the folder of a search of such designs")
        most = min(engine()[1].LM_START_MAX, len(starts))
        for i in range(most):  # spread over the front, both ends among them
            self.say(place, "start", *starts[i * (len(starts) - 1) // max(most - 1, 1)])

    def read_front(self, place: str, front: Path) -> tuple[Sequence[str], list[dict[str, Any]]]:
        expected = f"the folder of a search, with its {FRONT}"
        try:
            found = "no file" if not front.is_file() else ""
            text = "" if found else read_bytes(front, expected).decode("utf-8-sig")
            lines = csv.DictReader(text.splitlines())
            rows = list(lines)
        except (InputError, ValueError, csv.Error) as error:
            found = error.found if isinstance(error, InputError) else str(error)
        if found:
            raise self.refuse(place, f"{as_in_file(str(front))} ({found})", expected)
        return lines.fieldnames or (), rows

    def check(self) -> None:
        """Let the optimizer read the text."""
        ffi, lib = engine()
        choices = [line.split()[2:] for line in self.lines if line.startswith("choose ")]
        combinations = math.prod(map(len, choices))
        if combinations > lib.LM_COMBINATION_MAX:
            found = f"{combinations} combinations of choices"
            raise self.refuse("search.range", found, f"at most {lib.LM_COMBINATION_MAX}")
        problem = ffi.new("lm_problem *")
        error = ffi.new("lm_spec_error *")
        if lib.lm_read_spec(self.spec.text.encode(), problem, error) == 0:
            return
        said = c_string(error.text)
        if error.line > 0:
            raise self.refuse(self.origins[error.line - 1], said, "what spec.h allows")
        match = re.fullmatch(r"(\S+): (.*) \(found (\S+), expected (\S+) to (\S+)\)", said)
        if match is None:
            raise self.refuse("search", said, "a search that can be done")
        key, sentence, found, low, high = match.groups()
        places = {name.replace(".0.", "."): place for name, place in self.said.items()}
        expected = f"{low} to {high}" if low != high else f"a value that fits ({sentence})"
        raise self.refuse(places.get(key, key), found, expected)


def chosen(written: str | None, values: Sequence[str]) -> str | None:
    """Find the word of a choice that has the value of a cell."""
    number = _number_of(written)
    for word in values:
        if word == written or (number is not None and number == _number_of(word)):
            return word
    return None


def inside(written: str | None, low: str, high: str) -> str | None:
    """Return a cell as a value of a range; None outside."""
    number = _number_of(written)
    least, most = float(low), float(high)
    beyond = ROUNDING * (most - least)
    if number is None or not least - beyond <= number <= most + beyond:
        return None
    return repr(min(max(number, least), most))


def _number_of(written: str | None) -> float | None:
    try:
        number = float(written or "")
    except ValueError:
        return None
    return number if math.isfinite(number) else None


_RANGE = "[low, high]"
_WIDE = f"{_RANGE} with low below high; one value goes into [search.fixed]"
_CHOICE = "{choose = [..]}"

POSITIONS = {"hole": (1.0, 0.5), "shaft": (-1.0, -0.5), "link": (1.0, 0.0)}
"""Sign of the influence, and the middle of a field that starts at zero, in fields."""

GRADES = (3, 12)
"""Finest and coarsest ISO tolerance grade that a search takes."""

TOLERANCE_KEYS = (
    Key("kind", kind="text"),
    Key("name", kind="text"),
    Key("zone", kind="choice", choices=ZONES, required=True),
    Key("it_grade", low=GRADES[0], high=GRADES[1]),
    Key("nominal", "mm", low=0, high=500),
    Key("lower", "mm", low=-10, high=10),
    Key("upper", "mm", low=-10, high=10),
    Key("fundamental_deviation", "mm", low=-10, high=10),
    Key("distribution", kind="choice", choices=DISTRIBUTIONS),
    Key("position", low=-10, high=10),
    Key("diameter", kind="switch"),
    Key("influence", low=-100, high=100),
    Key("cost_weight", above=0, high=1e6),
)
"""Keys of [[design.tolerance]] in a spec: those of a drive file, and what a feature costs."""


def split_limit(name: str) -> tuple[str, str]:
    """Split a limit into what it limits and its unit; "min" is no minute there."""
    match = re.fullmatch(r"(.*_(?:min|max))_(.*)", name)
    return (match[1], match[2]) if match else (name, "")


def _is_pair(value: Any) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 2
        and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in value)
        and all(math.isfinite(v) for v in value)
    )
