"""A user effect as a formula: evaluated here, and written as C for the controller.

A formula is an expression in Python's notation of the effect's values, the conditions, numbers and
`FUNCTIONS`. It is parsed to a tree of only these elements, so that the evaluation over a recording
and that on the controller are identical.
"""

from __future__ import annotations

import ast
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.core import FILLED_IN, NEEDS, Kind, core
from lostmotion.effects.effect import RECORDED_ONLY, Effect, Value, effect
from lostmotion.errors import InputError, did_you_mean
from lostmotion.keys import as_in_file
from lostmotion.units import split_unit

EXPONENT_MAX = float(core().lib.LM_EXPONENT_MAX)
LOGARITHM_MIN = float(core().lib.LM_LOGARITHM_MIN)
"""Limits of the library's exponential and logarithm (elementary.h)."""

MULTIPLIED_OUT = 6
"""Integer exponents up to this are written as products."""


def _power(x: FloatArray, exponent: FloatArray) -> FloatArray:
    """As `lm_power`: the result is 0 for an x of 0 or less."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.asarray(x) > 0, np.maximum(x, LOGARITHM_MIN) ** exponent, 0.0)


FUNCTIONS: dict[str, tuple[int, Callable[..., Any], str]] = {
    "sin": (1, np.sin, "lm_sine"),
    "cos": (1, np.cos, "lm_cosine"),
    "exp": (
        1,
        lambda x: np.exp(np.clip(x, -EXPONENT_MAX, EXPONENT_MAX)),
        "lm_exponential",
    ),
    "log": (1, lambda x: np.log(np.maximum(x, LOGARITHM_MIN)), "lm_logarithm"),
    "tanh": (1, np.tanh, "lm_hyperbolic_tangent"),
    "sqrt": (1, lambda x: _power(x, np.asarray(0.5)), "square_root"),
    "power": (2, _power, "lm_power"),
    "abs": (1, np.abs, "absolute"),
    "sign": (1, np.sign, "sign"),
    "sat": (1, lambda x: np.clip(x, -1.0, 1.0), "saturated"),
    "min": (2, np.minimum, "smaller"),
    "max": (2, np.maximum, "larger"),
}
"""Functions of a formula: number of arguments, implementation, name in C."""

HELPERS = {
    "absolute": ("lm_real x", "return x < 0 ? -x : x;"),
    "sign": ("lm_real x", "return x > 0 ? LM_REAL(1) : x < 0 ? LM_REAL(-1) : LM_REAL(0);"),
    "saturated": ("lm_real x", "return !(x > -1) ? LM_REAL(-1) : x < 1 ? x : LM_REAL(1);"),
    "smaller": ("lm_real x, lm_real y", "return x < y ? x : y;"),
    "larger": ("lm_real x, lm_real y", "return x > y ? x : y;"),
    "square_root": ("lm_real x", "return lm_power(x, LM_REAL(0.5));"),
}
"""C code of functions that the library does not have."""

TURNS = {"input_turns": "input_angle_rad", "output_turns": "output_angle_rad"}
"""Angles in turns, for formulas with a period."""

WORDS = {*NEEDS, *FILLED_IN, *RECORDED_ONLY, *TURNS, "pi"}
"""Names in a formula that are not its values."""

OPERATORS: dict[type[ast.operator], tuple[str, Callable[[Any, Any], Any]]] = {
    ast.Add: ("+", np.add),
    ast.Sub: ("-", np.subtract),
    ast.Mult: ("*", np.multiply),
    ast.Div: ("/", np.divide),
}


@dataclass(frozen=True)
class ParsedFormula:
    """A formula as the function of an effect."""

    tree: ast.expr

    def __call__(self, p: SimpleNamespace, at: SimpleNamespace) -> FloatArray:
        """Evaluate by the values of an effect and the conditions of a recording."""
        words = {**vars(at), **vars(p), "pi": np.pi}
        for turns, angle in TURNS.items():
            words[turns] = vars(at)[angle] / (2 * np.pi)
        return np.asarray(_evaluate(self.tree, words))


def formula(
    name: str,
    text: str,
    *,
    values: Sequence[Value],
    kind: Kind = "angle",
    mechanism: str = "",
    typical_size: str = "",
    confused_with: Sequence[str] = (),
    experiment: str = "",
) -> Effect:
    """Make an effect from a formula, which can also run on the controller.

    Parameters
    ----------
    name : str
        A name in C.
    text : str
        The result, of the effect's kind, by the names of the values, of the conditions
        (``torque_Nm``, ``output_angle_rad`` ..., also ``input_turns`` and ``output_turns``), of
        ``pi`` and of `FUNCTIONS`.
    values : sequence of Value
    kind : {"torque", "compliance", "width", "angle"}

    Raises
    ------
    InputError
        If the formula contains anything else.
    """
    if not name.isidentifier():
        raise InputError("effect", name, "a name with other characters", "a name in C")
    known = [value.name for value in values]
    tree = _read(name, text)
    used = _names(name, tree, known)
    unused = [value for value in known if value not in used]
    if unused:
        raise InputError(
            f"effect {name}", unused[0], "a value that the formula does not have", text
        )
    needs = {TURNS.get(word, "torque_Nm" if word in FILLED_IN else word) for word in used}
    needs -= set(RECORDED_ONLY)

    made = effect(
        values=values,
        needs=[need for need in NEEDS if need in needs],
        kind=kind,
        name=name,
        mechanism=mechanism,
        equation=text,
        typical_size=typical_size,
        confused_with=confused_with,
        experiment=experiment,
    )(ParsedFormula(tree))
    return replace(made, formula=text, memory=0)


def written_formula(text: str, name: str) -> Effect:
    """Make an effect from a formula alone, as given after ``--add`` or in a drive file.

    Every name that is not a condition is a linear value; the result is lost motion in rad.

    Raises
    ------
    InputError
        If the formula has other elements, or is not proportional to its values.
    """
    tree = _read(name, text)
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    named = [n for n in ast.walk(tree) if isinstance(n, ast.Name) and id(n) not in called]
    named.sort(key=lambda node: (node.lineno, node.col_offset))
    names = list(dict.fromkeys(node.id for node in named if node.id not in WORDS))
    where = f"effect {name}"
    if not names:
        raise InputError(
            where, "formula", as_in_file(text), "the name of a value, such as size_rad"
        )
    made = formula(
        name, text, values=[_linear(value) for value in names], mechanism="a formula of one's own"
    )
    at = {need: np.linspace(0.1, 1.3, TRIED) for need in (*NEEDS, *FILLED_IN, *RECORDED_ONLY)}
    once, memory = np.full(len(names), 0.5), np.zeros(1)
    twice = made.function(2.0 * once, at, memory)
    if not np.allclose(twice, 2.0 * made.function(once, at, memory), rtol=1e-9, atol=0.0):
        found = f"not proportional to {', '.join(names)}"
        raise InputError(
            where,
            "formula",
            found,
            "numbers for all values to which the formula is not proportional",
        )
    return replace(made, in_file=True)


def _linear(name: str) -> Value:
    """A value of a written formula, by its unit: an angle, or a number that multiplies one."""
    unit = split_unit(name)[1]
    angle = unit is not None and unit.symbol.startswith("rad")
    typical, most = (
        (WRITTEN_RAD, WRITTEN_RAD_MOST) if angle else (WRITTEN_SHARE, WRITTEN_SHARE_MOST)
    )
    return Value(name, "linear", typical, -most, most)


WRITTEN_RAD, WRITTEN_RAD_MOST = 5e-6, 0.05
"""Typical angle of a written formula, an arc second, and its bound: 3 degrees exceed any lost
motion.
"""

WRITTEN_SHARE, WRITTEN_SHARE_MOST = 0.01, 100.0
"""Typical size of a value that is not an angle, and its bound."""


def _read(name: str, text: str) -> ast.expr:
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError):
        raise InputError(f"effect {name}", "formula", as_in_file(text), "an expression") from None


def _names(name: str, tree: ast.expr, values: Sequence[str]) -> set[str]:
    """Names in the formula except functions and pi; refuses invalid formulas."""
    allowed = {*values, *WORDS}
    found: set[str] = set()
    where = f"effect {name}"

    def walk(node: ast.expr) -> None:
        if isinstance(node, ast.BinOp) and (type(node.op) in OPERATORS or _is_power(node)):
            walk(node.left)
            walk(node.right)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
            walk(node.operand)
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            return
        elif isinstance(node, ast.Name):
            if node.id not in allowed:
                expected = "a value, a condition or pi" + did_you_mean(node.id, allowed)
                raise InputError(where, "formula", as_in_file(node.id), expected)
            found.add(node.id)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            if node.func.id not in FUNCTIONS:
                expected = "one of " + ", ".join(FUNCTIONS) + did_you_mean(node.func.id, FUNCTIONS)
                raise InputError(where, "formula", f"{node.func.id}()", expected)
            count = FUNCTIONS[node.func.id][0]
            if len(node.args) != count or node.keywords:
                raise InputError(
                    where, "formula", ast.unparse(node), f"{node.func.id}() of {count}"
                )
            for argument in node.args:
                walk(argument)
        else:
            expected = "numbers, names, + - * / ** and functions"
            raise InputError(where, "formula", as_in_file(ast.unparse(node)), expected)

    walk(tree)
    return found - {"pi"}


def _is_power(node: ast.BinOp) -> bool:
    return isinstance(node.op, ast.Pow)


def _whole(node: ast.expr) -> int | None:
    """A small integer exponent, which is written as a product; None for others."""
    value = node.value if isinstance(node, ast.Constant) else None
    return value if isinstance(value, int) and 1 <= value <= MULTIPLIED_OUT else None


def _evaluate(node: ast.expr, words: Mapping[str, Any]) -> Any:
    if isinstance(node, ast.Constant):
        return float(node.value)  # type: ignore[arg-type]
    if isinstance(node, ast.Name):
        return words[node.id]
    if isinstance(node, ast.UnaryOp):
        inner = _evaluate(node.operand, words)
        return -inner if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.BinOp):
        left, right = _evaluate(node.left, words), _evaluate(node.right, words)
        if not _is_power(node):
            return OPERATORS[type(node.op)][1](left, right)
        times = _whole(node.right)
        if times is None:
            return _power(left, right)
        product = left
        for _ in range(times - 1):
            product = product * left
        return product
    assert isinstance(node, ast.Call)
    assert isinstance(node.func, ast.Name)
    return FUNCTIONS[node.func.id][1](*(_evaluate(a, words) for a in node.args))


def _in_c(node: ast.expr, values: Sequence[str], used: set[str]) -> str:
    """C of a tree; `used` gathers the functions it calls."""
    if isinstance(node, ast.Constant):
        return f"LM_REAL({float(node.value)!r})"  # type: ignore[arg-type]
    if isinstance(node, ast.Name):
        if node.id == "pi":
            return "LM_PI"
        if node.id in values:
            return f"value[{node.id.upper()}]"
        if node.id in TURNS:
            return f"(at->{TURNS[node.id]} / (2 * LM_PI))"
        return f"at->{node.id}"
    if isinstance(node, ast.UnaryOp):
        inner = _in_c(node.operand, values, used)
        return f"(-{inner})" if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.BinOp):
        left = _in_c(node.left, values, used)
        if not _is_power(node):
            right = _in_c(node.right, values, used)
            return f"({left} {OPERATORS[type(node.op)][0]} {right})"
        times = _whole(node.right)
        if times is not None:
            return f"({' * '.join([left] * times)})"
        used.add("lm_power")
        return f"lm_power({left}, {_in_c(node.right, values, used)})"
    assert isinstance(node, ast.Call)
    assert isinstance(node.func, ast.Name)
    function = FUNCTIONS[node.func.id][2]
    used.add(function)
    return f"{function}({', '.join(_in_c(a, values, used) for a in node.args)})"


def symbol_of(own: Effect) -> str:
    """Name of the constant `lm_effect` in C."""
    return own.symbol or f"lm_effect_{own.name}"


def require_of_controller(own: Effect) -> None:
    """Refuse a formula of quantities unknown to a controller: runs, or turns of the input."""
    tree = _read(own.name, own.formula)
    words = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    for word in RECORDED_ONLY:
        if word in words:
            expected = "a formula of conditions: this one is not available on the controller"
            raise InputError(f"effect {own.name}", "formula", word, expected)
    if "input_angle_rad" not in own.needs:
        return
    at = {need: np.linspace(-1.0, 1.0, TRIED) for need in (*NEEDS, *FILLED_IN)}
    here, memory = own.function(own.typical, at, np.zeros(1)), np.zeros(1)
    turned = {**at, "input_angle_rad": at["input_angle_rad"] + 2 * np.pi}
    if not np.allclose(own.function(own.typical, turned, memory), here, rtol=1e-6, atol=1e-12):
        found = "not the same after a turn of the input"
        expected = "a period of one turn: the controller knows that angle only within one turn"
        raise InputError(f"effect {own.name}", "formula", found, expected)


TRIED = 41
"""Samples at which a formula is tried."""


def write_c(own: Effect) -> str:
    """C source of an effect with a formula, for desktop and controller.

    Raises
    ------
    InputError
        If it has none: a Python function cannot run on the controller.
    """
    if not own.formula:
        expected = "one made by formula(...), or in C: the controller cannot run a Python function"
        raise InputError("effect", own.name, "a Python function", expected)
    names = [value.name for value in own.values]
    require_of_controller(own)
    used: set[str] = set()
    result = _in_c(_read(own.name, own.formula), names, used)
    if result.startswith("(") and result.endswith(")") and _pairs(result):
        result = result[1:-1]
    helpers = "".join(
        f"static lm_real {name}({arguments}) {{\n  {body}\n}}\n\n"
        for name, (arguments, body) in HELPERS.items()
        if name in used
    )
    needs = " | ".join(f"LM_NEEDS_{_bit(need)}" for need in NEEDS if need in own.needs) or "0u"
    card = ",\n    ".join(
        _quoted(text)
        for text in (
            own.name,
            own.mechanism or own.name,
            own.formula,
            own.typical_size or "not stated",
            ", ".join(own.confused_with),
            own.experiment or "not stated",
        )
    )
    values = ",\n     ".join(map(_value_in_c, own.values))
    absorbed = _quoted(own.absorbed) if own.absorbed else "0"
    told_by = f"LM_NEEDS_{_bit(own.told_by)}" if own.told_by else "0u"
    bounds = ",\n     ".join(f"{{LM_REAL({v.low!r}), LM_REAL({v.high!r})}}" for v in own.values)
    symbol = symbol_of(own)
    comment = own.formula.replace("*/", "* /")
    return f"""/* {own.name}, a user's own effect, written by lostmotion from its formula:
 *
 *     {comment}
 *
 * The same file goes to the controller and, as a shared object, to --effects: of LM_REAL_BITS=64,
 * for replay of 32; where it calls sines and the like, together with lib/runtime/elementary.c.
 */
