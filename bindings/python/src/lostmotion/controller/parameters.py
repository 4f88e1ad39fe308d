"""The parameter struct of the library, and its binary form."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from lostmotion.controller.effects import known_effects
from lostmotion.controller.from_drive import Controller
from lostmotion.core import Core, core
from lostmotion.errors import InputError, LibraryError


def build(controller: Controller, c: Core | None = None) -> Any:
    """Build the library's own struct and check it.

    Returns
    -------
    cdata
        An owned ``lm_parameters *`` with its fingerprint. That of the gap profile can be stored but
        not run: the library in this package is built with a curve.

    Raises
    ------
    InputError
        When the library refuses a value.
    """
    c = c or core(32)
    made = c.ffi.new("lm_parameters *")
    made.torque_limit_Nm = controller.torque_limit_Nm
    for part, target in (
        (controller.limits, made.limits),
        (controller.watch, made.watch),
        (controller.valid, made.valid),
    ):
        for name in (entry.name for entry in fields(part)):
            setattr(target, name, getattr(part, name))
    if controller.torque_Nm.size:
        _build_model(controller, c, made)
    else:
        _build_gap(controller, made)
    made.fingerprint = int.from_bytes(store(made, c)[-4:], "little")
    return made


def _build_gap(controller: Controller, made: Any) -> None:
    """Set one operator directly: its weight exceeds the limit for operators with a curve."""
    (play,) = controller.plays
    made.plays.count = made.plays.outside_count = 1
    made.plays.knee_Nm = controller.envelope.knee_Nm
    slot = made.plays.slot[0]
    slot.radius_Nm, slot.weight = play.radius_Nm, play.weight
    made.plays.outside_rad_per_Nm = play.weight
    slot.edge_slope[0] = slot.edge_slope[1] = 1.0


def _build_model(controller: Controller, c: Core, made: Any) -> None:
    made.format = c.lib.LM_PARAMETERS_LAYOUT
    torque, angle = c.array(controller.torque_Nm), c.array(controller.angle_rad)
    plays = c.ffi.new("lm_play[]", max(1, len(controller.plays)))
    for i, play in enumerate(controller.plays):
        plays[i] = (play.radius_Nm, play.widening, play.weight)
    table = known_effects(c, controller.own)
    made.effect_count = len(controller.effects)
    for i, (name, values) in enumerate(controller.effects):
        made.effect[i].effect = table[name]
        for j, value in enumerate(values):
            made.effect[i].value[j] = value
    bank, envelope = c.ffi.addressof(made.plays), controller.envelope
    knots = (c.pointer(torque), c.pointer(angle), torque.size)
    try:
        c.call(c.lib.lm_build_curve, c.ffi.addressof(made.curve), *knots)
        counts = (len(controller.plays), len(controller.outside))
        c.call(c.lib.lm_build_play_bank, bank, plays, *counts)
        c.call(c.lib.lm_set_envelope, bank, envelope.most_Nm, envelope.knee_Nm)
        c.call(c.lib.lm_check_parameters, made)
    except LibraryError as error:
        raise refused(error) from None


def store(made: Any, c: Core | None = None) -> bytes:
    """Binary form of built parameters, which `lm_load_parameters` reads."""
    c = c or core(32)
    capacity = int(c.lib.LM_BLOB_BYTES_MAX)
    bytes_of = c.ffi.new("uint8_t[]", capacity)
    length = c.ffi.new("size_t *")
    c.call(c.lib.lm_store_parameters, made, bytes_of, capacity, length)
    return bytes(c.ffi.buffer(bytes_of, length[0]))


def refused(error: LibraryError) -> InputError:
    """Report a refusal of the library in terms of the command."""
    if error.key == "outside_rad_per_Nm":
        return InputError(
            "friction",
            "",
            f"operators that add up to {error.found:.3g} rad/Nm",
            "less than the least compliance of the torsion curve: the loop is too wide",
        )
    expected = f"{error.low:.6g} to {error.high:.6g}" if error.low != error.high else "a value"
    return InputError(
        "parameters", error.key, f"{error.found:.6g}", f"{expected} ({error.sentence})"
    )


def format_blob(controller: Controller) -> bytes:
    """Binary form, which `lm_load_parameters` reads."""
    return store(build(controller))
