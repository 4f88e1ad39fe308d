"""The cards of the conditions that effects use, as the C library states them.

Recorded quantities, the interface of an FMU, the pictures of effects, the groups of the workbench
and the unnamed shapes follow from these cards.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from lostmotion.core import NEEDS, core


@dataclass(frozen=True)
class ConditionCard:
    """Description of a condition: the fields of `lm_condition_card` (effects.h)."""

    quantity: str
    meaning: str
    cause: str
    usual: tuple[float, float]
    compared: tuple[float, float]
    recorded: tuple[float, float]
    turns: bool
    smooth: bool

    @property
    def drawn(self) -> bool:
        """Whether it can be the axis of a picture."""
        return self.usual[0] < self.usual[1]


def _read(c: Any, card: Any) -> ConditionCard:
    def text(pointer: Any) -> str:
        return str(c.ffi.string(pointer).decode())

    return ConditionCard(
        text(card.quantity),
        text(card.meaning),
        text(card.cause),
        tuple(card.usual),
        tuple(card.compared),
        tuple(card.recorded),
        bool(card.traits & c.lib.LM_CONDITION_TURNS),
        bool(card.traits & c.lib.LM_CONDITION_SMOOTH),
    )


def _read_all() -> dict[str, ConditionCard]:
    c = core(64)
    rows = [c.lib.lm_condition_cards[i] for i in range(c.lib.LM_CONDITION_COUNT)]
    return {c.ffi.string(row.name).decode(): _read(c, row) for row in rows}


CARDS = _read_all()
"""The cards by the names of `lostmotion.core.NEEDS`, in the order of the groups of effects."""


def _read_neutral() -> dict[str, float]:
    c = core(64)
    found = c.lib.lm_read_conditions(c.ffi.new("lm_recording *"), 0)
    return {name: float(getattr(found, name)) for name in NEEDS}


NEUTRAL = _read_neutral()
"""Value of each condition where it was not measured."""


def cause_of(needs: frozenset[str]) -> str:
    """Name the group of an effect by the conditions that it needs; that of a load without any."""
    return next((c.cause for name, c in CARDS.items() if name in needs), CARDS["torque_Nm"].cause)
