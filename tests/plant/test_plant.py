"""The compensator with an independent joint: every case at 1 and at 10 kHz."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import plant_table
import pytest


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """The program, and each blob with its rate."""
    folder = tmp_path_factory.mktemp("plant")
    program = plant_table.build(folder)
    return program, plant_table.export(folder, program, [1, 10])


def test_every_case_is_no_worse_than_none_and_none_rings(made: tuple[Path, list[str]]) -> None:
    program, blobs = made
    status, table = plant_table.run(program, "run", ["standard", *blobs])
    assert status == 0, table
    # Header and rows: nothing was left out.
    assert len(table.splitlines()) == 1 + 2 * 50, table


def test_watch_leaves_ordinary_duty_alone_and_finds_misuse(made: tuple[Path, list[str]]) -> None:
    program, blobs = made
    status, said = plant_table.run(program, "duty", [blobs[0].partition("=")[2], "20"])
    assert status == 0, said


def test_gap_profile_is_no_worse_than_a_constant_width(tmp_path: Path) -> None:
    program = plant_table.build(tmp_path, "GAP")
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_plant_shares_no_formula_with_the_library() -> None:
    for name in ("plant.c", "plant.h"):
        assert "lostmotion/" not in (plant_table.HERE / name).read_text()
