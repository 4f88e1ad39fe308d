"""What a linker takes of the library that does nothing with unused sections."""

from __future__ import annotations

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
    assert "lm_effects_f32" not in table
    assert "lm_effect_" not in table.replace("lm_effect_use", "")


MISMATCH = """
#include <string.h>
#include "lostmotion/runtime.h"
#include "params.h"
static lm_compensator joint;
int main(void) {
  lm_fault fault;
  lm_status status = lm_start_compensator(&joint, &joint_parameters, 0, &fault);
  return status == LM_OK ? 1 : status == LM_CORRUPT && !strcmp(fault.input, "format") ? 2 : 3;
}
"""


@pytest.mark.parametrize(
    ("sizes", "answer"),
    [
        ([], 1),
        (["-DLM_PROFILE=LM_PROFILE_FULL"], 2),
        (["-DLM_PLAYS_MAX=9"], 2),
        (["-DLM_CURVE_POINTS_MAX=34"], 2),
        (["-DLM_EFFECTS_MAX=1"], 2),
        (["-DLM_EFFECT_MEMORY_MAX=1"], 2),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, list) else "",
)
def test_a_program_of_other_sizes_than_the_library_is_refused(
    tmp_path: Path, standard_library: Path, sizes: list[str], answer: int
) -> None:
    main = tmp_path / "main.c"
    main.write_text(MISMATCH)
    example = ROOT / "firmware_examples" / "joint"
    include = [f"-I{ROOT / 'lib' / 'include'}", f"-I{example}"]
    program = tmp_path / "program"
    run(["cc", "-std=c99", *include, *sizes, main, standard_library, "-o", program])
    done = subprocess.run([program], check=False)
    assert done.returncode == answer


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
