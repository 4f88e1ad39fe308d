"""The report of a search: an interactive trade-off, the best drive, and why it is the best."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lostmotion.catalogue import PARTS
from lostmotion.design.engine import ARCMIN_PER_RAD, engine, figures, limit_names
from lostmotion.design.result import SearchResult, margin_unit, relaxation, rounded_up
from lostmotion.design.spec import Spec
from lostmotion.design.start import Start
from lostmotion.drives import Drive, format_toml, parse_drive, read_drive, tolerance_chain
from lostmotion.errors import LostMotionError
from lostmotion.files import write_whole
from lostmotion.model import DesignModel, design_model
from lostmotion.report import Section, drive_section
from lostmotion.report.charts import Chart, page_figure, script_json
from lostmotion.report.figure_data import Columns
from lostmotion.report.front import draw_front
from lostmotion.report.mesh import make_mesh
from lostmotion.report.page import (
    Block,
    Notes,
    PageTable,
    Raw,
    numbers_link,
    render,
)
from lostmotion.report.sources import file_fingerprint
from lostmotion.report.svg import Drawing, signs
from lostmotion.report.teeth import View, draw_view
from lostmotion.report.wording import unit_text, words, written
from lostmotion.results import figures as charts
from lostmotion.results.colours import BLUE, FAINT, ORANGE, RED
from lostmotion.results.page_figure import drawing_page
from lostmotion.structs import tolerance_links
from lostmotion.units import ARCMIN, split_unit

UNITS = {
    "arcmin": "arcmin",
    "Nm_per_rad": "N·m/rad",
    "arcsec": "arcsec",
    "1": "of fatigue strength",
    "units": "units",
}
"""Units of the figures, in words."""

PICTURES_MAX = 40
"""Number of designs of the front with a picture and a drive file; the others have only their
numbers."""

PICTURE_PX = (420.0, 150.0)
PICTURE_PITCHES = 11.0
"""Size of a picture, and number of teeth in it."""

LISTED_MAX = 400
"""Largest number of combinations listed on the page; the file has all."""

SHORTENED = 1e-9
"""Contributions to lost motion below this are not shown, arcmin."""


class Picture(NamedTuple):
    """The teeth of a design as SVG, and its drive file; empty if it has none on the page."""

    svg: str = ""
    toml: str = ""


@dataclass(frozen=True)
class Context:
    """Further inputs of a report.

    Attributes
    ----------
    starts : tuple of Start
        Textbook start unchanged, with its smallest gap closed, and also with the grades of the best
        design; empty if the model refuses it.
    torque_Nm : float
        Of the reversal.
    pictures : mapping
        Of designs of the front, by the names of their drives.
    """

    spec: Spec
    command: str
    seed: int
    evaluations: int
    budget: int
    torque_Nm: float
    starts: tuple[Start, ...]
    pictures: Mapping[str, Picture]


def write_search_report(result: SearchResult, context: Context) -> None:
    """Write ``report.html`` of a search."""
    title = f"Design search: {context.spec.name}"
    lead = f"Best designs found for {_listed(result)} within the ranges and limits of the spec."
    if result.best is None:
        sections = [_nothing_section(result, context)]
    else:
        drive = read_drive(result.folder / "best.toml")
        sections = [
            _front_section(result, context),
            _why_section(result, context, drive),
            drive_section(drive),
            _account_section(result, context),
        ]
        sections[2].title = "The best drive"
    sections[0].sources.append(
        (f"search spec {context.spec.file}", file_fingerprint(context.spec.file))
    )
    write_whole(result.folder / "report.html", render(title, lead, sections, context.command))


def _listed(result: SearchResult) -> str:
    names = [name.replace("_", " ") for name in result.objectives]
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]


def _unit(unit: str) -> str:
    return UNITS.get(unit, unit)


def _number(value: float) -> str:
    if not math.isfinite(value):
        return "–"
    return written(value, 5)


# --- the front ------------------------------------------------------------------------------------


def _front_section(result: SearchResult, context: Context) -> Section:
    ends = result.combinations
    first = result.front[0]["objectives"] if result.front else []
    facts = [
        (f"{name.replace('_', ' ')} of the best drive", f"{_number(value)} {_unit(unit)}")
        for name, value, unit in zip(result.objectives, first, result.units, strict=True)
    ]
    facts += [
        ("designs of the front", str(len(result.front))),
        ("evaluations", f"{context.evaluations} of {context.budget}"),
        ("seed", str(context.seed)),
        (
            "combinations",
            ", ".join(f"{n} {name.replace('_', ' ')}" for name, n in ends.items() if n),
        ),
    ]
    if result.refused:
        facts.append(("evaluations without a finite result, skipped", str(result.refused)))
    if not result.finished:
        facts.append(("state", "stopped; --resume continues it"))
    return Section(
        "The trade-off",
        "Every dot is a design that no other design of the search improves in every objective. "
        "Point at a dot to see the design; click to keep it.",
        facts,
        [Raw(explorer(result, context)), _history_figure(result)],
    )


def draw_drives(drives: Sequence[dict[str, Any] | None]) -> dict[str, Picture]:
    """Draw designs spread over a front; `drives` are all its drive files."""
    found = [drive for drive in drives if drive is not None]
    step = max(1, -(-len(found) // PICTURES_MAX))
    pictures = {}
    for drive in found[::step]:
        name, model = drive["drive"]["name"], _model(drive)
        pictures[name] = Picture(_close_up(model, name) if model else "", format_toml(drive))
    return pictures


def explorer(result: SearchResult, context: Context) -> str:
    """Return the part of the page that shows the front and the selected design."""
    designs = []
    values = []
    fields: dict[str, Values] = {}
    figure_labels = {name: f"{name.replace('_', ' ')}, {_unit(unit)}" for name, unit in figures()}
    labels = {name: f"{limit_name(name)}, {margin_unit(name)}" for name in limit_names()}
    for one in result.front:
        picture = context.pictures.get(one["drive"]["drive"]["name"], Picture())
        values.append(_values(one["drive"], fields))
        designs.append(
            {
                "o": one["objectives"],
                "verified": one["verified"],
                "values": values[-1],
                "figures": [[label, one["figures"][name]] for name, label in figure_labels.items()],
                "margins": [
                    [labels[name], margin]
                    for name, margin in one["margins"].items()
                    if margin != 1.0
                ],
                "svg": picture.svg,
                "toml": picture.toml,
            }
        )
    names = [
        {"name": name.replace("_", " "), "unit": _unit(unit)}
        for name, unit in zip(result.objectives, result.units, strict=True)
    ]
    start = None
    if context.starts:
        start = [context.starts[1].figures[name] for name in result.objectives]
    data = {"objectives": names, "designs": designs, "start": start}
    with drawing_page():
        drawn = page_figure(_trade_off(result, start))
    body = script_json(data)
    folder = files("lostmotion.design")
    style = (folder / "explorer.css").read_text(encoding="utf-8")
    script = (folder / "explorer.js").read_text(encoding="utf-8")
    choosers = ""
    if len(names) > 2:
        for k, place in enumerate(("across", "up")):
            options = "".join(
                f'<option value="{i}"{" selected" if i == k else ""}>{escape(n["name"])}</option>'
                for i, n in enumerate(names)
            )
            choosers += f"<label>{place} <select>{options}</select></label>"
    return (
        f"<style>{style}</style>"
        '<div class="explorer"><div>'
        f"{choosers}"
        '<div class="chart" id="front" role="group" tabindex="0" aria-label="trade-off" '
        f'style="height:{drawn["layout"]["height"]}px"></div>'
        f'<script type="application/json" id="front-data">{script_json(drawn)}</script>'
        '<p class="hint">Arrow keys go from design to design. Grey: tolerance grades not yet '
        f"rounded to whole ones. {numbers_link('front', _front_table(result, values))}"
        '</p></div><div class="drive"><noscript>Without scripts the designs are in front.csv.'
        f'</noscript></div><script type="application/json" class="designs">{body}</script></div>'
        f"<script>{script}</script>"
    )


def _trade_off(result: SearchResult, start: Sequence[float] | None) -> Any:
    """Draw the front: grey where grades are not yet whole, with the textbook start."""
    units = [_unit(unit) for unit in result.units]
    figure = draw_front([one["objectives"] for one in result.front], result.objectives, units)
    figure.update_traces(
        marker={"color": [BLUE if one["verified"] else FAINT for one in result.front]},
        selected={"marker": {"color": ORANGE, "size": 13}},
        unselected={"marker": {"opacity": 1}},
        selector={"mode": "markers"},
    )
    if start is not None:
        i, j = 0, min(1, len(start) - 1)
        figure.add_scatter(
            x=[start[i]],
            y=[start[j]],
            name="textbook start",
            mode="markers",
            marker={"symbol": "square-open", "size": 11, "color": RED},
            showlegend=True,
        )
    return figure


Values = list[tuple[str, Any]]


def _front_table(result: SearchResult, values: Sequence[Values]) -> Columns:
    columns: dict[str, list[object]] = {"design": list(range(1, len(result.front) + 1))}
    for name, unit in figures():
        columns[f"{name}_{unit}"] = [one["figures"][name] for one in result.front]
    rows = [dict(one) for one in values]
    for key in rows[0] if rows else ():
        columns[key] = [row.get(key, "") for row in rows]
    return columns


def _values(drive: Mapping[str, Any], fields: dict[str, Values]) -> Values:
    """List the dimensions of a drive that a designer requires first; `fields` is for `_fields`."""
    design = drive["design"]
    teeth, generator, rim = design["teeth"], design["generator"], design["flexspline"]
    out: Values = [
        ("ratio", drive["drive"]["ratio"]),
        ("module, mm", teeth["module_mm"]),
        ("teeth", f"{teeth['flexspline_teeth']} / {teeth['rigid_teeth']}"),
        ("pressure angle, deg", math.degrees(teeth["pressure_angle_rad"])),
        ("shift x₁", teeth["flexspline_shift"]),
        ("shift x₂", teeth["rigid_shift"]),
        ("tooth height, modules", teeth["tooth_height"]),
        ("engagement depth, modules", teeth["engagement_depth"]),
        ("face width, mm", teeth["face_width_mm"]),
        ("generator", generator["type"]),
        ("deflection w₀, mm", generator["deflection_mm"]),
        *(
            [("contact half angle, deg", math.degrees(generator["contact_half_angle_rad"]))]
            if "contact_half_angle_rad" in generator
            else []
        ),
        ("rim, mm", rim["rim_thickness_mm"]),
        ("wall, mm", rim["wall_thickness_mm"]),
    ]
    return out + _fields(drive, fields)


def _fields(drive: Mapping[str, Any], known: dict[str, Values]) -> Values:
    """List the fields of the tolerances.

    They depend on the entries, the module and the numbers of teeth alone, which many designs of a
    front share: `known` keeps them.
    """
    teeth = drive["design"]["teeth"]
    basis = (teeth["module_mm"], teeth["flexspline_teeth"], teeth["rigid_teeth"])
    key = repr((drive["design"].get("tolerance"), *basis))
    if key not in known:
        chain = tolerance_chain("", drive["design"])
        known[key] = [
            (f"field of {entry.label}, µm", 1e3 * link.upper_mm - 1e3 * link.lower_mm)
            for entry, link in zip(chain, tolerance_links("", chain), strict=False)
        ]
    return known[key]


def _model(document: Mapping[str, Any]) -> DesignModel | None:
    """Model of a drive file; none if it refuses the drive."""
    try:
        return design_model(parse_drive(dict(document)))
    except LostMotionError:
        return None


def _links(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Tolerances of a drive file, one per link; empty if the model refuses the drive."""
    model = _model(document)
    return model.tolerance_budget() if model else []


