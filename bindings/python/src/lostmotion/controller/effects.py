"""The effects that may be active in a controller: those of the library and the user's own."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

from lostmotion.core import KINDS, NEEDS, Bits, Core, core, library_effects

if TYPE_CHECKING:
    from lostmotion.effects.effect import Effect


@cache
def own_effect(bits: Bits, effect: Effect) -> Any:
    """Make an `lm_effect` of a user effect, to be checked but not run.

    It is kept alive because parameters point to it. One in the controller's precision is used
    unchanged.
    """
    if bits == 32 and effect.controller is not None:
        return effect.controller
    made = core(bits).ffi.new("lm_effect *")
    made.id = zlib.crc32(effect.name.encode())
    made.kind = KINDS.index(effect.kind)
    made.value_count = len(effect.values)
    made.memory_count = effect.memory
    made.covariates = sum(1 << bit for bit, need in enumerate(NEEDS) if need in effect.needs)
    made.run = core(bits).lib.lm_effects[0].run  # any function: the check requires one
    for i, value in enumerate(effect.values):
        made.bound[i][0], made.bound[i][1] = value.low, value.high
    return made


def known_effects(c: Core, own: Mapping[str, Effect]) -> dict[str, Any]:
    """Return every available `lm_effect` by its name."""
    mine = {name: own_effect(c.bits, effect) for name, effect in own.items()}
    return {**library_effects(c), **mine}


def build_macros(effects: Sequence[tuple[str, Sequence[float]]], own: Mapping[str, Effect]) -> str:
    """Compiler options that the run-time code needs for these effects."""
    known = known_effects(core(32), own)
    memory = sum(int(known[name].memory_count) for name, _ in effects)
    return f"-DLM_EFFECTS_MAX={len(effects)} -DLM_EFFECT_MEMORY_MAX={memory}"
