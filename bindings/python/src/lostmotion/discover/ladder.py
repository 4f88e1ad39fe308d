"""The ladder: the error of the baseline model and after each effect, by run and by condition.

Every rung is cross-validated twice: leaving out single runs, and leaving out all runs of one
setting of a condition (`measured_conditions`). An effect that lowers the error of similar runs but
makes the prediction of another amplitude worse is not recommended.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lostmotion import rules
from lostmotion.arrays import FloatArray, IntArray
from lostmotion.discover.gates import deviations_least
from lostmotion.discover.measured_conditions import Setting, settings_of
from lostmotion.effects.conditions import Conditions
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.fitted_range import beyond, fitted_ranges
from lostmotion.fit.held_out import LeftOut, LeftOutResiduals
from lostmotion.rms import rms_of

TWO_SIDED = 1.96
"""Standard errors of an interval of 95 %."""


@dataclass
class Rung:
    """A model with its errors.

    Attributes
    ----------
    model : BaselineModel
    rms_arcsec : float
        Error of the fit to all runs.
    left_out : ndarray
        Residual of every sample for a fit to the other runs.
    by_setting : dict
        Mean square of every run for a fit to the runs of other settings, by setting.
    sure : set
        Settings without which the other runs still identify the new effect of this rung.
    """

    model: BaselineModel
    rms_arcsec: float
    left_out: FloatArray
    by_setting: dict[Setting, FloatArray]
    sure: set[Setting]

    @property
    def rows(self) -> FloatArray:
        """Samples of every run."""
        return np.diff(self.model.conditions.starts).astype(np.float64)

    @property
    def heldout_rms_arcsec(self) -> float:
        """Leave-one-run-out error."""
        return rms_of(self.left_out)

    def rms_of(self, settings: Sequence[Setting]) -> float:
        """Error over settings, each predicted from the others, arc seconds."""
        runs = np.concatenate([one.runs for one in settings])
        squares = np.concatenate([self.by_setting[one] for one in settings])
        return float(np.sqrt(np.average(squares, weights=self.rows[runs])))

    def by_condition(self) -> dict[str, dict[str, Any]]:
        """Error of every condition, and of each of its settings."""
        found: dict[str, list[Setting]] = {}
        for one in self.by_setting:
            found.setdefault(one.condition, []).append(one)
        return {
            condition: {
                "rms_heldout_arcsec": self.rms_of(settings),
                "settings": [
                    {
                        "setting": str(one),
                        "rms_heldout_arcsec": self.rms_of([one]),
                        "beyond_fitted_range": beyond_others(self.model.conditions, one),
                    }
                    for one in settings
                ],
            }
            for condition, settings in found.items()
        }


def beyond_others(c: Conditions, setting: Setting) -> dict[str, float | None]:
    """Extrapolation of a setting beyond the runs of the others, in multiples of their range."""
    mine = np.isin(c.run_of, setting.runs)
    return beyond(fitted_ranges(c, ~mine), fitted_ranges(c, mine))


def make_rungs(
    models: Sequence[BaselineModel], by_run: LeftOutResiduals | None = None
) -> list[Rung]:
    """Cross-validate a sequence of models, each with more than the previous one.

    Parameters
    ----------
    models : sequence of BaselineModel
    by_run : LeftOutResiduals, optional
        Of the models that were cross-validated by run before.
    """
    if not models:
        return []
    settings = settings_of(models[0].conditions) if models[0].conditions.runs > 2 else {}
    every = [one for group in settings.values() for one in group]
    before = [len(models[0].terms), *(len(model.terms) for model in models)]
    by_run = by_run or LeftOutResiduals()
    return [
        make_rung(model, every, len(model.terms) > terms, by_run.of(model))
        for model, terms in zip(models, before, strict=False)
    ]


def make_rung(
    model: BaselineModel, settings: Sequence[Setting], grown: bool, left_out: FloatArray
) -> Rung:
    """Cross-validate a model over settings; whether it has `grown` by an effect."""
    left = LeftOut(model)
    rests = left.residuals([list(one.runs) for one in settings], known=left_out)
    by_setting = {
        one: np.array([mean_square(rest) for rest in own])
        for one, own in zip(settings, rests, strict=True)
    }
    return Rung(
        model,
        rms_of(model.residual()),
        left_out,
        by_setting,
        {one for one in settings if grown and shown_without(left, one)},
    )


def mean_square(residual: FloatArray) -> float:
    """Mean square."""
    return float(np.mean(residual**2))


def shown_without(left: LeftOut, setting: Setting) -> bool:
    """Whether the runs of other settings alone identify the newest effect.

    Wald test of its scaling values with the sandwich covariance over runs, because the noise within
    a run is coloured.
    """
    base = left.base
    term = base.terms[-1]
    group = list(setting.runs)
    others = [run for run in range(len(left.pieces)) if run not in group]
    kept, normal = left.normal_without(group)
    places = base.term_places(term)
    carries = [places.start + k for k, i in enumerate(term.free) if i in term.effect.scaling()]
    among = np.flatnonzero(left.free)[kept]
    mine = np.flatnonzero(np.isin(among, carries))
    if not mine.size or len(others) < 2:
        return False
    step = left.step_without(group)
    scores = np.array([left.slope[run] - left.gram[run] @ step for run in others])[:, kept]
    spread = np.linalg.solve(normal, scores.T)[mine]
    covariance = spread @ spread.T * len(others) / (len(others) - 1)
    x = base.vector()[0][left.free] * left.norm + step
    values = x[kept][mine]
    try:
        wald = float(values @ np.linalg.solve(covariance, values))
    except np.linalg.LinAlgError:
        return False
    return wald >= mine.size * deviations_least() ** 2


def harms(before: Rung, after: Rung) -> list[dict[str, Any]]:
    """Settings that an effect predicts worse although the other runs identify it."""
    found = []
    for one, squares in after.by_setting.items():
        if one not in after.sure:
            continue
        was, now = before.rms_of([one]), after.rms_of([one])
        worse = int(np.count_nonzero(squares > before.by_setting[one]))
        if now > (1.0 + rules.HARM_MOST) * was and 2 * worse > len(one.runs):
            found.append(
                {
                    "condition": one.condition,
                    "setting": str(one),
                    "rms_heldout_arcsec_before": was,
                    "rms_heldout_arcsec": now,
                }
            )
    return found


def gain(before: FloatArray, after: FloatArray, starts: IntArray) -> tuple[float, list[float]]:
    """Decrease of the leave-one-run-out error, arc seconds, with its 95 % interval.

    Conditional on these runs: the explained part is fixed, and the residual is random, constant
    within a run and independent between runs.

    Parameters
    ----------
    before, after : ndarray
        Leave-one-run-out residual of two models.
    starts : ndarray
        First sample of every run, and the number of samples.
    """
    was, now = rms_of(before), rms_of(after)
    explained = before - after
    by_run = np.add.reduceat(explained * after, starts[:-1]) / explained.size
    runs = by_run.size
    error = 2.0 * float(np.sqrt(np.sum(by_run**2) * runs / max(runs - 1, 1)))
    reach = TWO_SIDED * error / max(was + now, 1e-300)
    return was - now, [was - now - reach, was - now + reach]


def told(rungs: Sequence[Rung], names: Sequence[list[str]]) -> list[dict[str, Any]]:
    """Return the answer entry of every rung, with the names of its effects.

    Parameters
    ----------
    rungs : sequence of Rung
    names : sequence of list of str
    """
    out = []
    for number, (rung, has) in enumerate(zip(rungs, names, strict=True)):
        entry: dict[str, Any] = {
            "effects": has,
            "rms_arcsec": rung.rms_arcsec,
            "rms_heldout_arcsec": rung.heldout_rms_arcsec,
            "heldout_by_condition": rung.by_condition(),
        }
        if number:
            size, interval = gain(
                rungs[number - 1].left_out, rung.left_out, rung.model.conditions.starts
            )
            entry |= {
                "gain_arcsec": size,
                "gain_interval_arcsec": interval,
                "harms": harms(rungs[number - 1], rung),
            }
        out.append(entry)
    return out
