"""Parts of the library that are linked if the linker does not remove unused sections."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from measure import ALL, LIBRARY, M4F, ROOT, Target, run
from needs import need

CONTROLLER = """
#include "lostmotion/runtime.h"
static lm_parameters parameters;
static lm_compensator joint;
static lm_memory memory;
int main(void) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  lm_recording recording = {0};
  lm_real angle_rad;
  if (lm_start_compensator(&joint, &parameters, 0, 0) == LM_OK) {
    (void)lm_step_compensator(&joint, &at);
  }
  lm_run_model(&parameters, &memory, &recording, &angle_rad);
  return 0;
}
"""


@pytest.mark.parametrize("target", [ALL[0], M4F], ids=lambda target: target.name)
def test_a_program_that_names_no_effect_links_none(tmp_path: Path, target: Target) -> None:
    compiler = need(target).compiler
    flags = [*target.flags, "-std=c99", "-O2"]
    flags += ["-DLM_REAL_BITS=32", "-DLM_PROFILE=LM_PROFILE_FULL"]
    flags += [f"-I{ROOT / 'lib' / 'include'}", f"-I{ROOT / 'lib'}"]
    objects = []
    for source in LIBRARY:
        objects.append(tmp_path / f"{source.stem}.o")
        run([compiler, *flags, "-c", source, "-o", objects[-1]])
    archive = tmp_path / "liblostmotion.a"
    run(["ar", "rcs", archive, *objects])
    main = tmp_path / "main.c"
    main.write_text(CONTROLLER)
    bare = ["-nostartfiles", "--specs=nosys.specs", "-Wl,-e,main"] if target.bare else []
    program = tmp_path / "program"
    run([compiler, *flags, main, archive, *bare, "-o", program])
    table = subprocess.run(["nm", program], capture_output=True, text=True, check=True).stdout
    assert "lm_step_compensator" in table
    assert "lm_effects" not in table
    assert "lm_effect_" not in table.replace("lm_effect_use", "")


OTHER_SIZES = [
    ["-DLM_PROFILE=LM_PROFILE_FULL"],
    ["-DLM_PLAYS_MAX=9"],
    ["-DLM_CURVE_POINTS_MAX=34"],
    ["-DLM_EFFECTS_MAX=1"],
    ["-DLM_EFFECT_MEMORY_MAX=1"],
    ["-DLM_REAL_BITS=64"],
]
STANDARD = "2_33_8_0_0_1_f32"
"""Profile and sizes of the standard library, as symbols carry them."""

FILLS = {
    "lm_build_curve": "static lm_curve it; (void)lm_build_curve(&it, 0, 0, 0, 0);",
    "lm_build_play_bank": "static lm_play_bank it; (void)lm_build_play_bank(&it, 0, 0, 0, 0);",
    "lm_center_plays": "static lm_play_memory it; lm_center_plays(&it, 0);",
    "lm_load_parameters": "static lm_parameters it; (void)lm_load_parameters(&it, 0, 0, 0, 0, 0);",
    "lm_start_compensator": "static lm_compensator it; (void)lm_start_compensator(&it, 0, 0, 0);",
    "lm_start_model": "static lm_memory it; lm_start_model(&it, 0);",
}
"""Functions that fill a struct of the caller whose size depends on profile.h."""


def link(folder: Path, sizes: list[str], library: Path, text: str) -> str:
    """Message of the linker for a program with these sizes; empty if it links."""
    (folder / "main.c").write_text(text)
    include = [f"-I{ROOT / 'lib' / 'include'}", f"-I{ROOT / 'firmware_examples' / 'joint'}"]
    command = ["cc", "-std=c99", *include, *sizes, "main.c", library, "-o", "program"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return done.stderr


@pytest.mark.parametrize(
    ("sizes", "name"),
    [
        *((sizes, "lm_start_compensator") for sizes in OTHER_SIZES),
        (["-DLM_ENVELOPE=0"], "lm_start_compensator"),
        *((OTHER_SIZES[1], name) for name in FILLS if name != "lm_start_compensator"),
    ],
    ids=lambda value: "".join(value),
)
def test_a_program_of_other_sizes_than_the_library_does_not_link(
    tmp_path: Path, standard_library: Path, sizes: list[str], name: str
) -> None:
    text = f'#include "lostmotion/runtime.h"\nint main(void) {{ {FILLS[name]} return 0; }}\n'
    assert link(tmp_path, [], standard_library, text) == ""
    said = link(tmp_path, sizes, standard_library, text)
    missing = re.search(rf"{name}_(\d+_\d+_\d+_\d+_\d+_\d+_f\d\d)\b", said)
    assert missing is not None, said
    assert missing[1] != STANDARD


def test_a_header_before_runtime_h_does_not_change_the_precision(tmp_path: Path) -> None:
    first = '#include "lostmotion/parameters.h"\n#include "lostmotion/runtime.h"\n'
    source = tmp_path / "main.c"
    source.write_text(first + "int main(void) { return sizeof(lm_real) != 4; }\n")
    command = ["cc", "-std=c99", f"-I{ROOT / 'lib' / 'include'}", "-fsyntax-only", str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "include lostmotion/runtime.h before other headers" in done.stderr
    assert run([*command, "-DLM_REAL_BITS=32"]) == ""


def test_no_name_of_the_interface_is_a_macro() -> None:
    for header in (ROOT / "lib" / "include" / "lostmotion").glob("*.h"):
        found = re.findall(
            r"^[ \t]*#[ \t]*define[ \t]+(?!LM_|LOSTMOTION_)\w+", header.read_text(), re.M
        )
        assert found == [], header.name


LOOKED_UP = [*FILLS, "lm_step_compensator", "lm_watch_output", "lm_effects", "lm_find_crc"]


def test_dlsym_and_a_debugger_find_functions_by_the_names_in_the_headers(
    tmp_path: Path, standard_library: Path
) -> None:
    sources = [str(file) for file in LIBRARY]
    include = [f"-I{ROOT / 'lib' / 'include'}", f"-I{ROOT / 'lib'}"]
    shared = tmp_path / "lostmotion.so"
    flags = ["-std=c99", "-g", "-O1", "-DLM_REAL_BITS=32", *include]
    run(["cc", *flags, "-shared", "-fPIC", *sources, "-o", shared])
    library = ctypes.CDLL(str(shared))
    for name in LOOKED_UP:
        assert getattr(library, name)
    if shutil.which("gdb") is None:
        pytest.skip("no gdb: apt install gdb")
    breaks = [word for name in FILLS for word in ("-ex", f"break {name}")]
    said = run(["gdb", "-batch", *breaks, shared])
    assert said.count("Breakpoint ") == len(FILLS), said


def test_cpp_takes_the_headers_in_a_namespace_with_names_of_its_own(
    tmp_path: Path, standard_library: Path
) -> None:
    if shutil.which("c++") is None:
        pytest.skip("no C++ compiler: apt install g++")
    text = """
