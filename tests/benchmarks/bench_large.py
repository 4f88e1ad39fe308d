"""Recordings larger than memory: time, peak memory and verdict of a diagnosis.

    python tests/benchmarks/bench_large.py [--rows 100000000] [--effect thermal_gap]

Writes a campaign of the rig with as many rows, run by run, into a temporary folder (Parquet, about
25 bytes a row), diagnoses it through Dask on this machine, and diagnoses a tenth of the rows read
into memory. Each diagnosis is a separate process, whose peak memory the system reports.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

sys.path.insert(0, str(Path(__file__).parents[1]))
from rig.campaign import angle_noise, make_campaign

GIB = 2**30
COUNT_RAD = 0.3 * np.pi / 180 / 3600
SIGMA_RAD = 1.5 * np.pi / 180 / 3600
GROUP_ROWS = 1 << 20


def write(folder: Path, name: str, rows: int, effect: str, sigma: float, seed: int) -> Path:
    """Write a campaign of the rig with more samples in each run, and fresh noise on all of them."""
    made = make_campaign(seed, 0, {effect: sigma} if effect else {})
    plan, drive = made.bench.plan, made.bench.drive
    data = folder / name
    data.mkdir()
    chance = np.random.default_rng(seed)
    factor = rows / plan.time_s.size
    lost = made.readings.lost_motion_rad
    for number, at in enumerate(plan.slices()):
        old = np.arange(at.stop - at.start)
        count = max(2, round(factor * old.size))
        writer = None
        for begin in range(0, count, GROUP_ROWS):
            some = np.arange(begin, min(begin + GROUP_ROWS, count))
            x = some * (old.size - 1) / (count - 1)

            def fine(values: np.ndarray, x: np.ndarray = x, old: np.ndarray = old) -> np.ndarray:
                return np.interp(x, old, values)

            angle = fine(plan.input_angle_rad[at])
            noise = SIGMA_RAD * angle_noise(chance, [some.size])
            output = fine(lost[at]) + noise + angle / drive.ratio
            torque = fine(made.readings.torque_Nm[at])
            torque += 2e-4 * drive.rated_torque_Nm * chance.standard_normal(some.size)
            table = pa.table(
                {
                    "run": np.full(some.size, number + 1, dtype=np.int32),
                    "time_s": fine(plan.time_s[at]),
                    "torque_Nm": torque.astype(np.float32),
                    "input_angle_rad": angle,
                    "output_angle_rad": COUNT_RAD * np.round(output / COUNT_RAD),
                    "temperature_C": fine(plan.temperature_C[at]).astype(np.float32),
                    "cycles": fine(plan.cycles[at]).astype(np.float32),
                }
            )
            writer = writer or pq.ParquetWriter(data / f"{number + 1:03d}.parquet", table.schema)
            writer.write_table(table)
        assert writer is not None
        writer.close()
    return data


def sheet(folder: Path, effect: str, sigma: float, seed: int) -> Path:
    """Write the drive file."""
    file = folder / "drive.toml"
    made = make_campaign(seed, 0, {effect: sigma} if effect else {})
    made.write(folder, "sheet")
    (folder / "sheet.toml").rename(file)
    return file


def diagnose(drive: Path, data: Path, *more: str) -> dict[str, object]:
    """Diagnose in a separate process."""
    begin = time.perf_counter()
    words = [sys.executable, "-m", "lostmotion", "diagnose", str(drive), str(data), "--json", "-"]
    code = (
        "import json, resource, subprocess, sys;"
        "done = subprocess.run(sys.argv[1:], capture_output=True, text=True, check=True);"
        "answer = json.loads(done.stdout);"
        "answer['peak_kib'] = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss;"
        "print(json.dumps(answer))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *words, *more], capture_output=True, text=True, check=True
    )
    answer: dict[str, object] = json.loads(done.stdout)
    answer["seconds"] = time.perf_counter() - begin
    return answer


def main() -> int:
    """Write, diagnose, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=5_000_000)
    parser.add_argument("--effect", default="thermal_gap")
    parser.add_argument("--sigma", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    how = (arguments.effect, arguments.sigma, arguments.seed)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        drive = sheet(folder, *how)
        verdicts = []
        for name, rows, more in (
            ("all", arguments.rows, ["--dask"]),
            ("tenth", arguments.rows // 10, []),
        ):
            begin = time.perf_counter()
            data = write(folder, name, rows, *how)
            wrote = time.perf_counter() - begin
            size = sum(f.stat().st_size for f in data.iterdir()) / GIB
            found = diagnose(drive, data, *more)
            verdicts.append((found["verdict"], found["effects"]))
            print(
                f"{rows:>11} rows, {size:.2f} GiB written in {wrote:.0f} s: {found['verdict']} "
                f"{found['effects']}, {found['samples']} rows used, {found['seconds']:.0f} s, "
                f"peak {float(str(found['peak_kib'])) / 2**20:.2f} GiB, ladder "
                f"{[round(r['rms_arcsec'], 2) for r in found['ladder']]}",
                flush=True,
            )
            for file in data.iterdir():
                file.unlink()
    same = verdicts[0] == verdicts[1]
    print("the same verdict" if same else "another verdict")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
    print(f"largest process {peak:.2f} GiB")
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
