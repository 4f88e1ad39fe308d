"""The panels of the page, each drawn from the bench when it has changed."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from html import escape
from pathlib import Path
from typing import Any

from nicegui import ui

from lostmotion.discover.commands import card
from lostmotion.errors import LostMotionError, one_line
from lostmotion.export import PROFILES, SETTINGS, Profile
from lostmotion.report.discovery import verdict_sentence
from lostmotion.report.evidence import draw_dots
from lostmotion.report.ladder import ladder_figure
from lostmotion.report.maps import (
    ACROSS,
    NAMES,
    Map,
    Residuals,
    bin_residuals,
    cell_text,
    draw_map,
    draw_profile,
    map_figure,
    runs_in_cell,
    scale_of,
)
from lostmotion.report.page import NARROW, WIDE, Rows, rows_html
from lostmotion.report.svg import signs
from lostmotion.workbench.bench import Bench
from lostmotion.workbench.figures import Rendered, links, render_figure
from lostmotion.workbench.work import Work

RUNS_LISTED = 6
"""Runs that a picked cell of the map lists."""

NEEDED_FOR = {
    "input_angle_deg": "input_angle_rad",
    "output_angle_deg": "output_angle_rad",
    "time_in_run_s": "elapsed_s",
}
"""What effects call the quantities of a map."""


def words(name: str) -> str:
    """Write the name of an effect as words."""
    return name.replace("_", " ")


def action(text: str, does: Callable[..., Any], *, main: bool = False) -> ui.button:
    """Make a button in the look of the page."""
    made = ui.button(text, on_click=does, color=None).props("unelevated no-caps dense")
    return made.classes("act" if main else "plain")


class Panel:
    """A part of the page that shows one thing.

    Attributes
    ----------
    place : element
        Where it is drawn.
    shown : int or None
        Version of the bench that it shows.
    of_recordings : bool
        Whether there is nothing to show without recordings.
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
        """What the panel depends on; it is drawn anew when this changes."""
        return self.bench.version

    def update(self) -> None:
        """Draw the panel when something has changed since."""
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
        """Draw into the place."""
        raise NotImplementedError

    @staticmethod
    def html(text: str) -> ui.html:
        """Show markup of our own making."""
        return ui.html(text, sanitize=False)

    def hint(self, text: str) -> None:
        """Say what is missing before there is anything to show."""
        self.html(f'<p class="soft">{escape(text)}</p>')

    def figure(self, figure: Any) -> None:
        """Show a figure with its links."""
        out = Rendered()
        text = render_figure(figure, out)
        self.bench.comparison_page.tables.update(out.tables)
        self.bench.comparison_page.pictures.update(out.pictures)
        self.html(text)


class DrivePanel(Panel):
    """What the drive file says: contributions, and for a design clearances and checks."""

    name, title = "drive", "Drive"

    def __init__(self, bench: Bench, work: Work, example: Callable[[], None]) -> None:
        super().__init__(bench, work)
        self.example = example

    def draw(self) -> None:
        """Draw into the place."""
        if self.bench.drive is None:
            self.hint(
                "Name a drive file, or drop one: a catalogue sheet or a drawing. With recordings "
                "beside it you will see where the model fails and which effect is missing."
            )
            self.hint(
                "Or look around with the example: a joint of a robot, measured at several "
                "temperatures, with an effect that its data sheet knows nothing of."
            )
            action("Load the example", self.example).mark("example")
            return
        self.html(self.bench.drive_page.html)


class MeasuredPanel(Panel):
    """The recordings against the model: loops, errors by run, what the error hangs on."""

    name, title = "measured", "Measured"
    of_recordings = True

    def draw(self) -> None:
        """Draw into the place."""
        self.html(self.bench.comparison_page.html)


