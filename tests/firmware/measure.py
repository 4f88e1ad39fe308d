"""Build the runtime for every installed target and measure it under QEMU.

    measure.py golden        the same bits on every target
    measure.py cost          instructions, flash, RAM, stack and symbols against their limits
    measure.py cost --write  the same, and the page of the documentation with the table

Exits 1 when a figure passes its limit, a bit differs, or the page is not what was measured with the
page's own compilers. A target whose compiler or emulator is missing is skipped with a notice, never
silently.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

ROOT = Path(__file__).resolve().parents[2]
HERE = ROOT / "tests" / "firmware"
TARGETS = ROOT / "firmware_examples" / "targets"
LIBRARY = [
    ROOT / "lib" / "status.c",
    *sorted((ROOT / "lib" / "runtime").glob("*.c")),
    *sorted((ROOT / "lib" / "runtime" / "effects").glob("*.c")),
]
FLAGS = [
    "-std=gnu99",
    "-ffp-contract=off",
    "-ffunction-sections",
    "-fdata-sections",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-DLM_REAL_BITS=32",
    f"-I{ROOT / 'lib' / 'include'}",
    f"-I{ROOT / 'lib'}",
    f"-I{TARGETS}",
    f"-I{HERE}",
]
PAGE = ROOT / "bindings" / "python" / "docs" / "cost.md"
SECONDS = 120
"""Limit of one run under the emulator."""


@dataclass(frozen=True)
class Target:
    """One processor: how to compile for it and how to run it."""

    name: str
    compiler: str
    flags: tuple[str, ...] = ()
    emulator: str = ""
    machine: tuple[str, ...] = ()
    start: str = "hosted.c"
    link: tuple[str, ...] = ()

    @property
    def bare(self) -> bool:
        """No operating system."""
        return self.start != "hosted.c"

    def missing(self) -> str:
        """Name of the first program that is not installed, or nothing."""
        for program in (self.compiler, self.emulator):
            if program and shutil.which(program) is None:
                return program
        return ""


def cortex_m(name: str, flags: str, machine: str, flash: int = 0, ram: int = 0x20000000) -> Target:
    """Describe a Cortex-M on one of QEMU's boards; 16 KiB of RAM are on every one of them."""
    memory = {
        "flash_origin": flash,
        "flash_length": 0x40000,
        "ram_origin": ram,
        "ram_length": 0x4000,
    }
    return Target(
        name,
        "arm-none-eabi-gcc",
        ("-mthumb", *flags.split()),
        "qemu-system-arm",
        ("-M", machine),
        "cortex_m.c",
        (
            "-nostartfiles",
            "--specs=nano.specs",
            f"-T{TARGETS / 'cortex_m.ld'}",
            *(f"-Wl,--defsym={key}={value:#x}" for key, value in memory.items()),
        ),
    )


def riscv(name: str, march: str, mabi: str) -> Target:
    """Describe a 32-bit RISC-V on QEMU's `virt`."""
    return Target(
        name,
        "riscv64-unknown-elf-gcc",
        # The older name of the instruction set includes the status registers without an extension.
        (
            f"-march={march}",
            f"-mabi={mabi}",
            "-misa-spec=2.2",
            "-mcmodel=medany",
            "--specs=picolibc.specs",
        ),
        "qemu-system-riscv32",
        ("-M", "virt", "-bios", "none"),
        "riscv.c",
        ("-nostartfiles", f"-T{TARGETS / 'riscv.ld'}"),
    )


CLANG = next(filter(shutil.which, ("clang", "clang-19")), "clang")
"""Any release is suitable: only its bits are compared; the page has no figure of it."""

M0 = cortex_m("Cortex-M0+", "-mcpu=cortex-m0plus", "microbit")
M4F = cortex_m("Cortex-M4F", "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard", "mps2-an386")
M7 = cortex_m("Cortex-M7", "-mcpu=cortex-m7 -mfpu=fpv5-d16 -mfloat-abi=hard", "mps2-an500")
M33 = cortex_m(
    "Cortex-M33",
    "-mcpu=cortex-m33 -mfpu=fpv5-sp-d16 -mfloat-abi=hard",
    "mps2-an505",
    0x10000000,
    0x38000000,
)
RV32 = riscv("RV32IMAC", "rv32imac", "ilp32")
RV32F = riscv("RV32IMAFC", "rv32imafc", "ilp32f")
ALL = [
    Target("x86-64 GCC", "gcc"),
    Target("x86-64 Clang", CLANG),
    M0,
    M4F,
    M7,
    M33,
    RV32,
    RV32F,
    Target("ARM Linux", "arm-linux-gnueabihf-gcc", ("-static",), "qemu-arm"),
    Target("PowerPC big-endian", "powerpc-linux-gnu-gcc", ("-static",), "qemu-ppc"),
]

