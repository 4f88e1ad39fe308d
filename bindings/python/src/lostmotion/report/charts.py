"""Charts of a report: Plotly figures with title, caption and the numbers behind them.

The figures are those of the result in Python. A page contains Plotly compressed, and unpacks it
when the first chart becomes visible.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lostmotion.errors import InputError
from lostmotion.report.figure_data import Columns
from lostmotion.results.page_figure import PageFigure, drawing_page
from lostmotion.threads import begin

if TYPE_CHECKING:
    from lostmotion.discover.whitened_result import WhitenedResult

SCRIPT = Path(__file__).with_name("charts.js")

HOW = "Drag to zoom, double-click to reset; click a name in the legend to hide it."
"""Use of a chart, at the end of its caption."""


@dataclass(frozen=True)
class Chart:
    """Plotly figures under one title.

    Attributes
    ----------
    name : str
        Short, for menus and the names of files.
    title, caption : str
        Content and reading instructions, plain text.
    make : callable
        Returns the Plotly figures.
    columns : mapping, optional
        The numbers behind them; by default those that are drawn.
    beside : int
        How many of the figures are side by side on a wide page.
    """

    name: str
    title: str
    caption: str
    make: Callable[[], Sequence[Any]]
    columns: Columns | None = None
    beside: int = 1

    def figures(self) -> list[dict[str, Any]]:
        """Return the figures as Plotly's JSON, with the settings of a page."""
        with drawing_page():
            made = list(self.make())
        found = []
        for figure in made:
            if len(made) == 1:  # the caption has the title
                figure.update_layout(title=None)
            found.append(page_figure(figure))
        return found


CONFIG = {"responsive": True, "displayModeBar": False, "plotlyServerURL": ""}
"""Plotly configuration of a chart; no data are sent from the page."""


def page_figure(figure: Any) -> dict[str, Any]:
    """Return a Plotly figure as JSON, with the settings of a page."""
    drawn: dict[str, Any] = (
        figure.to_plotly_json() if isinstance(figure, PageFigure) else json.loads(figure.to_json())
    )
    return drawn | {"config": CONFIG}


def plots_of(result: WhitenedResult) -> list[Chart]:
    """Return the plots for judging the residual of a result."""
    from lostmotion.discover.fitted_model import FittedModel  # reports of drawings need no SciPy

    found = [
        Chart(
            "time",
            "Residual against time",
            "Drift, steps and warm-up appear as a trend within the runs.",
            lambda: [result.plot_residuals("time_s")],
        ),
        Chart(
            "fit",
            "Residual against the fit",
            "A residual that curves over the fitted lost motion indicates a wrong form of the "
            "model.",
            lambda: [result.plot_residuals("model_arcmin")],
        ),
        Chart(
            "predicted",
            "Measured against predicted",
            "By run; a run off the line of equality has a different stiffness or gap.",
            lambda: [result.plot_predicted()],
        ),
    ]
    if result.whitened():
        found += [
            Chart(
                "autocorrelation",
                "Autocorrelation of the whitened residual",
                "The residual after whitening by its autoregression. Bars outside the band (95 %) "
                "are correlation that the noise model does not describe.",
                lambda: [result.plot_autocorrelation()],
            ),
            Chart(
                "quantiles",
                "Normal quantiles of the whitened residual",
                "Gaussian noise lies on the line; deviating ends are outliers or a rare effect.",
                lambda: [result.plot_normal()],
            ),
        ]
    columns = result.fitted_base().conditions.columns
    if "input_angle_rad" in columns:
        found.append(
            Chart(
                "spectrum",
                "Spectrum of the residual over orders",
                "Amplitude by the order of an input turn: kinematic errors have 2 and 4.",
                lambda: [result.plot_spectrum()],
            )
        )
    if isinstance(result, FittedModel):
        found.append(
            Chart(
                "correlations",
                "Correlations of the estimated parameters",
                "Near 1 or −1 the recordings determine only a combination of the two parameters.",
                lambda: [result.plot_correlations()],
            )
        )
    return found


IN_SCRIPT = {c: f"\\u{ord(c):04x}" for c in "<>&\u2028\u2029"}
"""JSON escapes for characters that may end a script element or line, or open a comment."""


def script_json(data: object) -> str:
    """Return data as JSON that is safe in a script element for any texts.

    The escaped characters occur in JSON only inside texts.
    """
    text = json.dumps(data, separators=(",", ":"), ensure_ascii=False)
    for character, code in IN_SCRIPT.items():
        text = text.replace(character, code)
    return text


def chart_html(chart: Chart, place: str, number: str, links: str = "") -> str:
    """Write a chart as part of a page.

    Parameters
    ----------
    place : str
        The id of the chart; its figures add their number.
    number : str
        Text before the title.
    links : str
        Link to the numbers, as HTML; without it the page's script writes them.
    """
    drawn = []
    for i, figure in enumerate(chart.figures()):
        one = f"{place}-{i}"
        drawn.append(
            f'<div class="chart" id="{one}" role="group" aria-label="{escape(chart.title)}" '
            f'style="height:{figure["layout"]["height"]:.0f}px"></div>'
            f'<script type="application/json" id="{one}-data">{script_json(figure)}</script>'
        )
    numbers = links or f'<button type="button" data-csv="{place}">numbers (CSV)</button>'
    return (
        f'<figure class="plot"><div class="charts beside{chart.beside}">{"".join(drawn)}</div>'
        f"<figcaption><b>{number}{escape(chart.title)}.</b> {escape(chart.caption)} {HOW} "
        f'<span class="files">{numbers}'
        f'<button type="button" data-svg="{place}">picture (SVG)</button></span>'
        "</figcaption></figure>"
    )


PACKED = 5
"""Level of compression: the highest one takes twice as long, for a page that is 0.7 % smaller."""


@cache
def begin_packing() -> Callable[[], str]:
    """Begin to compress Plotly for a page, beside the calling thread; returns it in base64."""
    return begin(_pack)


def _pack() -> str:
    spec = find_spec("plotly")  # its script is read without loading its modules
    if spec is None or spec.origin is None:
        raise InputError("--report", "", "no Plotly", "pip install plotly")
    script = Path(spec.origin).with_name("package_data") / "plotly.min.js"
    return base64.b64encode(gzip.compress(script.read_bytes(), PACKED, mtime=0)).decode()


@cache
def drawing_script() -> str:
    """Compressed Plotly, and the script that unpacks it and draws visible charts."""
    packed = begin_packing()()
    return (
        "<noscript><p>The charts need scripts; their numbers are in the CSV links.</p></noscript>"
        f'<script type="text/plain" id="plotly-packed">{packed}</script>'
        f"<script>{SCRIPT.read_text(encoding='utf-8')}</script>"
    )
