"""Results of the benchmark of the diagnosis as a page of the documentation."""

from __future__ import annotations

import platform
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from scipy.stats import binomtest
from verdicts import condition, good, judge, kind_of, nothing_left, wrong_alone

Record = dict[str, Any]

JUDGE_FROM = 10_000
"""First seed for judging (`rig.suites.JUDGE`)."""

FLOOR_FACTOR = 1.1
"""After adding, the leave-one-run-out error should be at most this many times the noise floor."""

INTRO = """# Accuracy of the diagnosis

This page states how often `diagnose` names the right effect. `tests/benchmarks/bench_diagnosis.py`
writes its figures; the first lines of that file state how to run it.

The campaigns come from the simulator in `tests/rig`, which shares no formula with the library.
Each one measures one specimen of a catalogue drive in about thirty runs, with scatter from run to
run. It hides one of these:

- one effect, which causes half the noise (rms) after a refit of the baseline model;
- a pair of effects, which cause one noise and half the noise;
- nothing;
- a cause that is not in the library.

Friction that grows with the load is hidden as limits of friction that do. It counts as named if
the answer names `load_dependent_friction` or states a form of the hysteresis that contains it.

Development and evaluation use different seeds.

"""


NULLS = """## False alarms

Every routine with a significance level is tested on data without any effect, and its false alarms
are compared with the level that it states (binomial bounds, `tests/python/test_nulls_*.py`): the F
test over runs, sign flips, all criteria together over all candidates, paired differences, standard
errors and intervals, the shares of `compare`, steps, outliers, columns that rise together, stuck
sensors, and whole diagnoses under coloured, long-tailed and non-uniform noise."""


def page(rows: list[Record], note: str = "") -> str:
    """The whole page as Markdown, with a note on the results."""
    diagnosed = [done for done in rows if done["what"] == "diagnosis"]
    there = {(done["suite"], done["name"]) for done in diagnosed}
    # The first diagnoses of the campaigns with a next run count too.
    diagnosed += [
        done
        for done in rows
        if done["what"] == "next" and (done["suite"], done["name"]) not in there
    ]
    for done in diagnosed:
        done["judged"] = judge(done["truth"], done["answer"])
    parts = [INTRO + "\n".join([*seeds_line(diagnosed), *([note] if note else [])])]
    if diagnosed:
        parts += [
            "## Requirements and results\n\n" + "\n".join(headline(diagnosed)),
            "## One hidden effect\n\n" + "\n".join(confusion(diagnosed)),
            "## A cause that is not in the library, or nothing\n\n" + "\n".join(outside(diagnosed)),
            "## Under worse conditions\n\n" + "\n".join(falling_off(diagnosed)),
        ]
    tried = [done for done in rows if done["what"] == "baselines"]
    if tried:
        parts.append("## Other tools on the same campaigns\n\n" + "\n".join(rivals(tried, rows)))
    following = [d for d in rows if d["what"] == "next" and "suggested" in d]
    if following:
        parts.append("## The next run\n\n" + "\n".join(next_run(following)))
    parts.append(NULLS)
    return "\n\n".join(parts) + "\n"


def count(number: int, total: int) -> str:
    """A count, its share and the 95 % interval of the share (Clopper and Pearson)."""
    if total == 0:
        return "-"
    low, high = binomtest(number, total).proportion_ci()
    return (
        f"{number} of {total}: {100 * number / total:.0f} % ({100 * low:.0f} to {100 * high:.0f})"
    )


def table(head: Sequence[str], lines: Iterable[Sequence[object]]) -> list[str]:
    """A Markdown table."""
    rows = [head, ["---"] * len(head), *lines]
    return ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]


def in_words(found: Counter[str]) -> str:
    """Counts in words, the most frequent first."""
    return "; ".join(f"{what}: {number}" for what, number in found.most_common())


def ranges(seeds: list[int]) -> str:
    """Seeds in words: 10020-10039, 28020."""
    parts: list[list[int]] = []
    for seed in seeds:
        if parts and seed == parts[-1][1] + 1:
            parts[-1][1] = seed
        else:
            parts.append([seed, seed])
    return ", ".join(f"{a}-{b}" if b > a else f"{a}" for a, b in parts)