class WherePanel(Panel):
    """Where the model fails: the residual over torque and one quantity, a cell to be picked."""

    name, title = "where", "Where it fails"
    of_recordings = True

    def __init__(self, bench: Bench, work: Work) -> None:
        super().__init__(bench, work)
        self.covariate = ""
        self.picked: int | None = None
        self.scales: dict[str, float] = {}
        self.campaign: object = None

    def draw(self) -> None:
        """Draw into the place."""
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
            ui.select(
                {name: NAMES[name][0] for name in data.covariates},
                value=self.covariate,
                label="residual against",
                on_change=lambda event: self.choose(event.value),
            ).props("dense outlined options-dense").style("min-width: 190px").mark("covariate")
            ui.label(f"What {what} leaves. The colours stay when the model changes.").classes(
                "soft small"
            )
        of = bin_residuals(data, self.covariate)
        most = self.scales.setdefault(self.covariate, scale_of(of))
        area = (
            ui.element("div")
            .classes("map")
            .props('tabindex=0 role=application aria-label="map of the residual: arrow keys move"')
        )
        area.on(
            "click",
            lambda event: self.pick(event.args),
            js_handler="(e) => { const c = e.target.closest('[data-cell]');"
            " if (c) emit(Number(c.dataset.cell)); }",
        )
        area.on(
            "keydown",
            lambda event: self.move(event.args, of),
            js_handler="(e) => { if (e.key.startsWith('Arrow'))"
            " { e.preventDefault(); emit(e.key); } }",
        )
        with area:
            self.html(
                f'<div class="wide">{draw_map(of, WIDE, self.picked, most)}</div>'
                f'<div class="narrow">{draw_map(of, NARROW, self.picked, most)}</div>'
            )
        self.cell(data, of)
        self.html(
            f'<div class="wide">{draw_profile(data, self.covariate, WIDE)}</div>'
            f'<div class="narrow">{draw_profile(data, self.covariate, NARROW)}</div>'
        )
        figure = map_figure(data, self.covariate)
        self.bench.comparison_page.tables[figure.table.name] = figure.table
        self.bench.comparison_page.pictures[figure.table.name] = draw_map(of, WIDE, None, most)
        self.html(f'<p class="small">{escape(figure.caption)} {links(figure.table.name)}</p>')

    def worst(self, data: Residuals) -> str:
        """Choose the quantity on which the residual hangs most, by the comparison."""
        assert self.bench.comparison is not None
        for failure in self.bench.comparison.failures:
            for name in data.covariates:
                if name.startswith(failure.covariate):
                    return name
        return next(iter(data.covariates))

    def choose(self, covariate: str) -> None:
        """Look at another quantity."""
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
        """Say what lies in the picked cell."""
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
            f"Effects that hang on {escape(NAMES[self.covariate][0])}: {escape(effects)}.</p></div>"
        )


