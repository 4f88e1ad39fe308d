"""Flanks of two arcs with a common tangent, and the envelope of such a tooth on a rigid gear.

The arcs are drawn from their centres, and the tangent is found as a line at the distance of one
radius from each. The conjugate flank is generated as by a slotting tool: the tooth is placed on the
deformed neutral line at many angles, and at each radius the rigid gear keeps the part that no
position reaches. Points are complex numbers [mm], the tooth's axis is the real axis, as in
`polygons`.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from . import polygons

SWEEP_STEP_DEG = 0.05
"""Angle between two positions of the tool [deg]."""

NODE_STEP_DEG = 1.0
"""Angle between two positions computed on the neutral line [deg]; a spline through them deviates
from the line by 3e-6 arcmin."""

JUNCTION_STEPS_DEG = np.arange(-2.0, 2.01, 0.25)
"""Further positions around the end of the contact of discs or rollers [deg]. The shear of the line
jumps there, and a spline through positions 1 deg apart moves the flank by up to 3e-6 modules."""

SWEEP_HALF_DEG = 70.0
"""Beyond this material angle a tooth is out of mesh [deg]."""

LAND_SHARE = 0.02
"""Share of the height below the reach of the tip in which the space is radial, as in the library.
"""


@dataclass(frozen=True)
class Arcs:
    """Convex arc at the tip, common tangent, concave arc at the root [mm].

    Attributes
    ----------
    convex_mm, concave_mm : float
        Radii.
    convex_centre, concave_centre : complex
        Centres: real part from the gear's centre along the tooth's axis, imaginary part across.
    inner_mm, outer_mm : float
        Root and tip, along the tooth's axis.
    """

    convex_mm: float
    convex_centre: complex
    concave_mm: float
    concave_centre: complex
    inner_mm: float
    outer_mm: float


def tangent_rad(arcs: Arcs) -> float:
    """Inclination of the line that touches both arcs between them, against the tooth's axis."""
    apart = arcs.concave_centre - arcs.convex_centre

    def missing(angle: float) -> float:
        normal = complex(math.sin(angle), math.cos(angle))
        return (apart * normal.conjugate()).real - arcs.convex_mm - arcs.concave_mm

    line_of_centres = math.atan2(apart.real, apart.imag)
    return float(brentq(missing, line_of_centres, line_of_centres + math.pi / 2, xtol=1e-15))


