"""Tooth clearances by rotating teeth until they touch.

One tooth of the flexspline is placed on the deformed neutral line, and the flank of the rigid gear
at the place that follows from its tooth count. The rigid flank starts at a safe distance and
rotates about the axis towards the tooth. No point of it moves further than its radius times the
rotation, so a rotation of (distance / largest radius) cannot pass a contact; such rotations repeat
until the distance is zero. The rotation from the nominal position is the gap. A flank that is
inside the tooth is thus rotated back until it is free: its gap is negative.

Involutes are strings unrolled from the base circle. Only involutes and their ends are used, without
fillets; each flank ends at its tip corner. Points are complex numbers [mm]; the real axis is the
deformation axis of the wave generator, a tooth at rest has its axis along the real axis.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry import Polygon

from .neutral_line import NeutralLine, neutral_line, place

ARCMIN_PER_RAD = 180 * 60 / math.pi

ADDENDUM_MODULES = 1.0
"""Addendum of the basic rack, in modules: the standard rack of ISO 53."""

ROOT_GAP_MODULES = 0.2
"""Radial room between a fully engaged tip and the root opposite, in modules: the middle of the
usual 0.15 to 0.25.
"""

FLANK_POINTS = 400
"""Points a flank. Chords of a 0.45 mm flank of 9 mm radius then miss the involute by 2e-8 mm."""

LAND_POINTS = 9
"""Points on a tip or root land of a drawn tooth."""

CONTACT_DISTANCE_MM = 1e-9
"""Distance that counts as contact [mm]: 1.4e-7 arcmin at a radius of 25 mm."""

TURNS_MAX = 500
"""Largest number of rotations of the search; ordinary teeth need about ten."""

CLEAR_PITCHES = 3
"""Initial distance of the rigid flank [pitches]: more than any relevant interference."""


@dataclass(frozen=True)
class Design:
    """Teeth, rim and wave generator of a strain-wave gear.

    Attributes
    ----------
    deformation : {"internal", "external"}
        Internal: the wave generator is inside, the flexspline has external teeth. External: the
        wave generator is a ring outside, the flexspline has internal teeth.
    module_mm : float
        Module [mm].
    flexspline_teeth, rigid_teeth : int
        Tooth counts.
    pressure_angle_deg : float
        Pressure angle of the rack [deg].
    flexspline_shift, rigid_shift : float
        Profile shifts, in modules. That of an internal gear is the shift of the external tooth that
        fills its space.
    tooth_height : float
        Height of the external teeth, in modules.
    engagement_depth : float
        Depth of engagement on the deformation axis, in modules.
    root_clearance : float
        Clearance of the basic rack, in modules.
    rim_thickness_mm : float
        Thickness of the flexspline rim [mm]; the neutral line is in its middle.
    generator_type : {"cosine", "discs", "rollers", "ring", "ellipse"}
        Wave generator.
    deflection_mm : float
        Radial deflection of the neutral line on the deformation axis [mm], above 0.
    contact_half_angle_deg : float
        Half angle of the contact arc, or of a pair of rollers (0: one roller a lobe) [deg]; cosine
        and ellipse ignore it.
    """

    deformation: str
    module_mm: float
    flexspline_teeth: int
    rigid_teeth: int
    pressure_angle_deg: float
    flexspline_shift: float
    rigid_shift: float
    tooth_height: float
    engagement_depth: float
    root_clearance: float
    rim_thickness_mm: float
    generator_type: str
    deflection_mm: float
    contact_half_angle_deg: float

    def __post_init__(self) -> None:
        if self.deformation not in ("internal", "external"):
            raise ValueError(
                f"deformation: found {self.deformation!r}, expected internal or external"
            )

    @property
    def is_internal(self) -> bool:
        """True if the wave generator is inside and the flexspline has external teeth."""
        return self.deformation == "internal"


@dataclass(frozen=True)
class Radii:
    """Radii of the undeformed gears [mm].

    Attributes
    ----------
    flexspline_inner_mm, flexspline_outer_mm : float
        Ends of the flexspline flank: root to tip of external teeth, tip to root of internal ones.
    rigid_inner_mm, rigid_outer_mm : float
        Ends of the rigid flank: tip to root of internal teeth, root to tip of external ones.
    neutral_mm : float
        Neutral line of the flexspline rim.
    """

    flexspline_inner_mm: float
    flexspline_outer_mm: float
    rigid_inner_mm: float
    rigid_outer_mm: float
    neutral_mm: float


def radii(design: Design) -> Radii:
    """Radii that follow from the tooth height, engagement depth and rim of a design.

    The gear with external teeth is cut by the rack and has the given tooth height; the tip of the
    other one follows from the engagement depth, its root from the root gap.
    """
    module = design.module_mm
    cut_teeth, cut_shift = (
        (design.flexspline_teeth, design.flexspline_shift)
        if design.is_internal
        else (design.rigid_teeth, design.rigid_shift)
    )
    cut_root = module * (cut_teeth / 2 + cut_shift - ADDENDUM_MODULES - design.root_clearance)
    cut_tip = cut_root + module * design.tooth_height
    other_tip = cut_tip + design.deflection_mm - module * design.engagement_depth
    other_root = cut_tip + design.deflection_mm + module * ROOT_GAP_MODULES
    half_rim = design.rim_thickness_mm / 2
    if design.is_internal:
        return Radii(cut_root, cut_tip, other_tip, other_root, cut_root - half_rim)
    return Radii(other_tip, other_root, cut_root, cut_tip, other_root + half_rim)


def unrolled_string(base_radius_mm: float, roll_rad: ArrayLike) -> NDArray[np.complex128]:
    """End of a string unrolled from a circle: an involute that leaves the circle on the real axis.

    Parameters
    ----------
    base_radius_mm : float
        Radius of the circle [mm].
    roll_rad : array_like, any shape
        Angle over which the string has left the circle [rad], 0 or more.

    Returns
    -------
    ndarray of complex, same shape
        End of the string [mm].
    """
    roll = np.asarray(roll_rad, dtype=float)
    radial = np.exp(1j * roll)
    return base_radius_mm * radial - base_radius_mm * roll * 1j * radial


def tooth_flank(
    teeth: int,
    shift: float,
    module_mm: float,
    pressure_angle_deg: float,
    inner_mm: float,
    outer_mm: float,
    points: int = FLANK_POINTS,
) -> NDArray[np.complex128]:
    """Upper involute flank of an external tooth, or of the internal space that such a tooth fills.

    Parameters
    ----------
    teeth : int
        Tooth count.
    shift : float
        Profile shift, in modules.
    module_mm : float
        Module [mm].
    pressure_angle_deg : float
        Pressure angle of the rack [deg].
    inner_mm, outer_mm : float
        Radii of the ends [mm]; the flank starts at the base circle where that is larger than the
        inner one.
    points : int
        Points on the flank, evenly spaced by roll angle.

    Returns
    -------
    ndarray of complex, shape (points,)
        Flank [mm] from the inner to the outer end; the tooth's axis is the real axis.

    Raises
    ------
    ValueError
        No involute between the two radii.
    """
    pressure_angle = math.radians(pressure_angle_deg)
    reference_mm = module_mm * teeth / 2
    base_mm = reference_mm * math.cos(pressure_angle)
    inner_mm = max(inner_mm, base_mm)
    if not outer_mm > inner_mm:
        raise ValueError(
            f"flank: found {inner_mm} to {outer_mm} mm, expected an end above root and base circle"
        )
    thickness_mm = module_mm * (math.pi / 2 + 2 * shift * math.tan(pressure_angle))
    on_reference = unrolled_string(base_mm, math.tan(pressure_angle))
    roll = np.linspace(
        math.sqrt((inner_mm / base_mm) ** 2 - 1), math.sqrt((outer_mm / base_mm) ** 2 - 1), points
    )
    turn = thickness_mm / 2 / reference_mm + np.angle(on_reference)
    return np.conj(unrolled_string(base_mm, roll)) * np.exp(1j * turn)


@lru_cache(maxsize=256)
def _flanks(design: Design, points: int) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Upper flanks [mm] of the flexspline tooth and rigid space (external: space and tooth)."""
    size = radii(design)
    tooling = (design.module_mm, design.pressure_angle_deg)
    flexspline = tooth_flank(
        design.flexspline_teeth,
        design.flexspline_shift,
        *tooling,
        size.flexspline_inner_mm,
        size.flexspline_outer_mm,
        points,
    )
    rigid = tooth_flank(
        design.rigid_teeth,
        design.rigid_shift,
        *tooling,
        size.rigid_inner_mm,
        size.rigid_outer_mm,
        points,
    )
    return flexspline, rigid


