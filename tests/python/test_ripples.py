"""Ripples of any order over an angle: found, separated by both angles, and none in noise."""

from __future__ import annotations

import numpy as np
import pytest
from nulls import most
from small_campaigns import ARCSEC, RATED_NM, RATIO, campaign

from lostmotion.candidates.ripples import ripples
from lostmotion.discover import diagnose
from lostmotion.discover.contest_round import make_round
from lostmotion.discover.gates import judge_all
from lostmotion.discover.linearise import settle
from lostmotion.discover.measurement_noise import estimate_noise
from lostmotion.effects.conditions import Conditions
from lostmotion.fit.baseline import BaselineModel
from lostmotion.recordings import Campaign

TURNS = 7.3


def turning(seed: int, order: float = 1.0, size: float = 0.0, rows: int = 300) -> Campaign:
    """Torque loops; in every second run the input turns back and forth."""
    data = campaign(seed=seed, rows=rows, warm=False)
    for run in data.runs[::2]:
        there_and_back = 1 - np.abs(np.linspace(-1, 1, rows))
        angle = 2 * np.pi * TURNS * there_and_back
        run.columns["input_angle"] = angle
        ripple = size * np.cos(order * angle + 0.4)
        run.columns["lost_motion"] = run.columns["lost_motion"] + ripple * ARCSEC
    for run in data.runs:
        run.columns["output_angle"] = (
            run.columns["input_angle"] / RATIO + run.columns["lost_motion"]
        )
    return data


def base_of(data: Campaign) -> BaselineModel:
    base = BaselineModel(Conditions(data), RATED_NM)
    base.first_fit()
    return base


@pytest.mark.parametrize("order", [0.713, 1.37, 7.78])
def test_a_ripple_of_any_order_is_no_noise(order: float) -> None:
    found = diagnose(None, turning(4, order, 1.5), ratio=RATIO, rated_torque_Nm=RATED_NM)
    assert (found.verdict, found.effects) == ("unexplained", [])
    depends = {one["covariate"]: one["shape"] for one in found.unexplained["depends_on"]}
    resolved = 0.3 / TURNS
    told = {name: float(shape.split()[0]) for name, shape in depends.items()}
    assert told["input_angle"] == pytest.approx(order, abs=resolved)
    assert told["output_angle"] == pytest.approx(order * RATIO, abs=resolved * RATIO)


def test_what_is_reported_is_no_order_that_competes_anyway() -> None:
    (ripple,) = ripples(base_of(turning(5, 3.0, 2.0)))
    assert abs(float(ripple.name.split()[1]) - 3.0) > 1.0 / TURNS
    assert ripple.trials > 50


def test_constant_angles_have_no_ripples() -> None:
    assert ripples(base_of(campaign(seed=5, rows=300, warm=False))) == []


def test_the_best_of_many_orders_pays_for_all_of_them() -> None:
    trials, level = 16, 0.2
    alarms = 0
    for seed in range(trials):
        base = base_of(turning(100 + seed, rows=200))
        (ripple,) = ripples(base)
        settled = settle(base, estimate_noise(base, [ripple.columns]))
        (result,) = judge_all(make_round(settled, [ripple], {}))
        alarms += result.p < level
    assert alarms <= most(trials, level)
