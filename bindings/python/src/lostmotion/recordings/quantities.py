"""Measured quantities, their stored units and permitted ranges."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lostmotion import units


@dataclass(frozen=True)
class Quantity:
    """A measured quantity: name, stored unit and permitted range.

    The range is far beyond any drive: values outside indicate a wrong unit or a damaged file, or
    would overflow.
    """

    name: str
    unit: str
    dimension: units.Dimension
    low: float
    high: float

    @property
    def column(self) -> str:
        """Name of the column in the stored unit."""
        return f"{self.name}_{self.unit}" if self.unit else self.name


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity("run", "", units.DIMENSIONLESS, -math.inf, math.inf),
        Quantity("time", "s", units.TIME, -1e12, 1e12),
        Quantity("torque", "Nm", units.TORQUE, -1e6, 1e6),
        Quantity("input_angle", "rad", units.ANGLE, -1e9, 1e9),
        Quantity("output_angle", "rad", units.ANGLE, -1e9, 1e9),
        Quantity("lost_motion", "rad", units.ANGLE, -1e9, 1e9),
        Quantity("temperature", "C", units.TEMPERATURE, -units.ZERO_CELSIUS_K, 1e4),
        Quantity("cycles", "", units.DIMENSIONLESS, 0.0, 1e15),
        Quantity("tilt_moment", "Nm", units.TORQUE, -1e6, 1e6),
        Quantity("axial_force", "N", units.FORCE, -1e9, 1e9),
        Quantity("direction", "", units.DIMENSIONLESS, -1e6, 1e6),
        Quantity("motor_torque", "Nm", units.TORQUE, -1e6, 1e6),
        Quantity("motor_current", "A", units.CURRENT, -1e6, 1e6),
        Quantity("order", "", units.DIMENSIONLESS, -1e12, 1e12),
    )
}
