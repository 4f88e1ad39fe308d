"""The compensator on a joint with independent equations: build, fit, run every case.

The same steps as for a user: the plant's bench recording is fitted by ``lostmotion fit``, exported
by ``lostmotion export`` with only period and resonance stated, and loaded as a blob.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from dataclasses import dataclass
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
ratio = {ratio}
rated_torque_Nm = {rated}
[catalogue]
T1_Nm = {t1}
T2_Nm = {t2}
K1_Nm_per_rad = {k1}
K2_Nm_per_rad = {k2}
K3_Nm_per_rad = {k3}
hysteresis_arcmin = 0.5
lost_motion_arcmin = 0.5
"""


@dataclass(frozen=True)
class Joint:
    """Values from the data sheet and from the joint (``joints.c``)."""

    ratio: int
    rated_Nm: float
    stiffness_Nm_per_rad: float
    resonance_Hz: float

    def sheet(self) -> str:
        """Return its drive file; the stiffness rises by 15 % from range to range."""
        return SHEET.format(
            ratio=self.ratio,
            rated=self.rated_Nm,
            t1=0.2 * self.rated_Nm,
            t2=0.625 * self.rated_Nm,
            k1=self.stiffness_Nm_per_rad,
            k2=1.15 * self.stiffness_Nm_per_rad,
            k3=1.3 * self.stiffness_Nm_per_rad,
        )


JOINTS = {
    "standard": Joint(100, 40, 2e4, 25),
    "soft": Joint(160, 60, 1.6e4, 12),
    "stiff": Joint(50, 25, 4.3e4, 60),
}


def build(folder: Path, profile: str = "FULL") -> Path:
    """Compile the plant with the run-time code of a profile."""
    program = folder / f"plant_{profile.lower()}"
    main_file = HERE / ("gap.c" if profile == "GAP" else "main.c")
    sources = [main_file, *(HERE / name for name in ("plant.c", "joints.c", "loop.c")), *LIBRARY]
    if profile != "GAP":
        sources.append(HERE / "duty.c")
    options = [*FLAGS, f"-DLM_PROFILE=LM_PROFILE_{profile}"]
    subprocess.run(["cc", *options, *map(str, sources), "-lm", "-o", program], check=True)
    return program


def export(folder: Path, program: Path, rates_kHz: list[int], joint: str = "standard") -> list[str]:
    """Fit a joint's bench recording; ``KHZ=BLOB`` of each rate."""
    sheet, recording, fitted = (folder / name for name in ("plant.toml", "bench.csv", "fit.toml"))
    sheet.write_text(JOINTS[joint].sheet())
    with recording.open("w") as out:
        subprocess.run([program, "bench", joint], stdout=out, check=True)
    fit = ["fit", str(sheet), str(recording), "--add", "thermal_gap", "-o", str(fitted)]
    if main([*fit, "--quiet"]) != 0:
        raise SystemExit("the fit failed")
    made = []
    for rate in rates_kHz:
        blob = folder / f"{rate}_kHz.bin"
        options = ["--profile", "full", "--set", f"period_us={1000 // rate}", "--quiet"]
        options += ["--resonance-Hz", str(JOINTS[joint].resonance_Hz)]
        if main(["export", str(fitted), "-o", str(blob), *options]) != 0:
            raise SystemExit("the export failed")
        made.append(f"{rate}={blob}")
    return made


def run(program: Path, what: str, arguments: list[str]) -> tuple[int, str]:
    """Exit status and output of ``run`` or ``duty``."""
    done = subprocess.run([program, what, *arguments], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def judge_joints(names: list[str]) -> int:
    """Print every case of these joints; 1 if one is worse than no compensation or rings."""
    failed = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = build(folder)
        for joint in names:
            status, table = run(program, "run", [joint, *export(folder, program, [1, 10], joint)])
            print(f"{joint}\n{table}")
            failed |= status
    return failed


if __name__ == "__main__":
    sys.exit(judge_joints(sys.argv[1:]))
