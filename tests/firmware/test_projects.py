"""The example projects, each built by its own system as a user would, and run.

CMake, make, PlatformIO and Arduino are the real ones. ESP-IDF and Zephyr are the real ones where
``IDF_PATH`` or ``ZEPHYR_BASE`` is set; elsewhere a few lines of CMake replace them.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from measure import ROOT
from needs import TOOLS, pip_install, tool
from test_packages import LIB, STUBS, run

PROJECTS = ROOT / "firmware_examples" / "projects"
RAN = "the axis ran; closing moved it by "
SECONDS = 300


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder into which the run-time library is installed."""
    folder = tmp_path_factory.mktemp("installed")
    off = [f"-DLM_BUILD_{part}=OFF" for part in ("TESTS", "OPTIMIZER", "EXAMPLES")]
    run(["cmake", "-S", ROOT, "-B", folder / "build", *off])
    run(["cmake", "--build", folder / "build", "--parallel", "2"])
    run(["cmake", "--install", folder / "build", "--prefix", folder / "prefix"])
    return folder / "prefix"


@pytest.mark.parametrize("source", ["checkout", "installed", "fetched"])
def test_cmake_project_runs(tmp_path: Path, prefix: Path, source: str) -> None:
    options = [f"-DLOSTMOTION={source}", f"-DCMAKE_PREFIX_PATH={prefix}"]
    run(["cmake", "-S", PROJECTS / "cmake", "-B", tmp_path, *options])
    run(["cmake", "--build", tmp_path, "--parallel", "2"])
    assert run([tmp_path / "axis"]).startswith(RAN)


def test_makefile_project_runs(tmp_path: Path) -> None:
    if shutil.which("make") is None:
        pytest.skip("no make: apt install make")
    said = run(["make", "-s", "-C", PROJECTS / "make", f"BUILD={tmp_path}", "run"])
    assert RAN in said


PLATFORM = {
    # PlatformIO's registry is not a package index, so its native platform is written here in ten
    # lines.
    "platform.json": json.dumps(
        {
            "name": "native",
            "title": "Native",
            "version": "1.0.0",
            "description": "this machine",
            "frameworks": {},
            "packages": {},
        }
    ),
    "platform.py": "from platformio.public import PlatformBase\n\n\n"
    "class NativePlatform(PlatformBase):\n    pass\n",
    "builder/main.py": "from SCons.Script import AlwaysBuild, Default, DefaultEnvironment\n\n"
    "env = DefaultEnvironment()\n"
    'env.Replace(CC="cc", CXX="c++", AR="ar", RANLIB="ranlib")\n'
    "program = env.BuildProgram()\n"
    'run = env.VerboseAction(env.subst("$BUILD_DIR/${PROGNAME}"), "run")\n'
    'AlwaysBuild(env.Alias("exec", program, run))\n'
    "Default([program])\n",
}


def scons_for_platformio(core: Path) -> None:
    """Put pip's SCons into the folder of the one from PlatformIO's registry."""
    python = TOOLS / "scons" / "bin" / "python"
    if not python.exists():
        pip_install(TOOLS / "scons", "scons")
    package = run([python, "-c", "import SCons, os; print(os.path.dirname(SCons.__file__))"])
    wanted = run(
        [
            Path(tool("pio", "platformio")).parent / "python",
            "-c",
            "from platformio.dependencies import get_core_dependencies as d; "
            "print(d()['tool-scons'].lstrip('~'))",
        ]
    ).strip()
    folder = core / "packages" / "tool-scons"
    folder.mkdir(parents=True)
    (folder / "SCons").symlink_to(package.strip())
    (folder / "scons.py").write_text("from SCons.Script.Main import main\n\nmain()\n")
    about = {"name": "tool-scons", "version": wanted, "description": "SCons"}
    (folder / "package.json").write_text(json.dumps(about))
    spec = {"owner": "platformio", "id": 1, "name": "tool-scons", "requirements": None, "uri": None}
    about = {"type": "tool", "name": "tool-scons", "version": wanted, "spec": spec}
    (folder / ".piopm").write_text(json.dumps(about))


