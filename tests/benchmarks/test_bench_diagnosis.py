"""Results that the benchmark of the diagnosis counts as correct, and those that it stores."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from bench_diagnosis import in_turn, key, load, suite_and_count, work
from diagnosis_tables import count, page, ranges
from judging_suites import SPOILT, SUITES
from verdicts import condition, good, judge, wrong_alone

EVENT = {"run": "6", "time_s": 16.7}
PLAIN = {
    "noise": 1.0,
    "scatter": 1.0,
    "sheet_bias": 0.0,
    "outliers": 0.0,
    "dropped_counts": 0,
    "dropped_columns": [],
}


def truth(*effects: str, **more: Any) -> dict[str, Any]:
    return {
        "effects": dict.fromkeys(effects, 1.0),
        "hidden": [],
        "plan": "standard",
        "verdicts": ["missing-effect"] if effects else ["complete"],
        "events": [],
        "seed": 10_100,
        "drive": "size 20 ratio 100",
        "conditions": PLAIN,
        **more,
    }


def found(verdict: str, *effects: str, **more: Any) -> dict[str, Any]:
    depends = [{"covariate": name, "shape": "smooth"} for name in more.get("depends_on", ())]
    steps = [{"covariate": "time", "shape": "step of 6 arcsec"} for _ in more.get("events", ())]
    return {
        "verdict": verdict,
        "effects": list(effects),
        "unexplained": {"depends_on": depends + steps},
        "events": more.get("events", []),
        "ladder": [{"rms_arcsec": 1.6, "rms_heldout_arcsec": 1.6}],
        "noise_floor_arcsec": 1.5,
    }


def test_a_single_effect_has_to_be_named_first() -> None:
    wear = truth("wear")
    assert judge(wear, found("missing-effect", "wear")) == "right"
    assert judge(wear, found("missing-effect", "creep")) == "wrong"
    assert judge(wear, found("ambiguous", "creep", "wear")) == "in the set"
    twins = truth("wear", twins={"creep": 0.99})
    assert judge(twins, found("missing-effect", "creep")) == "twin"
    assert judge(wear, found("complete")) == "none"
    more = judge(wear, found("unexplained", "wear", depends_on=["torque"]))
    assert more == "first, a residual remains"
    assert good(wear, more)
    assert not good(wear, "in the set")


def test_a_wrong_effect_alone_is_one_without_the_right_one_or_its_twin() -> None:
    wear = truth("wear", twins={"thermal_gap": 0.99})
    assert wrong_alone(wear, found("missing-effect", "creep"))
    assert wrong_alone(wear, found("unexplained", "creep"))
    assert not wrong_alone(wear, found("missing-effect", "thermal_gap"))
    assert not wrong_alone(wear, found("ambiguous", "creep", "wear"))
    assert not wrong_alone(wear, found("complete"))


def test_a_pair_needs_both() -> None:
    pair = truth("wear", "creep")
    assert judge(pair, found("missing-effect", "creep", "wear")) == "right"
    assert judge(pair, found("missing-effect", "creep")) == "one of two"
    left = judge(pair, found("unexplained", "creep", "wear", depends_on=["time"]))
    assert left.startswith("both named")


def test_friction_that_grows_with_the_load_is_told_by_the_form() -> None:
    pair = truth("wear", "load_dependent_friction")
    answer = found("missing-effect", "wear")
    assert judge(pair, answer) == "one of two"
    assert judge(pair, answer | {"friction": "inside+load"}) == "right"
    alone = truth("load_dependent_friction")
    assert judge(alone, found("complete") | {"friction": "inside"}) == "none"
    assert judge(alone, found("complete") | {"friction": "both+load"}) == "right"
    assert judge(truth("wear"), answer | {"friction": "inside+load"}) == "first, with others"


def test_nothing_hidden_has_to_end_complete() -> None:
    assert judge(truth(), found("complete")) == "right"
    assert judge(truth(), found("missing-effect", "wear")).startswith("false alarm")


def test_a_cause_outside_needs_its_column_and_an_event_its_run_and_second() -> None:
    cause = truth("outside_warm_up", hidden=[{"depends_on": ["time"]}])
    assert judge(cause, found("unexplained", depends_on=["time"])) == "right"
    assert judge(cause, found("unexplained", depends_on=["torque"])) != "right"
    assert judge(cause, found("missing-effect", "creep")) != "right"
    slip = truth("outside_slip", events=[EVENT])
    assert judge(slip, found("unexplained", events=[{"run": 6, "time_s": 16.9}])) == "right"
    assert judge(slip, found("unexplained", events=[{"run": 5, "time_s": 16.9}])) != "right"
    assert judge(slip, found("unexplained", events=[{"run": 6, "time_s": 18.9}])) != "right"


def test_lost_counts_are_to_be_found_beside_the_effect() -> None:
    lost = truth("wear", events=[EVENT])
    at = [{"run": 6, "time_s": 16.7}]
    assert judge(lost, found("unexplained", "wear", events=at)) == "right"
    assert judge(lost, found("missing-effect", "wear")) == "event not found"
    nothing = truth(events=[EVENT])
    assert judge(nothing, found("unexplained", events=at)) == "right"
    assert judge(nothing, found("complete")).startswith("event not found")
    assert judge(nothing, found("unexplained", "wear", events=at)).startswith("false alarm")


def test_without_its_column_an_effect_is_not_to_be_named_and_no_other_either() -> None:
    blind = truth("wear", verdicts=["unexplained", "ambiguous"])
    assert judge(blind, found("unexplained", depends_on=["run"])) == "right"
    assert judge(blind, found("missing-effect", "creep")) == "wrong"
    assert judge(blind, found("unexplained", "creep")) == "another beside the unknown"
    assert judge(blind, found("complete")) == "none"


def test_conditions_and_seeds_are_in_words() -> None:
    spoilt = PLAIN | {"scatter": 3.0, "outliers": 0.01}
    assert condition(truth("wear", conditions=spoilt)) == "3 times the scatter, 1 % outliers"
    assert condition(truth("wear")) == "standard"
    assert ranges([1, 2, 3, 7]) == "1-3, 7"
    assert count(19, 20) == "19 of 20: 95 % (75 to 100)"


def test_every_way_to_spoil_a_campaign_has_a_suite_and_words() -> None:
    assert {f"single_{name}" for name in SPOILT} <= SUITES.keys()
    for conditions, more in SPOILT.values():
        how = truth(
            "wear",
            conditions=PLAIN | conditions,
            plan=more.get("plan", "standard"),
            hidden=[{"residual_sigma": more.get("sigma", 0.5)}],
        )
        assert condition(how) != "standard"


def note(file: Path) -> dict[str, Any]:
    """A result of nothing."""
    return {
        "what": "diagnosis",
        "suite": file.parent.name,
        "name": file.name.removesuffix(".truth.json"),
        "truth": truth("wear"),
        "answer": found("missing-effect", "wear"),
        "wall_s": 1.0,
        "cpu_s": 1.0,
        "rows": 100,
    }


def fail(file: Path) -> dict[str, Any]:
    """A function that must not be called again."""
    raise AssertionError(file)


@pytest.fixture
def campaigns(tmp_path: Path) -> Path:
    for suite, number in (("single", 6), ("clean", 3)):
        (tmp_path / suite).mkdir()
        for i in range(number):
            (tmp_path / suite / f"campaign_{i}.truth.json").write_text("{}")
    return tmp_path


def test_suites_are_taken_in_turn(campaigns: Path) -> None:
    names = [file.parent.name for file in in_turn([campaigns], {})]
    assert names[:3].count("clean") == 1
    assert names[:6].count("clean") == 2
    wanted = dict([suite_and_count("single:2"), suite_and_count("clean")])
    names = [file.parent.name for file in in_turn([campaigns], wanted)]
    assert sorted(names) == ["clean"] * 3 + ["single"] * 2


def test_results_outlive_a_stop_and_are_not_made_again(campaigns: Path) -> None:
    results = campaigns / "results.jsonl"
    files = in_turn([campaigns], {})
    first = list(work(note, "diagnosis", files[:4], results, 1))
    with results.open("a") as out:
        out.write(json.dumps(first[0])[:40])  # an incomplete line
    assert [key(done) for done in load(results)] == [key(done) for done in first]
    assert not list(work(fail, "diagnosis", files[:4], results, 1))
    assert len(list(work(note, "diagnosis", files, results, 1))) == len(files) - 4
    assert len(load(results)) == len(files)


def test_the_page_states_what_was_counted(campaigns: Path) -> None:
    rows = [note(file) for file in in_turn([campaigns], {})]
    rows[0]["answer"] = found("complete")
    text = page(rows)
    assert "| single effect named first | 95 % | 8 of 9: 89 % (52 to 100) |" in text
    assert "| `wear` | 9 | 1 | 8 | 8 | - | 8 | 0 | 0 | 1 |" in text