def _line(design: Design) -> NeutralLine:
    return neutral_line(
        design.generator_type,
        design.contact_half_angle_deg,
        radii(design).neutral_mm,
        design.deflection_mm if design.is_internal else -design.deflection_mm,
    )


def on_line(
    design: Design, points: NDArray[np.complex128], material_rad: float
) -> NDArray[np.complex128]:
    """Move points of the undeformed tooth at angle 0 to the tooth at a material angle."""
    neutral_mm = radii(design).neutral_mm
    origin, normal = place(_line(design), neutral_mm, material_rad)
    return origin + (points - neutral_mm) * normal


def frame_points(design: Design) -> NDArray[np.complex128]:
    """Foot of the undeformed tooth at angle 0 on the neutral line, and a module above it [mm]."""
    neutral_mm = radii(design).neutral_mm
    return np.array([neutral_mm, neutral_mm + design.module_mm], dtype=complex)


def rigid_axis_rad(design: Design, material_rad: ArrayLike) -> NDArray[np.float64]:
    """Axis of the rigid space that belongs to a flexspline tooth; both are on axis at angle 0."""
    return np.asarray(material_rad) * design.flexspline_teeth / design.rigid_teeth


def _plane(points: NDArray[np.complex128]) -> NDArray[np.float64]:
    return np.column_stack([points.real, points.imag])


