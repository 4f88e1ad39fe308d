"""An effect: name, required conditions and function.

All effects have the same interface: a list of values, and a function of the values and the
conditions of a recording. Effects of the library are in `library`; user effects are Python
functions (`effect`), formulas (`formula`) or shared objects (`loading`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, Literal, get_args

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.condition_cards import NEUTRAL
from lostmotion.core import NEEDS, Kind, core
from lostmotion.effects.conditions import Conditions
from lostmotion.errors import InputError, did_you_mean

Role = Literal["linear", "shape", "given", "fixed"]
Scale = Literal[
    "",
    "rated_torque",
    "largest_torque",
    "largest_speed",
    "speeds",
    "times",
    "sample_time",
    "greatest",
    "ratio",
    "tooth_angle",
    "rated_windup",
]
Sign = Literal["", "ratio", "first"]

ROLES: tuple[Role, ...] = get_args(Role)
"""In the order of `lm_value_role`."""

SCALES: tuple[Scale, ...] = get_args(Scale)
"""In the order of `lm_value_scale`."""

RECORDED_ONLY = ("time_s", "run_number")
"""Conditions of a recording that no controller knows: the time of a sample, the number of a run."""

STARTS_MAX = int(core(64).lib.LM_STARTS_MAX)
"""Largest number of start values of one value."""


@dataclass(frozen=True)
class Value:
    """A value of an effect.

    Attributes
    ----------
    name : str
        With its unit as a suffix.
    role : {"linear", "shape", "given", "fixed"}
        The result is proportional to it; it enters nonlinearly; it is a known property of the
        drive; or it is a limit that selects a branch and is not estimated.
    typical, low, high : float
        Typical value and bounds.
    scale : str
        Scale of the start values: none, ``"rated_torque"`` of the drive or its mean wind-up at that
        torque ``"rated_windup"``, ``"largest_torque"`` or ``"largest_speed"`` of the recordings, or
        the upper bound ``"greatest"``. ``"speeds"`` and ``"times"``: spread over the recorded ones,
        which are also the bounds. ``"sample_time"``: values below the time between two samples have
        no effect. For a given value, its source: ``"ratio"``, ``"rated_torque"`` or
        ``"tooth_angle"``.
    starts : tuple of float
        Start values of a fit, divided by the scale. None: a value in N m starts at 0.02, 0.1 and
        0.5 of the rated torque, any other at a quarter of the typical value, at that value, and at
        four times it.
    sign : {"", "ratio", "first"}
        Sign of the drive's ratio, or of the first value (the other sign is a different effect).
    between_runs : bool
        Whether it describes a dependence on quantities that are constant within a run.
    scales : bool
        Whether it scales the effect together with the linear values.
    words : str
        Description if the name is not sufficient.
    """

    name: str
    role: Role
    typical: float
    low: float
    high: float
    scale: Scale = ""
    starts: tuple[float, ...] = ()
    sign: Sign = ""
    between_runs: bool = False
    scales: bool = False
    words: str = ""


@dataclass(frozen=True)
class Effect:
    """An effect: name, required conditions and function.

    Attributes
    ----------
    name : str
    kind : {"torque", "compliance", "width", "angle"}
        What the function returns: N m to add to the torque, a relative change of the compliance, a
        factor on the width of the friction, or rad to add to the lost motion.
    values : tuple of Value
    needs : frozenset of str
        Conditions without which it cannot be tested.
    function : callable
        ``function(values, run)`` with `run` a mapping from conditions to arrays of one recording
        (elastic_rad and wound_Nm among them) and ``memory`` an array that carries state from run to
        run.
    memory : int
        Numbers of memory.
    formula : str
        Text of the function if it is a formula, which can be written as C.
    symbol : str
        Name of the C constant of an effect from a shared object.
    controller : cdata or None
        The ``lm_effect`` itself, of a shared object in the controller's precision.
    absorbed : str
        Part of the baseline model that absorbs it, if any ...
    told_by : str
        ... and the condition whose variation separates the two.
    steps : bool
        The angle changes in steps of its given value.
    in_file : bool
        A drive file with the effect also contains its formula.
    """

    name: str
    kind: Kind
    values: tuple[Value, ...]
    needs: frozenset[str]
    function: Callable[[FloatArray, Mapping[str, FloatArray], FloatArray], FloatArray]
    memory: int = 0
    mechanism: str = ""
    equation: str = ""
    typical_size: str = ""
    confused_with: tuple[str, ...] = ()
    experiment: str = ""
    formula: str = ""
    symbol: str = ""
    controller: Any = field(default=None, compare=False)
    absorbed: str = ""
    told_by: str = ""
    steps: bool = False
    in_file: bool = False

    def __repr__(self) -> str:
        """Summarise the effect; `vars` has all fields."""
        values = ", ".join(value.name for value in self.values)
        return f"<Effect {self.name} ({self.kind}) of {values}: {self.mechanism}>"

    def __post_init__(self) -> None:
        """Refuse numbers that are not finite, and bounds that leave no range for a fit."""
        for value in self.values:
            numbers = (value.typical, value.low, value.high, *value.starts)
            if not np.all(np.isfinite(np.array(numbers, dtype=np.float64))):
                found = ", ".join(f"{float(x):g}" for x in numbers)
                raise InputError(f"effect {self.name}", value.name, found, "finite numbers")
            if not value.low < value.high:
                raise InputError(
                    f"effect {self.name}",
                    value.name,
                    f"{value.low:g} to {value.high:g}",
                    "low below high",
                )
            if len(value.starts) > STARTS_MAX:
                found = f"{len(value.starts)} start values"
                expected = f"at most {STARTS_MAX}"
                raise InputError(f"effect {self.name}", value.name, found, expected)

    @property
    def is_hysteresis(self) -> bool:
        """Whether it is hysteresis of the torque, like the operators of the baseline model."""
        return bool(self.memory) and not self.steps and self.needs == {"torque_Nm"}

    def at_bound(self, values: FloatArray) -> list[str]:
        """Names of the values at a bound."""
        return [
            known.name
            for known, x in zip(self.values, values, strict=True)
            if known.role != "given" and not known.low < x < known.high
        ]

    def stopped_at_bound(self, values: FloatArray, free: Sequence[int] | None = None) -> list[str]:
        """Names of estimated values limited by a bound, except zeros at a lower bound.

        Estimated values are those that are `free`, by default all that a fit may estimate.
        """
        moved = {self.values[i].name for i in (self.free() if free is None else free)}
        size = {known.name: float(x) for known, x in zip(self.values, values, strict=True)}
        return [name for name in self.at_bound(values) if name in moved and size[name] != 0.0]

    def against_its_name(self, values: FloatArray) -> int | None:
        """Place of a value that makes it a different effect and should be zero."""
        for i, value in enumerate(self.values):
            if value.sign == "first" and abs(values[0] + values[i]) < abs(values[0]):
                return i
        return None

    def run(
        self,
        values: FloatArray,
        conditions: Conditions,
        torque_Nm: FloatArray,
        elastic_rad: FloatArray,
        wound_Nm: FloatArray | None = None,
    ) -> FloatArray:
        """Evaluate over a campaign, run by run, in the unit of the effect.

        Effects in the mesh use `wound_Nm`, the torque minus friction in parallel; by default the
        torque. Memory continues from run to run, except for effects of elapsed time, because the
        time between two recordings is unknown.
        """
        out = np.empty(conditions.rows)
        memory = np.zeros(max(self.memory, 1))
        fresh = "elapsed_s" in self.needs
        pieces = conditions.slices() if fresh or self.memory else [slice(0, conditions.rows)]
        sweep = getattr(self.function, "sweep", None)
        if sweep is not None:
            wrapped = conditions.wrapped_rad
            whole = dict(conditions.columns)
            if wrapped is not None:
                whole["input_angle_rad"] = wrapped
            whole["torque_Nm"], whole["elastic_rad"] = torque_Nm, elastic_rad
            whole["wound_Nm"] = torque_Nm if wound_Nm is None else wound_Nm
            # With a memory that continues, all runs form one recording.
            starts = conditions.starts.tolist() if fresh else [0, conditions.rows]
            return np.asarray(sweep(values, whole, memory, starts, fresh=fresh))
        for at in pieces:
            if fresh:
                memory[:] = 0.0
            # The angles are not wrapped here, because an order need not be an integer.
            run = {name: column[at] for name, column in conditions.columns.items()}
            run["time_s"] = conditions.time_s[at]
            run["run_number"] = 1.0 + conditions.run_of[at].astype(np.float64)
            run["torque_Nm"] = torque_Nm[at]
            run["elastic_rad"] = elastic_rad[at]
            run["wound_Nm"] = (torque_Nm if wound_Nm is None else wound_Nm)[at]
            out[at] = self.function(values, run, memory)
        return out

    def turns_with_torque(self, conditions: Conditions) -> bool:
        """Whether the lost motion that it causes changes its sign with torque and motion.

        That of every hysteresis does which is the same in both directions; its width and the
        compliance do not. The effect may compute in single precision.
        """

        def turns() -> bool:
            both = (conditions, conditions.mirrored())
            there, back = (self.run(self.typical, c, c.torque, c.torque) for c in both)
            even = self.kind in ("compliance", "width")
            rest = there - back if even else there + back
            rounding = float(np.finfo(np.float32).eps) * np.max(np.abs(there))
            return bool(np.max(np.abs(rest)) <= rounding)

        return conditions.once(("turns with torque", self), turns)

    @property
    def typical(self) -> FloatArray:
        """Typical values."""
        return np.array([value.typical for value in self.values])

    def ranges(self) -> list[tuple[str, float, float]]:
        """Name with unit and bounds of every value."""
        return [(value.name, value.low, value.high) for value in self.values]

    def indices(self, *roles: Role) -> list[int]:
        """Indices of the values of some roles."""
        return [i for i, value in enumerate(self.values) if value.role in roles]

    def free(self) -> list[int]:
        """Indices of the values that a fit may estimate: not given values or limits."""
        return self.indices("linear", "shape")

    def inner(self) -> list[int]:
        """Indices of the nonlinear values, including fixed ones."""
        return self.indices("shape", "fixed")

    def scaling(self) -> list[int]:
        """Indices of the values that scale the effect together, or of all nonlinear ones."""
        linear = [i for i, v in enumerate(self.values) if v.role == "linear" or v.scales]
        return linear or self.inner()


SAID = ("scale", "starts", "sign", "between_runs", "scales", "words")
"""Remarks of a card on a value."""


def card(effect: Effect) -> dict[str, Any]:
    """Description of an effect."""
    return {
        "name": effect.name,
        "kind": effect.kind,
        "mechanism": effect.mechanism,
        "equation": effect.equation,
        "parameters": [
            {
                "name": v.name,
                "role": v.role,
                "typical": v.typical,
                "low": v.low,
                "high": v.high,
                **{name: said for name in SAID if (said := getattr(v, name))},
            }
            for v in effect.values
        ],
        "needs": sorted(effect.needs),
        "typical_size": effect.typical_size,
        "confused_with": list(effect.confused_with),
        "separating_experiment": effect.experiment,
        **({"absorbed": effect.absorbed} if effect.absorbed else {}),
    }


@dataclass(frozen=True)
class CheckedFunction:
    """A Python function ``f(p, at)`` as the function of an effect, with checks of its result.

    It can be pickled if `function` can, that is, if it is in a module.
    """

    name: str
    values: tuple[Value, ...]
    function: Callable[[Any, Any], FloatArray]

    def __call__(
        self, numbers: FloatArray, run: Mapping[str, FloatArray], memory: FloatArray
    ) -> FloatArray:
        """Evaluate over one recording."""
        size = run["torque_Nm"].size
        everything = {
            condition: np.full(size, NEUTRAL.get(condition, 0.0))
            for condition in (*NEEDS, *RECORDED_ONLY)
        }
        p = SimpleNamespace(**{v.name: float(n) for v, n in zip(self.values, numbers, strict=True)})
        try:
            result = self.function(p, SimpleNamespace(**{**everything, **run}))
            result = np.broadcast_to(np.asarray(result, dtype=np.float64), (size,))
        except Exception as error:  # the user's own code may raise anything
            found = f"{type(error).__name__}: {error}"
            raise InputError(f"effect {self.name}", "", found, "an array of numbers") from None
        if not np.all(np.isfinite(result)):
            raise InputError(f"effect {self.name}", "", "a result that is not finite", "numbers")
        return np.asarray(result)


def effect(
    *,
    values: Sequence[Value],
    needs: Sequence[str],
    kind: Kind = "angle",
    name: str | None = None,
    mechanism: str = "",
    equation: str = "",
    typical_size: str = "",
    confused_with: Sequence[str] = (),
    experiment: str = "",
    absorbed: str = "",
    told_by: str = "",
    steps: bool = False,
) -> Callable[[Callable[[Any, Any], FloatArray]], Effect]:
    """Make an effect of a Python function ``f(p, at)``.

    `p` has the values as attributes, `at` the conditions of one recording as arrays
    (``at.torque_Nm``, ``at.temperature_C`` ..., and what the model fills in: ``at.elastic_rad``,
    the angle of torsion curve and friction, and ``at.wound_Nm``, the torque minus friction in
    parallel; for a ``"width"``, before friction has acted, angle of the curve and torque). The
    function returns an array. Angles are not wrapped. ``at.run_number``, 1 for the first run of the
    campaign, and ``at.time_s`` are for single occurrences: a controller does not know them.

    Parameters
    ----------
    values : sequence of Value
    needs : sequence of str
        Names of conditions, see `NEEDS`.
    kind : {"torque", "compliance", "width", "angle"}
    name : str, optional
        By default that of the function.
    absorbed, told_by, steps : optional
        See `Effect`.
    """
    unknown = [need for need in needs if need not in NEEDS]
    if unknown:
        raise InputError("effect", "needs", unknown[0], "one of " + ", ".join(NEEDS))

    def make(function: Callable[[Any, Any], FloatArray]) -> Effect:
        own = name or function.__name__

        call = CheckedFunction(own, tuple(values), function)
        return Effect(
            own,
            kind,
            tuple(values),
            frozenset(needs),
            call,
            1 if "elapsed_s" in needs else 0,
            mechanism,
            equation,
            typical_size,
            tuple(confused_with),
            experiment,
            absorbed=absorbed,
            told_by=told_by,
            steps=steps,
        )

    return make


def find_effect(name: str, effects: Mapping[str, Effect], file: str = "effect") -> Effect:
    """Find an effect by its name, or list the known ones."""
    if name not in effects:
        raise InputError(
            file,
            name,
            "no such effect",
            "one of "
            + ", ".join(effects)
            + did_you_mean(name, effects)
            + ", or your own by --effects FILE",
        )
    return effects[name]
