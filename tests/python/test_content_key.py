"""A fit from the same start is done once: models are compared by their content."""

from __future__ import annotations

import numpy as np
import pytest
from small_campaigns import RATED_NM, campaign

from lostmotion.content_key import content_key
from lostmotion.discover import library
from lostmotion.effects.conditions import Conditions
from lostmotion.fit import baseline
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.terms import Additive, Term


@pytest.fixture
def base():
    model = BaselineModel(Conditions(campaign(5, 6)), RATED_NM)
    wear = library()["wear"]
    model.terms.append(Term(wear, wear.typical, wear.free()))
    columns = np.linspace(0.0, 1.0, model.conditions.rows)[:, None]
    model.additives.append(Additive("step", columns, np.zeros(1)))
    return model


@pytest.fixture
def searches(monkeypatch):
    """Starts of the searches that were done."""
    starts = []
    search = baseline.bounded_least_squares

    def counted(evaluate, start, *rest, **options):
        starts.append(start)
        return search(evaluate, start, *rest, **options)

    monkeypatch.setattr(baseline, "bounded_least_squares", counted)
    return starts


def test_a_copy_has_the_same_key(base):
    assert base.copy().content_key() == base.content_key()


CHANGES = {
    "slope": lambda m: np.multiply(m.curve.slopes, 1.0 + 1e-15, out=m.curve.slopes),
    "deviation": lambda m: m.deviations.__setitem__((0, 0), 1e-9),
    "measured": lambda m: m.measured.__setitem__(7, 0.0),
    "value of an effect": lambda m: m.terms[0].values.__setitem__(0, 1e-9),
    "estimated values": lambda m: m.terms[0].free.pop(),
    "column of a shape": lambda m: m.additives[0].columns.__setitem__((3, 0), 2.0),
    "form": lambda m: m.hysteresis.allow_outside(),
    "noise of a law between runs": lambda m: setattr(m, "noise_arcsec", 2.0),
    "constraint": lambda m: setattr(m, "rises", True),
}


@pytest.mark.parametrize("what", CHANGES)
def test_whatever_a_fit_depends_on_changes_the_key(base, what):
    before = base.content_key()
    CHANGES[what](base)
    assert base.content_key() != before


def test_a_fit_from_the_same_start_is_done_once(base, searches):
    again = base.copy()
    first = base.fit(steps=5)
    assert len(searches) == 1
    assert again.fit(steps=5) is first
    assert len(searches) == 1
    np.testing.assert_array_equal(again.vector()[0], base.vector()[0])


@pytest.mark.parametrize(
    "options", [{"steps": 6}, {"noise": 2.0}, {"tolerance": 1e-3}, {"rows": 1}]
)
def test_another_fit_is_not_the_same(base, searches, options):
    again = base.copy()
    base.fit(steps=5)
    if "rows" in options:
        options = {"rows": base.conditions.run_of > 0}
    again.fit(**{"steps": 5} | options)
    assert len(searches) == 2


def test_what_cannot_be_compared_is_refused():
    with pytest.raises(TypeError):
        content_key({1, 2})
