"""User effects, loaded from a Python file or from a shared object compiled from C."""

from __future__ import annotations

import ctypes
import importlib.util
import os
import sys
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

from lostmotion.core import Bits, core
from lostmotion.effects.effect import (
    Effect,
)
from lostmotion.effects.library import from_c
from lostmotion.errors import InputError, one_line


def load_python(file: str | Path) -> dict[str, Effect]:
    """Load the effects that a user's Python file defines.

    Raises
    ------
    InputError
        If the file does not run or defines no effect.
    """
    path = Path(file)
    spec = importlib.util.spec_from_file_location(f"lostmotion_user_{path.stem}", path)
    if spec is None or spec.loader is None or not os.path.isfile(path):
        raise InputError(path, "", "no such file", "a Python file with effects")
    module = importlib.util.module_from_spec(spec)
    cached, sys.dont_write_bytecode = sys.dont_write_bytecode, True  # without __pycache__
    try:
        spec.loader.exec_module(module)
    except InputError:
        raise
    except Exception as error:  # the user's own code may raise anything
        raise InputError(
            path, "", f"{type(error).__name__}: {error}", "Python code that runs"
        ) from None
    finally:
        sys.dont_write_bytecode = cached
    found = {v.name: v for v in vars(module).values() if isinstance(v, Effect)}
    if not found:
        raise InputError(path, "", "no effect", "a function decorated with lostmotion's @effect")
    return found


def load_shared_object(file: str | Path, bits: Bits = 64) -> dict[str, Effect]:
    """Load a user's own effect in C: a shared object with an `lm_effect`.

    Its name is lm_user_effect, or lm_effect_ and the name of the file (without a _f32 at its end).
    It must be compiled with LM_REAL_BITS=64 and with its card; the same source goes to the
    controller. With LM_REAL_BITS=32 it is the controller's function, for `replay`.
    """
    path = Path(file)
    if not os.path.isfile(path):
        raise InputError(path, "", "no such file", "a shared object")
    try:
        handle = ctypes.CDLL(str(path.resolve()))
    except OSError as error:
        said = one_line(str(error)).removeprefix(f"{path.resolve()}: ")
        expected = "a shared object"
        if "undefined symbol: lm_" in said:
            from lostmotion.shipped import include_folder

            elementary = Path(include_folder()).parent / "runtime" / "elementary.c"
            expected += f", compiled together with {elementary} (-I {elementary.parents[1]})"
        raise InputError(path, "", said, expected) from None
    symbols = ("lm_user_effect", f"lm_effect_{path.stem.removesuffix('_f32')}")
    symbol = next((name for name in symbols if hasattr(handle, name)), None)
    if symbol is None:
        raise InputError(path, " or ".join(symbols), "no such symbol", "const lm_effect")
    address = ctypes.addressof(ctypes.c_char.in_dll(handle, symbol))
    found_bits = _precision(address)
    if found_bits is None:
        raise InputError(path, symbol, "no card", "LM_EFFECT_CARDS not set to 0")
    if found_bits != bits:
        user = "the controller's, for replay" if bits == 32 else "32 is only for replay"
        raise InputError(
            path, symbol, f"LM_REAL_BITS={found_bits}", f"LM_REAL_BITS={bits} ({user})"
        )
    c = core(bits)
    pointer = c.ffi.cast("const lm_effect *", address)
    found = replace(
        from_c(pointer, bits), symbol=symbol, controller=pointer if bits == 32 else None
    )
    number = zlib.crc32(found.name.encode())
    if pointer.id != number:
        expected = (
            f"{number:#x}, the CRC-32 of {found.name}: binary parameters identify it by that number"
        )
        raise InputError(path, f"{symbol}.id", f"{int(pointer.id):#x}", expected)
    KEPT.append(handle)
    return {found.name: found}


def _precision(address: int) -> Bits | None:
    """Precision in which an `lm_effect` was compiled; None if it has no card.

    The card is in the same file as the effect. In the other layout a bound or zero is at the
    position of its pointer.
    """
    precisions: tuple[Bits, ...] = (32, 64)
    for bits in precisions:
        ffi = core(bits).ffi
        card = ffi.cast("uintptr_t *", address + ffi.offsetof("lm_effect", "card"))[0]
        if card and abs(card - address) < FILE_MAX:
            return bits
    return None


FILE_MAX = 1 << 31
"""Largest size of a shared object in bytes."""

KEPT: list[Any] = []
"""Shared objects stay loaded: their functions are called later."""


def load(file: str | Path, bits: Bits = 64) -> dict[str, Effect]:
    """Load a user's own effects from Python or from a shared object of a precision."""
    return load_python(file) if str(file).endswith(".py") else load_shared_object(file, bits)