class EffectsPanel(Panel):
    """Which effect is missing: the verdict, the ladder, every effect with its evidence."""

    name, title = "effects", "Effects"
    of_recordings = True

    def state(self) -> object:
        """Drawn anew too when work begins and ends, for then ticks are shut and opened."""
        return self.bench.version, self.work.busy

    def draw(self) -> None:
        """Draw into the place."""
        found = self.bench.diagnosis
        if found is None:
            self.html(
                '<p class="verdict">What is missing?</p><p>The diagnosis refits the drive with '
                "each effect of the library and asks the runs that the fit has not seen. It takes "
                "some seconds. You may also tick an effect at once.</p>"
            )
            action("Find what is missing", self.find, main=True).mark("find").set_enabled(
                not self.work.busy
            )
        else:
            self.verdict(found.answer())
        model = self.bench.model
        if model is not None:
            name = self.bench.need_drive().name
            self.figure(ladder_figure(model.ladder, model.noise_floor_arcsec, name))
        self.html("<h3>Effects: tick to add, and the model is fitted anew</h3>")
        entries = self.entries()
        for entry in entries:
            if entry["testable"]:
                self.row(entry)
        if not all(entry["testable"] for entry in entries):
            self.html("<h3>Not testable with these recordings</h3>")
            for entry in entries:
                if not entry["testable"]:
                    self.row(entry)

    def find(self) -> None:
        """Start the diagnosis."""
        self.work.start("diagnosing", lambda: self.bench.find_missing(self.work.tick))

    def verdict(self, answer: Mapping[str, Any]) -> None:
        """Say what the diagnosis found."""
        sentence = verdict_sentence({**answer, "effects": map(words, answer["effects"])})
        lines = [
            f"It depends on {one['covariate'].replace('_', ' ')}: {one['shape']}."
            for one in answer["unexplained"]["depends_on"]
        ]
        lines += [
            f"Sudden: run {event['run']} at {event['time_s']:.6g} s, {event['size_arcsec']:.3g} "
            "arcsec."
            for event in answer["events"]
        ]
        lines.append(answer["next_experiment"])
        text = "".join(f"<p>{escape(line)}</p>" for line in lines)
        self.html(f'<p class="verdict" id="verdict">{escape(sentence)}</p>{text}')

    def entries(self) -> list[dict[str, Any]]:
        """All effects, by evidence where there is a diagnosis."""
        if self.bench.diagnosis is not None:
            return list(self.bench.diagnosis.answer()["candidates"])
        return [{"name": name, "testable": True, "evidence": None} for name in self.bench.effects]

    def row(self, entry: Mapping[str, Any]) -> None:
        """Show one effect."""
        name = entry["name"]
        effect = self.bench.effects[name]
        lines = [effect.mechanism[:1].upper() + effect.mechanism[1:]]
        if not entry["testable"]:
            lines.append(entry.get("reason") or "not testable")
        elif entry.get("parameters"):
            values = entry["parameters"].items()
            lines.append(", ".join(f"{key} = {signs(f'{value:.3g}')}" for key, value in values))
        if entry.get("confused_with") and entry["testable"]:
            lines.append("looks like " + ", ".join(map(words, entry["confused_with"])))
        row = ui.element("div").classes("effect" + ("" if entry["testable"] else " closed"))
        with row:
            box = ui.checkbox(
                value=name in self.bench.chosen,
                on_change=lambda event: self.tick(name, event.value),
            ).props(f'dense aria-label="add {words(name)}" id="tick-{name}"')
            box.set_enabled(entry["testable"] and not self.work.busy)
            self.html(f'<span class="name">{escape(words(name))}</span>')
            nats = entry["evidence"]
            if nats is not None and entry["testable"]:
                share = 100 * min(max(nats, 0.0) / 50.0, 1.0)
                self.html(
                    f'<div class="nats">{signs(f"{nats:.1f}")} nats<div class="strength">'
                    f'<div style="width:{share:.0f}%"></div></div></div>'
                )
            self.html(escape("; ".join(lines))).classes("about")

    def tick(self, name: str, wanted: bool) -> None:
        """Add an effect to the model or take it out."""
        names = [one for one in self.bench.chosen if one != name]
        if wanted:
            names.append(name)
        if self.work.start("fitting", lambda: self.bench.choose(names, self.work.tick)) is None:
            self.redraw()


