"""The rim on its wave generator: compliances of the teeth compared with brute force, and their
dependences."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lostmotion.design.textbook import textbook_drive
from lostmotion.drives import parse_drive
from lostmotion.model import DesignModel, design_model

sys.path.insert(0, str(Path(__file__).parents[1]))
from brute_force import ring_on_springs

GENERATORS = ("cosine", "ellipse", "discs", "rollers", "ring")


def size20(generator: str, **support: float) -> dict[str, Any]:
    document, _ = textbook_drive(20, 100, generator)
    document["design"]["support"] = support
    return document


def model_of(document: dict[str, Any]) -> DesignModel:
    model = design_model(parse_drive(document))
    model.torsion_curve([model.rated_torque_Nm])
    return model


def supports_of(model: DesignModel) -> tuple[np.ndarray, np.ndarray]:
    """Angles and compliance of the supports, by the laws on the theory page."""
    drive = model.drive
    mesh = model._workspace.meshes[model.sections // 2]
    s, r = drive.support, mesh.geometry.neutral_mm
    shape, lib = mesh.line.shape, model.core.lib
    force = lib.lm_shape_generator_force(model.core.ffi.addressof(shape))
    force *= s.ring_stiffness_N_mm2 * drive.generator.deflection_mm / r**3
    force += 1e3 * drive.rated_torque_Nm / (2 * r) * math.tan(drive.teeth.pressure_angle_rad)

    def ball(load: float) -> float:
        return 2 / 3 * 4.36e-4 * (s.ball_diameter_mm * load) ** (-1 / 3)

    def bearing(load: float) -> float:
        return 4.37 / s.balls * ball(4.37 / s.balls * load)

    beta = drive.generator.contact_half_angle_rad
    width = drive.teeth.face_width_mm
    kind = GENERATORS.index(("cosine", "ellipse", "discs", "rollers", "ring")[drive.generator.type])
    if kind < 2:
        pitch = 2 * math.pi / s.balls
        each = int(math.pi / 4 / pitch)
        angles = pitch * np.arange(-each, each + 1)
        return angles, np.eye(angles.size) * ball(force / angles.size)
    if GENERATORS[kind] == "rollers":
        load = force / (2 * math.cos(beta))
        own = bearing(load) + 0.9 * 7.68e-5 * load**-0.1 * width**-0.8
        return np.array([-beta, beta]), np.eye(2) * own
    angles = np.linspace(-beta, beta, 7)
    layer = drive.flexspline.rim_thickness_mm + s.race_thickness_mm
    own = layer / (drive.material.youngs_modulus_MPa * width * (2 * beta * r / 7))
    along = np.cos(angles)
    return angles, np.eye(7) * own + bearing(force) * np.outer(along, along)


@pytest.mark.parametrize("generator", GENERATORS)
def test_compliances_of_the_teeth_are_those_of_a_ring_on_springs(generator: str) -> None:
    model = model_of(size20(generator))
    held, compliance = supports_of(model)
    foundation = model._workspace.foundation
    assert foundation.supports == held.size
    count = model.drive.teeth.flexspline_teeth // 2 + 1
    clearances = model._workspace.clearances[0]
    angles = np.array([clearances[i].angle_rad for i in range(count)])
    lib, ffi = model.core.lib, model.core.ffi
    mesh = ffi.addressof(model._workspace.meshes[model.sections // 2])
    all_teeth = (model.drive, mesh, clearances, 0, count - 1)
    assert lib.lm_make_rim_support(*all_teeth, ffi.addressof(foundation), ffi.NULL) == lib.LM_OK
    teeth = np.flatnonzero(np.abs(angles) < math.radians(60))[::3]
    radius = model._workspace.meshes[model.sections // 2].geometry.neutral_mm
    expected = ring_on_springs.gives(
        radius,
        model.drive.support.ring_stiffness_N_mm2,
        held,
        compliance,
        angles[teeth],
    )
    found = np.array(
        [
            [lib.lm_rim_yield(ffi.addressof(foundation), int(a), int(b)) for b in teeth]
            for a in teeth
        ]
    )
    assert found == pytest.approx(expected, abs=1e-6 * expected.max())


def deflection(document: dict[str, Any]) -> float:
    """One-sided deflection at rated torque."""
    model = model_of(document)
    return float(model.torsion_curve([model.rated_torque_Nm]).total_rad[0])


def test_generators_differ_in_deflection() -> None:
    found = {generator: deflection(size20(generator)) for generator in GENERATORS}
    assert found["cosine"] > 1.05 * found["discs"]  # separate balls compared with a rigid arc
    assert max(found.values()) > 1.1 * min(found.values())


def untwisted(document: dict[str, Any]) -> float:
    """One-sided deflection at twice the rated torque, without the chain of torsion.

    The slope there is not suitable: it jumps where a pair begins to carry.
    """
    model = model_of(document)
    found = model.torsion_curve([2.0 * model.rated_torque_Nm])
    return float(found.total_rad[0] - found.parts_rad["torsion"][0])


@pytest.mark.parametrize("generator", GENERATORS)
def test_a_thicker_rim_or_race_deflects_less(generator: str) -> None:
    thin, thick, raced = size20(generator), size20(generator), size20(generator)
    rim = thin["design"]["flexspline"]["rim_thickness_mm"]
    thick["design"]["flexspline"]["rim_thickness_mm"] = 1.6 * rim
    race = design_model(parse_drive(thin)).drive.support.race_thickness_mm
    raced["design"]["support"]["race_thickness_mm"] = 1.3 * race
    assert untwisted(thin) > 1.005 * untwisted(thick)
    assert untwisted(thin) > 1.01 * untwisted(raced)


def test_a_stated_foundation_is_used() -> None:
    model = model_of(size20("discs", foundation_N_per_mm2=2600.0))
    assert model._workspace.foundation.supports == 0
