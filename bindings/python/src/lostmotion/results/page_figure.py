"""Figures of a page: Plotly's JSON, written without the classes of Plotly.

Those check every value. For the figures of a page, whose code is tested, loading and checking would
take longer than all other work on the page.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partialmethod
from typing import Any

import numpy as np
import numpy.typing as npt

SHORT_NAMES = {"float32": "f4", "float64": "f8"}
"""Types of packed numbers in Plotly's JSON."""

ON_PAGE: ContextVar[bool] = ContextVar("ON_PAGE", default=False)


@contextmanager
def drawing_page() -> Iterator[None]:
    """Within this, new figures are a `PageFigure` instead of a ``plotly.graph_objects.Figure``."""
    before = ON_PAGE.set(True)
    try:
        yield
    finally:
        ON_PAGE.reset(before)


class PageFigure:
    """A figure as Plotly's JSON.

    It has the methods of ``plotly.graph_objects.Figure`` that the figures of this package use, for
    the same arguments except names joined by underscores.

    Parameters
    ----------
    layout : mapping
    shares : sequence of float, optional
        Heights of charts above each other, from the top; by default there is one.
    gap : float
        Height between these charts.
    """

    def __init__(
        self, layout: Mapping[str, Any], shares: Sequence[float] = (), gap: float = 0.0
    ) -> None:
        self.data: list[dict[str, Any]] = []
        self.layout = as_json(layout)
        low = 0.0
        for row, share in reversed(list(enumerate(shares, 1))):
            height = (1.0 - gap * (len(shares) - 1)) * share / sum(shares)
            x, y = axes_of(row)
            last, _ = axes_of(len(shares))
            shared = {} if x == last else {"matches": last, "showticklabels": False}
            self.layout[layout_name(x)] = {"anchor": y, "domain": [0.0, 1.0], **shared}
            self.layout[layout_name(y)] = {"anchor": x, "domain": [low, low + height]}
            low += height + gap

    def add(self, kind: str, row: int | None = None, col: int = 1, **properties: Any) -> None:
        """Add a trace; `col` is always the first."""
        at = {} if row is None else dict(zip(("xaxis", "yaxis"), axes_of(row), strict=True))
        self.data.append({**as_json(properties), "type": kind, **at})

    add_bar = partialmethod(add, "bar")
    add_heatmap = partialmethod(add, "heatmap")
    add_scatter = partialmethod(add, "scatter")
    add_scattergl = partialmethod(add, "scattergl")

    def add_annotation(self, row: int | None = None, col: int = 1, **properties: Any) -> None:
        """Add a text or an arrow, in the coordinates of a chart unless it states others."""
        at = {} if row is None else dict(zip(("xref", "yref"), axes_of(row), strict=True))
        self.layout.setdefault("annotations", []).append(at | as_json(properties))

    def add_shape(self, **properties: Any) -> None:
        """Add a line or a rectangle."""
        self.layout.setdefault("shapes", []).append(as_json(properties))

    def add_vline(
        self,
        x: float,
        row: int | None = None,
        col: int = 1,
        annotation_text: str | None = None,
        **properties: Any,
    ) -> None:
        """Add a line over the whole height, with a text to the right of its upper end."""
        across, up = axes_of(row or 1)
        at: dict[str, Any] = {"xref": across, "yref": f"{up} domain"}
        self.add_shape(type="line", x0=x, x1=x, y0=0, y1=1, **at, **properties)
        if annotation_text is not None:
            place: dict[str, Any] = {"x": x, "y": 1, "xanchor": "left", "yanchor": "top"}
            self.add_annotation(text=annotation_text, showarrow=False, **place, **at)

    def add_hline(
        self,
        y: float,
        row: int | None = None,
        col: int = 1,
        annotation_text: str | None = None,
        **properties: Any,
    ) -> None:
        """Add a line over the whole width, with a text above its right end."""
        across, up = axes_of(row or 1)
        at: dict[str, Any] = {"xref": f"{across} domain", "yref": up}
        self.add_shape(type="line", x0=0, x1=1, y0=y, y1=y, **at, **properties)
        if annotation_text is not None:
            place: dict[str, Any] = {"x": 1, "y": y, "xanchor": "right", "yanchor": "bottom"}
            self.add_annotation(text=annotation_text, showarrow=False, **place, **at)

    def add_vrect(self, row: int | None = None, col: int = 1, **properties: Any) -> None:
        """Add an area over the whole height, from `x0` to `x1`."""
        across, up = axes_of(row or 1)
        self.add_shape(type="rect", y0=0, y1=1, xref=across, yref=f"{up} domain", **properties)

    def add_hrect(self, row: int | None = None, col: int = 1, **properties: Any) -> None:
        """Add an area over the whole width, from `y0` to `y1`."""
        across, up = axes_of(row or 1)
        self.add_shape(type="rect", x0=0, x1=1, xref=f"{across} domain", yref=up, **properties)

    def update_layout(self, **properties: Any) -> None:
        """Change properties of the layout; those of nested ones that are not named remain."""
        merge(self.layout, properties)

    def update_axes(
        self, way: str, row: int | None = None, col: int = 1, **properties: Any
    ) -> None:
        """Change all axes of one way, or that of one chart."""
        every = [name for name in self.layout if name.startswith(f"{way}axis")] or [f"{way}axis"]
        names = every if row is None else [layout_name(axes_of(row)[way == "y"])]
        for name in names:
            merge(self.layout.setdefault(name, {}), properties)

    update_xaxes = partialmethod(update_axes, "x")
    update_yaxes = partialmethod(update_axes, "y")

    def update_traces(self, selector: Mapping[str, Any], **properties: Any) -> None:
        """Change the traces whose properties include those of `selector`."""
        for trace in self.data:
            if selector.items() <= {k: trace.get(k) for k in selector}.items():
                merge(trace, properties)

    def to_plotly_json(self) -> dict[str, Any]:
        """Return the figure as JSON."""
        return {"data": self.data, "layout": self.layout}


