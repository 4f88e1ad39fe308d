"""One complete evaluation of a strain-wave drive design in NumPy and SciPy, tuned for speed.

It shows the speed that is possible without a compiler: arrays over all teeth, phases and flank
points at once, the take-up from event to event, symmetry halves the work. plain_numpy is the same
evaluation written as the theory prescribes.

Lengths are in mm, forces in N, angles in rad and torques in N·mm inside; the keys of a design and
of a result carry their unit. Angles are measured from the deformation axis: the major axis of an
internal wave generator, the minor axis of an external ring. A forward flank closes under positive
torque. Two lobes share the torque equally.

The pieces can be called one by one: `geometry`, `neutral_line`, `clearances`, `mesh_contacts`,
`mesh_path`, `characteristic`, `checks`; `evaluate` runs them all.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import simpson
from scipy.optimize import brentq, nnls

Array = NDArray[np.float64]
Design = Mapping[str, Any]

ARCMIN = np.pi / (180.0 * 60.0)
LOBES = 2
QUADRANT_POINTS = 2001
FLANK_POINTS = 100
PHASES = 8
TORQUES = 33
SUPPORT_MARGIN_DEG = 25.0  # the ring is unsupported this far beyond the wave generator's contact
GAP_LIMIT_ARCMIN = 8.0  # teeth with a wider gap do not engage below twice the rated torque
LOST_MOTION_SHARE = 0.04  # of the rated torque, catalogue definition of reversal lost motion
POINT_RING = 0.0744  # radial deflection of a ring under two opposite forces, F r^3 / (E I)
BALL_CONTACTS = 4.36e-4  # mm N^(-2/3) mm^(1/3), both contacts of one ball in steel races

REFERENCE_A: dict[str, Any] = {
    "module_mm": 0.25,
    "flexspline_teeth": 200,
    "rigid_teeth": 202,
    "pressure_angle_deg": 20.0,
    "flexspline_shift": 3.0,
    "rigid_shift": 2.957,
    "tooth_height": 1.75,
    "engagement_depth": 1.2,
    "root_clearance": 0.35,
    "root_tip_clearance": 0.2,
    "face_width_mm": 10.0,
    "generator": "discs",
    "deflection_mm": 0.2375,
    "contact_half_angle_deg": 30.0,
    "rim_thickness_mm": 0.6,
    "wall_thickness_mm": 0.35,
    "wall_radius_mm": 24.7,
    "rated_torque_Nm": 40.0,
    "radial_gap_mm": 0.0,
    "ring_stiffening": 3.0,
    "pair_compliance_mm_per_N": 3.5e-6,
    "foundation_N_per_mm2": 2600.0,
    "ring_bending_N_mm2": 3.5e5,
    "radial_factor": 7.88,
    "radial_chain": (),
    "torsion_chain": ({"stiffness_Nm_per_rad": 4.48e4},),
    "young_MPa": 2.1e5,
    "shear_MPa": 8.0e4,
    "poisson": 0.3,
    "fatigue_bending_MPa": 470.0,
    "fatigue_shear_MPa": 270.0,
    "notch_bending": 1.8,
    "notch_shear": 1.6,
    "mean_stress_bending": 0.1,
    "mean_stress_shear": 0.1,
    "tooth_factor": 1.45,
    "safety_factor_min": 1.5,
    "gap_min_arcmin": 0.0,
}
"""Size 20, ratio 100, calibrated: the radial chain is inside `radial_factor`."""

REFERENCE_A_FIRST_PRINCIPLES: dict[str, Any] = REFERENCE_A | {
    "radial_gap_mm": 0.01,
    "pair_compliance_mm_per_N": None,
    "radial_factor": 1.0,
    "radial_chain": (
        {"kind": "balls", "diameter_mm": 3.97, "share": 0.3, "preload_N": 15.0},
        {"kind": "rim", "inner_mm": 25.79, "outer_mm": 35.0, "width_mm": 10.0, "relief": 3.0},
    ),
    "torsion_chain": (
        {"stiffness_Nm_per_rad": 2.21e5},
        {"stiffness_Nm_per_rad": 1.79e5},
        {"length_mm": 30.0, "diameter_mm": 8.0, "ratio": 100.0},
        {"length_mm": 40.0, "diameter_mm": 25.0, "ratio": 1.0},
    ),
}
"""The same teeth with every compliance from its formula and a radial gap of 10 µm."""

REFERENCE_E: dict[str, Any] = REFERENCE_A | {
    "flexspline_teeth": 202,
    "rigid_teeth": 200,
    "rigid_shift": 3.05,
    "generator": "ring",
    "wall_radius_mm": 26.5,
}
"""External deformation: a ring outside, internal teeth on the flexspline."""


# ------------------------------------------------------------------------------ wave generator
# shapes


def shape(kind: str, beta: float, phi: Array) -> tuple[Array, Array, Array]:
    """Give the radial shape of the ring on its wave generator, unit deflection at the axis.

    Parameters
    ----------
    kind : {"cosine", "discs", "ring", "rollers"}
        Generator. A ring has the disc shape about the minor axis; its sign is the caller's.
        Two rollers are "rollers" with `beta` = 0.
    beta : float
        Half angle of contact, rad. Valid below about 35 deg for rollers.
    phi : ndarray, shape (n,)
        Angle from the deformation axis, rad, within -pi/2 .. pi/2.

    Returns
    -------
    w, slope, curvature : ndarray, shape (n,)
        Radial displacement, its derivative by the angle, and -(w'' + w).
    """
    sign, a = np.sign(phi), np.abs(phi)
    if kind == "cosine":
        return np.cos(2 * a), -2 * np.sin(2 * phi), 3 * np.cos(2 * a)
    s, c, x, p = np.sin(beta), np.cos(beta), np.pi / 2 - beta, np.pi / 2 - a
    near = a <= beta
    sa, ca = np.sin(a), np.cos(a)  # equal to cos p and sin p
    if kind in ("discs", "ring"):
        cap_c, cap_d, cap_e, cap_f, cap_g = _disc_constants(beta)
        w = np.where(near, cap_c + cap_d * ca, cap_e + cap_f * sa + cap_g * p * ca)
        slope = np.where(near, -cap_d * sa, cap_f * ca - cap_g * (ca + p * sa))
        curvature = -np.where(near, cap_c, cap_e + 2 * cap_g * sa)
        return w, sign * slope, curvature
    if kind == "rollers":
        cap_a = s + x * c
        cap_d, k = cap_a - 4 / np.pi, c + beta * s
        w = np.where(near, cap_a * ca + a * sa * s, k * sa + p * ca * c) - 4 / np.pi
        slope = np.where(near, -cap_a * sa + s * (sa + a * ca), k * ca - c * (ca + p * sa))
        curvature = 4 / np.pi - 2 * np.where(near, s * ca, c * sa)
        return w / cap_d, sign * slope / cap_d, curvature / cap_d
    raise ValueError(f"generator: found {kind!r}, expected cosine, discs, ring or rollers")


def first_order(kind: str, beta: float, phi: Array) -> tuple[Array, Array, Array]:
    """Give the first-order displacement and rotation of the inextensible ring.

    Parameters
    ----------
    kind, beta, phi
        As for `shape`, with `phi` within 0 .. pi/2.

    Returns
    -------
    w, v, theta : ndarray, shape (n,)
        Radial and tangential displacement per deflection, rotation times radius per deflection.
    """
    w, slope, _ = shape(kind, beta, phi)
    s, c, p = np.sin(beta), np.cos(beta), np.pi / 2 - phi
    near = phi <= beta
    sa, ca = np.sin(phi), np.cos(phi)
    if kind == "cosine":
        v = -0.5 * np.sin(2 * phi)
    elif kind == "rollers":
        cap_a, k = s + (np.pi / 2 - beta) * c, c + beta * s
        inside = -(cap_a * sa + s * (sa - phi * ca) - 4 / np.pi * phi)
        outside = k * ca - c * (p * sa - ca) + 4 / np.pi * phi - 2
        v = np.where(near, inside, outside) / (cap_a - 4 / np.pi)
    else:
        cap_c, cap_d, cap_e, cap_f, cap_g = _disc_constants(beta)
        outside = cap_e * p + cap_f * ca + cap_g * (ca - p * sa)
        v = np.where(near, -(cap_c * phi + cap_d * sa), outside)
    return w, v, v - slope


def _disc_constants(beta: float) -> tuple[float, float, float, float, float]:
    """Give C, D, E, F, G of the arc of constant curvature and the free ring beyond it."""
    s, c, x = np.sin(beta), np.cos(beta), np.pi / 2 - beta
    cap_g = (np.pi / 2) / (np.pi / 2 * (x - s * c) + 2 * x * s - 2 * c)
    cap_d = cap_g * (x - s * c)
    cap_f = cap_g * (1 + s * s)
    cap_e = 1 - cap_d + cap_d * c - cap_f * s - cap_g * x * c
    return 1 - cap_d, cap_d, cap_e, cap_f, cap_g


# ------------------------------------------------------------------------------ radii and flanks


def half_angle(rho: Array, teeth: int, shift: float, alpha: float, base: float) -> Array:
    """Give the half angle of an involute tooth, or of the space it would fill.

    Parameters
    ----------
    rho : ndarray
        Radius, mm, not below `base`.
    teeth, shift, alpha, base
        Number of teeth, profile shift in modules, rack angle in rad, base radius in mm.

    Returns
    -------
    ndarray
        Half angle at the gear's centre, rad, shape of `rho`.
    """
    reference = np.pi / (2 * teeth) + 2 * shift * np.tan(alpha) / teeth + np.tan(alpha) - alpha
    tangent = np.sqrt(np.maximum((rho / base) ** 2 - 1, 0.0))
    return reference - (tangent - np.arctan(tangent))


def geometry(design: Design) -> dict[str, Any]:
    """Give radii and tooth data of a design.

    Parameters
    ----------
    design : mapping
        Keys as in `REFERENCE_A`.

    Returns
    -------
    dict
        `external` (bool), `module`, `alpha`, `beta`, `deflection`, `kind`; neutral radius `r_m`;
        flexspline `z_f, x_f, base_f, tip_f, root_f`; rigid gear `z_r, x_r, base_r, tip_r, root_r`.
        Lengths in mm, angles in rad.
    """
    m, alpha = design["module_mm"], np.radians(design["pressure_angle_deg"])
    z_f, z_r = design["flexspline_teeth"], design["rigid_teeth"]
    x_f, x_r, w0 = design["flexspline_shift"], design["rigid_shift"], design["deflection_mm"]
    height, depth = design["tooth_height"] * m, design["engagement_depth"] * m
    root_gap = design["root_tip_clearance"] * m
    external = design["generator"] == "ring"
    if z_f - z_r != (2 if external else -2):
        raise ValueError(f"teeth: found {z_f} and {z_r}, expected a difference of two")
    if external:
        root_r = m * z_r / 2 + m * (x_r - 1 - design["root_clearance"])
        tip_r = root_r + height
        tip_f, root_f = tip_r + w0 - depth, tip_r + w0 + root_gap
        r_m = root_f + design["rim_thickness_mm"] / 2
    else:
        root_f = m * z_f / 2 + m * (x_f - 1 - design["root_clearance"])
        tip_f = root_f + height
        tip_r, root_r = tip_f + w0 - depth, tip_f + w0 + root_gap
        r_m = root_f - design["rim_thickness_mm"] / 2
    return {
        "external": external,
        "module": m,
        "alpha": alpha,
        "kind": design["generator"],
        "beta": np.radians(design["contact_half_angle_deg"]),
        "deflection": w0,
        "r_m": r_m,
        "z_f": z_f,
        "x_f": x_f,
        "base_f": m * z_f * np.cos(alpha) / 2,
        "tip_f": tip_f,
        "root_f": root_f,
        "z_r": z_r,
        "x_r": x_r,
        "base_r": m * z_r * np.cos(alpha) / 2,
        "tip_r": tip_r,
        "root_r": root_r,
        "mean_radius": (tip_f + tip_r) / 2,
    }


# ------------------------------------------------------------------------------ neutral line


def neutral_line(
    kind: str, beta: float, radius: float, deflection: float, points: int = QUADRANT_POINTS
) -> dict[str, Any]:
    """Give the deformed neutral line of one quadrant by its exact arc length.

    Parameters
    ----------
    kind, beta
        Wave generator, as for `shape`.
    radius, deflection : float
        Undeformed radius and deflection at the axis, mm. A ring presses inward.
    points : int
        Entries of the table.

    Returns
    -------
    dict
        `c0` (mm, radius change that closes the length), `polar` and `arc`, shape (points,): polar
        angle in rad and arc length in mm from the axis; and what `place` needs.
    """
    sign = -1.0 if kind == "ring" else 1.0
    polar = np.linspace(0.0, np.pi / 2, points)
    w, slope, _ = shape(kind, beta, polar)
    target = np.pi / 2 * radius
    c0 = 0.0
    for _ in range(4):  # Newton: the length is nearly linear in c0
        r = radius + sign * ((deflection - c0) * w + c0)
        dr = sign * (deflection - c0) * slope
        speed = np.hypot(r, dr)
        change = sign * simpson((r * (1 - w) - dr * slope) / speed, x=polar)
        step = (simpson(speed, x=polar) - target) / change
        c0 -= step
        if abs(step) < 1e-13 * radius:
            break
    arc = np.concatenate(([0.0], np.cumsum((speed[1:] + speed[:-1]) / 2)))
    return {
        "kind": kind,
        "beta": beta,
        "radius": radius,
        "amplitude": sign * (deflection - c0),
        "offset": sign * c0,
        "c0": c0,
        "polar": polar,
        "arc": arc * (target / arc[-1]),
    }


def place(line: Mapping[str, Any], phi: Array) -> tuple[Array, Array, Array]:
    """Place teeth of given material angle on the deformed neutral line.

    Parameters
    ----------
    line : mapping
        From `neutral_line`.
    phi : ndarray, shape (n,)
        Material angle, rad, within -pi/2 .. pi/2.

    Returns
    -------
    radius, polar, normal : ndarray, shape (n,)
        Position of the tooth's foot, mm and rad, and direction of its axis, rad.
    """
    polar = np.interp(line["radius"] * np.abs(phi), line["arc"], line["polar"])
    polar = np.copysign(polar, phi)
    w, slope, _ = shape(line["kind"], line["beta"], polar)
    radius = line["radius"] + line["amplitude"] * w + line["offset"]
    return radius, polar, polar - np.arctan2(line["amplitude"] * slope, radius)


# ------------------------------------------------------------------------------ clearances


def clearances(
    geo: Mapping[str, Any], line: Mapping[str, Any], phi: Array, forward: bool = True
) -> dict[str, Array]:
    """Give the rotation to first contact of one flank of every tooth.

    A rotation of the rigid gear keeps the radius, so the gap is the smallest difference of the
    polar angles over the radii common to both flanks. The flank is sampled between the two end
    points of the overlap (tip corner of the one gear, tip corner of the other); both ends are
    samples, because contact is usually there.

    Parameters
    ----------
    geo, line : mapping
        From `geometry` and `neutral_line`.
    phi : ndarray, shape (n,)
        Tooth angles, rad, within -pi/2 .. pi/2.
    forward : bool
        Flank that closes for positive torque, else the other one.

    Returns
    -------
    dict of ndarray, shape (n,)
        `gap` in rad (negative: interference, inf: no overlap); `radius` of contact in mm;
        `flank_angle` between flank and tooth axis there, rad; `flexspline_radius` of the contact
        in the undeformed flexspline, mm. The last three are NaN without overlap.
    """
    inside = -1.0 if geo["external"] else 1.0
    side = inside if forward else -inside
    radius, polar, normal = place(line, phi)
    lead = polar - phi * (geo["z_f"] / geo["z_r"])
    tilt = normal - polar
    flank_f = (geo["z_f"], geo["x_f"], geo["alpha"], geo["base_f"])
    flank_r = (geo["z_r"], geo["x_r"], geo["alpha"], geo["base_r"])

    def reach(rho: Array, foot: Array, cos_tilt: Array, sin_tilt: Array) -> tuple[Array, Array]:
        """Give flank points along and across the radius through the tooth's foot."""
        xi = half_angle(rho, *flank_f)
        x, y = side * rho * np.sin(xi), rho * np.cos(xi) - geo["r_m"]
        return foot + y * cos_tilt - x * sin_tilt, y * sin_tilt + x * cos_tilt

    result = {
        "gap": np.full(phi.shape, np.inf),
        "radius": np.full(phi.shape, np.nan),
        "flank_angle": np.full(phi.shape, np.nan),
        "flexspline_radius": np.full(phi.shape, np.nan),
    }
    frame = radius, np.cos(tilt), np.sin(tilt)
    tip_reach = np.hypot(*reach(np.full(phi.shape, geo["tip_f"]), *frame))
    overlap = np.flatnonzero(inside * (tip_reach - geo["tip_r"]) > 0)
    if overlap.size == 0:
        return result
    frame = frame[0][overlap], frame[1][overlap], frame[2][overlap]

    # Where the flexspline's flank crosses the rigid tip circle: secant, the reach is almost linear.
    deep = max(geo["root_f"], geo["base_f"])
    rho0 = np.full(overlap.shape, geo["tip_f"])
    miss0 = tip_reach[overlap] - geo["tip_r"]
    rho1 = rho0 - miss0
    for _ in range(4):
        miss1 = np.hypot(*reach(rho1, *frame)) - geo["tip_r"]
        change = np.where(miss1 == miss0, 1.0, miss1 - miss0)
        rho0, miss0, rho1 = rho1, miss1, rho1 - miss1 * (rho1 - rho0) / change
    end = np.clip(rho1, *sorted((deep, geo["tip_f"])))

    t = np.linspace(0.0, 1.0, FLANK_POINTS)
    rho = geo["tip_f"] + (end - geo["tip_f"])[:, None] * t
    along, across = reach(rho, *(f[:, None] for f in frame))
    common = np.hypot(along, across)
    angle = lead[overlap, None] + np.arctan(across / along)
    error = inside * (half_angle(common, *flank_r) - side * angle)
    best = np.argmin(error, axis=1)
    rows = np.arange(best.size)
    contact = common[rows, best]
    result["gap"][overlap] = error[rows, best]
    result["radius"][overlap] = contact
    result["flank_angle"][overlap] = np.arccos(geo["base_r"] / contact) - half_angle(
        contact, *flank_r
    )
    result["flexspline_radius"][overlap] = rho[rows, best]
    return result


