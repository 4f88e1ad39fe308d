"""The exported parameters on a controller: on an emulated Cortex-M4F or replayed on this machine.

Both receive the same ticks. The emulated controller prints the checksum of all computed bits, which
must equal that of the replay.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.drives import read_drive
from lostmotion.export import export, make_controller
from lostmotion.recordings import Campaign, Run
from lostmotion.replay import Tape, errors_of, read_parameters, replay
from lostmotion.rms import rms_of
from lostmotion.shipped import FIRMWARE, find_inputs
from lostmotion.units import ARCSEC

PERIOD_S = 0.005
"""Period of the controller; the torque is interpolated linearly between the recorded samples."""

LOGGED = ("time", "torque", "lost_motion", "temperature")
"""Quantities of the log."""

TOLD = ("torque_Nm", "temperature_C", "elapsed_s")
"""Inputs of the emulated controller in each tick, in the order of its log."""

COMPILER, EMULATOR = "arm-none-eabi-gcc", "qemu-system-arm"
MACHINE = "mps2-an386"
"""A board with a Cortex-M4F and 4 MiB of flash."""

FLAGS = (
    "-mthumb", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-std=gnu99", "-O2",
    "-ffp-contract=off", "-ffunction-sections", "-fdata-sections", "-DLM_REAL_BITS=32",
    "-Wall", "-Wextra", "-Werror", "-DLM_EFFECTS_MAX=8", "-DLM_EFFECT_MEMORY_MAX=8",
    "-DLM_ENVELOPE=1",
)  # fmt: skip
LINK = (
    "-nostartfiles", "--specs=nano.specs", "-Wl,--gc-sections", "-Wl,--defsym=flash_origin=0",
    "-Wl,--defsym=flash_length=0x400000", "-Wl,--defsym=ram_origin=0x20000000",
    "-Wl,--defsym=ram_length=0x4000",
)  # fmt: skip

SECONDS = 100.0
"""Time limit of a compilation and of a run in the emulator."""


@dataclass(frozen=True)
class Scores:
    """Error of the joint's output over each run, in arc seconds rms.

    Attributes
    ----------
    labels, temperature_C : list
        Of the runs.
    before, after : ndarray
        Without and with the correction.
    bits : str
        CRC-32 of every bit that the controller computed.
    tapes : list of Tape
        Ticks of the replay.
    """

    labels: list[int | str]
    temperature_C: list[float]
    before: FloatArray
    after: FloatArray
    bits: str
    tapes: list[Tape]


@dataclass(frozen=True)
class Emulated:
    """Output of the emulated controller: results by run, and the checksum."""

    before: FloatArray
    after: FloatArray
    bits: str


def make_log(campaign: Campaign) -> Campaign:
    """Select the torque loops at unusual temperatures, with the period of the controller."""
    means = np.array([float(np.mean(run.columns["temperature"])) for run in campaign.runs])
    swings = np.array([float(np.ptp(run.torque_Nm)) for run in campaign.runs])
    usual = float(np.median(means))
    far = (np.abs(means - usual) > 5.0) & (swings > 0.7 * swings.max())
    runs = []
    for run, chosen in zip(campaign.runs, far, strict=True):
        if chosen:
            ticks = np.arange(run.time_s[0], run.time_s[-1], PERIOD_S)
            columns = {
                name: ticks if name == "time" else np.interp(ticks, run.time_s, run.columns[name])
                for name in LOGGED
            }
            runs.append(Run(run.label, run.file, columns))
    return Campaign(runs)


def replay_here(blob: Path, log: Campaign) -> Scores:
    """Run the controller's code with exported parameters over the log on this machine."""
    parameters, _, _ = read_parameters(blob, {})
    result = replay(parameters, log)
    scores = [errors_of(tape) for tape in result.tapes]
    return Scores(
        [tape.run.label for tape in result.tapes],
        [float(np.mean(tape.run.columns["temperature"])) for tape in result.tapes],
        np.array([rms_of(before) for before, _, _ in scores]) / ARCSEC,
        np.array([rms_of(after) for _, after, _ in scores]) / ARCSEC,
        result.answer()["bits_crc32"],
        result.tapes,
    )


