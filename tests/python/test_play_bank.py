"""The runtime's friction memory through Python, in both precisions."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lostmotion.core import Bits, Core, core
from lostmotion.errors import LibraryError
from lostmotion.torsion_curve import run_plays
from lostmotion.units import ARCMIN

# Test set S20: size 20, ratio above 50. Torsion curve K1, K2, K3 of the catalogue; half widths in N
# m, their growth r0 / 80, compliances such that the loop of +-40 N m is 1 arcmin wide at zero
# torque.
RADIUS = np.array([0.5, 2.0, 5.0, 10.0])
WIDENING = RADIUS / 80
WEIGHT = 1.5852218e-6 * np.array([1.5, 3.0, 5.0, 6.0])
TORQUES, STIFFNESSES = (7.0, 25.0), (16e3, 25e3, 29e3)


def torsion_curve(torque: npt.NDArray[Any]) -> npt.NDArray[Any]:
    size = np.abs(torque)
    (t1, t2), (k1, k2, k3) = TORQUES, STIFFNESSES
    low, middle = np.minimum(size, t1) / k1, np.clip(size - t1, 0, t2 - t1) / k2
    return np.sign(torque) * (low + middle + np.maximum(size - t2, 0) / k3)


def bank(c: Core) -> Any:
    plays = c.ffi.new("lm_play[]", RADIUS.size)
    for i in range(RADIUS.size):
        plays[i].radius_Nm, plays[i].widening = RADIUS[i], WIDENING[i]
        plays[i].weight = WEIGHT[i]
    built = c.ffi.new("lm_play_bank *")
    fault = c.fault()
    c.check(c.lib.lm_build_play_bank(built, plays, RADIUS.size, RADIUS.size, fault), fault)
    return built


def angle(c: Core, torque: npt.NDArray[Any]) -> npt.NDArray[Any]:
    memory = c.ffi.new("lm_play_memory *")
    t = c.array(torque)
    outside = c.zeros(t.size)
    c.lib.lm_center_plays(memory, 0.0)
    c.lib.lm_run_play_bank(
        bank(c), memory, c.pointer(t), t.size, c.pointer(outside, write=True), c.ffi.NULL
    )
    return torsion_curve(torque) + outside


def swing(steps: int, *ends: float) -> npt.NDArray[Any]:
    legs = [np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(ends)]
    return np.concatenate(([ends[0]], *legs))


@pytest.fixture(params=[64, 32])
def c(request: pytest.FixtureRequest) -> Core:
    bits: Bits = request.param
    return core(bits)


def tolerance(c: Core) -> float:
    """Printed digits in float64; float32 has to be within 0.01 arcmin."""
    return 6e-5 if c.bits == 64 else 1e-3


@pytest.mark.parametrize(("at", "width"), [(0.0, 1.0), (10.0, 1.1250), (30.0, 0.643), (40.0, 0.0)])
def test_S20_loop_widths(c: Core, at: float, width: float) -> None:
    torque = swing(80, 0, 40, -40, 40, -40)
    found = angle(c, torque)
    places = np.flatnonzero(np.isclose(torque, at))
    last_up, last_down = places[-2], places[-1]
    if at == 40.0:
        last_up, last_down = places[0], places[-1]
    difference = (found[last_down] - found[last_up]) / ARCMIN
    assert difference == pytest.approx(width, abs=max(5e-4 if at == 30 else 0, tolerance(c)))


def test_S20_reversal_lost_motion_at_4_percent(c: Core) -> None:
    torque = swing(1000, 0, 40, -40, 40, -40)
    found = angle(c, torque)

    def middle(at: float) -> float:
        places = np.flatnonzero(np.isclose(torque, at, atol=1e-6))
        return float(found[places[-1]] + found[places[-2]]) / 2

    assert (middle(1.6) - middle(-1.6)) / ARCMIN == pytest.approx(0.68755, abs=tolerance(c) / 5)


def test_S20_minor_loop_closes(c: Core) -> None:
    found = angle(c, swing(10, 0, 40, -40, 10, 3, 10))
    assert (found[-1] - found[-21]) / ARCMIN == pytest.approx(0, abs=1e-9 if c.bits == 64 else 1e-6)


def test_S20_does_not_depend_on_the_sampling(c: Core) -> None:
    ends = [
        angle(c, swing(steps, 0, 40, -40, 17, -6, 12))[-1] / ARCMIN for steps in (10, 100, 1000)
    ]
    np.testing.assert_allclose(ends, ends[0], atol=1e-12 if c.bits == 64 else 1e-5)


def test_both_precisions_agree(c: Core) -> None:
    torque = swing(50, 0, 40, -40, 25, -12, 30)
    np.testing.assert_allclose(angle(c, torque), angle(core(64), torque), atol=0.001 * ARCMIN)


def test_a_refused_bank_states_which_input_and_range(c: Core) -> None:
    play = c.ffi.new("lm_play[]", 1)
    play[0].radius_Nm, play[0].widening = 1.0, 1.5
    built = c.ffi.new("lm_play_bank *")
    fault = c.fault()
    with pytest.raises(LibraryError) as caught:
        c.check(c.lib.lm_build_play_bank(built, play, 1, 0, fault), fault)
    error = caught.value
    assert (error.status, error.key, error.found) == (c.lib.LM_OUT_OF_RANGE, "widening", 1.5)
    assert "widening: an input is outside its range (found 1.5" in str(error)
    with pytest.raises(LibraryError, match=r"^a required pointer is null$"):
        c.check(c.lib.LM_NULL)


def test_arrays_go_in_and_out_without_copies(c: Core) -> None:
    values = c.zeros(5)
    c.pointer(values, write=True)[3] = 7.0
    assert values[3] == 7.0
    assert c.array(values) is values
    with pytest.raises(TypeError, match="contiguous"):
        c.pointer(c.zeros(6)[::2])
    with pytest.raises(TypeError, match="float"):
        c.pointer(np.zeros(3, dtype=np.int32))


@given(
    st.lists(st.floats(-50, 50), min_size=1, max_size=40),
    st.floats(0.01, 10),
    st.floats(-1, 1),
)
def test_plays_equal_their_definition(torques: list[float], radius: float, state: float) -> None:
    torque = np.array(torques)
    z = torque[0] + state * radius
    expected = []
    for t in torque:
        z = max(t - radius, min(t + radius, z))
        expected.append(z - t)
    found = run_plays(np.array([radius]), torque, state)[:, 0]
    np.testing.assert_allclose(found, expected, atol=1e-12)


@given(st.lists(st.floats(-40, 40), min_size=1, max_size=20), st.floats(30, 50))
def test_a_larger_swing_wipes_out_the_smaller_ones(before: list[float], peak: float) -> None:
    ends = np.array([50.0, -peak, 20.0])
    with_history = run_plays(RADIUS, np.concatenate((before, ends)))
    without = run_plays(RADIUS, ends)
    np.testing.assert_allclose(with_history[-1], without[-1], atol=1e-12)
