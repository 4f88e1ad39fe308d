"""One complete evaluation of a strain-wave drive design in NumPy and SciPy, following the theory.

It is what an engineer writes who uses the published algorithms and programs them well: a table
of the neutral line, for each tooth flank a grid of common radii with the points in arrays, for each
torque a root finder around the contact forces by non-negative least squares. bench_design.py
compares its time with the library's; test_plain_numpy.py its numbers.

Planar, both lobes equal. Lengths are in mm, forces in N, angles in rad, torques in N·mm inside.
Angles are measured from the deformation axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, nnls

Array = NDArray[np.float64]

NEUTRAL_POINTS = 6001
"""Entries of the neutral line's table in a quadrant: straight between, they leave 2e-6 arcmin."""

GRID_POINTS = 400
"""Common radii of a pair of flanks: linear interpolation leaves 2e-6 arcmin."""

PHASES = 8
TOOTH_POINTS = 201
ROTATION_TOLERANCE = 1e-11
"""Tolerance of the root finder, rad: 3e-8 arcmin."""

TIP_THICKNESS = 0.25
RADIAL_CLEARANCE = 0.15
"""Least, in modules."""

SAFETY = 1.5


@dataclass(frozen=True)
class Design:
    """A checked drive with every default filled in, as plain numbers."""

    external: bool
    generator: str
    beta: float
    deflection: float
    module: float
    flexspline_teeth: int
    rigid_teeth: int
    alpha: float
    flexspline_shift: float
    rigid_shift: float
    addendum: float
    root_clearance: float
    height: float
    depth: float
    width: float
    rim: float
    wall: float
    rated_torque: float
    youngs: float
    shear: float
    poisson: float
    bending_fatigue: float
    shear_fatigue: float
    bending_notch: float
    shear_notch: float
    mean_stress: float
    tooth_stress: float
    foundation: float
    ring_stiffness: float
    ring_factor: float
    engagement_limit: float
    gap_limit: float
    radial_gap: float
    gap_stiffness: float
    radial_laws: tuple[tuple[float, float, float, float], ...]
    torsion: tuple[tuple[float, float], ...]


# --- geometry ------------------------------------------------------------------------------------


def involute(angle: Array) -> Array:
    """Involute function."""
    return np.tan(angle) - angle


def half_angle(design: Design, teeth: int, shift: float, radius: Array) -> Array:
    """Half angle of a tooth (external gear) or of a space (internal gear) at radii."""
    base = design.module * teeth / 2 * np.cos(design.alpha)
    pressure = np.arccos(np.minimum(base / radius, 1.0))
    start = np.pi / (2 * teeth) + 2 * shift * np.tan(design.alpha) / teeth
    return start + involute(np.array(design.alpha)) - involute(pressure)


def radii(design: Design) -> dict[str, float]:
    """Radii of both gears and of the undeformed neutral line."""
    m, w0 = design.module, design.deflection
    depth = design.depth * m
    if design.external:
        root = m * design.rigid_teeth / 2
        root += m * (design.rigid_shift - design.addendum - design.root_clearance)
        tip = root + design.height * m
        found = {"rigid_root": root, "rigid_tip": tip}
        found |= {"flexspline_tip": tip + w0 - depth, "flexspline_root": tip + w0 + 0.2 * m}
        found["neutral"] = found["flexspline_root"] + design.rim / 2
    else:
        root = m * design.flexspline_teeth / 2
        root += m * (design.flexspline_shift - design.addendum - design.root_clearance)
        tip = root + design.height * m
        found = {"flexspline_root": root, "flexspline_tip": tip}
        found |= {"rigid_tip": tip + w0 - depth, "rigid_root": tip + w0 + 0.2 * m}
        found["neutral"] = root - design.rim / 2
    base = m / 2 * np.cos(design.alpha)
    found["flexspline_base"] = base * design.flexspline_teeth
    found["rigid_base"] = base * design.rigid_teeth
    return found


