"""An effect that is in the model: its evidence, its places among the columns, and its size."""

from __future__ import annotations

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.discover.contest_round import Projector
from lostmotion.discover.linearise import Settled, columns_of
from lostmotion.evidence.contest import Contest, Result
from lostmotion.evidence.gram import gather
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.terms import Additive, Term


def contest_of_term(settled: Settled, place: int) -> tuple[Contest, str]:
    """Evidence for a term in the model, linearised at that model.

    The contribution of the term is added back to the residual. The block of its name has the
    columns of its estimated values that scale it, the contribution in place of the one that scales
    it most. The others are fixed: without the term they have no meaning, so their columns would
    cost the test degrees of freedom of the runs and be no evidence for it.
    """
    base = settled.base
    point = base.at()
    fixed, precision, scatter, response = columns_of(base, point)
    name, own = base.terms[place].effect.name, term_places(base, place)
    done = term_angle(base, place)
    response = response + done
    term = base.terms[place]
    carries = [k for k, i in enumerate(term.free) if i in term.effect.scaling()]
    block = fixed[:, own[carries]]
    share = np.linalg.norm(block, axis=0) * np.abs(term.values[[term.free[k] for k in carries]])
    if np.any(share > 0.0):
        block[:, np.argmax(share)] = done
    else:
        block = done[:, None]
    evidence = gather(
        np.delete(fixed, own, axis=1),
        np.delete(precision, own),
        scatter,
        [(name, block)],
        response - float(np.mean(response)),
        settled.noise,
        base.conditions.starts,
    )
    return Contest(evidence), name


def term_places(base: BaselineModel, place: int) -> IntArray:
    """Places of a term's free values among the fixed columns."""
    places = base.term_places(base.terms[place])
    return np.arange(places.start, places.stop)


def term_angle(base: BaselineModel, place: int) -> FloatArray:
    """Contribution of a term: what the model lacks without it, arc seconds.

    The derivative by a value that enters nonlinearly, times the value, would be something else: a
    lag smooths the noise of the torque that its derivative has.
    """
    without = base.copy()
    del without.terms[place]
    return base.angle() - without.angle()


def term_size(base: BaselineModel, place: int) -> float:
    """Root mean square, arc seconds, of what the rest of the model cannot absorb of a term.

    As far as it scales with its values (Euler): the rest of the model was fitted with the term, and
    cannot absorb all of what a step of the load to nothing would do to its kinks.
    """
    term, own = base.terms[place], term_places(base, place)
    fixed = base.fixed_columns(base.at())
    scaling = term.effect.scaling()
    carries = [k for k, i in enumerate(term.free) if i in scaling]
    columns = fixed[:, own[carries]]
    angle = columns @ term.values[[term.free[k] for k in carries]]
    rest = Projector(np.delete(fixed, own, axis=1))
    return rest.size(angle if term.free else term_angle(base, place))


def beyond_form(base: BaselineModel, added: Term | Additive) -> float:
    """Share of what an effect or a shape contributes that no other form of the hysteresis follows.

    Of its mean square beside the rest of the model, linearised without it: beside columns that have
    an effect on the compliance in them, the effect itself would be the difference of two forms.
    """
    without = base.copy()
    without.terms = [
        own for own, term in zip(without.terms, base.terms, strict=True) if term is not added
    ]
    without.additives = [
        own for own, one in zip(without.additives, base.additives, strict=True) if one is not added
    ]
    angle = base.angle() - without.angle()
    others = Projector(without.fixed_columns(without.at()))
    rest, beyond = others.size(angle), others.size_beyond(base.form_basis, angle)
    return (beyond / rest) ** 2 if rest > 0.0 else 1.0


def term_tested(settled: Settled, place: int) -> Result | None:
    """Result of the tests of a term with the others present; None if they are not finite."""
    contest, name = contest_of_term(settled, place)
    try:
        return contest.test(name)
    except np.linalg.LinAlgError:
        return None
