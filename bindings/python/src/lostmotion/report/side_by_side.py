"""The page of several drives, or of a drive with one dimension swept."""

from __future__ import annotations

from typing import Any

from lostmotion.report.charts import Chart
from lostmotion.report.page import PageTable, Section
from lostmotion.report.wording import words
from lostmotion.results.colours import BLUE
from lostmotion.results.figures import line, stacked
from lostmotion.side_by_side import DRAWN, FIGURES, SideBySide

CHART_PX = 190
"""Height of the chart of a figure."""


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


def sweep_figure(answer: SideBySide) -> Chart:
    """Draw lost motion, stiffness and safety factor over the swept key."""
    rows = [row for row in answer["rows"] if row[DRAWN[0]] is not None]
    return Chart(
        "sweep",
        f"Influence of {answer['swept']}",
        "One curve per result, over the values of the key; where a curve ends, the drive is "
        "refused.",
        lambda: [draw_sweep(answer)],
        {name: [row[name] for row in rows] for name in (answer["swept"], *DRAWN)},
    )


def draw_sweep(answer: SideBySide) -> Any:
    """Draw one chart per figure, above each other."""
    names = [words(name) for name in DRAWN]
    shares = [1 / len(names)] * len(names)
    figure = stacked("", answer["swept"], names, shares, CHART_PX * len(names) + 80)
    for i, name in enumerate(DRAWN, 1):
        rows = [row for row in answer["rows"] if row[name] is not None]
        x, y = ([float(row[key]) for row in rows] for key in (answer["swept"], name))
        line(figure, x, y, BLUE, words(name), row=i, showlegend=False)
    return figure