def upper_flank(arcs: Arcs, points: int) -> NDArray[np.complex128]:
    """Upper flank of the undeformed tooth [mm] from root to tip, by height along its axis."""
    angle = tangent_rad(arcs)
    normal = complex(math.sin(angle), math.cos(angle))
    upper = arcs.convex_centre + arcs.convex_mm * normal
    lower = arcs.concave_centre - arcs.concave_mm * normal
    ends = [arcs.inner_mm, lower.real, upper.real, arcs.outer_mm]
    height = np.unique(
        np.concatenate([np.linspace(a, b, points // 3) for a, b in itertools.pairwise(ends)])
    )
    convex = arcs.convex_centre.imag + np.sqrt(
        np.maximum(arcs.convex_mm**2 - (height - arcs.convex_centre.real) ** 2, 0)
    )
    concave = arcs.concave_centre.imag - np.sqrt(
        np.maximum(arcs.concave_mm**2 - (height - arcs.concave_centre.real) ** 2, 0)
    )
    straight = np.interp(height, ends[1:3], [lower.imag, upper.imag])
    across = np.where(
        height >= upper.real, convex, np.where(height <= lower.real, concave, straight)
    )
    return height + 1j * across


def _angles_on(
    placed: NDArray[np.complex128], radius: NDArray[np.float64], sense: float
) -> NDArray[np.float64]:
    """Polar angles of a placed flank on radii, by its chords, all times the sense; minus infinity
    where it has no point."""
    square = sense * (placed.real**2 + placed.imag**2)
    above = np.searchsorted(square, sense * radius**2)
    found = np.full(len(radius), -np.inf)
    on = (above > 0) & (above < len(placed))
    low, high = placed[above[on] - 1], placed[above[on]]
    share = (np.abs(radius[on]) - np.abs(low)) / (np.abs(high) - np.abs(low))
    found[on] = sense * (np.angle(low) + share * (np.angle(high) - np.angle(low)))
    return found


def swept_flank(
    design: polygons.Design,
    tool: NDArray[np.complex128],
    tip_mm: float,
    points: int = polygons.FLANK_POINTS,
) -> NDArray[np.complex128]:
    """Upper flank of the rigid space [mm] that a moving flexspline tooth generates.

    External deformation: of the rigid tooth that a moving space of the flexspline leaves, with the
    signs of radii and angles changed.

    Parameters
    ----------
    tool : ndarray of complex, shape (n,)
        Upper flank of the undeformed tooth (external: space), from root to tip.
    tip_mm : float
        Tip radius of the rigid gear.

    Returns
    -------
    ndarray of complex, shape (points + 1,)
        From the inner to the outer end. The end opposite the tip is a point on the radial land.
    """
    sense = 1.0 if design.is_internal else -1.0
    inner_mm = sense * tip_mm
    top = float((sense * np.abs(polygons.on_line(design, tool, 0.0))).max())
    share = np.linspace(1.0, math.sqrt(LAND_SHARE), points)
    radius = top - (top - inner_mm) * share**2
    reach = np.full(points, -np.inf)
    node_deg = np.arange(0.0, SWEEP_HALF_DEG + 2 * NODE_STEP_DEG, NODE_STEP_DEG)
    if design.contact_half_angle_deg > 0:
        node_deg = np.unique(
            np.append(node_deg, np.round(design.contact_half_angle_deg) + JUNCTION_STEPS_DEG)
        )
    node = np.radians(node_deg)
    frame = np.array(
        [polygons.on_line(design, polygons.frame_points(design), angle) for angle in node]
    )
    frame *= np.exp(-1j * polygons.rigid_axis_rad(design, node))[:, None]
    # The line is symmetric about the deformation axis.
    path = CubicSpline(
        np.concatenate((-node[:0:-1], node)),
        np.concatenate((np.conj(frame[:0:-1]), frame)),
    )
    steps = round(SWEEP_HALF_DEG / SWEEP_STEP_DEG)
    from_neutral = tool - polygons.radii(design).neutral_mm
    angles = np.radians(np.linspace(-SWEEP_HALF_DEG, SWEEP_HALF_DEG, 2 * steps + 1))
    corner = np.empty(len(angles), np.complex128)
    before = last = np.full(points, -np.inf)
    for i, angle in enumerate(angles):
        origin, end = path(angle)
        placed = origin + from_neutral * (end - origin) / abs(end - origin)
        corner[i] = placed[-1]
        now = np.full(points, -np.inf)
        if sense * abs(corner[i]) > inner_mm:
            now = _angles_on(placed, radius, sense)
        reach = np.maximum(reach, now)
        # The vertex of the parabola through three positions, the middle one the furthest.
        peak = np.isfinite(before) & np.isfinite(now) & (last > before) & (last >= now)
        rise = (now[peak] - before[peak]) ** 2 / (16 * last[peak] - 8 * (before[peak] + now[peak]))
        reach[peak] = np.maximum(reach[peak], last[peak] + rise)
        before, last = last, now
    # The path of the corner of the tip between two positions.
    highest = int(np.argmax(sense * np.abs(corner)))
    for way in (corner[: highest + 1], corner[:highest:-1]):
        rho, theta = sense * np.abs(way), sense * np.angle(way)
        reach = np.maximum(reach, np.interp(radius, rho, theta, left=-np.inf, right=-np.inf))
    radius = np.append(radius, top + 0.1 * design.module_mm)
    flank = sense * radius * np.exp(1j * sense * np.append(reach, reach[-1]))
    return flank if design.is_internal else flank[::-1]


def swept_tooth(
    design: polygons.Design, space: NDArray[np.complex128], heights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Half thickness [mm] of the tooth that a moving space leaves, at heights over its neutral
    line.

    Parameters
    ----------
    space : ndarray of complex, shape (n,)
        Upper flank of the rigid space from its tip (the smallest radius) outwards.
    """
    steps = round(SWEEP_HALF_DEG / SWEEP_STEP_DEG)
    angles = np.radians(np.linspace(-SWEEP_HALF_DEG, SWEEP_HALF_DEG, 2 * steps + 1))
    frame = np.array(
        [polygons.on_line(design, polygons.frame_points(design), abs(angle)) for angle in angles]
    )
    frame *= np.exp(-1j * polygons.rigid_axis_rad(design, abs(angles)))[:, None]
    frame[angles < 0] = np.conj(frame[angles < 0])  # symmetric about the deformation axis
    left = np.full(len(heights), np.inf)
    corner = np.empty(len(angles), np.complex128)
    for i, (origin, end) in enumerate(frame):
        placed = (space - origin) * np.conj(end - origin) / abs(end - origin)
        corner[i] = placed[0]
        across = np.interp(heights, placed.real, placed.imag, left=np.inf, right=np.inf)
        left = np.minimum(left, across)
    # The path of the corner of the tip between two positions.
    deepest = int(np.argmin(corner.real))
    for way in (corner[deepest:], corner[deepest::-1]):
        across = np.interp(heights, way.real, way.imag, left=np.inf, right=np.inf)
        left = np.minimum(left, across)
    return left


@dataclass(frozen=True)
class STooth:
    """Half the path of a rack's tooth on both sides of a datum point, with its tangent next to it
    [mm].

    Attributes
    ----------
    kappa : float
        Deflection coefficient of the path.
    module_mm : float
        The length of the path is one pitch of a rack of this module.
    datum : complex
        As a centre of `Arcs`.
    inner_mm, outer_mm : float
        Root and tip, along the tooth's axis.
    """

    kappa: float
    module_mm: float
    datum: complex
    inner_mm: float
    outer_mm: float


def upper_s_flank(tooth: STooth, points: int) -> NDArray[np.complex128]:
    """Upper flank of the undeformed S tooth [mm] from root to tip, by height along its axis.

    The path is sampled by its angle, which concentrates the points where it bends most; the tangent
    is the steepest line from its start.
    """

    def path(angle: NDArray[np.float64]) -> NDArray[np.complex128]:
        height = tooth.kappa * tooth.module_mm * np.sin(angle / 2) ** 2
        return height - 1j * tooth.module_mm / 4 * (angle - tooth.kappa * np.sin(angle))

    angle = np.linspace(1e-4, math.pi, 20 * points)
    steepest = angle[int(np.argmin(-path(angle).imag / path(angle).real))]
    halves = []
    for reach in (tooth.datum.real - tooth.inner_mm, tooth.outer_mm - tooth.datum.real):
        end = 2 * math.asin(math.sqrt(reach / (tooth.kappa * tooth.module_mm)))
        bent = path(np.linspace(steepest, end, points // 3))
        halves.append(np.concatenate((np.linspace(0, bent[0], points // 6)[1:-1], bent)))
    return tooth.datum + np.concatenate((-halves[0][::-1], halves[1]))
