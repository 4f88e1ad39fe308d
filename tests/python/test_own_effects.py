"""A user's own effects, and their templates."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from small_campaigns import ARCSEC, answer_of, campaign

from conftest import needs_compiler
from lostmotion.discover import Value, effect, library
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.loading import load_python, load_shared_object
from lostmotion.effects.template import template
from lostmotion.errors import InputError

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("function", "found"),
    [(lambda p, at: 1 / 0, "ZeroDivisionError"), (lambda p, at: "x", "ValueError: could not")],
)
def test_an_effect_of_ones_own_that_fails_is_bad_input(function, found):
    own = effect(values=[], needs=["torque_Nm"], name="cable_pull")(function)
    with pytest.raises(InputError, match=f"effect cable_pull: found {found}"):
        own.function(np.zeros(0), {"torque_Nm": np.zeros(3)}, np.zeros(1))


@pytest.mark.parametrize(
    ("low", "high", "found"),
    [(1.0, 1.0, "1 to 1"), (2.0, -2.0, "2 to -2")],
)
def test_an_effect_that_no_fit_can_move_is_refused(low, high, found):
    size = Value("size_rad", role="linear", typical=1.0, low=low, high=high)
    with pytest.raises(InputError, match=f"pull: size_rad: found {found}, expected low below high"):
        effect(values=[size], needs=["torque_Nm"], name="pull")(lambda p, at: at.torque_Nm)


@pytest.mark.parametrize(
    "numbers", [{"typical": np.inf}, {"low": np.nan}, {"high": np.inf}, {"starts": (np.nan,)}]
)
def test_numbers_of_an_effect_are_finite(numbers):
    size = Value(
        **{"name": "size", "role": "linear", "typical": 1.0, "low": 0, "high": 2} | numbers
    )
    with pytest.raises(InputError, match=r"pull: size: found .*(inf|nan).*, expected finite"):
        effect(values=[size], needs=["torque_Nm"], name="pull")(lambda p, at: at.torque_Nm)


def test_an_effect_in_python_is_found_like_one_of_the_library():
    @effect(
        values=[Value("pull_rad", "linear", 1e-5, -1e-2, 1e-2)],
        needs=["torque_Nm"],
    )
    def cable_pull(p, at):
        return p.pull_rad * np.cos(2 * np.pi * at.wound_Nm / 5.0)

    data = campaign(seed=3, add=lambda columns, wound: 3.0 * np.cos(2 * np.pi * wound / 5.0))
    found = answer_of(data, effects={**library(), "cable_pull": cable_pull})
    assert found["effects"] == ["cable_pull"]
    assert found["candidates"][0]["parameters"]["pull_rad"] == pytest.approx(3 * ARCSEC, rel=0.1)


def write_template(folder, *, in_c):
    for name, text in template("cable_pull", in_c=in_c).items():
        (folder / name).write_text(text)


def run_its_test(folder):
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "test_cable_pull.py",
    ]
    subprocess.run(command, cwd=folder, check=True)


def test_the_python_template_runs_and_passes_its_own_test(tmp_path, monkeypatch):
    write_template(tmp_path, in_c=False)
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    before = set(tmp_path.iterdir())
    assert set(load_python(tmp_path / "cable_pull.py")) == {"cable_pull"}
    assert set(tmp_path.iterdir()) == before
    assert not sys.dont_write_bytecode
    run_its_test(tmp_path)


@needs_compiler
def test_the_c_template_passes_its_own_test_and_is_made_as_its_head_states(tmp_path):
    write_template(tmp_path, in_c=True)
    run_its_test(tmp_path)
    head = (tmp_path / "cable_pull.c").read_text().partition("*/")[0]
    said = [line.removeprefix(" *").strip() for line in head.splitlines()]
    made = [line for line in said if line.startswith(("headers=", "flags=", "cc "))]
    assert len(made) == 3
    made[0] = made[0].replace("python", sys.executable, 1)
    subprocess.run("\n".join(made), cwd=tmp_path, check=True, shell=True)
    assert set(load_shared_object(tmp_path / "cable_pull.so")) == {"cable_pull"}


@needs_compiler
def test_the_c_template_compiles_and_is_loaded_without_rebuilding(tmp_path):
    source = tmp_path / "cable_pull.c"
    source.write_text(template("cable_pull", in_c=True)["cable_pull.c"])
    made = tmp_path / "cable_pull.so"
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    command += [
        "-DLM_REAL_BITS=64",
        f"-I{ROOT / 'lib/include'}",
        str(source),
        "-o",
        str(made),
    ]
    subprocess.run(command, check=True)
    # A firmware in C++ may compile it as such, and finds it by its name in C.
    subprocess.run([*command[:1], "-x", "c++", *command[2:]], check=True)
    own = load_shared_object(made)["cable_pull"]
    conditions = Conditions(campaign(runs=2, rows=20))
    out = own.run(np.array([1e-6, 1.0]), conditions, conditions.torque, conditions.torque * 0)
    wanted = 1e-6 * (conditions.columns["temperature_C"] - 20) * np.clip(conditions.torque, -1, 1)
    np.testing.assert_allclose(out, wanted, atol=1e-18)


@pytest.mark.parametrize("name", ["Bad", "1st", "class", "a-b"])
def test_templates_refuse_names_that_are_no_identifiers(name):
    with pytest.raises(InputError, match="lower case"):
        template(name, in_c=False)


def test_templates_refuse_the_names_of_the_library():
    with pytest.raises(InputError, match="an effect of the library"):
        template("thermal_gap", in_c=False)
