"""Diagnosis judged on campaigns of the rig: confusion table, error after adding, times, rivals.

    cd tests && python -m rig suite --kind single --count 20 --seeds develop -o DIR
    python benchmarks/bench_diagnosis.py DIR [--workers 2] [--baselines] [--json FILE]
    python benchmarks/bench_diagnosis.py --results FILE --page ../bindings/python/docs/how_well.md

A campaign counts as right when the hidden effect is named (first, for a single one; both, for a
pair), as wrong when another effect is named alone. For causes outside the library right is
`unexplained` with a column that the truth lists; for a sudden event also its run, and its second
within `SECONDS`. `--baselines` needs pysindy and scikit-learn.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
import time
from collections import Counter, defaultdict
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.discover import diagnose
from lostmotion.discover.effects import library
from lostmotion.discover.threads import one_thread
from lostmotion.drives import read_drive
from lostmotion.model import make_backbone
from lostmotion.recordings import read_campaign

SECONDS = 1.0
"""How far a sudden event may be placed from where it was."""


JUDGE_FROM = 10_000
"""First seed for judging (`rig.suites.JUDGE`)."""

FLOOR_FACTOR = 1.1
"""After adding, the held-out error should be at most this many times the noise floor."""


def run(truth_file: Path, rivals: bool = False) -> dict[str, Any]:
    """Diagnose one campaign; let other tools try it too."""
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
        )
        wall, cpu = time.perf_counter() - begin, time.process_time() - cpu
        claims = {}
        if rivals:
            from baselines import baselines

            assert found.selection is not None
            claims = baselines(found.selection.settled[0].base, drive.ratio)
    answer = found.answer()
    return {
        "name": stem,
        "truth": truth,
        "answer": answer,
        "wall_s": wall,
        "cpu_s": cpu,
        "rows": campaign.rows,
        "judged": judge(truth, answer),
        "claims": claims,
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
        wanted = {name for cause in truth["hidden"] for name in (cause.get("depends_on") or [])}
        shown = {d["covariate"] for d in found["unexplained"]["depends_on"]}
        stems = {name.rsplit("_", 1)[0] if "_" in name else name for name in wanted} | wanted
        return "right" if shown & stems else "right verdict, other column"
    twins = set(truth.get("twins") or ())
    if verdict == "complete":
        return "none"
    if kind == "pair":
        both = set(hidden) <= set(named)
        if both:
            return "right" if verdict != "unexplained" else "both named, something left over"
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


def condition(truth: dict[str, Any]) -> str:
    """In a few words how a campaign differs from the standard one."""
    c = truth["conditions"]
    words = []
    if c["noise"] != 1:
        words.append(f"{c['noise']:g} times the noise")
    if c["scatter"] != 1:
        words.append(f"{c['scatter']:g} times the scatter")
    if truth["plan"] == "third":
        words.append("a third of the runs")
    if c["sheet_bias"]:
        words.append(f"sheet {100 * c['sheet_bias']:g} % off")
    if c["outliers"]:
        words.append(f"{100 * c['outliers']:g} % outliers")
    if c["dropped_counts"]:
        words.append("encoder counts lost")
    if c["dropped_columns"]:
        words.append("without " + ", ".join(c["dropped_columns"]))
    sizes = [e["residual_sigma"] for e in truth["hidden"] if "residual_sigma" in e]
    if sizes and max(sizes) < 0.4:
        words.append("half the effect")
    return ", ".join(words) or "standard"


def good(done: dict[str, Any]) -> bool:
    """Whether the answer is what was asked for."""
    return done["judged"] in ("right", "right first, with a set") or (
        kind_of(done["truth"]) == "aliased" and done["judged"] in ("in the set", "right")
    )


def claim_right(done: dict[str, Any], tool: str) -> str:
    """What another tool's first claim is worth."""
    claims = done["claims"][tool]
    hidden = list(done["truth"]["effects"])
    if not hidden:
        return "false alarm" if claims else "right"
    if not claims:
        return "none"
    if tool.startswith("lasso"):
        return "right" if claims[0] == hidden[0] else "wrong"
    effect = library().get(hidden[0])
    needs = set() if effect is None else set(effect.needs)
    if effect is None:
        needs = {f"{n}" for e in done["truth"]["hidden"] for n in e.get("depends_on", ())}
    hit = any(claims[0].startswith(need.rsplit("_", 1)[0]) for need in needs)
    return "right column" if hit else "wrong column"


def share(count: int, total: int) -> str:
    """Count and percentage."""
    return f"{count} of {total} ({100 * count / total:.0f} %)"


