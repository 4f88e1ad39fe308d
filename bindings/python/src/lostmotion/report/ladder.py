"""The error ladder: errors from the baseline model to the last effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from lostmotion.report.chart import Axes, round_up
from lostmotion.report.page import Figure, FigureData
from lostmotion.report.svg import BLUE, FAINT, INK, ORANGE, SMALL_SIZE, SOFT, Drawing
from lostmotion.report.wording import NOISE_FLOOR, NOISE_FLOOR_IS, with_zeros, words

FLOOR = "#e3e5e8"


def step_name(rungs: Sequence[Mapping[str, Any]], number: int) -> str:
    """Name the effects that a rung adds: ``base``, or the effects that were added."""
    now = list(rungs[number]["effects"])
    if number == 0:
        return " + ".join(["baseline", *map(words, now)])
    before = list(rungs[number - 1]["effects"])
    new = [name for name in now if name not in before] or now
    return "+ " + ", ".join(map(words, new))


def ladder_figure(rungs: Sequence[Mapping[str, Any]], floor_arcsec: float, name: str) -> Figure:
    """Make the figure of the errors from the baseline model to the last effect."""
    return Figure(
        f"The error ladder of {name}",
        "The rms of the residual, after each step: bar and first number fitted, ring and "
        "second number leave-one-run-out. The grey band is the "
        f"{NOISE_FLOOR}: {NOISE_FLOOR_IS}.",
        lambda width: draw_ladder(rungs, floor_arcsec, width),
        FigureData(
            "error_ladder",
            {
                "effects": [" + ".join(["baseline", *rung["effects"]]) for rung in rungs],
                "rms_arcsec": [rung["rms_arcsec"] for rung in rungs],
                "rms_heldout_arcsec": [rung["rms_heldout_arcsec"] for rung in rungs],
                "noise_floor_arcsec": [floor_arcsec] * len(rungs),
            },
        ),
    )


def draw_ladder(rungs: Sequence[Mapping[str, Any]], floor_arcsec: float, width: float) -> str:
    """Draw a bar for each rung, with names above the bars to allow long names."""
    row, top, left, right = 44.0, 12.0, 12.0, 92.0
    height = row * len(rungs)
    drawing = Drawing(width, top + height + 44, "The error ladder: rms after each step, in arcsec")
    most = max(max(rung["rms_heldout_arcsec"], rung["rms_arcsec"]) for rung in rungs)
    axes = Axes(
        drawing,
        (left, top, width - left - right, height),
        (0.0, round_up(max(most, 1.05 * floor_arcsec))),
        (0.0, 1.0),
    )
    end = float(axes.x(floor_arcsec))
    drawing.rectangle(left, top, end - left, height, FLOOR)
    axes.frame("", "", ticks=(width / 110, 0.0))
    # The label may extend below the numbers beside the bars: in the workbench the axis is too short
    # for it.
    under = f"rms, arcsec (grey: noise floor {with_zeros(floor_arcsec)})"
    drawing.text(width - left, top + height + 34, under, size=SMALL_SIZE, anchor="end")
    drawing.line((end, top, end, top + height), FAINT, 1.0, "3 3")
    for i, rung in enumerate(rungs):
        y = top + row * i
        fitted = float(axes.x(rung["rms_arcsec"]))
        held = float(axes.x(rung["rms_heldout_arcsec"]))
        ink = ORANGE if i == 0 else BLUE
        drawing.text(left + 4, y + 15, step_name(rungs, i), size=SMALL_SIZE, halo=True)
        drawing.rectangle(left, y + 21, max(fitted - left, 1.0), 12, ink)
        drawing.dots([(held, y + 27)], 4.0, "#ffffff", INK, 1.4)
        numbers = f"{with_zeros(rung['rms_arcsec'])} / {with_zeros(rung['rms_heldout_arcsec'])}"
        drawing.text(max(fitted, held) + 9, y + 31, numbers, size=SMALL_SIZE, weight="600")
    drawing.line((left, top, left, top + height), SOFT)
    return drawing.render()
