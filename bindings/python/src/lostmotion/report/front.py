"""The front of a design search: Pareto-optimal designs."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from lostmotion.report.chart import Axes, axis_range
from lostmotion.report.page import Figure, FigureData
from lostmotion.report.svg import BLUE, INK, SMALL_SIZE, SOFT, Drawing, coord, fine
from lostmotion.report.wording import words, written

Values = Sequence[Sequence[float]]

RADIUS = 5.0


def axis_name(name: str, unit: str) -> str:
    """Write an objective with its unit."""
    unit = {"Nm_per_rad": "N·m/rad", "-": ""}.get(unit, unit)
    return f"{name.replace('_', ' ')}, {unit}".rstrip(", ")


def front_figure(front: Values, names: Sequence[str], units: Sequence[str], name: str) -> Figure:
    """Make the figure of a front over its first two objectives."""
    across, up, *others = map(words, names if len(names) > 1 else [*names, *names])
    hidden = f" {' and '.join(others).capitalize()}: in the CSV." if others else ""
    return Figure(
        f"The front of {name}",
        "One dot per design: none of them is better than another in every objective. "
        f"Horizontal axis: {across}; vertical axis: {up}.{hidden}",
        lambda width: draw_front(front, names, units, width),
        FigureData(
            "front",
            {
                f"{one} {unit}".strip(): [row[i] for row in front]
                for i, (one, unit) in enumerate(zip(names, units, strict=True))
            },
        ),
    )


def draw_front(
    front: Values,
    names: Sequence[str],
    units: Sequence[str],
    width: float,
    axes_of: tuple[int, int] = (0, 1),
    picked: int | None = None,
) -> str:
    """Draw a front; every dot has its number in ``data-design`` and its values as a title.

    Parameters
    ----------
    front : sequence of sequence of float
        Objectives of each design.
    axes_of : tuple of int
        The objectives on the horizontal and vertical axis; with only one objective the designs are
        in a row.
    picked : int, optional
        A design to be marked.
    """
    left, right, top, height = 66.0, 20.0, 34.0, 280.0 if width > 600 else 230.0
    drawing = Drawing(width, top + height + 48, "The front of a design search")
    i, j = (min(axis, len(names) - 1) for axis in axes_of)
    x = np.array([row[i] for row in front], dtype=np.float64)
    y = np.array([row[j] for row in front], dtype=np.float64)
    if x.size == 0:
        drawing.text(
            width / 2, top + height / 2, "no feasible design yet", anchor="middle", fill=SOFT
        )
        return drawing.render()
    axes = Axes(
        drawing,
        (left, top, width - left - right, height),
        axis_range([float(x.min()), float(x.max())], 0.08),
        axis_range([float(y.min()), float(y.max())], 0.1),
    )
    axes.frame(axis_name(names[i], units[i]), axis_name(names[j], units[j]))
    order = np.argsort(x, kind="stable")
    if len(names) == 2 and i != j:
        axes.curve(x[order], y[order], BLUE, 1.0, opacity=0.35)
    for k, (across, up) in enumerate(axes.points(x, y)):
        title = "; ".join(
            f"{axis_name(n, u)}: {written(value, 5)}"
            for n, u, value in zip(names, units, front[k], strict=True)
        )
        mark = picked == k
        drawing.add(
            f'<circle data-design="{k}" cx="{coord(across)}" cy="{coord(up)}" '
            f'r="{fine(RADIUS + 2 * mark)}" fill="{INK if mark else BLUE}" stroke="#ffffff" '
            f'stroke-width="1.2"><title>{escape(title)}</title></circle>'
        )
    drawing.text(
        width - right, 17, f"{len(front)} designs", size=SMALL_SIZE, anchor="end", fill=SOFT
    )
    return drawing.render()
