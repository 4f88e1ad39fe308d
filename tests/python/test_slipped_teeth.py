"""Teeth that slipped at an overload are reported with run and time, and do not hide other missing
effects."""

from __future__ import annotations

import numpy as np
import pytest
from small_campaigns import ARCSEC, DRIVE, RATED_NM, RATIO, answer_of, campaign, gap

from lostmotion.candidates.slipped_teeth import jumps
from lostmotion.discover import diagnose, library
from lostmotion.discover.common_columns import gather_body
from lostmotion.discover.merged_verdict import judge_body
from lostmotion.drives import parse_drive, tomllib
from lostmotion.effects.conditions import Conditions
from lostmotion.evidence.merging import merge_bodies
from lostmotion.fit.baseline import BaselineModel
from lostmotion.recordings import Campaign, Run
from lostmotion.torsion_curve import run_plays

TOOTH_RAD = 2 * np.pi / (2 * RATIO + 2)
OVERLOAD_NM = 2.5 * RATED_NM


def overloaded(data, slips_at_Nm, teeth=1, peaks=(OVERLOAD_NM,)):
    """Add a run with load peaks of a given height, with a slip in each peak beyond a torque."""
    like = data.runs[-1].columns
    rows = like["time"].size
    phase = np.arange(rows) / rows * len(peaks)
    torque = np.sin(2 * np.pi * phase) * np.repeat(peaks, -(-rows // len(peaks)))[:rows]
    slipped = np.zeros(rows)
    armed = True
    for k, load in enumerate(torque):
        if abs(load) > slips_at_Nm and armed:
            slipped[k:] += teeth * np.sign(load)
            armed = False
        armed = armed or abs(load) < 0.5 * slips_at_Nm
    # The friction of the other runs, with its memory of them.
    before = [run.columns["torque"] for run in data.runs]
    wound = torque + 0.5 * run_plays(np.array([3.0]), np.concatenate((*before, torque)))[-rows:, 0]
    noise = np.random.default_rng(9).normal(size=rows)
    lost_motion = (wound * 7.0 + 25.0 * np.tanh(wound / 8.0) + noise) * ARCSEC
    columns = dict(like, torque=torque, lost_motion=lost_motion + slipped * TOOTH_RAD)
    return Campaign([*data.runs, Run(len(data.runs) + 1, "made.csv", columns)])


@pytest.mark.parametrize("teeth", [1, 2])
def test_teeth_that_slipped_are_named_with_their_torque_run_and_second(teeth):
    data = overloaded(campaign(seed=5), 2.1 * RATED_NM, teeth)
    found = answer_of(data)
    assert (found["verdict"], found["effects"]) == ("missing-effect", ["ratcheting"])
    first = found["candidates"][0]
    assert first["name"] == "ratcheting"
    assert first["parameters"]["threshold_Nm"] == pytest.approx(2.1 * RATED_NM, rel=0.02)
    assert first["parameters"]["tooth_angle_rad"] == pytest.approx(teeth * TOOTH_RAD)
    times = data.runs[-1].columns["time"]
    beyond = np.flatnonzero(np.abs(data.runs[-1].columns["torque"]) > 2.1 * RATED_NM)
    back = beyond[np.flatnonzero(np.diff(beyond) > 1)[0] + 1]
    assert [event["run"] for event in found["events"]] == [13, 13]
    assert [event["time_s"] for event in found["events"]] == [times[beyond[0]], times[back]]
    for event, sense in zip(found["events"], (1, -1), strict=True):
        assert event["size_arcsec"] == pytest.approx(sense * teeth * TOOTH_RAD / ARCSEC)
    assert found["unexplained"]["depends_on"] == []
    base, with_it = found["ladder"]
    assert base["rms_arcsec"] > 100 * with_it["rms_arcsec"]
    # The residual is the elasticity beyond the loads of the other runs.
    assert with_it["rms_heldout_arcsec"] < 0.015 * base["rms_heldout_arcsec"]


def test_a_slip_leaves_nothing_behind_where_another_run_has_its_loads():
    once = overloaded(campaign(seed=5), 2.1 * RATED_NM)
    found = answer_of(overloaded(once, 2.1 * RATED_NM))
    assert (found["verdict"], found["effects"]) == ("missing-effect", ["ratcheting"])
    assert found["ladder"][-1]["rms_heldout_arcsec"] < 3


def test_merged_evidence_has_them_as_events_of_one_campaign():
    drive = parse_drive(tomllib.loads(DRIVE))
    both = [overloaded(campaign(seed), limit) for seed, limit in ((5, 2.1 * RATED_NM), (6, 1e9))]
    bodies = [gather_body(diagnose(drive, data), library(), RATIO) for data in both]
    answer = judge_body(merge_bodies(bodies, ["1", "2"]), library())
    assert (answer["verdict"], answer["effects"]) == ("missing-effect", ["ratcheting"])
    assert [event["teeth"] for event in answer["events"]] == [1, -1]
    assert answer["unexplained"]["depends_on"] == []


def test_what_else_is_missing_is_found_beside_it():
    found = answer_of(overloaded(campaign(seed=5, add=gap), 2.1 * RATED_NM))
    assert found["effects"] == ["ratcheting", "thermal_gap"]
    assert [rung["effects"] for rung in found["ladder"]] == [
        [],
        ["ratcheting"],
        ["ratcheting", "thermal_gap"],
    ]


def test_a_jump_that_no_threshold_explains_is_no_ratcheting():
    """The second peak is higher than the first, in which the tooth slipped."""
    data = overloaded(campaign(seed=5), 1e9, peaks=(OVERLOAD_NM, 1.1 * OVERLOAD_NM))
    rows = data.runs[-1].columns["time"].size
    data.runs[-1].columns["lost_motion"][rows // 10 :] += TOOTH_RAD
    found = answer_of(data)
    assert found["verdict"] == "unexplained"
    assert "ratcheting" not in found["effects"]
    assert found["events"][0]["run"] == 13


def test_a_wild_sample_is_no_jump():
    data = campaign(seed=5)
    data.runs[3].columns["lost_motion"][200] += TOOTH_RAD
    base = BaselineModel(Conditions(data), RATED_NM)
    assert jumps(base, TOOTH_RAD / ARCSEC) == []
    data.runs[3].columns["lost_motion"][200] -= TOOTH_RAD
    data.runs[3].columns["lost_motion"][200:] += 2 * TOOTH_RAD
    base = BaselineModel(Conditions(data), RATED_NM)
    assert [teeth for _, teeth in jumps(base, TOOTH_RAD / ARCSEC)] == [2]
