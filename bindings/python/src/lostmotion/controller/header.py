"""Parameters as a C header: a constant in flash."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from lostmotion import __version__
from lostmotion.controller.effects import known_effects
from lostmotion.controller.from_drive import Controller, Limits, Validity, Watch
from lostmotion.controller.parameters import build
from lostmotion.core import NEEDS, core
from lostmotion.errors import InputError
from lostmotion.units import ARCMIN


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
    made = build(controller)
    guard, limits = f"{name.upper()}_H", controller.limits
    title = title.replace("*/", "* /")
    needs, size = _least_build(controller)
    return "\n".join(
        [
            f"/* {title}: parameters for its controller, written by lostmotion export "
            f"{__version__}.",
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
            "/* Time between two calls of lm_step_compensator: compare it with that of your loop, "
            "*/",
            f"/* #if {name.upper()}_PERIOD_NS != 1000000000 / LOOP_HZ, say. */",
            f"#define {name.upper()}_PERIOD_NS {round(limits.period_s * 1e9)}",
            f"#define {name.upper()}_PERIOD_S {literal(limits.period_s)}",
            f"#if {needs}",
            f'#error "lostmotion: these parameters need {size}"',
            "#endif",
            "",
            *_declarations(controller),
            *_constant(controller, made, name),
            "",
            "#endif",
            "",
        ]
    )


def _least_build(controller: Controller) -> tuple[str, str]:
    """Condition of the preprocessor for a build that lacks room, and what is required in words."""
    if controller.torque_Nm.size == 0:
        return "LM_PROFILE != LM_PROFILE_GAP", "-DLM_PROFILE=LM_PROFILE_GAP"
    known = known_effects(core(32), controller.own)
    least = {
        "LM_CURVE_POINTS_MAX": max(16, controller.torque_Nm.size),
        "LM_PLAYS_MAX": max(1, len(controller.plays)),
        "LM_EFFECTS_MAX": len(controller.effects),
        "LM_EFFECT_MEMORY_MAX": sum(
            int(known[name].memory_count) for name, _ in controller.effects
        ),
        "LM_ENVELOPE": int(controller.envelope.most_Nm > 0),
    }
    needs = " || \\\n    ".join(f"{macro} < {value}" for macro, value in least.items())
    size = ", ".join(f"{macro} {value}" for macro, value in least.items())
    return f"LM_PROFILE == LM_PROFILE_GAP || {needs}", f"no gap profile and at least {size}"


def _constant(controller: Controller, made: Any, name: str) -> list[str]:
    """Definition of the constant."""
    gap = controller.torque_Nm.size == 0
    return [
        f"static const lm_parameters {name} = {{",
        "    LM_PARAMETERS_LAYOUT,",
        f"    0x{made.fingerprint:08x}u,",
        f"    {literal(controller.torque_limit_Nm)}, /* torque_limit_Nm */",
        struct_initializer(controller.limits) + ",",
        struct_initializer(controller.watch) + ",",
        struct_initializer(controller.valid) + ",",
        *_plays_text(made.plays, gap),
        *([] if gap else _curve_text(made.curve)),
        *([] if gap else _effects_text(controller)),
        "};",
    ]


def struct_initializer(part: Limits | Watch | Validity) -> str:
    """Initializer of a struct of numbers and pairs of them, below the names of its fields."""
    texts = []
    names = ", ".join(entry.name for entry in fields(part))
    for entry in fields(part):
        value = getattr(part, entry.name)
        pair = isinstance(value, tuple)
        texts.append(f"{{{', '.join(map(literal, value))}}}" if pair else literal(value))
    return f"    /* {names} */\n    {{{', '.join(texts)}}}"


def _plays_text(bank: Any, gap: bool) -> list[str]:
    sums = f"{literal(bank.outside_rad_per_Nm)}, {literal(bank.inside_share)}"
    counts = f"{bank.count}, {bank.outside_count}, {bank.widens}, {sums}"
    text = [f"    {{{counts}, {literal(bank.envelope_Nm)}, {literal(bank.knee_Nm)},", "     {"]
    for i in range(bank.count):
        slot = bank.slot[i]
        edges = ", ".join(map(literal, slot.edge_slope))
        words = f"{literal(slot.radius_Nm)}, {{{edges}}}, {literal(slot.weight)}"
        text.append(f"         {',' if i else ''}{{{words}}}")
    for i in range(bank.count, 0 if gap else 32):
        text.append(f"#if LM_PLAYS_MAX > {i}")
        text.append(f"         {',' if i else ''}{{0, {{1, 1}}, 0}}")
        text.append("#endif")
    return [*text, "     }}" + ("" if gap else ",")]


def _curve_text(curve: Any) -> list[str]:
    """The three arrays; they have 17, 33 or 65 entries and repeat the last knot at the end."""
    text = [f"    {{{curve.count},"]
    names = ("torque_Nm", "angle_rad", "slope_rad_per_Nm")
    for name in names:
        values = [literal(value) for value in getattr(curve, name)]
        least = next(size for size in (17, 33, 65) if size >= curve.count)
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
