"""A user's own effect, from a formula in Python to the controller without manual steps."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from measure import ALL, LIBRARY, M0, M4F, ROOT, RV32, RV32F, Target
from needs import need
from test_examples import DRIVE, HERE, HOST, LOGGED, build, name_of, output_of, write_log

from lostmotion.cli import main
from lostmotion.discover import load
from lostmotion.recordings import read_campaign
from lostmotion.replay import conditions, read_parameters, replay

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
TICKS = 1500
SIZES = ("-DLM_EFFECTS_MAX=8", "-DLM_EFFECT_MEMORY_MAX=8")


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
    bits = np.column_stack([columns[name].view(np.uint32) for name in LOGGED])[:TICKS]
    lines = ("{" + ", ".join(f"0x{word:08x}u" for word in row) + "}," for row in bits)
    (folder / "log.h").write_text(
        f"#include <stdint.h>\n#define LOG_TICKS {len(bits)}\n"
        f"static const uint32_t log_bits[LOG_TICKS][{len(LOGGED)}] = {{\n"
        + "\n".join(lines)
        + "\n};\n"
    )
    return folder


def crc(target: Target, folder: Path, program: Path) -> str:
    """Checksum of all result bits as printed by the program."""
    sources = [HERE / "replay_log.c", folder / "ripple.c"]
    build(target, sources, program, (f"-I{folder}",), SIZES, LIBRARY)
    code, text = output_of(target, program)
    assert code == 0, text
    return text


@pytest.mark.parametrize("target", [M4F, M0, RV32, RV32F, *ALL[-2:]], ids=name_of)
def test_a_formula_runs_on_the_controller_as_it_does_here(
    tmp_path: Path, exported: Path, target: Target
) -> None:
    here = crc(need(HOST), exported, tmp_path / "here")
    assert crc(need(target), exported, tmp_path / "there") == here


def shared(folder: Path, bits: int, name: str) -> Path:
    """Compile the exported effect as a shared object, in one of the two precisions."""
    made = folder / name
    flags = ["-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC", f"-DLM_REAL_BITS={bits}"]
    includes = [f"-I{ROOT / 'lib' / 'include'}", f"-I{ROOT / 'lib'}"]
    sources = [folder / "ripple.c", ROOT / "lib" / "runtime" / "elementary.c"]
    command = [need(HOST).compiler, *flags, *includes, *sources, "-o", made]
    subprocess.run(command, check=True)
    return made


def test_replay_gives_the_bits_of_the_controller(
    tmp_path: Path, exported: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = ["--effects", str(shared(exported, 32, "ripple_f32.so"))]
    log = tmp_path / "log.csv"
    rows = (exported / "log.csv").read_text().splitlines(keepends=True)
    log.write_text("".join(rows[: TICKS + 1]))
    blob = exported / "params.bin"
    formula = ["--effects", str(exported / "ripple.py")]
    assert main(["export", str(exported / "joint.toml"), *formula, "-o", str(blob)]) == 0
    expected = crc(need(HOST), exported, tmp_path / "here").strip()
    capsys.readouterr()
    assert main(["replay", str(exported / "joint.toml"), str(log), *own, "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["bits_crc32"] == expected
    parameters, _, _ = read_parameters(blob, {}, own=load(own[1], 32))
    assert replay(parameters, read_campaign([log], ratio=100)).answer()["bits_crc32"] == expected
    assert main(["replay", str(blob), str(log)]) == 2
    assert "effect: found one that is not known here" in capsys.readouterr().err


def test_replay_refuses_what_is_not_the_controllers_code(
    exported: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["replay", str(exported / "joint.toml"), str(exported / "log.csv")]
    double = str(shared(exported, 64, "ripple.so"))
    for own, found in (
        ([], "found ripple, expected an effect of the library"),
        (["--effects", str(exported / "ripple.py")], "compile the C file that export writes"),
        (["--effects", double], "found LM_REAL_BITS=64, expected LM_REAL_BITS=32"),
    ):
        assert main([*command, *own]) == 2
        line = capsys.readouterr().err
        assert found in line
        assert line.count("\n") == 1


def test_an_object_of_the_controllers_precision_is_refused_elsewhere(
    exported: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    single = str(shared(exported, 32, "ripple_f32.so"))
    assert main(["effects", "ripple", "--effects", single]) == 2
    assert "found LM_REAL_BITS=32, expected LM_REAL_BITS=64" in capsys.readouterr().err


def test_an_effect_under_the_number_of_another_name_is_refused(
    tmp_path: Path, exported: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = (exported / "ripple.c").read_text()
    (tmp_path / "ripple.c").write_text(source.replace('"ripple"', '"riddle"'))
    own = str(shared(tmp_path, 64, "ripple.so"))
    assert main(["effects", "--effects", own]) == 2
    assert "the CRC-32 of riddle" in capsys.readouterr().err


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
