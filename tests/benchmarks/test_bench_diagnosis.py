"""What the benchmark of the diagnosis counts as right."""

from __future__ import annotations

from typing import Any

from bench_diagnosis import condition, judge, ranges

EVENT = {"run": "6", "time_s": 16.7}


def truth(*effects: str, **more: Any) -> dict[str, Any]:
    return {"effects": dict.fromkeys(effects, 1.0), "hidden": [], "plan": "standard", **more}


def found(verdict: str, *effects: str, **more: Any) -> dict[str, Any]:
    shown = {"depends_on": [{"covariate": name} for name in more.get("depends_on", ())]}
    events = more.get("events", [])
    return {"verdict": verdict, "effects": list(effects), "unexplained": shown, "events": events}


def test_a_single_effect_has_to_be_named_first() -> None:
    assert judge(truth("wear"), found("missing-effect", "wear")) == "right"
    assert judge(truth("wear"), found("missing-effect", "creep")) == "wrong"
    assert judge(truth("wear"), found("ambiguous", "creep", "wear")) == "in the set"
    twins = truth("wear", twins={"creep": 0.99})
    assert judge(twins, found("missing-effect", "creep")) == "twin"
    assert judge(truth("wear"), found("complete")) == "none"
    assert judge(truth("wear"), found("unexplained", "wear")) == "named (unexplained)"


def test_a_pair_needs_both_and_nothing_left_over() -> None:
    pair = truth("wear", "creep")
    assert judge(pair, found("missing-effect", "creep", "wear")) == "right"
    assert judge(pair, found("missing-effect", "creep")) == "one of two"
    assert judge(pair, found("unexplained", "creep", "wear")).startswith("both named")


def test_nothing_hidden_has_to_end_complete() -> None:
    assert judge(truth(), found("complete")) == "right"
    assert judge(truth(), found("missing-effect", "wear")).startswith("false alarm")


def test_a_cause_outside_needs_its_column_and_an_event_its_run_and_second() -> None:
    cause = truth("outside_warm_up", hidden=[{"depends_on": ["time"]}])
    assert judge(cause, found("unexplained", depends_on=["time"])) == "right"
    assert judge(cause, found("unexplained", depends_on=["torque"])) != "right"
    slip = truth("outside_slip", events=[EVENT])
    assert judge(slip, found("unexplained", events=[{"run": 6, "time_s": 16.9}])) == "right"
    assert judge(slip, found("unexplained", events=[{"run": 5, "time_s": 16.9}])) != "right"


def test_conditions_and_seeds_are_said_in_words() -> None:
    plain = {"noise": 1.0, "scatter": 3.0, "sheet_bias": 0.0, "outliers": 0.01}
    plain |= {"dropped_counts": 0, "dropped_columns": []}
    assert condition(truth("wear", conditions=plain)) == "3 times the scatter, 1 % outliers"
    assert ranges([1, 2, 3, 7]) == "1-3, 7"
