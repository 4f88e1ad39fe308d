"""Leave-one-run-out errors: the estimate from one step compared with a fit without the run."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from small_campaigns import ARCSEC, RATED_NM, RATIO, campaign

from lostmotion.candidates.named import named_candidates
from lostmotion.discover import library
from lostmotion.effects.conditions import Conditions
from lostmotion.fit import held_out
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.held_out import LeftOut, held_out_residual
from lostmotion.fit.terms import Additive, Term

RUNS = 9


def worn_gap(columns, wound):
    """A gap that wear opens, taken up slowly; arc seconds."""
    return 30.0 * (columns["cycles"] / 1e6) ** 0.5 * np.tanh(wound / 8.0)


def worn() -> BaselineModel:
    """A copy of `fitted`."""
    return fitted().copy()


@cache
def fitted() -> BaselineModel:
    """A fitted baseline model with wear in three runs, each with more than the one before."""
    data = campaign(5, RUNS)
    for run, cycles in zip(data.runs, [0.0] * (RUNS - 3) + [2e4, 1e5, 1.5e6], strict=True):
        run.columns["cycles"] = np.full(len(run), cycles)
        opened = worn_gap(run.columns, run.torque_Nm)
        run.columns["lost_motion"] = run.lost_motion_rad + opened * ARCSEC
    base = BaselineModel(Conditions(data), RATED_NM)
    base.first_fit()
    wear = library()["wear"]
    candidates, _ = named_candidates({"wear": wear}, base, base.at(), RATIO)
    values = candidates[0].starts[0].copy()
    base.terms.append(Term(wear, values, [0, 1, 2]))
    base.fit(steps=40)
    return base


def without(base: BaselineModel, run: int) -> float:
    """Error of a run with a converged fit to the others, arc seconds."""
    starts = base.conditions.starts
    at = slice(int(starts[run]), int(starts[run + 1]))
    rows = np.ones(base.conditions.rows, dtype=bool)
    rows[at] = False
    other = base.copy()
    other.fit(steps=60, rows=rows, tolerance=1e-9)
    rest = base.measured[at] - other.at().angle[at]
    return float(np.std(rest))


def by_run(residual, base: BaselineModel) -> np.ndarray:
    """Error of every run, arc seconds."""
    starts = base.conditions.starts
    return np.array([np.std(residual[a:b]) for a, b in pairwise(starts)])


def test_the_error_of_every_run_is_that_of_a_fit_without_it():
    base = worn()
    found = by_run(held_out_residual(base), base)
    fitted = by_run(base.residual(), base)
    wanted = np.array([without(base, run) for run in range(RUNS)])
    assert wanted.max() > 1.3 * fitted[wanted.argmax()]  # the most worn run is extrapolated
    assert found == pytest.approx(wanted, rel=0.1)


def test_a_step_alone_misleads_where_a_run_is_extrapolated(monkeypatch):
    base = worn()
    truth = by_run(held_out_residual(base), base)
    monkeypatch.setattr(held_out, "DOUBTFUL", np.inf)
    step = by_run(held_out_residual(base), base)
    most_worn = RUNS - 1
    assert step[most_worn] < 0.9 * truth[most_worn]
    assert step[:most_worn] == pytest.approx(truth[:most_worn], rel=0.1)


def test_a_run_with_an_event_that_no_other_has_is_predicted():
    base = worn()
    before = by_run(held_out_residual(base), base)
    start, end = base.conditions.starts[3:5]
    step = np.zeros((base.conditions.rows, 1))
    step[(start + end) // 2 : end] = 1.0
    base.measured = base.measured + 40.0 * step[:, 0]
    base.additives.append(Additive("step", step, np.full(1, 39.0)))  # the fit has not converged
    found = by_run(held_out_residual(base, refits=False), base)
    assert found[3] < 1.5 * before[3] + 1.0


def test_equal_groups_are_left_out_once(monkeypatch):
    left, asked = LeftOut(worn()), []
    alone = LeftOut.residual

    def residual(self, group, refits):
        asked.append(list(group))
        return alone(self, group, refits)

    monkeypatch.setattr(LeftOut, "residual", residual)
    first, other, again = left.residuals([[0], np.array([1, 2]), [0]], refits=False)
    assert sorted(asked) == [[0], [1, 2]]
    assert again is first
    assert len(other) == 2
