"""The compensator on a joint with independent equations: build, fit, run every case.

The way of the product: the plant's bench recording is fitted by ``lostmotion fit``, exported by
``lostmotion export`` with nothing stated but the period, and loaded as a blob.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

from lostmotion.cli import main

ROOT = Path(__file__).resolve().parents[2]
HERE = ROOT / "tests" / "plant"
LIBRARY = [
    ROOT / "lib" / "status.c",
    *sorted((ROOT / "lib" / "runtime").glob("*.c")),
    *sorted((ROOT / "lib" / "runtime" / "effects").glob("*.c")),
]
FLAGS = [
    "-std=c99",
    "-O2",
    "-ffp-contract=off",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-DLM_REAL_BITS=32",
    f"-I{ROOT / 'lib' / 'include'}",
    f"-I{ROOT / 'lib'}",
    f"-I{HERE}",
]
SHEET = """
[drive]
name = "plant"
ratio = 100
rated_torque_Nm = 40
[catalogue]
T1_Nm = 8
T2_Nm = 25
K1_Nm_per_rad = 2e4
K2_Nm_per_rad = 2.3e4
K3_Nm_per_rad = 2.6e4
hysteresis_arcmin = 0.5
lost_motion_arcmin = 0.5
"""


def build(folder: Path, profile: str = "FULL") -> Path:
    """Compile the plant with the run-time code of a profile."""
    program = folder / f"plant_{profile.lower()}"
    main_file = HERE / ("gap.c" if profile == "GAP" else "main.c")
    sources = [main_file, HERE / "plant.c", HERE / "loop.c", *LIBRARY]
    if profile != "GAP":
        sources.append(HERE / "duty.c")
    options = [*FLAGS, f"-DLM_PROFILE=LM_PROFILE_{profile}"]
    subprocess.run(["cc", *options, *map(str, sources), "-lm", "-o", program], check=True)
    return program


def export(folder: Path, program: Path, rates_kHz: list[int]) -> list[str]:
    """Fit the plant's bench recording; ``KHZ=BLOB`` of each rate."""
    sheet, recording, fitted = (folder / name for name in ("plant.toml", "bench.csv", "fit.toml"))
    sheet.write_text(SHEET)
    with recording.open("w") as out:
        subprocess.run([program, "bench"], stdout=out, check=True)
    fit = ["fit", str(sheet), str(recording), "--add", "thermal_gap", "-o", str(fitted)]
    if main([*fit, "--quiet"]) != 0:
        raise SystemExit("the fit failed")
    made = []
    for rate in rates_kHz:
        blob = folder / f"{rate}_kHz.bin"
        options = ["--profile", "full", "--set", f"period_us={1000 // rate}", "--quiet"]
        if main(["export", str(fitted), "-o", str(blob), *options]) != 0:
            raise SystemExit("the export failed")
        made.append(f"{rate}={blob}")
    return made


def run(program: Path, what: str, arguments: list[str]) -> tuple[int, str]:
    """Exit status and output of ``run`` or ``duty``."""
    done = subprocess.run([program, what, *arguments], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr
