"""Figure of single runs: measured, baseline model, with effects, and the residuals below."""

from __future__ import annotations

from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.effects.conditions import Conditions
from lostmotion.fit.baseline import BaselineModel
from lostmotion.report.charts import Chart
from lostmotion.report.figure_data import Columns
from lostmotion.report.loops import LOOP_LEAST
from lostmotion.report.svg import abridged
from lostmotion.report.wording import with_zeros
from lostmotion.results.colours import MEASURED, MODEL, WITH_EFFECTS
from lostmotion.results.figures import line, noise_band, stacked
from lostmotion.units import ARCMIN, ARCSEC

RUNS_SHOWN = 6
POINTS_SHOWN = 2000
"""Largest number of samples of a run that are drawn and listed; tests use all samples."""

RUN_PX = 380
"""Height of the figure of a run."""

TURN_LEAST_RAD = np.pi
"""Least rotation of the wave generator for which a run without a loop is drawn over its angle."""


def runs_to_show(before: FloatArray, after: FloatArray, starts: IntArray) -> list[int]:
    """Number of runs with the largest explained part that are drawn."""
    fall = np.add.reduceat(before**2 - after**2, starts[:-1]) / np.diff(starts)
    if not np.any(fall > 0):
        fall = np.add.reduceat(after**2, starts[:-1]) / np.diff(starts)
    return sorted(int(i) for i in np.argsort(-fall, kind="stable")[:RUNS_SHOWN])


class Overlay:
    """Curves of each run, about its own zero.

    Parameters
    ----------
    before, after : BaselineModel
        The baseline model, and the baseline model with effects; identical if nothing was added.
    """

    def __init__(
        self, before: BaselineModel, after: BaselineModel, floor_arcsec: float, name: str
    ) -> None:
        c = before.conditions
        self.name = name
        self.floor = floor_arcsec
        self.added = bool(after.terms or after.additives) and after is not before
        self.left = [before.residual()] + ([after.residual()] if self.added else [])
        angle = before.at().angle
        self.shown = runs_to_show(self.left[0], self.left[-1], c.starts)
        self.labels = [str(c.labels[i]) for i in self.shown]
        short = abridged([str(label) for label in c.labels])
        self.short = [short[i] for i in self.shown]
        slices = c.slices()
        self.torque, self.measured, self.model, self.residual = [], [], [], []
        self.seconds: list[FloatArray] = []
        self.across: list[tuple[FloatArray, str]] = []
        self.pieces: list[list[IntArray]] = []
        for i in self.shown:
            at = np.arange(slices[i].start, slices[i].stop)
            at = at[:: max(1, -(-at.size // POINTS_SHOWN))]
            zero = float(np.mean((before.measured - angle)[slices[i]]))
            measured = before.measured[at] - zero
            self.torque.append(c.torque[at])
            self.seconds.append(c.time_s[at])
            across, label, pieces = axis_of(c, slices[i], at)
            self.across.append((across, label))
            self.pieces.append(pieces)
            self.measured.append(measured * ARCSEC / ARCMIN)
            self.residual.append([left[at] for left in self.left])
            self.model.append([(measured - left[at]) * ARCSEC / ARCMIN for left in self.left])
        self.runs = c.runs

    def columns(self) -> Columns:
        """Return the data of the figure."""
        columns: dict[str, list[object]] = {
            "run": [label for label, t in zip(self.labels, self.torque, strict=True) for _ in t],
            "time_s": [x for t in self.seconds for x in t],
            "torque_Nm": [x for t in self.torque for x in t],
            "drawn_over": [x for over, _ in self.across for x in over],
            "measured_arcmin": [x for m in self.measured for x in m],
        }
        for k, name in enumerate(("baseline", "baseline_and_effects")[: len(self.left)]):
            columns[f"{name}_arcmin"] = [x for m in self.model for x in m[k]]
            columns[f"{name}_residual_arcsec"] = [x for r in self.residual for x in r[k]]
        return columns


def axis_of(c: Conditions, run: slice, at: IntArray) -> tuple[FloatArray, str, list[IntArray]]:
    """Choose the axis for the samples of a run, and the samples of each line.

    A loop is drawn over its torque, a run that turns at constant torque over the angle of the wave
    generator, separately for each direction, and other runs over time.
    """
    whole = [np.arange(at.size)]
    if np.ptp(c.torque[run]) >= LOOP_LEAST * float(np.max(np.abs(c.torque))):
        return c.torque[at], "torque, N·m", whole
    turned = c.columns.get("input_angle_rad")
    if turned is None or np.ptp(turned[run]) < TURN_LEAST_RAD:
        return c.time_s[at] - c.time_s[run.start], "time in the run, s", whole
    angle = np.rad2deg(np.remainder(turned[at], 2 * np.pi))
    back = c.columns["input_velocity_rad_s"][at] < 0
    ways = [np.flatnonzero(way) for way in (~back, back)]
    ways = [way[np.argsort(angle[way])] for way in ways if way.size]
    return angle, "wave generator angle, °", ways


def overlay_figure(
    before: BaselineModel, after: BaselineModel, floor_arcsec: float, name: str
) -> Chart:
    """Make the figure of the runs with the largest explained part."""
    data = Overlay(before, after, floor_arcsec, name)
    caption = "Measured lost motion (grey), the baseline model (orange)"
    caption += " and the baseline model with the added effects (blue)" if data.added else ""
    caption += " against torque, or against the wave generator's angle at constant torque. "
    caption += (
        f"Below each, its residual in arcsec; the grey band is the noise floor, ±"
        f"{with_zeros(floor_arcsec)} arcsec. "
    )
    if data.runs > len(data.shown):
        caption += (
            f"The {len(data.shown)} of {data.runs} runs with the largest "
            + ("explained part; " if data.added else "residual; ")
            + f"at most {POINTS_SHOWN} samples of each are drawn; the tests use all."
        )
    return Chart(
        "runs",
        f"Runs of {name}: measured and modelled",
        caption,
        lambda: draw_overlay(data),
        data.columns(),
        beside=3,
    )


def draw_overlay(data: Overlay) -> list[Any]:
    """Draw a figure of each run: measured and modelled, and the residuals below."""
    most = max(float(np.max(np.abs(r[0]))) for r in data.residual)
    most = 1.06 * max(most, 1.5 * data.floor)
    inks = ((MODEL, "baseline"), (WITH_EFFECTS, "with the added effects"))[: len(data.left)]
    found = []
    for i, (places, name) in enumerate(data.across):
        ys = ("arcmin", "residual, arcsec")
        figure = stacked(f"run {data.short[i]}", name, ys, (0.68, 0.32), RUN_PX)
        rows = [(1, MEASURED, "measured", data.measured[i])]
        rows += [(1, *ink, model) for ink, model in zip(inks, data.model[i], strict=True)]
        rows += [(2, *ink, left) for ink, left in zip(inks, data.residual[i], strict=True)]
        for row, colour, of, values in rows:
            for k, piece in enumerate(data.pieces[i]):
                line(
                    figure,
                    places[piece],
                    values[piece],
                    colour,
                    of,
                    width=1.1,
                    row=row,
                    legendgroup=of,
                    showlegend=row == 1 and k == 0,
                )
        noise_band(figure, data.floor, 2)
        figure.update_yaxes(range=[-most, most], row=2, col=1)
        found.append(figure)
    return found
