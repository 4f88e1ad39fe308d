"""A user's own effect as a formula: evaluated in Python, and compiled for the controller."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from conftest import needs_compiler
from lostmotion.discover import Value, formula
from lostmotion.effects.effect import Effect
from lostmotion.effects.formula import write_c
from lostmotion.effects.loading import load_shared_object
from lostmotion.errors import InputError

LIB = Path(__file__).parents[2] / "lib"
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror"]


def everything() -> Effect:
    """A formula with every operator and function."""
    return formula(
        "everything",
        "size_rad * (sin(2*pi*output_turns) + cos(input_angle_rad) ** 3 - tanh(wound_Nm / width_Nm)"
        " + exp(-abs(torque_Nm) / 10) + log(1 + cycles) + sqrt(abs(tilt_moment_Nm))"
        " + power(abs(axial_force_N), 0.3) + 2 ** 0.5 + sign(torque_Nm) * min(1, elapsed_s)"
        " + max(-1, sat(input_velocity_rad_s)) + 1000 * elastic_rad"
        " + (temperature_C - 20) / 40 + +output_acceleration_rad_s2)",
        values=[
            Value("size_rad", "linear", 1e-5, -1e-2, 1e-2),
            Value("width_Nm", "shape", 3.0, 1e-2, 1e3),
        ],
        mechanism='it does "everything" at once',
    )


def conditions(own: Effect) -> dict[str, np.ndarray]:
    generator = np.random.default_rng(1)
    names = {*own.needs, "torque_Nm", "elastic_rad", "wound_Nm"}
    run = {name: generator.normal(0, 3, 200) for name in sorted(names)}
    for name in ("cycles", "elapsed_s"):
        if name in run:
            run[name] = np.abs(run[name])
    return run


def compiled(own: Effect, folder: Path) -> Effect:
    source = folder / f"{own.name}.c"
    source.write_text(write_c(own))
    made = folder / f"{own.name}.so"
    command = ["cc", *STRICT, "-O2", "-ffp-contract=off", "-shared", "-fPIC"]
    command += ["-DLM_REAL_BITS=64", f"-I{LIB / 'include'}", f"-I{LIB}", str(source)]
    subprocess.run([*command, str(LIB / "runtime/elementary.c"), "-o", str(made)], check=True)
    return load_shared_object(made)[own.name]


@needs_compiler
def test_what_is_missing_beside_a_formula_is_named(tmp_path: Path) -> None:
    source, made = tmp_path / "everything.c", tmp_path / "everything.so"
    source.write_text(write_c(everything()))
    command = ["cc", "-std=c99", "-ffp-contract=off", "-shared", "-fPIC", "-DLM_REAL_BITS=64"]
    command += [f"-I{LIB / 'include'}", str(source), "-o", str(made)]
    subprocess.run(command, check=True)
    with pytest.raises(InputError, match=r"undefined symbol: lm_\w+, .*elementary\.c") as told:
        load_shared_object(made)
    missing, folder = str(told.value).split("together with ")[1].rstrip(")").split(" (-I ")
    subprocess.run([*command, f"-I{folder}", missing], check=True)
    assert set(load_shared_object(made)) == {"everything"}


@needs_compiler
def test_the_compiled_formula_is_the_evaluated_one(tmp_path: Path) -> None:
    own = everything()
    there = compiled(own, tmp_path)
    run = conditions(own)
    here = own.function(own.typical, run, np.zeros(1))
    assert np.ptp(here) > 1e-6
    np.testing.assert_allclose(there.function(own.typical, run, np.zeros(1)), here, rtol=1e-12)


@needs_compiler
def test_the_compiled_effect_has_the_same_card(tmp_path: Path) -> None:
    own = everything()
    there = compiled(own, tmp_path)
    assert (there.name, there.kind, there.values, there.needs) == (
        own.name,
        own.kind,
        own.values,
        own.needs,
    )
    assert (there.mechanism, there.equation) == (own.mechanism, own.equation)
    assert there.symbol == "lm_effect_everything"


def test_needs_are_the_conditions_that_the_formula_names() -> None:
    value = [Value("size_rad", "linear", 1.0, -1.0, 1.0)]
    made = formula("swing", "size_rad * sin(2 * pi * output_turns) * wound_Nm", values=value)
    assert made.needs == {"output_angle_rad", "torque_Nm"}
    run = {"torque_Nm": np.ones(3), "wound_Nm": np.full(3, 2.0)}
    run["output_angle_rad"] = np.array([0.0, np.pi / 2, np.pi])
    np.testing.assert_allclose(
        made.function(np.array([3.0]), run, np.zeros(1)), [0.0, 6.0, 0.0], atol=1e-12
    )


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("size_rad *", "an expression"),
        ("size_rad * torque", "did you mean 'torque_Nm'"),
        ("size_rad * sine(torque_Nm)", "one of sin"),
        ("size_rad * min(torque_Nm)", "min() of 2"),
        ("size_rad * __import__('os')", "one of sin"),
        ("size_rad * (torque_Nm > 0)", "numbers, names"),
        ("size_rad * torque_Nm.real", "numbers, names"),
        ("size_rad * 'a'", "numbers, names"),
        ("size_rad * True", "numbers, names"),
        ("torque_Nm * 1e-5", "size_rad"),
    ],
)
def test_what_is_no_formula_is_refused(text: str, complaint: str) -> None:
    with pytest.raises(InputError) as error:
        formula("swing", text, values=[Value("size_rad", "linear", 1.0, -1.0, 1.0)])
    assert complaint in str(error.value)


def test_a_name_that_is_none_in_c_is_refused() -> None:
    with pytest.raises(InputError, match="a name in C"):
        formula("two words", "torque_Nm", values=[])
