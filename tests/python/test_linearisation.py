"""The point of linearisation of a diagnosis on campaigns of the laboratory."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lostmotion.candidates.candidate import Candidate
from lostmotion.discover.choice import as_kept
from lostmotion.discover.growing_model import Contender
from lostmotion.discover.linearise import Misfit, objective_at, settle
from lostmotion.discover.recorded_model import RecordedModel
from lostmotion.drives import read_drive
from lostmotion.effects.conditions import Conditions
from lostmotion.evidence.contest import Contest, Result
from lostmotion.evidence.noise import Noise
from lostmotion.fit.baseline import BaselineModel
from lostmotion.recordings import read_campaign

sys.path.insert(0, str(Path(__file__).parents[1]))
from rig.laboratory import Laboratory

SEED, NOISES = 0, 2.0


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
    some = Result("", 0.0, 1, 1.0, 1.0, 1.0, 0.0, gain, *[np.zeros(0)] * 4, "")
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


def test_points_are_compared_in_one_unit_whatever_the_scale_of_their_columns(near):
    base, e = near.base, near.contest.evidence
    factor = np.ones(e.scale.size)
    factor[e.fixed] = 2.0 ** (np.arange(e.fixed.size) % 7)
    other = replace(
        e,
        gram=e.gram * np.outer(factor, factor),
        scale=e.scale / factor,
        precision=e.precision * factor[e.fixed] ** 2,
    )
    misfit, residual = Misfit(base, near.noise), base.residual()
    one, two = (
        objective_at(misfit, base, residual, contest)
        for contest in (near.contest, Contest(other, near.contest.null_omega))
    )
    assert two == pytest.approx(one, abs=1e-3)
