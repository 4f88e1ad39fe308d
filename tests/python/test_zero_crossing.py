"""The zero between two places is that of SciPy, to the accuracy of the last step."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from lostmotion.zero_crossing import zero_between


@given(st.floats(1e-3, 12.0))
def test_the_zero_is_that_of_brent(value: float) -> None:
    def missing(angle: float) -> float:
        return math.tan(angle) - angle - value

    expected = brentq(missing, 0.0, 1.5, xtol=1e-14)
    assert zero_between(missing, 0.0, 1.5, 1e-14) == pytest.approx(expected, abs=1e-13)


def test_an_end_may_be_the_zero() -> None:
    assert zero_between(lambda x: x - 2.0, 1.0, 2.0, 1e-12) == 2.0
    assert zero_between(lambda x: x - 1.0, 1.0, 2.0, 1e-12) == 1.0


def test_equal_signs_are_refused() -> None:
    with pytest.raises(ValueError, match="no change of sign"):
        zero_between(lambda x: x, 1.0, 2.0, 1e-12)
