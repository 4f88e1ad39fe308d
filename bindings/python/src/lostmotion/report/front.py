"""The front of a design search: Pareto-optimal designs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lostmotion.report.charts import Chart
from lostmotion.report.wording import words, written
from lostmotion.results import figures
from lostmotion.results.colours import BLUE, INK, SOFT

Values = Sequence[Sequence[float]]

FRONT_PX = 380
"""Height of the figure."""


def axis_name(name: str, unit: str) -> str:
    """Write an objective with its unit."""
    unit = {"Nm_per_rad": "N·m/rad", "-": ""}.get(unit, unit)
    return f"{name.replace('_', ' ')}, {unit}".rstrip(", ")


def front_figure(front: Values, names: Sequence[str], units: Sequence[str], name: str) -> Chart:
    """Make the figure of a front over its first two objectives."""
    across, up, *others = map(words, names if len(names) > 1 else [*names, *names])
    hidden = f" {' and '.join(others).capitalize()}: in the CSV." if others else ""
    return Chart(
        "front",
        f"The front of {name}",
        "One dot per design: none of them is better than another in every objective. "
        f"Horizontal axis: {across}; vertical axis: {up}.{hidden}",
        lambda: [draw_front(front, names, units)],
        {
            f"{one} {unit}".strip(): [row[i] for row in front]
            for i, (one, unit) in enumerate(zip(names, units, strict=True))
        },
    )


def draw_front(
    front: Values,
    names: Sequence[str],
    units: Sequence[str],
    axes_of: tuple[int, int] = (0, 1),
    picked: int | None = None,
) -> Any:
    """Draw a front; every dot has its number as `customdata` and shows its values on hovering.

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
    i, j = (min(axis, len(names) - 1) for axis in axes_of)
    x, y = ([row[axis] for row in front] for axis in (i, j))
    titles = [axis_name(name, unit) for name, unit in zip(names, units, strict=True)]
    figure = figures.framed("", titles[i], titles[j], FRONT_PX)
    if len(names) == 2 and i != j:
        order = np.argsort(x, kind="stable")
        figures.line(figure, np.array(x)[order], np.array(y)[order], "#a6cbe3", width=1)
    figures.dots(
        figure,
        x,
        y,
        BLUE,
        size=10,
        customdata=list(range(len(front))),
        text=[
            "<br>".join(f"{t}: {written(v, 5)}" for t, v in zip(titles, row, strict=True))
            for row in front
        ],
        hovertemplate="design %{customdata}<br>%{text}<extra></extra>",
    )
    if picked is not None and picked < len(front):
        figures.dots(figure, [x[picked]], [y[picked]], INK, size=15, hoverinfo="skip")
    said = f"{len(front)} designs" if front else "no feasible design yet"
    figure.add_annotation(
        x=1, y=1, xref="paper", yref="paper", text=said, showarrow=False, yanchor="bottom",
        font={"color": SOFT},
    )  # fmt: skip
    return figure
