"""Forms of the baseline model's hysteresis: where friction sits, whether it grows with the load.

inside       in parallel with the spring, operators of constant width
inside+load  some of the operators grow with the load
both         in parallel and in series, constant width
both+load    in parallel and in series, some growing with the load
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from lostmotion.fit.baseline import BaselineModel

Friction = Literal["inside", "inside+load", "both", "both+load"]

FORMS: tuple[Friction, ...] = get_args(Friction)
"""In the order of their numbers of values: the first that does is taken."""

WORDS: dict[str, str] = {
    "inside": "in parallel with the spring",
    "inside+load": "in parallel with the spring, growing with the load",
    "both": "in parallel and in series with the spring",
    "both+load": "in parallel and in series with the spring, growing with the load",
}
"""Every form in words, behind 'friction'."""

STEPS = 25
"""Evaluations of a fit."""


def friction_form(base: BaselineModel) -> Friction:
    """Form that a model has."""
    where = "inside" if base.hysteresis.outside is None else "both"
    load = base.hysteresis.widening is not None
    return FORMS[2 * (where == "both") + load]


def in_form(
    base: BaselineModel, form: Friction, rows: npt.NDArray[np.bool_] | None = None
) -> BaselineModel:
    """Fit a model with what a form has and it has not; itself where it has that already.

    Parameters
    ----------
    base : BaselineModel
        Fitted.
    form : str
        One that has at least what the model has.
    rows : ndarray of bool, optional
        Samples that count.
    """
    if form == friction_form(base):
        return base
    other = base.copy()
    if form.endswith("+load"):
        other.hysteresis.allow_load()
    if form.startswith("both"):
        other.allow_outside_friction()
    other.fit(steps=STEPS, rows=rows)
    return other
