"""A fit does not end where an effect vanishes, or at a kink, if other values fit better."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import small_campaigns

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rig.campaign import make_campaign

from lostmotion.discover import fit_model
from lostmotion.discover.linearise import plain_rms
from lostmotion.discover.stepwise_fit import scanned
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


def test_a_scan_leaves_a_take_up_on_which_the_error_does_not_depend(tmp_path: Path) -> None:
    def gap(columns: dict[str, np.ndarray], wound: np.ndarray) -> np.ndarray:
        return 0.6 * (columns["temperature"] - 20.0) * np.tanh(wound / 2.0)

    recorded = small_campaigns.campaign(add=gap)
    (tmp_path / "small.toml").write_text(small_campaigns.DRIVE)
    base = fit_model(read_drive(tmp_path / "small.toml"), recorded, "thermal_gap").base
    (term,) = base.terms
    place = [value.name for value in term.effect.values].index("takeup_Nm")
    found_Nm, least = term.values[place], plain_rms(base)
    term.values[place] = 0.001
    back = scanned(base)
    assert back.terms[0].values[place] == pytest.approx(found_Nm, rel=0.15)
    assert plain_rms(back) < 1.01 * least < plain_rms(base)


def test_a_gap_is_taken_up_within_the_soft_range_of_a_drive(tmp_path: Path) -> None:
    """What the rated torque hardly closes is a stiffness: a bound keeps the two apart."""

    def softer(columns: dict[str, np.ndarray], wound: np.ndarray) -> np.ndarray:
        return 0.3 * (columns["temperature"] - 20.0) * np.clip(wound / 34.0, -1.0, 1.0)

    sheet = tmp_path / "drive.toml"
    sheet.write_text(small_campaigns.DRIVE)
    fitted = fit_model(read_drive(sheet), small_campaigns.campaign(add=softer), "thermal_gap")
    assert fitted.params["thermal_gap.takeup_Nm"].value <= 0.54 * small_campaigns.RATED_NM
