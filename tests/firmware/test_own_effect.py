"""A user's own effect goes from a formula in Python to the controller without another hand."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from measure import ALL, LIBRARY, M0, M4F, RV32, RV32F, Target
from needs import need
from test_examples import DRIVE, HERE, HOST, LOGGED, build, name_of, output_of, write_log

from lostmotion.cli import main
from lostmotion.recordings import read_campaign
from lostmotion.replay import conditions

FORMULA = """
from lostmotion.discover import Value, formula

ripple = formula(
    "ripple",
    "amplitude_rad * sin(2 * pi * 3 * output_turns) * tanh(wound_Nm / closing_Nm)",
    values=[
        Value("amplitude_rad", "linear", 1e-5, -1e-2, 1e-2),
        Value("closing_Nm", "shape", 2.0, 1e-2, 1e3),
    ],
)
"""
FITTED = """
[[effect]]
name = "ripple"
amplitude_arcsec = 12
closing_Nm = 3
[fit]
[fit.values]
"ripple.amplitude_rad" = 5.8e-5
"ripple.closing_Nm" = 3
"""
OPTIONS = ("-DLM_EFFECTS_MAX=8", "-DLM_EFFECT_MEMORY_MAX=8")


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with params.h and ripple.c by `lostmotion export`, and a log."""
    folder = tmp_path_factory.mktemp("own")
    (folder / "ripple.py").write_text(FORMULA)
    (folder / "joint.toml").write_text(DRIVE + FITTED)
    output = folder / "params.h"
    own = ["--effects", str(folder / "ripple.py")]
    assert main(["export", str(folder / "joint.toml"), *own, "-o", str(output)]) == 0
    write_log(folder / "log.csv")
    columns = conditions(read_campaign([folder / "log.csv"], ratio=100).runs[0])
    bits = np.column_stack([columns[name].view(np.uint32) for name in LOGGED])[:1500]
    lines = ("{" + ", ".join(f"0x{word:08x}u" for word in row) + "}," for row in bits)
    (folder / "log.h").write_text(
        f"#include <stdint.h>\n#define LOG_TICKS {len(bits)}\n"
        f"static const uint32_t log_bits[LOG_TICKS][{len(LOGGED)}] = {{\n"
        + "\n".join(lines)
        + "\n};\n"
    )
    return folder


def crc(target: Target, folder: Path, program: Path) -> str:
    """What the program prints of all bits that come out."""
    sources = [HERE / "replay_log.c", folder / "ripple.c"]
    options = (f"-I{folder}", *OPTIONS)
    code, text = output_of(target, build(target, sources, program, options, LIBRARY))
    assert code == 0, text
    return text


@pytest.mark.parametrize("target", [M4F, M0, RV32, RV32F, *ALL[-2:]], ids=name_of)
def test_a_formula_runs_on_the_controller_as_it_does_here(
    tmp_path: Path, exported: Path, target: Target
) -> None:
    here = crc(need(HOST), exported, tmp_path / "here")
    assert crc(need(target), exported, tmp_path / "there") == here


def test_the_formula_is_at_work(tmp_path: Path, exported: Path) -> None:
    with_it = crc(need(HOST), exported, tmp_path / "with")
    quiet = tmp_path / "quiet"
    quiet.mkdir()
    for file in ("log.h", "params.h"):
        (quiet / file).write_text((exported / file).read_text())
    source = (exported / "ripple.c").read_text()
    assert source.count("return ") == 1
    (quiet / "ripple.c").write_text(source.replace("return ", "return 0 * "))
    assert crc(need(HOST), quiet, tmp_path / "without") != with_it


def test_a_python_function_is_refused_for_the_controller(
    tmp_path: Path, exported: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = tmp_path / "ripple.py"
    own.write_text(
        "from lostmotion.discover import Value, effect\n"
        "@effect(values=[Value('amplitude_rad', 'linear', 1e-5, -1e-2, 1e-2),\n"
        "                Value('closing_Nm', 'shape', 2.0, 1e-2, 1e3)],\n"
        "        needs=['torque_Nm'])\n"
        "def ripple(p, at):\n    return p.amplitude_rad * at.torque_Nm\n"
    )
    command = ["export", str(exported / "joint.toml"), "--effects", str(own)]
    output = tmp_path / "params.h"
    assert main([*command, "-o", str(output)]) == 2
    assert "formula" in capsys.readouterr().err
    assert not output.exists()
    assert main(["export", str(exported / "joint.toml"), "-o", str(output)]) == 2
    assert "--effects" in capsys.readouterr().err
    assert os.listdir(tmp_path) == ["ripple.py"]