def tooth_angles(teeth: int, phase: float = 0.0) -> Array:
    """Give the angles of the teeth within -90 .. 90 deg of one lobe, rad, ascending.

    `phase` is the position of the middle tooth, in tooth pitches.
    """
    first = np.ceil(-teeth / 4 - phase - 1e-9)
    last = np.floor(teeth / 4 - phase + 1e-9)
    phi = (np.arange(first, last + 1) + phase) * (2 * np.pi / teeth)
    return np.clip(phi, -np.pi / 2, np.pi / 2)


def clearances_by_phase(geo: Mapping[str, Any], line: Mapping[str, Any]) -> dict[str, Array]:
    """Give the clearances of both flanks at `PHASES` equally spaced tooth phases.

    The phases k/8 and 1 - k/8 of a pitch mirror each other, and so do the flanks; the backward
    flank at an angle is the forward flank at the opposite angle, which is in the list.

    Returns
    -------
    dict of ndarray, shape (n,)
        `angle` ascending in rad, the fields of `clearances` for the forward flank, and the same
        with the prefix `backward_`. Every `PHASES`-th tooth has the same phase.
    """
    phi = tooth_angles(geo["z_f"] * PHASES)
    ahead = clearances(geo, line, phi)
    return {"angle": phi} | ahead | {f"backward_{key}": v[::-1] for key, v in ahead.items()}


