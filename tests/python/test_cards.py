"""All data of an effect are on its card: nothing else in the package names an effect."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from small_campaigns import RATED_NM, campaign

import lostmotion
from conftest import needs_compiler
from lostmotion.candidates.named import named_candidates
from lostmotion.candidates.own_forms import own_forms
from lostmotion.candidates.tangents import given_values, grid, resolved
from lostmotion.condition_cards import CARDS
from lostmotion.core import FILLED_IN, NEEDS, core
from lostmotion.discover import Effect, Value, effect, include_folder, library, load
from lostmotion.effects.conditions import MEASURED, Conditions
from lostmotion.effects.formula import formula, write_c
from lostmotion.errors import InputError
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.terms import start_values
from lostmotion.recordings import QUANTITIES

PACKAGE = Path(lostmotion.__file__).parent
LIB = Path(__file__).resolve().parents[2] / "lib"

OTHER_THINGS = {
    # An objective of the design search; a file beside the drive.
    "kinematic_error": ("design/spec.py", "simulators/arm.py"),
    "creep": ("controller/from_drive.py",),  # a setting of the controller's watch
    # A clearance between teeth.
    "gap_rad": (
        "model.py",
        "drives.py",
        "report/mesh.py",
        "report/teeth.py",
    ),
    # A dead zone that was characterized is written into a drive file as this effect; a fit has it
    # in the torsion curve.
    "free_play": ("drives.py", "fit/drive_file.py"),
    "takeup_Nm": (
        "drives.py",
        "characterize/characterization.py",
        "characterize/backlash.py",
        "characterize/three_slopes.py",
    ),
    "thermal_gap": ("commands/parser.py", "effects/template.py"),  # examples in prose
}
"""Words that also have another meaning in a file."""


def said_in(file: Path) -> set[str]:
    """Words in the strings of a file that are not prose, and its names of attributes."""
    tree = ast.parse(file.read_text())
    prose = {
        id(first.value)
        for node in ast.walk(tree)
        for first in (node.body if isinstance(getattr(node, "body", None), list) else ())
        if isinstance(first, ast.Expr)
    }
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
            found |= {node.value} | {w for w in re.findall(r"\w+", node.value) if "_" in w}
        elif isinstance(node, ast.Attribute):
            found.add(node.attr)
        elif isinstance(node, ast.keyword) and node.arg:
            found.add(node.arg)
    return found


def test_no_file_names_an_effect_or_one_of_its_values() -> None:
    values = {value.name for one in library().values() for value in one.values}
    general = {*NEEDS, "ratio", "share", "exponent"} | {v for v in values if "_" not in v}
    names = {*library(), *values} - general
    assert {"thermal_gap", "takeup_Nm", "onset_s", "threshold_Nm"} <= names
    named = {
        (str(file.relative_to(PACKAGE)), word)
        for file in PACKAGE.rglob("*.py")
        if file.parent.name != "own_forms"
        for word in said_in(file) & names
    }
    assert {(file, word) for file, word in named if file not in OTHER_THINGS.get(word, ())} == set()


def test_conditions_are_the_fields_that_the_library_has() -> None:
    assert set(MEASURED) < set(NEEDS)
    assert [name for name, _ in core(64).ffi.typeof("lm_conditions").fields] == [*NEEDS, *FILLED_IN]
    columns = [name for name, _ in core(64).ffi.typeof("lm_recording").fields]
    assert columns == ["count", *NEEDS, *FILLED_IN]
    assert CARDS.keys() == set(NEEDS)
    assert all(
        QUANTITIES[card.quantity].column == name for name, card in CARDS.items() if card.recorded[0]
    )


@pytest.mark.skipif(not (LIB / "runtime").exists(), reason="the C sources are not beside the tests")
@pytest.mark.parametrize("condition", ["tilt_moment_Nm", "axial_force_N"])
def test_a_condition_without_laws_of_its_own_is_stated_in_one_file(condition: str) -> None:
    quantity = CARDS[condition].quantity
    named = [f.name for f in PACKAGE.rglob("*.py") if quantity in f.read_text()]
    named += [
        f.name
        for f in LIB.rglob("*.[ch]")
        if f.parent.name != "effects" and quantity in f.read_text()
    ]
    assert named == ["condition_list.h"]


@pytest.mark.skipif(not (LIB / "runtime").exists(), reason="the C sources are not beside the tests")
def test_an_effect_is_a_file_and_a_row_of_the_list() -> None:
    rows = re.findall(r"EFFECT\((\w+)\)", (LIB / "include/lostmotion/effect_list.h").read_text())
    files = sorted(file.stem for file in (LIB / "runtime" / "effects").glob("*.c"))
    assert rows == files == sorted(library())
    others = [file for file in LIB.rglob("*.[ch]") if file.stem not in (*files, "effect_list")]
    assert [f.name for f in others for e in files if f"lm_effect_{e}" in f.read_text()] == []


def test_forms_of_their_own_belong_to_effects() -> None:
    assert own_forms()
    assert own_forms().keys() <= library().keys()


@pytest.fixture(scope="module")
def base() -> BaselineModel:
    return BaselineModel(Conditions(campaign()), RATED_NM)


def one_of(*values: Value, **more: object) -> Effect:
    make = effect(values=values, needs=["torque_Nm"], name="own", **more)  # type: ignore[arg-type]
    return make(lambda p, at: np.zeros_like(at.torque_Nm))


def shape(name: str, **more: object) -> Value:
    return Value(name, "shape", 1.0, 1e-3, 1e4, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["threshold_Nm", "gap_rad", "blend_rad_s", "closing_Nm"])
def test_what_a_value_is_called_does_not_state_whether_it_is_fitted(name: str) -> None:
    assert one_of(shape(name)).free() == [0]
    assert one_of(Value(name, "fixed", 1.0, 0.0, 2.0)).free() == []


@pytest.mark.parametrize("name", ["takeup_Nm", "threshold_Nm", "closing_Nm"])
def test_torques_start_where_the_card_states(name: str, base: BaselineModel) -> None:
    usual = [share * RATED_NM for share in (0.02, 0.1, 0.5)]
    assert grid(one_of(shape(name)), 0, base) == usual
    stated = shape(name, scale="rated_torque", starts=(0.3,))
    assert grid(one_of(stated), 0, base) == [0.3 * RATED_NM]
    stated = shape(name, scale="largest_torque", starts=(0.5,))
    assert grid(one_of(stated), 0, base) == [0.5 * base.largest]


def test_only_a_torque_starts_as_one_in_its_own_unit(base: BaselineModel) -> None:
    usual = [1e3 * share * RATED_NM for share in (0.02, 0.1)]
    assert grid(one_of(shape("closing_mNm")), 0, base)[:2] == pytest.approx(usual)
    for name in ("compliance_rad_per_Nm", "softening_per_Nm", "stiffness_Nm_per_rad"):
        assert grid(one_of(shape(name)), 0, base) == [0.25, 1.0, 4.0]


def test_a_value_without_a_torque_starts_about_what_is_typical(base: BaselineModel) -> None:
    assert grid(one_of(shape("exponent")), 0, base) == [0.25, 1.0, 4.0]
    assert grid(one_of(shape("exponent", starts=(0.5, 2.0))), 0, base) == [0.5, 2.0]


def test_the_card_states_what_is_given(base: BaselineModel) -> None:
    given = given_values(base, -80.0)
    values = [
        Value(name, "given", 3.0, -1e4, 1e4, scale)
        for name, scale in (("a", "ratio"), ("b", "rated_torque"), ("ratio", ""))
    ]
    assert start_values(one_of(*values), given).tolist() == [80.0, RATED_NM, 3.0]


def test_a_sign_is_that_of_the_ratio(base: BaselineModel) -> None:
    drag = one_of(Value("drag_Nm", "shape", 1.0, -5.0, 5.0, sign="ratio"))
    for ratio, low, high in ((80.0, 0.0, 5.0), (-80.0, -5.0, 0.0)):
        value = resolved(drag, base, ratio).values[0]
        assert (value.low, value.high) == (low, high)


def test_a_value_of_the_other_sign_is_another_effect() -> None:
    both = one_of(shape("stays_Nm"), Value("lost_Nm", "linear", 1.0, -9.0, 9.0, sign="first"))
    assert both.against_its_name(np.array([1.0, 0.5])) is None
    assert both.against_its_name(np.array([1.0, -0.5])) == 1


def test_what_the_baseline_absorbs_does_not_compete(base: BaselineModel) -> None:
    linear = Value("size_rad", "linear", 1e-5, -1.0, 1.0)
    own = one_of(linear, absorbed="the baseline follows it")
    found, closed = named_candidates({"own": own}, base, base.at(), 100.0)
    assert (found, closed) == ([], {"own": "not testable: the baseline follows it"})


def test_more_starts_than_a_card_holds_are_refused() -> None:
    with pytest.raises(InputError, match="5 start values"):
        one_of(shape("a_Nm", starts=(1.0, 2.0, 3.0, 4.0, 5.0)))


@needs_compiler
def test_a_card_states_the_same_in_c(tmp_path: Path) -> None:
    own = formula(
        "told",
        "size_rad * tanh(torque_Nm / closing_Nm) * threshold_Nm + given + law",
        values=[
            Value("size_rad", "linear", 1e-5, -1e-2, 1e-2, scales=True),
            Value("closing_Nm", "shape", 3.0, 1e-2, 1e3, "largest_torque", (0.25, 0.5), words="x"),
            Value("threshold_Nm", "fixed", 3.0, 1e-2, 1e3, sign="ratio"),
            Value("given", "given", 3.0, 1e-2, 1e3, "tooth_angle"),
            Value("law", "linear", 0.5, 0.0, 1.0, sign="first", between_runs=True),
        ],
        mechanism="says everything",
    )
    source, made = tmp_path / "told.c", tmp_path / "told.so"
    source.write_text(write_c(own))
    compiler = shutil.which("cc")
    assert compiler is not None
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    library_c = Path(include_folder()).parent / "runtime" / "elementary.c"
    include = [f"-I{include_folder()}", f"-I{include_folder().parent}"]
    command = [compiler, *flags, "-DLM_REAL_BITS=64", *include, source, library_c, "-o", made]
    subprocess.run(command, check=True)
    assert load(made)["told"].values == own.values