class AlikePanel(Panel):
    """Two effects that are hard to tell apart, side by side."""

    name, title = "alike", "Two alike"
    of_recordings = True

    def __init__(self, bench: Bench, work: Work) -> None:
        super().__init__(bench, work)
        self.pair: list[str] = []

    def draw(self) -> None:
        """Draw into the place."""
        names = {name: words(name) for name in self.bench.effects}
        if not self.pair:
            self.pair = self.suggestion()
        self.html(
            "<p>Two effects that do much the same to these recordings: how well does each explain "
            "them, run by run, and what would tell them apart?</p>"
        )
        with ui.element("div").classes("line"):
            for place in (0, 1):
                ui.select(
                    names,
                    value=self.pair[place],
                    label="and" if place else "compare",
                    on_change=lambda event, place=place: self.put(place, event.value),
                ).props("dense outlined options-dense").style("width: 210px").mark(f"pair{place}")
            action("Compare", self.start, main=True).mark("compare")
        if self.bench.rivals is not None:
            self.result()

    def suggestion(self) -> list[str]:
        """Take the diagnosis's own rivals, or the strongest and what it is confused with."""
        found = self.bench.diagnosis
        ranked = [c for c in found.candidates if c["testable"]] if found is not None else []
        first = ranked[0]["name"] if ranked else "thermal_gap"
        others = [*(ranked[0]["confused_with"] if ranked else ())]
        others += [*self.bench.effects[first].confused_with, *(c["name"] for c in ranked[1:])]
        others += ["wear", "creep"]
        return [first, next(one for one in others if one != first and one in self.bench.effects)]

    def put(self, place: int, name: str) -> None:
        """Change one of the two."""
        self.pair[place] = name

    def start(self) -> None:
        """Fit both."""
        a, b = self.pair
        self.work.start(
            "comparing effects", lambda: self.bench.compare_effects(a, b, self.work.tick)
        )

    def result(self) -> None:
        """Show both."""
        rivals = self.bench.rivals
        assert rivals is not None
        if rivals.angle_deg is not None:
            alike = (
                "these recordings cannot separate them"
                if rivals.angle_deg < 10
                else "hard to separate"
                if rivals.angle_deg < 30
                else "well apart"
            )
            self.html(
                f'<p class="verdict">{rivals.angle_deg:.0f}° between what the two do here: '
                f"{alike}.</p>"
            )
        with ui.element("div").classes("two").props("id=rivals"):
            for name, model in rivals.models.items():
                rung = model.ladder[-1]
                about = card(self.bench.effects[name])
                gain = rivals.gains.get(name)
                rows = [
                    ("rms, arcsec", f"{rung['rms_arcsec']:.2f}"),
                    ("on runs not seen", f"{rung['rms_heldout_arcsec']:.2f}"),
                ]
                if gain is not None:
                    rows.append(("evidence, nats", signs(f"{gain.sum():.1f}")))
                    rows.append(("runs for it", f"{int((gain > 0).sum())} of {gain.size}"))
                with ui.element("div"):
                    self.html(
                        rows_html(Rows(words(name), ("", ""), rows, (1,)))
                        + f'<p class="small">{escape(about["mechanism"])}.<br>'
                        f"{escape(about['equation'])}<br><b>Told apart by:</b> "
                        f"{escape(about['separating_experiment'] or 'nothing known')}</p>"
                    )
        if rivals.gains:
            gains = [(words(name), gain) for name, gain in rivals.gains.items()]
            name = self.bench.need_drive().name
            self.html(
                f'<div class="wide">{draw_dots(gains, WIDE, name)}</div>'
                f'<div class="narrow">{draw_dots(gains, NARROW, name)}</div>'
                '<p class="small">What each run says: evidence in nats that the run, predicted by '
                "the others, gives for the effect. An effect that one run alone carries is no "
                "effect.</p>"
            )


class NextPanel(Panel):
    """What to measure next."""

    name, title = "next", "Next run"
    of_recordings = True

    def __init__(self, bench: Bench, work: Work) -> None:
        super().__init__(bench, work)
        self.path = ""

    def draw(self) -> None:
        """Draw into the place."""
        found = self.bench.diagnosis
        if found is None:
            self.hint("The suggestion comes with the diagnosis.")
            action(
                "Find what is missing",
                lambda: self.work.start(
                    "diagnosing", lambda: self.bench.find_missing(self.work.tick)
                ),
                main=True,
            )
            return
        self.html(f'<p class="verdict">{escape(found.next_experiment)}</p>')
        self.html(
            "<h3>Runs that you could do</h3><p>A plan is a recording without the measured angle: "
            "run, time and torque, and what else you would set. Each of its runs is ranked by how "
            "well it decides between the effects that are still open.</p>"
        )
        with ui.element("div").classes("line"):
            ui.input(
                "plan, a file or a folder",
                value=self.path,
                on_change=lambda event: setattr(self, "path", event.value),
            ).props("dense outlined stack-label").style("min-width: 230px").mark("plan")
            action("Rank the runs", self.rank, main=True).mark("rank")
        ranking = self.bench.ranking
        if ranking is not None:
            rows = [
                (
                    str(run["run"]),
                    f"{run['separation_nats']:.2f}",
                    f"{run['minutes']:.1f}",
                    f"{run['per_minute']:.2f}",
                )
                for run in ranking["runs"]
            ]
            head = ("run", "nats", "minutes", "nats a minute")
            between = ", ".join(map(words, ranking["between"]))
            self.html(rows_html(Rows(f"To decide between {between}", head, rows, (1, 2, 3))))
        sizes = found.smallest_detectable
        if sizes:
            sizes_shown = [
                (words(name), f"{one['value']:.3g} {one['unit']}", f"{one['rms_arcsec']:.2f}")
                for name, one in sorted(sizes.items(), key=lambda item: item[1]["rms_arcsec"])
            ]
            self.html(
                rows_html(
                    Rows(
                        "Smallest size that these recordings would have shown",
                        ("effect", "size", "rms, arcsec"),
                        sizes_shown,
                        (2,),
                    )
                )
            )

    def rank(self) -> None:
        """Rank the runs of the plan."""
        try:
            paths = [Path(path) for path in shlex.split(self.path)]
        except ValueError as error:
            self.work.say(f"plan: {error}")
            return
        self.work.start("ranking", lambda: self.bench.rank_options(paths, self.work.tick))