def _middle_phase(gaps: Mapping[str, Array]) -> dict[str, Array]:
    """Select the phase of `clearances_by_phase` with a tooth on the axis."""
    first = gaps["angle"].size // 2 % PHASES
    return {key: v[first::PHASES] for key, v in gaps.items()}


# ------------------------------------------------------------------------------ tooth compliance


def tooth_compliance(
    half_thickness: Callable[[Array], Array],
    height: Array,
    angle: Array,
    width: float,
    young: float = 2.1e5,
    shear: float = 8.0e4,
    points: int = 24,
) -> Array:
    """Give the deflection along the force per force of a cantilever tooth (energy integral).

    Parameters
    ----------
    half_thickness : callable
        Maps heights above the root, shape (n, points) in mm, to half thicknesses in mm.
    height, angle : ndarray, shape (n,)
        Height of the load above the root, mm, and its angle to the tooth's normal plane, rad.
    width, young, shear : float
        Face width in mm, moduli in MPa.
    points : int
        Gauss points over the height.

    Returns
    -------
    ndarray, shape (n,)
        Bending, shear and compression together, mm/N.
    """
    nodes, weights = np.polynomial.legendre.leggauss(points)
    y = height[:, None] * (nodes + 1) / 2
    thick = 2 * half_thickness(y)
    cos2 = np.cos(angle)[:, None] ** 2
    arm = height[:, None] - y
    density = cos2 * (12 * arm**2 / (young * width * thick**3) + 1.2 / (shear * width * thick))
    density += (1 - cos2) / (young * width * thick)
    return (density @ weights) * height / 2


