"""The page: loaded data on the left, results on the right."""

from __future__ import annotations

import itertools
import re
import shlex
import tempfile
from collections.abc import Collection
from html import escape
from pathlib import Path

from nicegui import ui
from nicegui.events import MultiUploadEventArguments

from lostmotion.compare import REPEATABILITY
from lostmotion.drives import read_toml
from lostmotion.errors import LostMotionError, one_line
from lostmotion.report.charts import page_figure
from lostmotion.report.ladder import draw_ladder
from lostmotion.report.wording import NOISE_FLOOR, NOISE_FLOOR_IS, words
from lostmotion.shipped import find_inputs
from lostmotion.workbench.bench import Bench
from lostmotion.workbench.column_map import ColumnsPanel
from lostmotion.workbench.designs import DesignPanel, Search
from lostmotion.workbench.handing_out import ExportPanel
from lostmotion.workbench.measured import DrivePanel, MeasuredPanel, WherePanel
from lostmotion.workbench.missing import AlikePanel, EffectsPanel, NextPanel
from lostmotion.workbench.panel import Panel, action, plot
from lostmotion.workbench.plots import PlotsPanel
from lostmotion.workbench.work import Work

STYLE = Path(__file__).with_name("style.css")

WITHOUT_TOKEN = "<script>history.replaceState(null, '', '/')</script>"
"""Removes the token from the address bar and the history; from here on it is in the cookie."""

HIDDEN_CHARTS = """<script>
for (const kind of ['error', 'unhandledrejection']) addEventListener(kind, (event) => {
  if (/displayed plot div/.test(event.message ?? event.reason)) event.preventDefault();
});
</script>"""
"""Plotly refuses to fit a chart to its place while that is hidden; it does so when it is shown."""

LOOK_S = 0.2
"""Interval at which the page polls the bench for changes."""

EXAMPLE = "joint"
"""Folder of the demonstration's inputs with a drive and a campaign."""

DRIVE_SUFFIX = ".toml"
"""An uploaded file with this suffix is a drive file; any other is a recording."""


DROPPED = (DRIVE_SUFFIX, ".csv", ".gz", ".parquet")
"""Suffixes of files that can be dropped."""

LONG_FIRST = (".csv.gz", *DROPPED)
"""The same, longest first, so that the complete suffix of a name is found."""

NAME_BYTES = 200
"""Largest length of the name of a dropped file: file systems permit 255, which include the
suffix."""


DROP_HEADER = """
<div class="drop">
  <q-btn flat dense no-caps label="Choose files" @click="props.pickFiles" />
  <label>or drop them here: a drive, recordings, a search spec<q-uploader-add-trigger /></label>
</div>
"""
"""Content of the drop area: a button for the keyboard, and the file field with its label."""


