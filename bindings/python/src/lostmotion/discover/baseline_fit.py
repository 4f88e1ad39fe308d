"""The fit of the baseline model, before anything is added: outliers first, then its form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lostmotion.arrays import BoolArray
from lostmotion.discover.baseline_form import ChosenForm, choose_form, form_beside
from lostmotion.discover.outliers import clean_outliers
from lostmotion.effects.effect import Effect
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.forms import in_form
from lostmotion.friction import Friction


@dataclass
class BaselineFit:
    """A fitted baseline model.

    Attributes
    ----------
    plain : BaselineModel
        The model before its form was chosen.
    chosen : ChosenForm
    outliers : int
        Number of single outlying samples that were replaced by interpolation.
    """

    plain: BaselineModel
    chosen: ChosenForm
    outliers: int

    @property
    def base(self) -> BaselineModel:
        """Baseline model in the chosen form."""
        return self.chosen.base


def fit_baseline(
    base: BaselineModel,
    effects: Mapping[str, Effect],
    ratio: float,
    form: Friction | None = None,
    *,
    rows: BoolArray | None = None,
) -> BaselineFit:
    """Fit a baseline model: set outliers aside and choose its form.

    `compare`, `diagnose` and `fit` start with it, so that they have the same baseline model.

    Parameters
    ----------
    base : BaselineModel
    effects : mapping
        That may be missing.
    ratio : float
        Of the drive.
    form : str, optional
        Form to be used instead of choosing one.
    rows : ndarray of bool, optional
        Samples that are fitted, whole runs.
    """
    base.first_fit(rows=rows)
    return finish_baseline(base, effects, ratio, form, rows=rows)


def finish_baseline(
    base: BaselineModel,
    effects: Mapping[str, Effect],
    ratio: float,
    form: Friction | None = None,
    *,
    rows: BoolArray | None = None,
) -> BaselineFit:
    """Complete `fit_baseline` after the first fit.

    In runs that are only predicted no outliers are set aside.
    """
    outliers = clean_outliers(base) if rows is None else 0
    if outliers:
        base.fit(rows=rows)
    return BaselineFit(base, choose_form(base, effects, ratio, form=form, rows=rows), outliers)


def form_beside_effects(
    fitted: BaselineFit, found: BaselineModel, effects: Mapping[str, Effect], ratio: float
) -> BaselineModel | None:
    """Choose the form again, with the effects found or added in the model.

    Returns
    -------
    BaselineModel or None
        The baseline model in that form; None if its form is kept or was stated.
    """
    if len(fitted.chosen.tried) < 2:
        return None
    beside = form_beside(fitted.plain, found, effects, ratio, fitted.chosen.tried)
    return None if beside == fitted.chosen.form else in_form(fitted.plain, beside)
