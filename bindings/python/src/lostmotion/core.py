"""The C library in one of its two precisions: declarations, zero-copy arrays, errors."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from lostmotion import _core32, _core64
from lostmotion.errors import LibraryError

Bits = Literal[32, 64]

Array = npt.NDArray[Any]

Kind = Literal["torque", "compliance", "width", "angle"]

KINDS: tuple[Kind, ...] = get_args(Kind)
"""Kinds of effects in the order of `lm_effect_kind`."""

FILLED_IN = ("elastic_rad", "wound_Nm")
"""Last fields of `lm_conditions`, which the model sets."""

NEEDS: tuple[str, ...] = tuple(
    name for name, _ in _core64.ffi.typeof("lm_conditions").fields if name not in FILLED_IN
)
"""Fields of `lm_conditions` that a host measures, in the order of the LM_NEEDS_ bits."""


REFERENCE_TEMPERATURE_C = float(_core64.lib.LM_REFERENCE_TEMPERATURE_C)
"""Temperature at which thermal effects are zero, °C."""


class Core:
    """One build of the library.

    Attributes
    ----------
    bits : int
        64 for double, 32 for float.
    ffi, lib
        Objects of cffi for the public headers; names are the same in both precisions.
    real : numpy.dtype
        The number type of this build.
    """

    def __init__(self, bits: Bits) -> None:
        module = _core64 if bits == 64 else _core32
        self.bits: Bits = bits
        self.ffi = module.ffi
        self.lib = module.lib
        self.real: np.dtype[Any] = np.dtype(np.float64 if bits == 64 else np.float32)

    def array(self, values: npt.ArrayLike) -> Array:
        """Return `values` as an array that the library can read; copied only if necessary."""
        return np.ascontiguousarray(values, dtype=self.real)

    def zeros(self, *shape: int) -> Array:
        """Return an array that the library can write to."""
        return np.zeros(shape, dtype=self.real)

    def pointer(self, array: Array, *, write: bool = False) -> Any:
        """Return a pointer to the memory of an array, which stays alive as long as the pointer.

        Raises
        ------
        TypeError
            If the array has a different number type or is not contiguous.
        """
        if array.dtype != self.real or not array.flags.c_contiguous:
            raise TypeError(f"a contiguous array of {self.real} is needed, not {array.dtype}")
        return self.ffi.from_buffer("lm_real[]", array, require_writable=write)

    def records(self, cdata: Any, count: int) -> Array:
        """View an array of C structs as a record array that shares its memory."""
        kind = self.ffi.typeof(cdata).item
        return np.frombuffer(
            self.ffi.buffer(cdata, count * self.ffi.sizeof(kind)), dtype=self.record_type(kind)
        )

    @cache  # noqa: B019  there are two objects of the class, for good
    def record_type(self, kind: Any) -> np.dtype[Any]:
        """Describe a C type to NumPy."""
        if kind.kind == "primitive":
            if kind.cname in ("double", "float"):
                return self.real
            return np.dtype(f"i{self.ffi.sizeof(kind)}")
        if kind.kind == "enum":
            return np.dtype(np.uintc)
        if kind.kind == "pointer":
            return np.dtype(np.uintp)
        if kind.kind == "array":
            return np.dtype((self.record_type(kind.item), (kind.length,)))
        fields = kind.fields
        return np.dtype(
            {
                "names": [name for name, _ in fields],
                "formats": [self.record_type(field.type) for _, field in fields],
                "offsets": [field.offset for _, field in fields],
                "itemsize": self.ffi.sizeof(kind),
            }
        )

    def fault(self) -> Any:
        """Return a struct in which the library reports a refused input."""
        return self.ffi.new("lm_fault *")

    def check(self, status: int, fault: Any = None) -> None:
        """Raise `LibraryError` unless the status is LM_OK."""
        if status == self.lib.LM_OK:
            return
        sentence = self.ffi.string(self.lib.lm_status_sentence(status)).decode()
        if fault is None or fault.input == self.ffi.NULL:
            raise LibraryError(status, sentence)
        key = self.ffi.string(fault.input).decode()
        raise LibraryError(status, sentence, key, fault.found, fault.low, fault.high)

    def call(self, function: Callable[..., int], *arguments: Any) -> None:
        """Call a function whose last argument is the fault; raise `LibraryError` if it refuses."""
        fault = self.fault()
        self.check(function(*arguments, fault), fault)

    def real_from(self, function: Callable[..., int], *arguments: Any) -> float:
        """Call a function that stores one number before the fault, and return the number."""
        one = self.ffi.new("lm_real *")
        self.call(function, *arguments, one)
        return float(one[0])


@cache
def core(bits: Bits = 64) -> Core:
    """Return the library in double (64) or float (32) precision."""
    return Core(bits)


def library_effects(c: Core) -> dict[str, Any]:
    """Return every `lm_effect` of the library by its name."""
    effects = (c.lib.lm_effects[i] for i in range(c.lib.LM_EFFECT_COUNT))
    return {c.ffi.string(effect.card.name).decode(): effect for effect in effects}


def value_ranges(c: Core, effect: Any) -> list[tuple[str, float, float]]:
    """Name with unit and bounds of every value of an effect of the library, in order."""
    names = (c.ffi.string(effect.card.value[i].name).decode() for i in range(effect.value_count))
    bounds = effect.bound[0 : effect.value_count]
    return [
        (name, float(low), float(high)) for name, (low, high) in zip(names, bounds, strict=True)
    ]