def wave(design: Design, angle: Array) -> tuple[Array, Array, Array]:
    """Radial wave of the wave generator over its deflection, its slope, and -(w'' + w).

    `angle` from 0 to pi/2.
    """
    b = design.beta
    if design.generator == "cosine":
        return np.cos(2 * angle), -2 * np.sin(2 * angle), 3 * np.cos(2 * angle)
    s, c, x = np.sin(b), np.cos(b), np.pi / 2 - b
    p = np.pi / 2 - angle
    inside = angle <= b
    if design.generator == "rollers":
        a = s + x * c
        d = a - 4 / np.pi
        k = c + b * s
        w = np.where(
            inside,
            a * np.cos(angle) + angle * np.sin(angle) * s,
            k * np.sin(angle) + p * np.cos(angle) * c,
        )
        slope = np.where(
            inside,
            -a * np.sin(angle) + s * (np.sin(angle) + angle * np.cos(angle)),
            k * np.cos(angle) - c * (np.cos(angle) + p * np.sin(angle)),
        )
        bend = 4 / np.pi - 2 * np.where(inside, s * np.cos(angle), c * np.sin(angle))
        return (w - 4 / np.pi) / d, slope / d, bend / d
    g = (np.pi / 2) / (np.pi / 2 * (x - s * c) + 2 * x * s - 2 * c)
    d = g * (x - s * c)
    f = g * (1 + s * s)
    e = 1 - d + d * c - f * s - g * x * c
    w = np.where(inside, 1 - d + d * np.cos(angle), e + f * np.cos(p) + g * p * np.sin(p))
    slope = np.where(inside, -d * np.sin(angle), f * np.sin(p) - g * (np.sin(p) + p * np.cos(p)))
    bend = -np.where(inside, 1 - d, e + 2 * g * np.cos(p))
    return w, slope, bend


def generator_force(design: Design) -> float:
    """Force of the wave generator on a lobe without load, over E I w0 / r^3."""
    b = design.beta
    s, c, x = np.sin(b), np.cos(b), np.pi / 2 - b
    if design.generator == "cosine":
        return 6.0
    if design.generator == "rollers":
        return float(4 * c / (s + x * c - 4 / np.pi))
    return float(4 * (np.pi / 2) / (np.pi / 2 * (x - s * c) + 2 * x * s - 2 * c))


@dataclass(frozen=True)
class NeutralLine:
    """Table of the deformed neutral line over a quadrant."""

    material: Array
    polar: Array
    radius: Array
    slope: Array


def neutral_line(design: Design, neutral: float) -> NeutralLine:
    """Deformed neutral line of the same length, by arc length from the axis."""
    polar = np.linspace(0.0, np.pi / 2, NEUTRAL_POINTS)
    w, dw, _ = wave(design, polar)
    way = -1.0 if design.external else 1.0

    def curve(c0: float) -> tuple[Array, Array]:
        scale = way * (design.deflection - c0)
        return neutral + scale * w + way * c0, scale * dw

    def excess(c0: float) -> float:
        radius, slope = curve(c0)
        return float(np.trapezoid(np.hypot(radius, slope), polar)) - np.pi / 2 * neutral

    c0 = brentq(excess, -0.1 * design.deflection, 0.1 * design.deflection, xtol=1e-14)
    radius, slope = curve(c0)
    speed = np.hypot(radius, slope)
    arc = np.concatenate(([0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * np.diff(polar))))
    return NeutralLine(arc * (np.pi / 2 / arc[-1]), polar, radius, slope)


def place(line: NeutralLine, angle: float) -> tuple[float, float, float]:
    """Polar angle and radius of the foot of a tooth and the direction of its axis."""
    at = abs(angle)
    polar = np.interp(at, line.material, line.polar)
    radius = np.interp(at, line.material, line.radius)
    slope = np.interp(at, line.material, line.slope)
    direction = polar - np.arctan2(slope, radius)
    side = -1.0 if angle < 0 else 1.0
    return side * polar, float(radius), side * direction


# --- clearances ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Gap:
    """Gap of one flank of one tooth, its radius of contact and the flank angle there."""

    gap: float
    radius: float
    flank_angle: float


