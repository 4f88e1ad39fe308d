"""Figure of the tolerance limits of the radial gap and the resulting lost motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lostmotion.report.chart import Axes, nice_step, round_up, tick_label, ticks_between
from lostmotion.report.page import Figure, FigureData
from lostmotion.report.svg import BLUE, INK, PAPER, SMALL_SIZE, SOFT, Drawing


@dataclass(frozen=True)
class Tolerances:
    """Limits of the radial gap in um, by ``worst_min`` and so on.

    Attributes
    ----------
    mean_um : float
        Radial gap of a drive with all parts in the middle of their fields.
    arcmin_per_um : float
        Lost motion in one direction per closed gap, equation (9).
    """

    name: str
    limits_um: Mapping[str, float]
    mean_um: float
    arcmin_per_um: float


def tolerances_figure(data: Tolerances) -> Figure:
    """Make the figure of the tolerance limits."""
    limits, scale = data.limits_um, data.arcmin_per_um
    kinds = ("worst", "probable")
    caption = (
        "Radial gap on the deformation axis that the tolerances allow (lower axis) and the "
        "lost motion that it causes in one direction, eq. (9) (upper axis); the reversal lost "
        "motion is twice that. "
        "Worst case: all links at their limits, eq. (10), (11). Probable: 99.73 % of all drives, "
        "by the distributions of the links. With every part in the middle of its field the gap is "
        f"{data.mean_um:.2f} µm; that is the drive of the torsion curve above."
    )
    return Figure(
        f"Tolerance limits of {data.name}",
        caption,
        lambda width: draw_tolerances(data, width),
        FigureData(
            "tolerances",
            {
                "limit": list(kinds),
                "gap_min_um": [limits[f"{kind}_min"] for kind in kinds],
                "gap_max_um": [limits[f"{kind}_max"] for kind in kinds],
                "lost_motion_min_arcmin": [limits[f"{kind}_min"] * scale for kind in kinds],
                "lost_motion_max_arcmin": [limits[f"{kind}_max"] * scale for kind in kinds],
            },
        ),
    )


def draw_tolerances(data: Tolerances, width: float) -> str:
    """Draw both ranges as bars on one axis."""
    left, right, top, height = 92.0, 20.0, 54.0, 86.0
    drawing = Drawing(width, top + height + 44, f"Tolerance limits of {data.name}")
    high = round_up(1.08 * max(data.limits_um.values()))
    axes = Axes(drawing, (left, top, width - left - right, height), (0.0, high), (0.0, 1.0))
    axes.frame("radial gap, µm", "", ticks=(width / 90, 0.0))
    angle = high * data.arcmin_per_um
    step = nice_step(angle, width / 110)
    drawing.line((left, top, width - right, top), SOFT)
    for value in ticks_between(0.0, angle, step):
        at = float(axes.x(value / data.arcmin_per_um))
        drawing.line((at, top, at, top - 4), SOFT)
        drawing.text(
            at, top - 9, tick_label(value, step), anchor="middle", size=SMALL_SIZE, fill=SOFT
        )
    drawing.text(
        width - right,
        top - 30,
        "lost motion in one direction, arcmin",
        anchor="end",
        size=SMALL_SIZE,
    )
    for i, (kind, name) in enumerate((("worst", "worst case"), ("probable", "probable"))):
        y = top + 24 + 38 * i
        x0 = float(axes.x(data.limits_um[f"{kind}_min"]))
        x1 = float(axes.x(data.limits_um[f"{kind}_max"]))
        drawing.rectangle(x0, y - 8, max(x1 - x0, 1.0), 16, "#cfe3f3" if i == 0 else BLUE, BLUE)
        drawing.text(left - 10, y + 4.5, name, anchor="end")
    at = float(axes.x(data.mean_um))
    drawing.line((at, top, at, top + height), INK, 1.2, "3 2")
    drawing.text(at + 5, top + 48, "middle of the fields", size=SMALL_SIZE, halo=True)
    drawing.dots([(at, top + height)], 2.6, PAPER, INK)
    return drawing.render()
