"""Entries of [[design.tolerance]] that represent two links: a fit (hole, shaft) and gear teeth.

They are expanded before any other use, so a chain contains only links.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from lostmotion import tooth_grades
from lostmotion.errors import InputError
from lostmotion.keys import Key, as_in_file, read_keys
from lostmotion.structs import DISTRIBUTIONS, ZONES
from lostmotion.tolerance_classes import read_fit

COMBINED = ("fit", "gear")
"""Kinds that are expanded."""

GEAR_KEYS = (
    Key("kind", kind="text"),
    Key("name", kind="text"),
    Key("gear", kind="choice", choices=("flexspline", "rigid"), required=True),
    Key("tooth_grade", kind="integer", low=tooth_grades.GRADES[0], high=tooth_grades.GRADES[1]),
    Key("nominal", "mm", above=0, high=500),
    Key("module", "mm", above=0, high=10),
    Key("distribution", kind="text"),
    Key("cost_weight", above=0, high=1e6),
)
"""Keys of ``kind = "gear"``."""

FIT_KEYS = (
    Key("fit", kind="text", required=True),
    Key("nominal", "mm", required=True),
    Key("zone", kind="choice", choices=ZONES, required=True),
    Key("it_grade", kind="integer"),
    Key("distribution", kind="choice", choices=DISTRIBUTIONS),
    Key("diameter", kind="switch"),
    Key("cost_weight", above=0, high=1e6),
)
"""Keys of ``kind = "fit"``; its hole and its shaft read them."""

COMBINED_KEYS = {"fit": FIT_KEYS, "gear": GEAR_KEYS[2:]}
"""Keys besides ``kind`` and ``name``, by kind."""


def spelled_out(
    file: str,
    place: str,
    entries: Sequence[Mapping[str, Any]],
    teeth: Mapping[str, Any],
    with_nominal: bool = False,
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Give the entries of a chain, each with its place in the file.

    Parameters
    ----------
    teeth : mapping
        [design.teeth], the source of module and number of teeth for a gear that does not state
        ``module_mm`` and ``nominal_mm``, its reference diameter.
    with_nominal : bool
        Whether the links of a gear state that diameter, which a search needs for its costs.
    """
    for index, entry in enumerate(entries):
        at = f"{place}[{index}]"
        kind = entry.get("kind") if place == "design.tolerance" else None
        if kind == "fit":
            yield from ((at, part) for part in parts_of_fit(file, at, index, entry))
        elif kind == "gear":
            parts = parts_of_gear(file, at, index, entry, teeth, with_nominal)
            yield from ((at, part) for part in parts)
        else:
            yield at, entry


def parts_of_fit(
    file: str, at: str, index: int, entry: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Give the hole and the shaft of a fit."""
    text = entry.get("fit")
    if not isinstance(text, str):
        found = "nothing" if text is None else as_in_file(text)
        raise InputError(file, f"{at}.fit", found, "a fit such as 'H7/g6'")
    try:
        classes = read_fit(text)
    except ValueError as error:
        raise InputError(file, f"{at}.fit", as_in_file(text), str(error)) from None
    rest = {key: value for key, value in entry.items() if key not in ("kind", "fit", "name")}
    name = entry.get("name", f"tolerance[{index}]")
    hole, shaft = (
        {"kind": kind, "name": f"{name}, {kind}", "tolerance_class": str(one), **rest}
        for kind, one in zip(("hole", "shaft"), classes, strict=True)
    )
    return hole, shaft


def parts_of_gear(
    file: str,
    at: str,
    index: int,
    entry: Mapping[str, Any],
    teeth: Mapping[str, Any],
    with_nominal: bool,
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Give run-out and infeed of a gear's teeth, both radial: ISO 1328-1, ISO/TR 10064-2.

    The infeed only makes teeth thinner and spaces wider: its field opens the gap.
    """
    read = {key: value.value for key, value in read_keys(file, at, entry, GEAR_KEYS).items()}
    if "tooth_grade" not in read:
        raise InputError(file, f"{at}.tooth_grade", "nothing", "this key, a tooth grade")
    grade = int(read["tooth_grade"])
    module = read.get("module", stated_number(teeth.get("module_mm")))
    count = stated_number(teeth.get(f"{read['gear']}_teeth"))
    diameter = read.get("nominal")
    if diameter is None and module is not None and count is not None:
        diameter = module * count
    if module is None or diameter is None:
        expected = "module_mm and nominal_mm, the reference diameter, where the teeth are not fixed"
        raise InputError(file, at, "no size", expected)
    if not 0 < diameter <= 500:
        found = f"a reference diameter of {diameter:g} mm"
        raise InputError(file, at, found, "more than 0, 500 mm at most")
    name = read.get("name", f"{read['gear']} teeth")
    runout = tooth_grades.runout_um(diameter, module, grade) / 1e3
    infeed = tooth_grades.infeed_um(diameter, grade) / 1e3
    common: dict[str, Any] = {
        "kind": "link",
        "zone": "teeth",
        "influence": 1.0,
        **({"nominal_mm": diameter} if with_nominal else {}),
        **{key: read[key] for key in ("distribution", "cost_weight") if key in read},
    }
    return (
        {**common, "name": f"{name}, run-out", "lower_mm": -runout / 2, "upper_mm": runout / 2},
        {**common, "name": f"{name}, infeed", "lower_mm": 0.0, "upper_mm": infeed},
    )


def stated_number(value: Any) -> float | None:
    """Return a value of the file as a number, or None if it is not a number."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number else None
