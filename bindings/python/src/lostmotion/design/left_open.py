"""Keys that a spec does not state, with the values that the search used."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from lostmotion import structs, units
from lostmotion.design.engine import keys, rival_keys
from lostmotion.design.spec_keys import ASSUMED, NAMED, NEVER, SWITCHES
from lostmotion.structs import GENERATORS

LEVELS = ("worst", "probable", "quantile")
"""Production level of the tolerance figure, by the value of `lm_level`."""

UNSET = "in proportion to the size"
"""Text for a value without a design."""


def left_open(
    problem: Any,
    said: Mapping[str, str],
    values: Mapping[str, float] | None,
    design: Mapping[str, Any] | None,
) -> dict[str, Any]:
    """List the keys of [search] and [search.fixed] that a spec does not state.

    Parameters
    ----------
    problem : cdata
        ``lm_problem *``.
    said : mapping
        Values stated or assumed when the spec was read, by dotted key.
    values : mapping or None
        Keys of a design in units of the search; 0 if the model uses its default.
    design : mapping or None
        [design] of the drive file of that design, the source of such defaults.
    """
    found: dict[str, Any] = {}
    heads = {
        "search.seed": int(problem.seed),
        "search.evaluations": int(problem.evaluations),
        "search.torque_Nm": float(problem.torque_Nm),
        "search.phases": int(problem.phases),
        "search.level": LEVELS[problem.level],
        "search.cost.tolerance_exponent": float(problem.cost.tolerance_exponent),
        "search.cost.size": float(problem.cost.size),
        **{
            f"search.cost.{name}": float(problem.cost.generator[i])
            for i, name in enumerate(GENERATORS)
        },
    }
    found |= {key: value for key, value in heads.items() if key not in said}
    hidden = structs.unused_keys(design) if design is not None else set()
    involutes = not {"teeth.flexspline_flank", "teeth.rigid_flank"} & set(said)
    for name in filter(None, keys()):
        bare = units.split_unit(name)[0]
        if involutes and bare.startswith("flank."):
            continue
        stated = name in said or rival_keys().get(name, name) in said
        if stated or name in rival_keys() or bare in NEVER or bare in ASSUMED or bare in hidden:
            continue
        found[name] = value_taken(name, values, design)
    return found


def value_taken(
    name: str, values: Mapping[str, float] | None, design: Mapping[str, Any] | None
) -> Any:
    """Return the value of a key, in the unit of its name."""
    value = (values or {}).get(name, 0.0)
    if name in NAMED:
        return NAMED[name][int(value)]
    if name in SWITCHES:
        return bool(value)
    if value != 0.0:
        return value
    if design is None:
        return UNSET
    section, _, key = name.rpartition(".")
    table = design.get(section, {}) if section else design
    bare, unit = units.split_unit(key)
    for written, number in table.items():
        other, kept = units.split_unit(written)
        if other == bare and unit is not None and kept is not None:
            return number * kept.scale / unit.scale
    return table.get(key, 0.0)


def stated_keys(document: Mapping[str, Any], said: Mapping[str, str]) -> dict[str, str]:
    """Return the keys that a spec states: of its variables, and directly in [search]."""
    search = document["search"]
    heads = {f"search.{re.sub('_[A-Za-z]*Nm$', '_Nm', key)}": key for key in search}
    cost = search.get("cost", {})
    return {**said, **heads, **{f"search.cost.{key}": key for key in cost}}
