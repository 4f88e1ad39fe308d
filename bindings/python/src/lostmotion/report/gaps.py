"""Figure of the side clearances around the gear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lostmotion.model import Clearances, DesignModel
from lostmotion.report.chart import Axes, axis_range
from lostmotion.report.page import Figure, FigureData
from lostmotion.report.svg import BLUE, ORANGE, PAPER, RED, SMALL_SIZE, SOFT, Array, Drawing, signs
from lostmotion.units import ARCMIN

FORWARD, BACKWARD = BLUE, ORANGE

ROOM = 1.7
"""Height of the picture relative to the widest gap of a closing flank: the other flank of the far
teeth opens to ten times that gap and is cut off."""


@dataclass(frozen=True)
class Flank:
    """Gaps of one flank of one lobe in one axial section, by rising angle."""

    section: int
    angle_deg: Array
    gap_arcmin: Array
    radius_mm: Array


@dataclass(frozen=True)
class Gaps:
    """Side clearances for the figure, one lobe; the other is identical half a turn on.

    Attributes
    ----------
    forward, backward : list of Flank
        One per axial section.
    limit_deg : float
        Only teeth within this angle of the axis can carry load.
    """

    name: str
    axis: str
    phase_rad: float
    table: Clearances
    forward: list[Flank]
    backward: list[Flank]
    limit_deg: float
    rigid_tip_mm: float

    def smallest(self) -> tuple[float, float, str]:
        """Smallest gap in arcmin, its angle in deg and its flank."""
        found = (np.inf, 0.0, "forward")
        for name, flanks in (("forward", self.forward), ("backward", self.backward)):
            for flank in flanks:
                at = int(np.argmin(flank.gap_arcmin))
                if flank.gap_arcmin[at] < found[0] - 1e-9:
                    found = (float(flank.gap_arcmin[at]), float(flank.angle_deg[at]), name)
        return found

    def interfering(self) -> int:
        """Number of flanks of one lobe that interfere."""
        return sum(
            int(np.count_nonzero(flank.gap_arcmin < 0)) for flank in self.forward + self.backward
        )


def collect_gaps(model: DesignModel, name: str, phase_rad: float = 0.0) -> Gaps:
    """Compute the clearances of all teeth of a design at a tooth phase of the wave generator."""
    table = model.clearances(phase_rad)
    sides: list[list[Flank]] = []
    for gap, radius in (
        (table.forward_rad, table.forward_radius_mm),
        (table.backward_rad, table.backward_radius_mm),
    ):
        flanks = []
        for section in range(model.sections):
            rows = (table.section == section) & np.isfinite(gap)
            flanks.append(
                Flank(
                    section,
                    np.degrees(table.angle_rad[rows]),
                    gap[rows] / ARCMIN,
                    np.asarray(radius[rows]),
                )
            )
        sides.append(flanks)
    external = int(model.drive.teeth.deformation) == int(model.core.lib.LM_EXTERNAL)
    return Gaps(
        name,
        "minor axis" if external else "major axis",
        phase_rad,
        table,
        sides[0],
        sides[1],
        float(np.degrees(model.drive.support.engagement_limit_rad)),
        rigid_tip(model),
    )


def rigid_tip(model: DesignModel) -> float:
    """Tip radius of the rigid gear in mm."""
    c = model.core
    geometry = c.ffi.new("lm_geometry *")
    fault = c.fault()
    drive = model.drive
    teeth = c.ffi.addressof(drive, "teeth")
    c.check(
        c.lib.lm_make_geometry(
            teeth,
            drive.generator.deflection_mm,
            drive.flexspline.rim_thickness_mm,
            geometry,
            fault,
        ),
        fault,
    )
    return float(geometry.rigid_tip_mm)


def gaps_figure(data: Gaps) -> Figure:
    """Make the figure of the side clearances."""
    table = data.table
    gap, angle, flank = data.smallest()
    interfering = data.interfering()
    caption = (
        f"Rotation of the output until a flank touches, unloaded, against the angle of the tooth "
        f"from the {data.axis} of the wave generator; tooth phase "
        f"{np.degrees(data.phase_rad):.3g}°, "
        f"and the other lobe is the same. "
        f"Each dot is a tooth. The {flank} flank at {angle:+.1f}° is the nearest: {gap:.3f} arcmin."
    )
    caption += (
        f" {interfering} flanks of a lobe interfere (below zero)."
        if interfering
        else " No flank interferes (none is below zero)."
    )
    caption += " Wider gaps are not drawn; the CSV has them all."
    radii = [
        np.where(r > 0, r, np.nan) for r in (table.forward_radius_mm, table.backward_radius_mm)
    ]
    if len(data.forward) > 1:
        caption += (
            f" One curve per axial section, {len(data.forward)} from the cup's edge of the teeth "
            "to "
            "the open end."
        )
    return Figure(
        f"Side clearances of {data.name}",
        signs(caption),
        lambda width: draw_gaps(data, width),
        FigureData(
            "clearances",
            {
                "section": [int(s) for s in table.section],
                "angle_deg": np.degrees(table.angle_rad),
                "forward_arcmin": table.forward_rad / ARCMIN,
                "backward_arcmin": table.backward_rad / ARCMIN,
                "forward_contact_radius_mm": radii[0],
                "backward_contact_radius_mm": radii[1],
            },
        ),
    )


def draw_gaps(data: Gaps, width: float) -> str:
    """Draw gaps above contact radii over one angle axis."""
    wide = width > 600
    left, right, top = 52.0, 14.0, 62.0
    height, lower = (300.0, 110.0) if wide else (230.0, 90.0)
    span = (-90.0, 270.0) if wide else (-90.0, 90.0)
    second = top + height + 52
    drawing = Drawing(
        width, second + lower + 44, f"Side clearances of {data.name} by angle, both flanks"
    )
    lobes = (0.0, 180.0) if wide else (0.0,)
    high = _upper(data)
    low = min(-0.1 * high, 1.4 * data.smallest()[0])
    axes = Axes(drawing, (left, top, width - left - right, height), span, (low, high))
    bottom = float(axes.y(low))
    zero = float(axes.y(0.0))
    drawing.rectangle(left, zero, width - left - right, bottom - zero, "#fbe4df")
    axes.frame("", "side clearance, arcmin", x_step=45.0 if wide else 30.0, x_numbers=False)
    drawing.line((left, zero, width - right, zero), SOFT, 1.2)
    drawing.text(left + 8, bottom - 5, "interference", size=SMALL_SIZE, fill=RED)
    for lobe in lobes:
        for edge in (-data.limit_deg, data.limit_deg):
            at = float(axes.x(lobe + edge))
            drawing.line((at, top, at, zero), SOFT, 1.0, "2 3")
        if wide:
            name = f"{data.axis}, lobe {1 if lobe == 0 else 2}"
            drawing.text(
                float(axes.x(lobe)), top - 8, name, anchor="middle", size=SMALL_SIZE, fill=SOFT
            )
    axes.open()
    for lobe in lobes:
        for flanks, ink in ((data.backward, BACKWARD), (data.forward, FORWARD)):
            for flank in flanks:
                _gap_curve(axes, flank, lobe, ink)
    axes.close()
    _key(drawing, data, wide)
    gap, angle, _ = data.smallest()
    x, y = float(axes.x(angle)), float(axes.y(gap))
    drawing.dots([(x, y)], 5.5, "none", RED if gap < 0 else SOFT, 1.5)
    said = f"{gap:.3f}′ at {angle:+.1f}°"
    drawing.text(x + 9, max(zero, y) + 16, signs(said), size=SMALL_SIZE, halo=gap < 0)

    radii = [f.radius_mm for f in data.forward + data.backward if f.radius_mm.size]
    values = np.concatenate(radii)
    below = Axes(
        drawing,
        (left, second, width - left - right, lower),
        span,
        axis_range([*values.tolist(), data.rigid_tip_mm], 0.12),
    )
    below.frame(
        f"angle from the {data.axis}, degrees",
        "contact radius, mm",
        x_step=45.0 if wide else 30.0,
        ticks=(6.0, 3.0),
    )
    tip = float(below.y(data.rigid_tip_mm))
    drawing.line((left, tip, width - right, tip), SOFT, 1.0, "6 3")
    inside = tip - 5 if tip > second + lower / 2 else tip + 13
    name, place, anchor = "rigid tip", width - right, "end"
    if wide:
        name, place, anchor = "tip of the rigid gear", float(below.x(90.0)), "middle"
    drawing.text(place, inside, name, anchor=anchor, size=SMALL_SIZE, fill=SOFT)
    for lobe in lobes:
        for flanks, ink in ((data.backward, BACKWARD), (data.forward, FORWARD)):
            for flank in flanks:
                places = below.points(flank.angle_deg + lobe, flank.radius_mm)
                filled = ink if ink == FORWARD else PAPER
                drawing.dots(places, 1.7, filled, ink, 0.9)
    return drawing.render()


def _upper(data: Gaps) -> float:
    """Top of the figure: the widest gap of the closing flank, with margin."""
    widest = 0.0
    for ahead, back in zip(data.forward, data.backward, strict=True):
        angles = np.intersect1d(np.round(ahead.angle_deg, 9), np.round(back.angle_deg, 9))
        one = np.interp(angles, ahead.angle_deg, ahead.gap_arcmin)
        other = np.interp(angles, back.angle_deg, back.gap_arcmin)
        near = np.abs(angles) <= data.limit_deg
        if near.any():
            widest = max(widest, float(np.max(np.minimum(one, other)[near])))
    return ROOM * widest if widest > 0 else 1.0


def _gap_curve(axes: Axes, flank: Flank, lobe: float, ink: str) -> None:
    """Draw the gaps of a flank; filled marks for the forward one, open ones for the other."""
    top = axes.y_range[1]
    axes.curve(flank.angle_deg + lobe, flank.gap_arcmin, ink, 1.1, opacity=0.6)
    shown = flank.gap_arcmin <= 1.02 * top
    bad = shown & (flank.gap_arcmin < 0)
    places = axes.points(flank.angle_deg + lobe, flank.gap_arcmin)
    fill = ink if ink == FORWARD else PAPER
    axes.drawing.dots(places[shown & ~bad], 2.1, fill, ink, 1.1)
    axes.drawing.dots(places[bad], 2.8, RED)


def _key(drawing: Drawing, data: Gaps, wide: bool) -> None:
    y = 16.0
    x = drawing.width - 14 - (520 if wide else 300)
    for name, ink, fill in (
        ("forward: closes for torque > 0", FORWARD, FORWARD),
        ("backward: closes for torque < 0", BACKWARD, PAPER),
    ):
        drawing.line((x, y - 4, x + 22, y - 4), ink, 1.4)
        drawing.dots([(x + 11, y - 4)], 2.8, fill, ink, 1.2)
        drawing.text(x + 28, y, name, size=SMALL_SIZE)
        if wide:
            x += 250
        else:
            y += 16
    reach = f"dotted: ±{data.limit_deg:.0f}°, within which teeth can carry"
    if wide:
        drawing.text(52, 16, reach, size=SMALL_SIZE, fill=SOFT)
