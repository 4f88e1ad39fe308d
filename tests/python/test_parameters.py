"""A parameter of the baseline model is one block: all other code iterates over the blocks."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from small_campaigns import ARCSEC, RATED_NM, campaign

from lostmotion.discover.linearise import settle
from lostmotion.discover.measurement_noise import estimate_noise
from lostmotion.discover.stepwise_fit import table_of
from lostmotion.effects.conditions import Conditions
from lostmotion.fit.baseline import FILED, BaselineModel
from lostmotion.fit.held_out import held_out_rms
from lostmotion.fit.parameters import Block, Filed, Prior

LEAN = 3.0
"""Asymmetry of the recordings under load, arc seconds."""


class Leaning(BaselineModel):
    """The baseline model with one more scalar: an asymmetry that does not change its sign."""

    lean_arcsec = 0.0

    def shape(self) -> Any:
        """Shape of the asymmetry."""
        return np.abs(np.tanh(self.conditions.torque / RATED_NM))

    def blocks(self) -> list[Block]:
        """One more block than the baseline model."""

        def fill(_: Any, out: Any) -> None:
            out[:, 0] = self.shape()

        return [
            *super().blocks(),
            Block(
                ["lean"],
                np.array([self.lean_arcsec]),
                np.array([-50.0]),
                np.array([50.0]),
                np.array([1e-4]),
                lambda values: setattr(self, "lean_arcsec", float(values[0])),
                fill,
                Prior(np.arange(1), np.zeros(1), np.array([100.0])),
                filed=Filed("lean_arcsec", "lean_rad", "lean_rad", ARCSEC),
            ),
        ]

    def angles(self, *arguments: Any) -> Any:
        """The angles of the baseline model plus the asymmetry."""
        elastic, angle = super().angles(*arguments)
        return elastic, angle + self.lean_arcsec * self.shape()


def leaning(columns: Any, _: Any) -> Any:
    return LEAN * np.abs(np.tanh(columns["torque"] / RATED_NM))


@pytest.fixture(scope="module")
def fitted() -> Leaning:
    model = Leaning(Conditions(campaign(add=leaning, warm=False)), RATED_NM)
    model.first_fit()
    return model


def test_a_scalar_more_is_fitted_and_named(fitted: Leaning) -> None:
    assert fitted.lean_arcsec == pytest.approx(LEAN, abs=0.3)
    assert fitted.names()[-1] == "lean"
    x, low, high = fitted.vector()
    assert x.size == low.size == high.size == len(fitted.names()) == fitted.precision().size


def test_a_scalar_more_lowers_the_error_on_unseen_runs(fitted: Leaning) -> None:
    plain = BaselineModel(fitted.conditions, RATED_NM)
    plain.first_fit()
    assert held_out_rms(fitted) < 0.95 * held_out_rms(plain)


def test_a_scalar_more_has_an_error_and_a_key_in_the_fitted_file(fitted: Leaning) -> None:
    noise = estimate_noise(fitted, [])
    table = table_of(fitted, settle(fitted, noise))
    names, values, covariance = table.names, table.values, table.covariance
    place = names.index("lean_rad")
    assert values[place] == fitted.lean_arcsec * ARCSEC
    error = np.sqrt(covariance[place, place]) / ARCSEC
    assert 0 < error < 0.5
    assert abs(fitted.lean_arcsec - LEAN) < 4 * error


def test_derivatives_are_those_of_the_model_and_leave_it_as_it_is(fitted: Leaning) -> None:
    before = fitted.vector()[0]
    columns = fitted.fixed_columns(fitted.at())
    np.testing.assert_array_equal(fitted.vector()[0], before)
    for place, name in enumerate(fitted.names()):
        if name in ("lean", "slope_3", "slope_20"):
            step = 1e-3 * np.eye(before.size)[place]
            high, low = fitted.copy(), fitted.copy()
            high.set_vector(before + step)
            low.set_vector(before - step)
            change = (high.angle() - low.angle()) / 2e-3
            np.testing.assert_allclose(columns[:, place], change, atol=1e-6 * np.abs(change).max())


def test_what_a_file_keeps_is_what_the_model_has(fitted: Leaning) -> None:
    assert len({filed.key for filed in FILED}) == len({filed.answer for filed in FILED})
    kept = {key for block in fitted.blocks() for key in block.file_keys}
    grid = {key for filed in FILED for key in filed.keys(filed.of(fitted).size)}
    assert {key for key in kept if key != "lean_rad"} <= grid
    assert "start_0" not in kept


def test_a_block_takes_over_what_it_is_given(fitted: Leaning) -> None:
    other = fitted.copy()
    change = partial(np.multiply, 0.5)
    other.set_vector(change(fitted.vector()[0]))
    assert other.lean_arcsec == 0.5 * fitted.lean_arcsec
    np.testing.assert_array_equal(other.curve.slopes, 0.5 * fitted.curve.slopes)
