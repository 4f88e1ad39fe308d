"""Sessions: if files restart their run numbers, the motion between them is unknown."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_campaigns import RATED_NM, RATIO, campaign, write

from lostmotion.discover import diagnose
from lostmotion.discover.common_columns import gather_body
from lostmotion.discover.merged_verdict import judge_body
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.library import library
from lostmotion.evidence.merging import merge_bodies
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.hysteresis import PLAYS
from lostmotion.recordings import Campaign, Run, read_campaign
from lostmotion.sample import thin_campaign
from lostmotion.torsion_curve import run_plays
from lostmotion.units import ARCSEC


def moved_before(data: Campaign, state: float) -> Campaign:
    """The same campaign with another start state of the friction, in half widths."""
    torque = data.runs[0].torque_Nm
    wound = [torque + 0.5 * run_plays(np.array([3.0]), torque, s)[:, 0] for s in (state, 0.0)]
    there, usual = (w * 7.0 + 25.0 * np.tanh(w / 8.0) for w in wound)
    columns = data.runs[0].columns
    columns["lost_motion"] = columns["lost_motion"] + (there - usual) * ARCSEC
    return data


@pytest.fixture(scope="module")
def months(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Three months of one drive, each with runs 1 to 8; before two of them the joint was moved."""
    folder = tmp_path_factory.mktemp("months")
    files = []
    for seed, state in ((1, 0.0), (2, 1.0), (3, -1.0)):
        files.append(folder / f"month_{seed}.csv")
        write(moved_before(campaign(seed, runs=8, warm=False), state), files[-1])
    return files


@pytest.mark.parametrize("states", [(0.0, 0.0, 0.0), (0.0, 0.5, -0.5)])
def test_every_session_begins_where_it_began(states: tuple[float, ...]) -> None:
    runs: list[Run] = []
    for k, state in enumerate(states):
        data = moved_before(campaign(k + 1, runs=8, warm=False, noise=0.3), state)
        data.runs[0].begins = k > 0
        runs += data.runs
    base = BaselineModel(Conditions(Campaign(runs)), RATED_NM)
    base.first_fit()
    rest = base.residual()
    begin = np.array([np.std(rest[a : a + 60]) for a in base.conditions.starts[:-1]])
    others = np.delete(begin, [0, 8, 16])
    # With the friction's memory of the month before, the residual is 1.7 to 7 arcsec.
    assert np.all(begin[[0, 8, 16]] < 4 * np.median(others))


def test_months_that_number_their_runs_anew_are_sessions(months: list[Path]) -> None:
    data = read_campaign(months, ratio=RATIO)
    assert data.sessions() == [0, 8, 16]
    found = diagnose(None, data, ratio=RATIO, rated_torque_Nm=RATED_NM)
    assert (found.verdict, found.effects, found.events) == ("complete", [], [])
    assert thin_campaign(data, 2000).sessions() == [0, 8, 16]


def test_runs_that_are_numbered_on_are_one_session(tmp_path: Path) -> None:
    data = campaign(runs=6)
    for name, runs in (("a", data.runs[:3]), ("b", data.runs[3:])):
        write(Campaign(runs), tmp_path / f"{name}.csv")
    assert read_campaign(tmp_path, ratio=RATIO).sessions() == [0]
    one = read_campaign(tmp_path / "a.csv", ratio=RATIO)
    assert one.sessions() == [0]


def test_start_states_of_every_session_have_their_columns(months: list[Path]) -> None:
    base = BaselineModel(Conditions(read_campaign(months, ratio=RATIO)), RATED_NM)
    base.first_fit()
    base.hysteresis.outside = np.full(PLAYS, 0.02 * float(base.curve.slopes.min()))
    fixed, names = base.fixed_columns(base.at()), base.names()
    x = base.vector()[0]
    assert len(names) == x.size == fixed.shape[1]
    places = base.start_places()
    assert [names[at][0] for at in places] == ["start_0", "start_1_0", "start_2_0"]
    for k, at in enumerate(places):
        more, less = base.copy(), base.copy()
        step = 1e-4 * (np.arange(x.size) == at.start + PLAYS - 1)
        more.set_vector(x + step)
        less.set_vector(x - step)
        np.testing.assert_array_equal(
            more.hysteresis.start[k] != base.hysteresis.start[k], np.arange(PLAYS) == PLAYS - 1
        )
        change = (more.angle() - less.angle()) / 2e-4
        # A kink between the two affects one or two samples.
        near = np.abs(change - fixed[:, at.stop - 1]) <= 1e-4 * np.abs(change).max()
        assert np.mean(near) > 0.99
        first = np.flatnonzero(base.conditions.run_of == 8 * k)
        assert np.any(change)
        assert set(np.flatnonzero(change)) <= set(first)


def test_evidence_of_several_sessions_merges_with_that_of_one(months: list[Path]) -> None:
    bodies = []
    for files in (months[:2], months[2:]):
        data = read_campaign(files, ratio=RATIO)
        bodies.append(
            gather_body(
                diagnose(None, data, ratio=RATIO, rated_torque_Nm=RATED_NM), library(), RATIO
            )
        )
    found = judge_body(merge_bodies(bodies, ["a", "b"]), library())
    assert (found["verdict"], found["effects"]) == ("complete", [])
    assert found["runs"] == 24
