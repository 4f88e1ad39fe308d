"""A catalogue drive in reduced form keeps the catalogue values and states its assumptions."""

from __future__ import annotations

import csv
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from conftest import DATA
from lostmotion.candidates.tangents import TAKEUP_MOST
from lostmotion.catalogue import PARTS, Catalogue
from lostmotion.drives import parse_drive
from lostmotion.predict import predict
from lostmotion.torsion_curve import run_plays
from lostmotion.units import ARCMIN

with (DATA / "catalogue" / "torsional_stiffness.csv").open() as stream:
    TABLE = [row for row in csv.DictReader(stream) if row["K3_Nm_per_rad"]]


def sheet(row: dict[str, str], **more: float) -> Catalogue:
    names = ("T1_Nm", "T2_Nm", "K1_Nm_per_rad", "K2_Nm_per_rad", "K3_Nm_per_rad")
    return Catalogue(*(float(row[name]) for name in names), **more)


def test_the_table_holds_33_drives() -> None:
    assert len(TABLE) == 33
    assert {row["ratio"] for row in TABLE} == {"30", "50", "80 and up"}


@pytest.mark.parametrize("row", TABLE, ids=lambda row: f"size {row['size']} ratio {row['ratio']}")
def test_the_prediction_has_the_catalogue_angles_at_T1_T2_and_2_T2(row: dict[str, str]) -> None:
    t1, t2 = float(row["T1_Nm"]), float(row["T2_Nm"])
    k1, k2, k3 = (float(row[f"K{i}_Nm_per_rad"]) for i in (1, 2, 3))
    names = ("T1_Nm", "T2_Nm", "K1_Nm_per_rad", "K2_Nm_per_rad", "K3_Nm_per_rad")
    document = {
        "drive": {"ratio": 100, "rated_torque_Nm": 2 * t2},
        "catalogue": {name: float(row[name]) for name in names},
    }
    answer = predict(parse_drive(document), [t1, t2, 2 * t2])
    # The definition under the table: slopes of the mean curve over 0..T1, T1..T2 and above.
    at_t1 = t1 / k1
    at_t2 = at_t1 + (t2 - t1) / k2
    expected = np.array([at_t1, at_t2, at_t2 + t2 / k3]) / ARCMIN
    np.testing.assert_allclose(answer["total_arcmin"], expected, rtol=0.01)
    total = np.sum([answer["parts_arcmin"][part] for part in PARTS], axis=0)
    np.testing.assert_allclose(total, answer["total_arcmin"], rtol=1e-14)


def test_size_32_at_60_Nm_is_what_the_manual_prints() -> None:
    # HFUC-32-100: 29 / 6.7e4 + 31 / 1.1e5 = 7.15e-4 rad; the maker's manual prints 2.5 arcmin.
    row = next(r for r in TABLE if r["size"] == "32" and r["ratio"] == "80 and up")
    angle = float(sheet(row).angle(60.0))
    assert angle == pytest.approx(7.15e-4, abs=0.5e-6)
    assert round(angle / ARCMIN, 1) == 2.5


def test_size_20_has_the_published_reversal_lost_motion(bought: dict[str, Any]) -> None:
    # 2 * 0.04 * 40 / 16000 rad = 0.69 arcmin at 4 % of the rated torque.
    row = next(r for r in TABLE if r["size"] == "20" and r["ratio"] == "80 and up")
    assert sheet(row).reversal_lost_motion(1.6) / ARCMIN == pytest.approx(0.6875, abs=5e-4)


def test_a_gap_is_taken_up_within_the_largest_first_corner_of_the_tables() -> None:
    with (DATA / "catalogue" / "torque_ratings.csv").open() as stream:
        ratings = list(csv.DictReader(stream))
    first_Nm = {(row["size"], row["ratio"]): float(row["T1_Nm"]) for row in TABLE}

    def key(row: dict[str, str]) -> tuple[str, str]:
        return row["size"], row["ratio"] if int(row["ratio"]) < 80 else "80 and up"

    corners = [first_Nm[key(row)] / float(row["rated_2000rpm_Nm"]) for row in ratings]
    assert len(corners) == 32
    assert max(corners) == pytest.approx(TAKEUP_MOST, abs=0.005)
    assert min(corners) == pytest.approx(0.13, abs=0.005)
    assert np.median(corners) == pytest.approx(0.17, abs=0.005)


positive = st.floats(0.1, 1e3)


