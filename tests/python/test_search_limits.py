"""Searches with contradictory or demanding limits: the limits to relax."""

from __future__ import annotations

import copy
import csv
import json
import re
from pathlib import Path
from typing import Any

import pytest
from small_search import Write

from conftest import NO_SEARCH
from lostmotion.cli import main

pytest.importorskip("lostmotion._search", reason=NO_SEARCH)


def test_contradictory_limits_name_the_limits_to_relax(
    write_spec: Write,
    small_spec: dict[str, Any],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    small_spec["search"]["limits"] = {"safety_factor_min": 1.5, "lost_motion_max_arcmin": 0.1}
    small_spec["search"]["evaluations"] = 800
    assert main(["design", str(write_spec(small_spec)), "-o", str(tmp_path / "run")]) == 1
    error = capsys.readouterr().err
    assert "no feasible design; relax" in error
    assert "lost_motion_max_arcmin by" in error
    relax = json.loads((tmp_path / "run" / "infeasible.json").read_text())["relax"]
    assert "lost_motion_max_arcmin" in [limit["limit"] for limit in relax]
    assert "Limits to be relaxed" in (tmp_path / "run" / "report.html").read_text()
    assert not (tmp_path / "run" / "best.toml").exists()


def test_what_has_to_give_has_the_same_bytes_however_the_work_was_done(
    write_spec: Write, small_spec: dict[str, Any], tmp_path: Path
) -> None:
    small_spec["search"]["limits"] = {"safety_factor_min": 1.5, "lost_motion_max_arcmin": 0.1}
    small_spec["search"]["evaluations"] = 300
    spec = str(write_spec(small_spec))
    one = tmp_path / "one"
    assert main(["design", spec, "-o", str(one), "--workers", "1", "-q"]) == 1
    assert main(["design", spec, "-o", str(tmp_path / "two"), "--workers", "2", "-q"]) == 1
    # interrupted during the repair, which is at the end of the journal
    journal = (one / "journal.bin").read_bytes()
    cut = tmp_path / "cut"
    cut.mkdir()
    (cut / "journal.bin").write_bytes(journal[: len(journal) - len(journal) // 50])
    assert main(["design", spec, "-o", str(cut), "--resume", "-q"]) == 1
    for name in ("infeasible.json", "nearest.csv", "combinations.csv"):
        for other in ("two", "cut"):
            assert (one / name).read_bytes() == (tmp_path / other / name).read_bytes(), name


LIMITS_THAT_CONTRADICT: dict[str, dict[str, float]] = {
    "lost motion and stress": {"lost_motion_max_arcmin": 0.1, "stress_max": 0.3},
    "stiffness": {"stiffness_min_Nm_per_rad": 60000.0},
    "safety": {"safety_factor_min": 4.0},
}


@pytest.mark.parametrize("limits", LIMITS_THAT_CONTRADICT.values(), ids=LIMITS_THAT_CONTRADICT)
def test_limits_relaxed_as_stated_have_a_design(
    limits: dict[str, float],
    write_spec: Write,
    small_spec: dict[str, Any],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    small_spec["search"]["limits"] = {"safety_factor_min": 1.5, **limits}
    small_spec["search"]["evaluations"] = 500
    assert main(["design", str(write_spec(small_spec)), "-o", str(tmp_path / "run"), "-q"]) == 1
    error = capsys.readouterr().err
    said = re.findall(r"(\w+) by (\S+) (% of the limit|arcmin)", error)
    assert said, error
    relaxed = small_spec["search"]["limits"]
    for name, by, unit in said:
        sign = -1 if "_min" in name else 1
        if unit == "arcmin":
            relaxed[name] = relaxed.get(name, 0.0) + sign * float(by)
        else:
            relaxed[name] *= 1 + sign * float(by) / 100
    small_spec["search"]["start_from"] = "run"
    assert main(["design", str(write_spec(small_spec)), "-o", str(tmp_path / "again"), "-q"]) == 0
    assert json.loads((tmp_path / "again" / "certificate.json").read_text())["holds"]
    assert not (tmp_path / "again" / "nearest.csv").exists()


def test_a_small_budget_states_what_it_did_not_reach(
    write_spec: Write,
    small_spec: dict[str, Any],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    small_spec["search"]["limits"] = {"safety_factor_min": 1.5, "lost_motion_max_arcmin": 0.1}
    small_spec["search"]["evaluations"] = 10
    small_spec["search"]["range"]["teeth.flexspline_teeth"] = {"choose": list(range(150, 250, 2))}
    assert main(["design", str(write_spec(small_spec)), "-o", str(tmp_path / "run")]) == 1
    error = capsys.readouterr().err
    assert re.search(
        r"no feasible design in the budget, \d+ combinations not reached; relax", error
    )


ONE_VARIABLE: dict[str, Any] = {
    "search": {
        "objectives": ["lost_motion"],
        "seed": 3,
        "evaluations": 200,
        "fixed": {
            "planar_only": True,
            "teeth.module_mm": 0.27,
            "teeth.flexspline_teeth": 160,
            "teeth.flexspline_shift": 2.6,
            "teeth.rigid_shift": 2.55,
            "teeth.tooth_height": 1.75,
            "teeth.engagement_depth": 1.2,
            "teeth.root_clearance": 0.35,
            "teeth.face_width_mm": 9,
            "generator.type": "ellipse",
            "flexspline.rim_thickness_mm": 0.5,
        },
        "range": {"generator.deflection_mm": [0.2, 0.32]},
    },
}
"""The first batch finds no design within all limits."""


def test_search_that_finds_its_first_design_late_has_its_report(
    write_spec: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    assert main(["design", str(write_spec(ONE_VARIABLE)), "-o", str(run)]) == 0
    assert "the front, 1 design:" in capsys.readouterr().out
    with (run / "history.csv").open(newline="") as stream:
        bests = [row["best"] for row in csv.DictReader(stream)]
    assert bests[0] == ""
    assert float(bests[-1]) > 0
    assert "Progress of the search" in (run / "report.html").read_text()


def test_what_the_fine_check_finds_is_reported(
    write_spec: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = copy.deepcopy(ONE_VARIABLE)
    spec["search"]["objectives"] = ["kinematic_error"]
    spec["search"]["phases"] = 3
    assert main(["design", str(write_spec(spec)), "-o", str(tmp_path / "run")]) == 0
    assert re.search(
        r"kinematic_error \S+ arcsec there, \S+ in the search", capsys.readouterr().out
    )
    spec["search"]["objectives"] = ["lost_motion"]
    spec["search"]["phases"] = 1  # which has no kinematic error
    spec["search"]["limits"] = {"kinematic_error_max_arcsec": 0.001}
    assert main(["design", str(write_spec(spec)), "-o", str(tmp_path / "broken")]) == 0
    said = capsys.readouterr()
    assert "does NOT hold" in said.out
    assert re.search(r"broken: kinematic_error_max_arcsec by \S+ share of the limit", said.out)
    assert "does not hold on the fine check" in said.err


def test_stiffness_beyond_reach_states_how_far_it_has_to_fall(
    write_spec: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = copy.deepcopy(ONE_VARIABLE)
    spec["search"]["limits"] = {"stiffness_min_Nm_per_rad": 1e6}
    assert main(["design", str(write_spec(spec)), "-o", str(tmp_path / "run")]) == 1
    out = capsys.readouterr().out
    found = re.search(r"relax stiffness_min_Nm_per_rad by (\S+) % of the limit", out)
    assert found is not None
    # The drive reaches some 2e4 N m/rad.
    assert 90 < float(found[1]) < 100