def test_platformio_project_runs(tmp_path: Path) -> None:
    pio = tool("pio", "platformio")
    scons_for_platformio(tmp_path / "core")
    for name, text in PLATFORM.items():
        file = tmp_path / "native" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    text = (PROJECTS / "platformio" / "platformio.ini").read_text()
    own = text.replace("platform = native", f"platform = symlink://{tmp_path / 'native'}")
    assert own != text
    (tmp_path / "platformio.ini").write_text(own)
    environment = {
        **os.environ,
        "PLATFORMIO_CORE_DIR": str(tmp_path / "core"),
        "PLATFORMIO_WORKSPACE_DIR": str(tmp_path / "work"),
        "PLATFORMIO_SETTING_ENABLE_TELEMETRY": "No",
    }
    command = [pio, "run", "-c", tmp_path / "platformio.ini", "-d", PROJECTS / "platformio"]
    said = run([*command, "-e", "native", "-t", "exec"], env=environment)
    assert RAN in said


ARDUINO = Path("/usr/share/arduino/hardware")
ARDUINO_NEEDS = {
    "arduino-builder": "arduino-builder",
    "avr-gcc": "gcc-avr avr-libc",
    "simavr": "simavr",
}


def test_arduino_sketch_runs_on_an_emulated_mega(tmp_path: Path) -> None:
    for program, package in ARDUINO_NEEDS.items():
        if shutil.which(program) is None:
            pytest.skip(f"no {program}: apt install {package}")
    if not (ARDUINO / "arduino" / "avr" / "cores").is_dir():
        pytest.skip("no Arduino core: apt install arduino-core-avr")
    library = tmp_path / "libraries" / "lostmotion"
    run([sys.executable, LIB / "amalgamate.py", "--arduino", library])
    sketch = tmp_path / "axis"
    shutil.copytree(PROJECTS / "arduino" / "axis", sketch)
    shutil.copytree(
        ROOT / "firmware_examples" / "axis",
        sketch / "src" / "axis",
        ignore=shutil.ignore_patterns("main.c"),
    )
    (sketch / "src" / "joint").mkdir()
    shutil.copy(ROOT / "firmware_examples" / "joint" / "params.h", sketch / "src" / "joint")
    build = tmp_path / "build"
    build.mkdir()
    preferences = {
        "runtime.tools.avr-gcc.path": "/usr",
        "runtime.tools.ctags.path": "/usr/bin",
        # Debian's core does not compile with Debian's compiler without it.
        "compiler.cpp.extra_flags": "-DDECIMAL_DIG=__DECIMAL_DIG__",
    }
    folders = [
        "-hardware",
        ARDUINO,
        "-hardware",
        "/usr/share/arduino-builder",
        "-tools",
        "/usr/bin",
    ]
    run(
        [
            "arduino-builder",
            "-compile",
            *folders,
            "-libraries",
            library.parent,
            "-fqbn",
            "arduino:avr:mega:cpu=atmega2560",
            "-build-path",
            build,
            *(f"-prefs={key}={value}" for key, value in preferences.items()),
            sketch / "axis.ino",
        ]
    )
    # simavr runs forever, like the sketch: it is terminated once the line is printed.
    command = ["simavr", "-m", "atmega2560", "-f", "16000000", str(build / "axis.ino.elf")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as simavr:
        limit = threading.Timer(SECONDS, simavr.kill)
        limit.start()
        try:
            assert simavr.stdout is not None
            said = b""
            for line in simavr.stdout:
                said += line
                if b"the axis" in line:
                    break
        finally:
            limit.cancel()
            simavr.kill()
    assert RAN in said.decode(errors="replace")


IDF_PROJECT = (
    STUBS["idf"].partition("set(ESP_PLATFORM ON)")[0]
    + """
macro(project name)
  _project(${name} C)
  set(ESP_PLATFORM ON)
  include_directories($ENV{IDF_PATH})
  foreach(component ${EXTRA_COMPONENT_DIRS} ${CMAKE_CURRENT_SOURCE_DIR}/main)
    get_filename_component(component_name ${component} NAME)
    set(COMPONENT_LIB __idf_${component_name})
    add_subdirectory(${component} ${component_name})
  endforeach()
  target_link_libraries(__idf_main PUBLIC __idf_lib)
  add_executable(${name}.elf $ENV{IDF_PATH}/start.c)
  target_link_libraries(${name}.elf PRIVATE __idf_main)
endmacro()
"""
)


def idf_stand_in(folder: Path) -> Path:
    """Write the parts of ESP-IDF that the project needs; returns its IDF_PATH."""
    cmake = folder / "tools" / "cmake"
    cmake.mkdir(parents=True)
    (cmake / "project.cmake").write_text(IDF_PROJECT)
    (folder / "start.c").write_text(
        "void app_main(void);\nint main(void) { app_main(); return 1; }\n"
    )
    (folder / "sdkconfig.h").write_text("#define CONFIG_IDF_TARGET_LINUX 1\n")
    return folder


def test_esp_idf_project_runs(tmp_path: Path) -> None:
    environment = {**os.environ, "IDF_COMPONENT_MANAGER": "0"}
    if "IDF_PATH" not in environment:
        environment["IDF_PATH"] = str(idf_stand_in(tmp_path / "idf"))
    options = [
        "-DIDF_TARGET=linux",
        "-DPYTHON_DEPS_CHECKED=1",
        f"-DSDKCONFIG={tmp_path / 'sdkconfig'}",
    ]
    command = ["cmake", "-S", PROJECTS / "esp_idf", "-B", tmp_path / "build", "-G", "Ninja"]
    if shutil.which("ninja") is None:
        pytest.skip("no ninja: apt install ninja-build")
    run([*command, *options], env=environment)
    run(["cmake", "--build", tmp_path / "build", "--parallel", "2"], env=environment)
    assert RAN in run([tmp_path / "build" / "axis.elf"])


ZEPHYR_CONFIG = (
    """
enable_language(C)
include_directories(${CMAKE_CURRENT_LIST_DIR})
add_executable(app)
"""
    + STUBS["zephyr"].partition("set(CONFIG_LOSTMOTION y)")[0]
    + """
include(${CMAKE_CURRENT_LIST_DIR}/configuration.cmake)
foreach(module ${EXTRA_ZEPHYR_MODULES})
  file(STRINGS ${module}/zephyr/module.yml cmake REGEX "^  cmake: ")
  string(REPLACE "  cmake: " "" cmake ${cmake})
  add_subdirectory(${module}/${cmake} module)
endforeach()
target_link_libraries(app PRIVATE lostmotion zephyr_interface)
"""
)


def zephyr_stand_in(folder: Path) -> Path:
    """Write the parts of Zephyr that the project needs; its Kconfig states the configuration."""
    olddefconfig = tool("olddefconfig", "kconfiglib")
    (folder / "zephyr" / "sys").mkdir(parents=True)
    (folder / "zephyr" / "sys" / "printk.h").write_text(
        "#include <stdio.h>\n#define printk printf\n"
    )
    wanted = (PROJECTS / "zephyr" / "prj.conf").read_text()
    ours = [line for line in wanted.splitlines() if "LOSTMOTION" in line]
    (folder / ".config").write_text("\n".join([*ours, ""]))
    run([olddefconfig, LIB / "zephyr" / "Kconfig"], cwd=folder)
    chosen = re.findall(r"^(CONFIG_\w+)=(\S+)$", (folder / ".config").read_text(), re.MULTILINE)
    assert ("CONFIG_LOSTMOTION", "y") in chosen
    (folder / "configuration.cmake").write_text(
        "".join(f"set({name} {value})\n" for name, value in chosen)
    )
    (folder / "ZephyrConfig.cmake").write_text(ZEPHYR_CONFIG)
    return folder


def test_zephyr_project_runs(tmp_path: Path) -> None:
    build, program = tmp_path / "build", ["app"]
    command: list[object] = ["cmake", "-S", PROJECTS / "zephyr", "-B", build]
    if "ZEPHYR_BASE" in os.environ:
        command += ["-G", "Ninja", "-DBOARD=native_sim"]
        program = ["zephyr/zephyr.exe", "-stop_at=1"]  # it continues after main
    else:
        command += [f"-DZephyr_DIR={zephyr_stand_in(tmp_path / 'zephyr')}"]
    run(command)
    run(["cmake", "--build", build, "--parallel", "2"])
    done = subprocess.run(
        [build / program[0], *program[1:]],
        capture_output=True,
        text=True,
        check=False,
        timeout=SECONDS,
    )
    assert RAN in done.stdout
