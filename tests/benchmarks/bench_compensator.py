"""The compensator round an independent joint, at 1 and 10 kHz (tests/plant); prints one table."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "plant"))

import plant_table


def main() -> int:
    """Print the table; 1 where a case fails that is not known to."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = plant_table.build(folder)
        status, table = plant_table.run(program, plant_table.export(folder, program, [1, 10]))
        print(table)
    return status


if __name__ == "__main__":
    sys.exit(main())