ENVELOPE = "-DDRIVE_ENVELOPE=1"
ONE = ("-DLM_EFFECTS_MAX=1", "-DDRIVE_EFFECTS=1")
TWO = ("-DLM_EFFECTS_MAX=2", "-DLM_EFFECT_MEMORY_MAX=6", "-DDRIVE_EFFECTS=2")
PROFILES = {
    "gap only": ("GAP", "-DLM_PROFILE=LM_PROFILE_GAP"),
    "standard": ("STANDARD", "-DLM_PROFILE=LM_PROFILE_STANDARD", ENVELOPE),
    "no envelope": ("STANDARD", "-DLM_PROFILE=LM_PROFILE_STANDARD", "-DLM_ENVELOPE=0"),
    "one effect": ("EFFECTS", "-DLM_PROFILE=LM_PROFILE_STANDARD", ENVELOPE, *ONE),
    "two effects": ("EFFECTS", "-DLM_PROFILE=LM_PROFILE_STANDARD", ENVELOPE, *TWO),
    "full": ("FULL", "-DLM_PROFILE=LM_PROFILE_FULL"),
}
"""The sources of each row of the table, and the options that they are compiled with."""

EFFECTS_OF = {"one effect": ["thermal_gap"], "two effects": ["thermal_gap", "creep"]}
"""Active effects, which are linked because the parameters name them."""

AXES = 6
"""Number of axes of a robot, for which the table states memory in addition to one axis."""

Options = tuple[str, ...]

STACK_MAX, STACK_SOFT_MAX = 132, 216
"""With a floating-point unit, and without: there, numbers that are live across a call take
registers."""
RAM_MAX = 200
RATIO_MAX = 1.5
FLASH_MAX = 5760
INSTRUCTIONS_MAX = {
    ("Cortex-M4F", "standard"): (202, 350),
    ("Cortex-M4F", "no envelope"): (202, 350),
    ("Cortex-M4F", "one effect"): (320, 450),
    ("Cortex-M4F", "gap only"): (48, 195),
    ("Cortex-M0+", "standard"): (4510, 6220),
}
"""Most instructions of the model alone and of the whole step, by target and profile."""
CORE = ["lm_start_compensator", "lm_step_compensator", "lm_set_mode", "lm_set_headroom"]
"""Functions that every controller calls, including the check of the parameters."""
EVERYTHING = [
    *CORE,
    "lm_settle_compensator",
    "lm_bound_uncertainty",
    "lm_change_parameters",
    "lm_watch_output",
    "lm_save_compensator",
    "lm_restore_compensator",
]
MEASURED = ("nothing", "model", "step", "ending", "change")
"""Functions that cost.c runs between the marks, in its order."""
WINDOWS, CHANGES = 4000, 400
"""Steps that cost.c makes, and changes of parameters."""
MARKS = ("begin", "end", "next")
AT_ONCE = os.cpu_count() or 1


def run(command: list[object]) -> str:
    """Output of a command; exits if it fails."""
    words = [str(word) for word in command]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(words)}\n{done.stdout}{done.stderr}")
    return done.stdout


def each(work: Callable[[T], R], items: Iterable[T]) -> list[R]:
    """Results in order; the work runs in as many threads as there are processors."""
    with ThreadPoolExecutor(AT_ONCE) as threads:
        return list(threads.map(work, items))


def library_of(profile: str, used: Sequence[str]) -> list[Path]:
    """Sources that a profile compiles; the table of all effects links every one of them."""
    table = ROOT / "lib" / "runtime" / "effects_table.c"
    if profile == "FULL":
        return LIBRARY
    return [
        file
        for file in LIBRARY
        if file != table and (file.parent.name != "effects" or file.stem in used)
    ]


