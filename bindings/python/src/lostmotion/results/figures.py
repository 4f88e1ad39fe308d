"""Figures of results, drawn with Plotly (``pip install 'lostmotion[plot]'``).

Each function takes arrays and returns a ``plotly.graph_objects.Figure``: a notebook displays it,
and ``figure.write_html("loops.html")`` writes a page. Runs are traces that can be toggled in the
legend.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.errors import InputError

FloatArray = npt.NDArray[np.float64]

POINTS_MAX = 4000
"""Samples of a run that are drawn; more slow down a page without benefit."""

MEASURED, MODEL = "#0072b2", "#d55e00"
"""Colours of Okabe and Ito (2008), distinct for colour-blind readers."""


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
        raise InputError("plot", "", "no Plotly", "pip install 'lostmotion[plot]'") from None
    return go  # type: ignore[no-any-return]


POINTS_ALL = 30_000
"""Largest number of samples drawn, over all runs: a figure of about 300 KB."""


def drawn(count: int, total: int = 0) -> slice:
    """Choose evenly spaced samples of a run to draw, of `total` in all runs."""
    return slice(None, None, max(1, -(-count // POINTS_MAX), -(-total // POINTS_ALL)))


def single(values: FloatArray) -> npt.NDArray[np.float32]:
    """Return values in single precision, which halves the size of a page."""
    return np.asarray(values, np.float32)


def framed(go: Any, title: str, x: str, y: str) -> Any:
    """Make an empty figure with its title and axes."""
    figure = go.Figure()
    figure.update_layout(
        title=title, xaxis_title=x, yaxis_title=y, template="plotly_white", hovermode="closest"
    )
    return figure


def loops(
    torque_Nm: Sequence[FloatArray],
    measured_arcmin: Sequence[FloatArray],
    model_arcmin: Sequence[FloatArray],
    labels: Sequence[int | str],
) -> Any:
    """Draw measured and modelled lost motion against the torque, run by run."""
    go = plotly()
    figure = framed(go, "Lost motion", "torque, N m", "lost motion, arcmin")
    for torque, *angles, label in zip(
        torque_Nm, measured_arcmin, model_arcmin, labels, strict=True
    ):
        kept = drawn(torque.size)
        for name, colour, angle in zip(
            ("measured", "model"), (MEASURED, MODEL), angles, strict=True
        ):
            figure.add_scattergl(
                x=single(torque[kept]),
                y=single(angle[kept]),
                name=f"run {label}, {name}",
                legendgroup=str(label),
                mode="lines",
                line={"color": colour, "width": 1},
            )
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
    go = plotly()
    figure = framed(go, "Residual", axis, "residual, arcsec")
    scatter_runs(figure, against, residual_arcsec, labels)
    return figure


def predicted(
    model_arcmin: Sequence[FloatArray],
    measured_arcmin: Sequence[FloatArray],
    labels: Sequence[int | str],
) -> Any:
    """Draw measured against predicted lost motion, run by run, with the line of equality."""
    go = plotly()
    figure = framed(
        go, "Measured against predicted", "predicted lost motion, arcmin", "measured, arcmin"
    )
    scatter_runs(figure, model_arcmin, measured_arcmin, labels)
    ends = [
        min(float(run.min()) for run in model_arcmin),
        max(float(run.max()) for run in model_arcmin),
    ]
    figure.add_scatter(x=ends, y=ends, mode="lines", name="equal", line={"dash": "dot"})
    return figure


def spectrum(order: FloatArray, amplitude_arcsec: FloatArray, turns_of: str) -> Any:
    """Draw the amplitude of a residual over orders, per turn of the input or the output."""
    go = plotly()
    figure = framed(go, "Spectrum of the residual", f"order, per turn of the {turns_of}", "arcsec")
    figure.add_scatter(x=order, y=amplitude_arcsec, mode="lines", name="amplitude")
    return figure


def autocorrelation(whitened: Sequence[FloatArray], lags: int) -> Any:
    """Draw the autocorrelation of a whitened residual, pooled over runs.

    The band contains independent samples with a probability of 95 %.
    """
    go = plotly()
    title = "Autocorrelation of the whitened residual"
    figure = framed(go, title, "lag, samples", "correlation")
    runs = [run - run.mean() for run in whitened if run.size > 1]
    lags = min(lags, max(run.size for run in runs) - 1)
    power = sum(float(run @ run) for run in runs)
    products = [
        sum(float(run[lag:] @ run[: run.size - lag]) for run in runs if run.size > lag)
        for lag in range(lags + 1)
    ]
    band = 1.96 / np.sqrt(sum(run.size for run in runs))
    figure.add_bar(x=list(range(lags + 1)), y=[p / power for p in products], name="residual")
    figure.add_hrect(y0=-band, y1=band, opacity=0.2, line_width=0, fillcolor="grey")
    return figure


def normal_quantiles(whitened: FloatArray) -> Any:
    """Draw the quantiles of a whitened residual against those of a normal distribution."""
    from scipy.special import ndtri

    go = plotly()
    title = "Quantiles of the whitened residual"
    figure = framed(go, title, "normal quantile", "quantile of the whitened residual")
    found = np.sort(whitened)
    normal = ndtri((np.arange(found.size) + 0.5) / found.size)
    kept = drawn(found.size)
    figure.add_scattergl(
        x=single(normal[kept]), y=single(found[kept]), mode="markers", name="residual"
    )
    ends = [normal[0], normal[-1]]
    figure.add_scatter(x=ends, y=ends, mode="lines", name="normal", line={"dash": "dot"})
    return figure


def correlations(names: Sequence[str], covariance: FloatArray) -> Any:
    """Draw the correlations of estimated parameters as a map."""
    go = plotly()
    size = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    figure = framed(go, "Correlations of the parameters", "", "")
    figure.add_heatmap(
        x=list(names),
        y=list(names),
        z=covariance / np.outer(size, size),
        zmin=-1,
        zmax=1,
        colorscale="RdBu",
        colorbar={"title": "correlation"},
    )
    return figure


def ladder(rungs: Sequence[Mapping[str, Any]], noise_floor_arcsec: float) -> Any:
    """Draw the error after each effect that was added, fitted and leave-one-run-out."""
    go = plotly()
    figure = framed(go, "Error ladder", "", "rms error, arcsec")
    names = ["baseline model", *(f"+ {rung['effects'][-1]}" for rung in rungs[1:])]
    figure.add_bar(x=names, y=[rung["rms_arcsec"] for rung in rungs], name="fitted")
    figure.add_scatter(
        x=names,
        y=[rung["rms_heldout_arcsec"] for rung in rungs],
        name="leave-one-run-out",
        mode="markers",
        marker={"size": 12, "symbol": "circle-open", "line": {"width": 2}},
    )
    figure.add_hline(y=noise_floor_arcsec, line_dash="dot", annotation_text="noise floor")
    return figure


def curves(x: npt.ArrayLike, series: Mapping[str, Any], title: str, axes: tuple[str, str]) -> Any:
    """Draw curves over one axis, each under its name."""
    go = plotly()
    figure = framed(go, title, *axes)
    for name, y in series.items():
        figure.add_scatter(x=np.asarray(x), y=y, name=name, mode="lines")
    return figure


def points(x: Sequence[float], y: Sequence[float], title: str, axes: tuple[str, str]) -> Any:
    """Draw numbered points: designs of a front."""
    go = plotly()
    figure = framed(go, title, *axes)
    figure.add_scatter(x=x, y=y, mode="markers", text=[f"design {i + 1}" for i in range(len(x))])
    return figure
