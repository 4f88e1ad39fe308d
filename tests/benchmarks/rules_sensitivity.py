"""Number of verdicts that change when a threshold of `rules.py` is changed by 30 %.

    cd tests
    python benchmarks/judging_suites.py CAMPAIGNS --seeds develop --share 0.1
    python benchmarks/rules_sensitivity.py CAMPAIGNS --results FILE.jsonl [--campaigns 200]

Every campaign is diagnosed with the unchanged rules, whose changed values are carried along
(`traced_rules`). A change on which no comparison of the diagnosis depends cannot change its
verdict, and is not tried. A verdict has changed if the word, the named effects, the runs of sudden
events or the column of an unexplained residual have. Integers change by at least one. Each result
is appended to FILE.jsonl at once, and existing results are not repeated. Rules that change none of
200 verdicts can be removed: the table lists them last.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from bench_diagnosis import diagnosed, in_turn, load, read
from traced_rules import NOTED, TracedRules, applied
from verdicts import good, judge

from lostmotion import rules
from lostmotion.discover import choice, diagnosis, gates
from lostmotion.threads import one_thread

Record = dict[str, Any]

CHANGE = 0.3
"""Share by which a rule is changed, down and up."""

NAMES = tuple(name for name in vars(rules) if name.isupper())
"""Every rule."""


def changed(value: float, share: float) -> float:
    """A rule changed by a share; a whole number by one at least, and not below 1."""
    if isinstance(value, int):
        step = max(1, round(abs(share) * value))
        return max(1, value + (step if share > 0 else -step))
    return value * (1 + share)


def changes_of(value: float) -> dict[float, float]:
    """Values of a changed rule, by the share by which it is changed."""
    both = {share: changed(value, share) for share in (-CHANGE, CHANGE)}
    return {share: other for share, other in both.items() if other != value}


@contextmanager
def traced() -> Iterator[None]:
    """Carry the changed rules along, and note the changes on which a comparison depends.

    The sizes that would have been detectable are no part of a verdict, and are not traced.
    """
    share_at, detectable = gates.share_at, diagnosis.detectable

    def untraced(*given: Any) -> Any:
        rules.__class__ = ModuleType
        try:
            return detectable(*given)
        finally:
            rules.__class__ = TracedRules

    NOTED.clear()
    rules.changes_of = changes_of  # type: ignore[attr-defined]
    gates.share_at = choice.share_at = lambda angle: applied(share_at, (angle,))
    diagnosis.detectable = untraced
    rules.__class__ = TracedRules
    try:
        yield
    finally:
        rules.__class__ = ModuleType
        gates.share_at = choice.share_at = share_at
        diagnosis.detectable = detectable


def signature(answer: dict[str, Any]) -> list[Any]:
    """The parts of an answer that count as its verdict."""
    rest = answer["unexplained"] or {"depends_on": []}
    return [
        answer["verdict"],
        answer["effects"],
        sorted({str(event["run"]) for event in answer["events"]}),
        sorted({str(entry["covariate"]) for entry in rest["depends_on"]}),
    ]


def run(truth_file: Path, rule: str = "", share: float = 0.0) -> Record:
    """Diagnose a campaign with one rule changed, or with the changes of all carried along."""
    kept = getattr(rules, rule) if rule else None
    truth, drive, campaign = read(truth_file)
    try:
        if rule:
            setattr(rules, rule, changed(kept, share))
            with one_thread():
                answer = diagnosed(drive, campaign).answer()
        else:
            with one_thread(), traced():
                answer = diagnosed(drive, campaign).answer()
    finally:
        if rule:
            setattr(rules, rule, kept)
    return {
        "campaign": f"{truth_file.parent.name}/{truth_file.name.removesuffix('.truth.json')}",
        "rule": rule,
        "share": share,
        "answer": signature(answer),
        "good": good(truth, judge(truth, answer)),
        **({} if rule else {"depends_on": sorted(NOTED)}),
    }


def trials(found: Record, wanted: Iterable[str]) -> Iterator[tuple[str, float]]:
    """Rules to be changed on a campaign, those on which it depends, and the share."""
    for name, share in found["depends_on"]:
        if name in wanted:
            yield name, share


def table(records: Iterable[Record]) -> str:
    """Rules, how many verdicts each changes, and how many answers it corrects or makes wrong."""
    plain: dict[str, Record] = {}
    changes: dict[str, list[Record]] = defaultdict(list)
    for record in records:
        if record["rule"]:
            changes[record["rule"]].append(record)
        else:
            plain[record["campaign"]] = record
    count = len(plain)
    lines = [
        f"{count} campaigns, rules changed by {100 * CHANGE:g} %",
        f"{'rule':24} {'depend':>10} {'down moves':>11} {'up moves':>9} {'better':>7} {'worse':>6}",
    ]

    def counts(name: str) -> list[int]:
        mine = changes[name]
        seen = sum(depends(record, name) for record in plain.values())
        moved = [r for r in mine if r["answer"] != plain[r["campaign"]]["answer"]]
        down = sum(r["share"] < 0 for r in moved)
        better = sum(r["good"] > plain[r["campaign"]]["good"] for r in mine)
        worse = sum(r["good"] < plain[r["campaign"]]["good"] for r in mine)
        return [seen, down, len(moved) - down, better, worse]

    rows = {name: counts(name) for name in NAMES if name in changes or not tried(name, plain)}
    for name, (seen, down, up, better, worse) in sorted(
        rows.items(), key=lambda row: -row[1][1] - row[1][2]
    ):
        lines.append(f"{name:24} {seen:10} {down:11} {up:9} {better:7} {worse:6}")
    still = [name for name, row in rows.items() if row[1] + row[2] == 0]
    lines.append(f"move none: {', '.join(still) or 'no rule'}")
    return "\n".join(lines)


def tried(name: str, plain: dict[str, Record]) -> bool:
    """Whether any campaign depends on a rule, so that it has to be tried."""
    return any(depends(record, name) for record in plain.values())


def depends(record: Record, name: str) -> bool:
    """Whether a comparison of a diagnosis depends on a change of a rule."""
    return any(rule == name for rule, _ in record["depends_on"])


def main() -> None:
    """Diagnose, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("campaigns_in", type=Path, nargs="*", help="folders of campaigns")
    parser.add_argument("--results", type=Path, required=True)
    parser.add_argument("--campaigns", type=int, default=4, help="how many (%(default)s)")
    parser.add_argument("--rules", nargs="*", default=list(NAMES), choices=NAMES, metavar="RULE")
    parser.add_argument("--but", nargs="*", default=[], metavar="RULE", help="all but these")
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    wanted = [name for name in arguments.rules if name not in arguments.but]
    records = load(arguments.results)
    done = {(r["campaign"], r["rule"], r["share"]): r for r in records}
    files = in_turn(arguments.campaigns_in, {})[: arguments.campaigns]
    with (
        ProcessPoolExecutor(arguments.workers) as pool,
        arguments.results.open("a", encoding="utf-8") as out,
    ):

        def keep(record: Record) -> Record:
            out.write(json.dumps(record) + "\n")
            out.flush()
            return record

        name_of = {
            file: f"{file.parent.name}/{file.name.removesuffix('.truth.json')}" for file in files
        }
        plain = [file for file in files if (name_of[file], "", 0.0) not in done]
        found = {r["campaign"]: r for r in map(keep, pool.map(run, plain))}
        found |= {r["campaign"]: r for r in records if not r["rule"]}
        futures = [
            pool.submit(partial(run, file, name, share))
            for file in files
            for name, share in trials(found[name_of[file]], wanted)
            if (name_of[file], name, share) not in done
        ]
        for future in as_completed(futures):
            keep(future.result())
    print(table(load(arguments.results)))


if __name__ == "__main__":
    sys.exit(main())
