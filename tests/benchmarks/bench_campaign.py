"""A campaign read, compared with its drive and diagnosed over the whole library: time of each, s.

    python tests/benchmarks/bench_campaign.py [CAMPAIGN.csv.gz DRIVE.toml]

Without arguments a campaign of the rig is written first: 44,200 rows in 31 runs.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lostmotion.compare import compare
from lostmotion.discover import diagnose
from lostmotion.drives import read_drive
from lostmotion.model import make_torsion_curve
from lostmotion.recordings import read_campaign
from lostmotion.threads import cores

sys.path.insert(0, str(Path(__file__).parents[1]))
from rig.campaign import make_campaign

ROUNDS = 3


def timed(what: str, work: Callable[[], Any]) -> Any:
    """Call a function a few times and print the least wall time and processor time."""
    walls, used = [], []
    for _ in range(ROUNDS):
        wall, processor = time.perf_counter(), time.process_time()
        found = work()
        walls.append(time.perf_counter() - wall)
        used.append(time.process_time() - processor)
    print(f"{what:10s} {min(walls):5.2f}  {min(used):5.2f}", flush=True)
    return found


def measure(recording: Path, sheet: Path) -> None:
    """Read, compare, diagnose, print."""
    drive = read_drive(sheet)
    campaign = read_campaign(recording, ratio=drive.ratio)
    torque = campaign.largest_torque_Nm
    torsion_curve = make_torsion_curve(drive, torque)
    print(f"{campaign.rows} rows in {len(campaign.runs)} runs, {cores()} cores")
    print(f"load of the machine {os.getloadavg()[0]:.1f}")
    print("            clock  processors")
    timed("read", lambda: read_campaign(recording, ratio=drive.ratio))
    answer = timed("compare", lambda: compare(torsion_curve, campaign)).answer()
    found = timed(
        "diagnose",
        lambda: diagnose(
            None,
            campaign,
            ratio=drive.ratio,
            rated_torque_Nm=drive.rated_torque_Nm,
            torsion_curve=torsion_curve,
        ),
    )
    print(
        f"rms {answer['rms_arcsec']:.2f}, predicted {answer['heldout_rms_arcsec']:.2f}, floor "
        f"{answer['noise_floor_arcsec']:.2f} arcsec; {found.verdict}: {', '.join(found.effects)}"
    )


def main() -> None:
    """Measure the given campaign, or one of the rig."""
    if len(sys.argv) == 3:
        measure(Path(sys.argv[1]), Path(sys.argv[2]))
        return
    with tempfile.TemporaryDirectory() as place:
        make_campaign(1, 0, {"thermal_gap": 1.0}).write(Path(place), "rig")
        measure(Path(place) / "rig.csv.gz", Path(place) / "rig.toml")


if __name__ == "__main__":
    main()