class Page:
    """One view of the bench; a second tab of the browser shows the same bench."""

    def __init__(self, bench: Bench, work: Work, search: Search) -> None:
        self.bench = bench
        self.search = search
        self.work = work
        self.panels: list[Panel] = [
            DrivePanel(bench, work, self.load_example),
            ColumnsPanel(bench, work, self.load_paths),
            MeasuredPanel(bench, work),
            WherePanel(bench, work),
            PlotsPanel(bench, work),
            EffectsPanel(bench, work),
            AlikePanel(bench, work),
            NextPanel(bench, work),
            DesignPanel(bench, work, search),
            ExportPanel(bench, work),
        ]
        self.seen: tuple[int, int] | None = None
        self.refused: object = None
        opened = (panel for panel in self.panels if panel.name == bench.opened)
        self.open = next(opened, self.panels[0])

    def build(self) -> None:
        """Make the page."""
        ui.colors(primary="#0077bb")
        ui.dark_mode(None)  # dark mode as set in the system
        ui.add_css(STYLE)
        ui.add_head_html(WITHOUT_TOKEN + HIDDEN_CHARTS)
        ui.page_title("lostmotion workbench")
        with ui.element("header").classes("top"):
            ui.label("lostmotion workbench").classes("brand")
            self.what = ui.label().classes("what")
            self.job = ui.element("div").classes("job").props("role=status")
        self.message = ui.label().classes("message").props("role=alert")
        with ui.element("div").classes("desk"):
            with ui.element("aside").classes("rail"):
                with ui.element("section").classes("card"):
                    self.inputs()
                self.model = ui.element("section").classes("card")
            with ui.element("main").classes("sheet"):
                with (
                    ui.tabs(on_change=lambda event: self.show(event.value))
                    .props("dense no-caps align=left outside-arrows mobile-arrows")
                    .classes("tabs") as self.tabs
                ):
                    for panel in self.panels:
                        ui.tab(panel.name, panel.title).mark(f"tab-{panel.name}")
                for panel in self.panels:
                    panel.place = ui.element("section").classes("panel")
                    panel.place.props(f'aria-label="{panel.title}" id="panel-{panel.name}"')
                    panel.place.set_visibility(False)
        self.tabs.set_value(self.open.name)
        self.refresh()
        ui.timer(LOOK_S, self.refresh)

    # --- the rail --------------------------------------------------------------------------------

    def inputs(self) -> None:
        """Inputs for drive and recordings."""
        ui.html("<h2>Drive and recordings</h2>", sanitize=False)
        with ui.element("div").classes("stack"):
            self.drive_path = self.field("drive file", "joint.toml")
            self.data_paths = self.field("recordings, files or folders", "recordings/")
            with ui.element("div").classes("line"):
                action("Load", self.load_paths, main=True).mark("load")
            self.drop = ui.upload(
                multiple=True,
                auto_upload=True,
                on_multi_upload=self.uploaded,
                on_rejected=self.refuse_kind,
            )
            self.drop.props(f'flat accept="{",".join(DROPPED)}"').mark("upload")
            self.drop.add_slot("header", DROP_HEADER)
        drive = self.bench.drive
        self.drive_path.value = drive.file if drive is not None else ""
        self.data_paths.value = shlex.join(map(str, self.bench.paths))

    def field(self, text: str, example: str) -> ui.input:
        """Make an input that loads on Enter."""
        made = ui.input(text, placeholder=example).props("dense outlined stack-label")
        return made.on("keydown.enter", self.load_paths)

    def load_paths(self) -> None:
        """Load the files named in the fields."""
        try:
            paths = shlex.split(self.data_paths.value or "")
        except ValueError as error:
            self.work.say(f"recordings: {error}")
            return
        self.load(self.drive_path.value.strip(), paths)

    def load_example(self) -> None:
        """Load the input files of the demonstration."""
        try:
            folder = find_inputs() / EXAMPLE
        except LostMotionError as error:
            self.work.say(one_line(str(error)))
            return
        self.drive_path.value = str(folder / "joint.toml")
        self.data_paths.value = shlex.quote(str(folder / "joint.csv.gz"))
        self.search.spec = self.search.spec or str(folder / "spec.toml")
        self.load_paths()

    def load(self, drive: str, paths: list[str]) -> None:
        """Load a drive, recordings or both in the background."""
        now = self.bench.drive
        new = bool(drive) and (now is None or now.file != drive or bool(paths))

        def task() -> None:
            # If recordings are loaded, a drive is loaded only with its own recordings.
            together = bool(paths) and self.bench.campaign is not None
            if new and not together:
                self.bench.load_drive(drive)
            if paths:
                file = drive if new and together else None
                self.bench.load_recordings(paths, None, self.work.tick, file)

        if not drive and not paths:
            self.work.say("nothing to load: name a drive file, or drop one")
            return
        if self.work.start("comparing" if paths else "predicting", task):
            self.turn_to("measured" if paths else "drive")
        else:
            self.work.say(f"not loaded: the page is {self.work.label}; stop that, or load again")

    def refuse_kind(self) -> None:
        """Describe what can be dropped."""
        self.drop.reset()
        self.work.say(f"dropped files: found another kind, expected {', '.join(DROPPED)}")

    async def uploaded(self, event: MultiUploadEventArguments) -> None:
        """Load dropped files; they are stored and read like any others."""
        self.work.say("")
        folder = Path(tempfile.mkdtemp(prefix="drop", dir=self.bench.folder))
        names: list[str] = []
        for file in event.files:
            name = plain_name(file.name, {Path(other).name for other in names})
            if not name.lower().endswith(DROPPED):
                self.refuse_kind()
                return
            await file.save(folder / name)
            names.append(str(folder / name))
        self.drop.reset()
        specs = [name for name in names if is_spec(name)]
        drives = [name for name in names if name.endswith(DRIVE_SUFFIX) and name not in specs]
        recordings = [name for name in names if name not in (*specs, *drives)]
        if specs:
            self.search.name(specs[-1])
            self.turn_to("design")
            if not drives and not recordings:
                return
        if len(drives) > 1:
            self.work.say("dropped files: found two drive files, expected one")
            return
        if drives:
            self.drive_path.value = drives[0]
        elif self.bench.drive is not None:  # the field may name a file that could not be read
            self.drive_path.value = self.bench.drive.file
        if recordings:
            self.data_paths.value = shlex.join(recordings)
        self.load_paths() if recordings else self.load(self.drive_path.value, [])

    def show_model(self) -> None:
        """Show the error and the effects of the current model."""
        bench = self.bench
        ui.html("<h2>Error of the model</h2>", sanitize=False)
        if bench.comparison is None:
            ui.label("Load recordings to see how far off the drive file is.").classes("soft small")
            return
        answer = bench.comparison.answer()
        model = bench.model
        last = model.ladder[-1] if model is not None else None
        rms = last["rms_arcsec"] if last else answer["rms_arcsec"]
        held = last["rms_heldout_arcsec"] if last else answer["heldout_rms_arcsec"]
        floor = model.noise_floor_arcsec if model is not None else answer["noise_floor_arcsec"]
        against, what = REPEATABILITY, bench.comparison.noise.parts
        if model is not None:
            against, what = NOISE_FLOOR, NOISE_FLOOR_IS
        ui.html(
            f'<div class="big"><span id="rms">{rms:.2f}</span><small>arcsec rms</small></div>'
            f'<div class="pair"><span>leave-one-run-out</span><b>{held:.2f} arcsec</b></div>'
            f'<div class="pair"><span title="{what}">{against}</span>'
            f"<b>{floor:.2f} arcsec</b></div>"
            '<div class="pair"><span>data-sheet model</span>'
            f"<b>{answer['unfitted_rms_arcsec']:.2f} arcsec</b></div>",
            sanitize=False,
        )
        if model is None or not model.ladder:
            return
        with ui.element("div").props("id=ladder"):
            figure = draw_ladder(model.ladder, floor, narrow=True)
            figure.update_layout(title=None)
            plot(page_figure(figure), "error ladder")
        if bench.chosen:
            with ui.element("div").classes("line"):
                for name in bench.chosen:
                    ui.html(escape(words(name)), sanitize=False).classes("chip on")
                action("Undo the last", self.undo).mark("undo")

    def undo(self) -> None:
        """Remove the last effect from the model."""
        names = self.bench.chosen[:-1]
        self.work.start("fitting", lambda: self.bench.choose(names, self.work.tick))

    # --- redrawing -------------------------------------------------------------------------------

    def turn_to(self, name: str) -> None:
        """Open a panel."""
        self.tabs.set_value(name)

    def show(self, name: str) -> None:
        """Show a panel, redrawn if the state has changed."""
        for panel in self.panels:
            panel.place.set_visibility(panel.name == name)
            if panel.name == name:
                self.open = panel
                self.bench.opened = name
                panel.update()

    def refresh(self) -> None:
        """Redraw the parts that have changed."""
        now = (self.bench.version, self.work.version)
        if self.seen != now:
            before = self.seen
            self.seen = now
            self.show_job()
            if before is None or before[0] != now[0]:
                self.show_bench()
            self.ask_columns()
        self.open.update()

    def ask_columns(self) -> None:
        """Open the columns of recordings that were refused because of them."""
        bench, table = self.bench, self.bench.columns
        if self.work.busy or table is None or bench.named == bench.paths:
            return
        if self.refused != bench.named:
            self.refused = bench.named
            rows, lacking = table.rows()
            if lacking or any(row.fault for row in rows):
                self.turn_to("columns")

    def show_bench(self) -> None:
        """Show the loaded data and the error of the model."""
        bench = self.bench
        parts = []
        if bench.drive is not None:
            parts.append(bench.drive.name)
        if bench.campaign is not None:
            parts.append(f"{len(bench.campaign.runs)} runs, {bench.campaign.rows} samples")
        self.what.set_text("  ·  ".join(parts))
        self.model.clear()
        with self.model:
            self.show_model()

    def show_job(self) -> None:
        """Show the running task, and the message of the last one."""
        work = self.work
        self.message.set_text(self.told(work.message))
        self.job.clear()
        if not work.busy:
            return
        with self.job:
            doing = f"{work.label}: {words(work.step)}" if work.step else work.label
            ui.label("stopping" if work.stopping else doing).classes("small")
            share = round(100 * work.share)
            ui.html(f'<div class="bar"><div style="width:{share}%"></div></div>', sanitize=False)
            action("Stop", work.stop).mark("stop")

    def told(self, message: str) -> str:
        """Show a message as on the command line; without the folder for dropped files."""
        return message.replace(f"{self.bench.folder}/", "")


def plain_name(name: str, taken: Collection[str] = ()) -> str:
    """Make a valid file name from the name that a browser sends.

    Folders, control characters and leading dots are removed; a long name is shortened with its
    suffix kept; a second file of the same name gets a number.
    """
    last = re.split(r"[/\\]", name)[-1]
    last = "".join(c for c in last if c.isprintable()).strip().lstrip(".") or "recording.csv"
    suffix = next((s for s in LONG_FIRST if last.lower().endswith(s)), "")
    stem, end = last[: len(last) - len(suffix)] or "recording", last[len(last) - len(suffix) :]
    stem = stem.encode(errors="replace")[:NAME_BYTES].decode(errors="ignore")
    numbers = itertools.chain([""], (f"_{i}" for i in itertools.count(2)))
    return next(made for n in numbers if (made := f"{stem}{n}{end}") not in taken)


def is_spec(file: str) -> bool:
    """Whether a dropped file is a search spec: TOML with a table [search]."""
    if not file.endswith(DRIVE_SUFFIX):
        return False
    try:
        return "search" in read_toml(file, "a search spec")
    except LostMotionError:
        return False