def seeds_line(rows: list[Record]) -> list[str]:
    """Machine, campaigns and seeds."""
    seeds = sorted({done["truth"]["seed"] for done in rows})
    judging = [seed for seed in seeds if seed >= JUDGE_FROM]
    kind = "evaluation" if len(judging) == len(seeds) else f"of which {len(judging)} for evaluation"
    cpu = [done["cpu_s"] for done in rows if done["suite"] in ("single", "clean")]
    lines = [
        f"{platform.machine()}, two cores; {len(rows)} campaigns, seeds ({kind}) {ranges(seeds)}.",
        "In brackets: 95 % intervals of the shares (Clopper and Pearson).",
    ]
    if cpu:
        largest = max(done["rows"] for done in rows)
        lines.append(
            f"A campaign of up to {largest} rows takes {np.median(cpu):.1f} s of one core "
            f"(median; maximum {np.max(cpu):.0f} s)."
        )
    return lines


def of(rows: list[Record], kind: str, how: str = "standard") -> list[Record]:
    """Campaigns of one kind under some conditions."""
    return [d for d in rows if kind_of(d["truth"]) == kind and condition(d["truth"]) == how]


def rights(rows: list[Record]) -> int:
    """How many answers are as required."""
    return sum(good(done["truth"], done["judged"]) for done in rows)


def headline(rows: list[Record]) -> list[str]:
    """The required shares, and those that were reached."""
    single, pair = of(rows, "single"), of(rows, "pair")
    scattered = "3 times the scatter"
    lines: list[tuple[str, str, str]] = []

    def say(what: str, bar: str, members: list[Record], hit: Callable[[Record], bool]) -> None:
        if members:
            lines.append((what, bar, count(sum(map(hit, members)), len(members))))

    def right(done: Record) -> bool:
        return good(done["truth"], done["judged"])

    def explained(done: Record) -> bool:
        return right(done) and nothing_left(done["truth"], done["answer"])

    def set_holds(done: Record) -> bool:
        return set(done["truth"]["effects"]) <= set(done["answer"]["effects"])

    say("single effect named first", "95 %", single, right)
    say("... and no remainder reported", "", single, explained)
    say(
        "only a wrong effect named",
        "at most 1 %",
        single,
        lambda d: wrong_alone(d["truth"], d["answer"]),
    )
    say("no effect hidden: `complete`", "98 %", of(rows, "clean"), right)
    say("the same with three times the scatter", "98 %", of(rows, "clean", scattered), right)
    say("cause not in the library: `unexplained`, right column", "95 %", of(rows, "outside"), right)
    say("both effects of a pair named", "90 %", pair, right)
    say("... and no remainder reported", "", pair, explained)
    say("aliased plan: hidden effect among those named", "98 %", of(rows, "aliased"), set_holds)
    added = [
        done
        for done in single + pair
        if explained(done) and set(done["truth"]["effects"]) <= set(done["answer"]["effects"])
    ]
    say(
        f"after adding, leave-one-run-out error at most {FLOOR_FACTOR} times the floor",
        "all",
        added,
        lambda d: held_over_floor(d) <= FLOOR_FACTOR,
    )
    out = table(("requirement", "required", "reached"), lines)
    if added:
        median = np.median([held_over_floor(done) for done in added])
        above = [
            f"{' and '.join(f'`{name}`' for name in sorted(done['truth']['effects']))} "
            f"{held_over_floor(done):.2f}"
            for done in sorted(added, key=held_over_floor)
            if held_over_floor(done) > FLOOR_FACTOR
        ]
        over = f"; above {FLOOR_FACTOR}: {', '.join(above)}" if above else ""
        out += ["", f"The median leave-one-run-out error is {median:.2f} times the floor{over}."]
    other = Counter(d["judged"] for d in single + pair if not right(d))
    if other:
        out += ["", f"Other answers to single effects and pairs: {in_words(other)}."]
    return out


