"""Figure of the tolerance limits of the radial gap and the resulting lost motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from lostmotion.report.charts import Chart
from lostmotion.results import figures
from lostmotion.results.colours import BLUE


@dataclass(frozen=True)
class Tolerances:
    """Limits of the radial gap in um, by ``worst_min`` and so on.

    Attributes
    ----------
    mean_um : float
        Radial gap of a drive with all parts in the middle of their fields.
    arcmin_per_um : float
        Lost motion in one direction per closed gap, equation (9).
    """

    name: str
    limits_um: Mapping[str, float]
    mean_um: float
    arcmin_per_um: float


def tolerances_figure(data: Tolerances) -> Chart:
    """Make the figure of the tolerance limits."""
    limits, scale = data.limits_um, data.arcmin_per_um
    kinds = ("worst", "probable")
    caption = (
        "Radial gap on the deformation axis that the tolerances allow (lower axis) and the "
        "lost motion that it causes in one direction, eq. (9) (upper axis); the reversal lost "
        "motion is twice that. "
        "Worst case: all links at their limits, eq. (10), (11). Probable: 99.73 % of all drives, "
        "by the distributions of the links. With every part in the middle of its field the gap is "
        f"{data.mean_um:.2f} µm; that is the drive of the torsion curve above."
    )
    return Chart(
        "tolerances",
        f"Tolerance limits of {data.name}",
        caption,
        lambda: [draw_tolerances(data)],
        {
            "limit": list(kinds),
            "gap_min_um": [limits[f"{kind}_min"] for kind in kinds],
            "gap_max_um": [limits[f"{kind}_max"] for kind in kinds],
            "lost_motion_min_arcmin": [limits[f"{kind}_min"] * scale for kind in kinds],
            "lost_motion_max_arcmin": [limits[f"{kind}_max"] * scale for kind in kinds],
        },
    )


def draw_tolerances(data: Tolerances) -> Any:
    """Draw both ranges as bars on two axes: the gap, and the lost motion that it causes."""
    figure = figures.framed("", "radial gap, µm", "", 250)
    for kind, name, fill in (("worst", "worst case", "#cfe3f3"), ("probable", "probable", BLUE)):
        low, high = (data.limits_um[f"{kind}_{end}"] for end in ("min", "max"))
        figure.add_bar(
            x=[high - low],
            base=[low],
            y=[name],
            orientation="h",
            width=0.5,
            marker={"color": fill, "line": {"color": BLUE, "width": 1}},
            hovertemplate=f"{name}: {low:.2f} to {high:.2f} µm, {low * data.arcmin_per_um:.3f} to "
            f"{high * data.arcmin_per_um:.3f} arcmin<extra></extra>",
            showlegend=False,
        )
    figure.add_vline(
        x=data.mean_um, line={"dash": "dash", "width": 1.2}, annotation_text="middle of the fields"
    )
    end = 1.08 * max(*data.limits_um.values(), data.mean_um)
    scale = data.arcmin_per_um
    # A second axis is only drawn for a trace of its own.
    figure.add_scatter(x=[0.0], y=["probable"], xaxis="x2", opacity=0, hoverinfo="skip")
    figure.update_layout(
        showlegend=False,
        margin={"t": 70},
        xaxis={"range": [0, end]},
        xaxis2={
            "overlaying": "x",
            "side": "top",
            "tickmode": "auto",
            "range": [0, end * scale],
            "title": "lost motion in one direction, arcmin",
        },
        yaxis={"autorange": "reversed", "showgrid": False},
    )
    return figure
