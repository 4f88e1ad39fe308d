"""Diagnosis on campaigns of the rig: confusion table, detection limits, other tools.

    cd tests
    python benchmarks/judging_suites.py CAMPAIGNS
    python benchmarks/bench_diagnosis.py CAMPAIGNS --results FILE.jsonl [--workers 2]
    python benchmarks/bench_diagnosis.py CAMPAIGNS --results FILE.jsonl --suite clean --baselines
    python benchmarks/bench_next.py CAMPAIGNS --results FILE.jsonl
    python benchmarks/bench_diagnosis.py --results FILE.jsonl --write

Each result is appended to FILE.jsonl at once, and existing results are not repeated: an
interruption loses nothing. Every worker is a process of one thread. Campaigns of all suites are
diagnosed in turn, so that an interrupted run covers a part of every suite; `--suite single:65
clean:25` selects the first campaigns of some suites. `--write` writes the page `how_well.md` of the
docs. `--baselines` needs pysindy and scikit-learn.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from diagnosis_tables import page
from verdicts import judge, kind_of

from lostmotion.discover import diagnose
from lostmotion.discover.answer import Diagnosis
from lostmotion.drives import Drive, read_drive
from lostmotion.model import make_torsion_curve
from lostmotion.recordings import Campaign, read_campaign
from lostmotion.threads import one_thread

Record = dict[str, Any]

PAGE = Path(__file__).resolve().parents[2] / "bindings/python/docs/how_well.md"

KEPT = ("verdict", "noise_floor_arcsec", "effects", "ladder", "events", "unexplained", "friction")
"""Keys of an answer that are stored."""


def diagnosed(drive: Drive, campaign: Campaign) -> Diagnosis:
    """Diagnose a campaign as the command does."""
    return diagnose(
        None,
        campaign,
        ratio=drive.ratio,
        rated_torque_Nm=drive.rated_torque_Nm,
        torsion_curve=make_torsion_curve(drive, campaign.largest_torque_Nm),
    )


def read(truth_file: Path) -> tuple[dict[str, Any], Drive, Campaign]:
    """Read the truth, the sheet and the recordings."""
    stem = truth_file.name.removesuffix(".truth.json")
    drive = read_drive(truth_file.with_name(f"{stem}.toml"))
    campaign = read_campaign(truth_file.with_name(f"{stem}.csv.gz"), ratio=drive.ratio)
    return json.loads(truth_file.read_text()), drive, campaign


def run(truth_file: Path) -> Record:
    """Diagnose one campaign."""
    truth, drive, campaign = read(truth_file)
    begin, cpu = time.perf_counter(), time.process_time()
    with one_thread():
        answer = diagnosed(drive, campaign).answer()
    return {
        "what": "diagnosis",
        "suite": truth_file.parent.name,
        "name": truth_file.name.removesuffix(".truth.json"),
        "truth": truth,
        "answer": {key: answer[key] for key in KEPT},
        "wall_s": time.perf_counter() - begin,
        "cpu_s": time.process_time() - cpu,
        "rows": campaign.rows,
    }


def run_rivals(truth_file: Path) -> Record:
    """Run the other tools on one campaign."""
    from baselines import baselines

    from lostmotion.discover.outliers import clean_outliers
    from lostmotion.effects.conditions import Conditions
    from lostmotion.fit.baseline import BaselineModel

    truth, drive, campaign = read(truth_file)
    cpu = time.process_time()
    with one_thread():
        torsion_curve = make_torsion_curve(drive, campaign.largest_torque_Nm)
        base = BaselineModel(Conditions(campaign), drive.rated_torque_Nm, torsion_curve)
        base.first_fit()
        if clean_outliers(base):
            base.fit(steps=8)
        claims = baselines(base, drive.ratio)
    return {
        "what": "baselines",
        "suite": truth_file.parent.name,
        "name": truth_file.name.removesuffix(".truth.json"),
        "truth": truth,
        "claims": {tool: found[:5] for tool, found in claims.items()},
        "cpu_s": time.process_time() - cpu,
    }


def in_turn(folders: Iterable[Path], wanted: dict[str, int | None]) -> list[Path]:
    """Truths of suites in an order in which every first part has an equal share of each suite.

    `wanted` states how many of each suite; all if it is empty.
    """
    suites: dict[Path, list[Path]] = {}
    for folder in folders:
        for file in sorted(folder.rglob("*.truth.json")):
            if not wanted or file.parent.name in wanted:
                suites.setdefault(file.parent, []).append(file)
    places: list[tuple[float, Path]] = []
    for suite, files in suites.items():
        files = files[: wanted.get(suite.name)]
        places += [((i + 0.5) / len(files), file) for i, file in enumerate(files)]
    return [file for _, file in sorted(places)]


def suite_and_count(text: str) -> tuple[str, int | None]:
    """Read `single` or `single:65`."""
    name, _, number = text.partition(":")
    return name, int(number) if number else None


def load(file: Path) -> list[Record]:
    """Results of earlier runs; an incomplete last line does not count."""
    found: list[Record] = []
    if file.exists():
        for line in file.read_text().splitlines():
            try:
                found.append(json.loads(line))
            except json.JSONDecodeError:
                continue
    return found


def key(done: Record) -> tuple[str, str, str]:
    """Key of a result."""
    return done["what"], done["suite"], done["name"]


def work(job: Any, what: str, files: list[Path], results: Path, workers: int) -> Iterator[Record]:
    """Compute the missing results in parallel, and store each at once."""
    there = {key(done) for done in load(results)}
    left = [
        file
        for file in files
        if (what, file.parent.name, file.name.removesuffix(".truth.json")) not in there
    ]
    with ProcessPoolExecutor(workers) as pool, results.open("a") as out:
        if out.tell():
            out.write("\n")  # an incomplete line remains a separate line
        for future in as_completed(jobs := {pool.submit(job, file): file for file in left}):
            if future.exception() is not None:
                print(f"{jobs[future]}: {future.exception()!r}", file=sys.stderr, flush=True)
                continue
            done = future.result()
            out.write(json.dumps(done) + "\n")
            out.flush()
            yield done


def report(done: Record) -> None:
    """One line for a campaign."""
    truth, answer = done["truth"], done["answer"]
    ladder = [round(r["rms_arcsec"], 2) for r in answer["ladder"]]
    depends = [(d["covariate"], d["shape"]) for d in answer["unexplained"]["depends_on"]]
    print(
        f"{done['suite']}/{done['name']:<15} {kind_of(truth):<8} "
        f"{'+'.join(truth['effects']) or '-':<42} {judge(truth, answer):<28} "
        f"{answer['verdict']:<15} {answer['effects']} {depends} {ladder} "
        f"floor {answer['noise_floor_arcsec']:.2f} "
        f"{done['wall_s']:.0f} s, {done['cpu_s']:.0f} s cpu",
        flush=True,
    )


def main() -> int:
    """Run folders of campaigns and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="*")
    parser.add_argument("--results", type=Path, required=True, help="JSON lines, appended to")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument(
        "--suite",
        nargs="+",
        default=[],
        type=suite_and_count,
        metavar="SUITE[:COUNT]",
        help="only folders of these names, or the first campaigns of them",
    )
    parser.add_argument("--baselines", action="store_true", help="let other tools try")
    parser.add_argument("--note", default="", help="sentence about these results, for the page")
    parser.add_argument("--write", action="store_true", help="write the page of the docs")
    arguments = parser.parse_args()
    files = in_turn(arguments.folder, dict(arguments.suite))
    if arguments.baselines:
        for done in work(run_rivals, "baselines", files, arguments.results, arguments.workers):
            print(done["name"], list(done["truth"]["effects"]), done["claims"], flush=True)
    else:
        for done in work(run, "diagnosis", files, arguments.results, arguments.workers):
            report(done)
    rows = load(arguments.results)
    if not rows:
        parser.error("neither campaigns nor results")
    text = page(rows, arguments.note)
    print("\n" + text, flush=True)
    if arguments.write:
        PAGE.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
