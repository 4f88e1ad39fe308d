"""The sections of the demonstration's report that no single command writes."""

from __future__ import annotations

from typing import Any

import numpy as np

from lostmotion.demo.controller import Emulated, Scores
from lostmotion.design import SearchResult
from lostmotion.discover.answer import Diagnosis
from lostmotion.drives import Drive
from lostmotion.report import Section
from lostmotion.report.charts import Chart
from lostmotion.report.front import front_figure
from lostmotion.report.page import PageTable
from lostmotion.report.svg import signs
from lostmotion.report.wording import words
from lostmotion.results import figures
from lostmotion.results.colours import BLUE, FAINT, ORANGE


def overview_section(
    drive: Drive,
    found: Diagnosis,
    plain: Scores,
    scores: Scores,
    designs: dict[str, SearchResult] | str,
) -> Section:
    """Summarise the case study in its main figures."""
    first, last = found.ladder[0], found.ladder[-1]
    worst = int(np.argmax(plain.after))
    ends = (scores.before[worst], plain.after[worst], scores.after[worst])
    facts = [
        (
            f"{drive.name}: missing effect",
            ", ".join(map(words, last["effects"])) or "nothing",
        ),
        ("error of the model, rms", f"{first['rms_arcsec']:.2f} arcsec"),
        ("with the missing effect", f"{last['rms_arcsec']:.2f} arcsec"),
        ("noise floor", f"{found.noise_floor_arcsec:.2f} arcsec"),
        (
            f"output at {scores.temperature_C[worst]:.0f} °C: uncompensated, baseline, with effect",
            ", ".join(f"{error:.0f}" for error in ends) + " arcsec",
        ),
    ]
    if not isinstance(designs, str):
        facts.append(("searched designs, lost motion", ", ".join(map(_gain, designs.values()))))
    return Section("Summary", "The main figures; details are in the sections below.", facts)


def _gain(found: SearchResult) -> str:
    was, now = (one["tolerance_lost_motion"] for one in (found.start, found.front[0]["figures"]))
    return signs(f"{100 * (now / was - 1):+.0f} %")


def controller_section(
    drive: Drive, plain: Scores, scores: Scores, emulated: Emulated | str
) -> Section:
    """Show the error of the joint's output without and with the exported parameters."""
    ran = not isinstance(emulated, str)
    if isinstance(emulated, str):
        where = f"Replayed on this machine with the controller's code: {emulated}."
    elif emulated.bits == scores.bits:
        where = (
            "Run on an emulated Cortex-M4F; it computed the same bits as the replay on this "
            "machine."
        )
    else:
        where = (
            "Run on an emulated Cortex-M4F; its bits are NOT those of the replay on this machine."
        )
    rows = [
        (
            str(label),
            f"{temperature:.0f}",
            f"{before:.1f}",
            f"{without:.1f}",
            f"{after:.1f}",
            *([] if isinstance(emulated, str) else [f"{emulated.after[i]:.1f}"]),
        )
        for i, (label, temperature, before, without, after) in enumerate(
            zip(
                scores.labels,
                scores.temperature_C,
                scores.before,
                plain.after,
                scores.after,
                strict=True,
            )
        )
    ]
    head = ["run", "°C", "uncompensated", "baseline model", "with effect"] + ["emulated"] * ran
    return Section(
        f"{drive.name}: on its controller",
        "The controller's code with the exported parameters, run over the recorded torque "
        f"loops at unusual temperatures. {where}",
        [("emulated", "Cortex-M4F" if ran else "no"), ("CRC-32 of all bits", scores.bits)],
        [
            Chart(
                "controller",
                "Error of the output at unusual temperatures",
                "rms in arc seconds: of the joint alone, with the parameters of the fit without "
                "the effect, and with it.",
                lambda: [draw_scores(plain, scores)],
                {
                    "run": scores.labels,
                    "temperature_C": scores.temperature_C,
                    "uncompensated_arcsec": scores.before,
                    "without_effect_arcsec": plain.after,
                    "compensated_arcsec": scores.after,
                },
            ),
            PageTable("Error of the output, arcsec rms", head, rows, range(1, len(head))),
        ],
    )


def draw_scores(plain: Scores, scores: Scores) -> Any:
    """Draw three bars for each run."""
    figure = figures.framed("", "rms, arcsec", "", 110 + 74 * len(scores.labels))
    rows = [f"{temperature:.0f} °C" for temperature in scores.temperature_C]
    for name, ink, values in (
        ("uncompensated", FAINT, scores.before),
        ("baseline", ORANGE, plain.after),
        ("with effect", BLUE, scores.after),
    ):
        figure.add_bar(
            x=values,
            y=rows,
            orientation="h",
            name=name,
            marker={"color": ink},
            text=[f"{value:.1f}" for value in values],
            textposition="outside",
            cliponaxis=False,
        )
    figure.update_yaxes(autorange="reversed", showgrid=False, type="category")
    figure.update_xaxes(range=[0, 1.15 * float(np.max(scores.before))])
    return figure


def design_section(designs: dict[str, SearchResult] | str) -> Section:
    """Show the results of the searches compared with textbook designs, and their fronts."""
    title = "Three design searches"
    if isinstance(designs, str):
        return Section(title, f"Left out: {designs}.")
    rows = []
    for name, found in designs.items():
        start, best = found.start, found.front[0]["figures"]
        was, now = start["tolerance_lost_motion"], best["tolerance_lost_motion"]
        holds = found.certificate is not None and found.certificate["holds"]
        rows.append(
            (
                name,
                f"{was:.3f}",
                f"{now:.3f}",
                _gain(found),
                f"{start['stress']:.3f}",
                f"{best['stress']:.3f}",
                "holds" if holds else "does not hold",
                str(len(found.front)),
            )
        )
    return Section(
        title,
        "A robot's joint, a large instrument drive with four rollers and a drive with a ring "
        "wave generator, optimised with the model of predict and compare. The budgets are "
        "small, as this is a demonstration.",
        [(f"lost motion, {name}", f"{was} to {now} arcmin") for name, was, now, *_ in rows],
        [
            PageTable(
                "Textbook start and best",
                (
                    "",
                    "lost motion, start",
                    "lost motion, best",
                    "change",
                    "stress, start",
                    "stress, best",
                    "fine check",
                    "on the front",
                ),
                rows,
                (1, 2, 3, 4, 5, 7),
                "Lost motion of a reversal over the tolerances, arcmin; stress as a share of the "
                "fatigue strength. The start has the teeth and wave generator of the best drive, "
                "textbook values otherwise, and its smallest gap closed.",
            ),
            *(
                front_figure(
                    [one["objectives"] for one in found.front],
                    found.objectives,
                    found.units,
                    f"the {name}",
                )
                for name, found in designs.items()
            ),
        ],
    )
