"""Search specs: TOML files with variables, limits and objectives, translated for the optimizer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from lostmotion import drives
from lostmotion.calibrate import CONSTANTS
from lostmotion.design.engine import engine, figures, limit_names
from lostmotion.design.left_open import LEVELS, stated_keys
from lostmotion.design.spec_chains import state_chains
from lostmotion.design.spec_keys import (
    SWITCH_LIMITS,
    find_key,
    find_limit,
    read_value,
    split_limit,
    tooth_counts,
)
from lostmotion.design.spec_tolerances import ToleranceLink, read_tolerances
from lostmotion.design.start_from import begin_with
from lostmotion.design.statements import Statements
from lostmotion.design.textbook import TORQUE_PER_D3
from lostmotion.design.variables import Variables, is_pair
from lostmotion.drives import read_drive, read_toml
from lostmotion.errors import InputError, did_you_mean
from lostmotion.keys import Key, TableEntry, as_in_file, read_keys
from lostmotion.structs import GENERATORS

SECTIONS = ("drive", "design", "search")
TABLES = ("fixed", "range", "limits", "cost", "start")


@cache
def search_keys() -> tuple[Key, ...]:
    """Return the keys of [search] besides its tables and the list of objectives.

    The optimizer defines the ranges of those that it reads.
    """
    _, lib = engine()
    return (
        Key("seed", kind="integer"),
        Key("evaluations", kind="integer"),
        Key("workers", kind="integer", low=1, high=lib.LM_WORKERS_MAX),
        Key("dask", kind="text"),
        Key("torque", "Nm", above=0),
        Key("phases", kind="integer"),
        Key("level", kind="choice", choices=LEVELS),
        Key("rigid_gear_turns", kind="switch"),
        Key("start_from", kind="text"),
        Key("calibrated_from", kind="text"),
        Key("damaged_share", low=0, high=1),
    )


DRIVE_KEYS = tuple(replace(key, required=False) for key in drives.DRIVE_KEYS)

COST_KEYS = (
    Key("tolerance_exponent", above=0, high=10),
    Key("size", low=0, high=1e6),
    *(Key(name, low=0, high=1e6) for name in GENERATORS),
)


@dataclass
class Spec:
    """A search spec.

    Attributes
    ----------
    file : str
    name : str
        Of the drives that the search finds.
    text : str
        Text for the optimizer.
    objectives : tuple of int
        By `lm_figure`.
    workers, dask
        As stated in the file, else None.
    assumed : dict
        Default values of keys that the file does not state, by dotted key.
    links : list of ToleranceLink
        The tolerances; a fit and a gear count as two links.
    said : dict
        Keys that the file states or for which a value is assumed, by dotted key.
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
    links: list[ToleranceLink] = field(default_factory=list)
    said: dict[str, str] = field(default_factory=dict)
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
    """Parse the tables of a search spec; `file` is for messages."""
    document = with_calibration(document, file)
    out = Statements(file, document)
    for section in document:
        if section not in SECTIONS:
            hint = did_you_mean(section, SECTIONS)
            expected = "one of the tables " + ", ".join(SECTIONS) + hint
            raise out.refuse(section, "an unknown table", expected)
    search = document.get("search")
    if not isinstance(search, Mapping):
        raise out.refuse("search", "no such table", "[search] with objectives")
    numbers = {k: v for k, v in search.items() if k != "objectives"}
    head = read_keys(file, "search", numbers, search_keys(), tables=TABLES)
    drive = read_keys(file, "drive", document.get("drive", {}), DRIVE_KEYS)
    # In the order in which the optimizer requires the statements.
    objectives = read_objectives(out)
    state_head(out, head)
    ratio, sign = ratio_window(out, drive)
    turns = "rigid_gear_turns" in head and bool(head["rigid_gear_turns"].value)
    variables = Variables(out, ratio, turns)
    variables.read()
    rated_Nm = state_rated_torque(out, drive, variables)
    variables.check_rigid_teeth()
    links = read_tolerances(out, variables)
    read_limits(out)
    read_cost(out)
    state_chains(out, variables, sign, rated_Nm)
    start = read_start(out)
    if "start_from" in head:
        begin_with(out, head["start_from"].value)
    out.check(variables.said)
    return Spec(
        file,
        drive["name"].value if "name" in drive else Path(file).stem,
        out.text,
        objectives,
        head["workers"].value if "workers" in head else None,
        head["dask"].value if "dask" in head else None,
        out.assumed,
        links,
        {**stated_keys(document, variables.said), **dict.fromkeys(out.assumed, "assumed")},
        start,
        dict(document),
    )


def with_calibration(document: Mapping[str, Any], file: str) -> Mapping[str, Any]:
    """Fix the support constants of the drive file that `calibrated_from` names.

    Constants stated in the spec take precedence.
    """
    search = document.get("search")
    if not isinstance(search, Mapping) or not isinstance(search.get("calibrated_from"), str):
        return document
    calibrated = read_drive(Path(file).parent / search["calibrated_from"])
    support = calibrated.document.get("design", {}).get("support", {})
    found = {f"support.{k}": v for k, v in support.items() if k in CONSTANTS}
    if not found:
        raise InputError(
            file,
            "search.calibrated_from",
            f"{search['calibrated_from']} without calibrated constants in [design.support]",
            "a file that lostmotion calibrate wrote",
        )
    stated = {*search.get("fixed", {}), *search.get("range", {})}
    fixed = {**search.get("fixed", {}), **{k: v for k, v in found.items() if k not in stated}}
    return {**document, "search": {**search, "fixed": fixed}}