def export_both(drive_file: Path, header: Path) -> None:
    """Write the parameters for the controller, as ``lostmotion export`` does: header and blob."""
    drive = read_drive(drive_file)
    controller = make_controller(drive, {"period": PERIOD_S})
    for file in (header, header.with_suffix(".bin")):
        export(controller, file, name="joint_parameters", title=drive.name)


def missing_tools() -> str:
    """Name what is needed for the emulated controller and not installed, or nothing."""
    return " and ".join(name for name in (COMPILER, EMULATOR) if shutil.which(name) is None)


def emulate(header: Path, log: Campaign, folder: Path) -> Emulated | str:
    """Compile the controller with parameters and log, and run it in the emulator.

    Returns
    -------
    Emulated or str
        The reason if there is none.
    """
    missing = missing_tools()
    if missing:
        return f"{missing} not installed"
    folder.mkdir(exist_ok=True)
    shutil.copyfile(header, folder / "params.h")
    (folder / "log.h").write_text(log_text(log), encoding="ascii")
    sources = find_inputs() / FIRMWARE
    lib, examples = sources / "lib", sources / "firmware_examples"
    program = folder / "controller.elf"
    command = [
        COMPILER, *FLAGS, f"-I{folder}", f"-I{lib / 'include'}", f"-I{lib}",
        f"-I{examples / 'joint'}", f"-I{examples / 'targets'}",
        examples / "log" / "main.c", examples / "joint" / "table.c", examples / "joint" / "sine.c",
        examples / "targets" / "cortex_m.c", examples / "targets" / "print.c", lib / "status.c",
        *sorted((lib / "runtime").rglob("*.c")), *LINK, f"-T{examples / 'targets' / 'cortex_m.ld'}",
        "-o", program,
    ]  # fmt: skip
    said = run(command)
    if not isinstance(said, str):
        return f"{COMPILER} cannot compile for the target"
    said = run(
        [
            EMULATOR, "-M", MACHINE, "-nographic", "-monitor", "none", "-serial", "none",
            "-semihosting-config", "enable=on,target=native", "-kernel", program,
        ]
    )  # fmt: skip
    if not isinstance(said, str):
        return f"{EMULATOR} cannot run the program"
    numbers = re.findall(r"^([\d.]+) +([\d.]+)$", said, re.MULTILINE)
    bits = re.search(r"^([0-9a-f]{8})$", said, re.MULTILINE)
    if len(numbers) != len(log.runs) or bits is None:
        return f"{EMULATOR} printed unexpected output"
    values = np.array(numbers, dtype=np.float64)
    return Emulated(values[:, 0], values[:, 1], bits[1])


def run(command: list[Any]) -> str | None:
    """Run a program and return its output, or None if it failed."""
    try:
        done = subprocess.run(
            [str(word) for word in command],
            capture_output=True,
            text=True,
            check=False,
            timeout=SECONDS,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout + done.stderr if done.returncode == 0 else None


def log_text(log: Campaign) -> str:
    """Write a log as C: bits of the controller's inputs, and the measured lost motion."""
    from lostmotion.replay import conditions

    lines = []
    for one in log.runs:
        columns = conditions(one)
        words = [columns[name].view(np.uint32) for name in TOLD]
        words.append(one.lost_motion_rad.astype(np.float32).view(np.uint32))
        lines += [
            "{" + ",".join(f"0x{int(word):x}u" for word in row) + "},"
            for row in np.column_stack(words)
        ]
    starts = ", ".join(str(int(start)) for start in log.starts)
    return (
        "#include <stdint.h>\n"
        f"#define LOG_RUNS {len(log.runs)}\n"
        f"static const int32_t log_starts[] = {{{starts}}};\n"
        f"static const uint32_t log_bits[][{len(TOLD) + 1}] = {{\n" + "\n".join(lines) + "\n};\n"
    )