def tables(rows: list[dict[str, Any]]) -> list[str]:
    """All tables as Markdown."""
    out = []
    seeds = sorted({done["truth"]["seed"] for done in rows})
    judging = [seed for seed in seeds if seed >= JUDGE_FROM]
    machine = f"{platform.machine()}, {len(seeds)} campaigns"
    out += [
        f"{machine}: {len(seeds) - len(judging)} of developing seeds, {len(judging)} of judging",
        f"seeds. Seeds: {ranges(seeds)}.",
        "",
        "| hidden | conditions | campaigns | as asked for | other answers |",
        "| --- | --- | --- | --- | --- |",
    ]
    groups: dict[tuple[str, str], list[dict[str, Any]]] = defaultdict(list)
    for done in rows:
        groups[kind_of(done["truth"]), condition(done["truth"])].append(done)
    for (kind, how), members in sorted(groups.items()):
        other = Counter(d["judged"] for d in members if not good(d))
        words = "; ".join(f"{what}: {number}" for what, number in other.most_common())
        ok = share(sum(map(good, members)), len(members))
        out.append(f"| {kind} | {how} | {len(members)} | {ok} | {words} |")
    out += ["", "| effect hidden alone | drives | named first | other answers |"]
    out += ["| --- | --- | --- | --- |"]
    effects: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for done in rows:
        alone = kind_of(done["truth"]) in ("single", "outside")
        if alone and condition(done["truth"]) == "standard":
            effects[next(iter(done["truth"]["effects"]))].append(done)
    for name, members in sorted(effects.items()):
        drives = sorted({d["truth"]["drive"].removeprefix("size ") for d in members})
        other = Counter(
            f"{d['judged']}: {', '.join(d['answer']['effects']) or '-'}"
            for d in members
            if not good(d)
        )
        words = "; ".join(f"{what} ({number})" for what, number in other.most_common())
        ok = f"{sum(map(good, members))} of {len(members)}"
        out.append(f"| `{name}` | {', '.join(drives)} | {ok} | {words} |")
    added = [
        d["answer"]["ladder"][-1]["rms_heldout_arcsec"] / d["answer"]["noise_floor_arcsec"]
        for d in rows
        if kind_of(d["truth"]) in ("single", "pair") and good(d)
    ]
    if added:
        low = sum(ratio <= FLOOR_FACTOR for ratio in added)
        out += [
            "",
            f"After adding what was named, the held-out error is at most {FLOOR_FACTOR} times the "
            f"noise floor in {share(low, len(added))}; median {np.median(added):.2f} times.",
        ]
    largest = max(d["rows"] for d in rows)
    cpu = [d["cpu_s"] for d in rows]
    out += [
        "",
        f"A campaign of up to {largest} rows takes {np.median(cpu):.1f} s of one core (median; "
        f"{np.max(cpu):.0f} s at most).",
    ]
    tried = [d for d in rows if d.get("claims")]
    if tried:
        out += ["", "| tool | hidden | campaigns | what it claims first |"]
        out += ["| --- | --- | --- | --- |"]
        for tool in tried[0]["claims"]:
            for kind in ("clean", "single", "outside", "pair"):
                members = [d for d in tried if kind_of(d["truth"]) == kind]
                if members:
                    found = Counter(claim_right(d, tool) for d in members)
                    words = "; ".join(f"{what}: {n}" for what, n in found.most_common())
                    out.append(f"| {tool} | {kind} | {len(members)} | {words} |")
    return out


def ranges(seeds: list[int]) -> str:
    """Seeds in words: 10020-10039, 28020."""
    parts: list[list[int]] = []
    for seed in seeds:
        if parts and seed == parts[-1][1] + 1:
            parts[-1][1] = seed
        else:
            parts.append([seed, seed])
    return ", ".join(f"{a}-{b}" if b > a else f"{a}" for a, b in parts)


PAGE = """# How well the diagnosis does

Figures of `python benchmarks/bench_diagnosis.py`, run in the folder `tests` on campaigns of the
rig in `tests/rig`: it shares no formula with the library, measures one specimen of a catalogue
drive over some thirty runs with scatter from run to run, and hides one effect of half the noise,
two (one noise and half of it), none, or a cause that the library does not have. Developing and
judging use seeds apart; nothing is tuned for a single campaign.

As asked for: a single effect named first, both of a pair named with nothing left over, `complete`
where nothing was hidden, `unexplained` with the right column (and run and second, for an event)
where the cause is none of ours, the truth in the reported set where the plan aliases two effects.

"""


def report(done: dict[str, Any]) -> None:
    """One line for a campaign."""
    truth, answer = done["truth"], done["answer"]
    ladder = [round(r["rms_arcsec"], 2) for r in answer["ladder"]]
    depends = [(d["covariate"], d["shape"]) for d in answer["unexplained"]["depends_on"]]
    print(
        f"{done['name']:<18} {kind_of(truth):<8} {'+'.join(truth['effects']) or '-':<42} "
        f"{done['judged']:<28} {answer['verdict']:<15} {answer['effects']} {depends} "
        f"{ladder} floor {answer['noise_floor_arcsec']:.2f} "
        f"{done['wall_s']:.0f} s, {done['cpu_s']:.0f} s cpu {done['claims'] or '-'}",
        flush=True,
    )


def main() -> int:
    """Run a folder of campaigns and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="*")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--baselines", action="store_true", help="let other tools try too")
    parser.add_argument("--json", type=Path, help="keep the results")
    parser.add_argument("--results", type=Path, nargs="*", default=[], help="of runs before")
    parser.add_argument("--page", type=Path, help="write the tables as a page of the docs")
    arguments = parser.parse_args()
    rows = [done for file in arguments.results for done in json.loads(file.read_text())]
    for done in rows:
        done["judged"] = judge(done["truth"], done["answer"])
    files = sorted(f for folder in arguments.folder for f in folder.rglob("*.truth.json"))
    with ProcessPoolExecutor(arguments.workers) as pool:
        for done in pool.map(run, files, [arguments.baselines] * len(files)):
            done["answer"].pop("candidates")
            rows.append(done)
            report(done)
            if arguments.json is not None:
                arguments.json.write_text(json.dumps(rows, indent=1))
    if not rows:
        parser.error("neither campaigns nor results")
    lines = tables(rows)
    print("\n" + "\n".join(lines))
    if arguments.page is not None:
        arguments.page.write_text(PAGE + "\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
