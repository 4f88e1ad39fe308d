"""The examples run on every installed target, with the same results as on this machine."""

from __future__ import annotations

import functools
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from measure import (
    ALL,
    FLAGS,
    LIBRARY,
    M0,
    M4F,
    M7,
    M33,
    PAGE,
    ROOT,
    RV32,
    RV32F,
    TARGETS,
    Target,
    compile_objects,
    emulate,
)
from needs import need

from lostmotion.cli import main
from lostmotion.recordings import read_campaign
from lostmotion.replay import conditions

EXAMPLES = ROOT / "firmware_examples"
HERE = ROOT / "tests" / "firmware"
HOST = ALL[0]
JOINT = [EXAMPLES / "joint" / f"{name}.c" for name in ("main", "table", "loop", "motion")]
PLANT = [EXAMPLES / "joint" / f"{name}.c" for name in ("plant", "sine")]
AXIS = sorted((EXAMPLES / "axis").glob("*.c"))
GLUE = sorted((EXAMPLES / "glue").glob("*.c"))
GLUE += [EXAMPLES / "axis" / f"{name}.c" for name in ("lm_axis", "lm_drive")]
COMMISSIONING = [EXAMPLES / "commissioning" / f"{name}.c" for name in ("main", "commissioning")]
COMMISSIONING += [EXAMPLES / "joint" / "sine.c"]
MINIMAL = [EXAMPLES / "minimal" / "main.c"]
FAULT_EXIT_CODE = 99

REFERENCE = PAGE.parent / "integration_reference.md"
README = ROOT / "README.md"
MARKERS = r"<!-- minimal example -->\s*```c\n(.*?)```\s*<!-- end of minimal example -->"

BARE = [M0, M4F, M7, M33, RV32, RV32F]


def name_of(target: Target) -> str:
    return target.name


CORE = [file for file in LIBRARY if "effects" not in (file.parent.name, file.stem)]
"""The library without effects, which the build for a standard controller does not call."""


COMPILED = tempfile.TemporaryDirectory()
BUILT = ("-O2", "-DLM_EFFECT_CARDS=0")


@functools.cache
def objects_of(target: Target, library: tuple[Path, ...], sizes: tuple[str, ...]) -> list[Path]:
    """Compile the library once for all examples of a target that have it in the same sizes."""
    folder = Path(tempfile.mkdtemp(dir=COMPILED.name))
    return compile_objects(target, [*library], [*BUILT, *sizes], folder)


def build(
    target: Target,
    sources: list[Path],
    program: Path,
    options: tuple[str, ...] = (),
    sizes: tuple[str, ...] = (),
    library: list[Path] = CORE,
) -> Path:
    """Compile an example and link it with the library for a target.

    The library has the same `sizes` as the example; the other options are the example's alone.
    """
    command = [target.compiler, *target.flags, *options, *FLAGS, *BUILT, *sizes]
    command += [f"-I{EXAMPLES / name}" for name in ("joint", "log", "axis")]
    command += [*map(str, sources), str(TARGETS / target.start), str(TARGETS / "print.c")]
    command += [*map(str, objects_of(target, (*library,), sizes)), *target.link]
    command += ["-Wl,--gc-sections", "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return program


def output_of(target: Target, program: Path) -> tuple[int, str]:
    """Exit code and text; QEMU writes what a program prints to the standard error."""
    done = emulate(target, program, [])
    return done.returncode, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("target", "trials"),
    [(M4F, None), (M0, 2), (RV32, 2), (RV32F, 2)],
    ids=["Cortex-M4F", "Cortex-M0+", "RV32IMAC", "RV32IMAFC"],
)
def test_joint_keeps_its_bars_and_prints_the_same_as_here(
    tmp_path: Path, target: Target, trials: int | None
) -> None:
    options = () if trials is None else (f"-DJOINT_TRIALS={trials}",)
    here = build(need(HOST), JOINT + PLANT, tmp_path / "here", options)
    there = build(need(target), JOINT + PLANT, tmp_path / "there", options)
    code, text = output_of(target, there)
    assert code == 0, text
    assert text == output_of(HOST, here)[1]
    assert "all criteria are met" in text


@pytest.mark.parametrize("target", BARE, ids=name_of)
@pytest.mark.parametrize(
    "sources",
    [MINIMAL, GLUE, COMMISSIONING, AXIS],
    ids=["minimal", "glue", "commissioning", "axis"],
)
def test_small_examples_run(tmp_path: Path, target: Target, sources: list[Path]) -> None:
    program = build(need(target), sources, tmp_path / "example")
    assert output_of(target, program) == (0, "")


