"""The optimizer's C library: availability and names."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

from lostmotion.errors import LostMotionError

MISSING = (
    "the design search is not in this installation: NLopt (Debian, Ubuntu: libnlopt-dev) or a C++ "
    "compiler was missing when lostmotion was built; install both and build the package again"
)

STAGES = ("screen", "evolve", "race", "polish", "trade-off", "repair", "verify", "done")
"""By the value of `lm_search_stage`."""

FATES = ("not_reached", "pruned", "dominated", "solved")
"""By the value of `lm_fate`."""

ARCMIN_PER_RAD = 10_800 / math.pi
"""arcmin in a radian: converts a compliance in arcmin/(N m) to a stiffness in N m/rad."""


@cache
def engine() -> tuple[Any, Any]:
    """Return ``ffi`` and ``lib`` of the optimizer.

    Raises
    ------
    LostMotionError
        When the package was built without it.
    """
    try:
        from lostmotion import _search
    except ImportError:
        raise LostMotionError(MISSING) from None
    return _search.ffi, _search.lib


def c_string(cdata: Any) -> str:
    """Return a C string."""
    ffi, _ = engine()
    found: str = ffi.string(cdata).decode(errors="replace")
    return found


@cache
def figures() -> tuple[tuple[str, str], ...]:
    """Names and units of the computed figures of a design, by `lm_figure`.

    The third is a stiffness here but a compliance in the search.
    """
    _, lib = engine()
    found = [
        (c_string(lib.lm_figure_name(i)), c_string(lib.lm_figure_unit(i)))
        for i in range(lib.LM_FIGURE_COUNT)
    ]
    found[lib.LM_FIGURE_COMPLIANCE] = ("stiffness", "Nm_per_rad")
    return tuple(found)


def figure_value(figure: int, value: float) -> float:
    """Convert a figure of the search to that of `figures`."""
    _, lib = engine()
    return ARCMIN_PER_RAD / value if figure == lib.LM_FIGURE_COMPLIANCE else value


@cache
def limit_names() -> tuple[str, ...]:
    """Names of the limits, by `lm_limit`."""
    _, lib = engine()
    return tuple(c_string(lib.lm_limit_name(i)) for i in range(lib.LM_LIMIT_COUNT))


@cache
def keys() -> dict[str, int]:
    """The dotted keys that can be fixed, varied or chosen, with the units of the search."""
    ffi, lib = engine()
    text = ffi.new("char[]", lib.LM_KEY_NAME_MAX)
    found = {}
    for key in range(lib.LM_KEY_GRADE):
        lib.lm_write_key(key, text)
        found[c_string(text)] = key
    return found


@cache
def rival_keys() -> dict[str, str]:
    """Pairs of keys that state the same quantity."""
    _, lib = engine()
    names = {key: name for name, key in keys().items()}
    return {
        name: names[lib.lm_rival_key(k)] for k, name in names.items() if lib.lm_rival_key(k) != k
    }
