"""Bounded least squares agrees with SciPy and reaches bounds exactly."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares, lsq_linear

from lostmotion.fit.least_squares import SumLimit, bounded_least_squares, solve_within

FloatArray = npt.NDArray[np.float64]


@settings(deadline=None)
@given(st.integers(0, 10**6))
def test_linear_problems_in_a_box_are_solved_like_scipy(seed: int) -> None:
    random = np.random.default_rng(seed)
    a = random.normal(size=(60, 5))
    b = a @ random.normal(size=5) + random.normal(size=60)
    low, high = np.full(5, -0.5), np.full(5, 0.7)
    found = bounded_least_squares(lambda x: (a @ x - b, a), np.zeros(5), low, high)
    expected = lsq_linear(a, b, bounds=(low, high))
    assert found.cost <= 2 * expected.cost * (1 + 1e-6)
    assert np.all((found.x >= low) & (found.x <= high))


@settings(deadline=None)
@given(st.integers(0, 10**6))
def test_normal_equations_in_a_box_are_solved_like_scipy(seed: int) -> None:
    random = np.random.default_rng(seed)
    a, b = random.normal(size=(20, 4)), 3.0 * random.normal(size=20)
    low, high = -random.random(4), random.random(4)
    found = solve_within(a.T @ a, a.T @ b, low, high)
    expected = lsq_linear(a, b, bounds=(low, high), method="bvls").x
    np.testing.assert_allclose(found, expected, atol=1e-9)
    free = solve_within(a.T @ a, a.T @ b, low - 100, high + 100)
    np.testing.assert_allclose(free, np.linalg.lstsq(a, b, rcond=None)[0], atol=1e-9)


@settings(deadline=None)
@given(st.integers(0, 10**6))
def test_a_limited_sum_satisfies_the_optimality_conditions(seed: int) -> None:
    """The conditions of Karush, Kuhn and Tucker, also with nearly equal columns."""
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 30))
    a = random.normal(size=(count + 5, count))
    if seed % 2:
        a[:, 0] = a[:, 1] * (1.0 + 1e-7)
    normal, right = a.T @ a, a.T @ random.normal(size=count + 5)
    low, high = -random.random(count), random.random(count)
    low[random.random(count) < 0.3] = 0.0
    limit = SumLimit(slice(0, (count + 1) // 2), float(random.random()))
    x = solve_within(normal, right, low, high, limit=limit)
    assert np.all((x >= low) & (x <= high))
    total = x[limit.places].sum()
    assert total <= limit.most + 1e-9
    slope = normal @ x - right
    inside = (x > low + 1e-9) & (x < high - 1e-9)
    mine = inside[limit.places]
    multiplier = -float(np.median(slope[limit.places][mine])) if mine.any() else 0.0
    if total < limit.most - 1e-9:
        multiplier = 0.0
    assert multiplier >= -1e-6
    slope[limit.places] += multiplier
    np.testing.assert_allclose(slope[inside], 0.0, atol=1e-6)
    if mine.any() or total < limit.most - 1e-9:
        assert np.all(slope[x <= low] >= -1e-6)
        assert np.all(slope[x >= high] <= 1e-6)


def test_a_nonlinear_problem_is_solved_like_scipy() -> None:
    t = np.linspace(0, 4, 80)
    y = 2.5 * np.exp(-1.3 * t) + 0.4 + 0.01 * np.sin(37 * t)

    def evaluate(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        e = np.exp(-x[1] * t)
        return x[0] * e + x[2] - y, np.column_stack((e, -x[0] * t * e, np.ones_like(t)))

    low, high = np.array([0, 0, 0.45]), np.array([9.0, 9.0, 9.0])
    found = bounded_least_squares(evaluate, np.array([1.0, 0.1, 1.0]), low, high)
    expected = least_squares(
        lambda x: evaluate(x)[0], [1.0, 0.1, 1.0], jac=lambda x: evaluate(x)[1], bounds=(low, high)
    )
    np.testing.assert_allclose(found.x, expected.x, rtol=1e-4)
    assert found.at_bound.tolist() == [False, False, True]
    assert found.x[2] == 0.45


def test_an_unknown_that_nothing_depends_on_stays_where_it_is() -> None:
    a = np.array([[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]])
    b = np.array([2.0, 4.0, 6.1])
    found = bounded_least_squares(
        lambda x: (a @ x - b, a), np.array([0.0, 0.25]), np.zeros(2), np.ones(2) * 10
    )
    np.testing.assert_allclose(found.x[0], np.dot(a[:, 0], b) / 14, rtol=1e-6)
    assert found.x[1] == 0.25


def test_a_start_outside_the_box_is_brought_in() -> None:
    def evaluate(x: FloatArray) -> tuple[FloatArray, Any]:
        return x - 3.0, np.eye(1)

    found = bounded_least_squares(evaluate, np.array([99.0]), np.zeros(1), np.full(1, 2.0))
    assert found.x[0] == 2.0


def test_samples_that_see_no_unknown_leave_the_start_where_it_is() -> None:
    found = bounded_least_squares(
        lambda x: (np.ones(9), np.zeros((9, 2))), np.array([0.3, 5.0]), np.zeros(2), np.ones(2)
    )
    np.testing.assert_array_equal(found.x, [0.3, 1.0])
    assert found.steps == 1


def test_normal_equations_without_unknowns_have_an_empty_solution() -> None:
    none = np.zeros(0)
    assert solve_within(np.zeros((0, 0)), none, none, none).size == 0
