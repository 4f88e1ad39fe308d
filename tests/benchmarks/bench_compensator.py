"""The compensator with an independent joint (tests/plant), and its watch over 1000 hours."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "plant"))

import plant_table


def main() -> int:
    """Print the table; 1 if a case fails that is not among the known exceptions."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = plant_table.build(folder)
        blobs = plant_table.export(folder, program, [1, 10])
        status, table = plant_table.run(program, "run", ["standard", *blobs])
        print(table)
        faults, said = plant_table.run(program, "duty", [blobs[0].partition("=")[2], "1000"])
        print(said)
        gap = subprocess.run([plant_table.build(folder, "GAP")], check=False)
    return status or faults or gap.returncode


if __name__ == "__main__":
    sys.exit(main())
