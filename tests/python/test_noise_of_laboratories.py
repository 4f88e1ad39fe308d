"""The measurement noise of a diagnosis against that of the laboratory."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from lostmotion.discover import diagnose
from lostmotion.drives import read_drive
from lostmotion.recordings import read_campaign

sys.path.insert(0, str(Path(__file__).parents[1]))
from rig.laboratory import Laboratory


def test_measurement_noise_is_that_of_the_encoders_though_the_input_angle_is_locked(tmp_path):
    # At a locked input, many candidates are constant in every run.
    truth = Laboratory(1, "dahl", "strangers").write(tmp_path)
    drive = read_drive(tmp_path / "drive.toml")
    campaign = read_campaign(sorted(tmp_path.glob("*.csv.gz")), ratio=drive.ratio)
    noise = diagnose(drive, campaign).answer()["noise"]["within_runs_arcsec"]
    assert noise == pytest.approx(truth["noise_arcsec_rms"], rel=0.15)
