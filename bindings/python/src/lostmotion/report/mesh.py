"""The mesh of a design as placed by the C library: flanks and first contacts, in mm."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.model import DesignModel
from lostmotion.structs import GENERATORS


@dataclass
class Mesh:
    """The middle axial section of a design, ready to be drawn.

    Screen coordinates here: mm, the deformation axis upward, growing angles to the right.
    """

    model: DesignModel
    mesh: Any
    phase_rad: float

    @property
    def geometry(self) -> Any:
        """The `lm_geometry`: numbers of teeth, radii and deflection."""
        return self.mesh.geometry

    @property
    def external(self) -> bool:
        """Whether the rigid gear is inside the flexspline."""
        return bool(self.geometry.deformation == self.model.core.lib.LM_EXTERNAL)

    @property
    def free_edge_mm(self) -> float:
        """Distance from the neutral line to the free edge of the rim, outward."""
        half = float(self.model.drive.flexspline.rim_thickness_mm) / 2.0
        return half if self.external else -half

    @property
    def generator(self) -> str:
        """Type of the wave generator."""
        return str(GENERATORS[self.model.drive.generator.type])

    @property
    def pitch(self) -> float:
        """Angle from tooth to tooth of the flexspline."""
        return float(2.0 * math.pi / self.geometry.flexspline_teeth)

    def tooth(self, number: int) -> float:
        """Material angle of a tooth (internal) or space (external), counted from the axis."""
        return number * self.pitch + self.phase_rad

    def number(self, angle_rad: float) -> int:
        """Index of the tooth nearest to a material angle."""
        return round((angle_rad - self.phase_rad) / self.pitch)

    def place(self, angle_rad: float) -> tuple[float, float, float]:
        """Polar angle and radius of the foot of a tooth, and the direction of its axis."""
        lib, ffi = self.model.core.lib, self.model.core.ffi
        found = lib.lm_place_tooth(ffi.addressof(self.mesh, "line"), angle_rad)
        polar = angle_rad + found.lead_rad
        return polar, found.radius_mm, polar + math.atan2(found.tilt_sin, found.tilt_cos)

    def half_angles(self, flank: str) -> Callable[[float], float]:
        """Half angle of a flank as a function of the radius in mm."""
        lib, ffi, mesh = self.model.core.lib, self.model.core.ffi, self.mesh
        if flank == "rigid":
            return lambda radius: float(lib.lm_rigid_flank_at(mesh, radius).half_angle_rad)
        if mesh.flank.kind == lib.LM_FLANK_INVOLUTE:
            involute = ffi.addressof(mesh.geometry, flank)
            return lambda radius: float(lib.lm_evaluate_involute(involute, radius).half_angle_rad)
        own, neutral_mm = ffi.addressof(mesh, "flank"), float(mesh.geometry.neutral_mm)

        def half_angle(radius: float) -> float:
            foot = lib.lm_evaluate_flank(own, lib.lm_flank_at_radius(own, radius))
            return math.atan2(foot.across_mm, foot.along_mm + neutral_mm)

        return half_angle

    def rigid_axis(self, angle_rad: float) -> float:
        """Position of the rigid gear's space (or tooth) that meets a tooth (or space)."""
        return float(angle_rad * (1.0 - self.geometry.lead_per_angle))


def make_mesh(model: DesignModel, phase_rad: float = 0.0) -> Mesh:
    """Prepare the middle section of a design for drawing."""
    c = model.core
    mesh = c.ffi.new("lm_mesh *")
    c.call(c.lib.lm_make_mesh, model.drive, 1.0, c.lib.LM_NEUTRAL_LINE_NODES, mesh)
    return Mesh(model, mesh, phase_rad)


@dataclass(frozen=True)
class Touch:
    """First contact of a tooth: its angle, where the flank touches, and which one."""

    angle_rad: float
    radius_mm: float
    gap_rad: float
    side: int
    loaded: bool


def first_touches(
    model: DesignModel, loaded: Sequence[tuple[int, int]], phase_rad: float = 0.0
) -> list[Touch]:
    """First contacts of all overlapping teeth.

    Parameters
    ----------
    loaded : sequence of (int, int)
        Tooth (number in the lobe) and side of the pairs that carry.
    """
    table = model.clearances(phase_rad)
    section = np.flatnonzero(table.section == model.sections // 2)
    touches = []
    for tooth, row in enumerate(section):
        for side, gap, radius in (
            (1, table.forward_rad[row], table.forward_radius_mm[row]),
            (-1, table.backward_rad[row], table.backward_radius_mm[row]),
        ):
            if np.isfinite(gap):
                touches.append(
                    Touch(
                        float(table.angle_rad[row]),
                        float(radius),
                        float(gap),
                        side,
                        (tooth, side) in loaded,
                    )
                )
    return touches


def touch_place(mesh: Mesh, touch: Touch) -> FloatArray:
    """Contact point on the rigid gear's flank, in screen coordinates."""
    half = mesh.half_angles("rigid")(touch.radius_mm)
    # Internal: the forward flank of the tooth meets the far flank of the space. External: the
    # flexspline's space comes with growing angles against the near flank of the rigid tooth.
    side = -touch.side if mesh.external else touch.side
    at = mesh.rigid_axis(touch.angle_rad) + side * half
    return touch.radius_mm * np.array([math.sin(at), math.cos(at)])
