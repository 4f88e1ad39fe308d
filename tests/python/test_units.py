"""Units are read from suffixes, by dimension, and never guessed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lostmotion import units


@pytest.mark.parametrize(
    ("value", "source", "target", "expected"),
    [
        (180.0, "deg", "rad", math.pi),
        (1.0, "arcmin", "rad", 2.908882086657216e-4),  # pi / 10800
        (1.0, "arcsec", "rad", 4.84813681109536e-6),  # pi / 648000
        (1.0, "rev", "deg", 360.0),
        (1.0, "mrad", "urad", 1000.0),
        (1500.0, "mNm", "Nm", 1.5),
        (1.0, "kNm", "Ncm", 1e5),
        # Catalogues state both stiffnesses: size 25, 0.92 kgf m/arcmin, 3.1e4 N m/rad.
        (1.0, "kgfm_per_arcmin", "Nm_per_rad", 9.80665 * 10800 / math.pi),
        (12.0, "lbfin", "lbfft", 1.0),
        (1.0, "lbfft", "Nm", 1.3558179483314004),  # NIST SP 811
        (1.0, "h", "min", 60.0),
        (250.0, "us", "ms", 0.25),
        (20.0, "C", "K", 293.15),
        (212.0, "F", "C", 100.0),
        (25.4, "mm", "um", 25400.0),
        (2.0, "kN", "N", 2000.0),
        (1.0, "Nm_per_arcmin", "Nm_per_rad", 10800 / math.pi),
        (1.0, "Nm_per_deg", "Nm_per_rad", 180 / math.pi),
        (1.0, "N_per_um", "N_per_mm", 1000.0),
        (2600.0, "N_per_mm2", "MPa", 2600.0),
        (210.0, "GPa", "MPa", 210e3),
        (1.0, "N_m2", "N_mm2", 1e6),
        (60.0, "rpm", "rad_per_s", 2 * math.pi),
        (1.0, "um_per_C", "um_per_K", 1.0),  # a difference, without the offset of the scale
        (3.0, "per_C", "1_per_K", 3.0),
    ],
)
def test_a_value_converts_between_units_of_one_dimension(
    value: float, source: str, target: str, expected: float
) -> None:
    assert units.convert(value, source, target) == pytest.approx(expected, rel=1e-12)


def test_arrays_convert_as_a_whole() -> None:
    degrees = np.array([0.0, 90.0, -45.0])
    np.testing.assert_allclose(units.convert(degrees, "deg", "rev"), [0, 0.25, -0.125])


@given(
    value=st.floats(-1e6, 1e6),
    pair=st.sampled_from([("arcmin", "rev"), ("C", "F"), ("Nm", "Ncm"), ("mm", "um"), ("h", "ns")]),
)
def test_conversion_there_and_back_gives_the_value(value: float, pair: tuple[str, str]) -> None:
    there = units.convert(value, *pair)
    assert units.convert(there, pair[1], pair[0]) == pytest.approx(value, rel=1e-9, abs=1e-9)


def test_converting_to_the_same_unit_keeps_every_bit() -> None:
    assert units.convert(0.1, "mm", "mm") == 0.1


def test_units_of_different_dimension_do_not_convert() -> None:
    with pytest.raises(ValueError, match=r"Nm is a torque .* mm a length"):
        units.convert(1.0, "Nm", "mm")
    with pytest.raises(KeyError):
        units.convert(1.0, "parsec", "mm")


@pytest.mark.parametrize(
    ("name", "base", "symbol"),
    [
        ("torque_Nm", "torque", "Nm"),
        ("rated_torque_mNm", "rated_torque", "mNm"),
        ("K1_Nm_per_rad", "K1", "Nm_per_rad"),
        ("foundation_N_per_mm2", "foundation", "N_per_mm2"),
        ("lost_motion_arcsec", "lost_motion", "arcsec"),
        ("temperature_C", "temperature", "C"),
    ],
)
def test_the_longest_suffix_that_is_a_unit_is_the_unit(name: str, base: str, symbol: str) -> None:
    found, unit = units.split_unit(name)
    assert unit is not None
    assert (found, unit.symbol) == (base, symbol)


@pytest.mark.parametrize(
    "name", ["torque", "ratio", "flexspline_teeth", "torque_nM", "torque_", "x_per"]
)
def test_a_name_without_a_unit_has_none(name: str) -> None:
    assert units.split_unit(name) == (name, None)


def test_cycles_are_a_count_and_not_an_angle() -> None:
    assert units.parse_unit("cycles") is None


def test_a_unit_has_one_division_at_most() -> None:
    assert units.parse_unit("m_per_s_per_s") is None


@pytest.mark.parametrize(
    ("value", "text"),
    [(50_500.0, "50500"), (1.0685e7, "10700000"), (-2234.0, "-2230"), (12.34, "12.3"), (0.0, "0")],
)
def test_plain_numbers_have_no_power_of_ten(value: float, text: str) -> None:
    assert units.plain_number(value) == text