@dataclass(frozen=True)
class Contact:
    """First contact of a flexspline tooth with the rigid gear.

    Attributes
    ----------
    gap_rad : float
        Turn from the unloaded position to contact [rad]; negative is interference.
    radius_mm : float
        Distance of the contact from the rotation axis [mm].
    """

    gap_rad: float
    radius_mm: float


def first_contact(
    design: Design,
    angle_deg: float,
    flank: str,
    points: int = FLANK_POINTS,
    moved_mm: complex = 0.0,
) -> Contact | None:
    """Turn the rigid gear until a flank touches the placed flexspline tooth.

    Parameters
    ----------
    design : Design
        The gear.
    angle_deg : float
        Material angle of the tooth (external deformation: of the flexspline space) from the
        deformation axis [deg], -90 to 90.
    flank : {"forward", "backward"}
        Forward: the flank that closes when the flexspline turns to larger angles.
    points : int
        Points a flank.
    moved_mm : complex
        Displacement of the flexspline against the rigid gear.

    Returns
    -------
    Contact or None
        None where the flanks share no radius.

    Raises
    ------
    ValueError
        Unknown flank name or an angle out of range.
    RuntimeError
        The search did not close.
    """
    if flank not in ("forward", "backward"):
        raise ValueError(f"flank: found {flank!r}, expected forward or backward")
    return turned_contact(design, *_flanks(design, points), angle_deg, flank, moved_mm)


