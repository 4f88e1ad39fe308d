"""Forms of the hysteresis: friction in parallel or in series, constant or growing with the load.

No heavy imports, because the command line options also use them.
"""

from __future__ import annotations

from typing import Literal, get_args

Friction = Literal["inside", "outside", "inside+load", "both", "both+load"]

FORMS: tuple[Friction, ...] = get_args(Friction)
"""In the order of their numbers of values: the first sufficient one is selected."""

PARTS: dict[Friction, frozenset[str]] = {
    "inside": frozenset({"parallel"}),
    "outside": frozenset({"series"}),
    "inside+load": frozenset({"parallel", "load"}),
    "both": frozenset({"parallel", "series"}),
    "both+load": frozenset({"parallel", "series", "load"}),
}
"""Parts: friction in parallel with the spring, in series, half widths that grow with the load. A
form contains every form whose parts are among its own.
"""

WORDS: dict[Friction, str] = {
    "inside": "in parallel with the spring",
    "outside": "in series with the spring",
    "inside+load": "in parallel with the spring, growing with the load",
    "both": "in parallel and in series with the spring",
    "both+load": "in parallel and in series with the spring, growing with the load",
}
"""Description of every form, after 'friction'."""


def contained(form: Friction) -> tuple[Friction, ...]:
    """Forms that are the next smaller ones within a form."""
    inner = [other for other in FORMS if PARTS[other] < PARTS[form]]
    return tuple(one for one in inner if not any(PARTS[one] < PARTS[other] for other in inner))
