"""The benchmark that changes one threshold at a time, and its table."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import rules_sensitivity as bench
from traced_rules import NOTED, Traced, TracedRules

from lostmotion import rules


def record(rule: str, share: float, verdict: str, *, good: bool) -> bench.Record:
    changes = [("TWIN_DEG", -bench.CHANGE), ("TWIN_DEG", bench.CHANGE)]
    plain = {"depends_on": changes} if not rule else {}
    answer = [verdict, [], [], []]
    return {"campaign": "a", "rule": rule, "share": share, "answer": answer, "good": good, **plain}


def test_whole_numbers_change_by_one_at_least_and_stay_whole() -> None:
    assert bench.changed(2, -0.3) == 1
    assert bench.changed(2, 0.3) == 3
    assert bench.changed(15, 0.3) == 19
    assert bench.changed(1, -0.3) == 1
    assert bench.changed(10.0, -0.3) == 7.0


def noted(value: float, test: Callable[[Any], object]) -> set[float]:
    """Shares of the changes of a rule on which a test depends."""
    NOTED.clear()
    test(Traced(value, {("RULE", s): other for s, other in bench.changes_of(value).items()}))
    return {share for _, share in NOTED}


def test_a_change_is_noted_if_and_only_if_an_outcome_depends_on_it() -> None:
    down, up = -bench.CHANGE, bench.CHANGE
    assert noted(10.0, lambda rule: rule > 6.9) == set()
    assert noted(10.0, lambda rule: rule > 7.1) == {down}
    assert noted(10.0, lambda rule: 2.0 * rule - rule**2 / 10.0 > 9.2) == {down, up}
    assert noted(10.0, lambda rule: np.float64(12.9) > rule) == {up}
    assert noted(10.0, lambda rule: max(8.0, rule) > 7.5) == {down}
    assert noted(10.0, lambda rule: np.array([1.0, 8.0, 20.0]) >= 1.0 * rule) == {down}
    assert noted(10.0, lambda rule: np.log(rule) < np.log(12.0)) == {up}
    assert noted(0.2, lambda rule: int(rule * 9)) == {up}  # 1 becomes 2
    assert noted(3, lambda rule: [1, 2, 3, 4][:rule]) == {down, up}
    assert noted(10.0, lambda rule: f"{rule:g}") == set()


def test_the_rules_of_a_module_are_traced() -> None:
    module = ModuleType("some_rules")
    module.LEAST, module.MOST = 1.0, 2.0  # type: ignore[attr-defined]
    module.changes_of = bench.changes_of  # type: ignore[attr-defined]
    module.__class__ = TracedRules
    NOTED.clear()
    assert not module.LEAST > 1.2
    assert module.MOST > 1.0
    assert {("LEAST", bench.CHANGE)} == NOTED


def test_only_what_was_looked_at_is_tried_both_ways() -> None:
    plain = record("", 0.0, "complete", good=True)
    assert list(bench.trials(plain, ["TWIN_DEG", "HARM_MOST"])) == plain["depends_on"]
    assert list(bench.trials(plain, ["HARM_MOST"])) == []


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
