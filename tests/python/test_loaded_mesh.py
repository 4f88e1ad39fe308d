"""Shares of the pairs in a torque, compared with finite elements of the whole toothed rim.

Geometry, gaps and the supports' own compliance are the library's, which other tests examine. The
compliances of teeth, tilt and the rim between its supports are from finite elements on one side and
from the library on the other. The library neglects that a loaded tooth bends its neighbours.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lostmotion.drives import read_drive
from lostmotion.model import DesignModel

pytest.importorskip("skfem", reason="pip install scikit-fem: finite elements to compare with")

sys.path.insert(0, str(Path(__file__).parents[1]))
from brute_force.loaded_mesh import (
    Gear,
    Load,
    forces_under,
    free_ring,
    held_sector,
    on_supports,
)

DRIVE = Path(__file__).parents[1] / "data" / "drives" / "reference_a.toml"

GAP_MAX_ARCMIN = 8.0
"""Pairs whose gap is wider than the rotation at rated torque are left out."""

EDGE_MM = 0.02
"""A force on the edge of a tip acts on the section this far below it."""

BACKING_MM = 4.0
"""Ring behind the rigid gear's teeth, held at its outer edge."""

RACE_MM = 0.025
"""The thinnest accepted race: the rim of the finite elements has none."""

LARGEST_BOUND = 1.15
"""Limits of the largest force relative to that of the finite elements.

Elements half as large change that by 1 %.
"""

MOVED_BOUND = 0.25
"""Share of the load that other pairs may carry."""

STRIBECK = 4.37
"""The most loaded ball of a bearing with rigid rings carries this times the mean force."""


def loaded(folder: Path) -> tuple[DesignModel, Any]:
    """Reference design A on its discs and its own rim, at rated torque."""
    text = DRIVE.read_text()
    start, end = (
        text.index("# The published foundation"),
        text.index("# Seat of the generator"),
    )
    own = f"[design.support]\nrace_thickness_mm = {RACE_MM}\n\n"
    file = folder / "rim.toml"
    file.write_text(text[:start] + own + text[end:])
    design = read_drive(file).design
    assert design is not None
    model = DesignModel(design)
    c = model.core
    workspace, fault = c.ffi.new("lm_design_workspace *"), c.fault()
    c.check(
        c.lib.lm_prepare_meshes(model.drive, c.lib.LM_NEUTRAL_LINE_NODES, workspace, fault),
        fault,
    )
    torque = c.array([model.rated_torque_Nm])
    parts, state = c.ffi.new("lm_contributions[]", 1), c.ffi.new("lm_mesh_state *")
    c.check(
        c.lib.lm_evaluate_torsion_curve(
            model.drive, 0.0, c.pointer(torque), 1, parts, state, workspace, fault
        ),
        fault,
    )
    return model, (workspace, state.pairs)


def disc_supports(model: DesignModel, mesh: Any) -> tuple[np.ndarray, np.ndarray]:
    """Angles of the supports on a disc's arc, and their own compliance, as rim_support.h has it."""
    c, drive = model.core, model.drive
    places = 7
    half = mesh.line.shape.contact_half_angle_rad
    radius = mesh.geometry.neutral_mm
    angles = half * np.linspace(-1, 1, places)
    stiffness = drive.support.ring_stiffness_N_mm2
    shape = c.ffi.addressof(mesh.line, "shape")
    force = c.lib.lm_shape_generator_force(shape) * stiffness * drive.generator.deflection_mm
    force = force / radius**3 + drive.rated_torque_Nm * 1e3 / (2 * radius) * math.tan(
        drive.teeth.pressure_angle_rad
    )
    share = STRIBECK / drive.support.balls
    bearing = share * c.lib.lm_ball_compliance(drive.support.ball_diameter_mm, share * force)
    thickness = drive.flexspline.rim_thickness_mm + drive.support.race_thickness_mm
    steel = drive.material.youngs_modulus_MPa * drive.teeth.face_width_mm
    own = thickness / (steel * 2 * half * radius / places)
    return angles, own * np.eye(places) + bearing * np.outer(np.cos(angles), np.cos(angles))


