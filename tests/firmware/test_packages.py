"""lib/ as a package for PlatformIO, ESP-IDF, Zephyr and Arduino: each package is made and then
built."""

from __future__ import annotations

import fnmatch
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest
from measure import ALL, M4F, TARGETS, Target, emulate
from needs import need, tool

ROOT = Path(__file__).resolve().parents[2]
LIB = ROOT / "lib"
JOINT = ROOT / "firmware_examples" / "joint"
MINIMAL = ROOT / "firmware_examples" / "minimal" / "main.c"
SECONDS = 120

# For `extractall`: Python has this argument from 3.11.4 on; Debian 12 is older.
SAFELY = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}

PROFILES = ("GAP", "STANDARD", "FULL")
SIZES = ("CURVE_POINTS_MAX", "PLAYS_MAX", "EFFECTS_MAX", "EFFECT_MEMORY_MAX", "ENVELOPE")

QUIET = {
    **os.environ,
    "PLATFORMIO_SETTING_ENABLE_TELEMETRY": "No",
    "IDF_COMPONENT_CHECK_NEW_VERSION": "0",
}


def run(command: list[object], **options: object) -> str:
    words = [str(word) for word in command]
    done = subprocess.run(
        words, capture_output=True, text=True, check=False, timeout=SECONDS, **options
    )
    assert done.returncode == 0, f"{' '.join(words)}\n{done.stdout}{done.stderr}"
    return done.stdout


def unpack(archive: Path, folder: Path) -> Path:
    with tarfile.open(archive) as tar:
        tar.extractall(folder, **SAFELY)
    return folder


def copy_of_lib(folder: Path) -> Path:
    """A copy of lib/ outside the checkout, under the name of the package."""
    return Path(shutil.copytree(LIB, folder / "lostmotion"))


def build_minimal(folder: Path, sources: list[Path], flags: list[str]) -> None:
    """Compile sources as a package states, link the minimal example, run it."""
    objects = []
    for index, source in enumerate(sources):
        objects.append(folder / f"{index}.o")
        run(["cc", "-std=gnu11", *flags, "-c", source, "-o", objects[-1]])
    include = [flag for flag in flags if flag.startswith("-I")]
    run(["cc", "-std=gnu11", *include, f"-I{JOINT}", MINIMAL, *objects, "-o", folder / "minimal"])
    run([folder / "minimal"])


def test_every_manifest_has_the_version_and_the_licence_of_the_project() -> None:
    project = (ROOT / "CMakeLists.txt").read_text()
    version = re.search(r"project\(lostmotion VERSION ([\d.]+)", project)[1]
    assert json.loads((LIB / "library.json").read_text())["version"] == version
    properties = (LIB / "library.properties").read_text()
    assert f"version={version}\n" in properties
    assert f'version: "{version}"\n' in (LIB / "idf_component.yml").read_text()
    assert (LIB / "LICENSE").read_text() == (ROOT / "LICENSE").read_text()
    major, minor, patch = (int(part) for part in version.split("."))
    assert max(minor, patch) < 100
    probe = '#include "lostmotion/status.h"\nLM_VERSION_MAJOR LM_VERSION_MINOR LM_VERSION_PATCH\n'
    whole = f"#if LM_VERSION != {10000 * major + 100 * minor + patch}\n#error\n#endif\n"
    command = ["cc", "-E", "-P", f"-I{LIB / 'include'}", "-x", "c", "-"]
    said = run(command, input=probe + whole).splitlines()
    assert said[-1].split() == [str(major), str(minor), str(patch)]


def platformio_sources(root: Path, manifest: dict[str, dict[str, list[str]]]) -> list[Path]:
    """Files that the source filter of library.json keeps, by PlatformIO's rules."""
    chosen: set[Path] = set()
    for word in manifest["build"]["srcFilter"]:
        sign, pattern = word[0], word[2:-1]
        pattern = pattern + "*" if pattern.endswith("/") else pattern
        names = {file.relative_to(root).as_posix(): file for file in root.rglob("*.c")}
        found = {names[name] for name in fnmatch.filter(names, pattern)}
        chosen = chosen | found if sign == "+" else chosen - found
    return sorted(chosen)


