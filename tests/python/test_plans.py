"""Effects that a plan can identify, and the suggested next run."""

from __future__ import annotations

import numpy as np
import pytest
from small_campaigns import DRIVE, RATED_NM, RATIO, campaign, gap

from lostmotion.discover import diagnose, library
from lostmotion.discover.fitted_model import fit_model
from lostmotion.discover.next_run import next_runs
from lostmotion.discover.recording_check import check
from lostmotion.drives import parse_drive, tomllib
from lostmotion.errors import InputError
from lostmotion.recordings import Campaign, Run


def test_columns_that_change_together_are_reported():
    data = campaign(seed=1)
    for r, run in enumerate(data.runs):
        run.columns["temperature"][:] = 20.0 + r
        run.columns["cycles"] = np.full(len(run), 1000.0 * r)
    pairs = [set(pair["columns"]) for pair in check(data, library())["aliased"]]
    assert {"temperature_C", "cycles"} in pairs


def test_angles_bound_by_the_gear_are_not_recommended_to_vary_alone():
    data = campaign(seed=1)
    for r, run in enumerate(data.runs):
        run.columns["input_angle"] = np.full(len(run), 0.3 * ((7 * r) % len(data.runs)))
        run.columns["output_angle"] = run.columns["input_angle"] / 100 + run.lost_motion_rad
    pairs = [set(pair["columns"]) for pair in check(data, library())["aliased"]]
    assert {"input_angle_rad", "output_angle_rad"} not in pairs
    # The angle is still examined against conditions that can be chosen freely.
    for r, run in enumerate(data.runs):
        run.columns["temperature"][:] = 20.0 + (7 * r) % len(data.runs)
    pairs = [set(pair["columns"]) for pair in check(data, library())["aliased"]]
    assert {"input_angle_rad", "temperature_C"} in pairs


def test_effects_need_only_columns_that_can_be_recorded():
    data = campaign()
    for run in data.runs:
        del run.columns["input_angle"], run.columns["output_angle"]
    blind = check(data, library())["not_testable"]
    assert blind["inertia"] == "not testable with these columns: no output_angle_rad"
    assert blind["viscous_friction"] == "not testable with these columns: no input_angle_rad"
    drive = parse_drive(tomllib.loads(DRIVE))
    with pytest.raises(InputError, match="output_angle_rad: found no such column"):
        fit_model(drive, data, ["inertia"])


def test_what_never_changes_is_called_what_it_is():
    data = campaign()
    for run in data.runs:
        run.columns["input_angle"][:] = run.columns["input_angle"][0]
    drive = parse_drive(tomllib.loads(DRIVE))
    with pytest.raises(InputError, match="speed of the input: found a constant"):
        fit_model(drive, data, ["viscous_friction"])


def test_the_next_run_is_the_one_that_differs_most():
    def both(columns, wound):
        return gap(columns, wound)

    data = campaign(seed=6, add=both)
    order = np.argsort([run.columns["temperature"][0] for run in data.runs])
    data.runs = [data.runs[i] for i in order]
    for r, run in enumerate(data.runs):
        run.columns["cycles"] = np.full(len(run), 1e5 * r)
    found = diagnose(None, data, ratio=RATIO, rated_torque_Nm=RATED_NM)
    options = []
    for label, temperature in (("again", 44.0), ("cold", 10.0)):
        columns = {k: v.copy() for k, v in data.runs[-1].columns.items()}
        columns["temperature"][:] = temperature
        options.append(Run(label, "plan.csv", columns))
    found.effects = ["thermal_gap", "wear"]
    answer = next_runs(found, Campaign(options), library(), RATIO)
    assert answer["suggested"] == "cold"
    # A further effect that was found and that is not confounded has no influence.
    alone = {run["run"]: run["separation_nats"] for run in answer["runs"]}
    found.selection.steps[0].rivals = ["wear"]
    found.effects.append("load_dependent_friction")
    beside = next_runs(found, Campaign(options), library(), RATIO)
    assert beside["suggested"] == "cold"
    assert {r["run"]: r["separation_nats"] for r in beside["runs"]} == pytest.approx(alone)
