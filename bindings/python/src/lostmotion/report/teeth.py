"""Figure of the meshing teeth, to scale, as placed by the C library."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.model import DesignModel
from lostmotion.report.mesh import (
    Mesh,
    Touch,
    first_touches,
    make_mesh,
    touch_place,
)
from lostmotion.report.page import Figure
from lostmotion.report.placed_teeth import flexspline_shape, rigid_shape
from lostmotion.report.svg import SIMPLIFY_PX, SMALL_SIZE, Drawing, signs
from lostmotion.results.colours import BLUE, INK, PAPER, RED, SOFT
from lostmotion.units import ARCMIN

FLEXSPLINE_FILL, FLEXSPLINE_INK = "#cfe3f3", BLUE
RIGID_FILL, RIGID_INK = "#e9e6df", "#5c5346"
FLEXSPLINE_LOADED, RIGID_LOADED = "#5aa2d6", "#b08a4a"

RING_SHARE = 0.1
"""Approximate deflection of the exaggerated ring, relative to its radius."""

CLOSE_UP_DEG = 30.0
FAR_UP_DEG = 48.0
"""Angles of the smaller close-ups from the axis, within the overlap."""


@dataclass(frozen=True)
class View:
    """Part of the mesh that a drawing shows.

    Attributes
    ----------
    box : tuple
        Left, top, width and height in the drawing.
    scale : float
        Pixels per mm.
    angle_rad : float
        Angle of the gear that is upright in the middle.
    radius_mm : float
        Radius in the middle of the window.
    """

    box: tuple[float, float, float, float]
    scale: float
    angle_rad: float
    radius_mm: float

    def show(self, points: FloatArray) -> FloatArray:
        """Place screen coordinates (mm) in the window."""
        c, s = math.cos(self.angle_rad), math.sin(self.angle_rad)
        x = points[..., 0] * c - points[..., 1] * s
        y = points[..., 0] * s + points[..., 1] * c - self.radius_mm
        left, top, width, height = self.box
        return np.stack(
            (left + width / 2 + self.scale * x, top + height / 2 - self.scale * y), axis=-1
        )


def draw_view(
    drawing: Drawing, mesh: Mesh, touches: Sequence[Touch], view: View, title: str
) -> None:
    """Draw the teeth of both gears in a window, to scale."""
    g = mesh.geometry
    left, top, width, height = view.box
    half = (width / 2 / view.scale + g.module_mm * 4) / g.neutral_mm
    first, last = mesh.number(view.angle_rad - half), mesh.number(view.angle_rad + half)
    angles = [mesh.tooth(k) for k in range(first - 1, last + 2)]
    drawing.open_window(left, top, width, height)
    drawing.rectangle(left, top, width, height, PAPER)
    slack_mm = SIMPLIFY_PX / view.scale
    toothed, edge = rigid_shape(mesh, angles, slack_mm)
    drawing.edge(view.show(toothed), view.show(edge[::-1]), RIGID_FILL, RIGID_INK, 1.1)
    toothed, free = flexspline_shape(mesh, angles, slack_mm)
    body = view.show(free[::-1])
    drawing.edge(view.show(toothed), body, FLEXSPLINE_FILL, FLEXSPLINE_INK, 1.1, opacity=0.85)
    drawing.curve(view.show(free), FLEXSPLINE_INK, 1.1, slack=0)
    line = np.array(
        [
            [radius * math.sin(polar), radius * math.cos(polar)]
            for polar, radius, _ in (
                mesh.place(a) for a in np.linspace(angles[0], angles[-1], 4 * len(angles))
            )
        ]
    )
    drawing.curve(view.show(line), FLEXSPLINE_INK, 0.8, "8 3 2 3")
    places = [(view.show(touch_place(mesh, t)), t) for t in touches if t.loaded]
    drawing.dots([p.tolist() for p, t in places if t.gap_rad >= 0], 2.6, INK)
    drawing.dots([p.tolist() for p, t in places if t.gap_rad < 0], 2.6, RED)
    drawing.close_window()
    drawing.rectangle(left, top, width, height, "none", SOFT)
    drawing.text(left, top - 8, title, size=SMALL_SIZE)
    _scale_bar(drawing, view)


def _scale_bar(drawing: Drawing, view: View) -> None:
    left, top, width, height = view.box
    length = 1.0
    for candidate in (10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1):
        if candidate * view.scale < 0.22 * width:
            length = candidate
            break
    px = length * view.scale
    x, y = left + width - px - 12, top + height - 10
    drawing.rectangle(x - 6, y - 18, px + 12, 25, PAPER, opacity=0.85)
    drawing.line((x, y, x + px, y), INK, 2.0)
    drawing.text(x + px / 2, y - 5, f"{length:g} mm", anchor="middle", size=SMALL_SIZE)


def ring_factor(mesh: Mesh) -> float:
    """Magnification of the ring's radial distances."""
    g = mesh.geometry
    wanted = RING_SHARE * g.neutral_mm / g.deflection_mm
    return min(
        (2.0, 3.0, 5.0, 8.0, 10.0, 12.0, 15.0, 20.0), key=lambda f: abs(math.log(f / wanted))
    )