def compile_objects(
    target: Target, sources: list[Path], options: Sequence[str], folder: Path
) -> list[Path]:
    """Compile each source by itself; the objects in their order."""
    folder.mkdir(exist_ok=True)

    def one(source: Path) -> Path:
        made = folder / f"{source.parent.name}_{source.stem}.o"
        run([target.compiler, *target.flags, *FLAGS, *options, "-c", source, "-o", made])
        return made

    return each(one, sources)


def emulate(target: Target, program: Path, plugin: list[str]) -> subprocess.CompletedProcess[str]:
    """Run a program on its target; its exit code is that of its main."""
    if not target.bare:
        command = [*([target.emulator] if target.emulator else []), str(program)]
    else:
        command = [
            target.emulator,
            *target.machine,
            "-nographic",
            *[
                "-monitor",
                "none",
                "-serial",
                "none",
                "-semihosting-config",
                "enable=on,target=native",
            ],
            "-kernel",
            str(program),
            *plugin,
        ]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=SECONDS)


def check_golden(target: Target, folder: Path) -> bool:
    """Whether the golden log has the same result in every profile.

    The effects, which are the same in every profile, are compiled once, with `-ffp-contract=fast`
    where the compiler lets the sources overrule it.
    """
    place = folder / target.name
    place.mkdir()
    fused = ["-ffp-contract=fast"] if "gcc" in target.compiler else []
    effects = [file for file in LIBRARY if file.parent.name == "effects"]
    own = [TARGETS / target.start, TARGETS / "print.c", HERE / "drive.c", HERE / "golden.c"]
    garbage = ["-Wl,--gc-sections"] if target.bare else []
    of_effects: list[Path] = []
    good = True
    for profile in ("FULL", "STANDARD", "GAP"):
        # The drive has as many operators as the profile permits: here eight, for the same numbers.
        plays = 1 if profile == "GAP" else 8
        options = ["-O2", f"-DLM_PROFILE=LM_PROFILE_{profile}", f"-DLM_PLAYS_MAX={plays}"]
        more = fused if profile == "FULL" else []
        rest = [file for file in LIBRARY if file not in effects]
        objects = compile_objects(target, [*rest, *own], [*options, *more], place / profile)
        if profile == "FULL":
            of_effects = compile_objects(target, effects, [*options, *more], place / "effects")
        program = place / f"golden_{profile}"
        run(
            [
                target.compiler,
                *target.flags,
                *objects,
                *of_effects,
                *target.link,
                *garbage,
                "-o",
                program,
            ]
        )
        done = emulate(target, program, [])
        good = good and done.returncode == 0
        result = (
            "same bits"
            if done.returncode == 0
            else f"exit {done.returncode}\n{done.stdout}{done.stderr}"
        )
        print(f"golden  {target.name:20} {profile.lower():10} {result}", file=sys.stderr)
    return good


def address(target: Target, program: Path, symbol: str) -> str:
    """Address of a symbol as the plugin reads it."""
    tool = target.compiler.replace("gcc", "nm")
    table = run([tool, program])
    match = re.search(rf"^([0-9a-f]+) \w {symbol}$", table, re.MULTILINE)
    assert match is not None, symbol
    return "0x" + match[1]


@dataclass
class Counted:
    """Least and most instructions between the marks, and bytes of stack."""

    least: int
    most: int
    stack: int


def count(
    target: Target, sizes: Options, objects: list[Path], plugin: Path, folder: Path
) -> dict[str, Counted]:
    """Run cost.c once; its results minus the cost of the marks."""
    program = folder / "cost.elf"
    start = [TARGETS / target.start, TARGETS / "print.c", HERE / "drive.c", HERE / "cost.c"]
    command = [target.compiler, *target.flags, *FLAGS, "-O2", *sizes, *start, *objects]
    run([*command, *target.link, "-Wl,--gc-sections", "-o", program])
    marks = ",".join(f"{name}={address(target, program, f'mark_{name}')}" for name in MARKS)
    done = emulate(target, program, ["-plugin", f"{plugin},{marks}"])
    output = done.stdout + done.stderr
    windows = re.findall(r"windows (\d+) least (\d+) most (\d+)", output)
    stack = re.findall(r"stack (\d+)", output)
    made = [int(number) for number, *_ in windows]
    if done.returncode != 0 or made != [*[WINDOWS] * (len(MEASURED) - 1), CHANGES]:
        raise SystemExit(f"{target.name}: {done.returncode}\n{output}")
    nothing = int(windows[0][1])
    return {
        name: Counted(int(least) - nothing, int(most) - nothing, int(deep))
        for name, (_, least, most), deep in zip(MEASURED, windows, stack, strict=True)
    }


