"""Figure of the torsion curve: deflection over torque and its five contributions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lostmotion.catalogue import PARTS, REVERSAL_TORQUE_SHARE, Catalogue
from lostmotion.report.chart import Axes, round_up
from lostmotion.report.page import Figure, FigureData
from lostmotion.report.svg import (
    INK,
    PAPER,
    SMALL_SIZE,
    SOFT,
    Array,
    Drawing,
    signs,
    text_width,
)
from lostmotion.report.wording import written
from lostmotion.units import ARCMIN

NAMES = {
    "radial_gap": "radial gap, eq. (8), (9)",
    "side_clearance": "side clearance, eq. (1)",
    "radial_compliance": "radial compliance, eq. (2)–(4)",
    "torsion": "torsion, eq. (5)",
    "tooth_bending": "tooth bending, eq. (6), (7)",
}
"""The contributions, with their names in the legend."""

FILLS = {
    "radial_gap": "#ee8866",
    "side_clearance": "#77aadd",
    "radial_compliance": "#44bb99",
    "torsion": "#eedd88",
    "tooth_bending": "#aa4499",
}
"""Paul Tol's light colours (and his wine), made for areas; neighbours are distinct for all types of
colour vision."""

ZOOM_SHARE = 0.1
"""Half width of the magnified part relative to the rated torque."""

CATALOGUE_INK = "#882255"


@dataclass(frozen=True)
class Contributions:
    """A torsion curve for the figure; torques rise from minus to plus twice the rated torque.

    Attributes
    ----------
    torque_Nm : ndarray
        With a pair of equal torques next to zero, where free play causes a jump.
    parts_arcmin : mapping
        By the names of `PARTS`.
    rated_torque_Nm, reversal_torque_Nm : float
    engaged_teeth : ndarray or None
    """

    name: str
    torque_Nm: Array
    parts_arcmin: Mapping[str, Array]
    rated_torque_Nm: float
    reversal_torque_Nm: float
    engaged_teeth: Array | None = None
    catalogue: Catalogue | None = None

    @property
    def total_arcmin(self) -> Array:
        """Sum of the contributions."""
        return np.asarray(sum(self.parts_arcmin[part] for part in PARTS))

    def at(self, values: Array, torque_Nm: float) -> float:
        """Interpolate a curve at a torque."""
        return float(np.interp(torque_Nm, self.torque_Nm, values))


def picture_torques(rated_Nm: float, ends: Array | None = None) -> Array:
    """Torques for the figure: dense around zero, with points very close to zero on both sides.

    Parameters
    ----------
    rated_Nm : float
    ends : ndarray, optional
        Torques that must be among them, such as T1 and T2 of a catalogue.
    """
    share = np.linspace(0.0, 1.0, 129)[1:]
    positive = 2.0 * rated_Nm * share**1.7
    must = [rated_Nm, REVERSAL_TORQUE_SHARE * rated_Nm, ZOOM_SHARE * rated_Nm, 1e-6 * rated_Nm]
    if ends is not None:
        must += [float(t) for t in ends if t <= 2.0 * rated_Nm]
    positive = np.unique(np.concatenate((positive, must)))
    return np.concatenate((-positive[::-1], [0.0], positive))


def contributions_figure(data: Contributions) -> Figure:
    """Make the figure of a torsion curve."""
    columns: dict[str, Array] = {"torque_Nm": data.torque_Nm, "total_arcmin": data.total_arcmin}
    columns |= {f"{part}_arcmin": data.parts_arcmin[part] for part in PARTS}
    if data.engaged_teeth is not None:
        columns["engaged_teeth_per_lobe"] = data.engaged_teeth
    lost = 2.0 * data.at(data.total_arcmin, data.reversal_torque_Nm)
    caption = (
        "One-sided deflection φ from the torque-free middle, input locked. The areas are the "
        "contributions, stacked from the axis outward; their sum is the black line. The second "
        "panel magnifies the part around zero. The reversal lost motion at "
        f"±{written(data.reversal_torque_Nm)} N·m (4 % of the rated torque) is {lost:.3f} arcmin."
    )
    if data.catalogue is not None:
        caption += " Dashed: the slopes of the catalogue, extended beyond their torque ranges."
    return Figure(
        f"Torsion curve of {data.name}",
        signs(caption),
        lambda width: draw_contributions(data, width),
        FigureData("torsion_curve", columns),
    )


def draw_contributions(data: Contributions, width: float) -> str:
    """Draw the whole torsion curve, the part around zero, and the legend."""
    wide = width > 600
    left, gap = 52.0, 78.0
    top, height = 34.0, 380.0 if wide else 250.0
    main = (width - left - gap - 18) * 0.62 if wide else width - left - 14
    zoom = width - left - gap - 18 - main if wide else main
    second = (left + main + gap, top) if wide else (left, top + height + 92)
    zoom_height = height if wide else 230.0
    below = top + height + 70 if wide else second[1] + zoom_height + 70
    rows = 3 if wide else len(PARTS)
    drawing = Drawing(
        width, below + 28 + 22 * rows, f"Torsion curve of {data.name} with its contributions"
    )
    reach = 2.0 * data.rated_torque_Nm
    axes = _panel(drawing, data, (left, top, main, height), reach)
    _mark_rated(axes, data)
    if data.catalogue is not None:
        _mark_slopes(axes, data.catalogue, reach)
    around = _panel(drawing, data, (*second, zoom, zoom_height), ZOOM_SHARE * data.rated_torque_Nm)
    _mark_reversal(around, data)
    _legend(drawing, data, below, wide)
    return drawing.render()


def _panel(
    drawing: Drawing, data: Contributions, box: tuple[float, float, float, float], reach: float
) -> Axes:
    inside = np.abs(data.torque_Nm) <= reach * (1 + 1e-12)
    torque = data.torque_Nm[inside]
    total = data.total_arcmin[inside]
    high = 1.04 * float(np.max(np.abs(total)))
    axes = Axes(drawing, box, (-reach, reach), (-round_up(high), round_up(high)))
    axes.frame("torque on the output, N·m", "deflection φ, arcmin")
    axes.open()
    sides = [torque > 0, torque < 0]
    for side in sides:
        # Parts against the torque (preload adds stiffness) are stacked on the other side of zero.
        with_torque = np.zeros(np.count_nonzero(side))
        against = np.zeros_like(with_torque)
        sign = np.sign(torque[side])
        for part in PARTS:
            value = data.parts_arcmin[part][inside][side]
            along = np.where(value * sign >= 0, value, 0.0)
            other = value - along
            for base, step in ((with_torque, along), (against, other)):
                if np.any(step != 0):
                    axes.band(torque[side], base, base + step, FILLS[part], 0.9, PAPER)
            with_torque = with_torque + along
            against = against + other
    axes.curve(torque, total, INK, 2.0)
    axes.close()
    return axes


def _mark_rated(axes: Axes, data: Contributions) -> None:
    d = axes.drawing
    _, top, _, height = axes.box
    rated = data.rated_torque_Nm
    at = float(axes.x(rated))
    d.line((at, top, at, top + height), SOFT, 1.0, "2 3")
    name = "rated torque T_{N}" if axes.box[2] > 400 else "T_{N}"
    d.text(at - 6, top + height - 8, name, anchor="end", size=SMALL_SIZE, fill=SOFT)
    value = data.at(data.total_arcmin, rated)
    y = float(axes.y(value))
    d.dots([(at, y)], 3.4, INK)
    d.text(at + 8, y + 16, f"{value:.2f}′", weight="600")


def _mark_slopes(axes: Axes, sheet: Catalogue, reach: float) -> None:
    """Mark T1 and T2, and extend each slope of the catalogue to make room for its name.

    K1 and K2 are extended upward, K3 back to the axis.
    """
    d = axes.drawing
    left, top, _, _ = axes.box
    wide = axes.box[2] > 400
    knots = (sheet.T1_Nm, sheet.T2_Nm)
    slopes = (sheet.K1_Nm_per_rad, sheet.K2_Nm_per_rad, sheet.K3_Nm_per_rad)
    origin = (0.0, sheet.T1_Nm, sheet.T2_Nm)
    ends = (sheet.T1_Nm + 0.2 * reach, sheet.T2_Nm + 0.22 * reach, 0.0)
    names = []
    axes.open()
    for i, slope in enumerate(slopes):
        x = np.array([origin[i], ends[i]])
        line = float(sheet.angle(origin[i])) / ARCMIN + (x - x[0]) / slope / ARCMIN
        axes.curve(x, line, CATALOGUE_INK, 1.3, "6 4")
        names.append((float(axes.x(x[1])), float(axes.y(line[1]))))
    for torque in knots:
        at, y = float(axes.x(torque)), float(axes.y(float(sheet.angle(torque)) / ARCMIN))
        d.line((at, y, at, float(axes.y(0.0))), CATALOGUE_INK, 1.0, "2 2")
        d.dots([(at, y)], 2.6, CATALOGUE_INK)
    axes.close()
    for i, (end, height) in enumerate(names):
        place = (end - 6, height + 1) if i == 2 else (end - 2, height - 5)
        d.text(
            *place, f"K_{{{i + 1}}}", size=SMALL_SIZE, fill=CATALOGUE_INK, anchor="end", halo=True
        )
    for i, torque in enumerate(knots):
        d.text(
            float(axes.x(torque)),
            float(axes.y(0.0)) + 15,
            f"T_{{{i + 1}}}",
            anchor="middle",
            size=SMALL_SIZE,
            fill=CATALOGUE_INK,
        )
    if wide:
        lines = [
            f"K_{{{i + 1}}} = {written(slope / 1e3)}·10³ N·m/rad" for i, slope in enumerate(slopes)
        ]
        lines += [f"T_{{{i + 1}}} = {written(torque)} N·m" for i, torque in enumerate(knots)]
        d.text(left + 14, top + 24, "catalogue", size=SMALL_SIZE, fill=CATALOGUE_INK, weight="600")
        for i, line in enumerate(lines):
            d.text(left + 14, top + 43 + 17 * i, line, size=SMALL_SIZE, fill=CATALOGUE_INK)


def _mark_reversal(axes: Axes, data: Contributions) -> None:
    """Draw the reversal lost motion as a dimension between its two torques."""
    d = axes.drawing
    torque = data.reversal_torque_Nm
    high = data.at(data.total_arcmin, torque)
    low = data.at(data.total_arcmin, -torque)
    top, bottom = float(axes.y(high)), float(axes.y(low))
    right, left_end = float(axes.x(torque)), float(axes.x(-torque))
    middle = float(axes.y(0.0))
    lines = ["reversal lost", f"motion {high - low:.3f}′", f"at ±{written(torque)} N·m"]
    if bottom - middle < 60.0:
        lines = ["lost motion", f"{high - low:.3f}′"]
    # The dimension is at the lower right, where there is room; its text is beside the axis of zero
    # torque.
    room = 18.0 + 1.1 * max(text_width(line, SMALL_SIZE) for line in lines)
    at = max(float(axes.x(0.66 * axes.x_range[1])), float(axes.x(0.0)) + room)
    d.line((right, top, at + 6, top), SOFT, 1.0)
    d.line((left_end, bottom, at + 6, bottom), SOFT, 1.0)
    d.arrow((at, bottom, at, top), INK, both=True)
    d.dots([(right, top), (left_end, bottom)], 3.4, PAPER, INK, 1.6)
    for i, line in enumerate(lines):
        d.text(
            at - 7,
            middle + 15 + 14 * i,
            line,
            anchor="end",
            size=SMALL_SIZE,
            weight="600" if i == 1 else "",
            halo=True,
        )


def _legend(drawing: Drawing, data: Contributions, top: float, wide: bool) -> None:
    rated = data.rated_torque_Nm
    total = data.at(data.total_arcmin, rated)
    drawing.text(14, top, f"At rated torque, {rated:g} N·m: {total:.3f}′ total", weight="600")
    rows = 3 if wide else len(PARTS)
    column = drawing.width / 2 if wide else drawing.width
    for i, part in enumerate(PARTS):
        x = 14 + (i // rows) * column
        y = top + 24 + 22 * (i % rows)
        value = data.at(data.parts_arcmin[part], rated)
        drawing.rectangle(x, y - 11, 14, 14, FILLS[part], SOFT)
        drawing.text(x + 22, y, NAMES[part])
        end = x + min(column - 28, 370)
        drawing.text(end - 58, y, signs(f"{value:.3f}′"), anchor="end")
        drawing.text(end, y, signs(f"{100 * value / total:.1f} %"), anchor="end")
