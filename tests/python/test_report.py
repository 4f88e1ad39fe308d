"""Reports: contents, the numbers behind the pictures, and no external resources."""

from __future__ import annotations

import base64
import csv
import dataclasses
import gzip
import io
import itertools
import json
import math
import re
import xml.etree.ElementTree as ET
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import unquote

import numpy as np
import pytest
import tomllib
from hypothesis import given
from hypothesis import strategies as st
from shapely.affinity import rotate
from shapely.geometry import Point, Polygon
from small_campaigns import DRIVE, campaign, gap, ripple

from conftest import DATA
from lostmotion.catalogue import PARTS
from lostmotion.cli import main
from lostmotion.compare import Comparison, compare
from lostmotion.discover import diagnose
from lostmotion.discover.answer import Diagnosis
from lostmotion.discover.fitted_model import FittedModel, fit_model
from lostmotion.drives import Drive, format_toml, parse_drive, read_drive
from lostmotion.model import design_model, make_torsion_curve
from lostmotion.predict import predict
from lostmotion.recordings import Campaign, Run, read_campaign
from lostmotion.report import (
    comparison_section,
    diagnosis_section,
    drive_section,
    fit_section,
    write_report,
)
from lostmotion.report.charts import Chart, script_json
from lostmotion.report.evidence import covariate_of
from lostmotion.report.figure_data import numbers_csv
from lostmotion.report.gear_profiles import gear_profile
from lostmotion.report.ladder import draw_ladder
from lostmotion.report.mesh import (
    first_touches,
    make_mesh,
    touch_place,
)
from lostmotion.report.overlay import Overlay
from lostmotion.report.page import (
    NARROW,
    WIDE,
    Figure,
    PageTable,
    Section,
    rows_html,
)
from lostmotion.report.placed_teeth import flexspline_shape, rigid_shape
from lostmotion.report.stages import collect_stages
from lostmotion.report.svg import abridged, signs, simplify
from lostmotion.report.wording import with_zeros
from lostmotion.units import ARCMIN, ARCSEC

DRIVES = DATA / "drives"
LOOPS = DATA / "cycloidal_locked_output"
SVG = "{http://www.w3.org/2000/svg}"

LABELS = {
    "size_25": (
        "torque on the output, N·m",
        "deflection φ, arcmin",
        "reversal lost",
        "rated torque",
        "catalogue",
    ),
    "reference_a": (
        "torque on the output, N·m",
        "deflection φ, arcmin",
        "side clearance, arcmin",
        "contact radius, mm",
        "angle from the major axis, degrees",
        "interference",
        "radial distances ×10",
        "2 mm",
        "angle of the tooth, degrees",
        "radial gap, µm",
        "lost motion in one direction, arcmin",
    ),
    "external_ring": (
        "angle from the minor axis, degrees",
        "ring, outside",
        "minor axis upright",
    ),
    "cycloid": (
        "lost motion, arcmin",
        "residual, arcmin",
        "measured",
        "model",
        "share of the residual variance, %",
        "time in the run, s",
    ),
    "found": (
        "rms, arcsec (grey: noise floor ",
        "+ thermal gap",
        "with the added effects",
        "residual, arcsec",
        "temperature, °C",
        "added, rising",
        "gain of a run, nats",
        "1 ",
    ),
    "unexplained": ("torque, N·m", "arcsec", "baseline, falling"),
    "fitted": (
        "rms, arcsec (grey: noise floor ",
        "+ thermal gap",
        "residual, arcsec",
        "temperature, °C",
    ),
    "turning fitted": ("wave generator angle, °", "arcmin"),
    "turning compared": ("4 runs, ", "torque on the output, N·m"),
}
"""Texts that the pictures of each section must contain."""


@cache
def drive_of(name: str) -> Drive:
    return read_drive(DRIVES / f"{name}.toml")


@cache
def measured() -> tuple[Drive, Comparison]:
    drive = read_drive(LOOPS / "drive.toml")
    campaign = read_campaign([LOOPS], ratio=drive.ratio, mapping=drive.columns)
    return drive, compare(make_torsion_curve(drive, campaign.largest_torque_Nm), campaign)


