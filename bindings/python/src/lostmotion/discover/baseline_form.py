"""The form of the baseline model, chosen before anything is named.

Every form of the hysteresis (`lostmotion.friction`) is cross-validated by runs; a combination of
forms is tried if one of its parts lowers the error. Fewer than `sign_flips.runs_least` runs are
cross-validated by half cycles of the torque: how friction grows with the load shows in each of
them. Whether it is in parallel or in series with the spring does not: a series operator moves the
angle as one in parallel does where the torsion curve has one slope, and only loops of several sizes
separate them. Half cycles therefore decide only whether friction grows with the load. A richer form
than operators of constant width in parallel with the spring is selected if

- these pieces confirm it (`gates.runs_separate`, of their errors under fits to the others): with
fewer than `sign_flips.runs_least` pieces no form is tried;
- it explains at least `rules.FORM_EXPLAINS` of what the odd functions of the torque's history can
(`FormBasis.preisach`), beside all effects that no form can imitate. A form that explains less may
imitate a missing effect and is left to the contest;
- no hysteresis effect of the library is as good in addition to constant width: up to
`rules.SIZE_LEAST` of the noise the one with fewer values is preferred; few runs do not identify
such an effect.

Of these forms, the one with the fewest values is selected that no other beats by
`rules.SIZE_LEAST` of the noise. Effects that may be missing hide which form is better: the form is
chosen again with the effects found in the model (`form_beside`). `diagnose` keeps
constant width with few runs: they name no effect, and their evidence is merged in one form.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from lostmotion import rules
from lostmotion.arrays import BoolArray, FloatArray, IntArray
from lostmotion.candidates import shapes
from lostmotion.candidates.named import tangent
from lostmotion.discover.contest_round import make_candidates
from lostmotion.discover.gates import is_of_form, runs_separate
from lostmotion.discover.linearise import Settled, noise_rms
from lostmotion.discover.measurement_noise import LargestModel
from lostmotion.discover.refits import without_deviations
from lostmotion.discover.terms import beyond_form
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.effect import Effect
from lostmotion.evidence.sign_flips import runs_least
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.forms import friction_form, in_form, leads_to
from lostmotion.fit.held_out import held_out_residual
from lostmotion.fit.terms import Term
from lostmotion.friction import FORMS, PARTS, Friction, contained

FAR = 0.25
"""Share of the largest torque of a run that is far from zero: above its noise, below its smallest
loop. On the printed reducer of `tests/data` shares of 0.05 to 0.5 give the same half cycles."""


@dataclass
class Tried:
    """A form with its fit.

    Attributes
    ----------
    by_piece : ndarray
        Sum of squares of each piece under a fit to the others, over the rows of all.
    """

    base: BaselineModel
    heldout: FloatArray
    by_piece: FloatArray

    @property
    def mean_square(self) -> float:
        """Cross-validated mean square, arc seconds squared."""
        return float(self.by_piece.sum())


@dataclass
class ChosenForm:
    """The chosen form, and the errors of the others."""

    base: BaselineModel
    form: Friction
    tried: dict[Friction, Tried]


def tried(
    base: BaselineModel,
    rows: BoolArray | None = None,
    starts: IntArray | None = None,
    refits: bool = False,
) -> Tried:
    """Predict every piece by a fit to the others.

    Parameters
    ----------
    rows : ndarray of bool, optional
        Samples that were fitted; runs outside are predicted and not used for the choice.
    starts : ndarray, optional
        Offsets of the pieces; by default `piece_starts`.
    refits : bool
        See `held_out_residual`; forms are compared without refits.
    """
    c = base.conditions
    judged = np.ones(c.rows, dtype=bool) if rows is None else rows
    starts = piece_starts(c, judged) if starts is None else starts
    few = starts.size < 3
    heldout = base.residual() if few else held_out_residual(base, starts, rows, refits=refits)
    heldout[~judged] = base.residual()[~judged]
    squares = np.where(judged, heldout**2, 0.0) / np.count_nonzero(judged)
    return Tried(base, heldout, np.add.reduceat(squares, starts[:-1]))


def piece_starts(c: Conditions, judged: BoolArray) -> IntArray:
    """Offsets of the pieces: runs, or their half cycles if few runs are judged."""
    runs = int(np.count_nonzero(np.logical_or.reduceat(judged, c.starts[:-1])))
    if runs >= runs_least():
        return c.starts
    cuts = [at.start + half_cycles(c.torque[at]) for at in c.slices()]
    return np.sort(np.concatenate((c.starts, *cuts)))


def half_cycles(torque: FloatArray) -> IntArray:
    """Samples of one run at which the torque changes its sign.

    Sign changes between torques of less than `FAR` of the largest do not count: they may be noise.
    """
    far = np.flatnonzero(np.abs(torque) >= FAR * np.max(np.abs(torque)))
    changes = np.flatnonzero(np.diff(np.sign(torque[far])))
    cuts = [
        a + int(np.argmin(np.abs(torque[a:b])))
        for a, b in zip(far[changes] + 1, far[changes + 1] + 1, strict=True)
    ]
    return np.array(cuts, dtype=np.intp)


def better(one: Tried, other: Tried) -> bool:
    """Whether the pieces show that the first predicts significantly better than the second."""
    seen = other.by_piece > 0
    return runs_separate(other.by_piece[seen], one.by_piece[seen])


def clearly_better(one: Tried, other: Tried, noise_arcsec: float) -> bool:
    """Whether it also predicts better by at least the least size of an effect."""
    fall = other.mean_square - one.mean_square
    return better(one, other) and fall >= (rules.SIZE_LEAST * noise_arcsec) ** 2


def preferred(form: Tried, effect: Tried, noise_arcsec: float) -> bool:
    """Whether a form is preferred to an effect that explains the same.

    If they are equally good, the one with fewer values is.
    """
    if form.base.vector()[0].size <= effect.base.vector()[0].size:
        return not clearly_better(effect, form, noise_arcsec)
    return clearly_better(form, effect, noise_arcsec)


def choose_form(
    base: BaselineModel,
    effects: Mapping[str, Effect],
    ratio: float,
    *,
    form: Friction | None = None,
    rows: BoolArray | None = None,
    rival: Callable[[], Tried] | None = None,
    known: Mapping[Friction, Tried] | None = None,
) -> ChosenForm:
    """Choose the form of a fitted model's hysteresis.

    Parameters
    ----------
    base : BaselineModel
        Fitted. A model with more than friction in parallel or in series alone (from a fitted drive
        file) keeps its form.
    effects : mapping
        That may be missing.
    ratio : float
        Of the drive.
    form : str, optional
        Form to be used regardless of the runs.
    rows : ndarray of bool, optional
        Samples that were fitted, whole runs.
    rival : callable, optional
        Tries several effects that explain the same without another form; they must not predict
        better. By default one hysteresis effect, which must predict worse.
    known : mapping, optional
        Forms that were tried for this model before.
    """
    given = friction_form(base)
    known = known or {}
    if form is not None or len(PARTS[given]) > 1:
        wanted = form if form is not None and leads_to(given, form) else given
        return ChosenForm(
            fitted := in_form(base, wanted, rows), wanted, {wanted: tried(fitted, rows)}
        )
    plain = known.get(given) or tried(base, rows)
    if np.count_nonzero(plain.by_piece) < runs_least():
        return ChosenForm(base, given, {given: plain})
    found, fits = {given: plain}, {given: base}
    others = [name for name in FORMS if name != given and leads_to(given, name)]
    by_half_cycles = plain.by_piece.size > base.conditions.runs
    if by_half_cycles:
        others = [name for name in others if PARTS[name] - PARTS[given] == {"load"}]
    for name in others:
        within = [found[one] for one in contained(name) if one in found and one != given]
        if len(PARTS[name] - PARTS[given]) > 1 and not any(better(one, plain) for one in within):
            continue  # neither of the added parts helps
        found[name] = known.get(name) or tried(in_form(base, name, rows, fits), rows)
        fits[name] = found[name].base
    confirmed = [name for name in others if name in found and better(found[name], plain)]
    if not confirmed:
        return ChosenForm(base, given, found)
    noise, explainable = 0.0, plain.mean_square
    if rows is None:  # runs that are only predicted must not influence the choice
        candidates, _ = make_candidates(base, effects, ratio, shapes.waves(base))
        columns = [one.columns for one in candidates]
        largest = LargestModel.of(base, [*columns, base.form_basis.preisach()])
        noise = noise_rms(largest.noise(), base)
        apart = [n for n, one in enumerate(candidates) if not one.may_be_form]
        explainable = largest.followed_by_last(apart)
    large = [
        name
        for name in confirmed
        if plain.mean_square - found[name].mean_square >= rules.FORM_EXPLAINS * explainable
    ]
    if large and rival is not None:
        several = rival()
        large = [name for name in large if not better(several, found[name])]
    elif large and not by_half_cycles:
        single = hysteresis_effect(base, effects, ratio, rows)
        if single is not None and better(single, plain):
            large = [name for name in large if preferred(found[name], single, noise)]
    if not large:
        return ChosenForm(base, given, found)
    best = min(large, key=lambda name: found[name].mean_square)
    near = found[best].mean_square + rules.SIZE_LEAST**2 * noise**2
    name = next(name for name in large if found[name].mean_square <= near)
    return ChosenForm(found[name].base, name, found)


def hysteresis_effect(
    base: BaselineModel,
    effects: Mapping[str, Effect],
    ratio: float,
    rows: BoolArray | None,
) -> Tried | None:
    """Fit the hysteresis effects, each from all its starts; returns the best."""
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
    base: BaselineModel,
    found: BaselineModel,
    effects: Mapping[str, Effect],
    ratio: float,
    known: Mapping[Friction, Tried],
) -> Friction:
    """Choose the form with the effects found in the model.

    Effects that depend on the torque alone, or on its history as another form would, may have
    imitated the form: a model with them is its rival, if it is not a single hysteresis effect.

    Parameters
    ----------
    base : BaselineModel
        With operators of constant width in parallel, as fitted before any effect was found.
    found : BaselineModel
        With the effects.
    known : mapping
        Forms that were tried for the baseline model.
    """
    beside = base.copy()
    imitates = [may_imitate_form(found, term) for term in found.terms]
    beside.terms = [term.copy() for term, out in zip(found.terms, imitates, strict=True) if not out]
    beside.fit()
    same = not beside.terms and not base.terms
    same = same and np.array_equal(beside.vector()[0], base.vector()[0])
    imitators = [term.effect for term, out in zip(found.terms, imitates, strict=True) if out]
    alone = not imitators or (len(imitators) == 1 and imitators[0].is_hysteresis)
    rival = None if alone else partial(tried_in_form_of, base, found)
    return choose_form(beside, effects, ratio, rival=rival, known=known if same else None).form


def tried_in_form_of(base: BaselineModel, found: BaselineModel) -> Tried:
    """Try the effects of a model without another form than that of a baseline model."""
    if friction_form(found) == friction_form(base):
        return tried(without_deviations(found))
    plain = base.copy()
    plain.terms = [term.copy() for term in found.terms]
    plain.fit()
    return tried(plain)


def may_imitate_form(found: BaselineModel, term: Term) -> bool:
    """Whether an effect of a model does with this plan what another form of hysteresis may do."""
    if not term.effect.turns_with_torque(found.conditions):
        return False
    return term.effect.needs <= {"torque_Nm"} or is_of_form(beyond_form(found, term))


def better_than_forms(with_effect: Settled, ratio: float) -> bool:
    """Whether no form predicts left-out runs better than the last effect of a model does.

    The forms are those of the hysteresis of the same model without the effect. As in `choose_form`,
    one must be `preferred`, and a hysteresis effect is fitted from all its starts: otherwise an
    effect might lose here to a form that loses there to it.
    """
    longer = with_effect.alike.copy()
    longer.fit()  # as long as the forms
    own = tried(longer)
    plain = with_effect.base.copy()
    effect = plain.terms.pop().effect
    plain = without_deviations(plain)
    started = hysteresis_effect(plain, {effect.name: effect}, ratio, None)
    if started is not None and started.mean_square < own.mean_square:
        own = started
    given, noise = friction_form(plain), noise_rms(with_effect.noise, plain)
    fits = {given: plain}
    for form in FORMS:
        if form != given and leads_to(given, form):
            fits[form] = in_form(fits[given], form, known=fits)
            if preferred(tried(fits[form]), own, noise):
                return False
    return True