def measure_flash(
    target: Target, objects: list[Path], called: list[str], folder: Path, *, whole: bool = False
) -> dict[str, int]:
    """Bytes by section of what some functions need, linked without start file.

    Parameters
    ----------
    whole : bool
        With soft float and all other functions that the linker includes from the compiler's and the
        C library.
    """
    alone = ["-nostdlib", "-Wl,--gc-sections"]
    behind = ["-lc", "-lgcc"] if whole else ["-Wl,--unresolved-symbols=ignore-all"]
    entry = f"-Wl,-e,{called[0]}"
    program = folder / "runtime.elf"
    run(
        [
            target.compiler,
            *target.flags,
            *alone,
            *(f"-Wl,-u,{name}" for name in called),
            entry,
            *objects,
            *behind,
            "-o",
            program,
        ]
    )
    sizes = run([target.compiler.replace("gcc", "size"), "-A", program])
    total = {"text": 0, "rodata": 0, "data": 0, "bss": 0}
    for name, size in re.findall(r"^\.(text|rodata|data|bss)\S*\s+(\d+)", sizes, re.MULTILINE):
        total[name] += int(size)
    return total


def sizes_of(target: Target, sizes: Options, folder: Path) -> dict[str, int]:
    """Bytes of an instance and of its parameters."""
    probe = folder / "sizes.c"
    probe.write_text(
        '#include "lostmotion/runtime.h"\n'
        "char instance[sizeof(lm_compensator)]; char parameters[sizeof(lm_parameters)];\n"
    )
    run([target.compiler, *target.flags, *FLAGS, *sizes, "-c", probe, "-o", folder / "sizes.o"])
    table = run([target.compiler.replace("gcc", "nm"), "-S", folder / "sizes.o"])
    found = re.findall(r"^\S+ (\S+) \w (\w+)$", table, re.MULTILINE)
    return {name: int(size, 16) for size, name in found}


def foreign_symbols(target: Target, objects: list[Path]) -> list[str]:
    """External symbols of the library."""
    nm = target.compiler.replace("gcc", "nm")
    undefined = set(re.findall(r"^\s+U (\w+)$", run([nm, "-u", *objects]), re.MULTILINE))
    table = run([nm, "--defined-only", *objects])
    defined = set(re.findall(r"^\S+ [A-Z] (\w+)$", table, re.MULTILINE))
    return sorted(undefined - defined)


@dataclass
class Row:
    """All measurements of one profile on one target."""

    target: Target
    profile: str
    flash: tuple[int, int]
    linked: int
    parameters: int
    ram: int
    variables: int
    stack: int
    model: tuple[int, int]
    step: tuple[int, int]
    ending: int
    change: int
    foreign: list[str]

    def has_fpu(self) -> bool:
        """Whether the processor has floating-point instructions."""
        return not any(helper(name) for name in self.foreign)

    def faults(self) -> list[str]:
        """Figures that exceed their limits."""
        key = (self.target.name, self.profile)
        model, step = INSTRUCTIONS_MAX.get(key, (None, None))
        allowed = () if self.target is M4F else ("memcpy",)
        names = [name for name in self.foreign if not helper(name) and name not in allowed]
        limited = [
            ("instructions of the model", self.model[1], model),
            ("instructions of the step", self.step[1], step),
            ("greatest over least, model", self.model[1] / self.model[0], RATIO_MAX),
            ("bytes of .data and .bss", self.variables, 0),
        ]
        if self.profile not in EFFECTS_OF:  # creep advances once in many steps
            ratio = self.step[1] / self.step[0]
            limited.append(("greatest over least, step", ratio, RATIO_MAX))
        if self.profile not in ("full", *EFFECTS_OF):
            limited += [
                ("bytes of stack", self.stack, STACK_MAX if self.has_fpu() else STACK_SOFT_MAX),
                ("bytes of RAM", self.ram, RAM_MAX),
                ("symbols from elsewhere", len(names), 0),
            ]
        if key == ("Cortex-M4F", "standard"):
            limited.append(("bytes of flash", self.flash[0], FLASH_MAX))
        return [
            f"{self.target.name}, {self.profile}: {value:.6g} {name}, at most {most}"
            for name, value, most in limited
            if most is not None and value > most
        ]

    def six_axes(self) -> str:
        """Flash and RAM of a robot: the code once, parameters and instance for each axis."""
        return f"{self.linked + AXES * self.parameters} + {AXES * self.ram}"

    def cells(self) -> str:
        """Line of the table."""
        names = [name for name in self.foreign if not helper(name)]
        if len(names) < len(self.foreign):
            names.append(f"{len(self.foreign) - len(names)} of soft float")
        spans = (f"{a} to {b} | {b / a:.2f}" for a, b in (self.model, self.step))
        return (
            f"| {self.target.name} | {self.profile} | {self.flash[0]} | {self.flash[1]} |"
            f" {self.linked} | {self.parameters} | {self.ram} | {self.six_axes()} |"
            f" {self.variables} | {self.stack} | {' | '.join(spans)} | {self.ending} |"
            f" {self.change} | {', '.join(names) or 'none'} |"
        )


