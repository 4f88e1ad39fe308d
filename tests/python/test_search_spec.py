"""Search specs: defaults, refusals, and the keys named in them."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import pytest
from small_search import SPECS, Write, format_spec

from conftest import DATA, NO_SEARCH
from lostmotion import design
from lostmotion.cli import main
from lostmotion.core import core
from lostmotion.design.spec import parse_spec
from lostmotion.errors import InputError

pytest.importorskip("lostmotion._search", reason=NO_SEARCH)


# --- specs ---


def test_the_shortest_spec_runs_and_states_what_it_took_for_granted(tmp_path: Path) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text(
        """
[search]
objectives = ["lost_motion", "stiffness", "cost"]
seed = 1
evaluations = 600
workers = 2
[search.fixed]
"teeth.module_mm" = 0.25
[search.range]
"generator.deflection_mm" = [0.2, 0.3]
"generator.type" = {choose = ["discs", "rollers", "cosine"]}
[search.limits]
safety_factor_min = 1.5
"""
    )
    result = design.search(spec, tmp_path / "run")
    assert result.finished
    assert result.objectives == ("lost_motion", "stiffness", "cost")
    assert result.larger_is_better == (False, True, False)
    assert result.best is not None
    assert "drive.rated_torque_Nm" in result.assumed
    assert "teeth.flexspline_teeth" in result.assumed


def test_any_unit_of_the_right_dimension_gives_the_same_search(small_spec: dict[str, Any]) -> None:
    text = parse_spec(small_spec).text
    small_spec["search"]["fixed"] = {"teeth.module_um": 250, "teeth.face_width_m": 0.01}
    assert parse_spec(small_spec).text == text


@pytest.mark.parametrize("width_um", [5, 25, 25.1, 39, 231.7, 250])
def test_a_stated_field_is_as_wide_as_it_states(
    small_spec: dict[str, Any], width_um: float
) -> None:
    del small_spec["search"]["range"]["tolerance.0.it_grade"]
    small_spec["design"]["tolerance"][0].update(lower_um=-4, upper_um=width_um - 4)
    said = re.search(r"^fixed tolerance\.0\.grade (.+)$", parse_spec(small_spec).text, re.MULTILINE)
    assert said is not None
    ffi, lib = core().ffi, core().lib
    one = ffi.new("double *")
    assert lib.lm_it_tolerance_continuous(48, float(said[1]), one, ffi.NULL) == 0
    assert one[0] == pytest.approx(width_um * 1e-3, rel=1e-12)
    whole = {25: 7, 39: 8, 250: 12}
    if width_um in whole:
        assert float(said[1]) == pytest.approx(whole[int(width_um)], abs=1e-12)


@pytest.mark.parametrize(("key", "value"), [("teeth.module_um", -250), ("teeth.module_mm", 5000.0)])
def test_a_size_that_no_gear_has_is_refused_by_its_key_without_a_rated_torque(
    small_spec: dict[str, Any], write_spec: Write, tmp_path: Path, key: str, value: float
) -> None:
    del small_spec["drive"]["rated_torque_Nm"]
    del small_spec["search"]["fixed"]["teeth.module_mm"]
    small_spec["search"]["fixed"][key] = value
    with pytest.raises(InputError, match=rf"search\.fixed\.{re.escape(key)}: found"):
        design.search(write_spec(small_spec), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_field_beyond_all_grades_is_refused(small_spec: dict[str, Any]) -> None:
    del small_spec["search"]["range"]["tolerance.0.it_grade"]
    small_spec["design"]["tolerance"][0].update(lower_um=0, upper_um=3.9)
    found = r"found a field of 0.0039 mm, expected from IT 3 \(0.004 mm\) to IT 12 \(0.25 mm\)"
    with pytest.raises(InputError, match=found):
        parse_spec(small_spec)


def test_what_a_search_does_anyway_may_be_fixed(small_spec: dict[str, Any]) -> None:
    del small_spec["search"]["range"]["teeth.flexspline_teeth"]
    fixed = small_spec["search"]["fixed"]
    fixed["teeth.flexspline_teeth"] = 200
    text = parse_spec(small_spec).text
    fixed.update({"teeth.rigid_teeth": 202, "generator.floating": True})
    fixed["generator.eccentricity_mm"] = 0
    assert parse_spec(small_spec).text == text
    fixed["teeth.rigid_teeth"] = 200
    with pytest.raises(InputError, match=r"rigid_teeth: found 200, expected 202"):
        parse_spec(small_spec)


def test_the_optimizers_own_texts_are_those_of_the_specs() -> None:
    sys.path.insert(0, str(DATA / "specs"))
    from derive import FOLDERS, derived

    specs = [file for folder in FOLDERS for file in folder.glob("*.toml")]
    assert {file.stem for file in specs} > set(SPECS)
    for file in specs:
        assert file.with_suffix(".search").read_text(encoding="utf-8") == derived(file)


BAD: list[tuple[str, Any, tuple[str, ...]]] = [
    ("search.objectives", ["lost_moton"], ("search.objectives", "did you mean 'lost_motion'")),
    ("search.objectives", [], ("search.objectives",)),
    ("search.objectives", [{"kind": "ball"}], ("search.objectives", "a table", "a list of one")),
    ("search.evaluations", 5, ("search.evaluations", "10 to 1")),
    ("search.seeed", 5, ("search.seeed", "did you mean 'seed'")),
    ("search.level", "best", ("search.level", "'worst', 'probable', 'quantile'")),
    ("search.fixed", {}, ("teeth.module_mm", "nothing")),
    ("search.fixed", {"teeth.module_Nm": 1}, ("teeth.module_Nm", "a length")),
    ("search.fixed", {"teeth.module": 1}, ("teeth.module", "no unit")),
    ("search.fixed", {"teeth.modul_mm": 1}, ("teeth.modul_mm", "did you mean 'teeth.module_mm'")),
    ("search.fixed", {"teeth.module_mm": "1"}, ("teeth.module_mm", "'1'", "a number")),
    ("search.fixed", {"teeth.module_mm": -1}, ("teeth.module_mm", "0.05 to 10")),
    (
        "search.fixed",
        {"teeth.module_mm": 0.25, "teeth.rigid_teeth": 202},
        ("teeth.rigid_teeth", "no teeth.flexspline_teeth beside it"),
    ),
    ("search.range", {"teeth.rigid_teeth": [198, 202]}, ("teeth.rigid_teeth", "it follows")),
    (
        "search.fixed",
        {"generator.floating": False},
        ("generator.floating", "a floating wave generator"),
    ),
    (
        "search.fixed",
        {"generator.eccentricity_mm": 0.01},
        ("eccentricity_mm", "without eccentricity"),
    ),
    ("search.range", {"generator.type": [1, 2]}, ("generator.type", "choose")),
    ("search.range", {"generator.type": {"choose": ["disc"]}}, ("did you mean 'discs'",)),
    ("search.fixed", {"teeth.module_mm": 0.25, "axial_sections": 2.6}, ("2.6", "a whole number")),
    ("search.range", {"axial_sections": [1, 3]}, ("axial_sections", "[search.fixed]")),
    ("search.range", {"axial_sections": {"choose": [1, 3]}}, ("axial_sections", "[search.fixed]")),
    ("search.range", {"teeth.flexspline_teeth": {"choose": [200, 201]}}, ("an even number",)),
    ("search.fixed", {"teeth.module_mm": 0}, ("teeth.module_mm", "found 0", "0.05 to 10")),
    ("search.range", {"teeth.tooth_height": [2, 2]}, ("one value goes into [search.fixed]",)),
    ("search.start_from", "nowhere", ("search.start_from", "nowhere", "front.csv")),
    ("search.start_from", "no\0where", ("search.start_from", "front.csv")),
    ("search.start_from", 3, ("search.start_from", "text")),
    (
        "search.range",
        {"teeth.tooth_height": [2, 1]},
        ("teeth.tooth_height", "[2, 1]", "low below high"),
    ),
    ("search.range", {"teeth.module_mm": [0.2, 0.3]}, ("a second value", "search.fixed")),
    ("search.range", {"teeth.module_um": {"choose": [250, 300]}}, ("a second value", "module_mm")),
    (
        "search.fixed",
        {"teeth.module_mm": 0.25, "generator.deflection_mm": 0.25},
        ("search.range.generator.deflection_modules", "search.fixed.generator.deflection_mm"),
    ),
    (
        "search.fixed",
        {"teeth.module_mm": 0.25, "teeth.rigid_shift": 3},
        ("search.range.teeth.shift_difference", "search.fixed.teeth.rigid_shift"),
    ),
    (
        "search.range",
        {f"tolerance.{i}.it_grade": [5, 9] for i in (0, 3)},
        ("tolerance 3", "1 tables"),
    ),
    ("search.limits", {"safety": 2}, ("search.limits.safety", "safety_factor_min")),
    ("search.limits", {"gap_min_Nm": 2}, ("gap_min_Nm", "an angle")),
    ("search.limits", {"ratio": [3, 4]}, ("teeth", "a ratio in the window")),
    ("search.limits", {"ratio": 3}, ("search.limits.ratio", "[lowest, highest]")),
    ("search.limits", {"free_assembly": 1}, ("free_assembly", "true or false")),
    ("search.cost", {"sise": 2}, ("search.cost.sise", "did you mean 'size'")),
    ("drive.rated_torque_N", 40, ("drive.rated_torque_N", "a torque")),
    ("design.tolerance", [{"kind": "bolt"}], ("design.tolerance[0]",)),
    ("design.teeth", {"module_mm": 1}, ("design.teeth", "search.fixed")),
    ("other", {}, ("other", "an unknown table")),
]


@pytest.mark.parametrize(("place", "value", "parts"), BAD)
def test_a_bad_spec_is_refused_by_its_key(
    place: str, value: Any, parts: tuple[str, ...], small_spec: dict[str, Any]
) -> None:
    *path, last = place.split(".")
    table = small_spec
    for name in path:
        table = table[name]
    table[last] = value
    with pytest.raises(InputError) as refused:
        parse_spec(small_spec, "spec.toml")
    for part in ("spec.toml", "found", "expected", *parts):
        assert part in str(refused.value)


def test_a_spec_among_the_names_of_the_results_is_kept(
    small_spec: dict[str, Any],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    text = format_spec(small_spec)
    Path("best.toml").write_text(text)
    assert main(["design", "best.toml", "-o", ".", "-q"]) == 2
    said = "lostmotion: ./best.toml: found the spec under the name of a result, expected another"
    assert capsys.readouterr().err.startswith(said)
    Path("spec.toml").write_text(text)
    assert main(["design", "spec.toml", "-o", ".", "-q"]) == 2
    assert "best.toml: found a file that no search in this folder" in capsys.readouterr().err
    assert {p.name: p.read_text() for p in Path().iterdir()} == {
        "best.toml": text,
        "spec.toml": text,
    }


@pytest.mark.parametrize(
    "content",
    [b"", b"verified\n", b"\xff\xfe", b"\0", b'verified,"a\n1,2\n', b"a,a\n1\n", b"," * 200_000],
)
def test_a_front_that_is_none_is_refused(
    content: bytes, write_spec: Write, small_spec: dict[str, Any], tmp_path: Path
) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "front.csv").write_bytes(content)
    small_spec["search"]["start_from"] = "run"
    with pytest.raises(InputError, match=r"search\.start_from"):
        parse_spec(small_spec, str(tmp_path / "spec.toml"))


def test_too_many_combinations_are_counted(small_spec: dict[str, Any]) -> None:
    small_spec["search"]["range"] |= {
        "teeth.flexspline_teeth": {"choose": list(range(150, 270, 2))},
        "teeth.root_clearance": {"choose": [0.2 + 0.001 * i for i in range(60)]},
        "teeth.rack_addendum": {"choose": [0.9 + 0.001 * i for i in range(60)]},
    }
    with pytest.raises(InputError, match=r"\d{6} combinations of choices, expected at most 20000"):
        parse_spec(small_spec)


def test_one_window_of_ratios_is_not_for_two_deformations(small_spec: dict[str, Any]) -> None:
    search = small_spec["search"]
    search["rigid_gear_turns"] = True
    search["fixed"].pop("teeth.deformation", None)
    search["fixed"].pop("teeth.flexspline_teeth", None)
    search["range"].pop("teeth.flexspline_teeth", None)
    search["limits"] = {"ratio": [98, 98]}
    search["range"]["teeth.deformation"] = {"choose": ["internal", "external"]}
    search["range"]["generator.type"] = {"choose": ["discs", "ring"]}
    with pytest.raises(InputError, match="found both deformations and a ratio"):
        parse_spec(small_spec)
    search["range"]["teeth.deformation"] = {"choose": ["external"]}
    assert "choose teeth.flexspline_teeth 198\n" in parse_spec(small_spec).text
