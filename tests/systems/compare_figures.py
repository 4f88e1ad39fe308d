"""Compare the numbers of another system with those of this one.

    compare_figures.py HERE THERE [-- EMULATOR ...]

HERE and THERE are build folders of the same sources. Compared are figures and limits at points of
the shipped specs, and the shipped searches: the fronts as they are printed. The C libraries of two
systems differ in the last place, and the figures by the effect of that place. It is measured
here: the same program with every result of the C library moved by one unit in the last
place (one_ulp.c). Figures that differ by more have another cause.
"""

from __future__ import annotations

import argparse
import csv
import os
import subprocess
import sys
import tempfile
from pathlib import Path

SPECS = Path(__file__).resolve().parents[1] / "data" / "specs"
POINTS = 200


def output_of(words: list[str | Path], **environment: str) -> str:
    """Text that a program prints, with this system's line ends."""
    done = subprocess.run(
        words, capture_output=True, text=True, check=True, env={**os.environ, **environment}
    )
    return done.stdout.replace("\r\n", "\n")


def program(build: Path, name: str) -> Path:
    """Return a program of a build folder, with or without a suffix."""
    return next(p for p in sorted(build.glob(f"{name}*")) if p.suffix in ("", ".exe"))


def difference_of(here: str, there: str) -> tuple[int, float]:
    """Count the numbers of two texts, and give their largest relative difference."""
    pairs = list(zip(here.split(), there.split(), strict=True))
    return len(pairs), max(
        abs(float(a) - float(b)) / max(1.0, abs(float(a))) if a != b else 0.0 for a, b in pairs
    )


def front_of(build: Path, emulator: list[str], spec: Path, folder: Path) -> list[list[str]]:
    """Search by a shipped spec and read the front as printed."""
    words = [*emulator, program(build / "optimizer", "lostmotion-optimizer"), spec, folder]
    done = subprocess.run(
        [*words, "--progress", "none"], capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise SystemExit(f"{spec.name}: exit {done.returncode}: {done.stderr}")
    with (folder / "front.csv").open() as file:
        return list(csv.reader(file))


def main() -> int:
    """Compare two build folders and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("here", type=Path)
    parser.add_argument("there", type=Path)
    parser.add_argument("emulator", nargs="*")
    arguments = parser.parse_args()
    agree = True
    for spec in sorted(SPECS.glob("*.search")):
        printed, there_printed = (
            [*before, program(build / "tests" / "c", "print_figures"), spec, str(POINTS)]
            for build, before in ((arguments.here, []), (arguments.there, arguments.emulator))
        )
        here_said = output_of(printed)
        count, largest = difference_of(here_said, output_of(there_printed))
        preload = str((arguments.here / "tests" / "c" / "libone_ulp.so").resolve())
        _, last_place = difference_of(here_said, output_of(printed, LD_PRELOAD=preload))
        if last_place == 0:
            raise SystemExit(f"{preload} moved no figure: was it loaded?")
        agree = agree and largest <= last_place
        print(
            f"{spec.stem}: {count} objectives and limits, largest difference {largest:.1e}; "
            f"one unit in the last place of the C library moves them by up to {last_place:.1e}"
        )
        with tempfile.TemporaryDirectory() as work:
            here = front_of(arguments.here, [], spec, Path(work) / "here")
            there = front_of(arguments.there, arguments.emulator, spec, Path(work) / "there")
        same = sum(row in there for row in here) - 1
        said = "the same bytes" if here == there else f"{same} designs printed the same"
        print(f"{spec.stem}: front of {len(here) - 1} here and {len(there) - 1} there, {said}")
    return int(not agree)


if __name__ == "__main__":
    sys.exit(main())
