"""Figures of a comparison: measured loops against the model, and where the model fails."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lostmotion.compare import REPEATABILITY, Comparison
from lostmotion.compare.failures import Failure
from lostmotion.discover.advice import count_runs
from lostmotion.friction import WORDS
from lostmotion.report.charts import Chart
from lostmotion.report.svg import abridged
from lostmotion.report.wording import chance, with_zeros, words, written
from lostmotion.results import figures
from lostmotion.results.colours import BLUE, PAPER
from lostmotion.units import ARCMIN, ARCSEC

SAME_SIZE = 1.3
"""Runs whose largest torques differ by no more than this factor are drawn together."""

GROUPS_SHOWN = 2
"""Number of loop sizes drawn: the largest and the smallest."""

LOOP_LEAST = 0.02
"""Runs whose torque varies by less than this share of the largest are not loops (a drive that
turns): they are drawn only if there are no others."""

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


def loops_figure(result: Comparison, name: str) -> Chart:
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
    return Chart(
        "loops",
        f"Measured loops of {name} against the model",
        caption,
        lambda: draw_loops(result),
        {
            "run": [labels[i] for i in result.run_of],
            "time_s": result.campaign.column("time"),
            "torque_Nm": result.torque_Nm,
            "measured_arcmin": result.measured_rad / ARCMIN,
            "model_arcmin": (result.measured_rad - result.residual_rad) / ARCMIN,
            "residual_arcmin": result.residual_rad / ARCMIN,
        },
        beside=2,
    )


def draw_loops(result: Comparison) -> list[Any]:
    """Draw loops above residuals, a figure for each size of loops."""
    unit, unit_name = error_unit(result)
    labels = abridged([str(run.label) for run in result.campaign.runs])
    found = []
    for group in groups(result):
        at = [slice(result.starts[i], result.starts[i + 1]) for i in group]
        measured = [result.measured_rad[a] / ARCMIN for a in at]
        residual = [result.residual_rad[a] for a in at]
        figure = figures.loops(
            [result.torque_Nm[a] for a in at],
            measured,
            [m - r / ARCMIN for m, r in zip(measured, residual, strict=True)],
            [labels[i] for i in group],
            [r / unit for r in residual],
            unit_name,
            result.noise.floor_rad / unit,
        )
        largest = max(float(np.max(np.abs(result.torque_Nm[a]))) for a in at)
        figure.update_layout(title=f"{count_runs(len(group))}, up to {written(largest)} N·m")
        found.append(figure)
    return found


def failures_figure(result: Comparison, name: str) -> Chart:
    """Make the figure of the quantities on which the residual depends."""
    caption = (
        "Share of the residual variance that depends on each recorded quantity, minus the "
        "share expected by chance; p is the probability that random signs of whole sections of "
        "the residual explain as much. "
        "Filled: p below 0.05."
    )
    failures = result.failures
    return Chart(
        "where_it_fails",
        f"Where the model of {name} fails",
        caption,
        lambda: [draw_failures(failures)],
        {
            "covariate": [f.covariate for f in failures],
            "share": [f.share for f in failures],
            "p": [f.p for f in failures],
        },
    )


def draw_failures(failures: Sequence[Failure]) -> Any:
    """Draw a bar for each covariate."""
    figure = figures.framed("", "share of the residual variance, %", "", 100 + 40 * len(failures))
    share = [100.0 * one.share for one in failures]
    figure.add_bar(
        x=share,
        y=list(range(len(failures))),
        orientation="h",
        marker={
            "color": [BLUE if one.p < 0.05 else PAPER for one in failures],
            "line": {"color": BLUE, "width": 1},
        },
        text=[f"{100 * one.share:.1f} %, {chance(one.p)}" for one in failures],
        textposition="outside",
        cliponaxis=False,
    )
    figures.names_above(figure, [words(one.covariate) for one in failures])
    figure.update_layout(showlegend=False)
    figure.update_xaxes(range=[min(0.0, *share), max(1.6 * max(share), 1.0)])
    return figure
