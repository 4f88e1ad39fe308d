"""Export: parameters for the controller, and the fitted drive file."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

from nicegui import ui

from lostmotion.errors import LostMotionError, one_line
from lostmotion.export import PROFILES, SETTINGS, Profile
from lostmotion.report.page import PageTable, rows_html
from lostmotion.report.wording import words
from lostmotion.workbench.bench import Bench
from lostmotion.workbench.panel import Panel, action, choice, field
from lostmotion.workbench.work import Work


class ExportPanel(Panel):
    """Parameters for the controller, and the equivalent drive file."""

    name, title = "export", "Export"

    def __init__(self, bench: Bench, work: Work) -> None:
        super().__init__(bench, work)
        self.settings = "period_us=500"
        self.profile: Profile = "standard"
        self.constant = "joint_parameters"
        self.answer: Mapping[str, Any] | None = None

    def draw(self) -> None:
        """Draw the panel."""
        bench = self.bench
        if bench.drive is None:
            self.hint("Load a drive first.")
            return
        if bench.model is not None:
            added = " and ".join(map(words, bench.chosen))
            with_it = f"with {added}" if added else "no effect added"
            what = f"The drive as fitted to the recordings, {with_it}."
        else:
            what = "The drive as stated in its file: nothing has been fitted yet (tick an effect)."
        self.html(f'<p class="verdict">{escape(what)}</p>')
        with ui.element("div").classes("line"):
            field("settings", self, "settings", "min-width: 230px").mark("settings")
            builds = {name: name for name in PROFILES}
            put = partial(setattr, self, "profile")
            choice(builds, self.profile, "build of the code", put, "width: 190px")
            field("name of the constant", self, "constant", "width: 190px")
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
                rows_html(PageTable("Limits of the correction", ("limit", "value"), rows, (1,)))
                + "".join(f'<p class="small">{escape(note)}</p>' for note in self.answer["notes"])
            )

    def download(self, suffix: str) -> None:
        """Send the parameters to the browser."""
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
        """Send the drive file to the browser."""
        name = Path(self.bench.need_drive().file).stem
        suffix = "_fitted" if self.bench.model is not None else ""
        ui.download.content(self.bench.fitted_drive().encode(), f"{name}{suffix}.toml")
