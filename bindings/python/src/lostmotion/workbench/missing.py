"""Which effect is missing, which two are confounded, and what to measure next."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from functools import partial
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

from nicegui import ui

from lostmotion import rules
from lostmotion.condition_cards import cause_of
from lostmotion.effects.effect import Effect
from lostmotion.report.discovery import detectable_rows, verdict_sentence
from lostmotion.report.effect_pictures import HEIGHT, WIDTH
from lostmotion.report.evidence import dots_figure
from lostmotion.report.ladder import ladder_figure
from lostmotion.report.page import PageTable, rows_html
from lostmotion.report.svg import signs
from lostmotion.report.wording import confounded_with, event_text, named_numbers, words
from lostmotion.workbench.bench import Bench
from lostmotion.workbench.panel import Panel, action, choice, field
from lostmotion.workbench.work import Work

NOT_TESTABLE = "Not testable with these recordings"


def capitalized(sentence: str) -> str:
    """Capitalise the first letter of a sentence."""
    return sentence[:1].upper() + sentence[1:]


def picture_of(effect: Effect) -> str:
    """Show the contribution of an effect; the browser requests it when it comes into view."""
    return (
        f'<img src="/effect/{quote(effect.name)}.svg" loading="lazy" width="{WIDTH:.0f}" '
        f'height="{HEIGHT:.0f}" alt="{escape(words(effect.name))}: its contribution">'
    )


class EffectsPanel(Panel):
    """Which effect is missing: the verdict, the ladder, every effect with its evidence."""

    name, title = "effects", "Effects"
    of_recordings = True

    def state(self) -> object:
        """Also redrawn when work begins and ends, because this disables and enables ticks."""
        return self.bench.version, self.work.busy

    def draw(self) -> None:
        """Draw the panel."""
        found = self.bench.diagnosis
        if found is None:
            self.html(
                '<p class="verdict">What is missing?</p><p>The diagnosis refits the drive with '
                "each effect of the library and compares their leave-one-run-out errors. It takes "
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
            self.chart(ladder_figure(model.ladder, model.noise_floor_arcsec, name))
        self.html(
            "<h3>Effects: tick one to add it and refit the model</h3>"
            '<p class="small soft">Pictures: the contribution of each with the typical values of '
            "its card.</p>"
        )
        ui.input("search effects", on_change=lambda event: self.search(event.value)).props(
            "dense outlined stack-label clearable"
        ).mark("search")
        self.groups: list[tuple[ui.element, list[tuple[str, ui.element]]]] = []
        causes: dict[str, list[dict[str, Any]]] = {}
        for entry in self.entries():
            cause = cause_of(self.bench.effects[entry["name"]].needs)
            causes.setdefault(cause if entry["testable"] else NOT_TESTABLE, []).append(entry)
        refused = causes.pop(NOT_TESTABLE, [])
        for cause, entries in (*causes.items(), *([(NOT_TESTABLE, refused)] if refused else [])):
            with ui.element("section") as group:
                self.html(f"<h4>{cause}</h4>")
                self.groups.append((group, [self.row(entry) for entry in entries]))

    def search(self, text: str | None) -> None:
        """Show only the effects whose name or mechanism contains these words."""
        wanted = (text or "").lower().split()
        for group, rows in self.groups:
            found = [all(word in said for word in wanted) for said, _ in rows]
            group.set_visibility(any(found))
            for (_, row), shown in zip(rows, found, strict=True):
                row.set_visibility(shown)

    def find(self) -> None:
        """Start the diagnosis."""
        self.work.start("diagnosing", lambda: self.bench.find_missing(self.work.tick))

    def verdict(self, answer: Mapping[str, Any]) -> None:
        """Describe what the diagnosis found."""
        sentence = verdict_sentence({**answer, "effects": map(words, answer["effects"])})
        lines = [
            f"It depends on {one['covariate'].replace('_', ' ')}: {one['shape']}."
            for one in answer["unexplained"]["depends_on"]
        ]
        lines += [f"Sudden: {event_text(event)}." for event in answer["events"]]
        lines.append(answer["next_experiment"])
        text = "".join(f"<p>{escape(line)}</p>" for line in lines)
        self.html(f'<p class="verdict" id="verdict">{escape(sentence)}</p>{text}')

    def entries(self) -> list[dict[str, Any]]:
        """All effects, ordered by evidence if there is a diagnosis."""
        if self.bench.diagnosis is not None:
            return list(self.bench.diagnosis.answer()["candidates"])
        return [{"name": name, "testable": True, "evidence": None} for name in self.bench.effects]

    def row(self, entry: Mapping[str, Any]) -> tuple[str, ui.element]:
        """Show one effect; what the search reads, and where it is."""
        name = entry["name"]
        effect = self.bench.effects[name]
        lines = [capitalized(effect.mechanism)]
        if not entry["testable"]:
            lines.append(entry.get("reason") or "not testable")
        elif known := named_numbers(
            entry.get("parameters") or {},
            entry.get("at_bound") or (),
            entry.get("not_fitted") or (),
        ):
            lines.append(", ".join(known))
        if self.bench.diagnosis is None or not entry["testable"]:
            others, how = list(effect.confused_with), "may be confounded with"
        else:
            others, how = confounded_with(entry), "confounded with"
        if others:
            lines.append(f"{how} {', '.join(map(words, others))}")
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
            self.html(picture_of(effect)).classes("seen")
            self.html(escape("; ".join(lines))).classes("about")
        return " ".join([words(name), *lines]).lower(), row

    def tick(self, name: str, wanted: bool) -> None:
        """Add an effect to the model or remove it."""
        names = [one for one in self.bench.chosen if one != name]
        if wanted:
            names.append(name)
        doing = f"fitting {' + '.join(map(words, names)) or 'the baseline model'}"
        if self.work.start(doing, lambda: self.bench.choose(names, self.work.tick)) is None:
            self.redraw()


class AlikePanel(Panel):
    """Two effects that are hard to separate, side by side."""

    name, title = "alike", "Confounded"
    of_recordings = True

    def __init__(self, bench: Bench, work: Work) -> None:
        super().__init__(bench, work)
        self.pair: list[str] = []

    def draw(self) -> None:
        """Draw the panel."""
        names = {name: words(name) for name in self.bench.fittable()}
        if not set(self.pair) <= names.keys() or not self.pair:
            self.pair = self.suggestion()
        self.html(
            "<p>Two confounded effects: how well does each explain the recordings, run by run, and "
            "what would separate them?</p>"
        )
        with ui.element("div").classes("line"):
            for place in (0, 1):
                label = "and" if place else "compare"
                choose = partial(self.pair.__setitem__, place)
                made = choice(names, self.pair[place], label, choose, "width: 210px")
                made.mark(f"pair{place}")
            action("Compare", self.start, main=True).mark("compare")
        if self.bench.rivals is not None:
            self.result()

    def suggestion(self) -> list[str]:
        """Suggest the rivals of the diagnosis, or the strongest effect and a confounded one."""
        found = self.bench.diagnosis
        ranked = [c for c in found.candidates if c["testable"]] if found is not None else []
        known = self.bench.fittable()
        names = [name for name in known if not self.bench.effects[name].absorbed]
        first = ranked[0]["name"] if ranked else names[0]
        others = [*(ranked[0]["confused_with"] if ranked else ())]
        others += [*self.bench.effects[first].confused_with, *(c["name"] for c in ranked[1:])]
        others += names
        return [first, next(one for one in others if one != first and one in known)]

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
                if rivals.angle_deg < rules.TWIN_DEG
                else "hard to separate"
                if rivals.angle_deg < rules.WARN_DEG
                else "well separated"
            )
            self.html(
                f'<p class="verdict">{rivals.angle_deg:.0f}° between their contributions here: '
                f"{alike}.</p>"
            )
        with ui.element("div").classes("two").props("id=rivals"):
            for name, model in rivals.models.items():
                rung = model.ladder[-1]
                about = self.bench.effects[name]
                gain = rivals.gains.get(name)
                rows = [
                    ("rms, arcsec", f"{rung['rms_arcsec']:.2f}"),
                    ("leave-one-run-out", f"{rung['rms_heldout_arcsec']:.2f}"),
                ]
                if gain is not None:
                    rows.append(("evidence, nats", signs(f"{gain.sum():.1f}")))
                    rows.append(("runs in favour", f"{int((gain > 0).sum())} of {gain.size}"))
                with ui.element("div"):
                    self.html(
                        rows_html(PageTable(words(name), ("", ""), rows, (1,)))
                        + picture_of(about)
                        + f'<p class="small">{escape(capitalized(about.mechanism))}.<br>'
                        f"{escape(about.equation)}<br><b>Separated by:</b> "
                        f"{escape(about.experiment or 'nothing known')}</p>"
                    )
        if rivals.gains:
            gains = [(words(name), gain) for name, gain in rivals.gains.items()]
            labels = [run.label for run in self.bench.need_campaign().runs]
            self.chart(dots_figure(gains, labels))


class NextPanel(Panel):
    """What to measure next."""

    name, title = "next", "Next run"
    of_recordings = True

    def __init__(self, bench: Bench, work: Work) -> None:
        super().__init__(bench, work)
        self.path = ""

    def draw(self) -> None:
        """Draw the panel."""
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
            "<h3>Possible runs</h3><p>A plan is a recording without the measured angle: "
            "run, time and torque, and any other quantity that you would set. Each of its runs is "
            "ranked by how "
            "well it decides between the effects that are still open.</p>"
        )
        with ui.element("div").classes("line"):
            field("plan, a file or a folder", self, "path", "min-width: 230px").mark("plan")
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
            self.html(rows_html(PageTable(f"To decide between {between}", head, rows, (1, 2, 3))))
        if found.smallest_detectable:
            self.html(rows_html(detectable_rows(found.answer())))

    def rank(self) -> None:
        """Rank the runs of the plan."""
        try:
            paths = [Path(path) for path in shlex.split(self.path)]
        except ValueError as error:
            self.work.say(f"plan: {error}")
            return
        self.work.start("ranking", lambda: self.bench.rank_options(paths, self.work.tick))