def _close_up(model: DesignModel, name: str) -> str:
    """Draw the teeth at the deformation axis, to scale."""
    try:
        mesh = make_mesh(model)
        g = mesh.geometry
    except LostMotionError:
        return ""
    width, height = PICTURE_PX
    drawing = Drawing(width, height + 26, f"teeth of {name}")
    middle = (max(g.rigid_tip_mm, g.flexspline_tip_mm) + g.neutral_mm) / 2
    middle += (0.35 if not mesh.external else -0.8) * g.module_mm
    scale = width / (PICTURE_PITCHES * math.pi * g.module_mm)
    view = View((2.0, 22.0, width - 4, height), scale, 0.0, middle)
    draw_view(drawing, mesh, (), view, "teeth at the deformation axis, to scale")
    return drawing.render()


def _history_figure(result: SearchResult) -> Chart:
    with (result.folder / "history.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    at = np.array([float(row["evaluations"]) for row in rows])
    # Before the first feasible design there is no best one: its cell is empty.
    best = np.array([float(row["best"] or math.nan) for row in rows])
    name, unit = result.objectives[0], result.units[0]
    if result.larger_is_better[0]:
        best = ARCMIN_PER_RAD / best
    found = np.isfinite(best)

    def draw() -> list[Any]:
        figure = charts.framed("", "evaluations", f"{words(name)}, {_unit(unit)}", 250)
        charts.line(figure, at[found], best[found], BLUE, width=1.8)
        return [figure]

    return Chart(
        "history",
        "Progress of the search",
        f"The best {name.replace('_', ' ')} over the number of evaluations. It may rise at the "
        "end, where tolerance grades are rounded to whole ones and gaps are also checked "
        "between the angles.",
        draw,
        {"evaluations": at, f"best_{unit}": best},
    )


# --- comparison with the textbook design ----------------------------------------------------------


def _why_section(result: SearchResult, context: Context, drive: Drive) -> Section:
    blocks: list[Block] = []
    facts: list[tuple[str, str]] = []
    seen = result.certificate or {}
    if context.starts and result.front:
        blocks.append(_start_table(result, context.starts))
        blocks.append(_parts_table(context, drive))
        facts += _gain(result, context.starts)
    blocks += [_limits_table(seen), _levels_table(result, seen)]
    if drive.document["design"].get("tolerance"):
        blocks.append(_shares_figure(result, seen))
    word = "every limit holds" if seen.get("holds") else "NOT every limit holds"
    facts.append(("verified on a finer grid", word))
    facts.append(("distance from a smooth optimum", written(float(seen["optimality_residual"]))))
    return Section(
        "Why this design",
        "The best drive compared with a textbook design, its active limits, and the effect of "
        "its tolerances. The numbers come from a finer evaluation than that of the search: 8 "
        "tooth phases, 32 angles per tooth, 8 × 2¹⁴ sampled drives.",
        facts,
        blocks,
    )


def _gain(result: SearchResult, starts: tuple[Start, ...]) -> list[tuple[str, str]]:
    best = result.front[0]["figures"]
    start = starts[1].figures
    facts = []
    for name in ("tolerance_lost_motion", "lost_motion"):
        was, now = start[name], best[name]
        facts.append(
            (
                f"{name.replace('_', ' ')}, textbook to best",
                signs(f"{was:.3f} to {now:.3f} arcmin ({100 * (now / was - 1):+.0f} %)"),
            )
        )
    was, now = start["stress"], best["stress"]
    facts.append(("stress, textbook to best", f"{was:.3f} to {now:.3f} of fatigue strength"))
    halved = best["tolerance_lost_motion"] <= 0.5 * start["tolerance_lost_motion"]
    facts.append(
        (
            "lost motion over the tolerances",
            ("at least halved" if halved else "not halved: see its contributions")
            + (", stress no higher" if now <= was else ", stress higher"),
        )
    )
    return facts


def _start_table(result: SearchResult, starts: tuple[Start, ...]) -> PageTable:
    best = result.front[0]
    rows = []
    for name, unit in figures():
        values = [*(start.figures[name] for start in starts), best["figures"][name]]
        change = f"{100 * (values[-1] / values[1] - 1):+.1f} %" if values[1] else "–"
        label = f"{name.replace('_', ' ')}, {_unit(unit)}"
        rows.append((label, *(_number(v) for v in values), signs(change)))
    for name in ("gap_min_arcmin", "form_radius"):
        margins = [*(start.margins[name] for start in starts), best["margins"][name]]
        rows.append(
            (
                f"margin of {limit_name(name)}, {margin_unit(name)}",
                *(("!" if m < 0 else "") + signs(f"{m:.4f}") for m in margins),
                "",
            )
        )
    links = [link["name"] for link in _links(best["drive"])]
    for key in best["variables"]:
        values = [*(start.values[key] for start in starts), best["variables"][key]]
        rows.append((variable_name(key, links), *(_number(v) for v in values), ""))
    return PageTable(
        "Textbook start and best",
        ("", "textbook", "gap closed", "and grades of the best", "best", "closed to best"),
        rows,
        (1, 2, 3, 4, 5),
        "All have the teeth and the wave generator of the best drive and were evaluated in the "
        "same way. A negative margin means that the textbook drive violates the limit. Grades "
        "without a recommendation are IT 7; the column with the grades of the best drive shows "
        "the difference that remains with equal grades.",
    )


def variable_name(key: str, links: Sequence[str]) -> str:
    """Name a variable of the search: part, quantity and unit."""
    part, _, name = key.rpartition(".")
    if part.startswith("tolerance."):
        place = int(part.partition(".")[2])
        return f"tolerance of {links[place]}: {words(name)}"
    stem, unit = split_unit(name)
    symbol = unit_text(unit.symbol) if unit is not None else ""
    if stem.endswith("_modules"):
        stem, symbol = stem.removesuffix("_modules"), "modules"
    return f"{words(part)}: {words(stem)}" + (f", {symbol}" if symbol else "")


def _parts_of(drive: Drive, torque_Nm: float) -> dict[str, float]:
    curve = design_model(drive).torsion_curve(np.array([-torque_Nm, torque_Nm]))
    return {part: float(np.diff(curve.parts_rad[part])[0]) / ARCMIN for part in PARTS}


def _parts_table(context: Context, drive: Drive) -> PageTable:
    torque = context.torque_Nm
    first = _parts_of(parse_drive(context.starts[1].drive), torque)
    best = _parts_of(drive, torque)
    rows = []
    for part in PARTS:
        change = f"{best[part] - first[part]:+.3f}"
        values = [f"{v:.3f}" if abs(v) > SHORTENED else "0" for v in (first[part], best[part])]
        rows.append((part.replace("_", " "), *(signs(v) for v in values), signs(change)))
    total = [sum(parts.values()) for parts in (first, best)]
    rows.append(("all", *(f"{v:.3f}" for v in total), signs(f"{total[1] - total[0]:+.3f}")))
    wind = best["torsion"] + best["radial_compliance"] + best["tooth_bending"]
    share = 100 * wind / total[1] if total[1] > 0 else 0.0
    gap = 100 * best["radial_gap"] / total[1] if total[1] > 0 else 0.0
    return PageTable(
        f"Where the lost motion of a reversal at ±{torque:.3g} N·m comes from, arcmin",
        ("part", "textbook, gap closed", "best", "change"),
        rows,
        (1, 2, 3),
        f"{share:.0f} % of the remaining lost motion is elastic: it decreases with stiffness, "
        "not with clearance. "
        f"{gap:.0f} % is the mean radial gap from tolerances: it decreases with finer grades. "
        "The tooth shape reduces neither.",
    )


def limit_name(name: str) -> str:
    """Name a limit without the unit of its value in the spec; its margin has a different one."""
    return words(split_unit(name)[0])


def _limits_table(seen: Mapping[str, Any]) -> PageTable:
    rows = []
    for limit in seen["limits"]:
        if not limit["stated"]:
            continue
        margin = limit["margin"]
        rows.append(
            (
                limit_name(limit["name"]),
                ("!" if margin < 0 else "") + signs(f"{margin:+.5f}"),
                margin_unit(limit["name"]),
                "binds" if limit["binds"] else "",
                _number(limit["multiplier"]) if limit["multiplier"] else "",
            )
        )
    gap = seen["smallest_gap"]
    return PageTable(
        "Limits, margins and prices",
        ("limit", "margin", "unit", "", "price"),
        rows,
        (1, 4),
        "The price is the decrease of the first objective per unit by which the limit is "
        "relaxed. The "
        f"smallest side clearance, {gap['gap_arcmin']:.4f} arcmin, is at "
        f"{signs(format(gap['angle_deg'], '.2f'))}° from the deformation axis.",
    )


def _levels_table(result: SearchResult, seen: Mapping[str, Any]) -> PageTable:
    lost = seen["lost_motion_arcmin"]
    searched = seen["figures_as_searched"]["tolerance_lost_motion_arcmin"]
    fine = seen["figures"]["tolerance_lost_motion_arcmin"]
    rows = [
        ("worst case, all links at their unfavourable limits", f"{lost['worst']:.4f}", ""),
        ("probable, root of the sum of squares", f"{lost['probable']:.4f}", ""),
        (
            "99.73 % of sampled drives stay below",
            f"{lost['quantile_9973']:.4f}",
            f"{lost['quantile_9973_standard_error']:.4f}",
        ),
        (
            "half of the sampled drives stay below",
            f"{lost['median']:.4f}",
            f"{lost['median_standard_error']:.4f}",
        ),
    ]
    away = 100 * (searched / lost["quantile_9973"] - 1) if lost["quantile_9973"] else 0.0
    samples = engine()[1].LM_LOOP_SAMPLES
    return PageTable(
        "Lost motion of a reversal over the tolerances, arcmin",
        ("level", "arcmin", "standard error"),
        rows,
        (1, 2),
        f"The search minimised {searched:.4f} arcmin (finer: {fine:.4f}) at the level of its spec. "
        + signs(f"That is {away:+.1f} % from the quantile of 8 × 2¹⁴ samples; ")
        + f"inside the search the quantile is taken over {samples} fixed samples.",
    )


def _shares_figure(result: SearchResult, seen: Mapping[str, Any]) -> Chart:
    assert result.best is not None
    links = _links(result.best)
    names = [link["name"] for link in links]
    worst = [float(share["worst"] or 0) for share in seen["tolerance_percent"]]
    probable = [float(share["probable"] or 0) for share in seen["tolerance_percent"]]

    def draw() -> list[Any]:
        figure = charts.framed("", "share, %", "", 100 + 46 * len(names))
        for name, ink, shares in (("worst case", BLUE, worst), ("probable", ORANGE, probable)):
            figure.add_bar(
                x=shares,
                y=list(range(len(names))),
                orientation="h",
                name=name,
                marker={"color": ink},
                text=[f"{value:.1f} %" for value in shares],
                textposition="outside",
                cliponaxis=False,
            )
        charts.names_above(figure, names)
        figure.update_layout(bargap=0.5)
        figure.update_xaxes(range=[0, 1.2 * max([*worst, *probable, 1.0])])
        return [figure]

    return Chart(
        "tolerance_shares",
        "What each tolerance contributes to the radial gap",
        "Share of the width between the limits (worst case) and of the variance (probable).",
        draw,
        {
            "tolerance": names,
            "lower_um": [link["lower_um"] for link in links],
            "upper_um": [link["upper_um"] for link in links],
            "influence": [link["influence"] for link in links],
            "worst_percent": worst,
            "probable_percent": probable,
        },
    )


# --- summary --------------------------------------------------------------------------------------


def _combination_lines(folder: Path) -> list[str]:
    with (folder / "combinations.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    lines = []
    for row in rows[:LISTED_MAX]:
        by = row.pop("pruned_by")
        fate = row.pop("fate")
        values = ", ".join(f"{key.rpartition('.')[2]} {value}" for key, value in row.items())
        why = f" by {by.replace('_', ' ')}" if by else ""
        lines.append(f"{values or 'the only one'}: {fate}{why}")
    if len(rows) > LISTED_MAX:
        lines.append(f"and {len(rows) - LISTED_MAX} more in combinations.csv")
    return lines


def _account_section(result: SearchResult, context: Context) -> Section:
    return Section(
        "Summary of the search",
        "Examined combinations and default values. Solved: searched to convergence. Dominated: "
        "worse than others in a preliminary search, which is not a proof. Pruned: excluded by "
        "a limit. Not reached: the budget was used up.",
        [],
        _account(result, context),
    )


def _account(result: SearchResult, context: Context) -> list[Block]:
    lines = _combination_lines(result.folder)
    blocks: list[Block] = [
        Notes(f"Result of every combination: {len(lines)}", lines, len(lines) > 12)
    ]
    if result.assumed:
        blocks.append(
            Notes(
                "Default values that the spec does not state",
                [f"{key} = {value}" for key, value in result.assumed.items()],
            )
        )
    return blocks


def _nothing_section(result: SearchResult, context: Context) -> Section:
    rows: Sequence[Sequence[str]] = [
        (limit_name(limit["limit"]), rounded_up(relaxation(limit)[0]), relaxation(limit)[1])
        for limit in (result.infeasible or {}).get("relax", [])
    ]
    blocks: list[Block] = []
    if rows:
        blocks.append(
            PageTable(
                "Limits to be relaxed",
                ("limit", "by", "unit"),
                rows,
                (1,),
                "The evaluated point with the smallest sum of relative violations: relaxing all of "
                "these limits makes it feasible. It is in nearest.csv; start_from in [search] "
                "starts from it. Stresses, clearances and contacts that no limit of the spec sets "
                "require wider ranges or other fixed values instead.",
            )
        )
    blocks += _account(result, context)
    state = "No design" if result.finished else "No design yet"
    lead = f"{state} within the ranges keeps every limit. {result.note}".strip()
    return Section("Nothing found", lead, [("seed", str(context.seed))], blocks)
