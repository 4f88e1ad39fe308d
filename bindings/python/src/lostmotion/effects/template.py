"""``lostmotion effects new``: a working template of a user's own effect, with its test."""

from __future__ import annotations

import keyword

from lostmotion.effects.library import library
from lostmotion.errors import InputError

NAME_MAX = 63
"""Characters by which C99 distinguishes names."""

PYTHON = '''"""A user's own effect: {name}. To use it:

lostmotion diagnose DRIVE DATA --effects {name}.py
lostmotion export DRIVE --effects {name}.py -o params.h
"""

from lostmotion.discover import Value, formula

# What a formula cannot express can be a function: see lostmotion.discover.effect.
{name} = formula(
    "{name}",
    "size_rad_per_K * (temperature_C - 20) * tanh(torque_Nm / closing_Nm)",
    values=[
        # The result is proportional to a linear value; a shape enters nonlinearly.
        Value("size_rad_per_K", role="linear", typical=5e-6, low=-1e-3, high=1e-3),
        Value("closing_Nm", role="shape", typical=1.0, low=1e-3, high=1e4),
    ],
    kind="angle",  # rad, added to the lost motion; "torque": N m; "width": factor on the friction;
    # "compliance": relative change of it
    mechanism="states in one sentence what happens in the drive",
)
'''

PYTHON_TEST = '''"""Test of {name}: run with pytest."""

import numpy as np

from {name} import {name}
'''

C_TEST = '''"""Test of {name}: run with pytest. It needs a C compiler that is called cc."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from lostmotion.discover import include_folder, load


@pytest.fixture
def {name}(tmp_path):
    made = tmp_path / "{name}.so"
    command = ["cc", "-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC"]
    command += ["-DLM_REAL_BITS=64", f"-I{{include_folder()}}"]
    subprocess.run([*command, Path(__file__).with_name("{name}.c"), "-o", made], check=True)
    return load(made)["{name}"]
'''

PROPORTIONAL = """

def test_{name}_is_proportional_to_its_linear_values({argument}):
    run = {{need: np.linspace(-1.0, 1.0, 11) for need in {name}.needs}}
    run["torque_Nm"] = np.linspace(-10.0, 10.0, 11)
    run["elastic_rad"] = 1e-5 * run["torque_Nm"]
    values = {name}.typical
    once = {name}.function(values, run, np.zeros(1))
    twice = values.copy()
    twice[{name}.indices("linear")] *= 2.0
    assert np.all(np.isfinite(once))
    assert np.any(once != 0.0)
    np.testing.assert_allclose({name}.function(twice, run, np.zeros(1)), 2.0 * once)
"""

C_SOURCE = """/* A user's own effect: {name}. The same file goes to the controller.
 *
 *   headers=$(python -c 'import lostmotion.discover as d; print(d.include_folder())')
 *   flags='-std=c99 -O2 -ffp-contract=off -shared -fPIC -DLM_REAL_BITS=64'
 *   cc $flags -I "$headers" {name}.c -o {name}.so
 *   lostmotion diagnose DRIVE DATA --effects {name}.so
 */
#include "lostmotion/effects.h"

enum {{ SIZE_RAD_PER_K, CLOSING_NM, VALUES }};

static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {{
  lm_real share = at->torque_Nm / value[CLOSING_NM];
  (void)memory;
  share = share > 1 ? 1 : share < -1 ? -1 : share;
  return value[SIZE_RAD_PER_K] * (at->temperature_C - LM_REFERENCE_TEMPERATURE_C) * share;
}}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {{
    "{name}",
    "states in one sentence what happens in the drive",
    "size (temperature - 20 C) sat(torque/closing)",
    "a few arc seconds",
    "thermal_gap",
    "soak at two temperatures",
    {{{{"size_rad_per_K", LM_VALUE_LINEAR, LM_REAL(5e-6), LM_VALUE_AS_USUAL}},
     {{"closing_Nm", LM_VALUE_SHAPE, LM_REAL(1), LM_VALUE_AS_USUAL}}}},
    LM_CARD_AS_USUAL}};
#endif

LM_BEGIN_DECLS
extern const lm_effect lm_user_effect;
LM_END_DECLS
const lm_effect lm_user_effect = {{
    {crc}u, /* CRC-32 of the name */
    LM_EFFECT_ANGLE,
    VALUES,
    0,
    LM_NEEDS_TORQUE | LM_NEEDS_TEMPERATURE,
    run,
    {{{{LM_REAL(-1e-3), LM_REAL(1e-3)}}, {{LM_REAL(1e-3), LM_REAL(1e4)}}}},
    LM_EFFECT_CARD(card)}};
"""


def template(name: str, *, in_c: bool) -> dict[str, str]:
    """Return the files of a template by name."""
    import zlib

    if not name.isidentifier() or keyword.iskeyword(name) or name != name.lower():
        raise InputError("NAME", "", f"'{name}'", "a lower case name such as cable_pull")
    if name in library():
        raise InputError("NAME", "", f"'{name}', an effect of the library", "a unique name")
    if len(name) > NAME_MAX:
        expected = f"a name of at most {NAME_MAX} characters"
        raise InputError("NAME", "", f"one of {len(name)} characters", expected)
    if in_c:
        crc = hex(zlib.crc32(name.encode()))
        return {
            f"{name}.c": C_SOURCE.format(name=name, crc=crc),
            f"test_{name}.py": (C_TEST + PROPORTIONAL).format(name=name, argument=name),
        }
    return {
        f"{name}.py": PYTHON.format(name=name),
        f"test_{name}.py": (PYTHON_TEST + PROPORTIONAL).format(name=name, argument=""),
    }
