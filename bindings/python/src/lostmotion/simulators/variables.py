"""Variables of an FMU: inputs, outputs and tunable parameters, with units and ranges.

The order is that of ``c/fmu.h``: an input for each condition, the outputs, then the parameters as
`fmu_build` reads them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Literal

from lostmotion.condition_cards import CARDS, NEUTRAL
from lostmotion.core import NEEDS, core, value_ranges
from lostmotion.effects.conditions import MEASURED
from lostmotion.export import Controller, Envelope, Limits, Validity, Watch, known_effects
from lostmotion.recordings import QUANTITIES

Kind = Literal["torque", "angles", "compensator"]

KINDS: dict[Kind, str] = {
    "torque": "torque and input angle in, output angle out",
    "angles": "input and output angle in, torque out: the inverse",
    "compensator": "the controller's compensator, float32",
}
"""Kinds of FMU; the values are their descriptions."""

Access = Literal["none", "input", "output", "independent", "tunable", "fixed"]

UNITS: dict[str, dict[str, float]] = {
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "rad/s3": {"rad": 1, "s": -3},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "N.m/rad": {"kg": 1, "m": 2, "s": -2, "rad": -1},
    "rad/(N.m)": {"kg": -1, "m": -2, "s": 2, "rad": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "degC": {"K": 1, "offset": 273.15},
    "s": {"s": 1},
    "Hz": {"s": -1},
    "1/s": {"s": -1},
}
"""Exponents of the SI units, as FMI states a unit."""

SUFFIXES = {
    "rad": "rad",
    "rad_s": "rad/s",
    "rad_s2": "rad/s2",
    "rad_s3": "rad/s3",
    "s": "s",
    "Hz": "Hz",
    "per_s": "1/s",
    "Nm": "N.m",
    "N": "N",
    "C": "degC",
}
"""Unit by the suffix of a field's name."""


@dataclass(frozen=True)
class Variable:
    """One variable of an FMU; its value reference is its place in the list.

    Attributes
    ----------
    name : str
        Structured name of FMI: ``torsion_curve.torque[3]``.
    access : str
    start : float
    unit : str
        A key of `UNITS`, or "".
    meaning : str
    low, high : float or None
        Validity range of the model.
    whole : bool
        An integer.
    """

    name: str
    access: Access
    start: float = 0.0
    unit: str = ""
    meaning: str = ""
    low: float | None = None
    high: float | None = None
    whole: bool = False


UNUSED = Variable("", "none")

TIME = Variable("time", "independent", 0.0, "s", "simulation time")
"""The last output; the parameters follow."""


def split_field(name: str) -> tuple[str, str]:
    """Split the name of a field into its stem and the unit of its suffix."""
    for suffix in sorted(SUFFIXES, key=len, reverse=True):
        if name.endswith(f"_{suffix}"):
            return name.removesuffix(f"_{suffix}"), SUFFIXES[suffix]
    return name, ""


def list_variables(controller: Controller, kind: Kind, ratio: float) -> list[Variable]:
    """List every variable in the order of the value references.

    Parameters
    ----------
    controller : Controller
    kind : {"torque", "angles", "compensator"}
    ratio : float
        Of the drive; 1 for a compensator, which needs none.
    """
    inputs = [_input(controller, kind, name) for name in NEEDS]
    return [*inputs, *_outputs(kind), *_parameters(controller, kind, ratio)]


def _input(controller: Controller, kind: Kind, condition: str) -> Variable:
    """Input for a condition; the place of the elapsed time, which FMI passes, is that of a mode."""
    if condition == "elapsed_s":
        mode = Variable("mode", "input", 0, "", "0: run, 1: hold, 2: reset", 0, 2, whole=True)
        return mode if kind == "compensator" else UNUSED
    if condition == {"torque": "output_angle_rad", "angles": "torque_Nm"}.get(kind):
        return UNUSED
    name, unit = split_field(condition)
    meaning, start = CARDS[condition].meaning, NEUTRAL[condition]
    if condition == "torque_Nm":
        limit = controller.torque_limit_Nm
        return Variable(name, "input", start, unit, meaning, -limit, limit)
    low, high = getattr(controller.valid, condition, (0.0, 0.0))
    if low or high:
        meaning += f"; fitted from {low:g} to {high:g}, clipped to that range"
    positive = condition in MEASURED and QUANTITIES[MEASURED[condition]].low == 0.0
    return Variable(name, "input", start, unit, meaning, 0.0 if positive else None)


