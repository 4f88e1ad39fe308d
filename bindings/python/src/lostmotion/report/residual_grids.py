"""Small maps of the residual, side by side: by torque, another quantity and direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.branches import directions
from lostmotion.compare.loops import branch_blocks
from lostmotion.effects.conditions import Conditions
from lostmotion.report.charts import Chart
from lostmotion.report.maps import bins_of, name_of, recorded_quantities
from lostmotion.report.wording import NOISE_FLOOR, angle_text
from lostmotion.results import figures
from lostmotion.results.colours import GRID

ACROSS, UP = 16, 8
"""Bins of the torque and of the other quantity."""

CLEAR_T = 2.0
"""t value below which a bin is not significant and grey."""

MAPS_SHOWN = 4
"""Largest number of quantities that are drawn."""

MAP_PX = 250
"""Height of a map."""

HOVER = "%{x:.4g} N·m, %{y:.4g}: %{z:.2f} arcsec, t %{customdata}<extra></extra>"

DIRECTIONS = ("falling torque", "rising torque")


@dataclass(frozen=True)
class Grid:
    """Bins of torque and another quantity.

    Attributes
    ----------
    name, unit : str
        Of the other quantity.
    torque_edges_Nm, edges : ndarray
    cell : ndarray of int
        Bin of every sample: direction, then quantity, then torque.
    stretch : ndarray of int
        Section between reversals of every sample.
    """

    name: str
    unit: str
    torque_edges_Nm: FloatArray
    edges: FloatArray
    cell: IntArray
    stretch: IntArray

    def means(self, residual: FloatArray, floor: float) -> tuple[FloatArray, FloatArray]:
        """Mean residual of every bin and its t, shape ``[direction, quantity, torque]``.

        A passage through a bin counts once, regardless of its number of samples.
        """
        shape = (2, self.edges.size - 1, self.torque_edges_Nm.size - 1)
        size = int(np.prod(shape))
        count = np.bincount(self.cell, minlength=size)
        mean = np.bincount(self.cell, residual, size) / np.maximum(count, 1)
        passages = np.unique(self.cell * (int(self.stretch.max()) + 1) + self.stretch)
        passed = np.bincount(passages // (int(self.stretch.max()) + 1), minlength=size)
        t = mean * np.sqrt(np.maximum(passed, 1)) / max(floor, 1e-12)
        mean[count == 0] = np.nan
        return mean.reshape(shape), t.reshape(shape)


def varying_quantities(c: Conditions) -> list[tuple[str, str, FloatArray]]:
    """Quantities that vary in a campaign, with name and unit."""
    return [
        (*name_of(quantity), values)
        for quantity, values in recorded_quantities(c).items()
        if np.ptp(values) > 1e-9 * max(1.0, float(np.max(np.abs(values))))
    ]


def make_grids(c: Conditions) -> list[Grid]:
    """Make the grids of a campaign."""
    largest = float(np.max(np.abs(c.torque)))
    direction = np.concatenate([directions(c.torque[at], largest)[0] for at in c.slices()])
    stretch = branch_blocks(c.starts, direction)
    torque_edges = np.linspace(float(c.torque.min()), float(c.torque.max()), ACROSS + 1)
    across = bins_of(c.torque, torque_edges)
    grids = []
    for name, unit, values in varying_quantities(c):
        edges = edges_of(values)
        cell = (direction * (edges.size - 1) + bins_of(values, edges)) * ACROSS + across
        grids.append(Grid(name, unit, torque_edges, edges, cell.astype(np.intp), stretch))
    return grids


def edges_of(values: FloatArray) -> FloatArray:
    """Edges of bins: between distinct values if they are few, else of equal width."""
    levels = np.unique(values)
    if 1 < levels.size <= UP:
        middle = (levels[1:] + levels[:-1]) / 2
        return np.concatenate(([levels[0]], middle, [levels[-1]]))
    return np.linspace(float(levels[0]), float(levels[-1]), UP + 1)


def grids_figure(
    c: Conditions,
    residuals: Sequence[tuple[str, FloatArray]],
    floor_arcsec: float,
    name: str,
    against: str = NOISE_FLOOR,
) -> Chart:
    """Make the figure of the maps.

    Parameters
    ----------
    residuals : sequence of (str, ndarray)
        Residuals in arc seconds of one or two models, with their names.
    floor_arcsec : float
        Reference for the significance of a mean.
    against : str
        Name of this reference.
    """
    grids = make_grids(c)
    made = [[grid.means(r, floor_arcsec) for _, r in residuals] for grid in grids]
    # Quantities with the largest residual of the first model come first.
    order = sorted(
        range(len(grids)),
        key=lambda i: -float(np.nanmean(np.where(np.abs(made[i][0][1]) > CLEAR_T, 1.0, 0.0))),
    )[:MAPS_SHOWN]
    grids, made = [grids[i] for i in order], [made[i] for i in order]
    scale = max([float(np.nanmax(np.abs(means))) for row in made for means, _ in row] or [1.0])
    caption = (
        "Mean residual over torque (horizontal) and another quantity (vertical), for falling "
        "and rising torque. Orange: more lost motion than in the model, blue: less; the "
        f"darkest colour is {angle_text(scale)}. Grey: no more than {CLEAR_T:g} standard "
        f"errors, where each passage counts once, with the {against} of "
        f"{angle_text(floor_arcsec)}; white: no "
        "samples."
    )
    rows: dict[str, list[object]] = {
        key: []
        for key in (
            "quantity",
            "model",
            "direction",
            "from",
            "to",
            "torque_from_Nm",
            "torque_to_Nm",
            "mean_residual_arcsec",
            "t",
        )
    }
    for grid, row in zip(grids, made, strict=True):
        for (label, _), (means, t) in zip(residuals, row, strict=True):
            for d, u, a in np.argwhere(np.isfinite(means)):
                values = (
                    grid.name,
                    label,
                    DIRECTIONS[d],
                    float(grid.edges[u]),
                    float(grid.edges[u + 1]),
                    float(grid.torque_edges_Nm[a]),
                    float(grid.torque_edges_Nm[a + 1]),
                    float(means[d, u, a]),
                    float(t[d, u, a]),
                )
                for column, value in zip(rows.values(), values, strict=True):
                    column.append(value)
    labels = [label for label, _ in residuals]
    return Chart(
        "residual_grids",
        f"Residual of the model of {name}",
        caption,
        lambda: draw_maps(grids, made, labels, scale),
        rows,
        beside=2,
    )


def draw_maps(
    grids: Sequence[Grid],
    made: Sequence[Sequence[tuple[FloatArray, FloatArray]]],
    labels: Sequence[str],
    scale: float,
) -> list[Any]:
    """Draw a figure for each quantity and model: falling torque beside rising torque."""
    from plotly.subplots import make_subplots

    found = []
    for grid, row in zip(grids, made, strict=True):
        unit = f", {grid.unit}" if grid.unit else ""
        for label, (means, t) in zip(labels, row, strict=True):
            titles = [f"{label}, {direction.split()[0]}" for direction in DIRECTIONS]
            figure = make_subplots(
                1, 2, shared_yaxes=True, subplot_titles=titles, horizontal_spacing=0.08
            )
            figure.update_layout(
                template=figures.TEMPLATE, height=MAP_PX, coloraxis_showscale=False
            )
            figure.update_annotations(font_size=12)
            figure.update_yaxes(title_text=f"{grid.name}{unit}", row=1, col=1)
            figure.update_xaxes(title_text="torque, N·m", showline=False, nticks=5)
            for k in range(len(DIRECTIONS)):
                clear = np.abs(t[k]) >= CLEAR_T
                faint = np.where(np.isfinite(means[k]) & ~clear, 0.0, np.nan)
                where = {"row": 1, "col": k + 1, "showscale": False}
                figure.add_heatmap(
                    x=grid.torque_edges_Nm,
                    y=grid.edges,
                    z=faint,
                    colorscale=[[0, GRID], [1, GRID]],
                    hoverinfo="skip",
                    **where,
                )
                figures.signed_map(
                    figure,
                    grid.torque_edges_Nm,
                    grid.edges,
                    np.where(clear, means[k], np.nan),
                    scale,
                    customdata=np.round(t[k], 1).tolist(),
                    hovertemplate=HOVER,
                    **where,
                )
            found.append(figure)
    return found