def turned_contact(
    design: Design,
    flexspline: NDArray[np.complex128],
    rigid: NDArray[np.complex128],
    angle_deg: float,
    flank: str,
    moved_mm: complex = 0.0,
) -> Contact | None:
    """Turn the rigid gear until given upper flanks touch, as `first_contact` does.

    Parameters
    ----------
    design : Design
        Deformation, tooth counts and neutral line.
    flexspline, rigid : ndarray of complex, shape (n,)
        Upper flanks [mm] of the undeformed flexspline tooth and of the rigid space (external: space
        and tooth), from the inner to the outer end; the axis of each is the real axis.
    angle_deg, flank
        As in `first_contact`.
    moved_mm : complex
        Displacement of the flexspline against the rigid gear.
    """
    # The rigid gear moves towards the tooth; the leading flank of a tooth is the upper one, that of
    # a space the lower one.
    closing = -1 if flank == "forward" else 1
    upper = (flank == "forward") == design.is_internal
    if not upper:
        flexspline, rigid = np.conj(flexspline), np.conj(rigid)
    material_rad = math.radians(angle_deg)
    fixed = on_line(design, flexspline, material_rad) + moved_mm
    inner, outer = np.abs(fixed).min(), np.abs(fixed).max()
    if outer <= np.abs(rigid[0]) or inner >= np.abs(rigid[-1]):
        return None

    fixed_line = shapely.linestrings(_plane(fixed))
    shapely.prepare(fixed_line)
    reach_mm = np.abs(rigid[-1])
    rigid = rigid * np.exp(1j * rigid_axis_rad(design, material_rad))
    turn = -CLEAR_PITCHES * 2 * math.pi / design.rigid_teeth
    for _ in range(TURNS_MAX):
        moving_line = shapely.linestrings(_plane(rigid * np.exp(1j * closing * turn)))
        distance = shapely.distance(fixed_line, moving_line)
        if distance <= CONTACT_DISTANCE_MM:
            touching = shapely.get_coordinates(shapely.shortest_line(fixed_line, moving_line))
            return Contact(float(turn), float(np.hypot(*touching.mean(axis=0))))
        turn += distance / reach_mm
    raise RuntimeError(f"no contact after {TURNS_MAX} turns at {angle_deg} deg, {distance} mm left")


def gap_arcmin(design: Design, angle_deg: float, flank: str) -> float:
    """Turn of the rigid gear relative to a flexspline tooth until they touch.

    Parameters
    ----------
    design : Design
        The gear.
    angle_deg : float
        Material angle of the tooth (external deformation: of the flexspline space) from the
        deformation axis [deg], -90 to 90.
    flank : {"forward", "backward"}
        Forward: the flank that closes when the flexspline turns to larger angles.

    Returns
    -------
    float
        Gap [arcmin]; infinite where the teeth share no radius, negative where they interfere.
    """
    contact = first_contact(design, angle_deg, flank)
    return math.inf if contact is None else contact.gap_rad * ARCMIN_PER_RAD


def _land(start: complex, end: complex) -> NDArray[np.complex128]:
    """Points of the circular land between two corners of equal radius, corners left out."""
    share = np.linspace(0, 1, LAND_POINTS)[1:-1]
    return start * np.exp(1j * share * np.angle(end / start))