def held_over_floor(done: Record) -> float:
    """Leave-one-run-out error after the last rung over the noise floor."""
    answer = done["answer"]
    return float(answer["ladder"][-1]["rms_heldout_arcsec"] / answer["noise_floor_arcsec"])


def first_named(done: Record) -> str:
    """The effect that is named first."""
    named = done["answer"]["effects"]
    return named[0] if named else "-"


def verdict_of(done: Record) -> str:
    """The verdict; `complete` if it states that nothing is missing."""
    return str(done["answer"]["verdict"])


def confusion(rows: list[Record]) -> list[str]:
    """Row: what is hidden; columns: what is named first, what alone, and the verdict."""
    members: dict[str, list[Record]] = defaultdict(list)
    for done in of(rows, "single"):
        members[next(iter(done["truth"]["effects"]))].append(done)
    lines = []
    for name, mine in sorted(members.items()):
        drives = {done["truth"]["drive"] for done in mine}
        first = sum(first_named(done) == name for done in mine)
        alone = sum(done["answer"]["effects"] == [name] for done in mine)
        others = Counter(f"`{first_named(d)}`" for d in mine if first_named(d) not in (name, "-"))
        verdicts = Counter(verdict_of(done) for done in mine)
        lines.append(
            (
                f"`{name}`",
                len(mine),
                len(drives),
                first,
                alone,
                in_words(others) or "-",
                *(verdicts[v] for v in VERDICTS),
            )
        )
    head = ("hidden", "campaigns", "drives", "named first", "only it", "another first")
    return table((*head, *(f"`{v}`" for v in VERDICTS)), lines)


VERDICTS = ("missing-effect", "ambiguous", "unexplained", "complete")


def outside(rows: list[Record]) -> list[str]:
    """Causes outside the library, clean campaigns and aliased ones."""
    members: dict[str, list[Record]] = defaultdict(list)
    for done in rows:
        kind = kind_of(done["truth"])
        if condition(done["truth"]) != "standard" or kind in ("single", "pair", "short"):
            continue
        name = next(iter(done["truth"]["effects"]), "nothing")
        if kind == "aliased":
            name += " (aliased)"
        members[name].append(done)
    lines = []
    for name, mine in sorted(members.items()):
        verdicts = Counter(verdict_of(done) for done in mine)
        named = Counter(f"`{n}`" for d in mine for n in d["answer"]["effects"])
        lines.append(
            (
                f"`{name.removeprefix('outside_')}`" if name != "nothing" else name,
                len(mine),
                rights(mine),
                in_words(named) or "-",
                *(verdicts[v] for v in VERDICTS),
            )
        )
    head = ("hidden", "campaigns", "as required", "named")
    return table((*head, *(f"`{v}`" for v in VERDICTS)), lines)


def falling_off(rows: list[Record]) -> list[str]:
    """The same figures under worse conditions; the single ones on the same seeds."""
    groups: dict[str, dict[str, list[Record]]] = defaultdict(lambda: defaultdict(list))
    for done in rows:
        if kind_of(done["truth"]) in ("single", "clean"):
            groups[condition(done["truth"])][kind_of(done["truth"])].append(done)
    lines = []
    for how, kinds in sorted(groups.items(), key=lambda item: (item[0] != "standard", item[0])):
        single, clean = kinds["single"], kinds["clean"]
        wrong = sum(wrong_alone(d["truth"], d["answer"]) for d in single)
        other = Counter(d["judged"] for d in single if not good(d["truth"], d["judged"]))
        lines.append(
            (
                how,
                count(rights(single), len(single)),
                wrong if single else "-",
                in_words(other) or "-",
                count(rights(clean), len(clean)),
            )
        )
    head = ("conditions", "single: as required", "only a wrong effect", "other answers", "clean")
    return [
        "*As required* means: the effect is named first; with lost encoder counts also their",
        "run and time; without the effect's column, no effect is named (`unexplained` or",
        "`ambiguous`). *Clean* campaigns have to end `complete`; with lost counts only that",
        "event may be named. The other rows repeat seeds of the first row, so a campaign and",
        "its degraded copy differ only in the condition.",
        "",
        *table(head, lines),
    ]


