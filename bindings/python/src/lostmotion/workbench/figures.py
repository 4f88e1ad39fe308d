"""Sections and figures of the report for the page, with links to data and figures."""

from __future__ import annotations

from dataclasses import dataclass, field
from html import escape

from lostmotion.report.page import (
    NARROW,
    WIDE,
    Figure,
    FigureData,
    Notes,
    Raw,
    Section,
    facts_html,
    notes_html,
    rows_html,
)
from lostmotion.report.page import PageTable as TableRows


@dataclass
class Rendered:
    """A section that is ready to be shown.

    Attributes
    ----------
    html : str
    tables : dict
        Data of its figures, by the name in their link.
    pictures : dict
        Figures for a wide page, by the same names.
    """

    html: str = ""
    tables: dict[str, FigureData] = field(default_factory=dict)
    pictures: dict[str, str] = field(default_factory=dict)


def render_section(section: Section) -> Rendered:
    """Draw a section; it may take a second, so it must not run in the page's thread."""
    out = Rendered()
    parts = [f'<p class="lead">{escape(section.lead)}</p>', facts_html(section.facts)]
    for block in section.blocks:
        if isinstance(block, Figure):
            parts.append(render_figure(block, out))
        elif isinstance(block, TableRows):
            parts.append(rows_html(block))
        elif isinstance(block, Notes):
            parts.append(notes_html(block))
        elif isinstance(block, Raw):
            parts.append(block.html)
        # Residual plots have a panel of their own, of the current model.
    out.html = f'<div class="report">{"".join(parts)}</div>'
    return out


def render_figure(figure: Figure, out: Rendered) -> str:
    """Draw a figure for a wide and a narrow page, and store its data for the link."""
    name = figure.table.name
    wide = figure.draw(WIDE)
    out.tables[name], out.pictures[name] = figure.table, wide
    return (
        f'<figure><div class="wide">{wide}</div><div class="narrow">{figure.draw(NARROW)}</div>'
        f"<figcaption><b>{escape(figure.title)}.</b> {escape(figure.caption)} {links(name)}"
        "</figcaption></figure>"
    )


def links(name: str) -> str:
    """Links to the data of a figure and to the figure."""
    return (
        f'<span class="files"><a href="/numbers/{name}.csv" download>numbers (CSV)</a> '
        f'<a href="/picture/{name}.svg" download>picture (SVG)</a></span>'
    )