HEAD = """\
| target | profile | flash | all functions | linked | parameters | RAM | six axes | .data + .bss \
| stack | model | ratio | step | ratio | reduced headroom | change | symbols |
"""
HEAD += "|" + 17 * " --- |" + "\n"


def helper(name: str) -> bool:
    """Whether a symbol is arithmetic that the compiler's own library does without an FPU."""
    return re.fullmatch(r"__aeabi_\w+|__\w+[sd]f[23i]?\w*|__\w+si\w*", name) is not None


def measure_row(target: Target, name: str, plugin: Path, folder: Path) -> Row:
    """Measure one profile on one target."""
    profile, *options = PROFILES[name]
    sizes = tuple(options)
    effects = EFFECTS_OF.get(name, [])
    sources = library_of(profile, effects)
    with tempfile.TemporaryDirectory(dir=folder) as own:
        place = Path(own)
        fast, small = (
            compile_objects(
                target, sources, [optimize, *sizes, "-DLM_EFFECT_CARDS=0"], place / optimize
            )
            for optimize in ("-O2", "-Os")
        )
        counted = count(target, sizes, fast, plugin, place)
        used = [f"lm_effect_{effect}" for effect in effects]
        flash = [
            measure_flash(target, small, [*called, *used], place) for called in (CORE, EVERYTHING)
        ]
        linked = measure_flash(target, small, [*EVERYTHING, *used], place, whole=True)
        bytes_of = sizes_of(target, sizes, place)
        return Row(
            target,
            name,
            (flash[0]["text"] + flash[0]["rodata"], flash[1]["text"] + flash[1]["rodata"]),
            linked["text"] + linked["rodata"],
            bytes_of["parameters"],
            bytes_of["instance"],
            flash[1]["data"] + flash[1]["bss"],
            max(counted[what].stack for what in ("model", "step", "ending")),
            (counted["model"].least, counted["model"].most),
            (counted["step"].least, counted["step"].most),
            counted["ending"].most,
            counted["change"].most,
            foreign_symbols(target, small),
        )


def usable(targets: list[Target]) -> list[Target]:
    """Keep the targets whose tools are installed, and state which are not."""
    for target in targets:
        if target.missing():
            print(f"skipped {target.name}: {target.missing()} is not installed", file=sys.stderr)
    return [target for target in targets if not target.missing()]


def version_of(program: str) -> str:
    """First line of the version text of a program."""
    return run([program, "--version"]).splitlines()[0]


