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


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_a_take_up_below_the_steps_of_the_load_is_found(seed: int, tmp_path: Path) -> None:
    """Hardly a sample lies within the take-up, so the error depends on it in few places."""

    def narrow_gap(columns: dict[str, np.ndarray], wound: np.ndarray) -> np.ndarray:
        return 0.6 * (columns["temperature"] - 20.0) * np.tanh(wound / 0.02)

    recorded = small_campaigns.campaign(seed=seed, add=narrow_gap)
    for run in recorded.runs:
        run.columns = {name: values[1::10] for name, values in run.columns.items()}
    (tmp_path / "small.toml").write_text(small_campaigns.DRIVE)
    fitted = fit_model(read_drive(tmp_path / "small.toml"), recorded, "thermal_gap")
    (term,) = fitted.base.terms
    takeup_Nm = dict(zip((v.name for v in term.effect.values), term.values, strict=True))[
        "takeup_Nm"
    ]
    assert 0.02 / 4 < takeup_Nm < 0.02 * 4