def foundation_compliance(
    height: Array, root: float, angle: Array, width: float, young: float, poisson: float
) -> Array:
    """Give the compliance of the body below a tooth (Weber, plane strain), mm/N.

    `height` (n,) of the load above the root and `root` thickness in mm, `angle` (n,) in rad.
    """
    ratio = height / root
    plane = 1 - poisson**2
    terms = 5.306 * ratio**2 + 2 * (1 - poisson - 2 * poisson**2) / plane * ratio
    terms += 1.534 * (1 + 0.4167 * np.tan(angle) ** 2 / (1 + poisson))
    return np.cos(angle) ** 2 * plane / (width * young) * terms


def pair_compliance(
    design: Design, geo: Mapping[str, Any], rigid_radius: Array, flexspline_radius: Array
) -> dict[str, Array]:
    """Give the compliance of both teeth of each contact, along the force.

    Parameters
    ----------
    design, geo : mapping
        Design and its `geometry`.
    rigid_radius, flexspline_radius : ndarray, shape (n,)
        Radius of contact on either gear, mm.

    Returns
    -------
    dict of ndarray, shape (n,)
        `flexspline`, `rigid` and `pair`, mm/N, each with its foundation.
    """
    width, young, nu = design["face_width_mm"], design["young_MPa"], design["poisson"]

    def one(gear: str, rho: Array, internal: bool) -> Array:
        flank = (geo[f"z_{gear}"], geo[f"x_{gear}"], geo["alpha"], geo[f"base_{gear}"])
        base, root = geo[f"base_{gear}"], geo[f"root_{gear}"]
        inward = -1.0 if internal else 1.0

        def tooth_half(at: Array) -> Array:
            xi = half_angle(at, *flank)
            return np.pi / geo[f"z_{gear}"] - xi if internal else xi

        def half_thickness(y: Array) -> Array:
            at = root + inward * y
            return at * tooth_half(at)

        height = inward * (rho - root)
        # The flank of an internal tooth leans the other way about its own axis.
        angle = np.arccos(base / rho) - inward * tooth_half(rho)
        bend = tooth_compliance(half_thickness, height, angle, width, young, design["shear_MPa"])
        thick = float(2 * half_thickness(np.zeros(1))[0])
        return bend + foundation_compliance(height, thick, angle, width, young, nu)

    flexspline = one("f", flexspline_radius, geo["external"])
    rigid = one("r", rigid_radius, not geo["external"])
    return {"flexspline": flexspline, "rigid": rigid, "pair": flexspline + rigid}