MODEL_MAX, STEP_MAX = INSTRUCTIONS_MAX["Cortex-M4F", "standard"]
MODEL_EFFECT_MAX, STEP_EFFECT_MAX = INSTRUCTIONS_MAX["Cortex-M4F", "one effect"]
MODEL_SOFT_MAX, _ = INSTRUCTIONS_MAX["Cortex-M0+", "standard"]
INTRODUCTION = f"""\
# What it costs

This page states flash, RAM, stack and instructions of the runtime on six processors.
`tests/firmware/measure.py cost --write` writes it. The tests repeat every measurement and fail \
if a
figure exceeds its limit.

QEMU counts instructions, not cycles, at `-O2`, over {WINDOWS} steps. The steps reverse, jump and
rest, leave the limits and the fitted range, and reach every limit of the correction. Sizes are in
bytes.

| column | meaning |
| --- | --- |
| flash | at `-Os`: check of the parameters, start, step, mode and headroom |
| all functions | flash with settling, uncertainty, watch, change of parameters, save and restore |
| linked | all functions with the parts of the compiler's and the C library that they use, mainly \
soft float |
| parameters | the constant struct of the parameters, also in flash |
| RAM | one instance |
| six axes | flash and RAM of a robot; the code is linked once |
| stack | bytes that one step overwrites, including the compiler's soft-float functions |
| model | minimum and maximum instructions of the curve and the operators (`lm_step_model`) |
| step | the same for `lm_step_compensator`, with limits and status |
| ratio | maximum over minimum of the column before it |
| reduced headroom | maximum of a step in which the headroom is reduced during a motion |
| change | maximum of a call of `lm_change_parameters`, which checks its parameters |
| symbols | external symbols of the objects |

| profile | meaning |
| --- | --- |
| gap only | the gap profile |
| standard | the default build; its operators follow an envelope of the torque, as in a fit |
| no envelope | `LM_ENVELOPE=0`; the bands of the operators widen with the torque, as from a data \
sheet |
| one effect, two effects | `thermal_gap`; `thermal_gap` and `creep` |
| full | 64 knots, 16 operators and 32 values of effect memory, measured without effect and \
envelope; the limits of size do not apply |

| limited figure | limit |
| --- | --- |
| model and step, Cortex-M4F | {MODEL_MAX} and {STEP_MAX} instructions; with one effect \
{MODEL_EFFECT_MAX} and {STEP_EFFECT_MAX} |
| model, Cortex-M0+ | {MODEL_SOFT_MAX} instructions |
| ratio | {RATIO_MAX}; step: only without effects |
| flash, Cortex-M4F | {FLASH_MAX} |
| RAM, without effects | {RAM_MAX} |
| stack, without effects | {STACK_MAX}; {STACK_SOFT_MAX} without an FPU |
| `.data` and `.bss` | 0 |
| symbols, without effects | none on the Cortex-M4F; soft float and memcpy on the others |

"""


def make_page(rows: list[Row]) -> str:
    """Page of the documentation that contains the table."""
    programs = [row.target.compiler for row in rows] + [row.target.emulator for row in rows]
    versions = "".join(f"* {line}\n" for line in dict.fromkeys(map(version_of, programs)))
    table = HEAD + "".join(row.cells() + "\n" for row in rows)
    return f"{INTRODUCTION}{table}\nMeasured with:\n\n{versions}"


def stale(page: str) -> str:
    """Errors of the page in the documentation, or the reason why it cannot be compared."""
    kept = PAGE.read_text() if PAGE.is_file() else ""
    if kept == page:
        return ""
    versions = [text.partition("\nMeasured with:\n")[2] for text in (kept, page)]
    if kept and versions[0] != versions[1]:
        print(f"not compared with {PAGE.name}, which was measured with:{versions[0]}")
        return ""
    return f"{PAGE.relative_to(ROOT)} is not what is measured: run measure.py cost --write\n"


def measure_costs(folder: Path, *, write: bool) -> bool:
    """Print or write the table; whether all figures are within limits and the page agrees."""
    plugin = folder / "count_instructions.so"
    run(["gcc", "-O2", "-fPIC", "-shared", HERE / "count_instructions.c", "-o", plugin])
    every = [M4F, M0, M7, M33, RV32, RV32F]
    there = usable(every)
    rows = each(
        lambda row: measure_row(*row, plugin, folder),
        [(target, name) for target in there for name in PROFILES],
    )
    page = make_page(rows)
    print(page[len(INTRODUCTION) :])
    faults = [fault for row in rows for fault in row.faults()]
    if write:
        PAGE.write_text(page)
    elif there == every and (wrong := stale(page)):
        faults.append(wrong)
    for fault in faults:
        print(fault)
    return not faults


def main() -> int:
    """Run what was requested."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", nargs="?", choices=("golden", "cost"))
    parser.add_argument("--write", action="store_true", help="write the page of the documentation")
    arguments = parser.parse_args()
    good = True
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if arguments.what != "cost":
            for target in usable(ALL):
                good = check_golden(target, folder) and good
        if arguments.what != "golden":
            good = measure_costs(folder, write=arguments.write) and good
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
