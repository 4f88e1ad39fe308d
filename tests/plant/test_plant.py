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
    check_page(table)


QUOTED = {
    "without compensation": ("", 0),
    "unfiltered sensor, 0.1 N m declared": ("raw sensor, error told", 3),
    "unfiltered current, 5 N m declared": ("raw current, error told", 3),
    "sensor, filter of [`torque.h`](reference/generated/torque_h.md)": ("sensor", 3),
    "current, the same filter": ("current", 3),
}
"""Rows of the page for move and dwell at 1 kHz: fault and column of the program's table."""


def check_page(table: str) -> None:
    """Compare the page's errors of an unfiltered torque with the program's."""
    cases = {}
    for line in table.splitlines()[1:]:
        kHz, *errors = line[52:].split()[:5]
        cases[line[:26].strip(), line[26:52].strip(), kHz] = errors
    page = (plant_table.ROOT / "bindings/python/docs/integration_reference.md").read_text()
    for row, (fault, column) in QUOTED.items():
        error = float(cases["move and dwell", fault, "1"][column])
        assert f"| {row} | {error:.0f} |" in page, (row, error)


def test_watch_leaves_ordinary_duty_alone_and_finds_misuse(made: tuple[Path, list[str]]) -> None:
    program, blobs = made
    status, said = plant_table.run(program, "duty", [blobs[0].partition("=")[2], "20"])
    assert status == 0, said


def test_an_axis_bounds_its_zero_turns_without_end_and_feeds_rates_to_an_output_loop(
    made: tuple[Path, list[str]], tmp_path: Path
) -> None:
    axis = plant_table.ROOT / "firmware_examples" / "axis"
    sources = [plant_table.HERE / name for name in ("axis.c", "plant.c", "joints.c")]
    sources += [axis / "lm_axis.c", axis / "lm_drive.c", *plant_table.LIBRARY]
    options = [*plant_table.FLAGS, "-DLM_PROFILE=LM_PROFILE_FULL", f"-I{axis}"]
    program = tmp_path / "axis"
    subprocess.run(["cc", *options, *map(str, sources), "-lm", "-o", program], check=True)
    blob = plant_table.export(tmp_path, made[0], [1], "soft")[0].partition("=")[2]
    done = subprocess.run([program, blob], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert done.stdout.count(" ok") == 12 * 4 + 2


def test_gap_profile_is_no_worse_than_a_constant_width(tmp_path: Path) -> None:
    program = plant_table.build(tmp_path, "GAP")
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_plant_shares_no_formula_with_the_library() -> None:
    for name in ("plant.c", "plant.h"):
        assert "lostmotion/" not in (plant_table.HERE / name).read_text()
