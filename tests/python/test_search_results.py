"""Results of a search: drives to the last bit, certificates, reports; the shipped specs."""

from __future__ import annotations

import csv
import json
import math
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_search import REACHED, SPECS, Write, format_spec

from conftest import DATA, NO_SEARCH
from lostmotion import design
from lostmotion.cli import main
from lostmotion.core import core
from lostmotion.design import running
from lostmotion.design.drive_document import drive_document
from lostmotion.drives import format_toml, parse_drive, read_drive, read_toml, tomllib
from lostmotion.model import ADVICE, design_model
from lostmotion.structs import make_drive

sys.path.insert(0, str(Path(__file__).parents[1]))
from brute_force import polygons

pytest.importorskip("lostmotion._search", reason=NO_SEARCH)


BY_QUANTILE = ("robot_joint", "ring_generator")
"""Specs whose tolerance level is the quantile of samples."""


HELD_LEAST = 60
"""Of the designs in `REACHED`, over 16 seeds, that a front has to hold. The search holds 75 of 96;
another compiler rounds differently, which changes the path of every seed: the number that one
seed holds has a standard deviation of 1.4, the sum of sixteen one of 6."""


# --- files of a search ---


def test_the_best_drive_reads_back_to_the_last_bit(
    tmp_path: Path, small_spec: dict[str, Any]
) -> None:
    # A ball bearing (exponent 2/3), a preloaded roller and a spring: not all of them are linear.
    small_spec["design"]["radial_chain"] = [
        {"kind": "ball", "ball_diameter_mm": 4, "balls": 23, "preload_N": 50},
        {"kind": "roller", "roller_length_mm": 8, "preload_N": 20},
        {"kind": "spring", "stiffness_N_per_mm": 3e4},
    ]
    small_spec["search"]["evaluations"] = 600
    spec = tmp_path / "spec.toml"
    spec.write_text(format_spec(small_spec))
    result = design.search(spec, tmp_path / "run")
    assert result.best is not None
    assert result.best["design"]["tolerance"][0]["name"] == "bore"
    drive = make_drive(read_drive(tmp_path / "run" / "best.toml").design)
    for section in ("teeth", "generator", "flexspline", "material", "support", "gap"):
        for name, value in result.best["design"][section].items():
            if not isinstance(value, str):
                assert getattr(getattr(drive, section), name) == value, name
    laws = drive.radial_laws
    assert drive.radial_law_count == 3
    assert laws[0].exponent == pytest.approx(2 / 3)
    assert laws[0].preload_N == 50
    assert laws[2].coefficient_mm_per_Nn == pytest.approx(1 / 3e4, rel=1e-15)
    text = (tmp_path / "run" / "best.toml").read_text()
    for law, entry in zip(
        laws, read_toml(tmp_path / "run" / "best.toml", "")["design"]["radial_chain"], strict=False
    ):
        assert law.coefficient_mm_per_Nn == entry["deflection_mm"], text


@pytest.mark.parametrize("name", ["external_ring", "reference_a"])
def test_the_document_of_a_drive_reads_back_to_the_last_bit(name: str) -> None:
    stated = read_drive(DATA / "drives" / f"{name}.toml")
    assert stated.design is not None
    drive = make_drive(stated.design)
    document = drive_document(drive)
    document["drive"]["name"] = "again"
    assert document == tomllib.loads(format_toml(document))
    again = make_drive(parse_drive(document).design)
    assert drive_document(again) == drive_document(drive)
    buffer = core().ffi.buffer
    assert bytes(buffer(again)) == bytes(buffer(drive))


