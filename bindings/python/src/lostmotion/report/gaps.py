"""Figure of the side clearances around the gear."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.model import Clearances, DesignModel
from lostmotion.report.charts import Chart
from lostmotion.report.mesh import make_mesh
from lostmotion.report.svg import signs
from lostmotion.results import figures
from lostmotion.results.colours import BLUE, ORANGE, RED, SOFT
from lostmotion.units import ARCMIN

FORWARD, BACKWARD = BLUE, ORANGE

LOBES = (0.0, 180.0)
"""Angles of the two lobes, which are equal."""

ROOM = 1.7
"""Height of the picture relative to the widest gap of a closing flank: the other flank of the far
teeth opens to ten times that gap and is cut off."""


@dataclass(frozen=True)
class Flank:
    """Gaps of one flank of one lobe in one axial section, by rising angle."""

    section: int
    angle_deg: FloatArray
    gap_arcmin: FloatArray
    radius_mm: FloatArray


@dataclass(frozen=True)
class Gaps:
    """Side clearances for the figure, one lobe; the other is identical half a turn on.

    Attributes
    ----------
    forward, backward : list of Flank
        One per axial section.
    limit_deg : float
        Only teeth within this angle of the axis can carry load.
    """

    name: str
    axis: str
    phase_rad: float
    table: Clearances
    forward: list[Flank]
    backward: list[Flank]
    limit_deg: float
    rigid_tip_mm: float

    def smallest(self) -> tuple[float, float, str]:
        """Smallest gap in arcmin, its angle in deg and its flank."""
        found = (np.inf, 0.0, "forward")
        for name, flanks in (("forward", self.forward), ("backward", self.backward)):
            for flank in flanks:
                at = int(np.argmin(flank.gap_arcmin))
                if flank.gap_arcmin[at] < found[0] - 1e-9:
                    found = (float(flank.gap_arcmin[at]), float(flank.angle_deg[at]), name)
        return found

    def interfering(self) -> int:
        """Number of flanks of one lobe that interfere."""
        return sum(
            int(np.count_nonzero(flank.gap_arcmin < 0)) for flank in self.forward + self.backward
        )


def collect_gaps(model: DesignModel, name: str, phase_rad: float = 0.0) -> Gaps:
    """Compute the clearances of all teeth of a design at a tooth phase of the wave generator."""
    table = model.clearances(phase_rad)
    sides: list[list[Flank]] = []
    for gap, radius in (
        (table.forward_rad, table.forward_radius_mm),
        (table.backward_rad, table.backward_radius_mm),
    ):
        flanks = []
        for section in range(model.sections):
            rows = (table.section == section) & np.isfinite(gap)
            flanks.append(
                Flank(
                    section,
                    np.degrees(table.angle_rad[rows]),
                    gap[rows] / ARCMIN,
                    np.asarray(radius[rows]),
                )
            )
        sides.append(flanks)
    mesh = make_mesh(model)
    return Gaps(
        name,
        "minor axis" if mesh.external else "major axis",
        phase_rad,
        table,
        sides[0],
        sides[1],
        float(np.degrees(model.drive.support.engagement_limit_rad)),
        float(mesh.geometry.rigid_tip_mm),
    )


def gaps_figure(data: Gaps) -> Chart:
    """Make the figure of the side clearances."""
    table = data.table
    gap, angle, flank = data.smallest()
    interfering = data.interfering()
    caption = (
        f"Rotation of the output until a flank touches, unloaded, against the angle of the tooth "
        f"from the {data.axis} of the wave generator; tooth phase "
        f"{np.degrees(data.phase_rad):.3g}°, "
        f"and the other lobe is the same. "
        f"Each dot is a tooth; dotted: ±{data.limit_deg:.0f}°, within which teeth can carry. "
        f"The {flank} flank at {angle:+.1f}° is the nearest: {gap:.3f} arcmin."
    )
    caption += (
        f" {interfering} flanks of a lobe interfere (below zero)."
        if interfering
        else " No flank interferes (none is below zero)."
    )
    caption += " Wider gaps are not drawn; the CSV has them all."
    radii = [
        np.where(r > 0, r, np.nan) for r in (table.forward_radius_mm, table.backward_radius_mm)
    ]
    if len(data.forward) > 1:
        caption += (
            f" One curve per axial section, {len(data.forward)} from the cup's edge of the teeth "
            "to "
            "the open end."
        )
    return Chart(
        "clearances",
        f"Side clearances of {data.name}",
        signs(caption),
        lambda: [draw_gaps(data)],
        {
            "section": [int(s) for s in table.section],
            "angle_deg": np.degrees(table.angle_rad),
            "forward_arcmin": table.forward_rad / ARCMIN,
            "backward_arcmin": table.backward_rad / ARCMIN,
            "forward_contact_radius_mm": radii[0],
            "backward_contact_radius_mm": radii[1],
        },
    )


def draw_gaps(data: Gaps) -> Any:
    """Draw gaps above contact radii over one angle axis."""
    angle_name = f"angle from the {data.axis}, degrees"
    ys = ("side clearance, arcmin", "contact radius, mm")
    figure = figures.stacked("", angle_name, ys, (0.72, 0.28), 560)
    low, high = min(-0.1 * _upper(data), 1.4 * data.smallest()[0]), _upper(data)
    figure.add_annotation(
        x=-88, y=low, text="interference", font={"color": RED}, showarrow=False,
        xanchor="left", yanchor="bottom", row=1, col=1,
    )  # fmt: skip
    figure.add_hrect(
        y0=low, y1=0, fillcolor="#fbe4df", line={"width": 0}, layer="below", row=1, col=1
    )
    for lobe, edge in itertools.product(LOBES, (-data.limit_deg, data.limit_deg)):
        figure.add_vline(x=lobe + edge, line={"dash": "dot", "color": SOFT}, row=1, col=1)
    for name, flanks, ink in (
        ("forward: closes for torque > 0", data.forward, FORWARD),
        ("backward: closes for torque < 0", data.backward, BACKWARD),
    ):
        for lobe, flank in itertools.product(LOBES, flanks):
            angle, gap = flank.angle_deg + lobe, flank.gap_arcmin
            shown = (flank.section, lobe) == (flanks[0].section, LOBES[0])
            one: dict[str, Any] = {"legendgroup": name, "showlegend": False}
            figures.line(figure, angle, gap, ink, width=1, row=1, **one)
            marks: dict[str, Any] = {**one, "hollow": ink == BACKWARD}
            figures.dots(
                figure, angle, gap, ink, name, size=5, row=1, **marks | {"showlegend": shown}
            )
            bad = gap < 0
            if bad.any():
                figures.dots(figure, angle[bad], gap[bad], RED, size=6, row=1, **one)
            figures.dots(figure, angle, flank.radius_mm, ink, size=4, row=2, **marks)
    least, place, _ = data.smallest()
    ring = RED if least < 0 else SOFT
    figures.dots(figure, [place], [least], ring, size=13, row=1, symbol="circle-open")
    figure.add_annotation(
        x=place, y=least, text=signs(f"{least:.3f}′ at {place:+.1f}°"), ax=50, ay=24, row=1, col=1
    )
    figure.add_hline(
        y=data.rigid_tip_mm, line={"dash": "dash", "color": SOFT}, row=2, col=1,
        annotation_text="tip of the rigid gear",
    )  # fmt: skip
    figure.update_yaxes(range=[low, high], row=1, col=1)
    figure.update_xaxes(range=[-90, 270], dtick=45)
    return figure


def _upper(data: Gaps) -> float:
    """Top of the figure: the widest gap of the closing flank, with margin."""
    widest = 0.0
    for ahead, back in zip(data.forward, data.backward, strict=True):
        angles = np.intersect1d(np.round(ahead.angle_deg, 9), np.round(back.angle_deg, 9))
        one = np.interp(angles, ahead.angle_deg, ahead.gap_arcmin)
        other = np.interp(angles, back.angle_deg, back.gap_arcmin)
        near = np.abs(angles) <= data.limit_deg
        if near.any():
            widest = max(widest, float(np.max(np.minimum(one, other)[near])))
    return ROOM * widest if widest > 0 else 1.0
