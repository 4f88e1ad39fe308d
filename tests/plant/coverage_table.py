"""Diagnostic coverage of the runtime's own checks: builds `coverage.c`, prints its table.

python tests/plant/coverage_table.py
"""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

import plant_table


def measure(folder: Path) -> str:
    """Rows of the table, for the plant's fitted parameters."""
    blob = plant_table.export(folder, plant_table.build(folder), [1])[0].partition("=")[2]
    program = folder / "coverage"
    own = [plant_table.HERE / name for name in ("coverage.c", "duty.c", "plant.c")]
    options = [*plant_table.FLAGS, "-DLM_PROFILE=LM_PROFILE_FULL"]
    sources = map(str, [*own, *plant_table.LIBRARY])
    subprocess.run(["cc", *options, *sources, "-lm", "-o", program], check=True)
    return subprocess.run([program, blob], capture_output=True, text=True, check=True).stdout


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as made:
        print(measure(Path(made)), end="")
