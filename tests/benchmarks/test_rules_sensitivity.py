"""The benchmark that changes one threshold at a time, and its table."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

sys.path.insert(0, str(Path(__file__).parent))
import rules_sensitivity as bench

from lostmotion import rules


def record(rule: str, share: float, verdict: str, *, good: bool) -> bench.Record:
    plain = {"looked_at": ["TWIN_DEG"]} if not rule else {}
    answer = [verdict, [], [], []]
    return {"campaign": "a", "rule": rule, "share": share, "answer": answer, "good": good, **plain}


def test_whole_numbers_change_by_one_at_least_and_stay_whole() -> None:
    assert bench.changed(2, -0.3) == 1
    assert bench.changed(2, 0.3) == 3
    assert bench.changed(15, 0.3) == 19
    assert bench.changed(1, -0.3) == 1
    assert bench.changed(10.0, -0.3) == 7.0


def test_the_rules_that_a_diagnosis_reads_are_noted() -> None:
    module = ModuleType("some_rules")
    module.LEAST, module.MOST = 1.0, 2.0  # type: ignore[attr-defined]
    module.__class__ = bench.Watched
    bench.LOOKED_AT.clear()
    assert module.LEAST == 1.0
    assert sorted(bench.LOOKED_AT) == ["LEAST"]


def test_only_what_was_looked_at_is_tried_both_ways() -> None:
    plain = record("", 0.0, "complete", good=True)
    assert list(bench.trials(plain, ["TWIN_DEG", "HARM_MOST"])) == [
        ("TWIN_DEG", -bench.CHANGE),
        ("TWIN_DEG", bench.CHANGE),
    ]


def test_the_table_counts_what_moves_and_names_what_moves_nothing() -> None:
    plain = record("", 0.0, "complete", good=True)
    down = record("TWIN_DEG", -bench.CHANGE, "ambiguous", good=False)
    up = record("TWIN_DEG", bench.CHANGE, "complete", good=True)
    text = bench.table([plain, down, up])
    assert text.splitlines()[2].split() == ["TWIN_DEG", "1", "1", "0", "0", "1"]
    last = text.splitlines()[-1]
    assert "TWIN_DEG" not in last
    assert "HARM_MOST" in last  # no campaign examines it
    assert {name for name in vars(rules) if name.isupper()} == set(bench.NAMES)