def axes_of(row: int) -> tuple[str, str]:
    """Names of the axes of a chart, in traces."""
    number = "" if row == 1 else str(row)
    return f"x{number}", f"y{number}"


def layout_name(axis: str) -> str:
    """Name of an axis in the layout."""
    return f"{axis[0]}axis{axis[1:]}"


def merge(into: dict[str, Any], properties: Mapping[str, Any]) -> dict[str, Any]:
    """Set properties, of nested ones those that are named; None removes one."""
    for name, value in properties.items():
        if name == "title" and isinstance(value, str):
            value = {"text": value}
        if value is None:
            into.pop(name, None)
        elif isinstance(value, Mapping):
            merge(into.setdefault(name, {}), value)
        else:
            into[name] = _value(value)
    return into


def as_json(properties: Mapping[str, Any]) -> dict[str, Any]:
    """Return properties as JSON."""
    return merge({}, properties)


def _value(value: Any) -> Any:
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, Mapping):
        return as_json(value)
    if isinstance(value, np.ndarray):
        return packed(value)
    if isinstance(value, (float, np.generic)):
        number = value.item() if isinstance(value, np.generic) else value
        return None if isinstance(number, float) and not math.isfinite(number) else number
    return [_value(item) for item in value]


def packed(values: npt.NDArray[Any]) -> Any:
    """Return an array as Plotly's JSON: fractional numbers in base64, anything else as a list."""
    short = SHORT_NAMES.get(str(values.dtype))
    if short is None or values.size == 0:
        return [_value(value) for value in values.tolist()]
    found = {"dtype": short, "bdata": base64.b64encode(values.tobytes()).decode()}
    if values.ndim > 1:
        found["shape"] = ", ".join(map(str, values.shape))
    return found