def flank_gap(
    design: Design, r: Mapping[str, float], line: NeutralLine, angle: float, forward: bool
) -> Gap:
    """Least difference of polar angles over the radii that both flanks share."""
    sense = -1.0 if design.external else 1.0
    side = sense if forward else -sense
    foot, radius, direction = place(line, angle)
    own = np.linspace(
        min(r["flexspline_tip"], max(r["flexspline_root"], r["flexspline_base"])),
        max(r["flexspline_tip"], r["flexspline_root"]),
        GRID_POINTS,
    )
    xi = half_angle(design, design.flexspline_teeth, design.flexspline_shift, own)
    across = side * own * np.sin(xi)
    along = own * np.cos(xi) - r["neutral"]
    x = radius * np.cos(foot) + along * np.cos(direction) - across * np.sin(direction)
    y = radius * np.sin(foot) + along * np.sin(direction) + across * np.cos(direction)
    rho, psi = np.hypot(x, y), np.arctan2(y, x)

    if design.external:
        low, high = max(r["rigid_root"], r["rigid_base"]), r["rigid_tip"]
    else:
        low, high = r["rigid_tip"], np.inf
    start, end = max(low, rho.min()), min(high, rho.max())
    if start >= end:
        return Gap(np.inf, 0.0, 0.0)
    common = np.linspace(start, end, GRID_POINTS)
    axis = angle * design.flexspline_teeth / design.rigid_teeth
    eta = half_angle(design, design.rigid_teeth, design.rigid_shift, common)
    error = sense * (eta - side * (np.interp(common, rho, psi) - axis))
    best = int(np.argmin(error))
    lean = np.arccos(r["rigid_base"] / common[best]) - eta[best]
    return Gap(float(error[best]), float(common[best]), float(lean))


def clearances(
    design: Design, r: Mapping[str, float], line: NeutralLine, phase: float
) -> list[tuple[float, Gap, Gap]]:
    """Angle, forward and backward gap of every tooth of a lobe."""
    z = design.flexspline_teeth
    pitch = 2 * np.pi / z
    first = int(np.ceil(-z / 4 - phase / pitch - 1e-9))
    last = int(np.floor(z / 4 - phase / pitch + 1e-9))
    teeth = []
    for k in range(first, last + 1):
        angle = k * pitch + phase
        ahead = flank_gap(design, r, line, angle, True)
        teeth.append((angle, ahead, flank_gap(design, r, line, angle, False)))
    return teeth


# --- take-up -------------------------------------------------------------------------------------


def tooth_give(design: Design, r: Mapping[str, float], gear: str, loaded: float) -> float:
    """Compliance of one tooth along the force: equation (6) and its tilt in the rim, mm/N."""
    teeth = getattr(design, f"{gear}_teeth")
    shift = getattr(design, f"{gear}_shift")
    inward = (gear == "rigid") != design.external
    root, base = r[f"{gear}_root"], r[f"{gear}_base"]
    e, nu, b = design.youngs, design.poisson, design.width
    plane = 1 - nu**2

    def thickness(radius: Array) -> Array:
        half = half_angle(design, teeth, shift, radius)
        return 2 * radius * (np.pi / teeth - half if inward else half)

    y0 = abs(loaded - root)
    y = np.linspace(0.0, y0, TOOTH_POINTS)
    thick = thickness(root - y if inward else root + y)
    half = float(half_angle(design, teeth, shift, np.array(loaded)))
    pressure = np.arccos(base / loaded)
    load = pressure + np.pi / teeth - half if inward else pressure - half
    c2, s2 = np.cos(load) ** 2, np.sin(load) ** 2
    integrand = 12 * (y0 - y) ** 2 * c2 * plane / (e * b * thick**3)
    integrand += 1.2 * c2 / (thick * design.shear * b) + s2 / (thick * e * b)
    ratio = y0 / float(thick[0])
    tilt = 5.306 * ratio**2 + 2 * (1 - nu - 2 * nu**2) / plane * ratio
    tilt += 1.534 * (1 + 0.4167 * np.tan(load) ** 2 / (1 + nu))
    return float(np.trapezoid(integrand, y) + c2 * plane / (b * e) * tilt)


@dataclass(frozen=True)
class Contacts:
    """Pairs that may carry, both flanks of one lobe, and their compliance matrix."""

    side: Array
    gap: Array
    arm: Array
    tooth: Array
    factor: Array
    flank_angle: float

    def forces(self, rotation: float) -> Array:
        """Contact forces at a rotation, none of them negative."""
        approach = self.arm * (self.side * rotation - self.gap)
        right = np.linalg.solve(self.factor, approach)
        return np.asarray(nnls(self.factor.T, right, maxiter=50 * right.size)[0])

    def torque(self, rotation: float) -> float:
        """Torque of both lobes at a rotation."""
        return float(2 * np.sum(self.side * self.arm * self.forces(rotation)))