# ------------------------------------------------------------------------------ mesh under load


def independent_springs(
    gap: Array, stiffness: Array, torque: Array
) -> tuple[Array, NDArray[np.int_]]:
    """Give rotation and number of engaged teeth of independent unilateral springs.

    Parameters
    ----------
    gap, stiffness : ndarray, shape (n,)
        Gap of each tooth in rad and its rotational stiffness in N·m/rad, both lobes listed.
    torque : ndarray, shape (m,)
        Positive torques, N·m.

    Returns
    -------
    rotation : ndarray, shape (m,)
        rad.
    engaged : ndarray of int, shape (m,)
    """
    order = np.argsort(gap)
    g, k = gap[order], stiffness[order]
    total, moment = np.cumsum(k), np.cumsum(k * g)
    events = g[1:] * total[:-1] - moment[:-1]
    stage = np.searchsorted(events, torque, side="right")
    return (torque + moment[stage]) / total[stage], stage + 1


def mesh_contacts(
    design: Design,
    phase: float = 0.0,
    flank_angle: float | None = None,
    from_first_contact: bool = False,
    section_factors: Array | None = None,
) -> dict[str, Any]:
    """List the contacts that can carry load, both flanks, with their compliance matrix.

    Parameters
    ----------
    design : mapping
        Keys as in `REFERENCE_A`. `pair_compliance_mm_per_N` None takes each pair's own value.
    phase : float
        Position of the middle tooth, tooth pitches.
    flank_angle : float, optional
        One angle for all contacts, rad, in place of each contact's own.
    from_first_contact : bool
        Subtract the smallest forward gap from all gaps.
    section_factors : ndarray, shape (S,), optional
        Spatial model: deflection of each axial section by that of the middle, from the inner edge
        of the rim to the open end. Each section has 1/S of the face width. All sections bear on
        one ring and one wave generator; section s twists by the torque carried outward of it, its
        torque acting at the middle of its slice.

    Returns
    -------
    dict
        ndarrays over contacts, shape (n,): `angle`, `gap` (rad), `radius` (mm), `sign` (+1 forward,
        -1 backward), `section`, `tooth` (tangential tooth compliance, mm/N); `compliance` (n, n).
    """
    geo = geometry(design)
    factors = np.ones(1) if section_factors is None else section_factors
    phi = tooth_angles(geo["z_f"], phase)
    sections = []
    for factor in factors:
        line = neutral_line(geo["kind"], geo["beta"], geo["r_m"], factor * geo["deflection"])
        ahead, back = clearances(geo, line, phi), clearances(geo, line, phi, forward=False)
        sections.append({"angle": phi} | ahead | {f"backward_{k}": v for k, v in back.items()})
    return _contacts(design, geo, sections, flank_angle, from_first_contact)


def _contacts(
    design: Design,
    geo: Mapping[str, Any],
    sections: list[dict[str, Array]],
    flank_angle: float | None = None,
    from_first_contact: bool = False,
) -> dict[str, Any]:
    """Build the contact list of `mesh_contacts` from the clearances of each section."""
    parts = []
    for number, field in enumerate(sections):
        held = np.abs(field["angle"]) < geo["beta"] + np.radians(SUPPORT_MARGIN_DEG)
        for sign, prefix in ((1.0, ""), (-1.0, "backward_")):
            near = held & (field[f"{prefix}gap"] < GAP_LIMIT_ARCMIN * ARCMIN)
            names = ("gap", "radius", "flank_angle", "flexspline_radius")
            rows = {k: field[prefix + k][near] for k in names}
            rows |= {"angle": field["angle"][near], "sign": np.full(near.sum(), sign)}
            parts.append(rows | {"section": np.full(near.sum(), number)})
    c = {k: np.concatenate([p[k] for p in parts]) for k in parts[0]}
    if not (c["sign"] > 0).any():
        raise ValueError("mesh: found no tooth that can engage, expected a smaller gap")
    if from_first_contact:
        c["gap"] = c["gap"] - c["gap"][c["sign"] > 0].min()
    alpha = c["flank_angle"] if flank_angle is None else np.full_like(c["gap"], flank_angle)
    pair = design["pair_compliance_mm_per_N"]
    if pair is None:
        pair = pair_compliance(design, geo, c["radius"], c["flexspline_radius"])["pair"]
    c["tooth"] = len(sections) * pair / np.cos(alpha) ** 2 * np.ones_like(alpha)

    bed = design["foundation_N_per_mm2"]
    decay = (bed / (4 * design["ring_bending_N_mm2"])) ** 0.25
    s = decay * geo["r_m"] * np.abs(c["angle"][:, None] - c["angle"])
    ring = design["radial_factor"] * decay / (2 * bed) * np.exp(-s) * (np.cos(s) + np.sin(s))
    tangent = np.tan(alpha)
    matrix = tangent[:, None] * tangent * ring
    matrix[np.diag_indices_from(matrix)] += c["tooth"]
    if len(sections) > 1:
        z = (c["section"] + 0.5) * design["face_width_mm"] / len(sections)
        polar_moment = 2 * np.pi * geo["r_m"] ** 3 * design["rim_thickness_mm"]
        lever = c["sign"] * c["radius"]
        twist = np.minimum(z[:, None], z) / (design["shear_MPa"] * polar_moment)
        matrix += LOBES * lever[:, None] * lever * twist
    return c | {"compliance": matrix}


def contact_forces(contacts: Mapping[str, Any], rotation: float) -> Array:
    """Give the contact forces of one lobe at a given rotation (unilateral contact by NNLS).

    `rotation` in rad; returns the tangential forces, shape (n,), N.
    """
    factor = np.linalg.cholesky(contacts["compliance"])
    closing = contacts["radius"] * (contacts["sign"] * rotation - contacts["gap"])
    return nnls(factor.T, np.linalg.solve(factor, closing), maxiter=50 * closing.size)[0]


