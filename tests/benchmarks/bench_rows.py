"""Cost of a row: campaigns diagnosed one after the other, per row, compared with the demo.

    python tests/benchmarks/bench_rows.py [DRIVE.toml DATA ...]

The demo's campaign is diagnosed unchanged, and with outliers in every column that it needs; then
the public recordings of `tests/data`, and campaigns of the rig, one for every plan. Each further
drive file with its recordings is diagnosed as well; columns are read by the drive's map. Times are
those of all processors, so that other work on the machine counts little.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rig.campaign import make_campaign

from lostmotion import cli
from lostmotion.discover import diagnose
from lostmotion.drives import read_drive
from lostmotion.recordings import read_campaign

DATA = Path(__file__).parents[1] / "data"
DEMO = DATA / "joint"

PUBLIC = (
    ("cycloidal_preload/conic_axial.csv.gz", None),
    ("cycloidal_preload/base_wear.csv.gz", None),
    ("cycloidal_locked_output/base_onyx_runin5.csv", "cycloidal_locked_output/drive.toml"),
    ("friction_damper/loops.csv", "friction_damper/drive.toml"),
)
"""Public recordings of several runs, and their drive file; without one `characterize` writes it."""

PRELOAD_RATED_Nm = "35"
"""Rated torque stated for the cycloidal actuator, as on the page of real drives."""

RIG = (
    ("third", "thermal_gap"),
    ("short", "wear"),
    ("aliased", "thermal_gap"),
    ("loops", "stiffness_modulation"),
    ("extended", "creep"),
)
"""Plans of the rig other than the demo's, and the effect hidden in each."""

RIG_SIGMA, RIG_SEED = 1.0, 40
"""Residual of that effect in noises, and seed of the first campaign (development)."""

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


def public_sheet(recording: Path, sheet: str | None, folder: Path) -> Path:
    """Drive file of a public recording, written by `characterize` if there is none."""
    if sheet is not None:
        return DATA / sheet
    file = folder / f"{recording.name.split('.')[0]}.toml"
    words = [str(recording), "--rated-torque-Nm", PRELOAD_RATED_Nm, "-o", str(file), "--quiet"]
    if cli.main(["characterize", *words]) != 0:
        raise SystemExit(f"characterize fails for {recording.name}")
    return file


def main(words: list[str]) -> None:
    """Measure all, and print the cost of a row relative to the demo's."""
    print("campaign                   rows runs  wild  ms/row rungs  verdict")
    demo = measure("demo", DEMO / "joint.toml", [DEMO / "joint.csv.gz"])
    times: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wild = measure("demo, wild values", DEMO / "joint.toml", [with_wild_values(folder)])
        for file, sheet in PUBLIC:
            recording = DATA / file
            times[file] = measure(
                recording.name, public_sheet(recording, sheet, folder), [recording]
            )
        for number, (plan, effect) in enumerate(RIG):
            label = f"rig: {plan}, {effect}"
            campaign = make_campaign(RIG_SEED + number, number, {effect: RIG_SIGMA}, plan)
            campaign.write(folder, plan)
            times[label] = measure(label, folder / f"{plan}.toml", [folder / f"{plan}.csv.gz"])
        for sheet, data in zip(words[::2], words[1::2], strict=True):
            times[data] = measure(Path(data).name, Path(sheet), [Path(data)])
    print(f"wild values: {wild / demo:.2f} times the clean copy (at most 2)")
    for label, row in times.items():
        print(f"{label}: {row / demo:.2f} times a row of the demo's (at most 3)")


if __name__ == "__main__":
    main(sys.argv[1:])
