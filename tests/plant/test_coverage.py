"""The figures of the page equal those that its command measures."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import coverage_table
import plant_table

PAGE = plant_table.ROOT / "bindings" / "python" / "docs" / "integration_reference.md"


def test_page_quotes_the_measured_coverage(tmp_path: Path) -> None:
    rows = coverage_table.measure(tmp_path).splitlines()
    assert len(rows) == 13
    page = PAGE.read_text().splitlines()
    assert [row for row in rows if row not in page] == []
