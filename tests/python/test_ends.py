"""Variables at a bound of their range are listed with their price."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from conftest import NO_SEARCH
from lostmotion import design
from lostmotion.cli import main
from lostmotion.design.ends import at_ends

pytest.importorskip("lostmotion._search", reason=NO_SEARCH)

RANGES = {
    "teeth.flexspline_shift": (2.5, 4.0),
    "teeth.shift_difference": (-0.4, 0.6),
    "teeth.tooth_height": (1.6, 1.8),
    "flexspline.rim_thickness_mm": (0.55, 0.6),
}
SPEC = """
[search]
objectives = ["lost_motion"]
seed = 1
evaluations = 600
[search.fixed]
planar_only = true
"teeth.module_mm" = 0.25
"generator.type" = "discs"
"teeth.engagement_depth" = 1.2
[search.range]
"""


def test_what_is_at_an_end_is_listed_with_its_price(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text(SPEC + "".join(f'"{k}" = [{a}, {b}]\n' for k, (a, b) in RANGES.items()))
    assert main(["design", str(spec), "-o", str(tmp_path / "run")]) == 0
    out = capsys.readouterr().out
    with (tmp_path / "run" / "front.csv").open(encoding="utf-8") as rows:
        best = next(csv.DictReader(rows))
    expected = {
        key: side
        for key, ends in RANGES.items()
        for side, value in zip(("low", "high"), ends, strict=True)
        if float(best[key]) == pytest.approx(value, abs=1e-9)
    }
    assert expected  # the search moves some variable to its bound
    result = design.search(spec, tmp_path / "again")
    ends = (result.certificate or {})["at_ends"]
    assert {end["key"]: end["end"] for end in ends} == expected
    assert all(end["price"] >= 0 for end in ends)
    for line in at_ends(result.certificate or {}, "arcmin of lost_motion"):
        assert line in out