def _tooth(upper: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Outline of the tooth between an upper flank and its mirror image."""
    if upper[-1].imag <= 0:
        raise ValueError("the tooth is pointed below its tip circle: it has no outline")
    lower = np.conj(upper)
    return np.concatenate(
        [lower, _land(lower[-1], upper[-1]), upper[::-1], _land(upper[0], lower[0])]
    )


def _beside_space(
    upper: NDArray[np.complex128], end: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """Outline of the internal tooth from the upper flank of a space to another line outwards."""
    if upper[-1].imag <= 0:
        raise ValueError("the space closes below its root circle: the tooth has no outline")
    return np.concatenate([upper, _land(upper[-1], end[-1]), end[::-1], _land(end[0], upper[0])])


def flexspline_outline(design: Design, angle_deg: float) -> list[Polygon]:
    """Polygons of the flexspline at a material angle, where the deformed neutral line puts them.

    Parameters
    ----------
    design : Design
        The gear.
    angle_deg : float
        Material angle from the deformation axis [deg], -90 to 90.

    Returns
    -------
    list of shapely Polygon
        Internal deformation: the tooth. External: the two half teeth beside the space at that
        angle. Coordinates in mm.
    """
    upper, _ = _flanks(design, FLANK_POINTS)
    if design.is_internal:
        outlines = [_tooth(upper)]
    else:
        middle = np.abs(upper[[0, -1]]) * np.exp(1j * math.pi / design.flexspline_teeth)
        half_tooth = _beside_space(upper, middle)
        outlines = [half_tooth, np.conj(half_tooth)]
    return [Polygon(_plane(on_line(design, one, math.radians(angle_deg)))) for one in outlines]


def rigid_outline(design: Design, angle_deg: float, turn_rad: float = 0.0) -> list[Polygon]:
    """Polygons of the rigid gear near a flexspline tooth.

    Parameters
    ----------
    design : Design
        The gear.
    angle_deg : float
        Material angle of the flexspline tooth from the deformation axis [deg], -90 to 90.
    turn_rad : float
        Turn of the rigid gear from the unloaded position [rad], increasing angle positive.

    Returns
    -------
    list of shapely Polygon
        Internal deformation: two teeth on each side of the space that belongs to the tooth.
        External: the tooth that belongs to the space and one on each side. Coordinates in mm.
    """
    _, upper = _flanks(design, FLANK_POINTS)
    pitch = 2 * math.pi / design.rigid_teeth
    if design.is_internal:
        outline, numbers = _beside_space(upper, np.conj(upper) * np.exp(1j * pitch)), (-2, -1, 0, 1)
    else:
        outline, numbers = _tooth(upper), (-1, 0, 1)
    axis = rigid_axis_rad(design, math.radians(angle_deg)) + turn_rad
    return [Polygon(_plane(outline * np.exp(1j * (axis + number * pitch)))) for number in numbers]


def overlap_area_mm2(design: Design, angle_deg: float, twist_rad: float = 0.0) -> float:
    """Area that a placed flexspline tooth shares with the rigid gear.

    Parameters
    ----------
    design : Design
        The gear.
    angle_deg : float
        Material angle of the tooth (external deformation: of the flexspline space) from the
        deformation axis [deg], -90 to 90.
    twist_rad : float
        Turn of the flexspline tooth relative to the rigid gear about the rotation axis [rad],
        increasing angle positive: the forward flank touches at the forward gap, the backward flank
        at minus the backward gap.

    Returns
    -------
    float
        Area [mm**2]; 0 where the teeth are clear of each other on both flanks.
    """
    placed = flexspline_outline(design, angle_deg)
    rigid = rigid_outline(design, angle_deg, -twist_rad)
    return float(
        sum(shapely.area(shapely.intersection(one, other)) for one in placed for other in rigid)
    )


def meshing_outline(
    design: Design, angles_deg: Iterable[float]
) -> tuple[list[Polygon], list[Polygon]]:
    """Outlines to draw a mesh.

    Parameters
    ----------
    design : Design
        The gear.
    angles_deg : iterable of float
        Material angles of the teeth to draw [deg], one flexspline pitch apart so that the rigid
        teeth fall on each other.

    Returns
    -------
    flexspline, rigid : list of shapely Polygon
        Placed flexspline teeth and the rigid teeth around them [mm].
    """
    angles = list(angles_deg)
    flexspline = [polygon for angle in angles for polygon in flexspline_outline(design, angle)]
    rigid = [polygon for angle in angles for polygon in rigid_outline(design, angle)]
    return flexspline, rigid
