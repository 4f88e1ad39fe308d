"""Format of numbers, units and names on pages."""

from __future__ import annotations

import pytest

from lostmotion.effects.library import library
from lostmotion.report.svg import signs
from lostmotion.report.wording import (
    chance,
    named_numbers,
    quantity,
    unit_text,
    with_signs,
    with_zeros,
    words,
    written,
)
from lostmotion.terminal import fixed
from lostmotion.units import ARCSEC, split_unit


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (0.74, "0.74"),
        (-60.04, "−60"),
        (1853.2, "1850"),
        (28035.0, "28\u202f000"),
        (3e5, "300\u202f000"),
        (1.9e6, "1.9·10⁶"),
        (999_999.9, "1·10⁶"),
        (4.161e-6, "4.16·10⁻⁶"),
        (-8.3e-4, "−8.3·10⁻⁴"),
        (0.00145, "0.00145"),
    ],
)
def test_a_number_is_written_with_three_digits_and_without_an_e(value: float, text: str) -> None:
    assert written(value) == text


@pytest.mark.parametrize(
    ("symbol", "text"),
    [
        ("", ""),
        ("Nm", "N·m"),
        ("rad_per_Nm", "rad/(N·m)"),
        ("arcsec_per_K", "arcsec/K"),
        ("per_K", "1/K"),
        ("kg_m2", "kg·m²"),
        ("Nm_s", "N·m·s"),
        ("rad_s", "rad/s"),
    ],
)
def test_a_unit_is_written_with_its_signs(symbol: str, text: str) -> None:
    assert unit_text(symbol) == text


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("gap_rad_per_K", 4.161e-6, "gap 0.858 arcsec/K"),
        ("runout_sine_rad", -600 * ARCSEC, "run-out sine −10 arcmin"),
        ("gap_rad", 0.5, "gap 28.6 deg"),
        ("takeup_Nm", 1.108, "take-up 1.11 N·m"),
        ("stribeck_rad_s", 1.798, "Stribeck speed of the input 1.8 rad/s"),
        ("blend_rad_s", 0.1, "blending speed of the input 0.1 rad/s"),
        ("share", -0.02, "share −0.02"),
        ("slope_1_rad_per_Nm", 4e-4, "slope 1 82.5 arcsec/(N·m)"),
        ("rate_1_per_s", 2.0, "rate 2 1/s"),
    ],
)
def test_a_value_of_an_effect_is_written_in_a_unit_of_its_size(
    name: str, value: float, text: str
) -> None:
    assert quantity(name, value) == text


def test_a_value_at_its_bound_is_reported() -> None:
    values = {"gap_rad_per_K": 4.161e-6, "gap_rad": 0.05, "takeup_Nm": 0.0, "cosine_rad": 0.0}
    assert named_numbers(values, ["gap_rad", "takeup_Nm"]) == [
        "gap 0.858 arcsec/K",
        "gap 172 arcmin (at its bound)",
        "take-up 0 N·m (at its bound)",
    ]


def test_people_keep_their_capital() -> None:
    assert words("stribeck_friction") == "Stribeck friction"


def test_no_value_of_the_library_shows_its_key() -> None:
    for own in library().values():
        for value in own.values:
            text = quantity(value.name, value.typical)
            assert "_" not in text
            assert split_unit(value.name)[1] is None or len(text.split()) >= 3, text


def test_chance_and_signs_write_no_nothing() -> None:
    assert (chance(0.0), chance(0.0009), chance(0.023)) == ("p < 0.001", "p < 0.001", "p 0.023")
    assert signs("-0.0 nats, +0.00 and -0.4 to +0.1") == "0.0 nats, 0.00 and −0.4 to +0.1"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.5, "1.50"),
        (0.9996, "1.00"),
        (31.12, "31.1"),
        (2498.44, "2500"),
        (18_730.0, "18\u202f700"),
        (1.87e6, "1.87·10⁶"),
        (-0.05, "−0.0500"),
        (0.0, "0"),
    ],
)
def test_numbers_beside_each_other_have_the_same_digits_and_no_e(value: float, text: str) -> None:
    assert with_zeros(value) == text


def test_newton_metres_in_a_sentence_have_their_sign() -> None:
    assert with_signs("ripple of 11 Nm, column torque_Nm") == "ripple of 11 N·m, column torque_Nm"


@pytest.mark.parametrize(
    ("value", "text"),
    [(-0.0001, "0.000"), (-0.0005001, "-0.001"), (12.34567, "12.346"), (None, "-")],
)
def test_a_number_that_is_nothing_in_its_digits_has_no_sign(value: float | None, text: str) -> None:
    assert fixed(value) == text
