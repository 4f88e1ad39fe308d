"""The columns of the recordings: what each is taken as, and a map for other names and units."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

from nicegui import ui

from lostmotion.drives import format_toml
from lostmotion.recordings import QUANTITIES
from lostmotion.recordings.column_table import DATES, Choice, ColumnRow, units_for
from lostmotion.report.wording import words
from lostmotion.workbench.bench import Bench
from lostmotion.workbench.panel import Panel, action
from lostmotion.workbench.work import Work

FIRST_SHOWN = 3
"""Number of first values of a column that are shown."""

BY_NAME = "by its name"
"""Choice without a map entry."""

HEAD = ("column", "first values", "taken as", "unit", "sign", "counts per unit", "")


class ColumnsPanel(Panel):
    """The columns: what each is taken as, with first values and unit, changed by a select."""

    name, title = "columns", "Columns"

    def __init__(self, bench: Bench, work: Work, load: Callable[[], None]) -> None:
        super().__init__(bench, work)
        self.load = load

    def state(self) -> object:
        """Also redrawn when work begins and ends."""
        return self.bench.version, self.work.busy

    def draw(self) -> None:
        """Draw the panel."""
        table = self.bench.columns
        if table is None:
            self.hint(
                "No recordings yet: name files or folders, or drop them. Their columns are shown "
                "here, with the quantity and the unit that each is read as."
            )
            return
        rows, lacking = table.rows()
        files = ", ".join(path.name for path in self.bench.named)
        used = sum(bool(row.quantity) for row in rows)
        self.html(
            f'<p class="verdict">{used} of {len(rows)} columns are used</p><p class="wrap">'
            f"{escape(files)}: choose what a column is, and its unit. A unit is never guessed.</p>"
        )
        faults = "".join(f"<li>{escape(one)}</li>" for one in lacking)
        self.html(f'<div role="alert"><ul class="bad">{faults}</ul></div>' if faults else "")
        with (
            ui.element("div")
            .classes("scroll")
            .props('tabindex=0 role=region aria-label="columns"'),
            ui.element("table").classes("columns"),
        ):
            head = "".join(f'<th scope="col">{one}</th>' for one in HEAD[:-1])
            head += '<th scope="col"><span class="unseen">remark</span></th>'
            ui.html(f"<tr>{head}</tr>", sanitize=False, tag="thead")
            with ui.element("tbody"):
                for place, row in enumerate(rows):
                    self.row(place, row, table.choice(row.name))
        with ui.element("div").classes("line").style("margin-top: 12px"):
            load = action("Load with these columns", self.load, main=True).mark("load-columns")
            load.set_enabled(not self.work.busy)
        self.paste(table.mapping)

    def row(self, place: int, row: ColumnRow, choice: Choice) -> None:
        """Show one column with its controls."""
        quantity = QUANTITIES.get(choice.quantity)
        shown = [value for value in row.first if value][:FIRST_SHOWN]
        remark = ("! " if row.fault else "") + row.remark
        with ui.element("tr").classes("fault" if row.fault else ""):
            ui.html(escape(row.name), sanitize=False, tag="th").props("scope=row").classes("wrap")
            first = escape(", ".join(shown)) or "–"
            ui.html(first, sanitize=False, tag="td").classes("wrap first")
            with ui.element("td"):
                read = f"{BY_NAME}: {words(row.quantity) if row.quantity else 'not used'}"
                options = {"": BY_NAME if quantity else read}
                options |= {name: words(name) for name in QUANTITIES}
                self.select(
                    f"take-{place}",
                    f"{row.name} is",
                    options,
                    choice.quantity if quantity else "",
                    lambda value: self.take(place, row.name, str(value)),
                )
            with ui.element("td"):
                if quantity is not None and quantity.unit:
                    listed = units_for(quantity)
                    listed += [choice.unit] if choice.unit not in ("", *listed) else []
                    names = {one: "date or time of day" if one == DATES else one for one in listed}
                    self.select(
                        f"unit-{place}",
                        f"unit of {row.name}",
                        names,
                        choice.unit or None,
                        lambda value: self.put(place, row.name, "unit", value),
                    )
                else:
                    self.html(escape("date or time of day" if row.unit == DATES else row.unit))
            numeric = quantity is not None and bool(quantity.unit) and choice.unit != DATES
            with ui.element("td"):
                if numeric:
                    self.select(
                        f"sign-{place}",
                        f"sign of {row.name}",
                        {False: "+", True: "−"},
                        choice.reversed,
                        lambda value: self.put(place, row.name, "reversed", value),
                    )
            with ui.element("td"):
                if numeric:
                    counts = ui.input(value=choice.divisor, placeholder="1").props(
                        f'dense outlined for=counts-{place} aria-label="counts per unit of '
                        f'{escape(row.name)}"'
                    )
                    counts.on(
                        "change",
                        lambda: self.put(place, row.name, "divisor", (counts.value or "").strip()),
                    )
            ui.html(escape(remark), sanitize=False, tag="td").classes("remark wrap")

    def select(
        self,
        key: str,
        label: str,
        options: dict[Any, str],
        value: Any,
        choose: Callable[[Any], None],
    ) -> None:
        """Make a select; its element has an id, so that it keeps the focus."""
        made = ui.select(options, value=value, on_change=lambda event: choose(event.value))
        made.props(f'dense outlined options-dense for={key} aria-label="{escape(label)}"')

    def take(self, place: int, column: str, quantity: str) -> None:
        """Take a column as a quantity; the unit stays if the quantity has it."""
        table = self.bench.columns
        assert table is not None
        before = table.choice(column)
        known = units_for(QUANTITIES[quantity]) if quantity else []
        unit = before.unit if before.unit in known else ""
        self.choose(column, replace(before, quantity=quantity, unit=unit), f"take-{place}")

    def put(self, place: int, column: str, part: str, value: Any) -> None:
        """Change unit, sign or divisor of a column."""
        table = self.bench.columns
        assert table is not None
        key = {"reversed": "sign", "divisor": "counts"}.get(part, part)
        self.choose(column, replace(table.choice(column), **{part: value}), f"{key}-{place}")

    def choose(self, column: str, choice: Choice, focus: str) -> None:
        """Change the map of a column, and return the focus to its control."""
        self.bench.choose_column(column, choice)
        self.update()
        self.place.client.run_javascript(f"document.getElementById({json.dumps(focus)})?.focus()")

    def paste(self, mapping: dict[str, str]) -> None:
        """Show the map as options of a command and as a table of a drive file."""
        if not mapping:
            return
        pairs = [f"{column}={entry}" for column, entry in mapping.items()]
        data = " ".join(shlex.quote(str(path)) for path in map(self.plain, self.bench.named))
        options = " ".join(f"--map {shlex.quote(pair)}" for pair in pairs)
        lines = {
            "The same map on the command line": f"lostmotion check {data} {options}",
            "The same map in the drive file": format_toml({"columns": mapping}).strip(),
        }
        for title, text in lines.items():
            self.html(f"<h3>{title}</h3>")
            self.html(f'<pre class="paste">{escape(text)}</pre>')
            action("Copy", lambda text=text: ui.clipboard.write(text)).props(
                f'aria-label="Copy: {title.lower()}"'
            )

    def plain(self, path: Path) -> Path:
        """Return a path without the folder for dropped files."""
        return Path(path.name) if self.bench.folder in path.parents else path
