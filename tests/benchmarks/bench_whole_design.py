"""Cost of a whole ``lostmotion design`` relative to its search alone.

    python tests/benchmarks/bench_whole_design.py [BUILD] [--spec NAME ...] [--evaluations N]
        [--repeats N]

BUILD is a build folder with the static libraries, that of ``./dev`` unless it is given; the package
is the installed one. The search alone ends before its verification. The whole design is a process
of its own, with the start of the interpreter, verification, certificate, all files and the report;
the modules of the package are compiled, as by any earlier command.
Processor time is that of all threads. The elapsed time is with a thread for each core, and valid
only on an idle machine: *busy* is the load. Each figure is the least of the repeats.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from bench_search import BUILD, SPECS, Problem, Search, load, read_spec, restate

HEAD = """\
| spec | designs | search, CPU s | with verification | whole design | CPU ratio | elapsed, s \
| elapsed ratio | busy |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |"""


def time_whole(name: str, evaluations: int) -> tuple[float, float]:
    """Processor and elapsed seconds of the command."""
    spec = next(file for folder in SPECS if (file := folder / f"{name}.toml").exists())
    text = re.sub(r"(?m)^evaluations = .*$", f"evaluations = {evaluations}", spec.read_text())
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / spec.name
        file.write_text(text)
        before, began = os.times(), time.perf_counter()
        subprocess.run(
            [sys.executable, "-m", "lostmotion", "design", file, "-o", file.with_suffix(".run")],
            check=True,
            env={k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"},
            stdout=subprocess.DEVNULL,
        )
        elapsed, after = time.perf_counter() - began, os.times()
    cpu = sum(after[2:4]) - sum(before[2:4])
    return cpu, elapsed


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build", type=Path, nargs="?", default=BUILD)
    parser.add_argument(
        "--spec",
        nargs="+",
        default=["robot_joint", "ring_generator", "instrument", "open_ring"],
    )
    parser.add_argument("--evaluations", type=int, default=5000)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    lib, cores = load(options.build), os.cpu_count() or 1
    print(HEAD)
    for name in options.spec:
        text = restate(read_spec(name), evaluations=options.evaluations)
        found = []
        for _ in range(options.repeats):
            row = []
            for verify in (False, True):
                with Search(Problem(lib, text), cores) as search:
                    cpu, began = time.process_time(), time.perf_counter()
                    search.run(verify=verify)
                    row += [time.process_time() - cpu, time.perf_counter() - began]
                    designs = len(search.read_front())
            found.append([*row, *time_whole(name, options.evaluations)])
        alone, elapsed, verified, _, whole, whole_elapsed = map(min, zip(*found, strict=True))
        print(
            f"| {name} | {designs} | {alone:.2f} | {verified:.2f} | {whole:.2f} | "
            f"{whole / alone:.1f} | {whole_elapsed:.2f} | {whole_elapsed / elapsed:.1f} | "
            f"{os.getloadavg()[0]:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