class ExportPanel(Panel):
    """What goes to the controller, and the drive file that says the same."""

    name, title = "export", "Export"

    def __init__(self, bench: Bench, work: Work) -> None:
        super().__init__(bench, work)
        self.settings = "period_us=500"
        self.profile: Profile = "standard"
        self.constant = "joint_parameters"
        self.answer: Mapping[str, Any] | None = None

    def draw(self) -> None:
        """Draw into the place."""
        bench = self.bench
        if bench.drive is None:
            self.hint("Load a drive first.")
            return
        if bench.model is not None:
            added = " and ".join(map(words, bench.chosen))
            with_it = f"with {added}" if added else "no effect added"
            what = f"The drive as it was fitted to the recordings, {with_it}."
        else:
            what = "The drive as its file says: nothing was fitted yet (tick an effect)."
        self.html(f'<p class="verdict">{escape(what)}</p>')
        with ui.element("div").classes("line"):
            ui.input(
                "settings",
                value=self.settings,
                on_change=lambda event: setattr(self, "settings", event.value),
            ).props("dense outlined stack-label").style("min-width: 230px").mark("settings")
            ui.select(
                list(PROFILES),
                value=self.profile,
                label="build of the code",
                on_change=lambda event: setattr(self, "profile", event.value),
            ).props("dense outlined options-dense").style("width: 190px")
            ui.input(
                "name of the constant",
                value=self.constant,
                on_change=lambda event: setattr(self, "constant", event.value),
            ).props("dense outlined stack-label").style("width: 190px")
        keys = ", ".join(key.written for key in SETTINGS)
        self.html(f'<p class="small soft" style="margin-top:8px">Settings: {escape(keys)}.</p>')
        with ui.element("div").classes("line"):
            action("params.h", lambda: self.download(".h"), main=True).mark("header")
            action("params.bin", lambda: self.download(".bin")).mark("blob")
            action("drive file", self.download_drive).mark("drive-file")
        if self.answer is not None:
            limits = {**self.answer["limits"], **self.answer["watch"]}
            rows = [(name.replace("_", " "), f"{value:.6g}") for name, value in limits.items()]
            self.html(
                rows_html(Rows("Limits of the correction", ("limit", "value"), rows, (1,)))
                + "".join(f'<p class="small">{escape(note)}</p>' for note in self.answer["notes"])
            )

    def download(self, suffix: str) -> None:
        """Hand the parameters to the browser."""
        try:
            content, self.answer = self.bench.export(
                suffix,
                shlex.split(self.settings),
                self.profile,
                self.constant,
            )
        except (LostMotionError, ValueError) as error:
            self.work.say(one_line(str(error)))
            return
        self.work.say("")
        ui.download.content(content, f"params{suffix}")
        self.redraw()

    def download_drive(self) -> None:
        """Hand the drive file to the browser."""
        name = Path(self.bench.need_drive().file).stem
        suffix = "_fitted" if self.bench.model is not None else ""
        ui.download.content(self.bench.fitted_drive().encode(), f"{name}{suffix}.toml")
