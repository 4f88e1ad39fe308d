"""Diagnosis judged on campaigns of the rig: the confusion table and the times.

    cd tests && python -m rig suite --kind single --count 20 --seeds develop -o DIR
    python benchmarks/bench_diagnosis.py DIR [--workers 2] [--json FILE]

A campaign counts as right when the hidden effect is named (first, for a single one), as wrong when
another effect is named alone. For causes outside the library right is `unexplained` with a column
that the truth lists; for a sudden event also its run, and its second within `SECONDS`.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter, defaultdict
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from lostmotion.discover import diagnose
from lostmotion.discover.threads import one_thread
from lostmotion.drives import read_drive
from lostmotion.model import make_backbone
from lostmotion.recordings import read_campaign

SECONDS = 1.0
"""How far a sudden event may be placed from where it was."""


def run(truth_file: Path) -> dict[str, Any]:
    """Diagnose one campaign."""
    truth = json.loads(truth_file.read_text())
    stem = truth_file.name.removesuffix(".truth.json")
    drive = read_drive(truth_file.with_name(f"{stem}.toml"))
    campaign = read_campaign(truth_file.with_name(f"{stem}.csv.gz"), ratio=drive.ratio)
    largest = float(np.max(np.abs(campaign.column("torque"))))
    begin, cpu = time.perf_counter(), time.process_time()
    with one_thread():
        found = diagnose(
            campaign,
            ratio=drive.ratio,
            rated_torque_Nm=drive.rated_torque_Nm,
            backbone=make_backbone(drive, largest),
        ).answer()
    return {
        "name": stem,
        "truth": truth,
        "answer": found,
        "wall_s": time.perf_counter() - begin,
        "cpu_s": time.process_time() - cpu,
        "rows": campaign.rows,
        "judged": judge(truth, found),
    }


def kind_of(truth: dict[str, Any]) -> str:
    """Which kind of campaign it is."""
    hidden = list(truth["effects"])
    if not hidden:
        return "clean"
    if any(name.startswith("outside") for name in hidden):
        return "outside"
    if "aliased" in str(truth.get("plan", "")):
        return "aliased"
    return "pair" if len(hidden) > 1 else "single"


def judge(truth: dict[str, Any], found: dict[str, Any]) -> str:
    """Right, set, none, unexplained, wrong ..."""
    hidden = list(truth["effects"])
    verdict, named = found["verdict"], found["effects"]
    kind = kind_of(truth)
    if kind == "clean":
        return "right" if verdict == "complete" else f"false alarm ({verdict})"
    if kind == "outside":
        if truth.get("events"):
            for event in truth["events"]:
                close = [
                    e
                    for e in found["events"]
                    if str(e["run"]) == str(event["run"])
                    and abs(e["time_s"] - event["time_s"]) <= SECONDS
                ]
                if not close:
                    return f"event not found ({verdict})"
            return "right" if verdict == "unexplained" else f"event, but {verdict}"
        if verdict != "unexplained":
            return f"not unexplained ({verdict})"
        wanted = {
            name
            for cause in truth["hidden"]
            for name in (cause.get("depends_on") or [])
        }
        shown = {d["covariate"] for d in found["unexplained"]["depends_on"]}
        stems = {
            name.rsplit("_", 1)[0] if "_" in name else name for name in wanted
        } | wanted
        return "right" if shown & stems else "right verdict, other column"
    given = truth.get("twins") or []
    lists = given.values() if isinstance(given, dict) else [given]
    twins = {twin for names in lists for twin in names}
    if verdict == "complete":
        return "none"
    if kind == "pair":
        both = set(hidden) <= set(named)
        if both:
            return "right"
        return "one of two" if set(hidden) & set(named) else f"wrong ({verdict})"
    if named and named[0] == hidden[0] and verdict != "unexplained":
        return "right" if verdict == "missing-effect" else "right first, with a set"
    if hidden[0] in named:
        return "in the set" if verdict == "ambiguous" else f"named ({verdict})"
    if verdict == "unexplained":
        return "unexplained"
    if set(named) & twins:
        return "twin"
    return "wrong"


def main() -> int:
    """Run a folder of campaigns and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="+")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    files = sorted(
        f for folder in arguments.folder for f in folder.rglob("*.truth.json")
    )
    table: dict[str, Counter[str]] = defaultdict(Counter)
    rows = []
    with ProcessPoolExecutor(arguments.workers) as pool:
        for done in pool.map(run, files):
            truth, answer = done["truth"], done["answer"]
            kind = kind_of(truth)
            table[kind][done["judged"]] += 1
            rows.append(done)
            ladder = [round(r["rms_arcsec"], 2) for r in answer["ladder"]]
            depends = [
                (d["covariate"], d["shape"])
                for d in answer["unexplained"]["depends_on"]
            ]
            print(
                f"{done['name']:<18} {kind:<8} {'+'.join(truth['effects']) or '-':<42} "
                f"{done['judged']:<28} {answer['verdict']:<15} {answer['effects']} {depends} "
                f"{ladder} floor {answer['noise_floor_arcsec']:.2f} "
                f"{done['wall_s']:.0f} s, {done['cpu_s']:.0f} s cpu",
                flush=True,
            )
    for kind, counts in table.items():
        total = sum(counts.values())
        print(f"\n{kind} ({total})")
        for what, number in counts.most_common():
            print(f"  {what:<34} {number:4d}  {100 * number / total:5.1f} %")
    if arguments.json is not None:
        for done in rows:
            done["answer"].pop("candidates")
        arguments.json.write_text(json.dumps(rows, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