def build_as_platformio(root: Path, folder: Path) -> None:
    manifest = json.loads((root / "library.json").read_text())
    sources = platformio_sources(root, manifest)
    assert len(sources) == 1 + len(list((LIB / "runtime").rglob("*.c")))
    flags = [flag.replace("-I.", f"-I{root}") for flag in manifest["build"]["flags"]]
    build_minimal(folder, sources, [*flags, f"-I{root / manifest['build']['includeDir']}"])


def test_platformio_manifest_builds(tmp_path: Path) -> None:
    build_as_platformio(LIB, tmp_path)


def test_platformio_packs_what_is_needed(tmp_path: Path) -> None:
    pio = tool("pio", "platformio")
    root = copy_of_lib(tmp_path)
    environment = {**QUIET, "PLATFORMIO_CORE_DIR": str(tmp_path / "core")}
    command = [pio, "pkg", "pack", str(root), "-o", str(tmp_path)]
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, timeout=SECONDS, env=environment
    )
    if "SPDX" in done.stderr:
        # It looks the licence up in a list on the network: without a network, pack without it.
        manifest = json.loads((root / "library.json").read_text())
        del manifest["license"]
        (root / "library.json").write_text(json.dumps(manifest))
        run(command, env=environment)
    archive = next(tmp_path.glob("*.tar.gz"))
    build_as_platformio(unpack(archive, tmp_path / "unpacked"), tmp_path)


STUBS = {
    # Behaviour of the CMake functions of both systems, as far as this library calls them.
    "idf": """
function(idf_component_register)
  cmake_parse_arguments(own "" "" "SRCS;INCLUDE_DIRS;PRIV_INCLUDE_DIRS;REQUIRES" ${ARGN})
  add_library(${COMPONENT_LIB} STATIC ${own_SRCS})
  foreach(scope INCLUDE_DIRS PRIV_INCLUDE_DIRS)
    foreach(folder ${own_${scope}})
      get_filename_component(folder ${folder} ABSOLUTE BASE_DIR ${CMAKE_CURRENT_LIST_DIR})
      if(NOT IS_DIRECTORY ${folder})
        message(FATAL_ERROR "Include directory '${folder}' is not a directory.")
      endif()
      list(APPEND absolute_${scope} ${folder})
    endforeach()
  endforeach()
  target_include_directories(${COMPONENT_LIB}
    PUBLIC ${absolute_INCLUDE_DIRS} PRIVATE ${absolute_PRIV_INCLUDE_DIRS})
endfunction()
set(ESP_PLATFORM ON)
set(COMPONENT_LIB __idf_lostmotion)
add_subdirectory(${PACKAGE} component)
target_link_libraries(minimal PRIVATE ${COMPONENT_LIB})
""",
    "zephyr": """
add_library(zephyr_interface INTERFACE)
macro(zephyr_library_named name)
  set(ZEPHYR_CURRENT_LIBRARY ${name})
  add_library(${name} STATIC)
  target_link_libraries(${name} PRIVATE zephyr_interface)
endmacro()
function(zephyr_library_sources)
  target_sources(${ZEPHYR_CURRENT_LIBRARY} PRIVATE ${ARGN})
endfunction()
function(zephyr_library_include_directories)
  target_include_directories(${ZEPHYR_CURRENT_LIBRARY} PRIVATE ${ARGN})
endfunction()
function(zephyr_library_compile_options)
  target_compile_options(${ZEPHYR_CURRENT_LIBRARY} PRIVATE ${ARGN})
endfunction()
function(zephyr_include_directories)
  target_include_directories(zephyr_interface INTERFACE ${ARGN})
endfunction()
function(zephyr_compile_definitions)
  target_compile_definitions(zephyr_interface INTERFACE ${ARGN})
endfunction()
set(CONFIG_LOSTMOTION y)
add_subdirectory(${PACKAGE}/zephyr module)
target_link_libraries(minimal PRIVATE lostmotion zephyr_interface)
""",
}


