"""The protocol of a recording: locked side, and quantities measured instead.

With one side locked, its angle is at rest and needs no encoder. With the output locked, the
external torque on it is the reaction to the motor's,

    torque = -ratio * motor_torque,        motor_torque = torque_constant * motor_current,

because the reducer is in balance at rest and its power sums to zero,
``motor_torque * input_speed + torque * output_speed = 0`` with ``output_speed = input_speed /
ratio``. The lost motion is ``-input_angle / ratio``. A motor that pushes in its positive direction
makes both negative, so they keep the sign that `docs/units.md` states, whatever the sign of the
ratio.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from lostmotion.arrays import FloatArray
from lostmotion.errors import InputError
from lostmotion.recordings.findings import Finding

Side = Literal["output", "input"]

SIDES: tuple[Side, ...] = ("output", "input")
"""Sides that can be locked."""

MOTOR_SIDE = ("motor_torque", "motor_current")
"""Quantities of the motor, which only a locked output turns into the torque on the output."""

ORDER = "order"
"""A running number in place of time stamps."""

REPLACED = (*MOTOR_SIDE, ORDER)
"""Substitute quantities, which a campaign does not contain."""

MOTOR_ACTION = (
    "the torque is that of the motor times the ratio: it includes friction and cogging of "
    "the motor and losses of the gear, so the hysteresis is that of both"
)
"""Report text for a torque measured at the motor with a locked output."""

INPUT_ACTION = (
    "the input is assumed locked and was not measured: the compliance of its lock is part "
    "of the lost motion"
)
"""Report text for a lost motion without a measured input angle."""

OUTPUT_ACTION = (
    "the output is assumed locked and was not measured: the compliance of its lock is part "
    "of the lost motion"
)
"""Report text for a lost motion without a measured output angle."""

ORDER_ACTION = "no time stamps: rows in the given order; effects of time and speed are not testable"
"""Report text for a running number instead of a clock."""


@dataclass(frozen=True)
class Protocol:
    """Side that was locked during the recordings.

    Attributes
    ----------
    locked : {"output", "input"} or None
        The side that was locked; None where both angles or the lost motion were recorded.
    torque_constant_Nm_per_A : float or None
        Motor torque for one ampere of ``motor_current_A``.
    """

    locked: Side | None = None
    torque_constant_Nm_per_A: float | None = None

    def supplies(self, there: Collection[str]) -> set[str]:
        """Quantities that need no column, given the existing ones."""
        found = set()
        if ORDER in there:
            found.add("time")
        if self.locked == "input":
            found.add("input_angle")
        if self.locked == "output":
            found.add("output_angle")
            if "motor_torque" in there or self._converts(there):
                found.add("torque")
        return found

    def _converts(self, there: Collection[str]) -> bool:
        return "motor_current" in there and self.torque_constant_Nm_per_A is not None

    def complete(
        self, file: str, numbers: dict[str, FloatArray], ratio: float | None
    ) -> dict[str, FloatArray]:
        """Fill in the values of the protocol and drop the columns that they replace.

        Parameters
        ----------
        file : str
            For messages.
        numbers : dict
            Columns in SI by quantity.
        ratio : float or None
            Input turns for one output turn, signed.

        Raises
        ------
        InputError
            If the torque comes from the motor and the ratio is unknown.
        """
        out = {name: values for name, values in numbers.items() if name not in REPLACED}
        if "time" not in numbers and ORDER in numbers:
            out["time"] = numbers[ORDER]
        if self.locked == "output" and "torque" not in numbers:
            motor = numbers.get("motor_torque")
            if motor is None and self._converts(numbers):
                assert self.torque_constant_Nm_per_A is not None
                motor = self.torque_constant_Nm_per_A * numbers["motor_current"]
            if motor is not None:
                if ratio is None:
                    expected = "the ratio, which converts the motor torque to torque on the output"
                    raise InputError(file, "torque_Nm", "no ratio", expected)
                out["torque"] = -ratio * motor
        return out

    def unused(self, there: Collection[str]) -> list[str]:
        """Substitute quantities of a file that are not needed."""
        return [
            name
            for name in REPLACED
            if name in there
            and ("time" in there if name == ORDER else not self._drives_torque(name, there))
        ]

    def _drives_torque(self, name: str, there: Collection[str]) -> bool:
        if self.locked != "output" or "torque" in there:
            return False
        return name == "motor_torque" or ("motor_torque" not in there and self._converts(there))

    def findings(self, file: str, there: Collection[str]) -> list[Finding]:
        """Describe systematic contributions to the data from the measurement method."""

        def note(kind: str, column: str, action: str) -> Finding:
            return Finding(kind, file, column, None, 1, action)

        found = []
        lost = "lost_motion" in there
        if self.locked == "output" and "output_angle" not in there and not lost:
            found.append(note("locked", "output_angle_rad", OUTPUT_ACTION))
        if self.locked == "input" and "input_angle" not in there and not lost:
            found.append(note("locked", "input_angle_rad", INPUT_ACTION))
        if self.locked == "output" and "torque" not in there:
            found.append(note("motor_torque", "torque_Nm", MOTOR_ACTION))
        if "time" not in there and ORDER in there:
            found.append(note("untimed", "time_s", ORDER_ACTION))
        return found


FREE = Protocol()
"""Both sides measured, or the lost motion."""


def suggest_protocol(there: Collection[str]) -> str:
    """Suggest a protocol for a file that lacks columns; empty if none applies."""
    if "lost_motion" in there:
        return ""
    if "input_angle" in there and "output_angle" not in there:
        if "torque" in there or "motor_torque" in there:
            return "--locked output where the output was locked"
        if "motor_current" in there:
            return "--locked output --torque-constant-Nm-per-A K where the output was locked"
        return ""
    if "output_angle" in there and "input_angle" not in there:
        return "--locked input where the input was locked"
    return ""