def rotation_by_nnls(contacts: Mapping[str, Any], torque: float) -> float:
    """Give the rotation at one torque by a root finder around NNLS, rad.

    The slower way, kept as an independent check of `mesh_path`. `torque` in N·mm, positive.
    """
    lever = LOBES * contacts["sign"] * contacts["radius"]
    low = contacts["gap"][contacts["sign"] > 0].min()
    high = max(low, 0.0) + ARCMIN
    while lever @ contact_forces(contacts, high) < torque:
        high *= 2

    def miss(rotation: float) -> float:
        return float(lever @ contact_forces(contacts, rotation)) - torque

    return float(brentq(miss, low, high, xtol=1e-13))


def mesh_path(contacts: Mapping[str, Any], torque_max: float) -> dict[str, Array]:
    """Follow the mesh from zero torque upward, from one change of contact to the next.

    Between changes the active forces are linear in the rotation. A change is a gap that closes
    or a force that vanishes. Interference starts from the equilibrium of both flanks.

    Parameters
    ----------
    contacts : mapping
        From `mesh_contacts`.
    torque_max : float
        N·mm, positive.

    Returns
    -------
    dict of ndarray
        `rotation` (rad) and `torque` (N·mm), shape (k,); `force` per contact of one lobe, shape
        (k, n), N. Linear between rows.
    """
    r, sign, gap = contacts["radius"], contacts["sign"], contacts["gap"]
    c, lever = contacts["compliance"], sign * r
    ahead = gap[sign > 0].min()
    back = gap[sign < 0].min() if (sign < 0).any() else np.inf
    force = np.zeros_like(gap)
    if ahead + back >= 0:
        rotation = ahead
    else:
        rotation = brentq(
            lambda x: float(lever @ contact_forces(contacts, x)), ahead, -back, xtol=1e-14
        )
        force = contact_forces(contacts, rotation)
    active = force > 0
    rows = [(rotation, LOBES * lever @ force, force)]
    while rows[-1][1] < torque_max:
        if len(rows) > 10 * gap.size:
            raise RuntimeError(f"mesh: no end after {len(rows)} changes of contact")
        on, off = np.flatnonzero(active), np.flatnonzero(~active)
        # force[on] = rate * rotation + start
        right = np.stack((lever[on], -r[on] * gap[on]), axis=1)
        rate, start = np.linalg.solve(c[np.ix_(on, on)], right).T
        # closing[off] = speed * rotation + lag: penetration of a force-free contact
        cross = c[np.ix_(off, on)]
        speed, lag = lever[off] - cross @ rate, -r[off] * gap[off] - cross @ start
        when = np.full(gap.shape, np.inf)
        falling, rising = rate < 0, speed > 0
        when[on[falling]] = -start[falling] / rate[falling]
        when[off[rising]] = -lag[rising] / speed[rising]
        change = int(np.argmin(when))
        following = max(when[change], rotation)
        slope = LOBES * lever[on] @ rate
        last = rows[-1][1] + slope * (following - rotation) >= torque_max
        if last:
            following = rotation + (torque_max - rows[-1][1]) / slope
        rotation = following
        force = np.zeros_like(gap)
        force[on] = np.maximum(rate * rotation + start, 0.0)
        if not last:
            active[change] = not active[change]
            force[change] = 0.0
        rows.append((rotation, torque_max if last else LOBES * lever @ force, force))
    rotations, torques, forces = zip(*rows, strict=True)
    return {"rotation": np.array(rotations), "torque": np.array(torques), "force": np.array(forces)}


def mesh_shares(
    contacts: Mapping[str, Any], path: Mapping[str, Array], torque: Array
) -> dict[str, Array]:
    """Read a path at positive torques and split the rotation into its causes.

    Every loaded contact satisfies rotation = sign (gap + deflection / radius); the shares are
    the means of its terms, weighted with force times radius. They add to the rotation.

    Parameters
    ----------
    contacts, path : mapping
        From `mesh_contacts` and `mesh_path`.
    torque : ndarray, shape (m,)
        N·mm, positive, within the path.

    Returns
    -------
    dict of ndarray, shape (m,)
        `rotation`, `clearance`, `tooth`, `ring` in rad; `engaged` forward contacts of one lobe.
    """
    row = np.clip(np.searchsorted(path["torque"], torque) - 1, 0, path["torque"].size - 2)
    span = path["torque"][row + 1] - path["torque"][row]
    part = np.where(span > 0, (torque - path["torque"][row]) / np.where(span > 0, span, 1.0), 0.0)
    rotation = path["rotation"][row] + part * (path["rotation"][row + 1] - path["rotation"][row])
    force = path["force"][row]
    force = force + part[:, None] * (path["force"][row + 1] - force)
    moment = force * contacts["radius"]
    idle = moment.sum(axis=1) <= 0  # at rest the nearest tooth stands for all
    moment[idle, np.argmin(np.where(contacts["sign"] > 0, contacts["gap"], np.inf))] = 1.0
    weight = contacts["sign"] * moment / moment.sum(axis=1, keepdims=True)
    clearance = weight @ contacts["gap"]
    tooth = (weight * force) @ (contacts["tooth"] / contacts["radius"])
    return {
        "rotation": rotation,
        "clearance": clearance,
        "tooth": tooth,
        "ring": rotation - clearance - tooth,
        "engaged": ((force > 0) & (contacts["sign"] > 0)).sum(axis=1),
    }


# ------------------------------------------------------------------------------ other compliances


def radial_gap_rotation(design: Design, geo: Mapping[str, Any], torque: Array) -> Array:
    """Give the rotation that a radial gap allows until the torque has closed it, rad.

    `torque` in N·mm, any sign, shape (m,).
    """
    gap = design["radial_gap_mm"]
    tangent, r = np.tan(geo["wedge"]), geo["mean_radius"]
    second_moment = design["face_width_mm"] * design["rim_thickness_mm"] ** 3 / 12
    bending = design["young_MPa"] * second_moment
    stiffness = design["ring_stiffening"] * bending / (POINT_RING * geo["r_m"] ** 3)
    closing = 2 * r * stiffness * gap / tangent
    share = np.clip(torque / closing, -1.0, 1.0) if closing > 0 else np.zeros_like(torque)
    return share * gap * tangent / r


