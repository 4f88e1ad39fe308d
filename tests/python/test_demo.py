"""The demonstration is complete, and all its numbers equal those of the commands."""

from __future__ import annotations

import gzip
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "docs"))

from blocks import read_blocks, same_line
from demonstration import Demonstration, demonstration
from small_search import REACHED

from conftest import NO_SEARCH
from lostmotion.cli import main
from lostmotion.demo.controller import missing_tools
from lostmotion.design.engine import MISSING
from lostmotion.drives import read_drive
from lostmotion.recordings import read_campaign

ROOT = Path(__file__).parents[2]

PAGE_MAX = 8_000_000
"""Largest size of the report in bytes, with Plotly in it."""

LIMIT_S = 120.0
"""Processor time that the demonstration may take after set-up, independent of other work on the
machine."""


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Demonstration:
    return demonstration(tmp_path_factory)


def test_the_hidden_effect_is_found_and_the_error_falls_to_the_noise(shown):
    _, answer, _, _ = shown
    joint = answer["joint"]
    assert joint["comparison"]["where_it_fails"]
    assert joint["diagnosis"]["verdict"] == "missing-effect"
    assert joint["diagnosis"]["effects"] == ["thermal_gap"]
    first, last = joint["fit"]["ladder"]
    assert last["effects"] == ["thermal_gap"]
    assert last["rms_arcsec"] < 0.3 * first["rms_arcsec"]
    # Noise of 1.5 arcsec, and the scatter from run to run.
    floor = joint["fit"]["noise_floor_arcsec"]
    assert 1.5 < floor < 1.7
    assert floor <= last["rms_heldout_arcsec"] < 1.1 * floor


def test_the_effect_takes_most_of_what_was_left_off_the_joint(shown):
    _, answer, _, _ = shown
    on = answer["joint"]["controller"]
    alone, without, with_it = (
        np.array(on[name])
        for name in ("uncompensated_arcsec", "without_effect_arcsec", "compensated_arcsec")
    )
    assert alone.size >= 3
    assert np.all(without < 0.15 * alone)
    assert np.all(with_it < 0.3 * without)


def test_the_emulated_controller_computes_the_bits_of_the_replay(shown):
    _, answer, out, _ = shown
    on = answer["joint"]["controller"]
    if missing_tools():
        assert "not installed" in on["emulator"]
        assert "replayed on this machine" in out
        pytest.skip(
            f"no emulated controller, {missing_tools()} not installed: apt install "
            "gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm"
        )
    assert on["emulator"] == ""
    assert on["same_bits"] is True


def test_each_shipped_spec_is_searched_and_halves_the_lost_motion_of_its_start(shown):
    _, answer, out, _ = shown
    if answer["designs"] == MISSING:
        pytest.skip(NO_SEARCH)
    specs = {path.stem.replace("_", " ") for path in (ROOT / "tests/data/specs").glob("*.toml")}
    assert set(answer["designs"]) == specs
    for name, found in answer["designs"].items():
        best = found["front"][0]["figures"]
        assert found["finished"]
        assert "folder" not in found  # it is gone when the answer is read
        assert found["certificate"]["holds"]
        earlier = REACHED if name == "ring generator" else ()
        assert len(found["front"]) >= (2 if earlier else 3)
        for reached in earlier:
            assert any(
                all(new <= old for new, old in zip(design["objectives"], reached, strict=True))
                for design in found["front"]
            ), (name, reached)
        assert best["tolerance_lost_motion"] <= 0.5 * found["start"]["tolerance_lost_motion"]
        assert best["stress"] <= found["start"]["stress"]
        assert f"{name}: lost motion" in out


def test_the_readme_quotes_what_it_prints(shown):
    _, _, out, _ = shown
    quoted = next(
        block.code for block in read_blocks(ROOT / "README.md") if "emulated" in block.code
    )
    wanted = [line for line in quoted.splitlines() if not line.startswith("5 ")]
    assert len(wanted) == 6
    for line in wanted:
        assert any(same_line(printed, line) for printed in out.splitlines()), line


def test_the_demonstration_is_short(shown):
    folder, answer, out, seconds = shown
    assert seconds < LIMIT_S
    assert len(out.splitlines()) <= 24
    for name in ("thermal_gap", "size 25", "reference design A", "external ring", "cycloidal"):
        assert name in out
    assert answer["report"] == str(folder / "report.html")
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.count("<section") == 9
    assert len(page) < PAGE_MAX
    assert f"lostmotion demo -o {folder}" in page
    assert "http://" not in page.replace("http://www.w3.org/", "")


def test_what_it_read_and_made_lies_beside_the_report(shown, tmp_path):
    folder, _, _, _ = shown
    assert read_drive(folder / "drives" / "reference_a.toml").design is not None
    assert (folder / "cycloidal_locked_output" / "SOURCE.md").is_file()
    fitted = read_drive(folder / "fitted.toml")
    assert [effect["name"] for effect in fitted.effects] == ["thermal_gap"]
    words = ["export", str(folder / "fitted.toml"), "-o", str(tmp_path / "params.h")]
    assert main([*words, "--set", "period_ms=5", "--quiet"]) == 0
    assert (tmp_path / "params.h").read_text() == (folder / "params.h").read_text()
    recording = folder / "joint" / "joint.csv.gz"
    made = tmp_path / "fitted.toml"
    words = ["fit", str(folder / "joint" / "joint.toml"), str(recording), "-o", str(made)]
    assert main([*words, "--add", "thermal_gap", "--quiet"]) == 0
    assert read_drive(made).fit == fitted.fit
    assert not (folder / "firmware").exists()


def test_its_recording_is_what_the_rig_writes(tmp_path):
    kept = ROOT / "tests" / "data" / "joint"
    words = (kept / "SOURCE.md").read_text().split("python -m rig ")[1].splitlines()[0].split()
    words[words.index("-o") + 1] = str(tmp_path)
    subprocess.run(
        [sys.executable, "-m", "rig", *words], check=True, cwd=ROOT / "tests", capture_output=True
    )
    assert (tmp_path / "joint.toml").read_text() == (kept / "joint.toml").read_text()
    one, two = (read_campaign([folder / "joint.csv.gz"], ratio=100) for folder in (tmp_path, kept))
    assert one.rows == two.rows == 44200
    # Another release of NumPy may round the last digit differently.
    assert one.column("lost_motion") == pytest.approx(two.column("lost_motion"), abs=2e-6)
    with gzip.open(kept / "joint.csv.gz", "rt") as stream:
        assert stream.readline().strip().startswith("run,time_s,torque_Nm")
