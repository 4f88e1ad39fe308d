"""The effects of the C library: the same C functions as on the controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.core import FILLED_IN, KINDS, NEEDS, Bits, core
from lostmotion.effects.effect import ROLES, SCALES, Effect, Value


class FunctionInC:
    """The function of an effect that is an `lm_effect` of the C library."""

    def __init__(self, effect: Any, bits: Bits = 64) -> None:
        self.effect = effect
        self.bits = bits

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle an effect of the library by its name; one of a shared object is refused."""
        c = core(self.bits)
        name = c.ffi.string(self.effect.card.name).decode()
        known = library().get(name)
        if known is None or known.function is not self:
            raise TypeError(f"effect {name}: one of a shared object cannot be pickled")
        return function_in_library, (name,)

    def __call__(
        self, values: FloatArray, run: Mapping[str, FloatArray], memory: FloatArray
    ) -> FloatArray:
        """Evaluate over one recording."""
        return self.sweep(values, run, memory, [0, run["torque_Nm"].size], fresh=False)

    def sweep(
        self,
        values: FloatArray,
        campaign: Mapping[str, FloatArray],
        memory: FloatArray,
        starts: Sequence[int],
        *,
        fresh: bool,
    ) -> FloatArray:
        """Evaluate over consecutive runs, with memory reset or continued at each run.

        The columns are passed once: a run is a view, not a copy.
        """
        c = core(self.bits)
        recordings = c.ffi.new("lm_recording[]", len(starts) - 1)
        columns = {
            name: c.pointer(c.array(campaign[name]))
            for name in (*NEEDS, *FILLED_IN)
            if name in campaign
        }
        table = c.records(recordings, len(starts) - 1)
        table["count"] = np.diff(starts)
        begins = c.real.itemsize * np.array(starts[:-1], np.uintp)
        for name, column in columns.items():
            table[name] = int(c.ffi.cast("uintptr_t", column)) + begins
        out = c.zeros(starts[-1])
        result = c.pointer(out, write=True)
        state = c.array(memory).copy()
        value, remembered = c.pointer(c.array(values)), c.pointer(state, write=True)
        for run, begin in enumerate(starts[:-1]):
            if fresh:
                state[:] = 0.0
            c.lib.lm_run_effect(self.effect, value, remembered, recordings + run, result + begin)
        memory[:] = state
        return np.asarray(out, dtype=np.float64)


def function_in_library(name: str) -> FunctionInC:
    """Give the function of an effect of the library."""
    function = library()[name].function
    assert isinstance(function, FunctionInC)
    return function


def from_c(effect: Any, bits: Bits = 64) -> Effect:
    """Describe an `lm_effect` of the C library or of a user's own shared object."""
    c = core(bits)

    def number(value: float) -> float:
        """Return the decimal number in the source code that was rounded to float32."""
        return float(str(np.float32(value))) if bits == 32 else float(value)

    def text(pointer: Any) -> str:
        return str(c.ffi.string(pointer).decode())

    card = effect.card

    def said(pointer: Any) -> str:
        return text(pointer) if pointer else ""

    def read(value: Any, bound: Any) -> Value:
        traits = int(value.traits)
        first, ratio = (
            bool(traits & bit)
            for bit in (c.lib.LM_VALUE_SIGN_OF_FIRST, c.lib.LM_VALUE_SIGN_OF_RATIO)
        )
        return Value(
            text(value.name),
            ROLES[int(value.role)],
            number(value.typical),
            number(bound[0]),
            number(bound[1]),
            SCALES[int(value.scale)],
            tuple(number(start) for start in value.start if start),
            "first" if first else "ratio" if ratio else "",
            bool(traits & c.lib.LM_VALUE_BETWEEN_RUNS),
            bool(traits & c.lib.LM_VALUE_SCALES),
            said(value.words),
        )

    values = tuple(read(card.value[i], effect.bound[i]) for i in range(effect.value_count))
    told_by = [name for bit, name in enumerate(NEEDS) if card.told_by >> bit & 1]
    needs = frozenset(name for bit, name in enumerate(NEEDS) if effect.covariates >> bit & 1)
    confounded = tuple(name.strip() for name in text(card.confused_with).split(",") if name.strip())
    return Effect(
        text(card.name),
        KINDS[int(effect.kind)],
        values,
        needs,
        FunctionInC(effect, bits),
        int(effect.memory_count),
        text(card.mechanism),
        text(card.equation),
        text(card.typical_size),
        confounded,
        text(card.experiment),
        absorbed=said(card.absorbed),
        told_by=told_by[0] if told_by else "",
        steps=bool(card.steps),
    )


@cache
def library() -> dict[str, Effect]:
    """Return the effects of the C library by name."""
    lib = core(64).lib
    effects = [from_c(lib.lm_effects[i]) for i in range(lib.LM_EFFECT_COUNT)]
    return {effect.name: effect for effect in effects}