def radial_chain_rotation(design: Design, geo: Mapping[str, Any], torque: Array) -> Array:
    """Give the rotation by the radial compliances common to all teeth of a lobe, rad.

    Elements: "balls" (`diameter_mm`, `share` of the lobe's force on the highest loaded ball,
    `preload_N`), "rim" of the rigid gear (`inner_mm`, `outer_mm`, `width_mm`, `relief` by the
    housing) and "spring" (`stiffness_N_per_mm`). `torque` in N·mm, any sign, shape (m,).
    """
    r, tangent = geo["mean_radius"], np.tan(geo["wedge"])
    force = np.abs(torque) / (2 * r) * tangent
    young = design["young_MPa"]
    sag = np.zeros_like(force)
    for e in design["radial_chain"]:
        if e["kind"] == "balls":
            c, q0 = BALL_CONTACTS * e["diameter_mm"] ** (-1 / 3), e["preload_N"]
            sag += c * ((q0 + e["share"] * force) ** (2 / 3) - q0 ** (2 / 3))
        elif e["kind"] == "rim":
            inner, outer, width = e["inner_mm"], e["outer_mm"], e["width_mm"]
            pressure = 2 * force / (2 * np.pi * inner * width)
            lame = (outer**2 + inner**2) / (outer**2 - inner**2) + design["poisson"]
            bending = young * width * (outer - inner) ** 3 / 12
            oval = POINT_RING * force * ((inner + outer) / 2) ** 3 / bending
            sag += pressure * inner / young * lame + oval / e["relief"]
        else:
            sag += force / e["stiffness_N_per_mm"]
    return np.sign(torque) * sag * tangent / r


def torsion_rotation(design: Design, torque: Array) -> Array:
    """Give the wind-up of the torsion chain at the output, rad.

    Elements: `stiffness_Nm_per_rad` at the output, or a solid shaft with `length_mm`,
    `diameter_mm` and `ratio` between it and the output. `torque` in N·mm, shape (m,).
    """
    flexibility = 0.0
    for e in design["torsion_chain"]:
        if "stiffness_Nm_per_rad" in e:
            flexibility += 1 / (1e3 * e["stiffness_Nm_per_rad"])
        else:
            polar = np.pi / 32 * e["diameter_mm"] ** 4
            flexibility += e["length_mm"] / (design["shear_MPa"] * polar * e["ratio"] ** 2)
    return flexibility * torque


# ------------------------------------------------------------------------------ whole evaluation


def characteristic(
    design: Design,
    geo: Mapping[str, Any],
    contacts: Mapping[str, Any],
    torque_Nm: Array | None = None,
) -> dict[str, Any]:
    """Give rotation over torque and its contributions.

    Parameters
    ----------
    design, geo, contacts
        Design, its `geometry` and its `mesh_contacts` at a phase that mirrors itself (0 or 1/2),
        so that negative torques mirror positive ones.
    torque_Nm : ndarray, shape (m,), optional
        Default: `TORQUES` values from -2 to 2 times the rated torque.

    Returns
    -------
    dict
        ndarrays of shape (m,), rad: `radial_gap`, `clearance`, `ring`, `tooth`, `radial_chain`,
        `torsion`, `total`; `torque_Nm`; `engaged` teeth per lobe; and
        `reversal_lost_motion` (rad) at 4 % of the rated torque.
    """
    rated = design["rated_torque_Nm"]
    if torque_Nm is None:
        torque_Nm = np.linspace(-2 * rated, 2 * rated, TORQUES)
    torque = 1e3 * np.append(torque_Nm, LOST_MOTION_SHARE * rated)
    size, sign = np.abs(torque), np.sign(torque)
    path = mesh_path(contacts, float(size.max()))
    shares = mesh_shares(contacts, path, size)
    carried = path["force"][-1]
    mean_tangent = float(np.average(np.tan(contacts["flank_angle"]), weights=carried))
    geo = dict(geo) | {"wedge": np.arctan(mean_tangent)}
    parts = {k: sign * shares[k] for k in ("clearance", "ring", "tooth")}
    parts["radial_gap"] = radial_gap_rotation(design, geo, torque)
    parts["radial_chain"] = radial_chain_rotation(design, geo, torque)
    parts["torsion"] = torsion_rotation(design, torque)
    parts["total"] = np.sum(list(parts.values()), axis=0)
    result: dict[str, Any] = {k: v[:-1] for k, v in parts.items()}
    result["torque_Nm"] = torque_Nm
    result["engaged"] = np.where(size[:-1] > 0, shares["engaged"][:-1], 0)
    result["reversal_lost_motion"] = 2 * parts["total"][-1]
    return result


