"""Residual plots of the current model, which show whether the residual is noise."""

from __future__ import annotations

from nicegui import ui

from lostmotion.report.charts import plots_of
from lostmotion.report.wording import words
from lostmotion.workbench.bench import Bench
from lostmotion.workbench.panel import Panel, choice
from lostmotion.workbench.work import Work


class PlotsPanel(Panel):
    """Plots for judging the residual of the current model."""

    name, title = "plots", "Residual plots"
    of_recordings = True

    def __init__(self, bench: Bench, work: Work) -> None:
        super().__init__(bench, work)
        self.chosen = "time"
        self.before = False

    def draw(self) -> None:
        """Draw the panel."""
        bench = self.bench
        comparison = bench.comparison
        assert comparison is not None
        changed = bench.model is not None and bool(bench.chosen)
        result = comparison if self.before and changed else bench.model or comparison
        plots = {plot.name: plot for plot in plots_of(result)}
        if self.chosen not in plots:
            self.chosen = next(iter(plots))
        added = ", ".join(words(name) for name in bench.chosen) or "baseline model"
        with ui.element("div").classes("line"):
            titles = {name: one.title for name, one in plots.items()}
            choice(titles, self.chosen, "plot", self.choose, "min-width: 260px").mark("plot")
            if changed:
                ends = {False: f"after: with {added}", True: "before: baseline model"}
                choice(ends, self.before, "model", self.turn, "min-width: 220px").mark("model")
            else:
                ui.label(f"Of the current model: {added}.").classes("soft small")
        self.chart(plots[self.chosen])

    def turn(self, before: bool) -> None:
        """Show the model before or after the effects were added."""
        self.before = before
        self.redraw()

    def choose(self, name: str) -> None:
        """Show another plot."""
        self.chosen = name
        self.redraw()
