"""One more run for ambiguous campaigns: the suggested one, or a repeated one.

    python benchmarks/bench_next.py CAMPAIGNS --results FILE.jsonl [--workers 2]

CAMPAIGNS are those of `judging_suites.py`. Of the runs that the rig offers (`rig/following.py`),
the one that `next` ranks first is made on the rig with the same specimen, effect, noise and
scatter, and so is a repeat of a run of the plan; both campaigns are diagnosed again. A campaign
counts as resolved if only the hidden effect is named. Results are stored with those of
`bench_diagnosis.py`.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench_diagnosis import (
    KEPT,
    Record,
    diagnosed,
    in_turn,
    load,
    page,
    read,
    suite_and_count,
    work,
)

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rig.following import drive_number, followed, offered, options_text, repeated
from rig.plans import Run

from lostmotion.discover.next_run import next_runs
from lostmotion.discover.plan_file import read_plan
from lostmotion.effects.library import library
from lostmotion.threads import one_thread

UNDECIDED = ("aliased", "short")
"""Suites whose plans leave effects open."""


def run(truth_file: Path) -> Record:
    """Diagnose; if the answer is ambiguous, add either run and diagnose again."""
    truth, drive, campaign = read(truth_file)
    done: Record = {
        "what": "next",
        "suite": truth_file.parent.name,
        "name": truth_file.name.removesuffix(".truth.json"),
        "truth": truth,
    }
    with one_thread(), tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        found = diagnosed(drive, campaign)
        answer = found.answer()
        done |= {"answer": {key: answer[key] for key in KEPT}, "rows": campaign.rows}
        if found.verdict != "ambiguous":
            return done
        number = drive_number(truth)
        offers: dict[str, Run] = {}

        def note(runs: list[Run], ratio: int) -> list[Run]:
            offers.update(offered(runs, ratio))
            return []

        made = followed(truth, number, note)
        plan = folder / "options.csv"
        plan.write_text(options_text(offers, drive.rated_torque_Nm, made.columns))
        ranking = next_runs(found, read_plan([plan], drive.ratio), library(), drive.ratio)
        suggested = str(ranking["suggested"])

        def again(label: str, then: Callable[[list[Run], int], list[Run]]) -> dict[str, Any]:
            followed(truth, number, then).write(folder, label)
            _, sheet, longer = read(folder / f"{label}.truth.json")
            result = diagnosed(sheet, longer)
            return {
                "verdict": result.verdict,
                "effects": result.effects,
                "resolved": result.verdict == "missing-effect"
                and result.effects == list(truth["effects"]),
                "wrong": bool(result.effects) and not set(result.effects) & set(truth["effects"]),
            }

        done["suggested"] = again("suggested", lambda runs, ratio: [offers[suggested]])
        done["suggested"] |= {"run": suggested, "between": ranking["between"]}
        done["suggested"]["ranked"] = [
            (entry["run"], round(entry["separation_nats"], 2)) for entry in ranking["runs"]
        ]
        done["repeated"] = again("repeated", lambda runs, ratio: [repeated(runs, truth["seed"])])
    return done


def main() -> int:
    """Try the campaigns of the plans that leave effects undecided."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="+")
    parser.add_argument("--results", type=Path, required=True)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--suite", nargs="+", default=[(name, None) for name in UNDECIDED])
    arguments = parser.parse_args()
    wanted = dict(s if isinstance(s, tuple) else suite_and_count(s) for s in arguments.suite)
    # A campaign that is already decided needs no further run.
    sure = {
        (d["suite"], d["name"])
        for d in load(arguments.results)
        if d["what"] == "diagnosis" and d["answer"]["verdict"] != "ambiguous"
    }
    files = [
        file
        for file in in_turn(arguments.folder, wanted)
        if (file.parent.name, file.name.removesuffix(".truth.json")) not in sure
    ]
    for done in work(run, "next", files, arguments.results, arguments.workers):
        print(
            done["name"],
            list(done["truth"]["effects"]),
            done["answer"]["verdict"],
            done["answer"]["effects"],
        )
        for way in ("suggested", "repeated"):
            if way in done:
                print("   ", way, done[way], flush=True)
    print(page(load(arguments.results)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
