"""The form of the baseline model, chosen before anything is named.

Every form of the hysteresis (`lostmotion.friction`) predicts runs that it has not been fitted to;
one that consists of others is tried where one of these helps. A richer form than operators of
constant width in parallel with the spring is taken where

- runs confirm it (`gates.told_apart`, of their errors as they are left out one by one): fewer than
  `rules.RUNS_LEAST` confirm nothing, and no form is tried;
- it is what the error comes from: of the residual above the measurement noise it takes at least
  `rules.FORM_EXPLAINS`. What takes less may be an effect that is missing, whose form the operators
  resemble, and is left to the contest;
- no effect of the library that is hysteresis itself does as well beside constant width.

Of the forms that do, the one with the fewest values is taken that none of the others beats by
`rules.SHAPE_AFTER_NAMED` of the noise. What an effect does that is missing hides how much of the
rest is the form's: the form is chosen again beside what a selection has found (`form_beside`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lostmotion import rules
from lostmotion.candidates import shapes
from lostmotion.candidates.named import tangent
from lostmotion.discover.contest_round import make_candidates
from lostmotion.discover.gates import told_apart
from lostmotion.discover.linearise import noise_rms
from lostmotion.discover.measurement_noise import estimate_noise
from lostmotion.discover.refits import without_deviations
from lostmotion.effects.effect import Effect
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.forms import friction_form, in_form, leads_to
from lostmotion.fit.held_out import held_out_residual
from lostmotion.fit.terms import Term
from lostmotion.friction import FORMS, PARTS, Friction, contained

FloatArray = npt.NDArray[np.float64]


@dataclass
class Tried:
    """A form with its fit.

    Attributes
    ----------
    by_run : ndarray
        Sum of squares of each run under a fit to the others, over the rows of all.
    """

    base: BaselineModel
    heldout: FloatArray
    by_run: FloatArray

    @property
    def mean_square(self) -> float:
        """Of the runs left out one by one, arc seconds squared."""
        return float(self.by_run.sum())


@dataclass
class ChosenForm:
    """The form that was chosen, and how the others did."""

    base: BaselineModel
    form: Friction
    tried: dict[Friction, Tried]


def tried(
    base: BaselineModel, rows: npt.NDArray[np.bool_] | None = None, refits: bool = False
) -> Tried:
    """Predict every run by a fit to the others; with a single run its halves.

    Parameters
    ----------
    rows : ndarray of bool, optional
        Samples that were fitted; runs outside them are predicted, and do not judge.
    refits : bool
        See `held_out_residual`; forms are compared without.
    """
    c = base.conditions
    starts = c.starts if c.runs > 1 else np.array([0, c.rows // 2, c.rows])
    few = c.rows < 2
    heldout = base.residual() if few else held_out_residual(base, starts, rows, refits=refits)
    judged = np.ones(c.rows, dtype=bool) if rows is None else rows
    heldout[~judged] = base.residual()[~judged]
    squares = np.where(judged, heldout**2, 0.0) / np.count_nonzero(judged)
    return Tried(base, heldout, np.add.reduceat(squares, c.starts[:-1]))


def better(one: Tried, other: Tried) -> bool:
    """Whether the runs confirm that the one predicts better than the other."""
    seen = other.by_run > 0
    return told_apart(other.by_run[seen], one.by_run[seen])


def choose_form(
    base: BaselineModel,
    effects: Mapping[str, Effect],
    ratio: float,
    *,
    form: Friction | None = None,
    rows: npt.NDArray[np.bool_] | None = None,
    rival: Tried | None = None,
) -> ChosenForm:
    """Choose the form of a fitted model's hysteresis.

    Parameters
    ----------
    base : BaselineModel
        Fitted. One that has more than friction in parallel or in series alone (of a fitted drive
        file) keeps its form.
    effects : mapping
        That may be missing.
    ratio : float
        Of the drive.
    form : str, optional
        To be used, whatever the runs say.
    rows : ndarray of bool, optional
        Samples that were fitted, whole runs.
    rival : Tried, optional
        Several effects that explain the same without another form: it must not predict better. By
        default one effect that is hysteresis, which must predict worse.
    """
    given = friction_form(base)
    if form is not None or len(PARTS[given]) > 1:
        wanted = form if form is not None and leads_to(given, form) else given
        return ChosenForm(
            fitted := in_form(base, wanted, rows), wanted, {wanted: tried(fitted, rows)}
        )
    plain = tried(base, rows)
    if np.count_nonzero(plain.by_run) < rules.RUNS_LEAST:
        return ChosenForm(base, given, {given: plain})
    found, fits = {given: plain}, {given: base}
    others = [name for name in FORMS if name != given and leads_to(given, name)]
    for name in others:
        within = [found[one] for one in contained(name) if one in found and one != given]
        if len(PARTS[name] - PARTS[given]) > 1 and not any(better(one, plain) for one in within):
            continue  # neither of what it adds helps
        fits[name] = in_form(base, name, rows, fits)
        found[name] = tried(fits[name], rows)
    confirmed = [name for name in others if name in found and better(found[name], plain)]
    if not confirmed:
        return ChosenForm(base, given, found)
    noise = 0.0
    if rows is None:  # what runs that are only predicted hold must not steer the choice
        richest = found[max(found, key=FORMS.index)].base
        columns, _ = make_candidates(richest, effects, ratio, shapes.waves(richest))
        noise = noise_rms(estimate_noise(richest, [c.columns for c in columns]), richest) ** 2
    excess = plain.mean_square - noise
    large = [
        name
        for name in confirmed
        if plain.mean_square - found[name].mean_square >= rules.FORM_EXPLAINS * excess
    ]
    if rival is not None:
        large = [name for name in large if not better(rival, found[name])]
    else:
        rival = hysteresis_effect(base, effects, ratio, rows)
        if rival is not None and better(rival, plain):
            large = [name for name in large if better(found[name], rival)]
    if not large:
        return ChosenForm(base, given, found)
    best = min(large, key=lambda name: found[name].mean_square)
    near = found[best].mean_square + rules.SHAPE_AFTER_NAMED**2 * noise
    name = next(name for name in large if found[name].mean_square <= near)
    return ChosenForm(found[name].base, name, found)


def hysteresis_effect(
    base: BaselineModel,
    effects: Mapping[str, Effect],
    ratio: float,
    rows: npt.NDArray[np.bool_] | None,
) -> Tried | None:
    """Fit the effects that are hysteresis themselves, each from all its starts: the best."""
    best: Tried | None = None
    for effect in effects.values():
        if not effect.is_hysteresis:
            continue
        for start in tangent(effect, base, base.at(), ratio).starts:
            with_effect = base.copy()
            with_effect.terms.append(Term(effect, start.copy(), effect.free()))
            with_effect.fit(rows=rows)
            found = tried(with_effect, rows)
            if best is None or found.mean_square < best.mean_square:
                best = found
    return best


def form_beside(
    base: BaselineModel, found: BaselineModel, effects: Mapping[str, Effect], ratio: float
) -> Friction:
    """Choose the form beside the effects that were found.

    Effects of the torque alone may have stood in for the form: all of them together are its rival.

    Parameters
    ----------
    base : BaselineModel
        With operators of constant width in parallel, as it was fitted before anything was found.
    found : BaselineModel
        With the effects.
    """
    beside = base.copy()
    beside.terms = [term.copy() for term in found.terms if not term.effect.needs <= {"torque_Nm"}]
    beside.fit()
    several = len(found.terms) > len(beside.terms) + 1
    rival = tried(without_deviations(found)) if several else None
    return choose_form(beside, effects, ratio, rival=rival).form
