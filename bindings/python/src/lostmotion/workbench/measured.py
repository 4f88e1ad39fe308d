"""Drive and recordings: drive file, measurements, and where the model fails."""

from __future__ import annotations

from collections.abc import Callable
from html import escape

from nicegui import ui

from lostmotion.report.charts import page_figure
from lostmotion.report.maps import (
    ACROSS,
    Map,
    Residuals,
    bin_residuals,
    cell_text,
    draw_map,
    map_figure,
    name_of,
    runs_in_cell,
    scale_of,
)
from lostmotion.report.overlay import overlay_figure
from lostmotion.report.residual_grids import grids_figure
from lostmotion.report.wording import words
from lostmotion.workbench.bench import Bench
from lostmotion.workbench.panel import Panel, action, choice, plot
from lostmotion.workbench.work import Work

RUNS_LISTED = 6
"""Largest number of runs that are listed for a picked cell of the map."""

NEEDED_FOR = {
    "input_angle_deg": "input_angle_rad",
    "output_angle_deg": "output_angle_rad",
    "time_in_run_s": "elapsed_s",
}
"""Names in effects of the quantities of a map."""


class DrivePanel(Panel):
    """The drive file: contributions, and for a design clearances and checks."""

    name, title = "drive", "Drive"

    def __init__(self, bench: Bench, work: Work, example: Callable[[], None]) -> None:
        super().__init__(bench, work)
        self.example = example

    def draw(self) -> None:
        """Draw the panel."""
        if self.bench.drive is None:
            self.hint(
                "Name a drive file, or drop one: a catalogue sheet or a drawing. With recordings "
                "beside it you will see where the model fails and which effect is missing."
            )
            self.hint(
                "Or try the example: a robot joint, measured at several temperatures, with an "
                "effect that its data sheet does not state."
            )
            action("Load the example", self.example).mark("example")
            return
        self.page(self.bench.drive_page)


class MeasuredPanel(Panel):
    """The recordings against the model: loops, errors by run, dependence of the error."""

    name, title = "measured", "Measured"
    of_recordings = True

    def draw(self) -> None:
        """Draw the panel: before and after, if effects were added."""
        bench = self.bench
        model, comparison = bench.model, bench.comparison
        if model is not None and comparison is not None and bench.chosen:
            name, floor = bench.need_drive().name, model.noise_floor_arcsec
            before, after = comparison.fitted_base(), model.base
            added = ", ".join(map(words, bench.chosen))
            self.html(f"<h3>Before and after: with {escape(added)}</h3>")
            self.chart(overlay_figure(before, after, floor, name))
            both = [("baseline", before.residual()), ("added", after.residual())]
            self.chart(grids_figure(after.conditions, both, floor, name))
            self.html("<h3>Before: without effects</h3>")
        self.page(bench.comparison_page)


class WherePanel(Panel):
    """Where the model fails: residual over torque and one quantity, with selectable cells."""

    name, title = "where", "Where it fails"
    of_recordings = True

    def __init__(self, bench: Bench, work: Work) -> None:
        super().__init__(bench, work)
        self.covariate = ""
        self.picked: int | None = None
        self.scales: dict[str, float] = {}
        self.campaign: object = None

    def draw(self) -> None:
        """Draw the panel."""
        data = self.bench.residuals()
        assert data is not None
        if self.campaign is not self.bench.campaign:
            self.campaign, self.scales, self.picked = self.bench.campaign, {}, None
        if self.covariate not in data.covariates:
            self.covariate = self.worst(data)
        model = self.bench.model
        added = ", ".join(words(name) for name in self.bench.chosen) or "nothing added"
        what = "the fit of compare" if model is None else f"the model with {added}"
        with ui.element("div").classes("line"):
            names = {name: name_of(name)[0] for name in data.covariates}
            made = choice(
                names, self.covariate, "residual against", self.choose, "min-width: 190px"
            )
            made.mark("covariate")
            ui.label(
                f"Residual of {what}. The colour scale is kept when the model changes."
            ).classes("soft small")
        of = bin_residuals(data, self.covariate)
        earlier = self.bench.residuals(before=True)
        assert earlier is not None
        before = bin_residuals(earlier, self.covariate)
        most = self.scales.setdefault(self.covariate, scale_of(before))
        area = (
            ui.element("div")
            .classes("map")
            .props('tabindex=0 role=application aria-label="map of the residual: arrow keys move"')
        )
        area.on(
            "keydown",
            lambda event: self.move(event.args, of),
            js_handler="(e) => { if (e.key.startsWith('Arrow'))"
            " { e.preventDefault(); emit(e.key); } }",
        )
        name = name_of(self.covariate)[0]
        maps = [(f"Mean residual over torque and {name}", of)]
        if self.bench.chosen and model is not None:
            maps = [("before: without effects", before), (f"after: with {added}", of)]
        with area, ui.element("div").classes(f"charts beside{len(maps)}"):
            for title, one in maps:
                figure = draw_map(one, self.picked, most)
                if len(maps) > 1:
                    figure.update_layout(title=title)
                plot(page_figure(figure), title).on(
                    "plotly_click",
                    lambda event: self.pick(event.args),
                    js_handler="(e) => emit(e.points[0].customdata)",
                )
        self.cell(data, of)
        self.chart(map_figure(data, self.covariate))

    def worst(self, data: Residuals) -> str:
        """Choose the quantity on which the residual depends most in the comparison."""
        assert self.bench.comparison is not None
        for failure in self.bench.comparison.failures:
            for name in data.covariates:
                if name.startswith(failure.covariate):
                    return name
        return next(iter(data.covariates))

    def choose(self, covariate: str) -> None:
        """Select another quantity."""
        self.covariate, self.picked = covariate, None
        self.redraw()

    def pick(self, cell: int) -> None:
        """Pick a cell of the map."""
        self.picked = None if cell == self.picked else cell
        self.redraw()

    def move(self, key: str, of: Map) -> None:
        """Move the picked cell by an arrow key."""
        row, column = divmod(self.picked or 0, ACROSS)
        across = {"ArrowLeft": -1, "ArrowRight": 1}.get(key, 0)
        up = {"ArrowUp": 1, "ArrowDown": -1}.get(key, 0)
        if self.picked is not None:
            column = min(max(column + across, 0), ACROSS - 1)
            row = min(max(row + up, 0), of.mean.shape[0] - 1)
        self.picked = row * ACROSS + column
        self.redraw()
        ui.run_javascript("document.querySelector('.map')?.focus()")

    def cell(self, data: Residuals, of: Map) -> None:
        """Describe the selected cell."""
        if self.picked is None:
            self.hint("Pick a cell to see which runs lie in it and which effects act there.")
            return
        runs = runs_in_cell(data, of, self.picked)
        needed = NEEDED_FOR.get(self.covariate, self.covariate)
        acting = [name for name, effect in self.bench.effects.items() if needed in effect.needs]
        shown = "; ".join(
            f"run {escape(str(label))}: {mean:+.1f} arcsec ({count})"
            for label, count, mean in runs[:RUNS_LISTED]
        )
        more = f" and {len(runs) - RUNS_LISTED} more" if len(runs) > RUNS_LISTED else ""
        effects = ", ".join(words(name) for name in acting) or "none of the library"
        self.html(
            f'<div id="cell"><p><b>{escape(cell_text(of, self.picked))}</b></p>'
            f'<p class="small">Mean by run (samples): {shown or "no samples"}{more}.<br>'
            f"Effects of {escape(name_of(self.covariate)[0])}: {escape(effects)}.</p></div>"
        )