SIX_AXES = EXAMPLES / "six_axes"


@pytest.mark.parametrize("target", BARE, ids=name_of)
def test_six_axes_run_from_blobs(tmp_path: Path, target: Target) -> None:
    program = build(need(target), [SIX_AXES / "main.c"], tmp_path / "six_axes")
    code, text = output_of(target, program)
    assert code == 0, text
    ram = re.fullmatch(r"RAM of six axes, bytes: (\d+)\n", text)
    assert ram is not None, text
    quoted = re.search(r"six axes take ([\d,]+) bytes", REFERENCE.read_text())
    assert quoted is not None
    assert quoted[1].replace(",", "") == ram[1]


@pytest.mark.parametrize("target", [M4F, RV32F], ids=name_of)
def test_rate_helps_a_loop_on_the_output_as_the_page_states(tmp_path: Path, target: Target) -> None:
    sources = [EXAMPLES / "output_loop" / "main.c", EXAMPLES / "joint" / "motion.c", *PLANT]
    code, text = output_of(target, build(need(target), sources, tmp_path / "output_loop"))
    assert code == 0, text
    page = REFERENCE.read_text()
    for line in text.splitlines()[1:]:
        name, *figures = re.split(r" (?=[\d.]+(?: |$))", line)
        assert f"| {name} | {' | '.join(figures)} |" in page


def test_blobs_of_the_six_axes_are_what_export_writes(tmp_path: Path) -> None:
    made = tmp_path / "blobs.h"
    subprocess.run([sys.executable, SIX_AXES / "make_blobs.py", made], check=True)
    assert made.read_text() == (SIX_AXES / "blobs.h").read_text()


def test_example_of_the_readme_is_the_minimal_example() -> None:
    found = re.search(MARKERS, README.read_text(), re.DOTALL)
    assert found is not None
    assert found[1] == MINIMAL[0].read_text()


def test_readme_quotes_the_page_of_costs() -> None:
    row = next(
        x for x in PAGE.read_text().splitlines() if x.startswith("| Cortex-M4F | standard |")
    )
    cell = [x.strip() for x in row.split("|")[1:-1]]
    flash, ram, stack, step = cell[2], cell[6], cell[9], cell[12].split()[-1]
    quoted = re.sub(r"\s+", " ", README.read_text()).replace(",", "")
    assert f"takes {step} instructions on a Cortex-M4F" in quoted
    assert f"is {flash} bytes RAM {ram} bytes per axis stack {stack} " in quoted


@pytest.mark.parametrize("target", [M0, M4F, RV32], ids=name_of)
def test_fault_ends_with_a_code_instead_of_hanging(tmp_path: Path, target: Target) -> None:
    source = tmp_path / "fault.c"
    source.write_text('#include "target.h"\nint main(void) { __builtin_trap(); }\n')
    code, text = output_of(target, build(need(target), [source], tmp_path / "fault"))
    assert (code, text) == (FAULT_EXIT_CODE, "fault\n")


def identified(header: Path) -> tuple[np.ndarray, np.ndarray]:
    """Angles of the knots and shares of the operators in a params.h."""
    text = header.read_text()
    plays = re.findall(r"\{([\d.e-]+)f, \{[^}]*\}, ([\d.e-]+)f\}", text)
    arrays = re.findall(r"^ {5}\{\n(.*?)^ {5}\}", text, re.MULTILINE | re.DOTALL)
    angles = arrays[-2].partition("#if")[0]
    return np.array([float(x) for x in re.findall(r"[-\d.e]+(?=f)", angles)]), np.array(
        [[float(r), float(w)] for r, w in plays]
    )


def test_parameters_of_the_joint_come_from_its_test_bench(tmp_path: Path) -> None:
    bench = tmp_path / "bench"
    command = ["cc", "-std=c99", "-O2", "-ffp-contract=off", f"-I{EXAMPLES / 'joint'}"]
    command += [str(EXAMPLES / "bench" / "main.c"), *map(str, PLANT), "-o", str(bench)]
    subprocess.run(command, check=True)
    recording = tmp_path / "locked.csv"
    recording.write_text(subprocess.run([bench], capture_output=True, text=True, check=True).stdout)
    script = EXAMPLES / "joint" / "identify.py"
    done = subprocess.run(
        [sys.executable, script, recording, tmp_path / "params.h"],
        capture_output=True,
        text=True,
        check=True,
    )
    left_arcsec = float(re.search(r"leaves ([\d.]+) arcsec", done.stdout)[1])
    # The sensors' noise is 0.01 N m, 0.1 to 0.4 arcsec, and the encoder's step 0.3 arcsec.
    assert left_arcsec < 1.0
    angles, plays = identified(tmp_path / "params.h")
    kept_angles, kept_plays = identified(EXAMPLES / "joint" / "params.h")
    # Another release of the solver may stop slightly earlier.
    assert angles == pytest.approx(kept_angles, abs=2e-7)
    assert plays == pytest.approx(kept_plays, abs=2e-3)


