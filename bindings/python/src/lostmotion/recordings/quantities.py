"""Measured quantities, their stored units and permitted ranges."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lostmotion import units
from lostmotion.condition_cards import CARDS
from lostmotion.core import NEEDS


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


def _of_conditions() -> list[Quantity]:
    """Conditions that are columns of a recording, as their cards state them."""
    found = []
    for name in NEEDS:
        low, high = CARDS[name].recorded
        if low < high:
            stem, unit = units.split_unit(name)
            symbol, dimension = (unit.symbol, unit.dimension) if unit else ("", units.DIMENSIONLESS)
            found.append(Quantity(stem, symbol, dimension, low, high))
    return found


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity("run", "", units.DIMENSIONLESS, -math.inf, math.inf),
        Quantity("time", "s", units.TIME, -1e12, 1e12),
        *_of_conditions(),
        Quantity("lost_motion", "rad", units.ANGLE, -1e9, 1e9),
        Quantity("direction", "", units.DIMENSIONLESS, -1e6, 1e6),
        Quantity("motor_torque", "Nm", units.TORQUE, -1e6, 1e6),
        Quantity("motor_current", "A", units.CURRENT, -1e6, 1e6),
        Quantity("order", "", units.DIMENSIONLESS, -1e12, 1e12),
    )
}
