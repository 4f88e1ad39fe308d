"""Diagnosis in independent laboratories: law of friction by protocol, with one effect or none.

    cd tests
    python benchmarks/bench_laboratories.py --results FILE.jsonl [--count 1] [--seeds develop]
    python benchmarks/bench_laboratories.py --results FILE.jsonl --count 3 --skip 2   # fresh seeds
    python benchmarks/bench_laboratories.py --results FILE.jsonl --write

Every cell of the table (law, protocol, no effect or an effect of one or two noises) gets `--count`
campaigns with its own seeds: even seeds for development, odd ones for evaluation. Each result is
appended at once and not repeated. The order of the campaigns covers every cell early. `--write`
writes the page `laboratories.md` of the docs.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
import zlib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from diagnosis_tables import count, in_words, table
from rig.bench import TooSmallError
from rig.ideal import IdealAnalyst
from rig.laboratory import HIDEABLE, PROTOCOLS, Laboratory
from rig.laws import LAWS

Record = dict[str, Any]

PAGE = Path(__file__).resolve().parents[2] / "bindings/python/docs/laboratories.md"

SIZES = (0.0, 1.0, 2.0)
"""Noises of the hidden effect; 0: a clean campaign."""

FORM = "hysteresis form"
"""Shape in a verdict that reports another form of hysteresis than the baseline model's."""

OF_LAW = {"load": {"load_dependent_friction"}, "lugre": {"rate_dependent_friction"}}
"""Effects that are the law of friction itself: naming them is right whatever is hidden."""

INTRO = """# Independent laboratories

Accuracy of `diagnose` if friction follows another law than that of the baseline model: figures of
`tests/benchmarks/bench_laboratories.py` on campaigns of `tests/rig/laboratory.py`, which shares no
formula with the library. Laws: Maxwell slip in parallel, Dahl, LuGre, Bouc-Wen, limits that grow
with the load, one play operator in series, a dead zone with Bouc-Wen friction. Protocols: bench
loops (20, 8 and 60 runs; strangers: one file a run with a load history before it that was not
recorded), an arm under gravity with four payloads, the same with encoders of 14 bits, a turntable
that never stops. A campaign hides one effect or none. The size of an effect is its residual after
an ideal refit with the true law, relative to the noise of a reading.

*Ideal analyst* (`tests/rig/ideal.py`): the most that the same recordings contain. It knows the law
of friction, the true torque and history, the formulas of the effects, noise and scatter, but not
the values, nor which effect is hidden. *Scatter estimated*: the same, but with the F test over
runs of an analyst who has to estimate the scatter from them. An `ambiguous` answer that lists the
hidden effect and others counts as a wrong name only if they are not confounded for the ideal
analyst. An effect that is the law of friction of the campaign is no wrong name:
`load_dependent_friction` if the limits grow with the load, `rate_dependent_friction` with LuGre,
whose friction falls with the speed.
"""


@dataclass(frozen=True)
class Job:
    """One campaign."""

    law: str
    protocol: str
    noises: float
    seed: int

    @property
    def key(self) -> tuple[str, str, float, int]:
        """Key of a result."""
        return self.law, self.protocol, self.noises, self.seed


def jobs(
    each: int, seeds: str, laws: list[str], protocols: list[str], skipped: int = 0
) -> list[Job]:
    """All campaigns, in random order within every round, without the first rounds."""
    out = []
    for number in range(skipped, each):
        seed = 2 * number + (seeds == "judge")
        dealt = [
            Job(law, protocol, noises, seed)
            for law in laws
            for protocol in protocols
            for noises in SIZES
        ]
        out += sorted(dealt, key=lambda job: zlib.crc32(repr(job).encode()))
    return out


def run(job: Job) -> Record | None:
    """Write a campaign, read it as a user would and diagnose it; None if nothing is hidden."""
    from lostmotion.discover import diagnose
    from lostmotion.drives import read_drive
    from lostmotion.recordings import read_campaign

    lab = Laboratory(job.seed, job.law, job.protocol)
    names = HIDEABLE[job.protocol]
    first = zlib.crc32(f"{job.law} {job.seed // 2}".encode())
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(len(names) if job.noises else 1):
            effect = names[(first + turn) % len(names)] if job.noises else ""
            try:
                truth = lab.write(Path(folder), effect, job.noises)
            except TooSmallError:
                continue
            break
        else:
            return None
        drive = read_drive(Path(folder) / "drive.toml")
        campaign = read_campaign(sorted(Path(folder).glob("*.csv.gz")), ratio=drive.ratio)
        begin = time.process_time()
        answer = diagnose(drive, campaign).answer()
        spent = time.process_time() - begin
    return {
        "law": job.law,
        "protocol": job.protocol,
        "noises": job.noises,
        "seed": job.seed,
        "truth": truth,
        "verdict": answer["verdict"],
        "named": answer["effects"],
        "unexplained": answer["unexplained"]["depends_on"],
        "events": len(answer["events"]),
        "ladder": [
            (r["effects"], r["rms_arcsec"], r["rms_heldout_arcsec"]) for r in answer["ladder"]
        ],
        "within_arcsec": answer["noise"]["within_runs_arcsec"],
        "floor_arcsec": answer["noise_floor_arcsec"],
        "cpu_s": spent,
        "ideal": look_as_ideal(lab, truth),
    }


