"""The panel of the design search: live progress, stop and resume, selection of designs."""

from __future__ import annotations

import math
import shlex
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from nicegui import ui

from lostmotion.design import SearchResult, search
from lostmotion.design.engine import figures
from lostmotion.design.report import limit_name
from lostmotion.design.result import margin_unit
from lostmotion.design.spec import read_spec
from lostmotion.drives import format_toml
from lostmotion.errors import InputError, LostMotionError
from lostmotion.files import check_plain, is_inside, write_whole
from lostmotion.report.charts import page_figure
from lostmotion.report.front import axis_name, draw_front
from lostmotion.report.page import PageTable, facts_html, rows_html
from lostmotion.report.svg import signs
from lostmotion.report.wording import written
from lostmotion.workbench.bench import Bench
from lostmotion.workbench.disclosure import public_message
from lostmotion.workbench.panel import Panel, action, choice, field, plot
from lostmotion.workbench.work import LOG, Work

MARGINS = 14
"""Number of margins of a picked design that are listed: the smallest."""


class Search:
    """A design search in the background, independent of the analysis.

    Parameters
    ----------
    roots : sequence of path
        Folders that a search may write to.

    Attributes
    ----------
    names, units : tuple of str
        Of the objectives.
    seen : dict or None
        The last progress.
    result : SearchResult or None
        Of the last search that ended or was stopped.
    """

    def __init__(self, roots: Sequence[str | Path] = (".",)) -> None:
        self.roots = tuple(roots)
        self.spec = ""
        self.folder = ""
        self.names: tuple[str, ...] = ()
        self.units: tuple[str, ...] = ()
        self.seen: dict[str, Any] | None = None
        self.result: SearchResult | None = None
        self.message = ""
        self.running = False
        self.version = 0
        self.stop_event = threading.Event()
        self.threads = ThreadPoolExecutor(1, thread_name_prefix="search")

    def start(self, *, resume: bool) -> None:
        """Start a search into the folder, or resume it."""
        if self.running:
            return
        self.running, self.message = True, ""
        self.seen = self.result = None
        self.stop_event.clear()
        self.version += 1
        self.threads.submit(self.run, resume)

    def run(self, resume: bool) -> None:
        """Run the search; errors are reported as on the command line."""
        spec, folder = self.spec, self.folder
        words = ["lostmotion", "design", spec, "-o", folder, *(["--resume"] if resume else [])]
        try:
            check_plain(spec, "a search spec")
            if folder and not is_inside(folder, self.roots):
                inside = " or ".join(f"'{root}'" for root in self.roots)
                where = f"a folder in {inside}; workbench --root FOLDER allows another"
                raise InputError(folder, "", "a folder elsewhere", where)
            listed = figures()
            chosen = [listed[i] for i in read_spec(spec).objectives]
            self.names, self.units = tuple(n for n, _ in chosen), tuple(u for _, u in chosen)
            self.result = search(
                spec,
                folder,
                resume=resume,
                watch=self.take,
                stop=self.stop_event,
                command=shlex.join(words),
            )
            self.message = self.result.note
        except LostMotionError as error:
            self.message = public_message(error)
        except Exception as error:
            LOG.exception("the search failed")
            self.message = f"{type(error).__name__}; see the terminal for details"
        finally:
            self.running = False
            self.version += 1

    def take(self, seen: dict[str, Any]) -> None:
        """Record progress."""
        self.seen = seen
        self.version += 1

    def name(self, spec: str) -> None:
        """Select another spec; results of the last one are removed."""
        self.spec, self.folder = spec, f"{Path(spec).stem}_run"
        self.message = ""
        self.version += 1

    def close(self) -> None:
        """Stop and save the state."""
        self.stop_event.set()
        self.threads.shutdown(cancel_futures=True)


PICTURE_S = 1.0
"""Least time between two pictures of the front while a search runs."""