def make_contacts(
    design: Design,
    r: Mapping[str, float],
    line: NeutralLine,
    teeth: list[tuple[float, Gap, Gap]],
) -> Contacts:
    """List the pairs near enough to touch and couple them through the rim."""
    held = [tooth for tooth in teeth if abs(tooth[0]) <= design.engagement_limit]
    nearest = {
        side: min((tooth[column] for tooth in held), key=lambda gap: gap.gap)
        for side, column in ((1, 1), (-1, 2))
    }
    rows = []
    for angle, ahead, back in held:
        for side, gap in ((1, ahead), (-1, back)):
            if gap.gap - nearest[side].gap <= design.gap_limit:
                _, foot, _ = place(line, angle)
                own = gap.radius - foot + r["neutral"]
                give = tooth_give(design, r, "flexspline", own)
                give += tooth_give(design, r, "rigid", gap.radius)
                give /= np.cos(gap.flank_angle) ** 2
                rows.append((side, gap.gap, gap.radius, np.tan(gap.flank_angle), give, angle))
    side, gaps, arm, wedge, tooth, angles = np.array(rows).T
    k = design.foundation
    decay = (k / (4 * design.ring_stiffness)) ** 0.25
    s = decay * r["neutral"] * np.abs(angles[:, None] - angles)
    ring = design.ring_factor * decay / (2 * k) * np.exp(-s) * (np.cos(s) + np.sin(s))
    matrix = np.outer(wedge, wedge) * ring + np.diag(tooth)
    flank_angle = (nearest[1].flank_angle + nearest[-1].flank_angle) / 2
    return Contacts(side, gaps, arm, tooth, np.linalg.cholesky(matrix), flank_angle)


def rest(contacts: Contacts) -> float:
    """Torque-free middle: the middle of the free play, or the equilibrium of both flanks."""
    ahead = contacts.gap[contacts.side > 0].min()
    back = contacts.gap[contacts.side < 0].min()
    if ahead + back >= 0:
        return float((ahead - back) / 2)
    return float(brentq(contacts.torque, ahead, -back, xtol=ROTATION_TOLERANCE))


def take_up(contacts: Contacts, torques: Array) -> Array:
    """Rotation from rest at each torque (N·mm, rising), with its shares in columns.

    Returns
    -------
    ndarray, shape (n, 4)
        Rotation, clearance, tooth and rim. The shares are those of an unpreloaded mesh.
    """
    middle = rest(contacts)
    found = np.zeros((torques.size, 4))
    positive = np.flatnonzero(torques > 0)
    negative = np.flatnonzero(torques < 0)[::-1]
    for way, order in ((1.0, positive), (-1.0, negative)):
        near = middle
        step = 1e-5
        for i in order:

            def miss(rotation: float, wanted: float = float(torques[i])) -> float:
                return contacts.torque(rotation) - wanted

            far = near + way * step
            while way * miss(far) < 0:
                near, step = far, 2 * step
                far = near + way * step
            low, high = sorted((near, far))
            rotation = brentq(miss, low, high, xtol=ROTATION_TOLERANCE)
            step = max(abs(rotation - near), 1e-6)
            near = rotation
            force = contacts.forces(rotation)
            moment = contacts.side * contacts.arm * force
            share = moment / moment.sum()
            clearance = float(share @ (contacts.side * contacts.gap - middle))
            tooth = float((share * contacts.side * force) @ (contacts.tooth / contacts.arm))
            turned = rotation - middle
            found[i] = turned, clearance, tooth, turned - clearance - tooth
    return found


# --- the sum -------------------------------------------------------------------------------------


def radial_chain(design: Design, r_mean: float, tangent: float, torques: Array) -> Array:
    """Rotation by the radial chain, equations (2) to (4)."""
    force = np.abs(torques) / (2 * r_mean) * tangent
    approach = np.zeros_like(force)
    for coefficient, exponent, share, preload in design.radial_laws:
        loaded = preload + share * force
        approach += coefficient * (loaded**exponent - preload**exponent)
    return np.sign(torques) * approach * tangent / r_mean


def radial_gap(design: Design, r_mean: float, tangent: float, torques: Array) -> Array:
    """Rotation by the radial gap, equations (8), (9), (9a)."""
    full = design.radial_gap * tangent / r_mean
    closing = 2 * r_mean * design.gap_stiffness * design.radial_gap / tangent
    share = np.minimum(np.abs(torques) / closing, 1.0) if closing > 0 else np.ones_like(torques)
    return np.sign(torques) * share * full


