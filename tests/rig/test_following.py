"""Runs after those of a plan, and conditions worse than the standard ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from .bench import TestBench
from .campaign import Conditions, make_campaign
from .drives import SIZES
from .following import drive_number, followed, offered, options_text, repeated
from .mechanics import ARCSEC
from .plans import Run, make_plan
from .suites import write_suite


def test_runs_that_follow_leave_the_others_as_they_were() -> None:
    plain = make_campaign(6, 3, {}, "short", magnitudes={"wear": 12.0})
    truth = plain.truth()
    longer = followed(truth, 3, lambda runs, _: [repeated(runs, 6)])
    rows = len(plain.bench.plan.run)
    assert longer.bench.plan.runs == plain.bench.plan.runs + 1
    for name, values in plain.measured.items():
        assert np.array_equal(longer.measured[name][:rows], values), name
    own = longer.bench.plan.slices()[-1]
    noise = longer.measured["output_angle_rad"][own] - longer.readings.lost_motion_rad[own]
    noise = noise - longer.bench.plan.input_angle_rad[own] / longer.bench.drive.ratio
    assert np.std(noise) / ARCSEC == pytest.approx(1.5, rel=0.1)


def test_no_following_run_makes_the_drive_younger() -> None:
    plan = make_plan("aliased", 100, np.random.default_rng(1), then=lambda _, __: [])
    made: dict[str, Run] = {}

    def note(runs: list[Run], ratio: int) -> list[Run]:
        made.update(offered(runs, ratio))
        made["again"] = repeated(runs, 1)
        return []

    make_plan("aliased", 100, np.random.default_rng(1), then=note)
    assert len(made) > 10
    assert {run.cycles for run in made.values()} == {plan.cycles.max()}


def test_one_more_of_the_same_is_as_warm_as_the_plan_has_become() -> None:
    def again(seed: int) -> Run:
        made: list[Run] = []

        def note(runs: list[Run], _: int) -> list[Run]:
            made.append(repeated(runs, seed))
            return []

        make_plan("aliased", 100, np.random.default_rng(1), then=note)
        return made[0]

    runs = [again(seed) for seed in range(12)]
    assert len({(run.kind, float(np.max(run.torque))) for run in runs}) > 2
    assert all(np.mean(run.temperature_C) > 40 for run in runs)


def test_options_are_a_plan_without_what_is_measured() -> None:
    made = make_campaign(6, 2, {}, "short")
    runs: dict[str, Run] = {}
    make_plan(
        "short", 100, np.random.default_rng(1), then=lambda r, u: runs.update(offered(r, u)) or []
    )
    text = options_text(runs, 40.0, made.columns).splitlines()
    assert text[0] == "run,time_s,torque_Nm,input_angle_rad,temperature_C,cycles"
    assert {line.split(",")[0] for line in text[1:]} == set(runs)


@pytest.mark.parametrize("number", range(len(SIZES)))
def test_a_drive_is_found_by_its_name(number: int) -> None:
    name = TestBench(1, number, "short").drive.name
    assert drive_number({"drive": name}) == number


@pytest.mark.parametrize("factor", [2.0, 4.0])
def test_the_noise_can_be_made_larger(factor: float) -> None:
    made = make_campaign(4, 1, {}, "third", Conditions(noise=factor))
    assert made.truth()["noise_arcsec_rms"] == pytest.approx(1.5 * factor, rel=0.03)


def test_the_sheet_can_be_off() -> None:
    one, other = (
        make_campaign(4, 1, {}, "third", Conditions(sheet_bias=bias)).bench.drive.sheet
        for bias in (0.0, 0.2)
    )
    for name in ("K1_Nm_per_rad", "K2_Nm_per_rad", "K3_Nm_per_rad"):
        assert other[name] == pytest.approx(1.2 * one[name], rel=0.01)


def test_a_third_of_the_runs_are_runs_of_the_standard_plan() -> None:
    whole, third = (make_plan(n, 100, np.random.default_rng(3)) for n in ("standard", "third"))
    assert whole.runs / third.runs == pytest.approx(3, rel=0.1)
    cycles = {tuple(whole.torque[rows]) for rows in whole.slices()}
    assert {tuple(third.torque[rows]) for rows in third.slices()} <= cycles


def test_a_suite_can_take_some_seeds_and_some_effects(tmp_path: Path) -> None:
    more = {"plan": "short", "twins": False, "report": lambda _: None}
    made = write_suite(
        "single", 2, "develop", tmp_path, skip=4, every=3, only=("torque_offset",), **more
    )
    assert [truth["seed"] for truth in made] == [4, 7]
    assert all(list(truth["effects"]) == ["torque_offset"] for truth in made)


def test_half_the_effect_is_half_the_residual(tmp_path: Path) -> None:
    made = write_suite(
        "single",
        1,
        "develop",
        tmp_path,
        sigma=0.25,
        plan="third",
        twins=False,
        report=lambda _: None,
        only=("kinematic_error",),
    )
    assert made[0]["hidden"][0]["residual_sigma"] == pytest.approx(0.25, rel=0.1)