@cache
def discovered(kind: str) -> tuple[Drive, Diagnosis | FittedModel]:
    """Diagnose or fit recordings with a gap that opens with temperature, or with a ripple."""
    drive = parse_drive(tomllib.loads(DRIVE))
    data = campaign(add=ripple if kind == "unexplained" else gap)
    if kind == "fitted":
        return drive, fit_model(drive, data, ["thermal_gap"])
    return drive, diagnose(None, data, ratio=drive.ratio, rated_torque_Nm=drive.rated_torque_Nm)


@cache
def turning() -> tuple[Drive, Campaign]:
    """Loops, and runs that turn under a load, in files with long names as from loggers."""
    data = campaign(add=lambda columns, _: 6.0 * np.cos(2 * columns["input_angle"]))
    random = np.random.default_rng(3)
    for load in (-25.0, 0.0, 25.0, 40.0):
        turned = np.concatenate((np.linspace(0, 90, 400), np.linspace(90, 0, 400)))
        torque = load + 0.01 * random.normal(size=800)
        seconds = (
            7.0 * load
            + 25.0 * np.tanh(load / 8.0)
            + 6.0 * np.cos(2 * turned)
            + random.normal(size=800)
        )
        columns = {
            "time": 0.1 * np.arange(800),
            "torque": torque,
            "temperature": np.full(800, 22.0),
            "input_angle": turned,
            "output_angle": turned / 100,
            "lost_motion": seconds * ARCSEC,
        }
        data.runs.append(Run("", "made.csv", columns))
    for number, run in enumerate(data.runs):
        run.label = f"2024-08-08__13-{number:02d}-25__torqueramp_onyx_80Nm"
    return parse_drive(tomllib.loads(DRIVE)), data


@cache
def section_of(name: str) -> Section:
    if name.startswith("turning"):
        drive, data = turning()
        drive = dataclasses.replace(drive, file=str(LOOPS / "drive.toml"))
        if name == "turning fitted":
            model = fit_model(drive, data, ["kinematic_error"])
            return fit_section(drive, model, [])
        torsion_curve = make_torsion_curve(drive, data.largest_torque_Nm)
        return comparison_section(drive, compare(torsion_curve, data), [])
    if name in ("found", "unexplained", "fitted"):
        drive, result = discovered(name)
        # A drive that was not read from a file has no fingerprint.
        drive = dataclasses.replace(drive, file=str(LOOPS / "drive.toml"))
        if isinstance(result, Diagnosis):
            return diagnosis_section(drive, result, [])
        return fit_section(drive, result, [])
    if name == "cycloid":
        drive, result = measured()
        return comparison_section(drive, result, [LOOPS / "base_onyx_runin5.csv"])
    return drive_section(drive_of(name))


def figures(name: str) -> list[Figure | Chart]:
    """Figures of a section, without the residual plots, whose numbers a script writes."""
    blocks = section_of(name).blocks
    return [
        block
        for block in blocks
        if isinstance(block, (Figure, Chart)) and block.columns is not None
    ]


def charts(name: str) -> list[Chart]:
    return [figure for figure in figures(name) if isinstance(figure, Chart)]


DRAWINGS = [
    pytest.param(name, width, id=f"{name}-{width:.0f}")
    for name in ("reference_a", "external_ring")
    for width in (WIDE, NARROW)
]
"""Drawings to scale: the teeth."""


def drawing(name: str) -> Figure:
    (found,) = (figure for figure in figures(name) if isinstance(figure, Figure))
    return found


