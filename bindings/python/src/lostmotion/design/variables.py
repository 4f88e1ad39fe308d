"""Variables of a search: fixed values, ranges and choices of a design."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from lostmotion import units
from lostmotion.design.engine import engine, rival_keys
from lostmotion.design.spec_keys import (
    ASSUMED,
    AXIAL_SECTIONS,
    DEFLECTION,
    DEFLECTION_MODULES,
    DEFORMATION,
    DEPTH,
    DIFFERENCE,
    FIXED_ONLY,
    MODULE,
    NAMED,
    PLANAR_ONLY,
    RIGID,
    RIGID_TEETH,
    TEETH,
    WIDTH,
    find_key,
    one_value,
    read_value,
    tooth_counts,
    word,
)
from lostmotion.design.statements import Statements
from lostmotion.design.textbook import SECTIONS as FACE_SECTIONS
from lostmotion.design.textbook import WIDTH_PER_D
from lostmotion.keys import as_in_file
from lostmotion.structs import DEFORMATIONS

DEFAULT_TEETH = 200
DEFAULT_DEPTH = (0.6, 1.2)
"""Range of the engagement depth, in modules: from that of short cups to the textbook value.
"""
DEFAULT_DIFFERENCE = (-0.4, 0.6)
"""Range of x2 - x1 that contains every interference-free pair from w0/m = 0.85 to 1.2."""

RANGE = "[low, high]"
WIDE = f"{RANGE} with low below high; one value goes into [search.fixed]"
CHOICE = "{choose = [..]}"


class Variables:
    """Common and varied values of the drives of a search.

    Parameters
    ----------
    out : Statements
    ratio : tuple of float or None
        Range of the magnitude of the ratio; None if unrestricted.
    turns : bool
        Whether the rigid gear is the output.

    Attributes
    ----------
    values : dict
        Values of one drive of the search, from which others are derived, by dotted key.
    said : dict
        Place in the file of each dotted key.
    """

    def __init__(self, out: Statements, ratio: tuple[float, float] | None, turns: bool) -> None:
        self.out = out
        self.ratio = ratio
        self.turns = turns
        self.values: dict[str, float] = {}
        self.said: dict[str, str] = {}

    @property
    def diameter_mm(self) -> float:
        """Pitch diameter of that drive."""
        return self.values[MODULE] * self.values[TEETH]

    def read(self) -> None:
        """Read [search.fixed] and [search.range], and state defaults for the rest."""
        self.check_turning()
        for name in ("fixed", "range"):
            for key, value in self.out.table(name).items():
                if name != "fixed" or not self.is_assumed(key, value):
                    self.read_variable(name, key, value)
        self.fill_open()

    def read_variable(self, table: str, written: str, value: Any) -> None:
        """Read a key of [search.fixed] or [search.range]."""
        name, scale = find_key(self.out.file, table, written)
        place = f"search.{table}.{written}"
        for stated in (name, rival_keys().get(name, name)):
            if stated in self.said:
                raise self.out.refuse(
                    place, "a second value", f"one of this and {self.said[stated]}"
                )
        self.said[name] = place
        if table == "range" and name in FIXED_ONLY:
            raise self.out.refuse(
                place, as_in_file(value), "the key in [search.fixed], because it cannot vary"
            )
        if table == "fixed":
            number = one_value(self.out.file, place, name, scale, value)
            self.values[name] = number
            self.out.say(place, "fixed", name, word(name, number))
        elif isinstance(value, Mapping):
            self.read_choice(place, name, scale, value)
        else:
            self.read_range(place, name, scale, value)

    def read_choice(self, place: str, name: str, scale: float, value: Mapping[str, Any]) -> None:
        """Read ``{choose = [..]}``."""
        found = value.get("choose")
        if set(value) != {"choose"} or not isinstance(found, list) or not found:
            raise self.out.refuse(place, as_in_file(found if found is not None else value), CHOICE)
        numbers = [one_value(self.out.file, place, name, scale, each) for each in found]
        if len(set(numbers)) < len(numbers):
            raise self.out.refuse(place, as_in_file(found), "each value once")
        if name == TEETH:
            numbers = self.teeth_in_window(place, numbers)
        self.choose(place, name, numbers)

    def choose(self, place: str, name: str, numbers: Sequence[float]) -> None:
        """State a choice."""
        most = engine()[1].LM_CHOICE_VALUES_MAX
        if len(numbers) > most:
            raise self.out.refuse(place, f"{len(numbers)} values", f"at most {most}")
        self.values[name] = numbers[len(numbers) // 2]
        self.out.say(place, "choose", name, *(word(name, number) for number in numbers))

    def read_range(self, place: str, name: str, scale: float, value: Any) -> None:
        """Read ``[low, high]``."""
        if name in NAMED or not is_pair(value):
            raise self.out.refuse(place, as_in_file(value), RANGE if name not in NAMED else CHOICE)
        low, high = (read_value(self.out.file, place, name, scale, each) for each in value)
        if not low < high:
            raise self.out.refuse(place, as_in_file(value), WIDE)
        if name == TEETH:
            numbers = [float(z) for z in range(math.ceil(low), math.floor(high) + 1) if z % 2 == 0]
            self.choose(place, name, self.teeth_in_window(place, numbers))
            return
        whole = ".grade" in name and all(isinstance(each, int) for each in value)
        self.values[name] = (low + high) / 2
        kind = "whole" if whole else "range"
        self.out.say(place, kind, name, word(name, low), word(name, high))

    def teeth_in_window(self, place: str, numbers: Sequence[float]) -> list[float]:
        """Keep the numbers of teeth whose ratio is in the range."""
        if self.ratio is None:
            kept = list(numbers)
        else:
            low, high = self.ratio
            kept = [z for z in numbers if low <= self.turning(z) / 2 <= high]
        if not kept:
            window = "" if self.ratio is None else " with a ratio in the window"
            raise self.out.refuse(place, "no number of teeth", f"an even number of teeth{window}")
        return kept

    def turning(self, teeth: float) -> float:
        """Number of teeth of the output gear."""
        external = self.external()
        return teeth + (-2 if external else 2) if self.turns else teeth

    def deformations(self) -> list[Any]:
        """Return the deformations that the drives of the search may have."""
        table = {**self.out.table("fixed"), **self.out.table("range")}
        value = table.get(DEFORMATION, DEFORMATIONS[0])
        found = value.get("choose") if isinstance(value, Mapping) else None
        return found if isinstance(found, list) else [value]

    def external(self) -> bool:
        """Whether the teeth of every drive are inside the flexspline."""
        return self.deformations() == ["external"]

    def check_turning(self) -> None:
        """Refuse a range of ratios in which the same teeth have two ratios."""
        if self.turns and self.ratio is not None and len(self.deformations()) > 1:
            place = f"search.range.{DEFORMATION}"
            expected = "one: where the rigid gear turns, its teeth and the ratio follow from it"
            raise self.out.refuse(place, "both deformations and a ratio", expected)

    def fill_open(self) -> None:
        """State defaults that the search requires and the file does not state."""
        if MODULE not in self.values:
            expected = "this key in [search.fixed] or [search.range]"
            raise self.out.refuse(f"search.fixed.{MODULE}", "nothing", expected)
        if TEETH not in self.values:
            if self.ratio is None:
                self.out.assume(TEETH, DEFAULT_TEETH)
                self.choose("search.fixed", TEETH, [float(DEFAULT_TEETH)])
            else:
                fewest, most = tooth_counts()
                numbers = [float(z) for z in range(fewest, most + 1, 2)]
                place = (
                    "search.limits.ratio" if "ratio" in self.out.table("limits") else "drive.ratio"
                )
                self.choose(place, TEETH, self.teeth_in_window(place, numbers))
        if AXIAL_SECTIONS not in self.values and not self.values.get(PLANAR_ONLY):
            self.out.assume(AXIAL_SECTIONS, FACE_SECTIONS)
            self.out.say("search.fixed", "fixed", AXIAL_SECTIONS, FACE_SECTIONS)
            self.values[AXIAL_SECTIONS] = float(FACE_SECTIONS)
        if RIGID not in self.values and DIFFERENCE not in self.values:
            self.out.assume(DIFFERENCE, list(DEFAULT_DIFFERENCE))
            self.out.say("search.range", "range", DIFFERENCE, *DEFAULT_DIFFERENCE)
            self.values[DIFFERENCE] = 0.0
        if DEPTH not in self.values:
            self.out.assume(DEPTH, list(DEFAULT_DEPTH))
            self.out.say("search.range", "range", DEPTH, *DEFAULT_DEPTH)
            self.values[DEPTH] = sum(DEFAULT_DEPTH) / 2
        if WIDTH not in self.values:
            width = WIDTH_PER_D * self.diameter_mm
            self.out.assume(WIDTH, width)
            self.out.say("search.fixed", "fixed", WIDTH, width)
            self.values[WIDTH] = width
        if DEFLECTION not in self.values and DEFLECTION_MODULES not in self.values:
            self.out.assume(DEFLECTION_MODULES, 1.0)
            self.out.say("search.fixed", "fixed", DEFLECTION_MODULES, 1)
            self.values[DEFLECTION_MODULES] = 1.0

    def is_assumed(self, written: str, value: Any) -> bool:
        """Whether a fixed value is the one assumed for all drives of a search."""
        if written == RIGID_TEETH:
            return True
        base = units.split_unit(written)[0]
        return base in ASSUMED and value is not None and value == ASSUMED[base]

    def check_rigid_teeth(self) -> None:
        """Refuse a number of rigid gear teeth that does not match the flexspline."""
        found = self.out.table("fixed").get(RIGID_TEETH)
        if found is None:
            return
        place = f"search.fixed.{RIGID_TEETH}"
        if self.said.get(TEETH) != f"search.fixed.{TEETH}":
            raise self.out.refuse(place, f"no {TEETH} beside it", "both in [search.fixed]")
        wanted = int(self.values[TEETH]) + (-2 if self.external() else 2)
        if found != wanted:
            raise self.out.refuse(place, as_in_file(found), f"{wanted}, by {TEETH}")


def is_pair(value: Any) -> bool:
    """Whether a value of the file is a pair of finite numbers."""
    return (
        isinstance(value, list)
        and len(value) == 2
        and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in value)
        and all(math.isfinite(v) for v in value)
    )
