"""The point of linearisation of a diagnosis on campaigns of the laboratory."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lostmotion.candidates.candidate import Candidate
from lostmotion.candidates.named import named_candidates
from lostmotion.discover.choice import as_kept
from lostmotion.discover.contest_round import make_round
from lostmotion.discover.gates import judge
from lostmotion.discover.growing_model import Contender
from lostmotion.discover.linearise import bounded_step, contest_at, settle
from lostmotion.discover.recorded_model import RecordedModel
from lostmotion.discover.refits import refit
from lostmotion.drives import read_drive
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.library import library
from lostmotion.evidence.contest import Result
from lostmotion.evidence.noise import Noise
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.hysteresis import RADIUS_STEP
from lostmotion.fit.least_squares import moved_within
from lostmotion.recordings import read_campaign

sys.path.insert(0, str(Path(__file__).parents[1]))
from rig.laboratory import Laboratory

SEED, NOISES, RATIO = 0, 2.0, 100


@pytest.fixture(scope="module")
def turned_at_two_angles(tmp_path_factory):
    """Loops after unknown histories, with a stiffness that depends on the input angle."""
    folder: Path = tmp_path_factory.mktemp("laboratory")
    laboratory = Laboratory(SEED, "maxwell", "strangers")
    laboratory.write(folder, "stiffness_modulation", NOISES)
    return laboratory, folder


@pytest.fixture(scope="module")
def fitted(turned_at_two_angles):
    """A fit to these loops, with the noise of one reading."""
    laboratory, folder = turned_at_two_angles
    drive = read_drive(folder / "drive.toml")
    campaign = read_campaign(sorted(folder.glob("*.csv.gz")), ratio=drive.ratio)
    base = BaselineModel(Conditions(campaign), drive.rated_torque_Nm)
    base.first_fit()
    runs = base.conditions.runs
    return base, Noise([np.zeros(0)] * runs, np.full(runs, laboratory.noise_arcsec))


@pytest.fixture(scope="module")
def near(fitted):
    """The same at the deviations of its runs."""
    return settle(*fitted)


def test_runs_of_one_stiffness_deviate_alike(turned_at_two_angles, near):
    # The first step goes through many kinks: its linearisation promises more than it keeps.
    laboratory, _ = turned_at_two_angles
    stiffness = near.base.deviations[:, 0]
    plan = laboratory.plan
    angle = np.array([plan.input_angle_rad[rows.start] for rows in plan.slices()])
    largest = np.array([np.abs(plan.torque[rows]).max() for rows in plan.slices()])
    large = largest > 0.5
    one, other = stiffness[large & (angle < 2.0)], stiffness[large & (angle > 2.0)]
    assert one.min() > other.max()


def test_a_model_keeps_less_than_its_linearisation_far_from_its_optimum(fitted, near):
    far = settle(*fitted, rounds=0)
    assert np.all(far.beyond_linear > 0)
    assert np.sum(far.beyond_linear) > 10 * abs(np.sum(near.beyond_linear))
    gain = np.ones(near.base.conditions.runs)
    some = Result("", 0.0, 1, 1.0, 1.0, 1.0, 0.0, gain, *[np.zeros(0)] * 3, "")
    one, other = (
        Contender(some, Candidate(name, False, np.zeros((0, 0))), settled, gain.sum(), gain)
        for name, settled in (("far", far), ("near", near))
    )
    kept = as_kept([replace(one, result=replace(some, name="far")), other])
    lost = np.sum(far.beyond_linear - near.beyond_linear)
    assert kept[1].gain == gain.sum()
    assert kept[0].gain == pytest.approx(gain.sum() - lost)
    alone = as_kept([other, replace(one, passes=False)])
    assert [c.gain for c in alone] == [gain.sum()] * 2
    # Neither is the promise of a present model that is the far one a gain over the candidate.
    at_far, at_near = (SimpleNamespace(now=settled) for settled in (far, near))
    assert RecordedModel.not_kept(at_far, other) == pytest.approx(lost)
    assert RecordedModel.not_kept(at_near, one) == 0.0


def test_the_columns_of_deviations_are_their_derivatives_however_large_they_are(fitted):
    model = fitted[0].copy()
    model.deviations[:] = (0.4, -0.5, 3.0)
    columns = model.run_columns(model.at())
    for place, step in enumerate((1e-4, RADIUS_STEP, 1e-4)):
        up, down = model.copy(), model.copy()
        up.deviations[:, place] += step
        down.deviations[:, place] -= step
        slope = (up.angle() - down.angle()) / (2.0 * step)
        assert np.abs(slope).max() > 0.1  # arc seconds
        assert float(columns[:, place] @ slope / (slope @ slope)) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("share", [1e-17, 1e-9, 1e-6])
def test_an_operator_of_almost_no_share_holds_no_other_value(fitted, share):
    # Its start states change almost nothing, and their prior is scaled with their columns.
    base, noise = fitted
    steps = []
    for value in (0.0, share):
        model = base.copy()
        model.hysteresis.shares = model.hysteresis.shares.copy()
        model.hysteresis.shares[0] = value
        contest = contest_at(model, noise)
        step, _ = bounded_step(model, contest)
        steps.append(
            (step / contest.evidence.scale[contest.evidence.fixed])[: base.curve.slopes.size]
        )
    assert np.abs(steps[0]).max() > 0.0
    assert steps[1] == pytest.approx(steps[0], rel=1e-2, abs=1e-2 * np.abs(steps[0]).max())


def test_a_value_that_reaches_its_bound_in_a_step_is_at_the_bound():
    for seed in range(200):
        random = np.random.default_rng(seed)
        low, x, high = np.sort(random.normal(size=(3, 8)), axis=0) * 10.0 ** random.integers(-9, 9)
        scale, far = np.exp(random.normal(size=8)), random.random(8) < 0.5
        step = (np.where(far, high, low) - x) * scale / scale
        np.testing.assert_array_equal(moved_within(x, step, low, high), np.where(far, high, low))
        inside = moved_within(x, 0.5 * step, low, high)
        assert np.all((inside > low) & (inside < high))
        free = np.full(8, np.inf)
        np.testing.assert_array_equal(moved_within(x, step, -free, free), x + step)


def test_a_refit_loses_nothing_however_weak_the_candidate_is(near):
    base = near.base
    candidates, _ = named_candidates(library(), base, base.at(), RATIO)
    current = make_round(near, candidates, {})
    judged = [judge(current, candidate.name) for candidate in candidates]
    refits = [refit(current, result) for result in judged if result is not None]
    gains = [found.gain for found in refits if found is not None]
    assert len(gains) > 8
    assert min(gains) > -3.0