def rivals(tried: list[Record], rows: list[Record]) -> list[str]:
    """First claims of other tools, compared with those of `diagnose`."""
    from baselines import claim, wanted_columns

    from lostmotion.effects.library import library

    ours = {(d["suite"], d["name"]): d for d in rows if d["what"] == "diagnosis"}

    def own(done: Record) -> str:
        truth, answer = done["truth"], done["answer"]
        hidden, first = list(truth["effects"]), first_named(done)
        if not hidden:
            return "right" if answer["verdict"] == "complete" else "false alarm"
        if answer["verdict"] == "complete":
            return "nothing"
        if first != "-" and kind_of(truth) != "outside":
            return "right effect" if first in hidden else "wrong effect"
        wanted = set().union(*(wanted_columns(name, truth) for name in hidden))
        if first == "-":
            shown = {d["covariate"] for d in answer["unexplained"]["depends_on"]}
            stems = {c for cause in truth["hidden"] for c in cause.get("depends_on", ())} | wanted
            event = bool(answer["events"]) and bool(truth["events"])
            return "right column" if event or shown & stems else "wrong column"
        needs = set(library()[first].needs)
        return "right column" if needs & wanted else "wrong column"

    lines = []
    tools = list(tried[0]["claims"])
    for kind in ("clean", "single", "pair", "outside"):
        members = [done for done in tried if kind_of(done["truth"]) == kind]
        if not members:
            continue
        both = [ours[d["suite"], d["name"]] for d in members if (d["suite"], d["name"]) in ours]
        lines.append((kind, "this diagnosis", len(both), in_words(Counter(map(own, both)))))
        for tool in tools:
            found = Counter(claim(d["truth"], tool, d["claims"][tool]) for d in members)
            lines.append((kind, tool, len(members), in_words(found)))
    cpu = np.median([done["cpu_s"] for done in tried])
    return [
        "All tools get the residual of the fitted baseline model without run means, and data",
        "split by whole runs. A claim counts only if it explains 2 % of the runs that were left",
        "out (`baselines.py`). A column is right if the hidden effect depends on it. The lasso",
        "gets the tangents of the library's effects. The three other tools together take",
        f"{cpu:.0f} s of one core with the baseline fit (median).",
        "",
        *table(("hidden", "tool", "campaigns", "first claim"), lines),
    ]


def next_run(rows: list[Record]) -> list[str]:
    """How many open campaigns one more run decides."""
    lines = []
    hidden = sorted({(d["truth"]["plan"], *d["truth"]["effects"]) for d in rows})
    for plan, name in hidden:
        mine = [d for d in rows if (d["truth"]["plan"], *d["truth"]["effects"]) == (plan, name)]
        lines.append(
            (
                plan,
                f"`{name}`",
                len(mine),
                *(
                    f"{sum(d[way]['resolved'] for d in mine)} "
                    f"({sum(d[way]['wrong'] for d in mine)} wrong)"
                    for way in ("suggested", "repeated")
                ),
            )
        )
    suggested = sum(d["suggested"]["resolved"] for d in rows)
    repeated = sum(d["repeated"]["resolved"] for d in rows)
    ratio = f"{suggested / repeated:.1f} times as many" if repeated else "the repeat none"
    kinds = Counter(d["suggested"]["run"] for d in rows)
    return [
        "Campaigns that end `ambiguous` get one more run of the simulator: the run that `next`",
        "ranks first (`rig/following.py`), or a repeated run of the plan. The table counts how",
        "many then end with only the hidden effect. In the plan `aliased` temperature and wear",
        "rise together over 21 runs. In the plan `short` 11 runs have one speed, and the drive",
        "is warm when it is worn.",
        "",
        *table(("plan", "hidden", "ambiguous", "suggested run", "repeated run"), lines),
        "",
        f"The suggested run resolves {suggested} campaigns, the repeated run {repeated}: {ratio} "
        "(required: 1.5).",
        f"Suggested runs: {in_words(kinds)}.",
    ]
