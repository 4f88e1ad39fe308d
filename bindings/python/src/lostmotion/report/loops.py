"""Figures of a comparison: measured loops against the model, and where the model fails."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lostmotion.compare import REPEATABILITY, Comparison
from lostmotion.friction import WORDS
from lostmotion.report.chart import Axes, axis_range, nice_step
from lostmotion.report.page import Figure, FigureData
from lostmotion.report.svg import (
    BLUE,
    FAINT,
    INK,
    ORANGE,
    SMALL_SIZE,
    SOFT,
    Drawing,
    abridged,
    shortened,
    text_width,
)
from lostmotion.report.wording import chance, with_zeros, words
from lostmotion.units import ARCMIN, ARCSEC

MEASURED, MODEL = SOFT, ORANGE

SAME_SIZE = 1.3
"""Runs whose largest torques differ by no more than this factor are drawn together."""

GROUPS_SHOWN = 2
"""Number of loop sizes drawn: the largest and the smallest."""

LOOP_LEAST = 0.02
"""Runs whose torque varies by less than this share of the largest are not loops (a drive that
turns): they are drawn only if there are no others."""

LOST_MOTION = "lost motion, arcmin"

RUNS_SHOWN = 6
"""Largest number of runs of a size that are drawn."""

ARCSEC_MOST = 600.0
"""Error in arcsec above which arcmin is used."""


def groups(result: Comparison) -> list[list[int]]:
    """Runs that are drawn together: loops of one size, the largest first."""
    sizes = [float(np.max(np.abs(run.torque_Nm))) for run in result.campaign.runs]
    swings = [float(np.ptp(run.torque_Nm)) for run in result.campaign.runs]
    loops = [i for i, swing in enumerate(swings) if swing >= LOOP_LEAST * max(sizes)]
    loops = loops or list(range(len(sizes)))
    order = sorted(loops, key=lambda i: -sizes[i])
    found: list[list[int]] = []
    for i in order:
        if found and sizes[found[-1][0]] <= SAME_SIZE * max(sizes[i], 1e-12):
            found[-1].append(i)
        else:
            found.append([i])
    found = [sorted(group) for group in found]
    if len(found) > GROUPS_SHOWN:
        found = [found[0], found[-1]]
    return [group[:RUNS_SHOWN] for group in found]


def error_unit(result: Comparison) -> tuple[float, str]:
    """Unit for errors: arcsec, or arcmin if they are large."""
    large = result.as_it_stands_rms_rad / ARCSEC >= ARCSEC_MOST
    return (ARCMIN, "arcmin") if large else (ARCSEC, "arcsec")


def loops_figure(result: Comparison, name: str) -> Figure:
    """Make the figure of the loops and their residuals."""
    shown = groups(result)
    drawn = sum(len(group) for group in shown)
    unit, unit_name = error_unit(result)
    left_out = len(result.campaign.runs) - drawn
    caption = (
        "Measured lost motion (grey) and the fitted baseline (orange) against torque, each run "
        "about its own zero; below, measured minus model on the same axis, with the "
        f"{REPEATABILITY} of ±{with_zeros(result.noise.floor_rad / unit)} {unit_name} as a grey "
        f"band ({result.noise.parts}). "
        f"rms {with_zeros(result.rms_rad / unit)} {unit_name}, leave-one-run-out "
        f"{with_zeros(result.heldout_rms_rad / unit)} {unit_name}; friction "
        f"{WORDS[result.friction]}."
    )
    if left_out:
        caption += f" {left_out} runs are not drawn; the CSV has all."
    labels = [run.label for run in result.campaign.runs]
    return Figure(
        f"Measured loops of {name} against the model",
        caption,
        lambda width: draw_loops(result, name, width),
        FigureData(
            "loops",
            {
                "run": [labels[i] for i in result.run_of],
                "time_s": result.campaign.column("time"),
                "torque_Nm": result.torque_Nm,
                "measured_arcmin": result.measured_rad / ARCMIN,
                "model_arcmin": (result.measured_rad - result.residual_rad) / ARCMIN,
                "residual_arcmin": result.residual_rad / ARCMIN,
            },
        ),
    )


def draw_loops(result: Comparison, name: str, width: float) -> str:
    """Draw loops above residuals, one column per loop size (stacked on narrow pages)."""
    wide = width > 600
    shown = groups(result)
    left, gap, right, top = 58.0, 66.0, 14.0, 56.0
    height, strip = (340.0, 120.0) if wide else (250.0, 100.0)
    columns = len(shown) if wide else 1
    column = (width - left - right - gap * (columns - 1)) / columns
    block = top + height + 46 + strip + 50
    total = block if wide else block * len(shown) - 30 * (len(shown) - 1)
    drawing = Drawing(width, total, f"Measured loops of {name} against the model, and residuals")
    _key(drawing, width)
    for i, group in enumerate(shown):
        x = left + (i * (column + gap) if wide else 0.0)
        y = top + (0.0 if wide else i * (block - 30))
        _loop_panels(drawing, result, group, (x, y, column), height, strip)
    return drawing.render()


def _key(drawing: Drawing, width: float) -> None:
    x = width - 14
    for name, ink, thick in (("model", MODEL, 1.8), ("measured", MEASURED, 1.4)):
        drawing.text(x, 16, name, size=SMALL_SIZE, anchor="end")
        x -= text_width(name, SMALL_SIZE) + 42
        drawing.line((x, 12, x + 26, 12), ink, thick)
        x -= 18


def title_of(labels: Sequence[str], room: float) -> str:
    """Name the runs of a panel, by the first and the last if there is no room for all."""
    title = f"run{'s' * (len(labels) > 1)} {', '.join(labels)}"
    if len(labels) == 1 or text_width(title, SMALL_SIZE) <= room:
        return shortened(title, room)
    count = f"{len(labels)} runs, "
    each = (room - text_width(f"{count} to ", SMALL_SIZE)) / 2
    return f"{count}{shortened(labels[0], each)} to {shortened(labels[-1], each)}"


def _loop_panels(
    drawing: Drawing,
    result: Comparison,
    group: Sequence[int],
    place: tuple[float, float, float],
    height: float,
    strip: float,
) -> None:
    x, y, width = place
    unit, unit_name = error_unit(result)
    at = [slice(result.starts[i], result.starts[i + 1]) for i in group]
    torque = [result.torque_Nm[a] for a in at]
    measured = [result.measured_rad[a] / ARCMIN for a in at]
    residual = [result.residual_rad[a] / unit for a in at]
    every = np.concatenate(torque)
    across = axis_range([float(every.min()), float(every.max())], 0.03)
    modelled = [m - r * unit / ARCMIN for m, r in zip(measured, residual, strict=True)]
    angles = np.concatenate(measured + modelled)
    axes = Axes(
        drawing,
        (x, y, width, height),
        across,
        axis_range([float(angles.min()), float(angles.max())]),
    )
    axes.frame("", LOST_MOTION, x_numbers=False)
    axes.open()
    for t, m in zip(torque, measured, strict=True):
        axes.curve(t, m, MEASURED, 1.1, opacity=0.75)
    for t, m in zip(torque, modelled, strict=True):
        axes.curve(t, m, MODEL, 1.5, opacity=0.95)
    axes.close()
    room = width - 1.1 * text_width(LOST_MOTION, SMALL_SIZE)
    names = [str(run.label) for run in result.campaign.runs]
    if text_width(f"run {max(names, key=len)}", SMALL_SIZE) > room:
        names = abridged(names)
    title = title_of([names[i] for i in group], room)
    drawing.text(x + width, y - 10, title, anchor="end", size=SMALL_SIZE, fill=SOFT)

    floor = result.noise.floor_rad / unit
    most = max(float(np.max(np.abs(np.concatenate(residual)))), 1.5 * floor)
    second = y + height + 46
    below = Axes(drawing, (x, second, width, strip), across, (-1.06 * most, 1.06 * most))
    y0, y1 = float(below.y(floor)), float(below.y(-floor))
    drawing.rectangle(x, y0, width, y1 - y0, "#e3e5e8")
    below.frame(
        "torque on the output, N·m",
        f"residual, {unit_name}",
        y_step=nice_step(2 * most, 3.4),
    )
    below.open()
    for t, r in zip(torque, residual, strict=True):
        below.curve(t, r, BLUE, 0.9, opacity=0.8)
    below.close()


def failures_figure(result: Comparison, name: str) -> Figure:
    """Make the figure of the quantities on which the residual depends."""
    caption = (
        "Share of the residual variance that depends on each recorded quantity, minus the "
        "share expected by chance; p is the probability that random signs of whole sections of "
        "the residual explain as much. "
        "Filled: p below 0.05."
    )
    failures = result.failures
    return Figure(
        f"Where the model of {name} fails",
        caption,
        lambda width: draw_failures(result, name, width),
        FigureData(
            "where_it_fails",
            {
                "covariate": [f.covariate for f in failures],
                "share": [f.share for f in failures],
                "p": [f.p for f in failures],
            },
        ),
    )


def draw_failures(result: Comparison, name: str, width: float) -> str:
    """Draw a bar for each covariate."""
    failures = result.failures
    left = 14.0 + max([text_width(f.covariate) for f in failures] or [0.0])
    row, top = 24.0, 34.0
    height = row * max(len(failures), 1)
    numbers = 126.0
    drawing = Drawing(width, top + height + 40, f"Where the model of {name} fails")
    high = max([100.0 * f.share for f in failures] or [0.0])
    across = width - left - 8 - numbers
    axes = Axes(drawing, (left + 8, top, across, height), (0.0, max(1.15 * high, 1.0)), (0.0, 1.0))
    axes.frame("share of the residual variance, %", "", ticks=(max(across / 70, 2.0), 0.0))
    for i, failure in enumerate(failures):
        y = top + row * (i + 0.5)
        end = float(axes.x(100.0 * failure.share))
        sure = failure.p < 0.05
        drawing.rectangle(
            left + 8, y - 7, max(end - left - 8, 0.5), 14, BLUE if sure else "#ffffff", BLUE
        )
        drawing.text(left, y + 4.5, words(failure.covariate), anchor="end")
        drawing.text(
            width - 14,
            y + 4,
            f"{100 * failure.share:.1f} %,  {chance(failure.p)}",
            anchor="end",
            size=SMALL_SIZE,
            fill=INK if sure else SOFT,
        )
    drawing.line((left + 8, top, left + 8, top + height), FAINT)
    return drawing.render()