def test_plant_and_library_share_no_code() -> None:
    for file in [*PLANT, EXAMPLES / "joint" / "plant.h", EXAMPLES / "bench" / "main.c"]:
        assert "lostmotion/" not in file.read_text()


DRIVE = """
[drive]
name = "joint"
ratio = 100
rated_torque_Nm = 40
[catalogue]
T1_Nm = 7
T2_Nm = 25
K1_Nm_per_rad = 16e3
K2_Nm_per_rad = 25e3
K3_Nm_per_rad = 29e3
hysteresis_arcmin = 1
[[effect]]
name = "thermal_friction"
rate_per_K = 0.02
[[effect]]
name = "kinematic_error"
cosine_2_arcsec = 8
sine_2_arcsec = 3
cosine_4_arcsec = 1
sine_4_arcsec = 2
[[effect]]
name = "inertia"
inertia_kg_m2 = 0.1
[[effect]]
name = "viscous_friction"
drag_Nm_s = 0.01
[[effect]]
name = "output_eccentricity"
cosine_arcsec = 20
sine_arcsec = 10
"""
EFFECTS = ("-DLM_EFFECTS_MAX=8", "-DLM_EFFECT_MEMORY_MAX=8")
LOGGED = (
    "torque_Nm",
    "temperature_C",
    "input_angle_rad",
    "output_angle_rad",
    "input_velocity_rad_s",
    "output_acceleration_rad_s2",
    "elapsed_s",
)


def write_log(file: Path) -> None:
    """A joint that swings against gravity while it warms up, with a noisy torque."""
    generator = np.random.default_rng(5)
    time = np.arange(4000) * 1e-3
    angle = 0.6 * np.sin(3.1 * time) + 0.2 * np.sin(7.3 * time)
    torque = -25 * np.sin(angle) + generator.normal(0, 0.002, time.size)
    torque[::500] *= 5
    temperature = 20 + 3 * time
    rows = np.column_stack((time, torque, angle * 100, angle + torque / 2e4, temperature))
    header = "time_s,torque_Nm,input_angle_rad,output_angle_rad,temperature_C"
    np.savetxt(file, rows, delimiter=",", header=header, comments="", fmt="%.17g")


@pytest.fixture(scope="module")
def replayed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Folder with params.h and log.h, and the result of `lostmotion replay`."""
    folder = tmp_path_factory.mktemp("replay")
    drive, log, answer = folder / "joint.toml", folder / "log.csv", folder / "answer.json"
    drive.write_text(DRIVE)
    write_log(log)
    assert main(["export", str(drive), "-o", str(folder / "params.h")]) == 0
    assert main(["replay", str(drive), str(log), "--json", str(answer)]) == 0
    columns = conditions(read_campaign([log], ratio=100).runs[0])
    bits = np.column_stack([columns[name].view(np.uint32) for name in LOGGED])
    lines = ("{" + ", ".join(f"0x{word:08x}u" for word in row) + "}," for row in bits)
    # The two-file library gives the same bits as any other build, and compiles quickly.
    subprocess.run([sys.executable, ROOT / "lib" / "amalgamate.py", folder], check=True)
    (folder / "lostmotion").mkdir()
    (folder / "lostmotion" / "runtime.h").write_text('#include "../lostmotion.h"\n')
    (folder / "log.h").write_text(
        f"#include <stdint.h>\n#define LOG_TICKS {len(bits)}\n"
        f"static const uint32_t log_bits[LOG_TICKS][{len(LOGGED)}] = {{\n"
        + "\n".join(lines)
        + "\n};\n"
    )
    return folder, json.loads(answer.read_text())["bits_crc32"]


@pytest.mark.parametrize("target", ALL, ids=name_of)
def test_replay_gives_the_bits_of_the_target(
    tmp_path: Path, replayed: tuple[Path, str], target: Target
) -> None:
    folder, expected = replayed
    own, library = (f"-I{folder}",), [folder / "lostmotion.c"]
    sources = [HERE / "replay_log.c"]
    program = build(need(target), sources, tmp_path / "replay", own, EFFECTS, library)
    assert output_of(target, program) == (0, f"{expected}{os.linesep}")
