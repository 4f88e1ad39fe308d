"""A search that starts from the designs of an earlier one."""

from __future__ import annotations

import csv
import json
import shutil
import threading
from pathlib import Path
from typing import Any

import pytest
from small_search import Write, left_by

from conftest import NO_SEARCH
from lostmotion import design
from lostmotion.design.spec import parse_spec
from lostmotion.errors import InputError

pytest.importorskip("lostmotion._search", reason=NO_SEARCH)


# --- a search that begins with the front of another one ---


def test_a_search_begins_with_the_designs_of_an_earlier_one(
    searched: tuple[Path, Path, dict[str, bytes]],
    write_spec: Write,
    small_spec: dict[str, Any],
    tmp_path: Path,
) -> None:
    shutil.copytree(searched[1], tmp_path / "run")
    small_spec["search"] |= {"start_from": "run", "evaluations": 1000, "seed": 4}
    spec = write_spec(small_spec)
    design.search(spec, tmp_path / "further", workers=2)
    expected = left_by(tmp_path / "further")
    with (tmp_path / "further" / "history.csv").open() as lines:
        first, *_, last = csv.DictReader(lines)
    with (tmp_path / "run" / "front.csv").open() as lines:
        designs = list(csv.DictReader(lines))
    assert int(first["tasks"]) == len(designs)
    before = json.loads((tmp_path / "run" / "certificate.json").read_text())
    after = json.loads((tmp_path / "further" / "certificate.json").read_text())
    key = "tolerance_lost_motion_arcmin"
    # another seed samples other drives: 1 % in the standard deviation
    assert after["figures"][key] <= 1.03 * before["figures"][key]
    assert float(last["best"]) <= (1 + 1e-5) * float(first["best"])
    # interrupted, it continues to the same bytes
    stop = threading.Event()
    stop.set()
    design.search(spec, tmp_path / "stopped", stop=stop)
    design.search(spec, tmp_path / "stopped", resume=True)
    assert left_by(tmp_path / "stopped") == expected


def test_designs_that_the_new_ranges_exclude_are_left_out(
    searched: tuple[Path, Path, dict[str, bytes]], small_spec: dict[str, Any], tmp_path: Path
) -> None:
    shutil.copytree(searched[1], tmp_path / "run")
    file = str(tmp_path / "spec.toml")
    with (tmp_path / "run" / "front.csv").open() as lines:
        designs = list(csv.DictReader(lines))
    small_spec["search"]["start_from"] = "run"
    kept = [line for line in parse_spec(small_spec, file).text.splitlines() if "start " in line]
    assert len(kept) == len(designs)
    for words, one in zip(kept, designs, strict=True):
        assert words.split()[1] == one["generator.type"]
        assert float(words.split()[-1]) == pytest.approx(float(one["tolerance.0.grade"]))
    coarsest = max(float(one["tolerance.0.grade"]) for one in designs)
    small_spec["search"]["range"]["tolerance.0.it_grade"] = [int(coarsest), 12]
    kept = [line for line in parse_spec(small_spec, file).text.splitlines() if "start " in line]
    assert len(kept) == sum(float(one["tolerance.0.grade"]) == coarsest for one in designs)
    small_spec["search"]["range"]["tolerance.0.it_grade"] = [11, 12]
    with pytest.raises(InputError, match=r"no design of .* in the ranges and choices"):
        parse_spec(small_spec, file)
    small_spec["search"]["range"]["teeth.tooth_height"] = [1.6, 1.8]
    with pytest.raises(InputError, match=r"without a column teeth\.tooth_height"):
        parse_spec(small_spec, file)


def test_more_designs_than_a_search_begins_with_are_drawn_along_the_front(
    searched: tuple[Path, Path, dict[str, bytes]], small_spec: dict[str, Any], tmp_path: Path
) -> None:
    (tmp_path / "run").mkdir()
    head, *rows = (searched[1] / "front.csv").read_text().splitlines()
    many = "\n".join([head, rows[0], *rows[1:-1] * 100, rows[-1]])
    (tmp_path / "run" / "front.csv").write_text(many)
    small_spec["search"]["start_from"] = "run"
    text = parse_spec(small_spec, str(tmp_path / "spec.toml")).text
    kept = [line for line in text.splitlines() if "start " in line]
    assert len(kept) == 64
    for line, row in ((kept[0], rows[0]), (kept[-1], rows[-1])):
        assert float(line.split()[3]) == float(row.split(",")[3])