#include "lostmotion/runtime.h"
struct joint { int lm_start_compensator(int axis) { return axis; } };
static lm_parameters parameters;
int main() {
  lm_compensator it;
  return joint().lm_start_compensator(0) + (lm_start_compensator(&it, &parameters, 0, 0) == LM_OK);
}
"""
    (tmp_path / "main.cpp").write_text(text)
    include = f"-I{ROOT / 'lib' / 'include'}"
    program = tmp_path / "program"
    run(["c++", "-std=c++11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", include,
         tmp_path / "main.cpp", standard_library, "-o", program])  # fmt: skip
    run([program])


PARAMETERS = """
#include "lostmotion/runtime.h"
#include "params.h"
const void *const compiled = &joint_parameters;
"""
STARTER = """
#include <string.h>
#include "lostmotion/runtime.h"
extern const void *const compiled;
static lm_compensator joint;
int main(void) {
  lm_fault fault;
  lm_status status = lm_start_compensator(&joint, (const lm_parameters *)compiled, 0, &fault);
  return status == LM_OK ? 1 : status == LM_CORRUPT && !strcmp(fault.input, "format") ? 2 : 3;
}
"""


@pytest.mark.parametrize("sizes", [[], *OTHER_SIZES], ids="".join)
def test_parameters_compiled_with_other_sizes_are_refused(
    tmp_path: Path, standard_library: Path, sizes: list[str]
) -> None:
    (tmp_path / "parameters.c").write_text(PARAMETERS)
    include = [f"-I{ROOT / 'lib' / 'include'}", f"-I{ROOT / 'firmware_examples' / 'joint'}"]
    made = tmp_path / "parameters.o"
    run(["cc", "-std=c99", *include, *sizes, "-c", tmp_path / "parameters.c", "-o", made])
    assert link(tmp_path, [str(made)], standard_library, STARTER) == ""
    done = subprocess.run([tmp_path / "program"], check=False)
    assert done.returncode == (2 if sizes else 1)


@pytest.fixture(scope="module")
def standard_library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run-time library of the standard profile."""
    folder = tmp_path_factory.mktemp("standard")
    objects = []
    for source in LIBRARY:
        objects.append(folder / f"{source.stem}.o")
        flags = ["-std=c99", "-DLM_REAL_BITS=32", f"-I{ROOT / 'lib' / 'include'}"]
        run(["cc", *flags, f"-I{ROOT / 'lib'}", "-c", source, "-o", objects[-1]])
    archive = folder / "liblostmotion.a"
    run(["ar", "rcs", archive, *objects])
    return archive
