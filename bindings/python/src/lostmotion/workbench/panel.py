"""Common parts of the panels: each is redrawn when the state has changed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

from nicegui import ui

from lostmotion.report.charts import HOW, Chart
from lostmotion.workbench.bench import Bench
from lostmotion.workbench.figures import DrawnChart, Rendered, numbers_address
from lostmotion.workbench.work import Work


def action(text: str, does: Callable[..., Any], *, main: bool = False) -> ui.button:
    """Make a button in the look of the page."""
    made = ui.button(text, on_click=does, color=None).props("unelevated no-caps dense")
    return made.classes("act" if main else "plain")


def field(text: str, kept_in: object, attribute: str, style: str) -> ui.input:
    """Make an input whose text is stored in an attribute of an object."""
    made = ui.input(text).props("dense outlined stack-label").style(style)
    return made.bind_value(kept_in, attribute)


def choice(
    options: Mapping[Any, str],
    value: Any,
    label: str,
    choose: Callable[[Any], None],
    style: str,
) -> ui.select:
    """Make a select, which calls `choose` with the chosen key."""
    made = ui.select(
        dict(options), value=value, label=label, on_change=lambda event: choose(event.value)
    )
    return made.props("dense outlined options-dense").style(style)


class Panel:
    """A part of the page that shows one thing.

    Attributes
    ----------
    place : element
        Element in which it is drawn.
    shown : int or None
        Version of the bench that it shows.
    of_recordings : bool
        Whether it needs recordings.
    """

    name = ""
    title = ""
    of_recordings = False
    place: ui.element

    def __init__(self, bench: Bench, work: Work) -> None:
        self.bench = bench
        self.work = work
        self.shown: object = None

    def state(self) -> object:
        """State on which the panel depends; it is redrawn when this changes."""
        return self.bench.version

    def update(self) -> None:
        """Redraw the panel if something has changed."""
        state = self.state()
        if self.shown != state:
            self.shown = state
            self.redraw()

    def redraw(self) -> None:
        """Draw the panel."""
        self.place.clear()
        with self.place:
            if self.of_recordings and self.bench.campaign is None:
                self.hint("No recordings yet: name files or folders, or drop them.")
            else:
                self.draw()

    def draw(self) -> None:
        """Draw the content."""
        raise NotImplementedError

    @staticmethod
    def html(text: str) -> ui.html:
        """Show trusted markup."""
        return ui.html(text, sanitize=False)

    def hint(self, text: str) -> None:
        """Show a hint while there is no content."""
        self.html(f'<p class="soft">{escape(text)}</p>')

    def page(self, page: Rendered) -> None:
        """Show a section."""
        for part in page.parts:
            if isinstance(part, DrawnChart):
                self.drawn(part)
            else:
                self.html(part)

    def chart(self, chart: Chart) -> list[ui.plotly]:
        """Draw a chart with its caption."""
        if chart.columns is not None:
            self.bench.comparison_page.tables[chart.name] = chart.columns
        return self.drawn(DrawnChart(chart, chart.figures()))

    def drawn(self, part: DrawnChart) -> list[ui.plotly]:
        """Show the figures of a chart with its caption."""
        chart = part.chart
        with ui.element("figure"):
            with ui.element("div").classes(f"charts beside{chart.beside}"):
                shown = [plot(figure, chart.title) for figure in part.figures]
            with ui.element("figcaption"):
                numbers = "" if chart.columns is None else numbers_address(chart.name)
                self.html(
                    f"<b>{escape(chart.title)}.</b> {escape(chart.caption)} {HOW} "
                    f'<span class="files">{numbers}</span>'
                )
                action("picture (SVG)", lambda: download_pictures(shown, chart.name))
        return shown


def plot(figure: dict[str, Any], title: str) -> ui.plotly:
    """Show a Plotly figure."""
    made = ui.plotly(figure).style(f"width: 100%; height: {figure['layout']['height']}px")
    made.props["role"], made.props["aria-label"] = "group", title
    return made


def download_pictures(shown: Sequence[ui.plotly], name: str) -> None:
    """Send figures to the browser as SVG."""
    for one in shown:
        one.run_plot_method("downloadImage", {"format": "svg", "filename": name})
