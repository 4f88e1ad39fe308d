"""Comparison of a campaign of the rig with its drive: time of each part, s.

    python tests/benchmarks/bench_compare.py [CAMPAIGN.csv.gz DRIVE.toml]

Without arguments a campaign of the rig is written first: 44,200 rows in 31 runs.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from lostmotion.compare import compare
from lostmotion.drives import read_drive
from lostmotion.model import make_backbone
from lostmotion.recordings import read_campaign

sys.path.insert(0, str(Path(__file__).parents[1]))
from rig.campaign import make_campaign

ROUNDS = 3


def main() -> None:
    """Read, compare, print."""
    with tempfile.TemporaryDirectory() as place:
        if len(sys.argv) == 3:
            recording, sheet = Path(sys.argv[1]), Path(sys.argv[2])
        else:
            make_campaign(1, 0, {"thermal_gap": 1.0}).write(Path(place), "rig")
            recording, sheet = Path(place) / "rig.csv.gz", Path(place) / "rig.toml"
        drive = read_drive(sheet)
        begin = time.perf_counter()
        campaign = read_campaign(recording, ratio=drive.ratio)
        print(f"read     {time.perf_counter() - begin:5.2f}  {campaign.rows} rows")
        backbone = make_backbone(drive, float(np.max(np.abs(campaign.column("torque")))))
        for _ in range(ROUNDS):
            begin, used = time.perf_counter(), time.process_time()
            found = compare(backbone, campaign).answer()
            wall, used = time.perf_counter() - begin, time.process_time() - used
            print(f"compare  {wall:5.2f}  ({used:.2f} of the processor)")
        print(
            f"rms {found['rms_arcsec']:.2f}, held out {found['heldout_rms_arcsec']:.2f}, floor "
            f"{found['noise_floor_arcsec']:.2f} arcsec"
        )


if __name__ == "__main__":
    main()