def build_with_stubs(
    folder: Path, system: str, package: Path, configuration: dict[str, str]
) -> str:
    """Build a package as its system does, run the example; returns the compiler's commands."""
    project = folder / "project"
    project.mkdir()
    lines = "".join(f"set({name} {value})\n" for name, value in configuration.items())
    (project / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.20)\nproject(user C)\n"
        "set(CMAKE_C_STANDARD 11)\nset(CMAKE_EXPORT_COMPILE_COMMANDS ON)\n"
        f'set(PACKAGE "{package}")\n{lines}'
        f'add_executable(minimal "{MINIMAL}")\n'
        f'target_include_directories(minimal PRIVATE "{JOINT}")\n' + STUBS[system]
    )
    run(["cmake", "-S", project, "-B", folder / "build"])
    run(["cmake", "--build", folder / "build", "--parallel", "2"])
    run([folder / "build" / "minimal"])
    return (folder / "build" / "compile_commands.json").read_text()


def test_zephyr_module_builds(tmp_path: Path) -> None:
    # The keys that a module.yml may have, by Zephyr's documentation on modules.
    text = (LIB / "zephyr" / "module.yml").read_text()
    keys = dict(re.findall(r"^ *(\w+):[ \t]*(\S*)$", text, re.MULTILINE))
    assert keys == {
        "name": "lostmotion",
        "build": "",
        "cmake": "zephyr",
        "kconfig": "zephyr/Kconfig",
    }
    assert (LIB / keys["cmake"] / "CMakeLists.txt").is_file()
    assert (LIB / keys["kconfig"]).is_file()
    configuration = {"CONFIG_LOSTMOTION_PROFILE_STANDARD": "y", "CONFIG_LOSTMOTION_PLAYS_MAX": "12"}
    commands = build_with_stubs(tmp_path, "zephyr", LIB, configuration)
    # Library and user have the same sizes; only the library has the floating-point flag.
    assert commands.count("-DLM_PLAYS_MAX=12") == commands.count('"command"')
    assert commands.count("-ffp-contract=off") == commands.count('"command"') - 1


def test_esp_idf_component_builds_from_its_package(tmp_path: Path) -> None:
    compote = tool("compote", "idf-component-manager")
    root = copy_of_lib(tmp_path)
    run([compote, "component", "pack", "--name", "lostmotion"], cwd=root, env=QUIET)
    package = unpack(next((root / "dist").glob("*.tgz")), tmp_path / "unpacked")
    assert not (package / "design").exists()
    build_with_stubs(tmp_path, "idf", package, {})


def test_esp_idf_component_builds(tmp_path: Path) -> None:
    commands = build_with_stubs(tmp_path, "idf", LIB, {"CONFIG_LOSTMOTION_PROFILE_FULL": "y"})
    assert commands.count("-DLM_PROFILE=LM_PROFILE_FULL") == commands.count('"command"')


def default_sizes(profile: str) -> dict[str, int]:
    """Sizes of a profile as the compiler sees them."""
    probe = '#include "lostmotion/profile.h"\n' + "".join(f"{s} = LM_{s}\n" for s in SIZES)
    text = run(
        [
            "cc",
            "-E",
            "-P",
            f"-I{LIB / 'include'}",
            f"-DLM_PROFILE=LM_PROFILE_{profile}",
            "-x",
            "c",
            "-",
        ],
        input=probe,
    )
    return {name: int(value) for name, value in re.findall(r"^(\w+) = (\d+)$", text, re.MULTILINE)}


