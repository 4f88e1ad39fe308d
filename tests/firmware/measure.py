"""Builds the runtime for every controller at hand and measures it under QEMU.

    measure.py golden   the same bits on every target
    measure.py cost     instructions, flash, RAM, stack and symbols against their limits
    measure.py          both

Prints one Markdown table; exits 1 when a figure passes its limit or a bit differs. A target whose
compiler or emulator is missing is skipped with a notice, never in silence.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

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
        # The older name of the instruction set holds the status registers without an extension.
        (f"-march={march}", f"-mabi={mabi}", "-misa-spec=2.2", "-mcmodel=medany"),
        "qemu-system-riscv32",
        ("-M", "virt", "-bios", "none"),
        "riscv.c",
        ("-nostartfiles", "--specs=picolibc.specs", f"-T{TARGETS / 'riscv.ld'}"),
    )


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
    Target("x86-64 Clang", "clang-19"),
    M0,
    M4F,
    M7,
    M33,
    RV32,
    RV32F,
    Target("ARM Linux", "arm-linux-gnueabihf-gcc", ("-static",), "qemu-arm"),
    Target("PowerPC big-endian", "powerpc-linux-gnu-gcc", ("-static",), "qemu-ppc"),
]

STANDARD = ()
GAP = ("-DLM_PROFILE=LM_PROFILE_GAP",)


@dataclass(frozen=True)
class Cost:
    """One figure to measure, and what it may be at most."""

    target: Target
    profile: tuple[str, ...]
    measure: int
    instructions: int | None
    stack_bytes: int | None
    ratio: float | None = 1.5


COSTS = [
    Cost(M4F, STANDARD, 1, 200, 128),
    Cost(M4F, STANDARD, 2, 320, 128),
    Cost(M4F, GAP, 1, 50, 128),
    Cost(M4F, GAP, 2, None, 128),
    Cost(M0, STANDARD, 1, 4500, 128),
    Cost(M0, STANDARD, 2, None, 128),
    Cost(M0, GAP, 1, None, 128),
    Cost(M7, STANDARD, 1, None, 128),
    Cost(M7, STANDARD, 2, None, 128),
    Cost(M33, STANDARD, 1, None, 128),
    Cost(M33, STANDARD, 2, None, 128),
    Cost(RV32, STANDARD, 1, None, None),
    Cost(RV32, STANDARD, 2, None, None),
    Cost(RV32F, STANDARD, 1, None, None),
    Cost(RV32F, STANDARD, 2, None, None),
]
MEASURES = {1: "curve and plays", 2: "with limiter and status"}
RAM_MAX = 256
CORE = ["lm_start_compensator", "lm_step_compensator", "lm_set_mode", "lm_set_headroom"]
"""What every controller calls, the check of the parameters included."""
OPTIONAL = [
    "lm_bound_uncertainty",
    "lm_change_parameters",
    "lm_watch_output",
    "lm_save_compensator",
    "lm_restore_compensator",
]
FLASH = [("core", CORE, 4096), ("everything", CORE + OPTIONAL, 5120)]
"""Name, functions called, and bytes they may take with whatever they need."""


def run(command: list[object]) -> str:
    """Output of a command; stops everything when it fails."""
    words = [str(word) for word in command]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(words)}\n{done.stdout}{done.stderr}")
    return done.stdout


def build(target: Target, sources: list[Path], options: list[str], program: Path) -> None:
    """Compile and link one program."""
    start = [TARGETS / target.start, TARGETS / "print.c", HERE / "drive.c"]
    garbage = ["-Wl,--gc-sections"] if target.bare else []
    run(
        [
            target.compiler,
            *target.flags,
            *FLAGS,
            *options,
            *sources,
            *start,
            *LIBRARY,
            *target.link,
            *garbage,
            "-o",
            program,
        ]
    )


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
    """Whether the golden log comes out the same, in every profile."""
    good = True
    for profile in ("STANDARD", "FULL", "GAP"):
        # The plays of the drive are as many as the profile holds: eight, for the same numbers.
        plays = 1 if profile == "GAP" else 8
        program = folder / "golden"
        options = ["-O2", f"-DLM_PROFILE=LM_PROFILE_{profile}", f"-DLM_PLAYS_MAX={plays}"]
        build(target, [HERE / "golden.c"], options, program)
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


def count(cost: Cost, measure: int, plugin: Path, folder: Path) -> tuple[int, int, int]:
    """Least and most instructions between the marks, and bytes of stack."""
    program = folder / "cost.elf"
    options = ["-O2", "-DLM_EFFECT_CARDS=0", f"-DMEASURE={measure}", *cost.profile]
    build(cost.target, [HERE / "cost.c"], options, program)
    marks = ",".join(
        f"{name}={address(cost.target, program, f'mark_{name}')}" for name in ("begin", "end")
    )
    done = emulate(cost.target, program, ["-plugin", f"{plugin},{marks}"])
    output = done.stdout + done.stderr
    windows = re.search(r"windows (\d+) least (\d+) most (\d+)", output)
    stack = re.search(r"stack (\d+)", output)
    if done.returncode != 0 or windows is None or stack is None or windows[1] != "4000":
        raise SystemExit(f"{cost.target.name}: {done.returncode}\n{output}")
    return int(windows[2]), int(windows[3]), int(stack[1])


def check_cost(cost: Cost, plugin: Path, folder: Path) -> tuple[bool, str]:
    """Measure one figure; whether it holds, and its line of the table."""
    marks, _, _ = count(cost, 0, plugin, folder)
    least, most, stack = count(cost, cost.measure, plugin, folder)
    least, most = least - marks, most - marks
    good = (
        (cost.instructions is None or most <= cost.instructions)
        and (cost.stack_bytes is None or stack <= cost.stack_bytes)
        and (cost.ratio is None or most <= cost.ratio * least)
    )
    profile = "gap only" if cost.profile == GAP else "standard"
    limit = "" if cost.instructions is None else f" (limit {cost.instructions})"
    line = (
        f"| {cost.target.name} | {profile}, {MEASURES[cost.measure]} | {least} | {most}{limit} |"
        f" {most / least:.2f} | {stack} |"
    )
    return good, line + ("" if good else " **over its limit**")


def measure_flash(
    target: Target, objects: list[Path], called: list[str], folder: Path
) -> dict[str, int]:
    """Bytes by section of what some functions need, linked without start file and C library."""
    roots = [f"-Wl,-u,{name}_f32" for name in called]
    alone = ["-nostdlib", "-Wl,--gc-sections", "-Wl,--unresolved-symbols=ignore-all"]
    entry = f"-Wl,-e,{called[0]}_f32"
    program = folder / "runtime.elf"
    run([target.compiler, *target.flags, *alone, *roots, entry, *objects, "-o", program])
    sizes = run([target.compiler.replace("gcc", "size"), "-A", program])
    total = {"text": 0, "rodata": 0, "data": 0, "bss": 0}
    for name, size in re.findall(r"^\.(text|rodata|data|bss)\S*\s+(\d+)", sizes, re.MULTILINE):
        total[name] += int(size)
    return total


def check_size(target: Target, folder: Path) -> tuple[bool, str]:
    """Flash, RAM, variables and undefined symbols of the standard profile at -Os."""
    objects = []
    for source in LIBRARY:
        objects.append(folder / f"{source.stem}.o")
        options = ["-Os", "-DLM_EFFECT_CARDS=0", "-c", source, "-o", objects[-1]]
        run([target.compiler, *target.flags, *FLAGS, *options])
    nm = target.compiler.replace("gcc", "nm")
    undefined = set(re.findall(r"^\s+U (\w+)$", run([nm, "-u", *objects]), re.MULTILINE))
    defined = set(
        re.findall(r"^\S+ [A-Z] (\w+)$", run([nm, "--defined-only", *objects]), re.MULTILINE)
    )
    foreign = sorted(undefined - defined - {"memcpy", "memset", "memmove", "memcmp"})
    probe = folder / "sizes.c"
    probe.write_text(
        '#include "lostmotion/runtime.h"\n'
        "char instance[sizeof(lm_compensator)]; char parameters[sizeof(lm_parameters)];\n"
    )
    run([target.compiler, *target.flags, *FLAGS, "-c", probe, "-o", folder / "sizes.o"])
    table = run([nm, "-S", folder / "sizes.o"])
    held = {
        name: int(size, 16)
        for size, name in re.findall(r"^\S+ (\S+) \w (\w+)$", table, re.MULTILINE)
    }
    good = held["instance"] <= RAM_MAX and (not foreign or "-mfpu" not in " ".join(target.flags))
    cells = []
    for _, called, limit in FLASH:
        total = measure_flash(target, objects, called, folder)
        flash = total["text"] + total["rodata"]
        limited = target is M4F
        good = good and total["data"] + total["bss"] == 0 and (not limited or flash <= limit)
        cells.append(f"{flash} (limit {limit})" if limited else f"{flash}")
    line = (
        f"| {target.name} | {' | '.join(cells)} | {held['parameters']} |"
        f" {held['instance']} (limit {RAM_MAX}) | {total['data'] + total['bss']} |"
        f" {', '.join(foreign) or 'none'} |"
    )
    return good, line + ("" if good else " **over its limit**")


def usable(targets: list[Target]) -> list[Target]:
    """Keep the targets whose tools are installed, and say which are not."""
    for target in targets:
        if target.missing():
            print(f"skipped {target.name}: {target.missing()} is not installed", file=sys.stderr)
    return [target for target in targets if not target.missing()]


def measure_costs(folder: Path) -> bool:
    """Print the tables; whether every figure holds."""
    plugin = folder / "count_instructions.so"
    run(["gcc", "-O2", "-fPIC", "-shared", HERE / "count_instructions.c", "-o", plugin])
    there = usable([M4F, M0, M7, M33, RV32, RV32F])
    good = True
    print("| target | one step | least instructions | most | ratio | stack, bytes |")
    print("| --- | --- | --- | --- | --- | --- |")
    for cost in COSTS:
        if cost.target in there:
            held, line = check_cost(cost, plugin, folder)
            good = good and held
            print(line, flush=True)
    print()
    print(
        "| target | flash at -Os, bytes: start, step, mode, headroom | everything | parameters"
        " | RAM an instance | .data + .bss | helpers called |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for target in (M4F, M0):
        if target in there:
            held, line = check_size(target, folder)
            good = good and held
            print(line, flush=True)
    return good


def main() -> int:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", nargs="?", choices=("golden", "cost"))
    what = parser.parse_args().what
    good = True
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if what != "cost":
            for target in usable(ALL):
                good = check_golden(target, folder) and good
        if what != "golden":
            good = measure_costs(folder) and good
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
