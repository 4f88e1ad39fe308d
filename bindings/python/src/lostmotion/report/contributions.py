"""Figure of the torsion curve: deflection over torque and its five contributions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.catalogue import PARTS, REVERSAL_TORQUE_SHARE, Catalogue
from lostmotion.report.charts import Chart
from lostmotion.report.svg import signs
from lostmotion.report.wording import written
from lostmotion.results import figures
from lostmotion.results.colours import INK, SOFT
from lostmotion.units import ARCMIN

NAMES = {
    "radial_gap": "radial gap, eq. (8), (9)",
    "side_clearance": "side clearance, eq. (1)",
    "radial_compliance": "radial compliance, eq. (2)–(4)",
    "torsion": "torsion, eq. (5)",
    "tooth_bending": "tooth bending, eq. (6), (7)",
}
"""The contributions, with their names in the legend."""

FILLS = {
    "radial_gap": "#ee8866",
    "side_clearance": "#77aadd",
    "radial_compliance": "#44bb99",
    "torsion": "#eedd88",
    "tooth_bending": "#aa4499",
}
"""Paul Tol's light colours (and his wine), made for areas; neighbours are distinct for all types of
colour vision."""

ZOOM_SHARE = 0.1
"""Half width of the magnified part relative to the rated torque."""

CATALOGUE_INK = "#882255"

PICTURE_PX = 470
"""Height of the figures."""

LEGEND_PX = 110
"""Height of the names of the contributions below the first."""


@dataclass(frozen=True)
class Contributions:
    """A torsion curve for the figure; torques rise from minus to plus twice the rated torque.

    Attributes
    ----------
    torque_Nm : ndarray
        With a pair of equal torques next to zero, where free play causes a jump.
    parts_arcmin : mapping
        By the names of `PARTS`.
    rated_torque_Nm, reversal_torque_Nm : float
    engaged_teeth : ndarray or None
    """

    name: str
    torque_Nm: FloatArray
    parts_arcmin: Mapping[str, FloatArray]
    rated_torque_Nm: float
    reversal_torque_Nm: float
    engaged_teeth: FloatArray | None = None
    catalogue: Catalogue | None = None

    @property
    def total_arcmin(self) -> FloatArray:
        """Sum of the contributions."""
        return np.asarray(sum(self.parts_arcmin[part] for part in PARTS))

    def at(self, values: FloatArray, torque_Nm: float) -> float:
        """Interpolate a curve at a torque."""
        return float(np.interp(torque_Nm, self.torque_Nm, values))


def picture_torques(rated_Nm: float, ends: FloatArray | None = None) -> FloatArray:
    """Torques for the figure: dense around zero, with points very close to zero on both sides.

    Parameters
    ----------
    rated_Nm : float
    ends : ndarray, optional
        Torques that must be among them, such as T1 and T2 of a catalogue.
    """
    share = np.linspace(0.0, 1.0, 129)[1:]
    positive = 2.0 * rated_Nm * share**1.7
    must = [rated_Nm, REVERSAL_TORQUE_SHARE * rated_Nm, ZOOM_SHARE * rated_Nm, 1e-6 * rated_Nm]
    if ends is not None:
        must += [float(t) for t in ends if t <= 2.0 * rated_Nm]
    positive = np.unique(np.concatenate((positive, must)))
    return np.concatenate((-positive[::-1], [0.0], positive))


def contributions_figure(data: Contributions) -> Chart:
    """Make the figure of a torsion curve."""
    columns: dict[str, FloatArray] = {
        "torque_Nm": data.torque_Nm,
        "total_arcmin": data.total_arcmin,
    }
    columns |= {f"{part}_arcmin": data.parts_arcmin[part] for part in PARTS}
    if data.engaged_teeth is not None:
        columns["engaged_teeth_per_lobe"] = data.engaged_teeth
    lost = 2.0 * data.at(data.total_arcmin, data.reversal_torque_Nm)
    caption = (
        "One-sided deflection φ from the torque-free middle, input locked. The areas are the "
        "contributions, stacked from the axis outward; their sum is the black line. The second "
        "panel magnifies the part around zero. The reversal lost motion at "
        f"±{written(data.reversal_torque_Nm)} N·m (4 % of the rated torque) is {lost:.3f} arcmin."
    )
    if data.catalogue is not None:
        caption += " Dashed: the slopes of the catalogue, extended beyond their torque ranges."
    return Chart(
        "torsion_curve",
        f"Torsion curve of {data.name}",
        signs(caption),
        lambda: draw_contributions(data),
        columns,
        beside=2,
    )


def draw_contributions(data: Contributions) -> list[Any]:
    """Draw the whole torsion curve, and the part around zero."""
    reach = 2.0 * data.rated_torque_Nm
    whole = _areas(data, reach, named=True)
    rated = data.rated_torque_Nm
    value = data.at(data.total_arcmin, rated)
    whole.add_vline(
        x=rated, line={"dash": "dot", "color": SOFT}, annotation_text="rated torque T<sub>N</sub>"
    )
    figures.dots(whole, [rated], [value], INK)
    whole.add_annotation(
        x=rated, y=value, text=f"<b>{value:.2f}′</b>", showarrow=False, xanchor="left", yshift=-12
    )
    if data.catalogue is not None:
        _mark_slopes(whole, data.catalogue, reach)
    around = _areas(data, ZOOM_SHARE * rated, named=False)
    around.update_layout(title="around zero")
    whole.update_layout(height=PICTURE_PX + LEGEND_PX)
    _mark_reversal(around, data)
    return [whole, around]


def _areas(data: Contributions, reach: float, *, named: bool) -> Any:
    """Draw the contributions up to a torque, stacked from the axis outward, and their sum."""
    figure = figures.framed("", "torque on the output, N·m", "deflection φ, arcmin", PICTURE_PX)
    rated, whole = data.rated_torque_Nm, data.at(data.total_arcmin, data.rated_torque_Nm)
    figure.update_layout(title=f"at rated torque, {rated:g} N·m: {whole:.3f}′")
    inside = np.abs(data.torque_Nm) <= reach * (1 + 1e-12)
    torque = data.torque_Nm[inside]
    seen: set[str] = set()
    for side in (torque > 0, torque < 0):
        # Parts against the torque (preload adds stiffness) are stacked on the other side of zero.
        ends = {way: np.zeros(np.count_nonzero(side)) for way in (True, False)}
        sign = np.sign(torque[side])
        for part in PARTS:
            value = data.parts_arcmin[part][inside][side]
            along = np.where(value * sign >= 0, value, 0.0)
            for way, step in ((True, along), (False, value - along)):
                if np.any(step != 0):
                    at_rated = data.at(data.parts_arcmin[part], rated)
                    share = signs(f"{at_rated:.3f}′, {100 * at_rated / whole:.1f} %")
                    figures.area(
                        figure,
                        torque[side],
                        ends[way],
                        ends[way] + step,
                        FILLS[part],
                        f"{NAMES[part]}: {share}",
                        legendgroup=part,
                        showlegend=named and part not in seen,
                    )
                    seen.add(part)
                    ends[way] = ends[way] + step
    figures.line(figure, torque, data.total_arcmin[inside], INK, "sum" if named else "", width=2)
    return figure


def _mark_slopes(figure: Any, sheet: Catalogue, reach: float) -> None:
    """Mark T1 and T2, and extend each slope of the catalogue to make room for its name.

    K1 and K2 are extended upward, K3 back to the axis.
    """
    knots = (sheet.T1_Nm, sheet.T2_Nm)
    slopes = (sheet.K1_Nm_per_rad, sheet.K2_Nm_per_rad, sheet.K3_Nm_per_rad)
    origin = (0.0, *knots)
    ends = (sheet.T1_Nm + 0.2 * reach, sheet.T2_Nm + 0.22 * reach, 0.0)
    said = ["<b>catalogue</b>"]
    for i, slope in enumerate(slopes):
        x = np.array([origin[i], ends[i]])
        y = float(sheet.angle(origin[i])) / ARCMIN + (x - x[0]) / slope / ARCMIN
        figures.line(figure, x, y, CATALOGUE_INK, dash="dash")
        _name(figure, x[1], y[1], f"K<sub>{i + 1}</sub>", yshift=9)
        said.append(f"K<sub>{i + 1}</sub> = {written(slope / 1e3)}·10³ N·m/rad")
    for i, torque in enumerate(knots):
        angle = float(sheet.angle(torque)) / ARCMIN
        figures.line(figure, [torque, torque], [0, angle], CATALOGUE_INK, width=1, dash="dot")
        _name(figure, torque, 0.0, f"T<sub>{i + 1}</sub>", yshift=-10)
        said.append(f"T<sub>{i + 1}</sub> = {written(torque)} N·m")
    figure.add_annotation(
        x=0.02, y=0.98, xref="paper", yref="paper", text="<br>".join(said), align="left",
        showarrow=False, font={"color": CATALOGUE_INK, "size": 11},
    )  # fmt: skip


def _name(figure: Any, x: float, y: float, text: str, **more: Any) -> None:
    font = {"color": CATALOGUE_INK, "size": 12}
    figure.add_annotation(x=x, y=y, text=text, showarrow=False, font=font, **more)


def _mark_reversal(figure: Any, data: Contributions) -> None:
    """Draw the reversal lost motion as a dimension between its two torques."""
    torque = data.reversal_torque_Nm
    high, low = (data.at(data.total_arcmin, side * torque) for side in (1, -1))
    at = 0.75 * ZOOM_SHARE * data.rated_torque_Nm
    for end, value in ((torque, high), (-torque, low)):
        figures.line(figure, [end, 1.04 * at], [value, value], SOFT, width=1)
    figures.dots(figure, [torque, -torque], [high, low], INK, size=7, hollow=True)
    for tip, tail in ((high, low), (low, high)):
        figure.add_annotation(
            x=at, y=tip, ax=at, ay=tail, axref="x", ayref="y", text="", arrowhead=2, arrowsize=1.2
        )
    figure.add_annotation(
        x=at, y=0.0, yanchor="top", xanchor="right", showarrow=False, align="right", xshift=-4,
        text=f"reversal lost<br><b>motion {high - low:.3f}′</b><br>at ±{written(torque)} N·m",
    )  # fmt: skip