def test_the_gap_profile_has_no_room_for_effects(tmp_path: Path) -> None:
    command = ["cc", "-fsyntax-only", f"-I{LIB / 'include'}", "-x", "c", "-"]
    command += ["-DLM_PROFILE=LM_PROFILE_GAP", "-DLM_EFFECTS_MAX=2"]
    program = '#include "lostmotion/runtime.h"\n'
    done = subprocess.run(command, input=program, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "the gap profile has no effects" in done.stderr


def test_kconfig_gives_the_gap_profile_no_effects(tmp_path: Path) -> None:
    olddefconfig = tool("olddefconfig", "kconfiglib")
    chosen = ["CONFIG_LOSTMOTION=y", "CONFIG_LOSTMOTION_PROFILE_GAP=y"]
    chosen += ["CONFIG_LOSTMOTION_EFFECTS_MAX=2", ""]
    (tmp_path / ".config").write_text("\n".join(chosen))
    run([olddefconfig, LIB / "zephyr" / "Kconfig"], cwd=tmp_path)
    assert "CONFIG_LOSTMOTION_EFFECTS_MAX=0\n" in (tmp_path / ".config").read_text()


CXX_JOINT = """
#include "lostmotion/runtime.h"
lm_conditions unknown();
lm_conditions unknown() {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  return at;
}
"""


def find_compiler(name: str) -> str | None:
    """Path of a compiler, with its version if the system has no other name for it."""
    names = (name, *(f"{name}-{version}" for version in range(30, 13, -1)))
    return next(filter(None, map(shutil.which, names)), None)


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
@pytest.mark.parametrize("standard", ["c++11", "c++20"])
def test_a_strict_cplusplus_project_takes_the_headers(compiler: str, standard: str) -> None:
    program = find_compiler(compiler)
    if program is None:
        pytest.skip(f"no {compiler}: apt install {compiler.replace('clang++', 'clang')}")
    command = [program, f"-std={standard}", "-fsyntax-only", f"-I{LIB / 'include'}"]
    command += ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
    command += ["-Wold-style-cast", "-Wzero-as-null-pointer-constant", "-Wcast-qual", "-Wundef"]
    run([*command, "-x", "c++", "-"], input=CXX_JOINT)


@pytest.mark.parametrize("profile", PROFILES)
def test_kconfig_has_the_defaults_of_the_profiles(tmp_path: Path, profile: str) -> None:
    olddefconfig = tool("olddefconfig", "kconfiglib")
    chosen = f"CONFIG_LOSTMOTION=y\nCONFIG_LOSTMOTION_PROFILE_{profile}=y\n"
    (tmp_path / ".config").write_text(chosen)
    run([olddefconfig, LIB / "zephyr" / "Kconfig"], cwd=tmp_path)
    text = (tmp_path / ".config").read_text()
    found = {s: int(re.search(rf"^CONFIG_LOSTMOTION_{s}=(\d+)$", text, re.M)[1]) for s in SIZES}
    assert found == default_sizes(profile)
    assert f"CONFIG_LOSTMOTION_PROFILE_{profile}=y" in text


def test_arduino_library_compiles_into_a_sketch(tmp_path: Path) -> None:
    run([sys.executable, LIB / "amalgamate.py", "--arduino", tmp_path / "lostmotion"])
    library = tmp_path / "lostmotion"
    names = [
        line.partition("=")[0] for line in (library / "library.properties").read_text().split("\n")
    ]
    # Requirements of Arduino's library specification, except for the address of a home page.
    needed = {"name", "version", "author", "maintainer", "sentence", "paragraph", "category"}
    assert needed <= set(names)
    sketch = tmp_path / "sketch.cpp"
    sketch.write_text(
        "#include <lostmotion.h>\n"
        '#include "params.h"\n'
        "static lm_compensator joint;\n"
        "void setup() { lm_start_compensator(&joint, &joint_parameters, 0, nullptr); }\n"
        "void loop() {\n"
        "  lm_conditions at = LM_CONDITIONS_UNKNOWN;\n"
        "  (void)lm_step_compensator(&joint, &at);\n"
        "}\n"
        "int main() { setup(); loop(); return 0; }\n"
    )
    source = library / "src"
    # An Uno's compiler defaults are gnu11 and gnu++11.
    run(["cc", "-std=gnu11", "-c", source / "lostmotion.c", "-o", tmp_path / "lostmotion.o"])
    include = [f"-I{source}", f"-I{JOINT}"]
    program = tmp_path / "sketch"
    run(["c++", "-std=gnu++11", *include, sketch, tmp_path / "lostmotion.o", "-o", program])
    run([program])


def test_two_files_do_not_depend_on_where_they_are_made(tmp_path: Path) -> None:
    for name in ("a", "b"):
        run([sys.executable, LIB / "amalgamate.py", tmp_path / name], cwd=tmp_path)
    for name in ("lostmotion.h", "lostmotion.c"):
        text = (tmp_path / "a" / name).read_text()
        assert text == (tmp_path / "b" / name).read_text()
        assert str(ROOT) not in text
        assert "Permission is hereby granted" in text
    done = subprocess.run([sys.executable, LIB / "amalgamate.py"], capture_output=True, check=False)
    assert done.returncode == 2


X86 = platform.machine() in ("x86_64", "AMD64")


def can_fuse() -> bool:
    """Whether this machine runs fused operations; only x86 compilers do not fuse by default."""
    about = Path("/proc/cpuinfo")
    return not X86 or (about.is_file() and "fma" in about.read_text())


@pytest.mark.parametrize("target", [ALL[0], ALL[1], M4F], ids=lambda target: target.name)
def test_two_files_keep_their_bits_without_any_flag(tmp_path: Path, target: Target) -> None:
    need(target)
    if not target.bare and not can_fuse():
        pytest.skip("no fused multiply-add on this processor")
    run([sys.executable, LIB / "amalgamate.py", tmp_path])
    (tmp_path / "lostmotion").mkdir()
    (tmp_path / "lostmotion" / "runtime.h").write_text('#include "../lostmotion.h"\n')
    # In its GNU dialects GCC contracts by default, and these processors can.
    able = ["-march=haswell"] if not target.bare and X86 else [*target.flags]
    fused = tmp_path / "lostmotion.o"
    run([target.compiler, *able, "-std=gnu11", "-O2", "-c", tmp_path / "lostmotion.c", "-o", fused])
    here = ROOT / "tests" / "firmware"
    sources = [here / "golden.c", here / "drive.c", TARGETS / target.start, TARGETS / "print.c"]
    include = [f"-I{place}" for place in (tmp_path, TARGETS, here, LIB)]
    flags = [*target.flags, "-std=gnu11", "-O2", "-ffp-contract=off", *include]
    program = tmp_path / "golden"
    run([target.compiler, *flags, *sources, fused, *target.link, "-o", program])
    done = emulate(target, program, [])
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    "flag", ["-ffast-math", "-Ofast", "-ffinite-math-only", "-fassociative-math"]
)
def test_the_library_refuses_flags_that_change_its_bits_and_a_host_keeps_them(
    tmp_path: Path, flag: str
) -> None:
    host = tmp_path / "host.c"
    host.write_text('#include "lostmotion/runtime.h"\n#include "lostmotion/torsion_curve.h"\n')
    command = ["gcc", flag, "-fno-signed-zeros", "-fno-trapping-math", "-fsyntax-only"]
    command += [f"-I{LIB / 'include'}", f"-I{LIB}"]
    run([*command, host])
    computing = [
        file
        for file in LIB.rglob("*.c")
        if file.name not in ("effects_table.c", "design_keys.c")  # tables
    ]
    assert len(computing) > 40
    for file in computing:
        done = subprocess.run([*command, file], capture_output=True, text=True, check=False)
        assert done.returncode != 0, file
        assert "drops NaN handling" in done.stderr, file
