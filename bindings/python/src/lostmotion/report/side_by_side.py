"""The page of several drives, or of a drive with one dimension swept."""

from __future__ import annotations

from functools import partial

import numpy as np

from lostmotion.report.chart import Axes, axis_range
from lostmotion.report.page import Figure, FigureData, PageTable, Section
from lostmotion.report.svg import BLUE, SOFT, Drawing
from lostmotion.report.wording import words
from lostmotion.side_by_side import DRAWN, FIGURES, SideBySide

CHART_PX, GAP_PX = 150.0, 46.0


def table_section(answer: SideBySide) -> Section:
    """Make the section of a table: all figures, and for a sweep their plots."""
    swept = answer["swept"]
    first = swept or "drive"
    head = [first, *(words(name) for name in FIGURES), "failed checks"]
    rows = [
        [
            show_value(row[first]),
            *(show_value(row[name]) for name in FIGURES),
            f"!{row['checks_not_kept'] or row['refused']}".rstrip("!"),
        ]
        for row in answer["rows"]
    ]
    table = PageTable("Figures", head, rows, tuple(range(1, len(FIGURES) + 1)))
    name = str(answer["rows"][0]["drive"])
    title = f"{name}, {swept} swept" if swept else f"{len(rows)} drives"
    facts = [("drives", str(len(rows)))]
    return Section(title, "", facts, [*([sweep_figure(answer)] if swept else []), table])


def show_value(value: float | str | None) -> str:
    """Write a cell of the table."""
    if value is None:
        return ""
    return value if isinstance(value, str) else f"{value:.5g}"


def sweep_figure(answer: SideBySide) -> Figure:
    """Draw lost motion, stiffness and safety factor over the swept key."""
    rows = [row for row in answer["rows"] if row[DRAWN[0]] is not None]
    return Figure(
        f"Influence of {answer['swept']}",
        "One curve per result, over the values of the key; where a curve ends, the drive is "
        "refused.",
        partial(draw_sweep, answer),
        FigureData(
            "sweep", {name: [row[name] for row in rows] for name in (answer["swept"], *DRAWN)}
        ),
    )


def draw_sweep(answer: SideBySide, width: float) -> str:
    """Draw one chart per figure, stacked."""
    swept = answer["swept"]
    left, right, top = 66.0, 20.0, 34.0
    drawing = Drawing(width, top + len(DRAWN) * (CHART_PX + GAP_PX) + 20, f"sweep of {swept}")
    every = [float(row[swept]) for row in answer["rows"]]
    for i, name in enumerate(DRAWN):
        rows = [row for row in answer["rows"] if row[name] is not None]
        y = np.array([row[name] for row in rows], dtype=np.float64)
        place = (left, top + i * (CHART_PX + GAP_PX), width - left - right, CHART_PX)
        if y.size == 0:
            drawing.text(width / 2, place[1] + CHART_PX / 2, f"no {words(name)}", fill=SOFT)
            continue
        axes = Axes(drawing, place, axis_range(every, 0.02), axis_range(list(y), 0.1))
        last = i == len(DRAWN) - 1
        axes.frame(swept if last else "", words(name), x_numbers=last)
        axes.curve([float(row[swept]) for row in rows], y, BLUE)
    return drawing.render()