CORNER_SIDES = np.array([-1.0, -1.0, 1.0, 1.0])
"""Side of its axis on which each corner of a tooth is, from the first root to the other."""


def draw_ring(
    drawing: Drawing,
    mesh: Mesh,
    touches: Sequence[Touch],
    centre: tuple[float, float],
    size: float,
    views: Sequence[View],
) -> None:
    """Draw the whole ring with magnified radial distances from the neutral line."""
    g = mesh.geometry
    factor = ring_factor(mesh)
    outermost = g.neutral_mm + 1.3 * g.deflection_mm + abs(mesh.free_edge_mm)
    outermost = max(outermost, g.rigid_root_mm)
    scale = size / 2 / (g.neutral_mm + factor * (outermost - g.neutral_mm) + 1.0)

    def at(angle: FloatArray, radius: FloatArray) -> FloatArray:
        r = scale * (g.neutral_mm + factor * (radius - g.neutral_mm))
        return np.stack((centre[0] + r * np.sin(angle), centre[1] - r * np.cos(angle)), axis=-1)

    circle = np.linspace(0.0, 2.0 * math.pi, 241)

    def arc(radius: float) -> FloatArray:
        return at(circle, np.full(circle.size, radius))

    # Rigid gear: a toothed ring of trapezoids.
    start = mesh.rigid_axis(mesh.phase_rad)
    spaces = np.array([start + k * 2.0 * math.pi / g.rigid_teeth for k in range(g.rigid_teeth)])
    loaded = {mesh.number(t.angle_rad) for t in touches if t.loaded}
    ends = np.array(sorted((g.rigid_root_mm, g.rigid_tip_mm)))
    half = np.array([mesh.half_angles("rigid")(float(end)) for end in ends])
    shapes = at(spaces[:, None] + half[[0, 1, 1, 0]] * CORNER_SIDES, ends[[0, 1, 1, 0]])
    toothed = shapes.reshape(-1, 2)
    if mesh.external:
        drawing.area(toothed, RIGID_FILL, RIGID_INK, 0.5)
    else:
        drawing.area(arc(outermost + 0.6 * g.module_mm), RIGID_FILL)
        drawing.area(toothed, PAPER, RIGID_INK, 0.5)

    # Flexspline: every tooth at the place that the library gives it.
    ends = np.array(sorted((g.flexspline_root_mm, g.flexspline_tip_mm)))
    half = np.array([mesh.half_angles("flexspline")(float(end)) for end in ends])
    places = [mesh.place(mesh.tooth(k)) for k in range(g.flexspline_teeth)]
    polar, foot, _ = np.array(places).T
    corners = at(
        polar[:, None] + half[[0, 1, 1, 0]] * CORNER_SIDES,
        ends[[0, 1, 1, 0]] + (foot[:, None] - g.neutral_mm),
    )
    free = at(polar, foot + mesh.free_edge_mm)
    body = corners.reshape(-1, 2)
    ring = np.concatenate((body, body[:1], free[:1], free[::-1], free[-1:]))
    drawing.area(ring, FLEXSPLINE_FILL, opacity=0.9)
    drawing.area(body, "none", FLEXSPLINE_INK, 0.5)
    fill = RIGID_LOADED if mesh.external else FLEXSPLINE_LOADED
    drawn = shapes if mesh.external else corners
    for k, tooth in enumerate(drawn):
        if _in_lobe(k, len(drawn)) in loaded:
            drawing.area(tooth, fill)
    drawing.area(free, "none", FLEXSPLINE_INK, 0.9)
    drawing.curve(arc(g.neutral_mm), SOFT, 1.0, "4 3")
    drawing.curve(np.concatenate((at(polar, foot), at(polar[:1], foot[:1]))), FLEXSPLINE_INK, 1.6)
    _draw_generator(drawing, mesh, at)
    _ring_labels(drawing, mesh, centre, size, factor, views)


