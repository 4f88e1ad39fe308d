"""Common parts of the panels: each is redrawn when the state has changed."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

from nicegui import ui

from lostmotion.workbench.bench import Bench
from lostmotion.workbench.figures import Rendered, render_figure
from lostmotion.workbench.work import Work


def action(text: str, does: Callable[..., Any], *, main: bool = False) -> ui.button:
    """Make a button in the look of the page."""
    made = ui.button(text, on_click=does, color=None).props("unelevated no-caps dense")
    return made.classes("act" if main else "plain")


def field(text: str, kept_in: object, attribute: str, style: str) -> ui.input:
    """Make an input whose text is stored in an attribute of an object."""
    made = ui.input(text).props("dense outlined stack-label").style(style)
    return made.bind_value(kept_in, attribute)


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

    def figure(self, figure: Any) -> None:
        """Show a figure with its links."""
        out = Rendered()
        text = render_figure(figure, out)
        self.bench.comparison_page.tables.update(out.tables)
        self.bench.comparison_page.pictures.update(out.pictures)
        self.html(text)