def test_the_optimizer_and_the_package_write_the_same_drive(
    tmp_path: Path, small_spec: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(running, "write_whole", lambda *_: None)
    small_spec["search"]["evaluations"] = 600
    spec = tmp_path / "spec.toml"
    spec.write_text(format_spec(small_spec))
    best = design.search(spec, tmp_path / "run").best
    assert best is not None
    written = read_toml(tmp_path / "run" / "best.toml", "")
    for document in (best, written):
        del document["drive"]["name"], document["design"]["tolerance"]
    for key in set(written["design"]["generator"]) - set(best["design"]["generator"]):
        assert key == "cam_offset_mm", "only what does not apply is left out"
        del written["design"]["generator"][key]
    assert json.dumps(written) == json.dumps(best)


def test_predict_gives_the_numbers_of_the_certificate(
    searched: tuple[Path, Path, dict[str, bytes]], capsys: pytest.CaptureFixture[str]
) -> None:
    _, run, _ = searched
    assert main(["predict", str(run / "best.toml"), "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    # The library's phase 0; the certificate has the largest of eight.
    certificate = json.loads((run / "certificate.json").read_text())
    lost = certificate["figures"]["lost_motion_arcmin"]
    assert answer["reversal_lost_motion_arcmin"] <= lost * (1 + 1e-9)
    assert answer["reversal_lost_motion_arcmin"] == pytest.approx(lost, rel=1e-2)
    assert answer["reversal_lost_motion_arcmin"] <= lost * (1 + 1e-6)
    assert answer["checks"] == certificate["checks"]
    for key in ("figures", "figures_as_searched"):
        assert "compliance" not in " ".join(certificate[key])
    stiffness = certificate["figures"]["stiffness_Nm_per_rad"]
    rows = csv.DictReader((run / "front.csv").read_text().splitlines())
    assert stiffness == pytest.approx(float(next(rows)["stiffness_Nm_per_rad"]), rel=2e-3)
    # The stiffness of a search is the secant: the tangent at rated torque is another.
    assert answer["secant_stiffness_Nm_per_rad"] == pytest.approx(stiffness, rel=2e-3)
    assert answer["stiffness_Nm_per_rad"][-1] > 1.01 * stiffness


def test_every_design_of_the_front_is_a_drive_with_margins(
    searched: tuple[Path, Path, dict[str, bytes]], tmp_path: Path
) -> None:
    spec, run, _ = searched
    shutil.copytree(run, tmp_path / "run")
    result = design.search(spec, tmp_path / "run", resume=True)
    frame = result.to_dataframe()
    assert list(frame[result.objectives[0]]) == [one["objectives"][0] for one in result.front]
    assert len(result.plot().data[0].x) == len(result.front)
    assert len(result.front) > 3
    lead = [one["objectives"][0] for one in result.front]
    assert lead == sorted(lead)
    for one in result.front:
        assert min(one["margins"].values()) >= 0
        assert one["verified"]
        assert one["drive"]["design"]["teeth"]["flexspline_teeth"] in (198, 200)
    assert result.certificate is not None
    assert result.certificate["holds"]
    assert sum(result.combinations.values()) == 4
    # front.csv contains the same designs
    rows = (run / "front.csv").read_text().splitlines()
    assert len(rows) == 1 + len(result.front)
    assert rows[0].startswith("verified,generator.type,teeth.flexspline_teeth")
    place = rows[0].split(",").index("stiffness_Nm_per_rad")
    for row, one in zip(rows[1:], result.front, strict=True):
        assert float(row.split(",")[place]) == pytest.approx(one["figures"]["stiffness"])


def test_a_package_without_the_search_states_what_is_missing(
    searched: tuple[Path, Path, dict[str, bytes]], tmp_path: Path
) -> None:
    code = (
        "import sys; sys.modules['lostmotion._search'] = None\n"
        "from lostmotion.cli import main\n"
        f"sys.exit(main(['design', {str(searched[0])!r}, '-o', {str(tmp_path / 'run')!r}]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "NLopt (Debian, Ubuntu: libnlopt-dev)" in done.stderr
    assert len(done.stderr.splitlines()) == 1


# --- the shipped specs, at a short budget ---


@pytest.fixture(scope="module", params=SPECS)
def shipped(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp(request.param)
    spec = folder / f"{request.param}.toml"
    text = (DATA / "specs" / spec.name).read_text()
    spec.write_text(re.sub(r"evaluations = \d+", "evaluations = 3000", text))
    return design.search(spec, folder / "run"), folder / "run"


def test_a_shipped_spec_ends_with_a_certified_design(shipped: Any) -> None:
    result, _ = shipped
    assert result.finished
    assert result.certificate["holds"]


def test_predict_passes_what_the_search_certifies(
    shipped: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    result, run = shipped
    assert main(["predict", str(run / "best.toml"), "--json", str(run / "prediction.json")]) == 0
    assert "check failed" not in capsys.readouterr().out
    answer = json.loads((run / "prediction.json").read_text())
    assert answer["checks"] == result.certificate["checks"]


def test_lost_motion_is_at_least_halved_at_no_more_stress(shipped: Any) -> None:
    _, run = shipped
    page = (run / "report.html").read_text()
    assert "at least halved, stress no higher" in page
    assert "Textbook start and best" in page


@pytest.mark.parametrize("shipped", BY_QUANTILE, indirect=True)
def test_the_loops_quantile_is_that_of_many_samples(shipped: Any) -> None:
    # 2048 samples in the loop, 8 x 2^14 in the certificate; bar 3 %.
    result, _ = shipped
    searched = result.certificate["figures_as_searched"]["tolerance_lost_motion_arcmin"]
    sampled = result.certificate["lost_motion_arcmin"]["quantile_9973"]
    assert searched == pytest.approx(sampled, rel=0.03)


def test_what_is_certified_holds_however_many_sections_share_the_load(shipped: Any) -> None:
    result, run = shipped
    document = read_toml(run / "best.toml", "a drive file")
    for sections in (1, 3, 5, 7):
        document["design"]["axial_sections"] = sections
        checks = design_model(parse_drive(document)).checks()
        assert [c.name for c in checks if c.margin < 0 and c.name not in ADVICE] == []
        margins = [c.margin for c in checks]
        assert margins == [c["margin"] for c in result.certificate["checks"]], sections


def test_short_searches_hold_what_a_search_delivered_whatever_the_seed(tmp_path: Path) -> None:
    text = (DATA / "specs" / "ring_generator.toml").read_text()
    text = re.sub(r"evaluations = \d+", "evaluations = 2000", text)
    spec = tmp_path / "ring_generator.toml"
    held = []
    for seed in range(1, 17):
        spec.write_text(re.sub(r"seed = \d+", f"seed = {seed}", text))
        found = [one["objectives"] for one in design.search(spec, tmp_path / str(seed)).front]
        held.append(sum((np.array(found) <= reached).all(axis=1).any() for reached in REACHED))
    assert sum(held) >= HELD_LEAST, held


def test_planar_only_is_requested_and_stated(
    write_spec: Write, tmp_path: Path, small_spec: Any
) -> None:
    small_spec["search"]["fixed"]["planar_only"] = True
    result = design.search(write_spec(small_spec), tmp_path / "run")
    assert result.certificate["holds"]
    assert "Planar only, as the drive file requests" in (tmp_path / "run/report.html").read_text()
    best = read_toml(tmp_path / "run/best.toml", "a drive file")
    assert best["design"]["planar_only"] is True
    best["design"]["planar_only"] = False
    checks = {c.name: c.margin for c in design_model(parse_drive(best)).checks()}
    assert checks["smallest_gap"] < 0  # a planar verdict does not include the cup


def face_designs(run: Path, sections: int) -> list[tuple[int, polygons.Design, Any]]:
    """The best drive as polygons, one for each place of the face, and the library's meshes."""
    drive = make_drive(read_drive(run / "best.toml").design)
    c = core(64)
    workspace = c.ffi.new("lm_design_workspace *")
    c.check(c.lib.lm_make_face(drive, sections, 256, workspace.face, c.ffi.NULL))
    t, g = drive.teeth, drive.generator
    found = []
    for section in range(sections):
        factor = c.lib.lm_section_factor(drive, section, sections)
        wave = g.deflection_mm * factor
        # The parts are the same: the same radii with another wave need another depth.
        depth = t.engagement_depth + (wave - g.deflection_mm) / t.module_mm
        # With internal teeth the root, and with it the rim, follows from the section of the largest
        # wave.
        beyond = g.deflection_mm * c.lib.lm_section_factor(drive, sections - 1, sections) - wave
        rim = drive.flexspline.rim_thickness_mm + (2 * beyond if t.deformation else 0.0)
        types = ("cosine", "ellipse", "discs", "rollers", "ring")
        found.append(
            (
                section,
                polygons.Design(
                    deformation="external" if t.deformation else "internal",
                    module_mm=t.module_mm,
                    flexspline_teeth=t.flexspline_teeth,
                    rigid_teeth=t.rigid_teeth,
                    pressure_angle_deg=math.degrees(t.pressure_angle_rad),
                    flexspline_shift=t.flexspline_shift,
                    rigid_shift=t.rigid_shift,
                    tooth_height=t.tooth_height,
                    engagement_depth=depth,
                    root_clearance=t.root_clearance,
                    rim_thickness_mm=rim,
                    generator_type=types[g.type],
                    deflection_mm=wave,
                    contact_half_angle_deg=math.degrees(g.contact_half_angle_rad),
                ),
                workspace,
            )
        )
    return found


@pytest.mark.parametrize("sections", [2, 3])
def test_polygons_of_a_certified_design_do_not_overlap_and_have_its_clearances(
    shipped: Any, sections: int
) -> None:  # at both edges, and in the middle of the face
    result, run = shipped
    c = core(64)
    smallest = result.certificate["smallest_gap"]["angle_deg"]
    angles = np.unique(np.concatenate((np.arange(-60.0, 60.1, 2.5), [smallest, -smallest])))
    compared = 0
    for section, drawn, workspace in face_designs(run, sections):
        mesh = c.ffi.addressof(workspace.face[section])
        for angle in angles:
            clearance = c.lib.lm_tooth_clearance(mesh, math.radians(angle))
            assert polygons.overlap_area_mm2(drawn, angle) < 1e-9, (section, angle)
            for flank, gap in (("forward", clearance.forward), ("backward", clearance.backward)):
                if math.isfinite(gap.gap_rad):
                    own = gap.gap_rad * 10_800 / math.pi
                    assert own > -1e-5
                    brute = polygons.gap_arcmin(drawn, angle, flank)
                    assert own == pytest.approx(brute, abs=0.005), (section, angle, flank)
                    compared += 1
    assert compared > 20