class Page(HTMLParser):
    """A parsed page: attributes with links, its elements and its text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[tuple[str, str]] = []
        self.downloads: dict[str, list[str]] = {}
        self.tags: list[str] = []
        self.words: list[str] = []
        self.feed(text)
        self.text = " ".join(self.words)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.tags.append(tag)
        for name in ("src", "href", "xlink:href", "action", "data", "poster", "srcset"):
            if values.get(name) is not None:
                self.links.append((name, values[name] or ""))
        if "download" in values:
            name = (values["download"] or "").removesuffix(".gz")
            self.downloads.setdefault(name, []).append(values["href"] or "")

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    def table(self, name: str, number: int = 0) -> dict[str, list[str]]:
        # In the order of the page, of which large tables are compressed.
        head, data = self.downloads[name][number].split(",", 1)
        if head == "data:application/gzip;base64":
            text = gzip.decompress(base64.b64decode(data)).decode()
        else:
            assert head == "data:text/csv;charset=utf-8"
            text = unquote(data)
        rows = list(csv.reader(io.StringIO(text)))
        return {column: [row[i] for row in rows[1:]] for i, column in enumerate(rows[0])}


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    sections = [section_of(name) for name in LABELS]
    write_report(path, "Four drives", "Everything at once.", sections, "lostmotion demo -o demo")
    return path


@pytest.fixture(scope="module")
def page(report: Path) -> Page:
    return Page(report.read_text(encoding="utf-8"))


# --- the pictures --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", LABELS)
def test_every_axis_and_mark_is_labelled(name):
    said = [one.caption + json.dumps(one.figures(), ensure_ascii=False) for one in charts(name)]
    said += [one.draw(WIDE) for one in figures(name) if isinstance(one, Figure)]
    text = " ".join(said)
    for expected in LABELS[name]:
        assert expected in text


@pytest.mark.parametrize("name", LABELS)
def test_a_chart_has_a_size_and_names_in_its_legend_and_sends_nothing(name):
    for chart in charts(name):
        for figure in chart.figures():
            assert figure["layout"]["height"] > 100
            assert figure["config"]["plotlyServerURL"] == ""
            shown = [trace for trace in figure["data"] if trace.get("showlegend")]
            assert all(trace["name"] for trace in shown)


def unpacked(entry: dict[str, object]) -> object:
    """Write packed numbers of a figure as lists, and leave out what is empty."""
    if "bdata" not in entry:
        return {key: value for key, value in entry.items() if value != {}}
    values = np.frombuffer(base64.b64decode(str(entry["bdata"])), str(entry["dtype"]))
    return values.reshape(
        [int(n) for n in str(entry.get("shape", values.size)).split(",")]
    ).tolist()


@pytest.mark.parametrize("name", LABELS)
def test_a_figure_of_a_page_is_that_of_plotly(name):
    for chart in charts(name):
        drawn = chart.figures()
        for figure, checked in zip(drawn, chart.make(), strict=True):
            if len(drawn) == 1:  # the caption has the title
                checked.update_layout(title=None)
            del figure["config"]
            sorted_texts = [
                json.dumps(json.loads(text, object_hook=unpacked), sort_keys=True)
                for text in (json.dumps(figure), checked.to_json())
            ]
            assert sorted_texts[0] == sorted_texts[1]


def test_runs_under_one_torque_are_drawn_over_the_angle_in_which_they_turn() -> None:
    drive, data = turning()
    model = fit_model(drive, data, ["kinematic_error"])
    before = model.base.copy()
    before.terms, before.additives = [], []
    overlay = Overlay(before, model.base, 1.0, "small")
    names = [name for _, name in overlay.across]
    assert names.count("wave generator angle, °") == 4
    assert names.count("torque, N·m") == 2
    for (angle, name), pieces, measured in zip(
        overlay.across, overlay.pieces, overlay.measured, strict=True
    ):
        assert sorted(np.concatenate(pieces)) == list(range(measured.size))
        if name == "wave generator angle, °":
            # One piece per direction, each along the turn.
            assert len(pieces) == 2
            assert all(np.all(np.diff(angle[piece]) >= 0) for piece in pieces)
            expected = 0.1 * np.cos(np.deg2rad(2 * angle))
            rest = measured - measured.mean() - expected
            assert np.std(rest) < 0.03


MEAN_CHARACTER = 0.54
"""Mean width of a character relative to the font size."""


def text_width(text: str, size: float) -> float:
    """Estimate how wide a text is."""
    return MEAN_CHARACTER * size * len(re.sub(r"[_{}]", "", text))


def texts(svg: ET.Element) -> list[tuple[float, float, float, float]]:
    """Boxes of the texts of a picture, from the estimated width of their letters."""
    boxes = []
    for element in svg.iter(f"{SVG}text"):
        words = "".join(element.itertext()).replace("\u200b", "")
        size = float(element.get("font-size", "13"))
        x, y, wide = float(element.get("x", "0")), float(element.get("y", "0")), 0.0
        wide = text_width(words, size)
        x -= {"start": 0.0, "middle": wide / 2, "end": wide}[element.get("text-anchor", "start")]
        boxes.append((x, y - 0.75 * size, x + wide, y + 0.2 * size))
    return boxes


@pytest.mark.parametrize(("name", "width"), DRAWINGS)
def test_no_text_is_cut_off_or_covers_another(name, width):
    svg = ET.fromstring(drawing(name).draw(width))
    height = float(svg.get("height", "0"))
    boxes = texts(svg)
    assert boxes
    for x0, y0, x1, y1 in boxes:
        assert x0 >= -4
        assert x1 <= width + 4
        assert y0 >= -2
        assert y1 <= height + 2
    for i, a in enumerate(boxes):
        for b in boxes[:i]:
            across = min(a[2], b[2]) - max(a[0], b[0])
            down = min(a[3], b[3]) - max(a[1], b[1])
            assert across < 4 or down < 3, (a, b)


@pytest.mark.parametrize(("name", "width"), DRAWINGS)
def test_pictures_are_complete_in_themselves(name, width):
    svg = ET.fromstring(drawing(name).draw(width))
    assert svg.tag == f"{SVG}svg"
    assert svg.find(f"{SVG}title").text
    assert "font-family" in svg.attrib
    for element in svg.iter():
        assert not {"class", "id", "href", "style"} & set(element.attrib)


def test_areas_of_the_contributions_end_at_the_total():
    whole, _ = charts("reference_a")[0].make()
    areas = [trace for trace in whole.data if trace.fill == "toself"]
    assert len({trace.legendgroup for trace in areas}) == len(PARTS)
    (total,) = (trace for trace in whole.data if trace.name == "sum")
    for side in (np.max, np.min):
        edge = max(areas, key=lambda trace: abs(side(trace.y)))
        assert side(edge.y) == pytest.approx(side(total.y), rel=1e-5)


@pytest.mark.parametrize("name", ["reference_a", "external_ring"])
@pytest.mark.parametrize("phase_deg", [0.0, 0.6])
def test_drawn_teeth_touch_after_the_clearance_that_the_library_gives(name, phase_deg):
    phase = math.radians(phase_deg)
    model = design_model(drive_of(name))
    mesh = make_mesh(model, phase)
    rigid_profile, own_profile = (gear_profile(mesh, gear) for gear in ("rigid", "flexspline"))

    def touches_a_fillet(touch) -> bool:
        # Both references reach into the root fillets, which are no flanks for the library.
        polar, radius, normal = mesh.place(touch.angle_rad)
        axis = np.array([math.sin(normal), math.cos(normal)])
        height = touch_place(mesh, touch) @ axis - radius * math.cos(normal - polar)
        return any(
            (at - gear.form_radius_mm) * (gear.tip_mm - gear.form_radius_mm) < 0
            for at, gear in (
                (touch.radius_mm, rigid_profile),
                (height + mesh.geometry.neutral_mm, own_profile),
            )
        )

    checked = 0
    for touch in first_touches(model, [], phase):
        if abs(touch.angle_rad) > math.radians(45) or touch.gap_rad > 6 * ARCMIN:
            continue
        if touches_a_fillet(touch):
            continue
        around = [touch.angle_rad + k * mesh.pitch for k in (-1, 0, 1)]
        toothed, free = flexspline_shape(mesh, around)
        flexspline = Polygon(np.concatenate((toothed, free[::-1]))).buffer(0)
        toothed, edge = rigid_shape(mesh, around)
        rigid = Polygon(np.concatenate((toothed, edge[::-1]))).buffer(0)
        # A neighbouring tooth may touch first: only the points near this tooth's contact count.
        place = touch_place(mesh, touch)
        near = Point(place).buffer(0.12 * mesh.geometry.module_mm)
        assert Point(place).distance(rigid.boundary) < 1e-4

        def overlap(turn_rad: float, body=flexspline, rigid=rigid, near=near) -> float:
            # Positive angles are clockwise in the picture.
            moved = rotate(body, -turn_rad, origin=(0, 0), use_radians=True)
            return moved.intersection(near).intersection(rigid).area

        slack = 0.03 * ARCMIN  # straight pieces of the drawn flanks
        assert overlap(touch.side * (touch.gap_rad - slack)) < 1e-9
        assert overlap(touch.side * (touch.gap_rad + slack)) > 0
        checked += 1
    assert checked > 40


@given(
    st.lists(st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)), min_size=2, max_size=80),
    st.floats(0.05, 20),
)
def test_simplified_curves_stay_within_the_slack(points, slack):
    full = np.array(points)
    kept = simplify(full, slack)
    assert len(kept) <= len(full)
    assert np.array_equal(kept[[0, -1]], full[[0, -1]])
    ends = list(itertools.pairwise(kept))
    for point in full:
        nearest = math.inf
        for a, b in ends:
            d = b - a
            along = np.clip((point - a) @ d / max(d @ d, 1e-300), 0, 1)
            nearest = min(nearest, float(np.hypot(*(point - a - along * d))))
        assert nearest <= slack * (1 + 1e-9) + 1e-9


def test_numbers_in_drawings_carry_true_signs():
    assert signs("at -1.5° of size-20 (-2 to +3)") == "at −1.5° of size-20 (−2 to +3)"


# --- the numbers behind them ---------------------------------------------------------------------


@pytest.mark.parametrize("name", LABELS)
def test_numbers_behind_each_picture_survive_the_way_through_csv(name, page):
    order = list(LABELS)
    for figure in figures(name):
        earlier = sum(
            1
            for other in order[: order.index(name)]
            for f in figures(other)
            if f.name == figure.name
        )
        read = page.table(f"{figure.name}.csv", earlier)
        assert list(read) == list(figure.columns)
        for column, values in figure.columns.items():
            expected = np.asarray(values)
            if expected.dtype.kind == "f":
                found = np.array([float(v) if v else np.nan for v in read[column]])
                expected = np.where(np.isfinite(expected), expected, np.nan)
                np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-15)
            else:
                assert read[column] == [str(value) for value in values]


def test_torsion_curve_of_the_page_is_that_of_predict(page):
    drive = drive_of("reference_a")
    read = page.table("torsion_curve.csv", 1)
    torque = np.array(read["torque_Nm"], dtype=float)
    # Written to ten digits, torques near zero differ.
    answer = predict(drive, torque)
    total = np.array(read["total_arcmin"], dtype=float)
    np.testing.assert_allclose(total, answer["total_arcmin"], rtol=1e-6, atol=1e-9)
    parts = sum(np.array(read[f"{part}_arcmin"], dtype=float) for part in PARTS)
    np.testing.assert_allclose(parts, total, rtol=0, atol=1e-8)
    assert torque.max() == 2 * drive.rated_torque_Nm


def test_residual_in_the_csv_is_measured_minus_model(page):
    read = page.table("loops.csv")
    measured_, model, residual = (
        np.array(read[f"{name}_arcmin"], dtype=float) for name in ("measured", "model", "residual")
    )
    np.testing.assert_allclose(measured_ - model, residual, atol=1e-6)
    _, result = measured()
    rms = float(np.sqrt(np.mean(residual**2)))
    assert rms == pytest.approx(result.rms_rad / ARCMIN, rel=1e-6)


def test_empty_cells_replace_what_is_not_finite():
    assert numbers_csv({"a_mm": [1.5, math.inf], "b": ["x,y", "z"]}) == ('a_mm,b\n1.5,"x,y"\n,z\n')


def test_stages_count_the_teeth_that_the_torsion_curve_reports():
    drive = drive_of("reference_a")
    model = design_model(drive)
    stages = collect_stages(model, drive.name)
    for torque in (1.0, 17.0, 40.0, 79.0):
        teeth = int(model.torsion_curve([torque]).engaged_teeth[0])
        assert len(stages.loaded(torque)) == teeth


# --- the page ------------------------------------------------------------------------------------


def test_page_refers_to_nothing_outside_itself(report, page):
    assert page.links
    for name, target in page.links:
        assert target.startswith(("#", "data:")), (name, target[:80])
    assert not {"iframe", "object", "embed", "img"} & set(page.tags)
    text = report.read_text(encoding="utf-8")
    assert not re.search(r"<script[^>]*\bsrc=", text)
    inside = text.replace("http://www.w3.org/2000/svg", "")
    inside = inside.replace("http://www.w3.org/2000/svg".replace(":", "%3A"), "")
    for outside in ("http://", "https://", "@import", "url(", "//cdn"):
        assert outside not in inside


def test_a_page_draws_its_plots_by_itself(page, report):
    text = report.read_text(encoding="utf-8")
    places = re.findall(r'class="chart" id="([\w-]+)"', text)
    assert places
    for place in places:
        data = re.search(f'<script type="application/json" id="{place}-data">(.*?)</script>', text)
        assert data is not None
        assert json.loads(data[1])["data"], place
        assert f'data-svg="{place.rpartition("-")[0]}"' in text
    assert text.count('id="plotly-packed"') == 1


def test_page_states_how_it_was_made(page):
    _, result = measured()
    assert "lostmotion demo -o demo" in page.text
    assert result.campaign.fingerprint() in page.text
    for name in ("size_25", "reference_a", "external_ring"):
        assert f"{name}.toml" in page.text
    assert "NumPy" in page.text
    assert "design.support.balls = 23" in page.text  # a default that is stated
    assert "The straight line T / K3 is split" in page.text  # an assumption that is stated


def test_headlines_are_the_numbers_of_predict(page):
    for name in ("size_25", "reference_a", "external_ring"):
        drive = drive_of(name)
        answer = predict(drive, [drive.rated_torque_Nm])
        assert f"{answer['reversal_lost_motion_arcmin']:.3f} arcmin" in page.text.replace(
            "\xa0", " "
        )
        assert f"{answer['total_arcmin'][0]:.3f} arcmin" in page.text.replace("\xa0", " ")


def test_a_failed_check_is_marked_by_word_and_sign(drawn, tmp_path):
    drawn["design"]["teeth"]["rigid_shift"] = 2.80
    file = tmp_path / "tight.toml"
    file.write_text("")
    section = drive_section(parse_drive(drawn, str(file)))
    path = tmp_path / "report.html"
    write_report(path, "One drive", "", [section], "lostmotion predict")
    text = Page(path.read_text(encoding="utf-8")).text
    assert "✗ FAIL" in text
    assert "flanks of a lobe interfere" in text
    assert "the mesh is preloaded" in text


def test_spatial_drive_has_a_curve_for_each_section(drawn, tmp_path):
    drawn["design"]["axial_sections"] = 3
    file = tmp_path / "spatial.toml"
    file.write_text("")
    blocks = drive_section(parse_drive(drawn, str(file)), math.radians(0.5)).blocks
    gaps = next(b for b in blocks if isinstance(b, Chart) and b.name == "clearances")
    assert set(gaps.columns["section"]) == {0, 1, 2}
    assert "tooth phase 0.5°" in gaps.caption
    assert "3 from the cup's edge" in gaps.caption


def test_tolerances_are_a_budget_also_where_they_leave_no_gap(drawn, tmp_path):
    link = {"kind": "hole", "zone": "generator", "name": "bore", "lower_um": -9, "upper_um": -3}
    drawn["design"]["tolerance"] = [link]
    file = tmp_path / "tight.toml"
    file.write_text("")
    section = drive_section(parse_drive(drawn, str(file)))
    path = tmp_path / "report.html"
    write_report(path, "One drive", "", [section], "lostmotion predict")
    text = Page(path.read_text(encoding="utf-8")).text
    assert "states neither tolerances" not in text
    assert "The tolerances leave no radial gap" in text
    budget = next(b for b in section.blocks if isinstance(b, PageTable) and "budget" in b.title)
    assert budget.rows == [("bore", "generator", "+0.500", "−9.0", "−3.0", "100.0", "100.0")]


def test_demo_refuses_a_folder_that_cannot_be(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["demo", "-o", str(tmp_path / "file" / "demo")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize(
    "words",
    [
        ["predict", str(DRIVES / "size_25.toml")],
        ["predict", str(DRIVES / "external_ring.toml"), "--phase-deg", "0.4"],
        ["compare", str(LOOPS / "drive.toml"), str(LOOPS)],
        ["diagnose", str(LOOPS / "drive.toml"), str(LOOPS)],
        ["fit", str(LOOPS / "drive.toml"), str(LOOPS), "-o", "{folder}/fitted.toml"],
    ],
    ids=["bought", "designed", "measured", "diagnosed", "fitted"],
)
def test_commands_write_reports(words, tmp_path, capsys):
    path = tmp_path / "report.html"
    words = [word.replace("{folder}", str(tmp_path)) for word in words]
    assert main([*words, "--report", str(path)]) == 0
    assert f"written: {path}" in capsys.readouterr().out
    page = Page(path.read_text(encoding="utf-8"))
    assert "figure" in page.tags
    assert words[1] in page.text


def test_the_verdict_leads_the_page_of_a_diagnosis():
    found, odd = section_of("found"), section_of("unexplained")
    assert found.lead == "Missing: thermal gap."
    assert odd.lead.startswith("A systematic residual remains")
    assert "It depends on torque: ripple of 4.99 N·m" in odd.lead
    assert any(f.title == "The residual depends on torque" for f in figures("unexplained"))
    titles = [block.title for block in found.blocks]
    assert {"What to do next", "Candidate effects", "Smallest detectable size"} < set(titles)
    assert not any("depends on" in title for title in titles)


def test_findings_are_before_the_pictures(tmp_path):
    path = tmp_path / "report.html"
    log = (LOOPS / "base_onyx_runin5.csv").read_text().splitlines()
    names = log[0].split(",")
    cells = log[200].split(",")
    cells[names.index("TORQUE")] = "655.35"  # one wild value
    recording = tmp_path / "loops.csv"
    recording.write_text("\n".join([*log[:200], ",".join(cells), *log[201:]]) + "\n")
    words = ["compare", str(LOOPS / "drive.toml"), str(recording), "--report", str(path)]
    assert main(words) == 0
    text = path.read_text(encoding="utf-8")
    assert 0 < text.index("outliers") < text.index("<figure")


def test_the_runs_of_a_shape_are_counted_from_one():
    base = SimpleNamespace(conditions=SimpleNamespace(run_of=np.array([0, 0, 1])))
    found = covariate_of(base, "run")
    assert found is not None
    assert found[0].tolist() == [1, 1, 2]


def test_long_names_of_runs_keep_what_distinguishes_them():
    names = [f"2024-07-11__ramp__runin_{i}_after_relubrication" for i in (1, 13, 14)]
    assert abridged(names) == ["…1…", "…13…", "…14…"]
    assert abridged(names[1:]) == ["…13…", "…14…"]
    assert abridged(["7", "8"]) == ["7", "8"]
    assert abridged(["warm", "warm_again"]) == ["warm", "warm_again"]
    assert abridged(["a_b", "a_b_b"]) == ["a_b", "a_b_b"]
    assert abridged(["alone"]) == ["alone"]


def test_the_ladder_writes_beside_a_ring_what_the_ring_is():
    _, result = discovered("found")
    answer = result.answer()
    figure = draw_ladder(answer["ladder"], answer["noise_floor_arcsec"])
    said = [text for trace in figure.data for text in trace.text or ()]
    for rung in answer["ladder"]:
        errors = (with_zeros(rung[name]) for name in ("rms_arcsec", "rms_heldout_arcsec"))
        assert f"<b>{' / '.join(errors)}</b>" in said


def test_the_ladder_of_the_page_is_that_of_the_answer(page):
    _, result = discovered("found")
    read = page.table("error_ladder.csv")
    assert read["effects"] == ["baseline", "baseline + thermal_gap"]
    expected = [rung["rms_heldout_arcsec"] for rung in result.answer()["ladder"]]
    np.testing.assert_allclose(np.array(read["rms_heldout_arcsec"], dtype=float), expected)


def test_the_maps_grow_pale_when_the_effect_is_added(page):
    read = page.table("residual_grids.csv", 1)
    size = np.abs(np.array(read["mean_residual_arcsec"], dtype=float))
    clear = np.abs(np.array(read["t"], dtype=float)) > 2
    base = np.array(read["model"]) == "baseline"
    warm = np.array(read["quantity"]) == "temperature"
    assert size[base & warm].mean() > 3 * size[~base & warm].mean()
    assert clear[base & warm].mean() > 0.4
    assert clear[~base & warm].mean() < 0.1


def test_the_gain_of_every_run_adds_up_to_the_evidence(page):
    _, result = discovered("found")
    read = page.table("gain_by_run.csv")
    gain = np.array(read["thermal gap_nats"], dtype=float)
    assert gain.size == 12
    assert gain.sum() == pytest.approx(result.answer()["candidates"][0]["evidence"], rel=1e-6)


def test_nothing_is_written_when_a_place_is_wrong(tmp_path, capsys):
    drive = str(DRIVES / "size_25.toml")
    bad = str(tmp_path / "missing" / "answer.json")
    good = tmp_path / "report.html"
    assert main(["predict", drive, "--report", str(good), "--json", bad]) == 2
    assert not good.exists()
    assert "--json" in capsys.readouterr().err


def test_a_long_slim_table_is_in_two_halves_and_a_folded_one_opens_on_request() -> None:
    rows = [(f"n{i}", f"{i * i}") for i in range(31)]
    page = rows_html(PageTable("Squares", ("number", "square"), rows, (1,)))
    assert page.count("<table>") == page.count("<thead>") == 2
    assert page.index(">n15<") < page.index("</table>") < page.index(">n16<")
    for i, square in rows:
        assert page.count(f"<td>{i}</td>") == 1
        assert f'<td class="r">{square}</td>' in page
    assert rows_html(PageTable("Few", ("a", "b"), rows[:16])).count("<table>") == 1
    assert rows_html(PageTable("Wide", tuple("abcde"), [tuple("12345")] * 31)).count("<table>") == 1
    folded = rows_html(PageTable("Long", ("", ""), rows, folded=True))
    assert folded.startswith("<details><summary>Long</summary>")
    assert "<thead>" not in folded
    assert "<h3>" not in folded


NASTY = "<!--<script>alert(1)</script>-->&\u2028\"'><img src=x onerror=alert(2)>"
"""A name that closes, opens and comments out the markup around it."""


def test_a_name_in_a_script_is_data_and_nothing_else():
    body = script_json({"name": NASTY, "values": [1.5, None, True]})
    assert not set("<>&\u2028\u2029") & set(body)
    assert json.loads(body) == {"name": NASTY, "values": [1.5, None, True]}


def test_names_of_a_drive_are_escaped_wherever_the_page_shows_them(drawn, tmp_path):
    drawn["drive"]["name"] = NASTY
    link = {"kind": "hole", "zone": "generator", "name": NASTY, "lower_um": -9, "upper_um": -3}
    drawn["design"]["tolerance"] = [link]
    file, page = tmp_path / "drive.toml", tmp_path / "page.html"
    file.write_text(format_toml(drawn))
    assert main(["predict", str(file), "--report", str(page), "--quiet"]) == 0
    text = page.read_text()
    assert "alert(1)" in text
    assert "<script>alert" not in text
    assert "<img" not in text
    assert "<!--<script>" not in text
