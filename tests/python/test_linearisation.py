"""The point of linearisation of a diagnosis on campaigns of the laboratory."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from lostmotion.discover.linearise import settle
from lostmotion.drives import read_drive
from lostmotion.effects.conditions import Conditions
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


def test_runs_of_one_stiffness_deviate_alike(turned_at_two_angles):
    # The first step goes through many kinks: its linearisation promises more than it keeps.
    laboratory, folder = turned_at_two_angles
    drive = read_drive(folder / "drive.toml")
    campaign = read_campaign(sorted(folder.glob("*.csv.gz")), ratio=drive.ratio)
    base = BaselineModel(Conditions(campaign), drive.rated_torque_Nm)
    base.first_fit()
    runs = base.conditions.runs
    noise = Noise([np.zeros(0)] * runs, np.full(runs, laboratory.noise_arcsec))
    stiffness = settle(base, noise).base.deviations[:, 0]
    plan = laboratory.plan
    angle = np.array([plan.input_angle_rad[rows.start] for rows in plan.slices()])
    largest = np.array([np.abs(plan.torque[rows]).max() for rows in plan.slices()])
    large = largest > 0.5
    one, other = stiffness[large & (angle < 2.0)], stiffness[large & (angle > 2.0)]
    assert one.min() > other.max()
