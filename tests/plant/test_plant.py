"""The compensator round an independent joint; every case at 1 kHz (`./dev bench`: at 10 kHz too)."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import plant_table


def test_every_case_is_no_worse_than_none_and_none_rings(tmp_path: Path) -> None:
    program = plant_table.build(tmp_path)
    blobs = plant_table.export(tmp_path, program, [1])
    status, table = plant_table.run(program, blobs)
    assert status == 0, table
    # Header and rows: nothing was left out.
    assert len(table.splitlines()) == 34, table


def test_plant_shares_no_formula_with_the_library() -> None:
    for name in ("plant.c", "plant.h"):
        assert "lostmotion/" not in (plant_table.HERE / name).read_text()