@given(
    t1=positive, step=positive, k=st.tuples(*[st.floats(1e2, 1e6)] * 3), scale=st.floats(0.001, 5)
)
def test_the_curve_is_odd_monotone_and_the_sum_of_its_parts(
    t1: float, step: float, k: tuple[float, float, float], scale: float
) -> None:
    drive = Catalogue(t1, t1 + step, *k)
    rising = np.linspace(0, scale, 21) * (t1 + step)
    torque = np.concatenate((-rising[:0:-1], rising))
    angle = drive.angle(torque)
    assert drive.angle(0.0) == 0
    np.testing.assert_array_equal(angle, -angle[::-1])
    assert np.all(np.diff(angle) >= 0)
    parts = drive.parts(torque)
    assert tuple(parts) == PARTS
    np.testing.assert_allclose(sum(parts.values()), angle, rtol=1e-12, atol=1e-15)
    if k[0] <= k[1] <= k[2]:
        # Hardening: the excess over the final straight line is clearance, never negative.
        assert np.all(parts["side_clearance"][torque > 0] >= -1e-12 * angle[-1])


def test_the_knots_lie_on_the_curve_and_reach_the_largest_torque() -> None:
    drive = sheet(TABLE[0])
    torque, angle = drive.knots(1e3)
    assert torque[-1] == 1e3
    np.testing.assert_allclose(angle, drive.angle(torque), rtol=1e-15)
    assert np.all(np.diff(torque) > 0)


@pytest.mark.parametrize("hysteresis_arcmin", [0.5, 1.0, 3.0])
def test_the_loop_after_full_swings_is_as_wide_as_the_sheet_states(
    hysteresis_arcmin: float,
) -> None:
    rated = 67.0
    drive = sheet(TABLE[0], hysteresis_rad=hysteresis_arcmin * ARCMIN)
    found = drive.plays(rated)
    assert found is not None
    radius, widening, weight = found
    up = np.linspace(-rated, rated, 201)
    torque = np.concatenate((np.linspace(0, rated, 101), up[::-1], up))
    # The library's operators have fixed half widths here; widen them as the bank does: R + w |T|.
    z = torque[0] + np.zeros(radius.size)
    loss = np.zeros(torque.size)
    for i, t in enumerate(torque):
        width = radius + widening * abs(t)
        z = np.maximum(t - width, np.minimum(t + width, z))
        loss[i] = weight @ (z - t)
    down_zero, up_zero = np.flatnonzero(np.abs(torque) < 1e-9)[1:]
    assert (loss[down_zero] - loss[up_zero]) / ARCMIN == pytest.approx(hysteresis_arcmin, rel=1e-9)
    assert np.all(widening < 1)


def test_no_figure_of_hysteresis_gives_no_plays() -> None:
    assert sheet(TABLE[0]).plays(10.0) is None


def test_what_the_lost_motion_leaves_bounds_the_radial_gap(bought: dict[str, Any]) -> None:
    drive = parse_drive(bought)
    answer = predict(drive, [0.0, 67.0])
    # 1 arcmin / 2 - 0.04 * 67 / 31e3 rad
    expected = 0.5 - 0.04 * 67 / 31e3 / ARCMIN
    assert answer["radial_gap_bound_arcmin"] == pytest.approx(expected)
    assert answer["parts_arcmin"]["radial_gap"] == [0.0, 0.0]
    assert any(f"{expected:.3g} arcmin" in line for line in answer["assumptions"])
    del bought["catalogue"]["lost_motion_arcmin"]
    assert predict(parse_drive(bought), [0.0, 1.0])["radial_gap_bound_arcmin"] is None
    bought["catalogue"]["lost_motion_arcmin"] = 0.1
    assert predict(parse_drive(bought), [0.0, 1.0])["radial_gap_bound_arcmin"] == 0


def test_a_preloaded_drive_is_called_one(bought: dict[str, Any]) -> None:
    bought["catalogue"]["K1_Nm_per_rad"] = 60e3
    answer = predict(parse_drive(bought), [10.0, 20.0])
    assert any("preloaded" in line for line in answer["assumptions"])
    assert answer["parts_arcmin"]["side_clearance"][0] < 0


def test_the_answer_states_that_it_is_an_estimate(bought: dict[str, Any]) -> None:
    text = " ".join(predict(parse_drive(bought), [1.0, 2.0])["assumptions"])
    for word in ("65 %", "34 %", "1 %", "guaranteed", "Tolerances and engaged teeth"):
        assert word in text


def test_plays_keep_to_their_band() -> None:
    torque = np.array([0.0, 3.0, 10.0, 8.0, 4.0, -10.0])
    z = run_plays(np.array([2.0]), torque)[:, 0] + torque
    np.testing.assert_allclose(z, [0, 1, 8, 8, 6, -8])
