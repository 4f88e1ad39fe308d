"""Profiles of both gears with root fillets, in mm.

Each gear is undeformed, on its own axis, with a tooth (external) or a space (internal) upward.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.model import DesignModel
from lostmotion.report.mesh import Mesh, make_mesh
from lostmotion.zero_crossing import zero_between

FLANK_POINTS = 25
"""Points of one flank, from the fillet to the tip: error at most 1e-5 modules."""

ARC_POINTS = 9
"""Points of a fillet, of half a tip and of half a root."""

COINCIDENT_MM = 1e-6
"""Closer points are identical: a thousandth of the resolution of a machine tool."""

ACCURACY_MM = 1e-12
"""Last step towards the radius of the form circle; its rounding is coarser."""


@dataclass(frozen=True)
class GearProfile:
    """One gear.

    Attributes
    ----------
    name : str
        ``flexspline`` or ``rigid``.
    internal : bool
        Teeth inward; then `half_pitch` is of a space, otherwise of a tooth.
    half_pitch : ndarray, shape (n, 2)
        From the middle of the tooth or space to the middle of its neighbour: x to the side of
        growing angle, y outward along its axis.
    fillet_radius_mm, form_radius_mm : float
        Of the root arc, and where it meets the flank.
    """

    name: str
    internal: bool
    teeth: int
    root_mm: float
    tip_mm: float
    fillet_radius_mm: float
    form_radius_mm: float
    half_pitch: FloatArray

    def pitch(self) -> FloatArray:
        """One pitch, symmetric about its axis, at growing angles."""
        mirrored = self.half_pitch[::-1] * np.array([-1.0, 1.0])
        return np.concatenate((mirrored, self.half_pitch[1:]))

    def outline(self) -> FloatArray:
        """All teeth, closed: the last point is not the first one again."""
        one = self.pitch()[:-1]
        turns = -2.0 * math.pi * np.arange(self.teeth) / self.teeth
        x, y = one[:, 0], one[:, 1]
        c, s = np.cos(turns)[:, None], np.sin(turns)[:, None]
        return np.stack((x * c - y * s, x * s + y * c), axis=-1).reshape(-1, 2)


def gear_profiles(model: DesignModel) -> tuple[GearProfile, GearProfile]:
    """Profiles of the flexspline, undeformed, and of the rigid gear."""
    mesh = make_mesh(model)
    return gear_profile(mesh, "flexspline"), gear_profile(mesh, "rigid")


def gear_profile(mesh: Mesh, name: str) -> GearProfile:
    """Profile of one gear, ``flexspline`` or ``rigid``."""
    internal = mesh.external if name == "flexspline" else not mesh.external
    teeth = int(getattr(mesh.geometry, f"{name}_teeth"))
    cut = mesh.model.drive.teeth
    rounding = (
        cut.root_clearance / (1.0 - math.sin(cut.pressure_angle_rad)) * mesh.geometry.module_mm
    )  # tip of the basic rack, ISO 53: c / (1 - sin alpha)
    root, tip = (float(getattr(mesh.geometry, f"{name}_{end}_mm")) for end in ("root", "tip"))
    side = -1.0 if internal else 1.0  # from the flank to the middle of the space

    half = mesh.half_angles(name)
    fillet, form, centre = _fillet(half, (root, tip), rounding, (side, math.pi / teeth))
    foot = centre * root / np.hypot(*centre)
    arc = _arc(centre, fillet, np.array(_at(form, half(form))), foot)
    radius = np.linspace(form, tip, FLANK_POINTS).tolist()
    flank = np.array([_at(r, half(r)) for r in radius])
    end, middle = math.atan2(*foot), 0.0 if internal else math.pi / teeth
    bottom = np.array([_at(root, a) for a in np.linspace(end, middle, ARC_POINTS)])
    top_middle = math.pi / teeth if internal else 0.0
    top = np.array([_at(tip, a) for a in np.linspace(half(tip), top_middle, ARC_POINTS)])
    # from the middle of the root to that of the tip, then in order of growing angle
    line = np.concatenate((bottom[:0:-1], arc[:0:-1], flank[:-1], top))
    apart = np.hypot(*np.diff(line, axis=0).T) > COINCIDENT_MM  # a full fillet: no root arc
    line = line[np.concatenate(([True], apart))]
    return GearProfile(
        name, internal, teeth, root, tip, fillet, form, line if internal else line[::-1]
    )


def _at(radius: float, angle: float) -> tuple[float, float]:
    return radius * math.sin(angle), radius * math.cos(angle)


def _fillet(
    half: Callable[[float], float],
    ends: tuple[float, float],
    rounding: float,
    space: tuple[float, float],
) -> tuple[float, float, FloatArray]:
    """Find the arc that touches root circle and flank: radius, radius of the form circle, centre.

    Its radius is that of the basic rack's tip, or less if the space to the opposite flank or the
    tip is smaller.
    """
    root, tip = ends
    side, half_pitch = space
    step = 1e-6 * abs(tip - root)

    def touching(form: float) -> tuple[float, tuple[float, float]]:
        """Radius and centre of the arc that touches the flank at a radius, and the root circle.

        With the point p of the flank, its normal n and the radius a, the centre p + a n is at the
        distance root + side a from the axis: a = (root^2 - p^2) / (2 (p n - side root)).
        """
        ahead, behind = (_at(r, half(r)) for r in (form + step, form - step))
        x, y = ahead[0] - behind[0], ahead[1] - behind[1]
        length = math.hypot(x, y)
        normal = side * y / length, -side * x / length
        at = _at(form, half(form))
        along = at[0] * normal[0] + at[1] * normal[1]
        arc = (root - form) * (root + form) / (2.0 * (along - side * root))
        return arc, (at[0] + arc * normal[0], at[1] + arc * normal[1])

    def room(form: float) -> float:
        """Angle from the centre of the arc to the middle of the space."""
        angle = math.atan2(*touching(form)[1])
        return angle if side < 0 else half_pitch - angle

    if room(root) < 0:
        return 0.0, root, np.array(_at(root, half(root)))
    form = tip
    if touching(tip)[0] > rounding:
        form = zero_between(lambda r: touching(r)[0] - rounding, root, tip, ACCURACY_MM)
    if room(form) < 0:
        form = zero_between(room, root, form, ACCURACY_MM)
    arc, centre = touching(form)
    return arc, form, np.array(centre)


def _arc(centre: FloatArray, radius: float, start: FloatArray, end: FloatArray) -> FloatArray:
    """Points of the short arc from start to end."""
    if radius == 0:
        return np.array([start, end])
    first, last = (math.atan2(*(p - centre)[::-1]) for p in (start, end))
    turn = (last - first + math.pi) % (2.0 * math.pi) - math.pi
    angle = first + np.linspace(0.0, turn, ARC_POINTS)
    return np.column_stack((centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)))
