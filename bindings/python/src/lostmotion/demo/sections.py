"""The sections of the demonstration's report that no single command writes."""

from __future__ import annotations

import numpy as np

from lostmotion.demo.controller import Emulated, Scores
from lostmotion.design import SearchResult
from lostmotion.discover.answer import Diagnosis
from lostmotion.drives import Drive
from lostmotion.report import Section
from lostmotion.report.chart import Axes, round_up
from lostmotion.report.front import front_figure
from lostmotion.report.page import Figure, FigureData, PageTable
from lostmotion.report.svg import BLUE, FAINT, ORANGE, SMALL_SIZE, Drawing, signs, text_width
from lostmotion.report.wording import words


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
            Figure(
                "Error of the output at unusual temperatures",
                "rms in arc seconds: of the joint alone, with the parameters of the fit without "
                "the effect, and with it.",
                lambda width: draw_scores(plain, scores, width),
                FigureData(
                    "controller",
                    {
                        "run": scores.labels,
                        "temperature_C": scores.temperature_C,
                        "uncompensated_arcsec": scores.before,
                        "without_effect_arcsec": plain.after,
                        "compensated_arcsec": scores.after,
                    },
                ),
            ),
            PageTable("Error of the output, arcsec rms", head, rows, range(1, len(head))),
        ],
    )


def draw_scores(plain: Scores, scores: Scores, width: float) -> str:
    """Draw three bars for each run."""
    left, top, row, bar = 58.0, 40.0, 58.0, 13.0
    inks = (FAINT, ORANGE, BLUE)
    parts = (scores.before, plain.after, scores.after)
    height = row * len(scores.labels)
    drawing = Drawing(width, top + height + 44, "Error of the output, arcsec rms")
    most = round_up(1.15 * float(scores.before.max()))
    axes = Axes(drawing, (left, top, width - left - 16, height), (0.0, most), (0.0, 1.0))
    axes.frame("rms, arcsec", "", ticks=(width / 110, 0.0))
    for i, temperature in enumerate(scores.temperature_C):
        y = top + row * i + 7
        drawing.text(left - 8, y + 1.9 * bar, f"{temperature:.0f} °C", anchor="end")
        for k, (ink, values) in enumerate(zip(inks, parts, strict=True)):
            end = float(axes.x(values[i]))
            drawing.rectangle(left, y + k * (bar + 1), max(end - left, 1.0), bar, ink)
            drawing.text(end + 5, y + k * (bar + 1) + 11, f"{values[i]:.1f}", size=SMALL_SIZE)
    x = left
    for ink, name in zip(inks, ("uncompensated", "baseline", "with effect"), strict=True):
        drawing.rectangle(x, 10, 12, 12, ink)
        drawing.text(x + 17, 20, name, size=SMALL_SIZE)
        x += 34 + text_width(name, SMALL_SIZE)
    return drawing.render()


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
