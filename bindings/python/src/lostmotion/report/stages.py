"""Figure of the staged take-up: teeth and the torques from which they carry load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lostmotion.model import DesignModel
from lostmotion.report.chart import Axes
from lostmotion.report.gaps import BACKWARD, FORWARD
from lostmotion.report.page import Figure, FigureData, PageTable
from lostmotion.report.svg import PAPER, SMALL_SIZE, SOFT, Drawing, signs, text_width
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
    fault = c.fault()
    nodes = c.lib.LM_NEUTRAL_LINE_NODES
    c.check(c.lib.lm_prepare_meshes(model.drive, nodes, workspace, fault), fault)
    torque = c.array([2.0 * model.rated_torque_Nm])
    found = c.ffi.new("lm_contributions[]", 1)
    state = c.ffi.new("lm_mesh_state *")
    c.check(
        c.lib.lm_evaluate_torsion_curve(
            model.drive, phase_rad, c.pointer(torque), 1, found, state, workspace, fault
        ),
        fault,
    )
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


def stages_figure(data: Stages) -> Figure:
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
    return Figure(
        f"Stages of take-up of {data.name}",
        caption,
        lambda width: draw_stages(data, width),
        FigureData(
            "stages",
            {
                "torque_Nm": [e.torque_Nm for e in rows],
                "rotation_arcmin": [e.rotation_arcmin for e in rows],
                "tooth_angle_deg": [e.angle_deg for e in rows],
                "flank": ["forward" if e.side > 0 else "backward" for e in rows],
                "section": [e.section for e in rows],
                "event": ["begins" if e.joined else "ceases" for e in rows],
            },
        ),
    )


def draw_stages(data: Stages, width: float) -> str:
    """Draw a bar for each pair over torque, placed by the angle of its tooth."""
    wide = width > 600
    left, right, top = 52.0, 14.0, 50.0
    height = 290.0 if wide else 250.0
    drawing = Drawing(
        width, top + height + 44, f"Stages of take-up of {data.name}: teeth that carry by torque"
    )
    reach = 2.0 * data.rated_torque_Nm
    pairs = {(e.tooth, e.side, e.section): e.angle_deg for e in (*data.at_rest, *data.events)}
    angles = list(pairs.values()) or [0.0]
    low = 10.0 * np.floor((min(angles) - 2.0) / 10.0)
    high = 10.0 * np.ceil((max(angles) + 2.0) / 10.0)
    axes = Axes(drawing, (left, top, width - left - right, height), (0.0, reach), (low, high))
    axes.frame(
        "torque on the output, N·m", "angle of the tooth, degrees", ticks=(width / 110, height / 45)
    )
    at = float(axes.x(data.rated_torque_Nm))
    drawing.line((at, top, at, top + height), SOFT, 1.0, "2 3")
    drawing.text(at + 5, top + 12, "T_{N}", size=SMALL_SIZE, fill=SOFT, halo=True)
    # Pairs of one tooth are side by side: one lane per section and flank.
    lanes = sorted({(section, -side) for _, side, section in pairs})
    spacing = min((abs(a - b) for a in angles for b in angles if abs(a - b) > 1e-6), default=2.0)
    pitch = abs(float(axes.y(0.0)) - float(axes.y(spacing)))
    lane = 0.84 * pitch / max(len(lanes), 1)
    thick = min(5.0, max(0.8, 0.72 * lane))
    for (tooth, side, section), angle in pairs.items():
        ink = FORWARD if side > 0 else BACKWARD
        shift = lanes.index((section, -side)) - (len(lanes) - 1) / 2
        y = float(axes.y(angle)) + shift * lane
        for start, end in _spells(data, (tooth, side, section), reach):
            x0, x1 = float(axes.x(start)), float(axes.x(end))
            fill = ink if side > 0 or thick < 2.5 else PAPER
            drawing.rectangle(x0, y - thick / 2, max(x1 - x0, 0.8), thick, fill, ink)
            drawing.line((x0, y - thick / 2 - 1.0, x0, y + thick / 2 + 1.0), ink, 1.6)
    x = width - right
    for name, ink, fill, side in (
        ("backward pair", BACKWARD, PAPER, -1),
        ("forward pair", FORWARD, FORWARD, 1),
    ):
        if any(one == side for _, one, _ in pairs):
            drawing.text(x, 16, name, size=SMALL_SIZE, anchor="end")
            x -= text_width(name, SMALL_SIZE) + 30
            drawing.rectangle(x, 9, 20, 6, fill, ink)
            x -= 20
    return drawing.render()


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