def look_as_ideal(lab: Laboratory, truth: Record) -> Record:
    """What the ideal analyst finds in a campaign."""
    found = IdealAnalyst(lab, truth["effects"]).look()
    return {
        "first": found.first(),
        "first_scatter_estimated": found.first(lab.plan.runs),
        "confounded": found.confounded(next(iter(truth["effects"]), "")),
    }


def add_ideal(done: Record) -> Record:
    """Complete a result that was written before there was an ideal analyst."""
    lab = Laboratory(done["seed"], done["law"], done["protocol"])
    return done | {"ideal": look_as_ideal(lab, done["truth"])}


def load(file: Path) -> list[Record]:
    """Existing results; an incomplete line does not count."""
    out = []
    for line in file.read_text().splitlines() if file.exists() else ():
        try:
            out.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return out


def work(wanted: list[Job], results: Path, workers: int) -> Iterator[Record]:
    """Compute the missing results."""
    there = {(d["law"], d["protocol"], d["noises"], d["seed"]) for d in load(results)}
    left = [job for job in wanted if job.key not in there]
    with ProcessPoolExecutor(workers) as pool, results.open("a") as out:
        doing = {pool.submit(run, job): job for job in left}
        for future in as_completed(doing):
            if future.exception() is not None:
                print(doing[future], repr(future.exception()), file=sys.stderr, flush=True)
                continue
            done = future.result()
            if done is not None:
                out.write(json.dumps(done) + "\n")
                out.flush()
                yield done


def complete(results: Path, workers: int) -> None:
    """Add the results of the ideal analyst where they are missing."""
    seen, left = [], []
    for done in load(results):
        (seen if "ideal" in done else left).append(done)
    if left:
        with ProcessPoolExecutor(workers) as pool:
            seen += pool.map(add_ideal, left)
        results.write_text("".join(json.dumps(done) + "\n" for done in seen))


# --- judging --------------------------------------------------------------------------------------


def strange(done: Record) -> set[str]:
    """Effects that are named but are neither hidden nor part of the law of friction."""
    return set(done["named"]) - set(done["truth"]["effects"]) - OF_LAW.get(done["law"], set())


def said_confounded(done: Record) -> bool:
    """Whether the answer is that the hidden effect and others are confounded."""
    hidden = set(done["truth"]["effects"])
    return done["verdict"] == "ambiguous" and hidden <= set(done["named"]) and bool(strange(done))


def wrong(done: Record) -> bool:
    """Whether an effect is named that was not hidden, and is not confounded with the hidden one."""
    others = strange(done)
    if said_confounded(done):
        others -= set(done["ideal"]["confounded"])
    return bool(others)


def clean_end(done: Record) -> bool:
    """Whether nothing is found, or only the form of the hysteresis."""
    if done["verdict"] == "complete" or (done["verdict"] == "missing-effect" and not strange(done)):
        return True
    shapes = {what["shape"] for what in done["unexplained"]}
    return (
        done["verdict"] == "unexplained"
        and not strange(done)
        and bool(shapes)
        and all(shape.startswith(FORM) for shape in shapes)
    )


def right_first(done: Record) -> bool:
    """Whether the hidden effect is named first."""
    named = [n for n in done["named"] if n not in OF_LAW.get(done["law"], set())]
    return bool(named) and named[0] in done["truth"]["effects"]


def ideal_right(done: Record, test: str = "first") -> bool:
    """Whether the ideal analyst names the hidden effect first."""
    return done["ideal"][test] in done["truth"]["effects"]


def estimated_right(done: Record) -> bool:
    """The same for the analyst who estimates the scatter."""
    return ideal_right(done, "first_scatter_estimated")


def told(done: Record) -> str:
    """Short text of a result."""
    depends = "; ".join(f"{d['covariate']} {d['shape']}" for d in done["unexplained"])
    return f"{done['verdict']} {'+'.join(done['named']) or '-'} [{depends}]"