def _in_lobe(tooth: int, teeth: int) -> int:
    """Number of a tooth counted from the axis of its own lobe."""
    return (tooth + teeth // 4) % (teeth // 2) - teeth // 4


def _draw_generator(drawing: Drawing, mesh: Mesh, at: Any) -> None:
    """Draw the contact of the wave generator with the ring: arcs, or rollers."""
    rim = mesh.free_edge_mm
    beta = mesh.model.drive.generator.contact_half_angle_rad
    lobes = (0.0, math.pi)
    if mesh.generator == "rollers":
        for lobe in lobes:
            for side in (-beta, beta) if beta > 0 else (0.0,):
                at_polar, at_foot, _ = mesh.place(lobe + side)
                place = at(np.array([at_polar]), np.array([at_foot + 2.6 * rim]))
                drawing.dots(place, 6.0, SOFT)
        return
    half = beta if mesh.generator in ("discs", "ring") else math.pi / 2
    for lobe in lobes:
        held = [mesh.place(lobe + a) for a in np.linspace(-half, half, 41)]
        polar = np.array([p for p, _, _ in held])
        foot = np.array([r for _, r, _ in held])
        drawing.curve(at(polar, foot + 1.7 * rim), SOFT, 4.0)


def _ring_labels(
    drawing: Drawing,
    mesh: Mesh,
    centre: tuple[float, float],
    size: float,
    factor: float,
    views: Sequence[View],
) -> None:
    x, y = centre
    reach = size / 2
    drawing.line((x, y - 0.52 * reach, x, y + 0.52 * reach), SOFT, 1.0, "8 3 2 3")
    axis = "minor axis" if mesh.external else "major axis"
    lines = (
        ("wave generator", "600"),
        (mesh.generator + (", outside" if mesh.external else ""), ""),
        (f"{axis} upright", ""),
        (f"radial distances ×{factor:g}", ""),
    )
    drawing.rectangle(x - 66, y - 36, 132, 72, PAPER, opacity=0.9)
    for i, (text, weight) in enumerate(lines):
        drawing.text(
            x,
            y - 20 + 16 * i,
            text,
            anchor="middle",
            size=SMALL_SIZE,
            weight=weight,
            fill=SOFT if not weight else INK,
        )


def teeth_figure(
    model: DesignModel, name: str, loaded: Sequence[tuple[int, int]], phase_rad: float = 0.0
) -> Figure:
    """Make the figure of the meshing teeth.

    Parameters
    ----------
    loaded : sequence of (int, int)
        Tooth (number in the lobe) and side of the pairs that carry at rated torque.
    phase_rad : float
        Tooth phase of the wave generator.
    """
    mesh = make_mesh(model, phase_rad)
    g = mesh.geometry
    touches = first_touches(model, loaded, phase_rad)
    factor = ring_factor(mesh)
    caption = (
        "Both gears to scale, unloaded, in the torque-free middle: close-ups at the "
        "deformation axis and farther from it. Dots mark where the pairs that carry at rated "
        f"torque touch first. The ring shows all {g.flexspline_teeth} and {g.rigid_teeth} teeth "
        "with radial distances from the undeformed neutral line (dashed) enlarged "
        f"{factor:g} times; darker teeth carry at rated torque. Root fillets are not drawn."
    )
    if model.sections > 1:
        caption += f" The middle one of {model.sections} axial sections is drawn."
    rows = [(t, mesh.place(t.angle_rad)) for t in touches]
    return Figure(
        "teeth",
        f"Meshing teeth of {name}",
        caption,
        lambda width: draw_teeth(mesh, touches, name, width),
        {
            "angle_deg": [math.degrees(t.angle_rad) for t, _ in rows],
            "flank": ["forward" if t.side > 0 else "backward" for t, _ in rows],
            "neutral_line_radius_mm": [p[1] for _, p in rows],
            "polar_angle_deg": [math.degrees(p[0]) for _, p in rows],
            "axis_direction_deg": [math.degrees(p[2]) for _, p in rows],
            "first_contact_radius_mm": [t.radius_mm for t, _ in rows],
            "gap_arcmin": [t.gap_rad / ARCMIN for t, _ in rows],
            "carries_at_rated_torque": [int(t.loaded) for t, _ in rows],
        },
    )


def close_up_title(angle_rad: float, touches: Sequence[Touch]) -> str:
    """Describe the position of a close-up and the gap of its middle tooth."""
    title = f"{math.degrees(angle_rad):+.0f}° from the axis"
    here = [t for t in touches if abs(t.angle_rad - angle_rad) < 1e-6 and t.side > 0]
    if here:
        gap = here[0].gap_rad
        title += f": forward gap {gap / ARCMIN:.2f}′ = {1e3 * gap * here[0].radius_mm:.1f} µm"
    return signs(title)


def draw_teeth(mesh: Mesh, touches: Sequence[Touch], name: str, width: float) -> str:
    """Draw close-ups and the ring."""
    g = mesh.geometry
    wide = width > 600
    middle = (max(g.rigid_tip_mm, g.flexspline_tip_mm) + g.neutral_mm) / 2
    middle += (0.35 if not mesh.external else -0.8) * g.module_mm
    reach = max((abs(t.angle_rad) for t in touches), default=0.5)
    close = min(math.radians(CLOSE_UP_DEG), 0.55 * reach)
    far = min(math.radians(FAR_UP_DEG), 0.92 * reach)
    way = -1.0 if mesh.external else 1.0  # where the forward gaps of the far teeth are small
    close, far = (mesh.tooth(mesh.number(way * angle)) for angle in (close, far))
    circular = math.pi * g.module_mm
    left = 14.0

    def view(box: tuple[float, float, float, float], angle: float, pitches: float) -> View:
        # The deformed ring is nearer to the centre away from the axis (external: further out).
        return View(box, box[2] / (pitches * circular), angle, middle)

    if wide:
        side = 440.0
        top = view((left, 30.0, width - 28, 215.0), 0.0, 13.0)
        row = 290.0
        half = width - side - 2 * left - 14
        views = [
            top,
            view((left + side + 28, row, half - 14, 195.0), close, 6.4),
            view((left + side + 28, row + 240.0, half - 14, 195.0), far, 6.4),
        ]
        centre, ring = (left + side / 2, row + 215.0), side
        height = row + 240.0 + 195.0 + 14
    else:
        box = width - 2 * left
        views = [
            view((left, 30.0, box, 170.0), 0.0, 6.0),
            view((left, 235.0, box, 170.0), close, 6.0),
            view((left, 440.0, box, 170.0), far, 6.0),
        ]
        centre, ring = (width / 2, 640.0 + box / 2), box
        height = 640.0 + box + 14
    drawing = Drawing(width, height, f"Meshing teeth of {name}, to scale, and the whole ring")
    axis = "minor" if mesh.external else "major"
    titles = [
        f"at the {axis} axis; rigid gear brown, flexspline blue",
        close_up_title(close, touches),
        close_up_title(far, touches),
    ]
    for window, title in zip(views, titles, strict=True):
        draw_view(drawing, mesh, touches, window, title)
    draw_ring(drawing, mesh, touches, centre, ring, views)
    return drawing.render()