def checks(
    design: Design, geo: Mapping[str, Any], smallest_gap: tuple[float, float]
) -> dict[str, dict[str, float]]:
    """Check a design against its limits.

    Parameters
    ----------
    design, geo : mapping
        Design and its `geometry`.
    smallest_gap : tuple of float
        Smallest gap of the forward and of the backward flank over all angles and phases, rad.

    Returns
    -------
    dict
        For each check `value`, `limit` and `margin` (not negative: passed), in mm, rad, MPa or 1.
    """
    m, w0, alpha = geo["module"], geo["deflection"], geo["alpha"]
    flank = {g: (geo[f"z_{g}"], geo[f"x_{g}"], alpha, geo[f"base_{g}"]) for g in ("f", "r")}
    outer, inner = ("r", "f") if not geo["external"] else ("f", "r")
    shift, base = geo[f"x_{inner}"], geo[f"base_{inner}"]
    reference = m * geo[f"z_{inner}"] / 2
    form = np.hypot(base, reference * np.sin(alpha) + (shift - 1) * m / np.sin(alpha))
    tip_in, tip_out = geo[f"tip_{inner}"], geo[f"tip_{outer}"]
    thick_in = 2 * tip_in * float(half_angle(np.array(tip_in), *flank[inner]))
    space = float(half_angle(np.array(tip_out), *flank[outer]))
    thick_out = 2 * tip_out * (np.pi / geo[f"z_{outer}"] - space)

    quarter = np.linspace(0.0, np.pi / 2, 181)
    w, _, curvature = shape(geo["kind"], geo["beta"], quarter)
    young, nu, s = design["young_MPa"], design["poisson"], design["rim_thickness_mm"]
    unit = design["tooth_factor"] * young * s * w0 / (2 * geo["r_m"] ** 2 * (1 - nu**2))
    bending = unit * float(np.abs(curvature).max())
    amplitude = unit * float(np.ptp(curvature)) / 2
    mean = unit * abs(float(curvature.max() + curvature.min())) / 2
    shell = 2 * np.pi * design["wall_radius_mm"] ** 2 * design["wall_thickness_mm"]
    shear = 1e3 * design["rated_torque_Nm"] / shell
    n_bend = design["fatigue_bending_MPa"] / (
        design["notch_bending"] * amplitude + design["mean_stress_bending"] * mean
    )
    n_shear = design["fatigue_shear_MPa"] / (
        (design["notch_shear"] + design["mean_stress_shear"]) * shear / 2
    )
    safety = n_bend * n_shear / np.hypot(n_bend, n_shear)
    gap_min = design["gap_min_arcmin"] * ARCMIN

    def floor(value: float, limit: float) -> dict[str, float]:
        return {"value": float(value), "limit": float(limit), "margin": float(value - limit)}

    def ceiling(value: float, limit: float) -> dict[str, float]:
        return {"value": float(value), "limit": float(limit), "margin": float(limit - value)}

    free = w0 * abs(float(w[-1]))
    return {
        "form_radius_mm": floor(tip_out - w0, form),
        "tip_thickness_inner_mm": floor(thick_in, 0.25 * m),
        "tip_thickness_outer_mm": floor(thick_out, 0.25 * m),
        "tip_clearance_outer_root_mm": floor(geo[f"root_{outer}"] - tip_in - w0, 0.15 * m),
        "tip_clearance_inner_root_mm": floor(tip_out - w0 - geo[f"root_{inner}"], 0.15 * m),
        "gap_forward_rad": floor(smallest_gap[0], gap_min),
        "gap_backward_rad": floor(smallest_gap[1], gap_min),
        "clearance_at_90_deg_mm": floor(tip_out + free - tip_in, 0.0),
        "free_assembly_mm": floor(tip_out - tip_in, 0.0),
        "bending_MPa": ceiling(bending, design["fatigue_bending_MPa"]),
        "torsion_MPa": ceiling(shear, design["fatigue_shear_MPa"]),
        "safety_factor": floor(safety, design["safety_factor_min"]),
    }


def evaluate(design: Design) -> dict[str, Any]:
    """Evaluate a whole design.

    Parameters
    ----------
    design : mapping
        Keys as in `REFERENCE_A`.

    Returns
    -------
    dict
        `geometry`, `clearances` (`clearances_by_phase`), `tooth_compliance` of each contact
        (`pair_compliance`), `characteristic` and `checks`.
    """
    geo = geometry(design)
    line = neutral_line(geo["kind"], geo["beta"], geo["r_m"], geo["deflection"])
    gaps = clearances_by_phase(geo, line)
    contacts = _contacts(design, geo, [_middle_phase(gaps)])
    teeth = pair_compliance(design, geo, contacts["radius"], contacts["flexspline_radius"])
    return {
        "geometry": geo,
        "clearances": gaps,
        "tooth_compliance": teeth,
        "characteristic": characteristic(design, geo, contacts),
        "checks": checks(design, geo, (gaps["gap"].min(), gaps["backward_gap"].min())),
    }


def timings(design: Design = REFERENCE_A, repeat: int = 50) -> dict[str, float]:
    """Give the median time of each piece of an evaluation, s."""
    geo = geometry(design)
    line = neutral_line(geo["kind"], geo["beta"], geo["r_m"], geo["deflection"])
    gaps = clearances_by_phase(geo, line)
    contacts = _contacts(design, geo, [_middle_phase(gaps)])
    top = 2e3 * design["rated_torque_Nm"]
    sixteen = top * np.arange(1, 17) / 16
    path = mesh_path(contacts, top)
    contact_radii = contacts["radius"], contacts["flexspline_radius"]
    pieces: dict[str, Callable[[], Any]] = {
        "geometry": lambda: geometry(design),
        "neutral_line": lambda: neutral_line(
            geo["kind"], geo["beta"], geo["r_m"], geo["deflection"]
        ),
        "clearances_by_phase": lambda: clearances_by_phase(geo, line),
        "one_phase_both_flanks": lambda: (
            clearances(geo, line, tooth_angles(geo["z_f"])),
            clearances(geo, line, tooth_angles(geo["z_f"]), forward=False),
        ),
        "contacts": lambda: _contacts(design, geo, [_middle_phase(gaps)]),
        "pair_compliance": lambda: pair_compliance(design, geo, *contact_radii),
        "mesh_path": lambda: mesh_path(contacts, top),
        "mesh_shares": lambda: mesh_shares(contacts, path, sixteen),
        "mesh_by_nnls": lambda: [rotation_by_nnls(contacts, t) for t in sixteen],
        "characteristic": lambda: characteristic(design, geo, contacts),
        "checks": lambda: checks(design, geo, (0.0, 0.0)),
        "evaluate": lambda: evaluate(design),
    }
    result = {}
    for name, piece in pieces.items():
        spent = []
        for _ in range(repeat if name != "mesh_by_nnls" else max(repeat // 10, 3)):
            start = time.perf_counter()
            piece()
            spent.append(time.perf_counter() - start)
        result[name] = float(np.median(spent))
    return result


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Time one design evaluation in tuned NumPy.")
    parser.add_argument("--repeat", type=int, default=50, help="runs of each piece")
    for piece_name, seconds in timings(repeat=parser.parse_args().repeat).items():
        print(f"{piece_name:20s} {1e3 * seconds:9.3f} ms")
