"""Interactive Plotly plots of a fitted result, with zoom and selectable runs.

The figures are those of the result in Python, with title and caption. A page contains Plotly
compressed, and unpacks it when the first plot becomes visible.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from lostmotion.discover.fitted_model import FittedModel
from lostmotion.discover.whitened_result import WhitenedResult

SCRIPT = Path(__file__).with_name("plots.js")

CONFIG = {
    "responsive": True,
    "displaylogo": False,
    "showSendToCloud": False,
    "plotlyServerURL": "",
    "modeBarButtonsToRemove": ["sendChartToCloud", "sendDataToCloud"],
}
"""Plotly configuration of a plot; no data are sent from the page."""

NOT_INSTALLED = "Residual plots need Plotly: pip install 'lostmotion[plot]'."


@dataclass(frozen=True)
class Plot:
    """A plot of a result.

    Attributes
    ----------
    name : str
        Short, for menus and places in a page.
    title, caption : str
        Content and reading instructions, plain text.
    make : callable
        Returns the Plotly figure.
    """

    name: str
    title: str
    caption: str
    make: Callable[[], Any]


def installed() -> bool:
    """Whether Plotly is installed."""
    return find_spec("plotly") is not None


def plots_of(result: WhitenedResult) -> list[Plot]:
    """Return the plots for judging the residual of a result."""
    found = [
        Plot(
            "time",
            "Residual against time",
            "Drift, steps and warm-up appear as a trend within the runs.",
            lambda: result.plot_residuals("time_s"),
        ),
        Plot(
            "fit",
            "Residual against the fit",
            "A residual that curves over the fitted lost motion indicates a wrong form of the "
            "model.",
            lambda: result.plot_residuals("model_arcmin"),
        ),
        Plot(
            "predicted",
            "Measured against predicted",
            "By run; a run off the line of equality has a different stiffness or gap.",
            result.plot_predicted,
        ),
    ]
    if result.whitened():
        found += [
            Plot(
                "autocorrelation",
                "Autocorrelation of the whitened residual",
                "The residual after whitening by its autoregression. Bars outside the band (95 %) "
                "are correlation that the noise model does not describe.",
                result.plot_autocorrelation,
            ),
            Plot(
                "quantiles",
                "Normal quantiles of the whitened residual",
                "Gaussian noise lies on the line; deviating ends are outliers or a rare effect.",
                result.plot_normal,
            ),
        ]
    columns = result.fitted_base().conditions.columns
    if "input_angle_rad" in columns:
        found.append(
            Plot(
                "spectrum",
                "Spectrum of the residual over orders",
                "Amplitude by the order of an input turn: kinematic errors have 2 and 4.",
                result.plot_spectrum,
            )
        )
    if isinstance(result, FittedModel):
        found.append(
            Plot(
                "correlations",
                "Correlations of the estimated parameters",
                "Near 1 or −1 the recordings determine only a combination of the two parameters.",
                result.plot_correlations,
            )
        )
    return found


def plot_html(plot: Plot, place: str) -> str:
    """Write a plot as part of a page; `place` is its id."""
    figure = plot.make()
    figure.update_layout(title=None, margin={"l": 60, "r": 20, "t": 20, "b": 50})
    drawn = json.loads(figure.to_json()) | {"config": CONFIG}
    data = json.dumps(drawn, separators=(",", ":")).replace("<", "\\u003c").replace("&", "\\u0026")
    return (
        f'<figure class="plot"><div class="chart" id="{place}" role="group" '
        f'aria-label="{escape(plot.title)}"></div>'
        f'<script type="application/json" id="{place}-data">{data}</script>'
        f"<figcaption><b>{escape(plot.title)}.</b> {escape(plot.caption)} Drag to zoom, click a "
        'run in the legend to hide it. <span class="files"><button type="button" '
        f'data-csv="{place}">numbers (CSV)</button></span></figcaption></figure>'
    )


@cache
def drawing_script() -> str:
    """Compressed Plotly, and the script that unpacks it and draws visible plots."""
    from plotly.offline import get_plotlyjs

    packed = base64.b64encode(gzip.compress(get_plotlyjs().encode(), 9, mtime=0)).decode()
    return (
        f'<script type="text/plain" id="plotly-packed">{packed}</script>'
        f"<script>{SCRIPT.read_text(encoding='utf-8')}</script>"
    )
