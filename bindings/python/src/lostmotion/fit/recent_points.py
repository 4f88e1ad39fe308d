"""The last points at which a model and its copies were evaluated, to be used again."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.fit.point import Point

FloatArray = npt.NDArray[np.float64]

KEPT = 4
"""Number of points that are kept: those of two fits that run in parallel, before and after a step.
"""


@dataclass
class RecentPoint:
    """An evaluated point.

    Attributes
    ----------
    state : tuple
        Everything that the evaluation depends on, as bytes and identities.
    owners : tuple
        Objects whose identities are part of the state; kept, so that no others receive these.
    point : Point
    columns : tuple or None
        Names of parameters, and the derivatives of the angle by them, if they were computed.
    """

    state: tuple[object, ...]
    owners: tuple[object, ...]
    point: Point
    columns: tuple[list[str], FloatArray] | None = None

    def columns_of(self, names: list[str]) -> FloatArray | None:
        """Derivatives of the angle by parameters, if they are known."""
        return self.columns[1] if self.columns is not None and self.columns[0] == names else None


@dataclass
class RecentPoints:
    """The last points of the models that share it.

    Threads may replace each other's entries: then a point is evaluated again.
    """

    kept: tuple[RecentPoint, ...] = field(default=(), repr=False, compare=False)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles are empty."""
        return RecentPoints, ()

    def find(self, state: tuple[object, ...]) -> Point | None:
        """The point of a state, if it is kept."""
        return next((one.point for one in self.kept if one.state == state), None)

    def keep(self, state: tuple[object, ...], owners: tuple[object, ...], point: Point) -> Point:
        """Keep a point."""
        if self.find(state) is None:
            self.kept = (RecentPoint(state, owners, point), *self.kept[: KEPT - 1])
        return point

    def entry_of(self, point: Point) -> RecentPoint | None:
        """The entry of a point, if it is still kept."""
        return next((one for one in self.kept if one.point is point), None)
