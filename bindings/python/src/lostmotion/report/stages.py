"""Figure of the staged take-up: teeth and the torques from which they carry load."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lostmotion.model import DesignModel
from lostmotion.report.charts import Chart
from lostmotion.report.gaps import BACKWARD, FORWARD
from lostmotion.report.page import PageTable
from lostmotion.report.svg import signs
from lostmotion.results import figures
from lostmotion.results.colours import SOFT
from lostmotion.units import ARCMIN

EVENTS_SHOWN = 14
"""Largest number of stages in the table on the page; the CSV has all."""


@dataclass(frozen=True)
class FlankEvent:
    """A pair of flanks begins or ceases to carry on the way up from rest."""

    torque_Nm: float
    rotation_arcmin: float
    angle_deg: float
    tooth: int
    side: int
    section: int
    joined: bool


@dataclass(frozen=True)
class Stages:
    """The take-up under rising positive torque.

    Attributes
    ----------
    at_rest : list of FlankEvent
        Preloaded pairs, as events at torque 0.
    events : list of FlankEvent
        In the order of occurrence.
    """

    name: str
    phase_rad: float
    rated_torque_Nm: float
    at_rest: list[FlankEvent]
    events: list[FlankEvent]
    limit_deg: float

    def carrying(self, torque_Nm: float) -> set[tuple[int, int, int]]:
        """Tooth, side and section of the pairs that carry at a torque."""
        found: set[tuple[int, int, int]] = set()
        for event in (*self.at_rest, *self.events):
            if event.torque_Nm <= torque_Nm:
                pair = (event.tooth, event.side, event.section)
                found.symmetric_difference_update({pair})
        return found

    def loaded(self, torque_Nm: float) -> list[tuple[int, int]]:
        """Tooth and side of the pairs that carry at a torque, in any section."""
        return sorted({(tooth, side) for tooth, side, _ in self.carrying(torque_Nm)})


def collect_stages(model: DesignModel, name: str, phase_rad: float = 0.0) -> Stages:
    """Follow the take-up up to twice the rated torque at a tooth phase of the wave generator."""
    c = model.core
    workspace = c.ffi.new("lm_design_workspace *")
    c.call(c.lib.lm_prepare_meshes, model.drive, c.lib.LM_NEUTRAL_LINE_NODES, workspace)
    torque = c.pointer(c.array([2.0 * model.rated_torque_Nm]))
    state = c.ffi.new("lm_mesh_state *")
    found = c.ffi.new("lm_contributions[]", 1)
    evaluated = (torque, 1, found, state, workspace)
    c.call(c.lib.lm_evaluate_torsion_curve, model.drive, phase_rad, *evaluated)
    take_up = workspace.take_up
    table = model.clearances(phase_rad)
    angles = np.degrees(table.angle_rad[table.section == 0])

    def event(contact: int, torque_Nm: float, angle_rad: float, joined: bool) -> FlankEvent:
        pair = workspace.contacts[contact]
        return FlankEvent(
            torque_Nm,
            angle_rad / ARCMIN,
            float(angles[pair.tooth]),
            pair.tooth,
            pair.side,
            pair.section,
            joined,
        )

    pairs = [i for i in range(state.pairs) if workspace.contacts[i].lobe == 0]
    at_rest = [event(i, 0.0, 0.0, True) for i in pairs if take_up.rest_force[i] > 0]
    events = [
        event(stage.contact, stage.torque_Nm, stage.angle_rad, bool(stage.joined))
        for stage in (take_up.stages[i] for i in range(take_up.stage_count))
        if workspace.contacts[stage.contact].lobe == 0
    ]
    return Stages(
        name,
        phase_rad,
        model.rated_torque_Nm,
        at_rest,
        events,
        float(np.degrees(model.drive.support.engagement_limit_rad)),
    )


def stages_figure(data: Stages) -> Chart:
    """Make the figure of the take-up."""
    rated = len(data.carrying(data.rated_torque_Nm))
    double = len(data.carrying(2.0 * data.rated_torque_Nm))
    caption = (
        "Each bar is a pair of flanks of one lobe, from the torque at which it begins to carry to "
        "the one at which it ceases; positive torque rising from rest, "
        f"tooth phase {np.degrees(data.phase_rad):.3g}°. {rated} pairs carry at rated torque, "
        f"{double} at twice that."
    )
    if data.at_rest:
        caption += f" {len(data.at_rest)} pairs carry without load: the mesh is preloaded."
    rows = [*data.at_rest, *data.events]
    return Chart(
        "stages",
        f"Stages of take-up of {data.name}",
        caption,
        lambda: [draw_stages(data)],
        {
            "torque_Nm": [e.torque_Nm for e in rows],
            "rotation_arcmin": [e.rotation_arcmin for e in rows],
            "tooth_angle_deg": [e.angle_deg for e in rows],
            "flank": ["forward" if e.side > 0 else "backward" for e in rows],
            "section": [e.section for e in rows],
            "event": ["begins" if e.joined else "ceases" for e in rows],
        },
    )


def draw_stages(data: Stages) -> Any:
    """Draw a bar for each pair over torque, placed by the angle of its tooth."""
    figure = figures.framed("", "torque on the output, N·m", "angle of the tooth, degrees", 400)
    reach = 2.0 * data.rated_torque_Nm
    pairs = {(e.tooth, e.side, e.section): e.angle_deg for e in (*data.at_rest, *data.events)}
    angles = list(pairs.values())
    # Pairs of one tooth lie side by side: a lane for each section and flank.
    lanes = sorted({(section, -side) for _, side, section in pairs})
    spacing = min((abs(a - b) for a in angles for b in angles if abs(a - b) > 1e-6), default=2.0)
    pitch_px = 300.0 * spacing / (np.ptp(angles) + 4.0 if angles else 1.0)
    lane = 0.84 / max(len(lanes), 1)
    for side, name, ink in ((1, "forward pair", FORWARD), (-1, "backward pair", BACKWARD)):
        x: list[float | None] = []
        y: list[float | None] = []
        for pair, angle in pairs.items():
            if pair[1] == side:
                shift = lanes.index((pair[2], -side)) - (len(lanes) - 1) / 2
                for start, end in _spells(data, pair, reach):
                    x += [start, end, None]
                    y += [angle + shift * lane * spacing] * 2 + [None]
        if x:
            figure.add_scatter(
                x=x,
                y=y,
                mode="lines+markers",
                name=name,
                line={"color": ink, "width": min(5.0, max(1.0, 0.72 * lane * pitch_px))},
                marker={"symbol": "line-ns-open", "size": 7, "color": ink},
            )
    figure.add_vline(
        x=data.rated_torque_Nm, line={"dash": "dot", "color": SOFT}, annotation_text="T<sub>N</sub>"
    )
    figure.update_xaxes(range=[0, 1.01 * reach])
    figure.update_layout(showlegend=bool(figure.data))
    return figure


def _spells(data: Stages, pair: tuple[int, int, int], reach: float) -> list[tuple[float, float]]:
    """Ranges of torque in which a pair carries load."""
    spells, since = [], None
    for event in (*data.at_rest, *data.events):
        if (event.tooth, event.side, event.section) == pair and event.torque_Nm <= reach:
            if since is None:
                since = event.torque_Nm
            else:
                spells.append((since, event.torque_Nm))
                since = None
    if since is not None:
        spells.append((since, reach))
    return spells


def stages_table(data: Stages) -> PageTable:
    """List the first stages."""
    events = [*data.at_rest, *data.events]
    rows = []
    carrying = 0
    for event in events[:EVENTS_SHOWN]:
        carrying += 1 if event.joined else -1
        rows.append(
            (
                f"{event.torque_Nm:.3f}",
                f"{event.rotation_arcmin:.4f}",
                signs(f"{event.angle_deg:+.2f}"),
                "forward" if event.side > 0 else "backward",
                "begins to carry" if event.joined else "ceases to carry",
                str(carrying),
            )
        )
    left = len(events) - len(rows)
    return PageTable(
        "Stages of take-up",
        (
            "torque, N·m",
            "mesh rotation, arcmin",
            "tooth, degrees",
            "flank",
            "event",
            "pairs that carry, a lobe",
        ),
        rows,
        (0, 1, 2, 5),
        f"Later stages are in the CSV of the figure above: {left}." if left else "",
    )
