"""Charts as Plotly figures: one set for notebooks, reports and the workbench.

Each function takes arrays and returns a ``plotly.graph_objects.Figure``: a notebook displays it,
``figure.write_html("loops.html")`` writes a page, and reports and the workbench show the same
figure with its caption. Runs are traces that can be toggled in the legend.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.arrays import FloatArray
from lostmotion.errors import InputError
from lostmotion.results.colours import (
    BAND,
    BLUE,
    FAINT,
    GRID,
    INK,
    MEASURED,
    MODEL,
    ORANGE,
    PAPER,
    RED,
    SIGNED,
    SOFT,
    TEAL,
)
from lostmotion.results.page_figure import ON_PAGE, PageFigure

POINTS_MAX = 4000
"""Samples of a run that are drawn; more slow down a page without benefit."""

POINTS_ALL = 30_000
"""Largest number of samples drawn, over all runs: a figure of about 300 KB."""

HEIGHT_PX = 400
"""Height of a chart unless its content requires another."""

AXIS = {
    "gridcolor": GRID,
    "zerolinecolor": FAINT,
    "zerolinewidth": 1,
    "linecolor": SOFT,
    "ticks": "outside",
    "tickcolor": SOFT,
    "automargin": True,
    "title": {"standoff": 6},
}

TEMPLATE = {
    "layout": {
        "font": {"family": "system-ui, 'Segoe UI', Roboto, Arial, sans-serif", "color": INK},
        "colorway": [BLUE, ORANGE, TEAL, RED, "#33bbee", "#ee3377", SOFT],
        "paper_bgcolor": PAPER,
        "plot_bgcolor": PAPER,
        "hovermode": "closest",
        "separators": ".\u202f",
        "margin": {"l": 56, "r": 16, "t": 30, "b": 48},
        "title": {"x": 0, "xref": "paper", "y": 0.98, "yanchor": "top", "font": {"size": 14}},
        "legend": {"orientation": "h", "x": 0, "y": 0, "yref": "container", "yanchor": "bottom"},
        "xaxis": {**AXIS, "showgrid": False, "showline": True},
        "yaxis": AXIS,
    }
}
"""The look of every chart."""


def plotly() -> ModuleType:
    """Return Plotly's ``graph_objects``.

    Raises
    ------
    InputError
        When Plotly is not installed.
    """
    try:
        import plotly.graph_objects as go
    except ImportError:
        raise InputError("plot", "", "no Plotly", "pip install plotly") from None
    return go  # type: ignore[no-any-return]


def drawn(count: int, total: int = 0) -> slice:
    """Choose evenly spaced samples of a run to draw, of `total` in all runs."""
    return slice(None, None, max(1, -(-count // POINTS_MAX), -(-total // POINTS_ALL)))


def single(values: npt.ArrayLike) -> npt.NDArray[np.float32]:
    """Return values in single precision, which halves the size of a page."""
    return np.asarray(values, np.float32)


def framed(title: str, x: str, y: str, height: float = HEIGHT_PX) -> Any:
    """Make an empty figure with its title and axes."""
    layout = {**_layout(title, height), "xaxis": {"title": x}, "yaxis": {"title": y}}
    return PageFigure(layout) if ON_PAGE.get() else plotly().Figure(layout=layout)


def _layout(title: str, height: float) -> dict[str, Any]:
    """Return what every chart has.

    Given to a new figure: an update of an existing one merges Plotly's own template, and takes
    thirty times as long.
    """
    return {"title": title, "template": TEMPLATE, "height": height}


def stacked(
    title: str,
    x: str,
    ys: Sequence[str],
    shares: Sequence[float],
    height: float = HEIGHT_PX,
) -> Any:
    """Make an empty figure of charts above each other, over one horizontal axis.

    Parameters
    ----------
    ys : sequence of str
        Titles of the vertical axes, from the top.
    shares : sequence of float
        Heights of the charts.
    """
    layout, gap = _layout(title, height), 0.22 / len(ys)
    if ON_PAGE.get():
        figure: Any = PageFigure(layout, shares, gap)
    else:
        from plotly.subplots import make_subplots

        figure = make_subplots(
            len(ys),
            1,
            shared_xaxes=True,
            row_heights=list(shares),
            vertical_spacing=gap,
            figure=plotly().Figure(layout=layout),
        )
    for row, y in enumerate(ys, 1):
        figure.update_yaxes(title={"text": y}, row=row, col=1)
    figure.update_xaxes(title={"text": x}, row=len(ys), col=1)
    return figure


def line(
    figure: Any,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    colour: str,
    name: str = "",
    *,
    width: float = 1.4,
    dash: str | None = None,
    row: int | None = None,
    **more: Any,
) -> None:
    """Add a curve; without a name it is not in the legend."""
    figure.add_scatter(
        x=single(x),
        y=single(y),
        mode="lines",
        name=name,
        showlegend=more.pop("showlegend", bool(name)),
        line={"color": colour, "width": width, "dash": dash},
        **({} if row is None else {"row": row, "col": 1}),
        **more,
    )


def dots(
    figure: Any,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    colour: str,
    name: str = "",
    *,
    size: float = 6,
    hollow: bool = False,
    symbol: str = "circle",
    row: int | None = None,
    **more: Any,
) -> None:
    """Add marks; without a name they are not in the legend."""
    marker: dict[str, Any] = {"size": size, "color": PAPER if hollow else colour}
    marker["symbol"] = symbol
    if hollow:
        marker["line"] = {"color": colour, "width": 1.4}
    figure.add_scatter(
        x=single(x),
        y=single(y),
        mode="markers",
        name=name,
        showlegend=more.pop("showlegend", bool(name)),
        marker=marker,
        **({} if row is None else {"row": row, "col": 1}),
        **more,
    )


def area(
    figure: Any,
    x: FloatArray,
    low: FloatArray,
    high: FloatArray,
    colour: str,
    name: str = "",
    **more: Any,
) -> None:
    """Fill between two curves over the same x."""
    figure.add_scatter(
        x=single(np.concatenate((x, x[::-1]))),
        y=single(np.concatenate((high, low[::-1]))),
        mode="lines",
        fill="toself",
        fillcolor=colour,
        line={"color": PAPER, "width": 0.5},
        name=name,
        showlegend=more.pop("showlegend", bool(name)),
        hoverinfo="skip",
        **more,
    )


def noise_band(figure: Any, floor: float, row: int | None = None) -> None:
    """Draw the band of the noise floor about zero."""
    place = {} if row is None else {"row": row, "col": 1}
    figure.add_hrect(y0=-floor, y1=floor, fillcolor=BAND, line={"width": 0}, layer="below", **place)


def loops(
    torque_Nm: Sequence[FloatArray],
    measured_arcmin: Sequence[FloatArray],
    model_arcmin: Sequence[FloatArray],
    labels: Sequence[int | str],
    residual: Sequence[FloatArray],
    unit: str = "arcsec",
    floor: float | None = None,
) -> Any:
    """Draw measured and modelled lost motion and the residual against the torque, run by run.

    Parameters
    ----------
    residual : sequence of ndarray
        In `unit`.
    floor : float, optional
        Noise floor in `unit`.
    """
    ys = ("lost motion, arcmin", f"residual, {unit}")
    title = "Lost motion: measured grey, model orange"
    figure = stacked(title, "torque on the output, N·m", ys, (0.7, 0.3), 560)
    for torque, measured, model, left, label in zip(
        torque_Nm, measured_arcmin, model_arcmin, residual, labels, strict=True
    ):
        kept = drawn(torque.size)
        run = f"run {label}"
        for y, colour, row, name in (
            (measured, MEASURED, 1, "measured"),
            (model, MODEL, 1, "model"),
            (left, BLUE, 2, "residual"),
        ):
            line(
                figure,
                torque[kept],
                y[kept],
                colour,
                run if name == "measured" else f"{run}, {name}",
                width=1,
                row=row,
                legendgroup=str(label),
                showlegend=name == "measured",
            )
    if floor is not None:
        noise_band(figure, floor, 2)
    return figure


def scatter_runs(
    figure: Any, xs: Sequence[FloatArray], ys: Sequence[FloatArray], labels: Sequence[int | str]
) -> None:
    """Add the samples of every run as dots, one trace per run."""
    total = sum(x.size for x in xs)
    for x, y, label in zip(xs, ys, labels, strict=True):
        kept = drawn(x.size, total)
        figure.add_scattergl(
            x=single(x[kept]),
            y=single(y[kept]),
            name=f"run {label}",
            mode="markers",
            marker={"size": 3},
        )


def residuals(
    against: Sequence[FloatArray],
    residual_arcsec: Sequence[FloatArray],
    labels: Sequence[int | str],
    axis: str,
) -> Any:
    """Draw the residual against a quantity, run by run.

    Parameters
    ----------
    axis : str
        Name of the quantity with its unit, for the axis.
    """
    figure = framed("Residual", axis, "residual, arcsec")
    scatter_runs(figure, against, residual_arcsec, labels)
    return figure


def predicted(
    model_arcmin: Sequence[FloatArray],
    measured_arcmin: Sequence[FloatArray],
    labels: Sequence[int | str],
) -> Any:
    """Draw measured against predicted lost motion, run by run, with the line of equality."""
    figure = framed(
        "Measured against predicted", "predicted lost motion, arcmin", "measured, arcmin"
    )
    scatter_runs(figure, model_arcmin, measured_arcmin, labels)
    ends = [
        min(float(run.min()) for run in model_arcmin),
        max(float(run.max()) for run in model_arcmin),
    ]
    line(figure, ends, ends, INK, "equal", dash="dot")
    return figure


def spectrum(order: FloatArray, amplitude_arcsec: FloatArray, turns_of: str) -> Any:
    """Draw the amplitude of a residual over orders, per turn of the input or the output."""
    figure = framed("Spectrum of the residual", f"order, per turn of the {turns_of}", "arcsec")
    line(figure, order, amplitude_arcsec, BLUE, "amplitude")
    return figure


def autocorrelation(whitened: Sequence[FloatArray], lags: int) -> Any:
    """Draw the autocorrelation of a whitened residual, pooled over runs.

    The band contains independent samples with a probability of 95 %.
    """
    title = "Autocorrelation of the whitened residual"
    figure = framed(title, "lag, samples", "correlation")
    runs = [run - run.mean() for run in whitened if run.size > 1]
    lags = min(lags, max(run.size for run in runs) - 1)
    power = sum(float(run @ run) for run in runs)
    products = [
        sum(float(run[lag:] @ run[: run.size - lag]) for run in runs if run.size > lag)
        for lag in range(lags + 1)
    ]
    band = 1.96 / np.sqrt(sum(run.size for run in runs))
    figure.add_bar(x=list(range(lags + 1)), y=[p / power for p in products], name="residual")
    noise_band(figure, band)
    return figure


def normal_quantiles(whitened: FloatArray) -> Any:
    """Draw the quantiles of a whitened residual against those of a normal distribution."""
    from scipy.special import ndtri

    title = "Quantiles of the whitened residual"
    figure = framed(title, "normal quantile", "quantile of the whitened residual")
    found = np.sort(whitened)
    normal = ndtri((np.arange(found.size) + 0.5) / found.size)
    kept = drawn(found.size)
    dots(figure, normal[kept], found[kept], BLUE, "residual", size=5)
    ends = [normal[0], normal[-1]]
    line(figure, ends, ends, INK, "normal", dash="dot")
    return figure


def correlations(names: Sequence[str], covariance: FloatArray) -> Any:
    """Draw the correlations of estimated parameters as a map."""
    size = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    figure = framed("Correlations of the parameters", "", "", 480)
    figure.add_heatmap(
        x=list(names),
        y=list(names),
        z=covariance / np.outer(size, size),
        zmin=-1,
        zmax=1,
        colorscale=SIGNED,
        colorbar={"title": "correlation"},
    )
    return figure


def texts(figure: Any, x: npt.ArrayLike, y: npt.ArrayLike, said: Sequence[str]) -> None:
    """Write texts to the right of places."""
    figure.add_scatter(
        x=np.asarray(x),
        y=np.asarray(y),
        text=list(said),
        mode="text",
        textposition="middle right",
        hoverinfo="skip",
        showlegend=False,
    )


def names_above(figure: Any, names: Sequence[str]) -> None:
    """Name horizontal bars at 0, 1, ... from the top, above each: long names take no width."""
    rows = np.arange(len(names))
    texts(figure, np.zeros(len(names)), rows - 0.36, names)
    figure.update_layout(bargap=0.68)
    figure.update_yaxes(range=[len(names) - 0.55, -0.65], visible=False)


def ladder(
    names: Sequence[str],
    fitted: Sequence[float],
    heldout: Sequence[float],
    noise_floor_arcsec: float,
    written: Sequence[str] | None = None,
    *,
    narrow: bool = False,
) -> Any:
    """Draw the error after each effect that was added, fitted and leave-one-run-out.

    Parameters
    ----------
    names : sequence of str
        Name of what each step adds.
    fitted, heldout : sequence of float
        rms errors in arcsec.
    written : sequence of str, optional
        Both errors in words, beside each bar.
    narrow : bool
        Whether it is drawn for a width of about 250 pixels.
    """
    rows = np.arange(len(names))
    floor = f"rms, arcsec (grey: noise floor {noise_floor_arcsec:.3g})"
    figure = framed("Error ladder", floor, "", 90 + 46 * len(names))
    figure.update_layout(showlegend=False)
    figure.add_vrect(x0=0, x1=noise_floor_arcsec, fillcolor=BAND, line={"width": 0}, layer="below")
    figure.add_bar(
        x=list(fitted),
        y=rows,
        orientation="h",
        marker={"color": [MODEL, *[BLUE] * (len(names) - 1)]},
        name="fitted",
        customdata=list(names),
        hovertemplate="%{customdata}: %{x:.2f} arcsec fitted<extra></extra>",
    )
    dots(
        figure,
        heldout,
        rows,
        INK,
        "leave-one-run-out",
        size=9,
        hollow=True,
        customdata=list(names),
        hovertemplate="%{customdata}: %{x:.2f} arcsec leave-one-run-out<extra></extra>",
    )
    most = max(*fitted, *heldout, noise_floor_arcsec)
    ends = [max(pair) for pair in zip(fitted, heldout, strict=True)]
    said = written or [f"{a:.3g} / {b:.3g}" for a, b in zip(fitted, heldout, strict=True)]
    names_above(figure, names)
    texts(figure, np.array(ends) + 0.03 * most, rows, [f"<b>{one}</b>" for one in said])
    figure.update_layout(margin={"l": 12, "r": 12})
    if narrow:
        figure.update_layout(font={"size": 11})
    figure.update_xaxes(range=[0, (1.9 if narrow else 1.36) * most])
    return figure


def ladder_of(rungs: Sequence[Mapping[str, Any]], noise_floor_arcsec: float) -> Any:
    """Draw the ladder of an answer."""
    return ladder(
        ["baseline model", *(f"+ {rung['effects'][-1]}" for rung in rungs[1:])],
        [rung["rms_arcsec"] for rung in rungs],
        [rung["rms_heldout_arcsec"] for rung in rungs],
        noise_floor_arcsec,
    )


def curves(x: npt.ArrayLike, series: Mapping[str, Any], title: str, axes: tuple[str, str]) -> Any:
    """Draw curves over one axis, each under its name."""
    figure = framed(title, *axes)
    for name, y in series.items():
        figure.add_scatter(x=np.asarray(x), y=y, name=name, mode="lines")
    return figure


def points(x: Sequence[float], y: Sequence[float], title: str, axes: tuple[str, str]) -> Any:
    """Draw numbered points: designs of a front."""
    figure = framed(title, *axes)
    figure.add_scatter(x=x, y=y, mode="markers", text=[f"design {i + 1}" for i in range(len(x))])
    return figure


def signed_map(
    figure: Any,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    values: FloatArray,
    most: float,
    **more: Any,
) -> None:
    """Add a map of a signed quantity over cells: blue below zero, orange above.

    Parameters
    ----------
    x, y : array_like
        Edges of the cells.
    values : ndarray, shape (y.size - 1, x.size - 1)
        NaN leaves a cell white.
    most : float
        Largest value of the colour scale.
    """
    figure.add_heatmap(
        x=single(x), y=single(y), z=single(values), zmin=-most, zmax=most, colorscale=SIGNED, **more
    )


def axis_range(values: Sequence[float], share: float = 0.06) -> list[float]:
    """Range of an axis: that of the values, with a margin on either side."""
    low, high = float(min(values)), float(max(values))
    room = share * (high - low) or 1.0
    return [low - room, high + room]


def mean_curve(
    loops_drawn: Sequence[tuple[FloatArray, FloatArray]],
    torque_Nm: FloatArray,
    curve_arcmin: FloatArray,
) -> Any:
    """Draw the branches of torque loops and their mean curve.

    Parameters
    ----------
    loops_drawn : sequence of (ndarray, ndarray)
        Torque in Nm and angle in arcmin of each branch.
    """
    title = "Torque loops and their mean curve"
    figure = framed(title, "torque on the output, N·m", "lost motion, arcmin", 460)
    for i, (torque, angle) in enumerate(loops_drawn):
        line(
            figure,
            torque,
            angle,
            MEASURED,
            "measured",
            width=1,
            legendgroup="measured",
            showlegend=i == 0,
        )
    line(figure, torque_Nm, curve_arcmin, MODEL, "mean curve", width=2)
    return figure
