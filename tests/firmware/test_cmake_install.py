"""The library is installed with the toolchain file of a project, then found by the project."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from measure import M4F, ROOT
from needs import need
from test_packages import run

TOOLCHAIN = """
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(flags "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -fdata-sections")
set(CMAKE_C_FLAGS_INIT "${flags} -ffunction-sections")
set(CMAKE_CXX_FLAGS_INIT "${flags} -ffunction-sections -fno-exceptions -fno-rtti")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-nostartfiles --specs=nosys.specs -Wl,--gc-sections,-e,main")
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
"""
PROJECT = """
cmake_minimum_required(VERSION 3.20)
project(joint LANGUAGES C CXX)
find_package(lostmotion 0.1 REQUIRED)
foreach(language c cpp)
  add_executable(joint_${language} joint.${language})
  target_link_libraries(joint_${language} PRIVATE lostmotion::lostmotion_runtime)
  target_compile_options(joint_${language} PRIVATE -Wall -Wextra -Wconversion -Wpedantic -Werror)
endforeach()
"""
JOINT = """
#include "lostmotion/runtime.h"
static lm_parameters parameters;
static lm_compensator joint;
#ifdef __cplusplus
extern "C"
#endif
int main(void) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  if (lm_start_compensator(&joint, &parameters, 0, 0) != LM_OK) {
    return 1;
  }
  parameters.effect[0].effect = &lm_effect_thermal_gap;
  return lm_step_compensator(&joint, &at).status != 0u;
}
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the toolchain file and the library installed by it, with room for two effects."""
    need(M4F)
    if shutil.which("cmake") is None:
        pytest.skip("no cmake: apt install cmake")
    if shutil.which("arm-none-eabi-g++") is None:
        pytest.skip("no arm-none-eabi-g++: apt install gcc-arm-none-eabi")
    folder = tmp_path_factory.mktemp("cmake")
    (folder / "arm.cmake").write_text(TOOLCHAIN)
    configure(folder, ROOT, "build", "-DLM_RUNTIME_DEFINITIONS=LM_EFFECTS_MAX=2;LM_EFFECT_CARDS=0")
    run(["cmake", "--build", folder / "build"])
    run(["cmake", "--install", folder / "build", "--prefix", folder / "prefix"])
    return folder


def has_cpp_library() -> bool:
    """Whether the compiler finds a C++ library; Debian has it in a separate package."""
    asked = ["arm-none-eabi-g++", "-print-file-name=libstdc++.a"]
    said = subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip()
    return said != "libstdc++.a"  # only the name is returned if there is none


def configure(folder: Path, source: Path, build: str, *options: str) -> None:
    """Configure a project for the controller, with only the toolchain stated."""
    toolchain = f"-DCMAKE_TOOLCHAIN_FILE={folder / 'arm.cmake'}"
    run(["cmake", "-S", source, "-B", folder / build, toolchain, *options])


@pytest.mark.parametrize("language", ["c", "cpp"])
def test_an_installed_runtime_needs_no_ram_of_its_own(installed: Path, language: str) -> None:
    if language == "cpp" and not has_cpp_library():
        pytest.skip("no C++ library for arm: apt install libstdc++-arm-none-eabi-newlib")
    source = installed / "source"
    source.mkdir(exist_ok=True)
    (source / "CMakeLists.txt").write_text(PROJECT)
    for suffix in ("c", "cpp"):
        (source / f"joint.{suffix}").write_text(JOINT)
    configure(installed, source, "joint", f"-DCMAKE_PREFIX_PATH={installed / 'prefix'}")
    run(["cmake", "--build", installed / "joint", "--target", f"joint_{language}"])
    objects = run(["arm-none-eabi-size", "-A", installed / "prefix/lib/liblostmotion_runtime.a"])
    ram = re.findall(r"^(\.(?:data|bss|got)\S*)\s+([1-9]\d*)", objects, re.MULTILINE)
    assert ram == []


def test_a_project_that_adds_the_checkout_builds_what_it_links_alone(tmp_path: Path) -> None:
    if shutil.which("cmake") is None:
        pytest.skip("no cmake: apt install cmake")
    source = tmp_path / "source"
    source.mkdir()
    (source / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.20)\nproject(joint LANGUAGES C)\n"
        f"add_subdirectory({ROOT} lostmotion)\nadd_executable(joint joint.c)\n"
        "target_link_libraries(joint PRIVATE lostmotion::lostmotion_runtime)\n"
        "target_compile_options(joint PRIVATE -ffast-math)\n"
    )
    host = '#include "lostmotion/runtime.h"\nint main(void) { return LM_REAL_BITS != 32; }\n'
    (source / "joint.c").write_text(host)
    run(["cmake", "-S", source, "-B", tmp_path / "build"])
    run(["cmake", "--build", tmp_path / "build"])
    archives = {file.name for file in (tmp_path / "build").rglob("*.a")}
    assert archives == {"liblostmotion_runtime.a"}
