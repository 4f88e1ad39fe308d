"""Campaigns from which the figures of the documentation are computed.

    python benchmarks/judging_suites.py DIR [--seeds develop --share 0.1]

`python -m rig suite` writes every suite into its folder of DIR with the options in the table. The
degraded suites repeat seeds of the standard ones, so that a campaign and its degraded copy differ
only by the condition. Confounded effects are not searched for: naming one counts as wrong.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rig.campaign import Conditions
from rig.suites import write_suite

SEEN = {"single": 5505, "clean": 3465, "outside": 1390, "pair": 1675, "aliased": 1260}
"""Evaluation seeds of every kind that earlier versions were evaluated with."""

LOST_COUNTS = 20
"""Encoder counts of 0.3 arcsec that are lost at one moment."""


@dataclass(frozen=True)
class Suite:
    """One folder of campaigns."""

    kind: str
    count: int
    after: int = 0
    """Seeds that are skipped, in addition to those used before."""
    every: int = 1
    conditions: dict[str, Any] = field(default_factory=dict)
    more: dict[str, Any] = field(default_factory=dict)


SPOILT: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "noise_2": ({"noise": 2.0}, {}),
    "noise_4": ({"noise": 4.0}, {}),
    "half": ({}, {"sigma": 0.25}),
    "third": ({}, {"plan": "third"}),
    "columns": ({"dropped_columns": ("temperature_C", "cycles")}, {}),
    "sheet": ({"sheet_bias": 0.2}, {}),
    "outliers": ({"outliers": 0.01}, {}),
    "counts": ({"dropped_counts": LOST_COUNTS}, {}),
    "scatter": ({"scatter": 3.0}, {}),
}
"""Conditions and options of the rig for every way in which a campaign is worse than standard."""

UNDECIDED = ("thermal_gap", "wear", "viscous_friction", "stribeck_friction")
"""Effects of which the short plan leaves pairs undecided."""

SUITES = {
    "clean": Suite("clean", 100),
    "single": Suite("single", 100),
    "outside": Suite("outside", 100),
    "pair": Suite("pair", 100),
    "aliased": Suite("aliased", 100),
    "short": Suite("single", 36, after=400, more={"plan": "short", "only": UNDECIDED}),
    "clean_scatter": Suite("clean", 100, after=110, conditions={"scatter": 3.0}),
    **{
        f"single_{name}": Suite("single", 8, every=2, conditions=conditions, more=more)
        for name, (conditions, more) in SPOILT.items()
    },
    **{
        f"clean_{name}": Suite("clean", 3, after=210, conditions=conditions, more=more)
        for name, (conditions, more) in SPOILT.items()
        if name not in ("half", "scatter")
    },
}
# With every eighth seed, one effect would depend on a column that is left out; with every seed,
# three do.
SUITES["single_columns"] = Suite(
    "single", 8, after=6, conditions=SPOILT["columns"][0], more=SPOILT["columns"][1]
)


def write(name: str, folder: Path, seeds: str, share: float) -> str:
    """Write one suite, or the first of it."""
    suite = SUITES[name]
    seen = SEEN[suite.kind] if seeds == "judge" else 0
    write_suite(
        suite.kind,
        math.ceil(share * suite.count),
        seeds,
        folder / name,
        conditions=Conditions(**suite.conditions),
        twins=False,
        report=lambda _: None,
        skip=seen + (suite.after if seeds == "judge" else 0),
        every=suite.every,
        **suite.more,
    )
    return name


def missing(folder: Path) -> Iterator[str]:
    """Suites that do not exist yet."""
    for name in SUITES:
        if not (folder / name / "suite.json").exists():
            yield name


def main() -> int:
    """Write the missing suites."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", choices=("develop", "judge"), default="judge")
    parser.add_argument("--share", type=float, default=1.0, help="only so much of every suite")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--suite", action="append", choices=SUITES, help="only these")
    arguments = parser.parse_args()
    wanted = [n for n in missing(arguments.folder) if n in (arguments.suite or SUITES)]
    with ProcessPoolExecutor(arguments.workers) as pool:
        for name in pool.map(
            write,
            wanted,
            [arguments.folder] * len(wanted),
            [arguments.seeds] * len(wanted),
            [arguments.share] * len(wanted),
        ):
            print(name, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
