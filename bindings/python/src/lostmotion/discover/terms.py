"""An effect that is in the model: its evidence, its places among the columns, and its size."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from lostmotion.discover.contest_round import Projector
from lostmotion.discover.gates import accepted
from lostmotion.discover.linearise import Settled, columns_of
from lostmotion.evidence.contest import Contest
from lostmotion.evidence.gram import gather
from lostmotion.fit.baseline import BaselineModel

FloatArray = npt.NDArray[np.float64]


def contest_of_term(settled: Settled, place: int) -> tuple[Contest, str]:
    """Evidence for a term in the model, linearised at that model.

    The contribution of the term is added back to the residual; the block of its name has its
    estimated values, or its whole contribution if it has none.
    """
    base = settled.base
    point = base.at()
    fixed, precision, scatter, response = columns_of(base, point)
    name, own = base.terms[place].effect.name, term_places(base, place)
    done = term_angle(base, place, fixed)
    response = response + done
    evidence = gather(
        np.delete(fixed, own, axis=1),
        np.delete(precision, own),
        scatter,
        [(name, fixed[:, own] if own.size else done[:, None])],
        response - float(np.mean(response)),
        settled.noise,
        base.conditions.starts,
    )
    return Contest(evidence), name


def term_places(base: BaselineModel, place: int) -> npt.NDArray[np.intp]:
    """Places of a term's free values among the fixed columns."""
    places = base.term_places(base.terms[place])
    return np.arange(places.start, places.stop)


def term_angle(base: BaselineModel, place: int, fixed: FloatArray) -> FloatArray:
    """Contribution of a term, arc seconds, as far as it scales with its values (Euler).

    A term without estimated values, such as slipped teeth, contributes what the model lacks without
    it.
    """
    term = base.terms[place]
    if not term.free:
        without = base.copy()
        del without.terms[place]
        return base.angle() - without.angle()
    scaling = term.effect.scaling()
    carries = [k for k, i in enumerate(term.free) if i in scaling]
    columns = fixed[:, term_places(base, place)[carries]]
    return np.asarray(columns @ term.values[[term.free[k] for k in carries]])


def term_size(base: BaselineModel, place: int) -> float:
    """Root mean square, arc seconds, of what the rest of the model cannot absorb of a term."""
    fixed = base.fixed_columns(base.at())
    rest = Projector(np.delete(fixed, term_places(base, place), axis=1))
    return rest.size(term_angle(base, place, fixed))


def term_passes(settled: Settled, place: int, count: int) -> bool:
    """Whether a term of a model passes the tests with the others present."""
    contest, name = contest_of_term(settled, place)
    try:
        result = contest.test(name)
    except np.linalg.LinAlgError:
        return False
    return result is not None and accepted(result, count)
