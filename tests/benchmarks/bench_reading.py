"""Time to read a text as a campaign, compared with pyarrow's reader alone.

    python tests/benchmarks/bench_reading.py [MEGABYTES]

The text is clean: commas, a header in the first line. Both read it in turn, in one process, so that
other work on the machine affects both.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.csv

from lostmotion.recordings import read_campaign

ROUNDS = 5
RUN_ROWS = 100_000


def write(file: Path, megabytes: float) -> int:
    """Write loops of a drive with a locked input; return the number of rows."""
    rows = round(megabytes * 1e6 / 52)
    at = np.arange(rows)
    torque = 40 * np.sin(at / 300)
    angle = 0.007 + torque / 3e4
    columns = (1 + at // RUN_ROWS, at * 0.01, torque, np.full(rows, 0.7), angle, 23 + at / rows)
    with open(file, "w") as stream:
        stream.write("run,time_s,torque_Nm,input_angle_rad,output_angle_rad,temperature_C\n")
        form = ("%d", "%.2f", "%.5f", "%.6f", "%.8f", "%.3f")
        np.savetxt(stream, np.column_stack(columns), fmt=form, delimiter=",")
    return rows


def seconds(work: Callable[[], object]) -> float:
    """Time of a call."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def main() -> None:
    """Write, read in turn, print."""
    megabytes = float(sys.argv[1]) if len(sys.argv) > 1 else 100.0
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "clean.csv"
        rows = write(file, megabytes)
        campaign, alone = [], []
        for _ in range(ROUNDS):
            campaign.append(seconds(lambda: read_campaign(file, ratio=100)))
            alone.append(seconds(lambda: pyarrow.csv.read_csv(file)))
        size = file.stat().st_size / 1e6
    ratio = float(np.median(np.array(campaign) / np.array(alone)))
    print(
        f"{rows} rows, {size:.0f} MB: campaign {min(campaign):.2f} s, pyarrow alone "
        f"{min(alone):.2f} s, ratio {ratio:.1f}"
    )


if __name__ == "__main__":
    main()
