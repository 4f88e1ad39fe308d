"""A fit does not end where an effect vanishes, though another start explains the recordings."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rig.campaign import make_campaign

from lostmotion.discover import fit_model
from lostmotion.drives import read_drive
from lostmotion.recordings import read_campaign


@pytest.mark.parametrize("seed", [901, 906])
def test_an_effect_of_one_noise_is_fitted(seed: int, tmp_path: Path) -> None:
    made = make_campaign(seed, seed % 8, {"lobe_eccentricity": 1.0}, "third")
    truth = made.write(tmp_path, "lobes", None)
    drive = read_drive(tmp_path / "lobes.toml")
    campaign = read_campaign(tmp_path / "lobes.csv.gz", ratio=drive.ratio)
    without, fitted = fit_model(drive, campaign, "lobe_eccentricity").ladder
    noise = truth["noise_arcsec_rms"]
    # Runs differ as well, so neither is at the noise; the effect itself is of one noise.
    explained = without["rms_arcsec"] ** 2 - fitted["rms_arcsec"] ** 2
    assert explained > 0.5 * noise**2, (without["rms_arcsec"], fitted["rms_arcsec"], noise)