def test_the_same_pairs_share_a_torque_as_by_finite_elements(tmp_path: Path) -> None:
    model, (workspace, count) = loaded(tmp_path)
    c, drive, mesh = model.core, model.drive, workspace.meshes[0]
    size = mesh.geometry
    take_up = workspace.take_up
    carried = {
        take_up.active[i]: take_up.rest_force[take_up.active[i]] + take_up.change[i]
        for i in range(take_up.active_count)
    }
    chosen = [
        i
        for i in range(count)
        if (pair := workspace.contacts[i]).lobe == 0
        and pair.side > 0
        and pair.gap_rad < math.radians(GAP_MAX_ARCMIN / 60)
    ]
    assert set(carried) <= set(chosen)
    pairs = [workspace.contacts[i] for i in chosen]
    angles = [workspace.clearances[0][pair.tooth].angle_rad for pair in pairs]
    numbers = [round(a * drive.teeth.flexspline_teeth / (2 * math.pi)) for a in angles]
    arm = np.array([pair.arm_mm for pair in pairs])
    gap = np.array([pair.gap_rad for pair in pairs])
    foot = [c.lib.lm_place_tooth(c.ffi.addressof(mesh.line), a).radius_mm for a in angles]
    own = np.minimum(arm - foot + size.neutral_mm, size.flexspline_tip_mm - EDGE_MM)
    opposite = np.maximum(arm, size.rigid_tip_mm + EDGE_MM)

    def half_of_flexspline(radius: float) -> float:
        flank = c.ffi.addressof(size, "flexspline")
        return float(c.lib.lm_evaluate_involute(flank, radius).half_angle_rad)

    def half_of_rigid(radius: float) -> float:
        space = c.lib.lm_evaluate_involute(c.ffi.addressof(size, "rigid"), radius).half_angle_rad
        return math.pi / size.rigid_teeth - float(space)

    steel = (
        drive.teeth.face_width_mm,
        drive.material.youngs_modulus_MPa,
        drive.material.poisson_ratio,
    )
    flexspline = Gear(
        size.flexspline_teeth,
        size.flexspline_root_mm,
        size.flexspline_tip_mm,
        size.flexspline_root_mm - drive.flexspline.rim_thickness_mm,
        half_of_flexspline,
        *steel,
    )
    rigid = Gear(
        size.rigid_teeth,
        size.rigid_root_mm,
        size.rigid_tip_mm,
        size.rigid_root_mm + BACKING_MM,
        half_of_rigid,
        *steel,
    )
    wedge = [pair.wedge for pair in pairs]
    held, supports = disc_supports(model, mesh)
    loads = [Load(k, r, t) for k, r, t in zip(numbers, own, wedge, strict=True)]
    ring = on_supports(free_ring(flexspline, loads, held), len(loads), supports)
    teeth = held_sector(
        rigid, [Load(k, r, t) for k, r, t in zip(numbers, opposite, wedge, strict=True)]
    )
    found = forces_under(model.rated_torque_Nm, ring + teeth, arm, gap)
    ours = np.array([carried.get(i, 0.0) for i in chosen])
    # Both models carry the torque.
    assert 2e-3 * ours @ arm == pytest.approx(model.rated_torque_Nm, rel=1e-9)
    assert 2e-3 * found @ arm == pytest.approx(model.rated_torque_Nm, rel=1e-6)
    # The same pairs carry; the largest force is larger by the share that the neighbours do not
    # carry.
    assert [k for k, f in zip(numbers, found, strict=True) if f > 0] == [
        k for k, f in zip(numbers, ours, strict=True) if f > 0
    ]
    assert 1.0 < ours.max() / found.max() < LARGEST_BOUND
    assert np.abs(ours - found).sum() / 2 < MOVED_BOUND * ours.sum()
    print(f"largest force {ours.max():.0f} N, by finite elements {found.max():.0f} N")
