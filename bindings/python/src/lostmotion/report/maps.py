"""Where a model fails: its residual over torque and another quantity, as map and profile."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.branches import directions
from lostmotion.core import NEEDS
from lostmotion.effects.conditions import Conditions
from lostmotion.report.charts import Chart
from lostmotion.report.wording import unit_text, words, written
from lostmotion.results import figures
from lostmotion.results.colours import INK, SOFT, TEAL
from lostmotion.units import split_unit

ACROSS, UP = 14, 9
"""Cells of a map, and of a profile."""

EMPTY = "#f4f5f6"
"""Colour of cells with too few samples."""

SAMPLES_LEAST = 3
"""Least number of samples of a cell; with fewer it stays empty."""

NAMES = {
    "input_angle_deg": ("wave generator angle", "°"),
    "output_angle_deg": ("output angle", "°"),
    "time_in_run_s": ("time in the run", "s"),
    "order": ("order of the runs", ""),
    "direction": ("direction of the torque", "−1 falling, 1 rising"),
}
"""Displayed names and units of quantities that do not follow from the name of the column."""


def name_of(quantity: str) -> tuple[str, str]:
    """Displayed name of a quantity, and its unit."""
    stem, unit = split_unit(quantity)
    return NAMES.get(quantity) or (words(stem), "" if unit is None else unit_text(unit.symbol))


def recorded_quantities(c: Conditions) -> dict[str, FloatArray]:
    """Quantities on which a residual may depend besides the torque; angles within one turn."""
    found = {}
    for name in (name for name in NEEDS if name in c.columns):
        if name.endswith("_angle_rad"):
            turned = np.asarray(np.degrees(np.mod(c.columns[name], 2 * np.pi)))
            found[name.replace("_rad", "_deg")] = turned
        elif name not in ("torque_Nm", "elapsed_s"):
            found[name] = c.columns[name]
    found["time_in_run_s"] = np.asarray(c.time_s - c.time_s[c.starts[:-1]][c.run_of])
    return found


@dataclass
class Residuals:
    """Residual of a campaign, with all quantities on which it may depend.

    Attributes
    ----------
    values : ndarray
        Arc seconds.
    covariates : dict
        Arrays by name, in the unit of `name_of`, without constant ones.
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
    found = recorded_quantities(c)
    largest = float(np.max(np.abs(c.torque)))
    turns = [directions(c.torque[at], largest)[0] for at in c.slices()]
    found["direction"] = np.asarray(2.0 * np.concatenate(turns) - 1.0)
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


def bins_of(values: FloatArray, edges: FloatArray) -> IntArray:
    """Bin of every value."""
    return np.clip(np.searchsorted(edges, values, "right") - 1, 0, edges.size - 2).astype(np.intp)


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
    cell = bins_of(values, edges) * ACROSS + bins_of(data.torque_Nm, across)
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
    name, unit = name_of(of.covariate)
    t, v = of.torque_edges, of.edges
    mean = of.mean[j, i]
    text = f"torque {t[i]:.3g} to {t[i + 1]:.3g} N·m, "
    text += f"{name} {v[j]:.4g} to {v[j + 1]:.4g} {unit}".strip()
    return text + (": too few samples" if np.isnan(mean) else f": mean {mean:+.2f} arcsec")


def scale_of(of: Map) -> float:
    """Largest absolute mean residual of a map: the limit of its colour scale."""
    return float(np.nanmax(np.abs(of.mean))) if np.isfinite(of.mean).any() else 1.0


def map_figure(data: Residuals, covariate: str) -> Chart:
    """Make the profile of the residual along a covariate, with the numbers of the map."""
    of = bin_residuals(data, covariate)
    name, _ = name_of(covariate)
    j, i = np.divmod(np.arange(of.mean.size), ACROSS)
    return Chart(
        f"residual_by_{covariate}",
        f"Residual over torque and {name}",
        "Above, the mean of measured minus model in each cell: orange above the model, blue below. "
        "Here, the mean along the quantity for either sign of the torque; the grey band is the "
        f"{data.against}.",
        lambda: [draw_profile(data, covariate)],
        {
            "torque_from_Nm": of.torque_edges[i],
            "torque_to_Nm": of.torque_edges[i + 1],
            f"{covariate}_from": of.edges[j],
            f"{covariate}_to": of.edges[j + 1],
            "samples": of.count.ravel(),
            "mean_residual_arcsec": of.mean.ravel(),
        },
    )


def draw_map(of: Map, picked: int | None = None, most: float | None = None) -> Any:
    """Draw the map; every cell has its number as `customdata` and shows its text on hovering."""
    name, unit = name_of(of.covariate)
    up = of.edges.size - 1
    # Rows of equal height, because the levels of a covariate may be far apart.
    figure = figures.framed("", "torque on the output, N·m", f"{name}, {unit}".rstrip(", "), 340)
    cells = np.arange(of.mean.size).reshape(of.mean.shape)
    figures.signed_map(
        figure,
        of.torque_edges,
        np.arange(up + 1),
        of.mean,
        most or scale_of(of),
        customdata=cells.tolist(),
        text=[[cell_text(of, int(cell)) for cell in row] for row in cells],
        hovertemplate="%{text}<extra></extra>",
        hoverongaps=False,
        colorbar={"title": {"text": "arcsec"}, "thickness": 12, "tickformat": "+"},
        xgap=1,
        ygap=1,
    )
    middles = 0.5 * (of.edges[1:] + of.edges[:-1])
    figure.update_yaxes(
        tickvals=np.arange(up) + 0.5, ticktext=[written(float(m), 3) for m in middles],
        range=[0, up], showgrid=False, zeroline=False,
    )  # fmt: skip
    figure.update_layout(plot_bgcolor=EMPTY)
    if picked is not None:
        j, i = divmod(picked, ACROSS)
        x0, x1 = of.torque_edges[i : i + 2]
        figure.add_shape(type="rect", x0=x0, x1=x1, y0=j, y1=j + 1, line={"color": INK, "width": 3})
    return figure


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
        cell = bins_of(values, edges)
    count = np.bincount(cell[side], minlength=bins)
    kept = count >= SAMPLES_LEAST
    middles = np.bincount(cell[side], values[side], bins)[kept] / count[kept]
    return middles, np.bincount(cell[side], data.values[side], bins)[kept] / count[kept]


def draw_profile(data: Residuals, covariate: str) -> Any:
    """Draw the mean residual along a covariate, separately for positive and negative torque."""
    name, unit = name_of(covariate)
    axis = f"{name}, {unit}".rstrip(", ")
    figure = figures.framed("", axis, "residual, arcsec", 250)
    figures.noise_band(figure, data.floor_arcsec)
    for text, ink, rising in (("torque above 0", TEAL, True), ("below 0", SOFT, False)):
        middles, mean = profile(data, covariate, rising=rising)
        marker = {"color": ink, "size": 6}
        figure.add_scatter(
            x=middles, y=mean, name=text, mode="lines+markers", line={"width": 1.2}, marker=marker
        )
    return figure
