"""Pictures of a diagnosis: the error ladder, and how much each run speaks for an effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.report.chart import Axes, round_up
from lostmotion.report.page import Figure, Table
from lostmotion.report.svg import BLUE, FAINT, INK, ORANGE, SMALL_SIZE, SOFT, Drawing, text_width

FLOOR = "#e3e5e8"


def step_name(rungs: Sequence[Mapping[str, Any]], number: int) -> str:
    """Name what a rung has over the one before: ``base``, or the effects that were added."""
    now = list(rungs[number]["effects"])
    if number == 0:
        return " + ".join(["base", *now]).replace("_", " ")
    before = list(rungs[number - 1]["effects"])
    new = [name for name in now if name not in before] or now
    return "+ " + ", ".join(new).replace("_", " ")


def ladder_figure(rungs: Sequence[Mapping[str, Any]], floor_arcsec: float, name: str) -> Figure:
    """Make the figure of how the error falls from the base to the last effect."""
    return Figure(
        f"The error ladder of {name}",
        "rms of what the model leaves, after each step: bar fitted, ring on runs that the fit has "
        "not seen. The grey band is the noise floor: noise within runs and scatter between them.",
        lambda width: draw_ladder(rungs, floor_arcsec, width),
        Table(
            "error_ladder",
            {
                "effects": [" + ".join(["base", *rung["effects"]]) for rung in rungs],
                "rms_arcsec": [rung["rms_arcsec"] for rung in rungs],
                "rms_heldout_arcsec": [rung["rms_heldout_arcsec"] for rung in rungs],
                "noise_floor_arcsec": [floor_arcsec] * len(rungs),
            },
        ),
    )


def draw_ladder(rungs: Sequence[Mapping[str, Any]], floor_arcsec: float, width: float) -> str:
    """Draw a bar for each rung; names stand above the bars, so that any name has room."""
    row, top, left, right = 44.0, 12.0, 12.0, 58.0
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
    axes.frame(f"rms, arcsec (grey: noise floor {floor_arcsec:.2f})", "", ticks=(width / 110, 0.0))
    drawing.line((end, top, end, top + height), FAINT, 1.0, "3 3")
    for i, rung in enumerate(rungs):
        y = top + row * i
        fitted = float(axes.x(rung["rms_arcsec"]))
        held = float(axes.x(rung["rms_heldout_arcsec"]))
        ink = ORANGE if i == 0 else BLUE
        drawing.text(left + 4, y + 15, step_name(rungs, i), size=SMALL_SIZE, halo=True)
        drawing.rectangle(left, y + 21, max(fitted - left, 1.0), 12, ink)
        drawing.dots([(held, y + 27)], 4.0, "#ffffff", INK, 1.4)
        drawing.text(
            max(fitted, held) + 9,
            y + 31,
            f"{rung['rms_arcsec']:.2f}",
            size=SMALL_SIZE,
            weight="600",
        )
    drawing.line((left, top, left, top + height), SOFT)
    return drawing.render()


def evidence_figure(
    labels: Sequence[int | str], gains: Mapping[str, npt.NDArray[np.float64]]
) -> Figure:
    """Make the figure of how much each run speaks for some effects."""
    names = " and ".join(name.replace("_", " ") for name in gains)
    return Figure(
        f"What each run says about {names}",
        "One dot a run: evidence in nats that the run, predicted by the others, gives for the "
        "effect. An effect that one run alone carries is no effect.",
        lambda width: draw_evidence(labels, gains, width),
        Table(
            "evidence_by_run",
            {"run": list(labels), **{f"{name}_nats": gain for name, gain in gains.items()}},
        ),
    )


def draw_evidence(
    labels: Sequence[int | str], gains: Mapping[str, npt.NDArray[np.float64]], width: float
) -> str:
    """Draw dots of each run's evidence, a colour an effect."""
    inks = (BLUE, ORANGE)
    left, top, right, height = 52.0, 40.0, 14.0, 170.0
    drawing = Drawing(width, top + height + 44, "Evidence of each run, in nats")
    values = np.concatenate(list(gains.values()))
    low, high = min(0.0, float(values.min())), max(1.0, float(values.max()))
    room = 0.08 * (high - low)
    axes = Axes(
        drawing,
        (left, top, width - left - right, height),
        (0.2, len(labels) + 0.8),
        (low - room, high + room),
    )
    axes.frame("run, in the order of the recording", "nats", ticks=(width / 60, height / 40))
    axes.open()
    for ink, gain in zip(inks, gains.values(), strict=False):
        drawing.dots(axes.points(np.arange(1, len(labels) + 1), gain), 3.6, ink, "#ffffff", 0.8)
    axes.close()
    x = width - right
    for ink, name in reversed(list(zip(inks, gains, strict=False))):
        text = name.replace("_", " ")
        drawing.text(x, 17, text, size=SMALL_SIZE, anchor="end")
        x -= text_width(text, SMALL_SIZE) + 10
        drawing.dots([(x, 13)], 4.0, ink)
        x -= 18
    return drawing.render()
