"""From a CSV file without a drive file to the first result: the commands of the README."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]

COMMANDS_MOST = 5
"""Number of commands to the first answer, including the installation."""


def typed() -> list[list[str]]:
    """Return the commands in the README, as words."""
    text = (ROOT / "README.md").read_text("utf-8")
    block = re.search(r"<!-- first answer -->\n```sh\n(.*?)```", text, re.DOTALL)
    assert block is not None
    return [line.split("#")[0].split() for line in block[1].splitlines()]


def write_recordings(file: Path) -> None:
    """Write loops of a drive whose gap grows with the temperature, like those of a user's bench."""
    rng = np.random.default_rng(3)
    lines = ["run,time_s,torque_Nm,lost_motion_arcmin,temperature_C"]
    for run in range(8):
        for k in range(100):
            torque = 50.0 * math.sin(0.02 * math.pi * k)
            lost = torque / 4e4 + 1e-4 * (1.0 + 0.05 * run) * math.tanh(torque / 4.0)
            lost += 2e-6 * float(rng.standard_normal())
            lines.append(
                f"{run},{0.02 * k:.2f},{torque:.6g},{60 * math.degrees(lost):.6g},{20 + 3 * run}"
            )
    file.write_text("\n".join(lines) + "\n")


def test_the_commands_of_the_readme_lead_from_a_csv_to_the_missing_effect(tmp_path: Path) -> None:
    commands = typed()
    assert len(commands) <= COMMANDS_MOST
    assert commands[0][:2] == ["pip", "install"]
    write_recordings(tmp_path / "mine.csv")
    for words in commands[1:]:
        assert words[0] == "lostmotion"
        done = subprocess.run(
            [sys.executable, "-m", *words],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Missing: thermal_gap.")