def check_design(design: Design, r: Mapping[str, float], smallest: float) -> dict[str, float]:
    """Margin of every check of a design, under the library's names."""
    m, w0 = design.module, design.deflection
    across = abs(float(wave(design, np.array([np.pi / 2]))[0][0])) * w0
    inner, outer = ("rigid", "flexspline") if design.external else ("flexspline", "rigid")
    teeth, shift = getattr(design, f"{inner}_teeth"), getattr(design, f"{inner}_shift")
    pitch_radius = m * teeth / 2
    along = pitch_radius * np.sin(design.alpha)
    along += (shift - design.addendum) * m / np.sin(design.alpha)
    form = np.hypot(pitch_radius * np.cos(design.alpha), along)

    def tip(gear: str) -> float:
        z, x = getattr(design, f"{gear}_teeth"), getattr(design, f"{gear}_shift")
        radius = r[f"{gear}_tip"]
        half = float(half_angle(design, z, x, np.array(radius)))
        return 2 * radius * (np.pi / z - half if gear == outer else half)

    spread = r[f"{outer}_tip"] - r[f"{inner}_tip"]
    root_inner = r[f"{outer}_tip"] - w0 - r[f"{inner}_root"]
    root_outer = r[f"{outer}_root"] - w0 - r[f"{inner}_tip"]
    quarter = np.linspace(0.0, np.pi / 2, 1001)
    _, _, bend = wave(design, np.append(quarter, design.beta))
    unit = design.tooth_stress * design.youngs / (1 - design.poisson**2) * design.rim * w0
    unit /= 2 * r["neutral"] ** 2
    most, amplitude = unit * float(np.abs(bend).max()), unit * float(np.ptp(bend)) / 2
    tension = generator_force(design) / 2 * design.youngs * design.rim**2 / 12 * w0
    tension /= r["neutral"] ** 3
    shear = 1e3 * design.rated_torque / (2 * np.pi * r["neutral"] ** 2 * design.wall)
    mean = most - amplitude + tension
    n_bend = design.bending_fatigue / (design.bending_notch * amplitude + design.mean_stress * mean)
    n_shear = design.shear_fatigue / ((design.shear_notch + 0.1) * shear / 2)
    return {
        "form_radius": r[f"{outer}_tip"] - w0 - form,
        "flexspline_tip_thickness": tip("flexspline") - TIP_THICKNESS * m,
        "rigid_tip_thickness": tip("rigid") - TIP_THICKNESS * m,
        f"{inner}_root_clearance": root_inner - RADIAL_CLEARANCE * m,
        f"{outer}_root_clearance": root_outer - RADIAL_CLEARANCE * m,
        "smallest_gap": smallest,
        "disengagement": spread + across,
        "free_assembly": spread,
        "bending_stress": design.bending_fatigue - most,
        "torsion_stress": design.shear_fatigue - shear,
        "safety_factor": n_bend * n_shear / np.hypot(n_bend, n_shear) - SAFETY,
    }


def evaluate(design: Design, torque_Nm: Array) -> dict[str, Any]:
    """Evaluate a design: clearances at all phases, contributions at the torques, checks.

    Returns
    -------
    dict
        `clearances`: one list of (angle, forward, backward) a phase; `total`, `radial_gap`,
        `side_clearance`, `radial_compliance`, `torsion`, `tooth_bending` in rad; `checks`.
    """
    r = radii(design)
    line = neutral_line(design, r["neutral"])
    pitch = 2 * np.pi / design.flexspline_teeth
    phases = [clearances(design, r, line, k / PHASES * pitch) for k in range(PHASES)]
    smallest = min(gap.gap for teeth in phases for tooth in teeth for gap in tooth[1:])
    contacts = make_contacts(design, r, line, phases[0])
    torques = 1e3 * np.asarray(torque_Nm, dtype=float)
    mesh = take_up(contacts, torques)
    tangent = float(np.tan(contacts.flank_angle))
    # Midway between both tip circles where they are on the deformation axis.
    way = -1.0 if design.external else 1.0
    r_mean = (r["flexspline_tip"] + way * design.deflection + r["rigid_tip"]) / 2
    twist = sum(1 / (stiffness * ratio**2) for stiffness, ratio in design.torsion)
    parts = {
        "radial_gap": radial_gap(design, r_mean, tangent, torques),
        "side_clearance": mesh[:, 1],
        "radial_compliance": mesh[:, 3] + radial_chain(design, r_mean, tangent, torques),
        "torsion": torques / 1e3 * twist,
        "tooth_bending": mesh[:, 2],
    }
    total = np.sum(list(parts.values()), axis=0)
    return {
        "clearances": phases,
        "total": total,
        **parts,
        "checks": check_design(design, r, smallest),
    }
