"""Small maps of the residual, side by side: by torque, another quantity and direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lostmotion.branches import directions
from lostmotion.compare.loops import branch_blocks
from lostmotion.effects.conditions import Conditions
from lostmotion.report.page import Figure, FigureData
from lostmotion.report.svg import GRID, INK, SMALL_SIZE, SOFT, Array, Drawing
from lostmotion.report.wording import NOISE_FLOOR, angle_text, written

IntArray = npt.NDArray[np.intp]

ACROSS, UP = 16, 8
"""Bins of the torque and of the other quantity."""

CLEAR_T = 2.0
"""t value below which a bin is not significant and grey."""

MAPS_SHOWN = 4
"""Largest number of quantities that are drawn."""

WARM, COLD = (179, 64, 22), (0, 84, 140)
"""Colours of the largest positive and negative mean residual."""

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
    torque_edges_Nm: Array
    edges: Array
    cell: IntArray
    stretch: IntArray

    def means(self, residual: Array, floor: float) -> tuple[Array, Array]:
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


def varying_quantities(c: Conditions) -> list[tuple[str, str, Array]]:
    """Quantities that vary in a campaign, with their unit; angles within one turn, in degrees."""
    found: list[tuple[str, str, Array]] = []
    for name, unit, column in (
        ("temperature", "°C", "temperature_C"),
        ("wave generator angle", "°", "input_angle_rad"),
        ("output angle", "°", "output_angle_rad"),
        ("cycles", "", "cycles"),
        ("tilt moment", "N·m", "tilt_moment_Nm"),
        ("axial force", "N", "axial_force_N"),
        ("speed of the input", "rad/s", "input_velocity_rad_s"),
    ):
        values = c.columns.get(column)
        if values is None or np.ptp(values) <= 1e-9 * max(1.0, float(np.max(np.abs(values)))):
            continue
        if unit == "°":
            values = np.degrees(np.mod(values, 2 * np.pi))
        found.append((name, unit, values))
    found.append(("time in the run", "s", c.time_s - c.time_s[c.starts[:-1]][c.run_of]))
    return found


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


def edges_of(values: Array) -> Array:
    """Edges of bins: between distinct values if they are few, else of equal width."""
    levels = np.unique(values)
    if 1 < levels.size <= UP:
        middle = (levels[1:] + levels[:-1]) / 2
        return np.concatenate(([levels[0]], middle, [levels[-1]]))
    return np.linspace(float(levels[0]), float(levels[-1]), UP + 1)


def bins_of(values: Array, edges: Array) -> IntArray:
    """Bin of every value."""
    return np.clip(np.searchsorted(edges, values, "right") - 1, 0, edges.size - 2).astype(np.intp)


def grids_figure(
    c: Conditions,
    residuals: Sequence[tuple[str, Array]],
    floor_arcsec: float,
    name: str,
    against: str = NOISE_FLOOR,
) -> Figure:
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
    return Figure(
        f"Residual of the model of {name}",
        caption,
        lambda width: draw_maps(grids, made, labels, scale, name, width),
        FigureData("residual_grids", rows),
    )


def draw_maps(
    grids: Sequence[Grid],
    made: Sequence[Sequence[tuple[Array, Array]]],
    labels: Sequence[str],
    scale: float,
    name: str,
    width: float,
) -> str:
    """Draw the maps of each quantity, for each model and both directions."""
    wide = width > 600
    columns = 2 * len(labels)
    shown = columns if wide else 2
    left, gap, top = 64.0, 12.0, 40.0
    cell = (width - left - 10 - gap * (shown - 1)) / shown
    tall = 84.0
    lines = columns // shown
    block = lines * (tall + 42) + 22
    drawing = Drawing(width, block * len(grids) + 8, f"Residual of the model of {name}")
    for g, (grid, row) in enumerate(zip(grids, made, strict=True)):
        y0 = g * block
        unit = f", {grid.unit}" if grid.unit else ""
        drawing.text(10, y0 + 16, f"{grid.name}{unit}", weight="600")
        for k in range(columns):
            means, t = row[k // 2]
            x = left + (k % shown) * (cell + gap)
            y = y0 + top + (k // shown) * (tall + 42)
            title = f"{labels[k // 2]}, {DIRECTIONS[k % 2].split()[0]}"
            drawing.text(x, y - 6, title, size=SMALL_SIZE, fill=SOFT)
            _map(drawing, means[k % 2], t[k % 2], scale, (x, y, cell, tall))
            if k % shown == 0:
                for value, place in ((grid.edges[-1], y + 9), (grid.edges[0], y + tall)):
                    drawing.text(
                        x - 6, place, written(value), anchor="end", size=SMALL_SIZE, fill=SOFT
                    )
            low, high = grid.torque_edges_Nm[0], grid.torque_edges_Nm[-1]
            below = y + tall + 14
            drawing.text(x, below, written(low), size=SMALL_SIZE, fill=SOFT)
            drawing.text(
                x + cell, below, f"{written(high)} N·m", anchor="end", size=SMALL_SIZE, fill=SOFT
            )
    return drawing.render()


def _map(
    drawing: Drawing,
    means: Array,
    t: Array,
    scale: float,
    box: tuple[float, float, float, float],
) -> None:
    x, y, width, height = box
    up, across = means.shape
    w, h = width / across, height / up
    for u in range(up):
        for a in range(across):
            value = means[u, a]
            if not np.isfinite(value):
                continue
            fill = GRID if abs(t[u, a]) < CLEAR_T else residual_colour(value / scale)
            drawing.rectangle(x + a * w, y + (up - 1 - u) * h, w + 0.3, h + 0.3, fill)
    for ends in (
        (x, y, x + width, y),
        (x, y + height, x + width, y + height),
        (x, y, x, y + height),
        (x + width, y, x + width, y + height),
    ):
        drawing.line(ends, INK, 0.6)


def residual_colour(share: float) -> str:
    """Colour of a mean residual over the largest one, from white to the full colour."""
    strength = min(abs(share), 1.0) ** 0.7
    full = WARM if share > 0 else COLD
    mixed = [round(255 + (c - 255) * strength) for c in full]
    return "#" + "".join(f"{c:02x}" for c in mixed)