def read_objectives(out: Statements) -> tuple[int, ...]:
    """State the objectives; returns them by `lm_figure`."""
    names = [name for name, _ in figures()]
    expected = f"a list of one to four of {', '.join(names)}"
    found = out.document["search"].get("objectives")
    if found is None:
        raise out.refuse("search.objectives", "nothing", expected)
    if (
        not isinstance(found, list)
        or not 1 <= len(found) <= 4
        or len(set(map(repr, found))) < len(found)
    ):
        raise out.refuse("search.objectives", as_in_file(found), expected)
    for name in found:
        if name not in names:
            hint = did_you_mean(name, names) if isinstance(name, str) else ""
            raise out.refuse("search.objectives", as_in_file(name), expected + hint)
    for name in found:
        out.say("search.objectives", "objective", name)
    return tuple(names.index(name) for name in found)


def state_head(out: Statements, head: Mapping[str, TableEntry]) -> None:
    """State the numbers of [search]."""
    names = {"torque": "torque_Nm"}
    for name in (
        "seed",
        "evaluations",
        "torque",
        "phases",
        "level",
        "rigid_gear_turns",
        "damaged_share",
    ):
        if name in head:
            value = head[name].value
            value = int(value) if isinstance(value, bool) else value
            out.say(head[name].place, names.get(name, name), value)
    if "phases" not in head and "kinematic_error" in out.document["search"]["objectives"]:
        out.assume("search.phases", 4)
        out.say("search.phases", "phases", 4)


def ratio_window(
    out: Statements, drive: Mapping[str, TableEntry]
) -> tuple[tuple[float, float] | None, int]:
    """Range of the magnitude of the ratio, None if unrestricted, and its sign."""
    ratio: tuple[float, float] | None = None
    sign = 1
    if "ratio" in drive:
        sign = -1 if drive["ratio"].value < 0 else 1
        ratio = (abs(drive["ratio"].value),) * 2
    if "ratio" in out.table("limits"):
        ratio, sign = read_ratio(out, out.table("limits")["ratio"])
    if sign < 0:
        out.say("drive.ratio", "ratio_sign", -1)
    return ratio, sign


def read_ratio(out: Statements, value: Any) -> tuple[tuple[float, float], int]:
    """Range of the magnitude of the ratio, and its sign."""
    fewest, most = tooth_counts()
    window = f"between {fewest // 2} and {most // 2 + 1} turns"
    expected = f"[lowest, highest], both of one sign, {window}"
    if not is_pair(value) or not value[0] <= value[1] or value[0] * value[1] <= 0:
        raise out.refuse("search.limits.ratio", as_in_file(value), expected)
    low, high = sorted(abs(float(v)) for v in value)
    return (low, high), -1 if value[0] < 0 else 1


def state_rated_torque(
    out: Statements, drive: Mapping[str, TableEntry], variables: Variables
) -> float:
    """State the rated torque, N m: from the file, or from the size."""
    if "rated_torque" in drive:
        rated = float(drive["rated_torque"].value)
        place = drive["rated_torque"].place
    else:
        # An impossible size is reported for its own key, not for the torque derived from it.
        usual = TORQUE_PER_D3 * variables.diameter_mm**3
        _, lib = engine()
        rated = min(max(usual, lib.LM_RATED_LEAST_NM), lib.LM_RATED_MOST_NM)
        place = "drive.rated_torque_Nm"
        out.assume(place, rated)
    out.say(place, "rated_torque_Nm", rated)
    return rated


def read_limits(out: Statements) -> None:
    """State [search.limits] except the ratio."""
    _, lib = engine()
    names = list(limit_names()[lib.LM_LIMIT_SAFETY :])
    for written, value in out.table("limits").items():
        place = f"search.limits.{written}"
        if written == "ratio":
            continue
        if written in SWITCH_LIMITS:
            if not isinstance(value, bool):
                raise out.refuse(place, as_in_file(value), "true or false")
            out.say(place, "limit", written, int(value))
            continue
        name, scale = find_limit(out.file, place, written, names)
        out.say(place, "limit", name, read_value(out.file, place, "", scale, value))
    given = out.table("limits")
    for name, value in (("safety_factor_min", 1.5), ("gap_min_arcmin", 0.0)):
        base = split_limit(name)[0]
        if not any(split_limit(written)[0] == base for written in given):
            out.assume(f"search.limits.{name}", value)


def read_cost(out: Statements) -> None:
    """State [search.cost]."""
    place = "search.cost"
    for name, value in read_keys(out.file, place, out.table("cost"), COST_KEYS).items():
        out.say(f"{place}.{name}", "cost", name, value.value)


def read_start(out: Statements) -> dict[str, float]:
    """[search.start] in the units of the search."""
    start = {}
    for written, value in out.table("start").items():
        name, scale = find_key(out.file, "start", written)
        place = f"search.start.{written}"
        start[name] = read_value(out.file, place, name, scale, value)
    return start
