"""After measuring: which run to do next to decide between the effects that are still open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.candidates.named import named_candidates
from lostmotion.discover.answer import Diagnosis
from lostmotion.discover.contest_round import make_round
from lostmotion.discover.linearise import settle
from lostmotion.discover.recorded_model import Selection
from lostmotion.effects.columns import missing_columns
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.effect import Effect
from lostmotion.evidence.contest import Contest
from lostmotion.evidence.scatter import reduce
from lostmotion.recordings import Campaign, Run


def next_runs(
    diagnosis: Diagnosis, options: Campaign, effects: Mapping[str, Effect], ratio: float
) -> dict[str, Any]:
    """Rank planned runs by how well each decides between the effects that are still open."""
    selection = diagnosis.need_selection()
    assert diagnosis.base is not None
    open_effects = [n for n in diagnosis.effects if n in effects]
    if len(open_effects) < 2:
        ranked = [c["name"] for c in diagnosis.candidates if c["testable"]]
        open_effects = list(dict.fromkeys([*open_effects, *ranked]))[:2]
    step = selection.steps[0]
    before = selection.settled[0].base
    past = before.conditions.campaign
    names = set(past.quantities()) & set(options.quantities())
    runs = [
        Run(run.label, run.file, {k: run.columns[k] for k in names}, run.begins)
        for run in (*past.runs, *options.runs)
    ]
    base = before.with_planned(Conditions(Campaign(runs)))
    base.terms, base.additives = [], []
    noise = selection.settled[0].noise
    # An option has the usual sampling rate of the recordings.
    usual = int(np.argsort(noise.sigma)[noise.sigma.size // 2])
    extended = noise.with_runs(usual, [run.time_s.size for run in options.runs])
    lacking = [n for n in open_effects if missing_columns(effects[n], base.conditions)]
    open_effects = [n for n in open_effects if n not in lacking]
    candidates, _ = named_candidates(
        {name: effects[name] for name in open_effects}, base, base.at(), ratio
    )
    planned = make_round(settle(base, extended, rounds=0), candidates, {})
    contest = planned.contest
    contest.null_omega = (
        step.round.contest.null_omega
        * (
            contest.evidence.scale[contest.evidence.scatter]
            / step.round.contest.evidence.scale[step.round.contest.evidence.scatter]
        )
        ** 2
    )
    known = len(past.runs)
    pairs = open_pairs(selection, [c.name for c in candidates])
    apart = np.zeros((max(len(pairs), 1), len(options.runs)))
    for i, (a, b) in enumerate(pairs):
        both = discrimination(contest, a, b, known) + discrimination(contest, b, a, known)
        apart[i] = 0.5 * both
    # Runs are ranked by the evidence on the pair that they separate least, then on all pairs.
    scores = apart.min(axis=0)
    minutes = np.array([max(np.ptp(run.time_s) / 60.0, 1e-3) for run in options.runs])
    order = np.lexsort((-apart.sum(axis=0), -scores))
    return {
        "schema": "lostmotion.next/1",
        "between": open_effects,
        "runs": [
            {
                "run": options.runs[i].label,
                "separation_nats": float(scores[i]),
                "per_minute": float(scores[i] / minutes[i]),
                "minutes": float(minutes[i]),
            }
            for i in order
        ],
        "suggested": options.runs[int(order[0])].label if pairs else None,
    }


def open_pairs(selection: Selection, names: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of effects still open: each effect found with each rival, else all pairs."""
    found = [
        (step.selected.result.name, rival)
        for step in selection.steps
        if step.selected is not None
        for rival in step.rivals
    ]
    kept = [(a, b) for a, b in found if a in names and b in names]
    return kept or list(combinations(names, 2))


def discrimination(contest: Contest, true: str, rival: str, known: int) -> FloatArray:
    """Expected evidence of each new run against `rival` when `true` is right (T-optimality)."""
    e = contest.evidence
    index = e.index(true, rival)
    matrix = reduce(e, index, contest.null_omega).matrix
    n0, na = e.fixed.size, e.blocks[true].size
    ridge = np.diag(e.ridge(index))
    past = matrix[:known].sum(axis=0)
    keep_a = np.arange(n0 + na)
    keep_b = np.concatenate((np.arange(n0), np.arange(n0 + na, index.size - 1)))

    def solve(keep: IntArray) -> FloatArray:
        part = past[np.ix_(keep, keep)] + ridge[np.ix_(keep, keep)]
        part += 1e-8 * np.diag(np.diag(part))
        out = np.zeros(index.size - 1)
        out[keep] = np.linalg.solve(part, past[keep, -1])
        return out

    apart = solve(keep_a) - solve(keep_b)
    h = past[np.ix_(keep_b, keep_b)] + ridge[np.ix_(keep_b, keep_b)]
    h += 1e-8 * np.diag(np.diag(h))
    scores = []
    for run in range(known, matrix.shape[0]):
        own = matrix[run][:-1, :-1]
        push = own @ apart
        free = push[keep_b]
        taken = free @ np.linalg.solve(h + own[np.ix_(keep_b, keep_b)], free)
        scores.append(0.5 * max(float(apart @ push - taken), 0.0))
    return np.array(scores)
