"""A fitted baseline model in another form of the hysteresis.

Forms are nested, and operators have kinks: a fit of a large form converges to the minimum nearest
its start. It starts from the best of the forms that it contains, which it can only improve.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lostmotion.arrays import BoolArray
from lostmotion.fit.baseline import BaselineModel
from lostmotion.friction import FORMS, PARTS, Friction, contained

STEPS = 25
"""Evaluations of a fit."""


def friction_form(base: BaselineModel) -> Friction:
    """Return the form of a model."""
    hysteresis = base.hysteresis
    parts = {
        "parallel": hysteresis.parallel,
        "series": hysteresis.outside is not None,
        "load": hysteresis.widening is not None,
    }
    has = {part for part, there in parts.items() if there}
    return next(form for form in FORMS if PARTS[form] == has)


def in_form(
    base: BaselineModel,
    form: Friction,
    rows: BoolArray | None = None,
    known: Mapping[Friction, BaselineModel] | None = None,
) -> BaselineModel:
    """Fit a model in another form; returns it unchanged if it already has that form.

    Parameters
    ----------
    base : BaselineModel
        Fitted, in a form that `leads_to` the other.
    form : str
        The requested form.
    rows : ndarray of bool, optional
        Samples that are used.
    known : mapping, optional
        Existing fits of other forms.
    """
    given = friction_form(base)
    if form == given:
        return base
    if form == "outside":
        other = base.copy()
        other.begin_outside()
        other.fit(steps=STEPS, rows=rows)
        return other
    fits = {given: base, **(known or {})}
    inner = [
        fits[name] if name in fits else in_form(base, name, rows, fits)
        for name in contained(form)
        if leads_to(given, name)
    ]
    other = min(inner, key=lambda one: squares(one, rows)).copy()
    if "parallel" in PARTS[form]:
        other.hysteresis.parallel = True
    if "load" in PARTS[form]:
        other.hysteresis.allow_load()
    if "series" in PARTS[form]:
        other.hysteresis.allow_outside()
    other.fit(steps=STEPS, rows=rows)
    return other


def leads_to(given: Friction, form: Friction) -> bool:
    """Whether a model in one form can be fitted in another without losing parts.

    Friction in parallel alone, with which every model starts, can be removed.
    """
    return PARTS[given] <= PARTS[form] or given == FORMS[0]


def squares(base: BaselineModel, rows: BoolArray | None) -> float:
    """Sum of squares of the residual over the samples that are used."""
    residual = base.residual()
    return float(np.sum(residual**2 if rows is None else residual[rows] ** 2))
