"""Cost of a row: campaigns diagnosed in parallel in one run, per row, compared with the demo.

    python tests/benchmarks/bench_rows.py [DRIVE.toml DATA ...]

The demo's campaign is diagnosed unchanged, and with outliers in every column that it needs. Each
further drive file with its recordings is diagnosed as well; columns are read by the drive's map.
Times are those of all processors, so that other work on the machine counts little.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from lostmotion.discover import diagnose
from lostmotion.drives import read_drive
from lostmotion.recordings import read_campaign

DEMO = Path(__file__).parents[1] / "data" / "joint"

WILD = {"torque_Nm": (0.0, 1e5, -40.0), "output_angle_rad": (0.0,), "temperature_C": (85.0, -127.0)}
"""Values that single samples of a column read."""

EVERY = 1500
"""Rows between two outliers."""


def with_wild_values(folder: Path) -> Path:
    """Write the demo's campaign with outliers."""
    import gzip

    with gzip.open(DEMO / "joint.csv.gz", "rt") as file:
        head, *rows = (line.rstrip("\n").split(",") for line in file)
    wild = [(head.index(name), value) for name, values in WILD.items() for value in values]
    for k, row in enumerate(range(EVERY // 2, len(rows), EVERY)):
        column, value = wild[k % len(wild)]
        rows[row][column] = f"{value:g}"
    (folder / "wild.csv").write_text("\n".join(",".join(row) for row in [head, *rows]) + "\n")
    return folder / "wild.csv"


def measure(name: str, sheet: Path, recordings: list[Path]) -> float:
    """Diagnose, print a line, return the time of a row in ms."""
    begin = time.process_time()
    drive = read_drive(sheet)
    campaign = read_campaign(recordings, ratio=drive.ratio, mapping=drive.columns)
    found = diagnose(drive, campaign)
    row = 1e3 * (time.process_time() - begin) / campaign.rows
    wild = sum(finding.count for finding in campaign.findings if finding.kind == "wild")
    print(
        f"{name:24s} {campaign.rows:6d} {len(campaign.runs):4d} {wild:5d} {row:8.3f}  "
        f"{len(found.ladder):2d}  {found.verdict}: {', '.join(found.effects)}",
        flush=True,
    )
    return row


def main(words: list[str]) -> None:
    """Measure all, and print the cost of a row relative to the demo's."""
    print("campaign                   rows runs  wild  ms/row rungs  verdict")
    demo = measure("demo", DEMO / "joint.toml", [DEMO / "joint.csv.gz"])
    with tempfile.TemporaryDirectory() as folder:
        wild = measure("demo, wild values", DEMO / "joint.toml", [with_wild_values(Path(folder))])
    print(f"wild values: {wild / demo:.2f} times the clean copy (at most 2)")
    for sheet, data in zip(words[::2], words[1::2], strict=True):
        row = measure(Path(data).name, Path(sheet), [Path(data)])
        print(f"{Path(data).name}: {row / demo:.2f} times a row of the demo's (at most 3)")


if __name__ == "__main__":
    main(sys.argv[1:])
