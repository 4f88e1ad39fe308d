"""Parameters as a C header: a constant in flash."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from lostmotion import __version__
from lostmotion.core import NEEDS, core
from lostmotion.errors import InputError
from lostmotion.units import ARCMIN

if TYPE_CHECKING:
    pass
from lostmotion.controller.effects import known_effects
from lostmotion.controller.from_drive import Controller, Limits, Validity, Watch
from lostmotion.controller.parameters import build


def literal(value: float | np.float32) -> str:
    """Write a number as a C literal that gives the same float."""
    return f"{np.float32(value)!s}f"


def rows(texts: Sequence[str], indent: str, width: int = 100) -> str:
    """Join texts with commas into lines of at most `width`."""
    lines, line = [], indent
    for i, text in enumerate(texts):
        word = text + ("," if i + 1 < len(texts) else "")
        if len(line) + len(word) + 1 > width:
            lines.append(line.rstrip())
            line = indent
        line += word + " "
    lines.append(line.rstrip())
    return "\n".join(lines)


def needed_conditions(controller: Controller) -> list[str]:
    """List the fields of `lm_conditions` that the host must set."""
    if controller.torque_Nm.size == 0:
        return ["output_angle_rad"]
    known = known_effects(core(32), controller.own)
    bits = 1
    for effect, _ in controller.effects:
        bits |= int(known[effect].covariates)
    return [field for bit, field in enumerate(NEEDS) if bits >> bit & 1]


def format_header(controller: Controller, name: str, title: str) -> str:
    """C header with one constant `lm_parameters`, for all profiles of sufficient size.

    Parameters
    ----------
    controller : Controller
    name : str
        Of the constant.
    title : str
        Purpose, for the first line of the header.

    Raises
    ------
    InputError
        If the name is not a C identifier, or the library refuses the parameters.
    """
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
        raise InputError("--name", "", f"'{name}'", "a name in C")
    gap = controller.torque_Nm.size == 0
    plays = controller.plays
    fingerprint = build(controller).fingerprint
    if gap:
        needs, size = "LM_PROFILE != LM_PROFILE_GAP", "-DLM_PROFILE=LM_PROFILE_GAP"
    else:
        known = known_effects(core(32), controller.own)
        least = {
            "LM_CURVE_POINTS_MAX": max(16, controller.torque_Nm.size),
            "LM_PLAYS_MAX": max(1, len(plays)),
            "LM_EFFECTS_MAX": len(controller.effects),
            "LM_EFFECT_MEMORY_MAX": sum(
                int(known[effect].memory_count) for effect, _ in controller.effects
            ),
            "LM_ENVELOPE": int(controller.envelope.most_Nm > 0),
        }
        needs = "LM_PROFILE == LM_PROFILE_GAP || " + " || \\\n    ".join(
            f"{macro} < {value}" for macro, value in least.items()
        )
        size = "no gap profile and at least " + ", ".join(
            f"{macro} {value}" for macro, value in least.items()
        )
    guard = f"{name.upper()}_H"
    limits, watch = controller.limits, controller.watch
    title = title.replace("*/", "* /")
    text = [
        f"/* {title}: parameters for its controller, written by lostmotion export {__version__}.",
        f" * Corrects up to {limits.correction_rad / ARCMIN:.3g} arcmin; for one call every "
        f"{limits.period_s * 1e3:.4g} ms.",
        f" * Every tick needs {', '.join(needed_conditions(controller))}. */",
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        "/* clang-format off */",
        "#ifndef LOSTMOTION_RUNTIME_H",
        '#include "lostmotion/runtime.h"',
        "#endif",
        "",
        f"#if LM_PARAMETERS_FORMAT != {core().lib.LM_PARAMETERS_FORMAT}",
        '#error "lostmotion: these parameters were written for another version: export again"',
        "#endif",
        "/* Time between two calls of lm_step_compensator: compare it with that of your loop, */",
        f"/* #if {name.upper()}_PERIOD_NS != 1000000000 / LOOP_HZ, say. */",
        f"#define {name.upper()}_PERIOD_NS {round(limits.period_s * 1e9)}",
        f"#define {name.upper()}_PERIOD_S {literal(limits.period_s)}",
        f"#if {needs}",
        f'#error "lostmotion: these parameters need {size}"',
        "#endif",
        "",
        *_declarations(controller),
        f"static const lm_parameters {name} = {{",
        "    LM_PARAMETERS_LAYOUT,",
        f"    0x{fingerprint:08x}u,",
        f"    {literal(controller.torque_limit_Nm)},",
        struct_initializer(limits) + ",",
        struct_initializer(watch) + ",",
        struct_initializer(controller.valid) + ",",
    ]
    text += _plays_text(controller, gap)
    if not gap:
        text += _curve_text(controller)
        text += _effects_text(controller)
    text += ["};", "", "#endif", ""]
    return "\n".join(text)


def struct_initializer(part: Limits | Watch | Validity) -> str:
    """Initializer of a struct of numbers and pairs of them."""
    texts = []
    for entry in fields(part):
        value = getattr(part, entry.name)
        pair = isinstance(value, tuple)
        texts.append(f"{{{', '.join(map(literal, value))}}}" if pair else literal(value))
    return "    {" + ", ".join(texts) + "}"


def _plays_text(controller: Controller, gap: bool) -> list[str]:
    plays = controller.plays
    # Sums in the library's order and precision.
    outside = inside = np.float32(0)
    for play in plays[: len(controller.outside)]:
        outside = np.float32(outside + np.float32(play.weight))
    for play in plays[len(controller.outside) :]:
        inside = np.float32(inside + np.float32(play.weight))
    widens = int(any(np.float32(1) + np.float32(play.widening) != 1 for play in plays))
    sums = f"{literal(outside)}, {literal(inside)}"
    counts = f"{len(plays)}, {len(controller.outside)}, {widens}, {sums}"
    envelope = f"{literal(controller.envelope.most_Nm)}, {literal(controller.envelope.knee_Nm)}"
    text = [f"    {{{counts}, {envelope},", "     {"]
    one = np.float32(1)
    for i, play in enumerate(plays):
        low, high = one - np.float32(play.widening), one + np.float32(play.widening)
        slot = f"{{{literal(play.radius_Nm)}, {{{literal(low)}, {literal(high)}}}, "
        text.append(f"         {',' if i else ''}{slot}{literal(play.weight)}}}")
    if not gap:
        for i in range(len(plays), 32):
            text.append(f"#if LM_PLAYS_MAX > {i}")
            text.append(f"         {',' if i else ''}{{0, {{1, 1}}, 0}}")
            text.append("#endif")
    return [*text, "     }}" + ("" if gap else ",")]


def _curve_text(controller: Controller) -> list[str]:
    """The three arrays; they have 17, 33 or 65 entries and repeat the last knot at the end."""
    c = core(32)
    made = build(controller, c)
    curve = made.curve  # memory owned by `made`
    count = controller.torque_Nm.size
    text = [f"    {{{count},"]
    names = ("torque_Nm", "angle_rad", "slope_rad_per_Nm")
    for name in names:
        values = [literal(getattr(curve, name)[i]) for i in range(c.lib.LM_CURVE_STORE)]
        least = next(size for size in (17, 33, 65) if size >= count)
        text += ["     {", rows(values[:least], "         ")]
        for low, high in ((17, 33), (33, 65)):
            if least <= low:
                text += [f"#if LM_CURVE_STORE > {low}", "         ,"]
                text += [rows(values[low:high], "         "), "#endif"]
        text.append("     }" + ("," if name != names[-1] else "}"))
    return text


def _symbol(controller: Controller, name: str) -> str:
    """Name in C of an active effect."""
    own = controller.own.get(name)
    return own.symbol if own is not None and own.symbol else f"lm_effect_{name}"


def _declarations(controller: Controller) -> list[str]:
    """Declarations of the user's own effects, which are defined in the user's files."""
    if not controller.own:
        return []
    lines = [f"extern const lm_effect {_symbol(controller, name)};" for name in controller.own]
    return ["LM_BEGIN_DECLS", *lines, "LM_END_DECLS", ""]


def _effects_text(controller: Controller) -> list[str]:
    text = ["#if LM_EFFECTS_MAX > 0", f"    , {len(controller.effects)}", "    , {"]
    for i, (name, values) in enumerate(controller.effects):
        numbers = ", ".join(literal(value) for value in values)
        text.append(f"         {',' if i else ''}{{&{_symbol(controller, name)}, {{{numbers}}}}}")
    if not controller.effects:
        text.append("         {0, {0}}")
    return [*text, "     }", "#endif"]