class DesignPanel(Panel):
    """Search a design."""

    name, title = "design", "Design"

    def __init__(self, bench: Bench, work: Work, search: Search) -> None:
        super().__init__(bench, work)
        self.search = search
        self.picked: int | None = None
        self.axes = (0, 1)
        self.drawn_result: object = None

    def state(self) -> object:
        """The panel is redrawn when a search begins or ends; progress is drawn separately."""
        search = self.search
        return search.running, id(search.result), search.message

    def update(self) -> None:
        """Draw changes; during a search only the progress."""
        super().update()
        if self.search.version != getattr(self, "live_version", None):
            self.live_version = self.search.version
            self.draw_live()

    def draw(self) -> None:
        """Draw the panel."""
        search = self.search
        self.html(
            "<p>A search spec states variables, limits and objectives. The search runs in the "
            "background and writes to its folder as the command does: you can stop it, close the "
            "page, and resume it later.</p>"
        )
        with ui.element("div").classes("line"):
            wide = "min-width: 250px; flex: 1 1 250px"
            field("spec, a file", search, "spec", wide)
            field("folder of the search", search, "folder", wide)
        with ui.element("div").classes("line").style("margin-top: 8px"):
            start = action("Start", lambda: self.begin(resume=False), main=True)
            resume = action("Resume", lambda: self.begin(resume=True))
            stop = action("Stop", search.stop_event.set)
            start.mark("search-start").set_enabled(not search.running)
            resume.mark("search-resume").set_enabled(not search.running)
            stop.mark("search-stop").set_enabled(search.running)
        if search.message:
            ui.label(search.message).classes("message").props("role=alert").style("margin-top: 8px")
        self.live = ui.element("div").props("id=live aria-live=polite").style("margin-top: 12px")
        self.picture = ui.element("div").classes("front")
        self.pictured = -math.inf
        self.details = ui.element("div").props("id=design")
        if self.drawn_result is not search.result:
            self.drawn_result, self.picked = search.result, None
        self.live_version = search.version
        self.draw_live()
        self.draw_details()

    def begin(self, *, resume: bool) -> None:
        """Start or resume."""
        search = self.search
        search.spec, search.folder = search.spec.strip(), search.folder.strip()
        if search.spec and not search.folder:
            search.folder = Path(search.spec).stem + "_run"
        search.start(resume=resume)

    def front(self) -> list[list[float]]:
        """Objectives of the designs of the present front."""
        result, seen = self.search.result, self.search.seen
        if result is not None:
            return [list(one["objectives"]) for one in result.front]
        return [list(one) for one in seen["front"]] if seen is not None else []

    def draw_live(self) -> None:
        """Draw progress and the front so far."""
        seen = self.search.seen
        self.live.clear()
        if seen is None:
            self.picture.clear()
            with self.live:
                if self.search.running:
                    ui.label("starting")
            return
        ends = seen["combinations"]
        share = seen["done_share"]
        best = "none yet"
        if seen["best_value"] is not None:
            best = written(seen["best_value"], 4)
        left = seen["seconds_left"]
        result = self.search.result
        done = "finished" if result is not None and result.finished else "stopped"
        facts = [
            ("stage", seen["stage"] if self.search.running else done),
            ("evaluations", f"{seen['evaluations']} of {seen['budget']}"),
            (f"best {axis_name(self.search.names[0], self.search.units[0])}", best),
            ("feasible", f"{100 * seen['feasible_share']:.0f} %"),
            ("combinations done", f"{ends['total'] - ends['not_reached']} of {ends['total']}"),
        ]
        if self.search.running and left is not None:
            facts.append(("time left", f"{left:.0f} s"))
        with self.live:
            self.html(
                '<div class="wide-bar"><div '
                f'style="width:{100 * share:.1f}%"></div></div>{facts_html(facts)}'
            )
        # A chart takes longer to draw than the numbers: not at every step of a search.
        now = time.monotonic()
        if self.search.running and now - self.pictured < PICTURE_S:
            return
        self.pictured = now
        self.picture.clear()
        front, names, units = self.front(), self.search.names, self.search.units
        with self.picture:
            if result is not None and len(names) > 2:
                self.choose_axes()
            title = "The front of the search"
            figure = draw_front(front, names, units, self.axes, self.picked)
            plot(page_figure(figure), title).on(
                "plotly_click",
                lambda event: self.pick(event.args),
                js_handler="(e) => emit(e.points[0].customdata)",
            )

    def choose_axes(self) -> None:
        """Let the user choose the two objectives to be drawn."""
        named = zip(self.search.names, self.search.units, strict=True)
        options = {i: axis_name(name, unit) for i, (name, unit) in enumerate(named)}
        with ui.element("div").classes("line"):
            for place, text in enumerate(("along", "upwards")):
                choice(options, self.axes[place], text, partial(self.turn, place), "width: 220px")

    def turn(self, place: int, objective: int) -> None:
        """Draw another objective."""
        self.axes = (objective, self.axes[1]) if place == 0 else (self.axes[0], objective)
        self.pictured = -math.inf
        self.draw_live()

    def pick(self, number: int) -> None:
        """Pick a design of the front."""
        self.picked, self.pictured = number, -math.inf
        self.draw_live()
        self.draw_details()

    def draw_details(self) -> None:
        """Describe the picked design."""
        self.details.clear()
        result = self.search.result
        with self.details:
            if result is None or not result.front:
                return
            with ui.element("div").classes("line"):
                lines = {i: self.one_line(i) for i in range(len(result.front))}
                wide = "min-width: 260px; flex: 1 1 260px"
                choice(lines, self.picked, "design, or pick a dot", self.pick, wide)
            if self.picked is None:
                return
            one = result.front[self.picked]
            rows = [
                (axis_name(n, u), written(v, 5))
                for n, u, v in zip(result.objectives, result.units, one["objectives"], strict=True)
            ]
            # The margin of a limit that the spec does not state is 1.
            stated = [item for item in one["margins"].items() if item[1] != 1.0]
            margins = [
                (limit_name(name), signs(f"{value:+.4f}"), margin_unit(name))
                for name, value in sorted(stated, key=lambda item: item[1])[:MARGINS]
            ]
            with ui.element("div").classes("two"):
                self.html(
                    rows_html(
                        PageTable(f"Design {self.picked + 1}", ("objective", "value"), rows, (1,))
                    )
                )
                self.html(
                    rows_html(
                        PageTable(
                            "Margins, the tightest first", ("limit", "margin", ""), margins, (1,)
                        )
                    )
                )
            with ui.element("div").classes("line"):
                action("Load into the workbench", lambda: self.put(one["drive"]), main=True).mark(
                    "put"
                )
                action("drive file", lambda: self.download(one["drive"])).mark("design-file")

    def one_line(self, number: int) -> str:
        """Name a design by its number and objectives."""
        return f"{number + 1}: " + ", ".join(written(value, 5) for value in self.front()[number])

    def put(self, document: dict[str, Any]) -> None:
        """Load the design as the drive."""
        assert self.picked is not None
        file = self.bench.folder / f"design_{self.picked + 1}.toml"

        def task() -> None:
            write_whole(file, format_toml(document))
            self.bench.load_drive(file)

        self.work.start("predicting", task)

    def download(self, document: dict[str, Any]) -> None:
        """Send the drive file to the browser."""
        assert self.picked is not None
        ui.download.content(format_toml(document).encode(), f"design_{self.picked + 1}.toml")