#include "lostmotion/effects.h"

enum {{ {", ".join([*(name.upper() for name in names), "VALUES"])} }};

{helpers}static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {{
  (void)memory;
  (void)at;
  return {result};
}}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {{
    {card},
    {{{values}}},
    {absorbed},
    {told_by},
    {int(own.steps)}}};
#endif

LM_BEGIN_DECLS
extern const lm_effect {symbol};
LM_END_DECLS
const lm_effect {symbol} = {{
    {zlib.crc32(own.name.encode()):#010x}u, /* CRC-32 of the name */
    LM_EFFECT_{own.kind.upper()},
    VALUES,
    0,
    {needs},
    run,
    {{{bounds}}},
    LM_EFFECT_CARD(card)}};
"""


def _value_in_c(value: Value) -> str:
    """Initializer of a value on the card."""
    starts = ", ".join([f"LM_REAL({start!r})" for start in value.starts] or ["0"])
    bits = {
        "LM_VALUE_BETWEEN_RUNS": value.between_runs,
        "LM_VALUE_SIGN_OF_RATIO": value.sign == "ratio",
        "LM_VALUE_SIGN_OF_FIRST": value.sign == "first",
        "LM_VALUE_SCALES": value.scales,
    }
    return (
        f"{{{_quoted(value.name)}, LM_VALUE_{value.role.upper()}, LM_REAL({value.typical!r}), "
        f"LM_SCALE_{(value.scale or 'none').upper()}, {{{starts}}}, "
        f"{' | '.join(bit for bit, set_ in bits.items() if set_) or '0u'}, "
        f"{_quoted(value.words) if value.words else '0'}}}"
    )


def _pairs(text: str) -> bool:
    """Whether the first bracket closes at the last character."""
    depth = 0
    for i, sign in enumerate(text):
        depth += (sign == "(") - (sign == ")")
        if depth == 0:
            return i == len(text) - 1
    return False


def _bit(need: str) -> str:
    """The LM_NEEDS_ bit of a condition."""
    return "TIME" if need == "elapsed_s" else split_unit(need)[0].upper()


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ") + '"'
