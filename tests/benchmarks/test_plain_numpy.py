"""The plain NumPy evaluation equals that of the library, at the same accuracy."""

from __future__ import annotations

import dataclasses

import numpy as np
import plain_numpy as pn
import pytest
import tuned_numpy as tn
from same_drive import library_drive, plain_design, read_design, tuned_design

from lostmotion import structs
from lostmotion.core import core
from lostmotion.model import DesignModel
from lostmotion.structs import Design

ARCMIN = np.pi / 10800
CORE = core(64)

# Straight lines between 400 radii and 2001 points of the neutral line: below 2e-5 arcmin.
GAP_TOLERANCE = 2e-5 * ARCMIN
# The library reads the compliance of a tooth from five radii, about 1 % of the angle to 1 %.
ANGLE_TOLERANCE = 2e-4 * ARCMIN


def design_of(name: str, **changes: float) -> Design:
    """Give a design with some values of the library's struct replaced."""
    design = read_design(name)
    values = dict(design.values)
    for path, value in changes.items():
        path = path.replace("__", ".")
        values[path] = dataclasses.replace(values[path], value=value)
    return dataclasses.replace(design, values=values)


CASES = {
    "discs": design_of("reference_a"),
    "cosine": design_of("reference_a", generator__type="cosine"),
    "rollers": design_of("reference_a", generator__type="rollers"),
    "free play": design_of("reference_a", teeth__rigid_shift=3.05),
    "preloaded": design_of("reference_a", teeth__rigid_shift=2.9),
    "external": design_of("external_ring"),
}


@pytest.mark.parametrize("name", CASES)
def test_plain_numpy_agrees_with_the_library(name):
    design = CASES[name]
    model = DesignModel(design)
    plain = plain_design(structs.make_drive(design), CORE)
    torque = np.linspace(-80.0, 80.0, 9)
    found = pn.evaluate(plain, torque)

    pitch = 2 * np.pi / plain.flexspline_teeth
    for k, teeth in enumerate(found["clearances"]):
        table = model.clearances(k / pn.PHASES * pitch)
        assert [angle for angle, _, _ in teeth] == pytest.approx(table.angle_rad)
        for column, gap, radius in (
            (1, table.forward_rad, table.forward_radius_mm),
            (2, table.backward_rad, table.backward_radius_mm),
        ):
            mine = np.array([tooth[column].gap for tooth in teeth])
            both = np.isfinite(gap)
            assert np.array_equal(both, np.isfinite(mine))
            assert mine[both] == pytest.approx(gap[both], abs=GAP_TOLERANCE)
            where = np.array([tooth[column].radius for tooth in teeth])
            # If both ends of the flank are nearly equally close, either may be named.
            assert np.mean(np.abs(where[both] - radius[both]) < 0.01) > 0.95

    curve = model.torsion_curve(torque)
    assert found["total"] == pytest.approx(np.asarray(curve.total_rad), abs=ANGLE_TOLERANCE)
    # The shares of the angle of a preloaded mesh are a definition.
    if model.mesh_state()["preloaded_pairs"] == 0:
        for part, values in curve.parts_rad.items():
            assert found[part] == pytest.approx(np.asarray(values), abs=ANGLE_TOLERANCE)

    # Only the library has the checks of load capacity at the end of the list.
    checks = model.checks()[: CORE.lib.LM_CHECK_FLANK_PRESSURE]
    assert {check.name for check in checks} == set(found["checks"])
    for check in checks:
        mine = found["checks"][check.name]
        if check.name == "smallest_gap":
            # The library examines more phases, so it may find a slightly smaller gap.
            assert check.margin <= mine + GAP_TOLERANCE
            assert check.margin == pytest.approx(mine, abs=0.02 * ARCMIN)
        else:
            assert mine == pytest.approx(check.margin, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("name", ["reference_a", "external_ring"])
def test_tuned_numpy_does_the_same_work(name):
    drive = library_drive(name, CORE)
    tuned = tn.evaluate(tuned_design(drive, CORE))
    model = DesignModel(design_of(name))
    pitch = 2 * np.pi / drive.teeth.flexspline_teeth
    table = model.clearances()
    middle = np.searchsorted(tuned["clearances"]["angle"], table.angle_rad - pitch / 100)
    both = np.isfinite(table.forward_rad)
    gaps = tuned["clearances"]["gap"][middle]
    assert gaps[both] == pytest.approx(table.forward_rad[both], abs=1e-4 * ARCMIN)
    # Its teeth are in plane stress and its list of pairs has another limit: one percent.
    curve = tuned["characteristic"]
    total = model.torsion_curve(curve["torque_Nm"]).total_rad
    assert curve["total"] == pytest.approx(np.asarray(total), rel=0.015, abs=1e-9)
