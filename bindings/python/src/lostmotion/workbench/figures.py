"""Sections of the report for the page: markup, charts, and the files that links download."""

from __future__ import annotations

from dataclasses import dataclass, field
from html import escape
from typing import Any

from lostmotion.report.charts import Chart
from lostmotion.report.figure_data import Columns
from lostmotion.report.page import NARROW, WIDE, Figure, Section, facts_html, markup


@dataclass(frozen=True)
class DrawnChart:
    """A chart with its figures as Plotly's JSON."""

    chart: Chart
    figures: list[dict[str, Any]]


@dataclass
class Rendered:
    """A section that is ready to be shown.

    Attributes
    ----------
    parts : list of str or DrawnChart
        Markup and charts, in order.
    tables : dict
        Data of its figures, by the name in their link.
    pictures : dict
        Drawings to scale for a wide page, by the same names.
    """

    parts: list[str | DrawnChart] = field(default_factory=list)
    tables: dict[str, Columns] = field(default_factory=dict)
    pictures: dict[str, str] = field(default_factory=dict)

    def add_chart(self, chart: Chart) -> None:
        """Draw a chart and store its numbers."""
        self.parts.append(DrawnChart(chart, chart.figures()))
        if chart.columns is not None:
            self.tables[chart.name] = chart.columns


def render_section(section: Section) -> Rendered:
    """Draw a section; it may take a second, so it must not run in the page's thread."""
    out = Rendered()
    out.parts += [f'<p class="lead">{escape(section.lead)}</p>', facts_html(section.facts)]
    for block in section.blocks:
        if isinstance(block, Figure):
            out.parts.append(render_figure(block, out))
        elif not isinstance(block, Chart):
            out.parts.append(markup(block))
        elif block.columns is not None:
            out.add_chart(block)
        # Residual plots have a panel of their own, of the current model.
    return out


def render_figure(figure: Figure, out: Rendered) -> str:
    """Draw a drawing to scale for a wide and a narrow page, and store its data for the link."""
    name = figure.name
    wide = figure.draw(WIDE)
    out.tables[name], out.pictures[name] = figure.columns, wide
    return (
        f'<figure><div class="wide">{wide}</div><div class="narrow">{figure.draw(NARROW)}</div>'
        f"<figcaption><b>{escape(figure.title)}.</b> {escape(figure.caption)} "
        f'<span class="files">{numbers_address(name)} '
        f'<a href="/picture/{name}.svg" download>picture (SVG)</a></span></figcaption></figure>'
    )


def numbers_address(name: str) -> str:
    """Link to the data of a figure."""
    return f'<a href="/numbers/{name}.csv" download>numbers (CSV)</a>'