def _outputs(kind: Kind) -> list[Variable]:
    status = Variable("status", "output", 0, "", "LM_STATE_ bits (lostmotion/state.h)", whole=True)
    lost = Variable(
        "lost_motion", "output", 0.0, "rad", "output angle less input angle over the ratio"
    )
    if kind == "compensator":
        motion = "of the correction, for feed-forward"
        return [
            lost,
            *[UNUSED] * 4,
            status,
            Variable("correction", "output", 0.0, "rad", "to add to the commanded output angle"),
            Variable("correction_velocity", "output", 0.0, "rad/s", motion),
            Variable("correction_acceleration", "output", 0.0, "rad/s2", motion),
            TIME,
        ]
    angle = Variable(
        "output_angle", "output", 0.0, "rad", "input angle over ratio, and lost motion"
    )
    torque = Variable("torque", "output", 0.0, "N.m", "external torque on the output shaft")
    return [
        lost,
        Variable("lost_motion_rate", "output", 0.0, "rad/s", "change over the last step"),
        angle if kind == "torque" else UNUSED,
        torque if kind == "angles" else UNUSED,
        Variable(
            "stiffness",
            "output",
            0.0,
            "N.m/rad",
            "tangent stiffness in the direction in which the torque moved last; at most 1e12",
        ),
        status,
        *[UNUSED] * 3,
        TIME,
    ]


def _fields(
    part: Envelope | Limits | Watch | Validity, group: str, access: Callable[[str], Access]
) -> Iterator[Variable]:
    """One variable per number of a part of the controller."""
    for entry in fields(part):
        stem, unit = split_field(entry.name)
        value = getattr(part, entry.name)
        if isinstance(value, tuple):
            for end, number in zip(("least", "greatest"), value, strict=True):
                yield Variable(f"{group}.{stem}_{end}", access(stem), float(number), unit)
        else:
            yield Variable(f"{group}.{stem}", access(stem), float(value), unit)


def _row(
    name: str, numbers: Sequence[float], unit: str, meaning: str, low: float | None = None
) -> list[Variable]:
    return [
        Variable(f"{name}[{i + 1}]", "tunable", float(number), unit, meaning, low)
        for i, number in enumerate(numbers)
    ]


def _parameters(controller: Controller, kind: Kind, ratio: float) -> list[Variable]:
    control = kind == "compensator"

    def limits(stem: str) -> Access:
        return ("fixed" if stem == "period" else "tunable") if control else "none"

    found = [
        Variable(
            "ratio",
            "none" if control else "tunable",
            ratio,
            "",
            "input turns for one output turn, signed",
        ),
        Variable(
            "torque_limit",
            "tunable",
            controller.torque_limit_Nm,
            "N.m",
            "torque beyond it, either sign, is clipped",
            0.0,
        ),
        *_fields(controller.envelope, "friction.envelope", lambda _: "tunable"),
        *_fields(controller.limits, "limits", limits),
        *_fields(controller.watch, "watch", limits),
        *_fields(controller.valid, "fitted", lambda _: "fixed"),
        *_row("torsion_curve.torque", list(controller.torque_Nm), "N.m", "knot, rising"),
        *_row("torsion_curve.angle", list(controller.angle_rad), "rad", "at the knot, rising"),
    ]
    plays = controller.plays
    weight = "compliance in series with the spring; in parallel, share of the torque"
    found += _row("friction.radius", [p.radius_Nm for p in plays], "N.m", "half width", 0.0)
    found += _row("friction.widening", [p.widening for p in plays], "", "half width over |T|", 0.0)
    found += _row("friction.weight", [p.weight for p in plays], "", weight, 0.0)
    return found + _effects(controller)


def _effects(controller: Controller) -> list[Variable]:
    c = core(64)
    known = known_effects(c, controller.own)
    found = []
    for name, values in controller.effects:
        own = controller.own.get(name)
        ranges = own.ranges() if own is not None else value_ranges(c, known[name])
        for (key, low, high), value in zip(ranges, values, strict=True):
            meaning = f"of the effect {name}"
            variable = f"effect.{name}.{key}"
            found.append(Variable(variable, "tunable", float(value), "", meaning, low, high))
    return found
