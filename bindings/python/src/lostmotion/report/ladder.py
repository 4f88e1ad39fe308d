"""The error ladder: errors from the baseline model to the last effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from lostmotion.report.charts import Chart
from lostmotion.report.wording import NOISE_FLOOR, NOISE_FLOOR_IS, with_zeros, words
from lostmotion.results import figures


def step_name(rungs: Sequence[Mapping[str, Any]], number: int) -> str:
    """Name the effects that a rung adds: ``base``, or the effects that were added."""
    now = list(rungs[number]["effects"])
    if number == 0:
        return " + ".join(["baseline", *map(words, now)])
    before = list(rungs[number - 1]["effects"])
    new = [name for name in now if name not in before] or now
    return "+ " + ", ".join(map(words, new))


def ladder_figure(rungs: Sequence[Mapping[str, Any]], floor_arcsec: float, name: str) -> Chart:
    """Make the figure of the errors from the baseline model to the last effect."""
    return Chart(
        "error_ladder",
        f"The error ladder of {name}",
        "The rms of the residual, after each step: bar and first number fitted, ring and "
        "second number leave-one-run-out. The grey band is the "
        f"{NOISE_FLOOR}: {NOISE_FLOOR_IS}.",
        lambda: [draw_ladder(rungs, floor_arcsec)],
        {
            "effects": [" + ".join(["baseline", *rung["effects"]]) for rung in rungs],
            "rms_arcsec": [rung["rms_arcsec"] for rung in rungs],
            "rms_heldout_arcsec": [rung["rms_heldout_arcsec"] for rung in rungs],
            "noise_floor_arcsec": [floor_arcsec] * len(rungs),
        },
    )


def draw_ladder(
    rungs: Sequence[Mapping[str, Any]], floor_arcsec: float, *, narrow: bool = False
) -> Any:
    """Draw a bar for each rung."""
    errors = [(rung["rms_arcsec"], rung["rms_heldout_arcsec"]) for rung in rungs]
    return figures.ladder(
        [step_name(rungs, i) for i in range(len(rungs))],
        [fitted for fitted, _ in errors],
        [held for _, held in errors],
        floor_arcsec,
        [f"{with_zeros(fitted)} / {with_zeros(held)}" for fitted, held in errors],
        narrow=narrow,
    )
