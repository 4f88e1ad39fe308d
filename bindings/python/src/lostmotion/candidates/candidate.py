"""A candidate: a block of columns that may explain what the baseline model lacks."""

from __future__ import annotations

from dataclasses import dataclass, field

from lostmotion.arrays import FloatArray
from lostmotion.effects.effect import Effect

LOAD_NEEDS = {"torque_Nm", "elapsed_s"}
LOAD_CHANNELS = {"torque", "torque_rate", "time"}
"""Conditions of effects, and quantities of shapes, that are the torque and its history."""

KINDS = ("effect", "shape", "ripple", "run")
"""Named effects, smooth shapes, ripples over torque or angle, differences between runs."""


@dataclass
class Candidate:
    """A block of columns in the contest.

    Attributes
    ----------
    name : str
    named : bool
        Whether it is an effect of the library or the user; otherwise an unnamed shape.
    columns : ndarray
        Arc seconds per unit.
    covariate, shape : str
        What a shape depends on, in words.
    starts : list of ndarray
        Values to start a joint refit from.
    start_of : list of int
        The start that each column belongs to.
    trials : int
        Number of columns examined to find these; the test is corrected for all of them.
    tests : int
        Number of tests of which it is the result.
    also : list of tuple
        Other quantities with the same columns, and their shapes.
    kind : str
        One of `KINDS`. Every effect, and every other kind, has the same share of the test level.
    formula : str
        A shape as ``fit --add`` takes it, where it can be written.
    odd : bool
        Whether it changes its sign with torque and motion, see `Effect.turns_with_torque`.
    of_form : bool
        Whether it is confounded with the form error: with this plan it is a function of the torque
        and its history, as creep is if all runs have the same loading rate.
    """

    name: str
    named: bool
    columns: FloatArray
    covariate: str = ""
    shape: str = ""
    effect: Effect | None = None
    starts: list[FloatArray] = field(default_factory=list)
    start_of: list[int] = field(default_factory=list)
    trials: int = 1
    tests: int = 1
    also: list[tuple[str, str]] = field(default_factory=list)
    kind: str = "shape"
    formula: str = ""
    odd: bool = True
    of_form: bool = False

    def __post_init__(self) -> None:
        """Set the kind of effects."""
        if self.named:
            self.kind = "effect"

    @property
    def hangs_on_load_alone(self) -> bool:
        """Whether it depends only on the torque and its history, as the baseline model does."""
        if self.effect is not None:
            return self.effect.needs <= LOAD_NEEDS
        return self.covariate in LOAD_CHANNELS

    @property
    def may_be_form(self) -> bool:
        """Whether another form of the hysteresis may cause the same."""
        return self.hangs_on_load_alone and self.odd