def page(rows: list[Record], note: str = "") -> str:
    """The whole page as Markdown, with a note on the results."""
    seeds = sorted({d["seed"] for d in rows})
    kind = "evaluation (odd)" if all(s % 2 for s in seeds) else "development (even)"
    parts = [
        INTRO,
        f"{len(rows)} campaigns, seeds for {kind}: {', '.join(map(str, seeds))}. In brackets: 95 % "
        f"intervals of the shares (Clopper and Pearson). {note}".rstrip()
        + "\n",
    ]
    groups = [[d for d in rows if d["noises"] == size] for size in SIZES]
    clean, one, two = groups
    bars: list[tuple[object, ...]] = [
        ("no effect hidden: `complete` or only `hysteresis form`", "95 %", "clean_end", clean),
        ("a wrong effect named, alone or beside the right one", "at most 2 %", "wrong", rows),
        ("hidden effect of one noise named first", "90 %", "right_first", one),
        ("hidden effect of two noises named first", "95 %", "right_first", two),
    ]
    judges = {"clean_end": clean_end, "wrong": wrong, "right_first": right_first}
    lines = [
        (
            what,
            bar,
            *(
                count(sum(map(one, members)), len(members)) if one else "-"  # type: ignore[arg-type]
                for one in (
                    judges[str(judge)],
                    *(
                        (None, None)
                        if judge in ("wrong", "clean_end")
                        else (ideal_right, estimated_right)
                    ),
                )
            ),
        )
        for what, bar, judge, members in bars
    ]
    head = ("requirement", "required", "reached", "ideal analyst", "scatter estimated")
    parts.append("\n".join(table(head, lines)))
    for key, names in (("law", LAWS), ("protocol", tuple(PROTOCOLS))):
        lines = []
        for name in names:
            mine = [d for d in rows if d[key] == name]
            cells = [[d for d in group if d[key] == name] for group in groups]
            lines.append(
                (
                    name,
                    f"{sum(map(clean_end, cells[0]))} of {len(cells[0])}",
                    *(f"{sum(map(right_first, c))} of {len(c)}" for c in cells[1:]),
                    f"{sum(map(wrong, mine))} of {len(mine)}",
                    in_words(
                        Counter(f"`{n}`" for d in mine for n in (strange(d) if wrong(d) else ()))
                    )
                    or "-",
                )
            )
        head = (key, "none hidden", "first, one noise", "first, two noises", "wrong named", "which")
        parts.append("\n".join(["", *table(head, lines)]))
    apart = list(filter(said_confounded, rows))
    known = sum(wrong(d) for d in apart)
    parts.append(
        f"\n`ambiguous`, with the hidden effect: {len(apart)} of {len(rows)}; in {known} of them "
        "the effects are not confounded for the ideal analyst."
    )
    noise = [d["within_arcsec"] / d["truth"]["noise_arcsec_rms"] for d in rows]
    off = sum(abs(ratio - 1) > 0.15 for ratio in noise)
    parts.append(
        f"\nMeasurement noise as estimated over the true one: off by more than 15 % in {off} of "
        f"{len(noise)} campaigns."
    )
    return "\n".join(parts) + "\n"


def main() -> int:
    """Run what is missing and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--results", type=Path, required=True, help="JSON lines, appended to")
    parser.add_argument("--count", type=int, default=0, help="campaigns of every cell")
    parser.add_argument("--skip", type=int, default=0, help="rounds of earlier runs")
    parser.add_argument("--seeds", choices=("develop", "judge"), default="develop")
    parser.add_argument("--law", action="append", choices=LAWS)
    parser.add_argument("--protocol", action="append", choices=tuple(PROTOCOLS))
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--note", default="", help="sentence about these results, for the page")
    parser.add_argument("--write", action="store_true", help="write the page of the docs")
    arguments = parser.parse_args()
    laws, protocols = arguments.law or list(LAWS), arguments.protocol or list(PROTOCOLS)
    wanted = jobs(arguments.count, arguments.seeds, laws, protocols, arguments.skip)
    for done in work(wanted, arguments.results, arguments.workers):
        hidden = "+".join(done["truth"]["effects"]) or "-"
        print(
            f"{done['law']:<10} {done['protocol']:<10} {done['noises']:g} {hidden:<22} "
            f"{'WRONG' if wrong(done) else '':<6} {told(done)} "
            f"rms {done['ladder'][0][1]:.2f} to {done['ladder'][-1][1]:.2f}, leave-one-run-out "
            f"{done['ladder'][-1][2]:.2f}, within {done['within_arcsec']:.2f} true "
            f"{done['truth']['noise_arcsec_rms']:.2f} {done['cpu_s']:.0f} s",
            flush=True,
        )
    complete(arguments.results, arguments.workers)
    text = page(load(arguments.results), arguments.note)
    print("\n" + text, flush=True)
    if arguments.write:
        PAGE.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
