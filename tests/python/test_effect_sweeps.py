"""Effects over a campaign: one call for all runs gives the same bits as one call per run."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
import pytest

from conftest import DATA
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.library import library
from lostmotion.recordings import read_campaign

EVERY = 20
"""Rows of the demo's campaign that are used."""


@pytest.fixture(scope="module")
def conditions() -> Conditions:
    campaign = read_campaign(DATA / "joint" / "joint.csv.gz", ratio=100)
    for run in campaign.runs:
        run.columns = {name: values[::EVERY] for name, values in run.columns.items()}
    return Conditions(campaign)


@pytest.mark.parametrize("name", sorted(library()))
def test_a_sweep_gives_the_bits_of_its_runs(conditions: Conditions, name: str) -> None:
    effect = library()[name]
    function = effect.function

    def by_run(values: np.ndarray, run: Mapping[str, np.ndarray], memory: np.ndarray) -> np.ndarray:
        angle = run["input_angle_rad"]  # which the C effects get within one turn
        within = np.remainder(angle + np.pi, 2 * np.pi) - np.pi
        return function(values, {**run, "input_angle_rad": within}, memory)

    elastic = conditions.torque / 3e4
    loads = (conditions.torque, elastic, 0.9 * conditions.torque)
    swept = effect.run(effect.typical, conditions, *loads)
    one_by_one = dataclasses.replace(effect, function=by_run)
    np.testing.assert_array_equal(swept, one_by_one.run(effect.typical, conditions, *loads))
