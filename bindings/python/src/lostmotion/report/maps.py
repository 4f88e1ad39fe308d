"""Where a model fails: its residual over torque and another quantity, as map and profile."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

import numpy as np
import numpy.typing as npt

from lostmotion.branches import directions
from lostmotion.effects.conditions import Conditions
from lostmotion.report.chart import Axes, axis_range, nice_step, tick_label
from lostmotion.report.page import Figure, FigureData
from lostmotion.report.svg import (
    INK,
    SMALL_SIZE,
    SOFT,
    TEAL,
    Drawing,
    coord,
    text_width,
)
from lostmotion.report.wording import written

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]

ACROSS, UP = 14, 9
"""Cells of a map, and of a profile."""

SAMPLES_LEAST = 3
"""Least number of samples of a cell; with fewer it stays empty."""

TURNS = {"input_angle_rad": "input_angle_deg", "output_angle_rad": "output_angle_deg"}
"""Quantities with a period of one turn, and their names within it."""

NAMES = {
    "torque_Nm": ("torque", "N·m"),
    "input_angle_deg": ("input angle", "° of a turn"),
    "output_angle_deg": ("output angle", "° of a turn"),
    "temperature_C": ("temperature", "°C"),
    "cycles": ("cycles", ""),
    "tilt_moment_Nm": ("tilt moment", "N·m"),
    "axial_force_N": ("axial force", "N"),
    "input_velocity_rad_s": ("input velocity", "rad/s"),
    "output_acceleration_rad_s2": ("output acceleration", "rad/s²"),
    "time_in_run_s": ("time in the run", "s"),
    "order": ("order of the runs", ""),
    "direction": ("direction of the torque", "−1 falling, 1 rising"),
}
"""Displayed names of the quantities, and their units."""


@dataclass
class Residuals:
    """Residual of a campaign, with all quantities on which it may depend.

    Attributes
    ----------
    values : ndarray
        Arc seconds.
    covariates : dict
        Arrays by the names of `NAMES`, in the displayed unit, without constant ones.
    """

    values: FloatArray
    torque_Nm: FloatArray
    run_of: IntArray
    labels: list[int | str]
    covariates: dict[str, FloatArray]
    floor_arcsec: float
    against: str
    """Description of the floor."""


def collect_residuals(
    conditions: Conditions, residual_arcsec: FloatArray, floor_arcsec: float, against: str
) -> Residuals:
    """Collect the residual of a campaign with all recorded and derived quantities."""
    c = conditions
    found = {name: c.columns[name] for name in NAMES if name in c.columns and name != "torque_Nm"}
    for name, within in TURNS.items():
        if name in c.columns:
            found[within] = np.asarray(np.degrees(np.mod(c.columns[name], 2 * np.pi)))
    largest = float(np.max(np.abs(c.torque)))
    turns = [directions(c.torque[at], largest)[0] for at in c.slices()]
    found["direction"] = np.asarray(2.0 * np.concatenate(turns) - 1.0)
    found["time_in_run_s"] = np.asarray(c.time_s - c.time_s[c.starts[:-1]][c.run_of])
    found["order"] = c.run_of.astype(np.float64) + 1.0
    return Residuals(
        residual_arcsec,
        c.torque,
        c.run_of,
        list(c.labels),
        {name: values for name, values in found.items() if np.ptp(values) > 0},
        floor_arcsec,
        against,
    )


@dataclass
class Map:
    """Mean residual in cells of torque and a covariate.

    Attributes
    ----------
    mean, count : ndarray, shape (up, across)
        Arc seconds; NaN if a cell has too few samples.
    cell : ndarray
        Cell of every sample, row by row from the lowest.
    """

    covariate: str
    torque_edges: FloatArray
    edges: FloatArray
    mean: FloatArray
    count: IntArray
    cell: IntArray


def bin_residuals(data: Residuals, covariate: str) -> Map:
    """Sort a residual into cells."""
    values = data.covariates[covariate]
    across = np.linspace(data.torque_Nm.min(), data.torque_Nm.max(), ACROSS + 1)
    levels = np.unique(values)
    if levels.size <= UP:
        middle = 0.5 * (levels[1:] + levels[:-1])
        first, last = 2 * levels[0] - middle[0], 2 * levels[-1] - middle[-1]
        edges = np.concatenate(([first], middle, [last]))
    else:
        edges = np.linspace(float(levels[0]), float(levels[-1]), UP + 1)
    up = edges.size - 1
    i = np.clip(np.searchsorted(across, data.torque_Nm, "right") - 1, 0, ACROSS - 1)
    j = np.clip(np.searchsorted(edges, values, "right") - 1, 0, up - 1)
    cell = (j * ACROSS + i).astype(np.intp)
    count = np.bincount(cell, minlength=up * ACROSS).astype(np.intp)
    sums = np.bincount(cell, data.values, up * ACROSS)
    mean = np.where(count >= SAMPLES_LEAST, sums / np.maximum(count, 1), np.nan)
    shape = (up, ACROSS)
    return Map(covariate, across, edges, mean.reshape(shape), count.reshape(shape), cell)


def runs_in_cell(data: Residuals, of: Map, cell: int) -> list[tuple[int | str, int, float]]:
    """List the runs with samples in a cell: label, samples and mean residual, the worst first."""
    inside = of.cell == cell
    count = np.bincount(data.run_of[inside], minlength=len(data.labels))
    sums = np.bincount(data.run_of[inside], data.values[inside], len(data.labels))
    found = [
        (data.labels[i], int(count[i]), float(sums[i] / count[i])) for i in np.flatnonzero(count)
    ]
    return sorted(found, key=lambda run: -abs(run[2]))


def cell_text(of: Map, cell: int) -> str:
    """Describe the position and content of a cell."""
    j, i = divmod(cell, ACROSS)
    name, unit = NAMES[of.covariate]
    t, v = of.torque_edges, of.edges
    mean = of.mean[j, i]
    text = f"torque {t[i]:.3g} to {t[i + 1]:.3g} N·m, "
    text += f"{name} {v[j]:.4g} to {v[j + 1]:.4g} {unit}".strip()
    return text + (": too few samples" if np.isnan(mean) else f": mean {mean:+.2f} arcsec")


def diverging_colour(value: float, most: float) -> str:
    """Blue below zero, orange above, white at zero."""
    share = min(abs(value) / most, 1.0) if most > 0 else 0.0
    full = (0x00, 0x77, 0xBB) if value < 0 else (0xEE, 0x77, 0x33)
    return "#" + "".join(f"{round(255 + share * (c - 255)):02x}" for c in full)


def scale_of(of: Map) -> float:
    """Largest absolute mean residual of a map: the limit of its colour scale."""
    return float(np.nanmax(np.abs(of.mean))) if np.isfinite(of.mean).any() else 1.0


def map_figure(data: Residuals, covariate: str) -> Figure:
    """Make the figure of the residual over torque and a covariate."""
    of = bin_residuals(data, covariate)
    name, _ = NAMES[covariate]
    j, i = np.divmod(np.arange(of.mean.size), ACROSS)
    return Figure(
        f"Residual over torque and {name}",
        "Mean of measured minus model in each cell: orange above the model, blue below. "
        "Below, the mean along the quantity for either sign of the torque; the grey band is the "
        f"{data.against}.",
        lambda width: draw_map(of, width) + draw_profile(data, covariate, width),
        FigureData(
            f"residual_by_{covariate}",
            {
                "torque_from_Nm": of.torque_edges[i],
                "torque_to_Nm": of.torque_edges[i + 1],
                f"{covariate}_from": of.edges[j],
                f"{covariate}_to": of.edges[j + 1],
                "samples": of.count.ravel(),
                "mean_residual_arcsec": of.mean.ravel(),
            },
        ),
    )


def draw_map(of: Map, width: float, picked: int | None = None, most: float | None = None) -> str:
    """Draw the map; every cell has its number in ``data-cell`` and its text as a title."""
    wide = width > 600
    left, right, top = 66.0, 86.0 if wide else 14.0, 30.0
    height = 250.0 if wide else 210.0
    bottom = 46.0 if wide else 84.0
    name, unit = NAMES[of.covariate]
    drawing = Drawing(width, top + height + bottom, f"Mean residual over torque and {name}")
    box = (left, top, width - left - right, height)
    up = of.edges.size - 1
    # Rows of equal height, because the levels of a covariate may be far apart.
    axes = Axes(drawing, box, (float(of.torque_edges[0]), float(of.torque_edges[-1])), (0.0, up))
    axes.frame("torque on the output, N·m", f"{name}, {unit}".rstrip(", "), ticks=(box[2] / 75, 0))
    end = most or scale_of(of)
    w, h = box[2] / ACROSS, height / up
    for j in range(up):
        for i in range(ACROSS):
            value = of.mean[j, i]
            cell = j * ACROSS + i
            paper = "#f4f5f6" if np.isnan(value) else diverging_colour(float(value), end)
            x, y = left + i * w, top + height - (j + 1) * h
            drawing.add(
                f'<rect data-cell="{cell}" x="{coord(x)}" y="{coord(y)}" width="{coord(w)}" '
                f'height="{coord(h)}" fill="{paper}" '
                f'stroke="#ffffff" stroke-width="1"><title>{escape(cell_text(of, cell))}</title>'
                "</rect>"
            )
    step = float(np.ptp(of.edges)) / max(up, 1)
    for j in range(up):
        middle = 0.5 * float(of.edges[j] + of.edges[j + 1])
        if up > 6 and j % 2:
            continue
        drawing.text(
            left - 7,
            float(axes.y(j + 0.5)) + 4,
            tick_label(middle, nice_step(step, 4)) if abs(middle) < 1e5 else written(middle, 2),
            anchor="end",
            size=SMALL_SIZE,
            fill=SOFT,
        )
    if picked is not None:
        j, i = divmod(picked, ACROSS)
        drawing.add(
            f'<rect x="{coord(left + i * w)}" y="{coord(top + height - (j + 1) * h)}" '
            f'width="{coord(w)}" height="{coord(h)}" fill="none" stroke="{INK}" '
            'stroke-width="2.4" pointer-events="none"/>'
        )
    _colour_key(drawing, end, width, (top, height), wide=wide)
    return drawing.render()


def _colour_key(
    drawing: Drawing, end: float, width: float, place: tuple[float, float], *, wide: bool
) -> None:
    top, height = place
    for k in range(20):
        share = (k + 0.5) / 10 - 1
        if wide:
            x, y, w, h = width - 66, top + height * (19 - k) / 20, 12.0, height / 20 + 0.5
        else:
            x, y, w, h = (
                66 + (width - 80) * k / 20,
                top + height + 48,
                (width - 80) / 20 + 0.5,
                10.0,
            )
        drawing.rectangle(x, y, w, h, diverging_colour(share * end, end))
    digits = 0 if end >= 10 else 1 if end >= 1 else 2
    for share in (-1, 0, 1):
        text = f"{share * end:+.{digits}f}".replace("-", "−") if share else "0"
        if wide:
            at = top + height * (1 - share) / 2
            drawing.text(width - 49, at + 4, text, size=SMALL_SIZE, fill=SOFT)
        else:
            at = 66 + (width - 80) * (share + 1) / 2
            anchor = ("start", "middle", "end")[share + 1]
            drawing.text(at, top + height + 74, text, size=SMALL_SIZE, fill=SOFT, anchor=anchor)
    if wide:
        drawing.text(width - 14, top - 10, "arcsec", size=SMALL_SIZE, anchor="end")
    else:
        drawing.text(60, top + height + 74, "arcsec", size=SMALL_SIZE, anchor="end")


def profile(data: Residuals, covariate: str, *, rising: bool) -> tuple[FloatArray, FloatArray]:
    """Mean residual along a covariate, for torques of one sign: bin centres and means."""
    values = data.covariates[covariate]
    levels = np.unique(values)
    side = (data.torque_Nm > 0) == rising
    if levels.size <= 2 * ACROSS:
        cell, bins = np.searchsorted(levels, values), levels.size
    else:
        edges = np.unique(np.quantile(values, np.linspace(0, 1, 2 * ACROSS + 1)))
        bins = edges.size - 1
        cell = np.clip(np.searchsorted(edges, values, "right") - 1, 0, bins - 1)
    count = np.bincount(cell[side], minlength=bins)
    kept = count >= SAMPLES_LEAST
    middles = np.bincount(cell[side], values[side], bins)[kept] / count[kept]
    return middles, np.bincount(cell[side], data.values[side], bins)[kept] / count[kept]


def draw_profile(data: Residuals, covariate: str, width: float) -> str:
    """Draw the mean residual along a covariate, separately for positive and negative torque."""
    wide = width > 600
    left, right, top, height = 66.0, 86.0 if wide else 14.0, 32.0, 130.0
    name, unit = NAMES[covariate]
    drawing = Drawing(width, top + height + 46, f"Residual along {name}")
    values = data.covariates[covariate]
    series = {
        "torque above 0": (TEAL, *profile(data, covariate, rising=True)),
        "below 0": (SOFT, *profile(data, covariate, rising=False)),
    }
    sizes = [float(np.max(np.abs(mean))) for _, _, mean in series.values() if mean.size]
    most = max(1.08 * max(sizes, default=0.0), 1.5 * data.floor_arcsec)
    axes = Axes(
        drawing,
        (left, top, width - left - right, height),
        axis_range([float(values.min()), float(values.max())], 0.03),
        (-most, most),
    )
    y0, y1 = float(axes.y(data.floor_arcsec)), float(axes.y(-data.floor_arcsec))
    drawing.rectangle(left, y0, width - left - right, y1 - y0, "#e3e5e8")
    axes.frame(f"{name}, {unit}".rstrip(", "), "residual, arcsec", y_step=nice_step(2 * most, 3.4))
    axes.open()
    for ink, middles, mean in series.values():
        axes.curve(middles, mean, ink, 1.2, opacity=0.7)
        drawing.dots(axes.points(middles, mean), 3.2, ink)
    axes.close()
    x = width - right
    for text, (ink, _, _) in reversed(series.items()):
        drawing.text(x, 18, text, size=SMALL_SIZE, anchor="end")
        x -= text_width(text, SMALL_SIZE) + 10
        drawing.dots([(x, 14)], 3.6, ink)
        x -= 14
    return drawing.render()
