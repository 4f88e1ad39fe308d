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
    """Evidence for a term that is in the model, linearised where the model with it stands.

    What the term does is put back into the residual; its free values are the block of that name, or
    all that it does where it has none.
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
    """What a term adds to the model, arc seconds, as far as it scales with its values (Euler).

    One without free values, as a tooth that has slipped, adds what the model lacks without it.
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
    """Root mean square, arc seconds, of what the rest of the model leaves of a term."""
    fixed = base.fixed_columns(base.at())
    rest = Projector(np.delete(fixed, term_places(base, place), axis=1))
    return rest.size(term_angle(base, place, fixed))


def term_passes(settled: Settled, place: int, count: int) -> bool:
    """Whether a term of a model passes the gates beside the others."""
    contest, name = contest_of_term(settled, place)
    try:
        result = contest.test(name)
    except np.linalg.LinAlgError:
        return False
    return result is not None and accepted(result, count)
