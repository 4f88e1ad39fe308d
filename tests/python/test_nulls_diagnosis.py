"""The whole diagnosis and the fit without a missing effect, under noise of several kinds.

How often whole campaigns are called incomplete is measured by `benchmarks/bench_diagnosis.py`.
"""

from __future__ import annotations

import numpy as np
import pytest
from nulls import fewest, most
from scipy import stats
from scipy.signal import lfilter
from small_campaigns import DRIVE, RATED_NM, RATIO, campaign

from lostmotion.discover import diagnose
from lostmotion.discover.fitted_model import fit_model
from lostmotion.drives import parse_drive, tomllib
from lostmotion.recordings import Campaign

ARCSEC = np.pi / 180 / 3600
RUNS, ROWS = 9, 240


def with_noise(seed: int, kind: str) -> Campaign:
    """A clean campaign with noise other than white Gaussian."""
    data = campaign(seed=seed, runs=RUNS, rows=ROWS, noise=0.0)
    rng = np.random.default_rng(seed + 1000)
    for run in data.runs:
        noise = rng.normal(size=ROWS)
        if kind == "coloured":
            noise = lfilter([1.0], [1.0, -0.9], noise) * np.sqrt(1 - 0.9**2)
        elif kind == "long tails":
            noise = rng.standard_t(3, ROWS) / np.sqrt(3)
        elif kind == "louder in some runs":
            noise *= rng.choice((0.5, 2.0))
        run.columns["lost_motion"] = run.columns["lost_motion"] + noise * ARCSEC
    return data


@pytest.mark.parametrize("kind", ["coloured", "long tails", "louder in some runs"])
def test_noise_of_another_kind_names_nothing(kind: str) -> None:
    for seed in (31, 32):
        found = diagnose(None, with_noise(seed, kind), ratio=RATIO, rated_torque_Nm=RATED_NM)
        assert found.effects == [], (seed, found.verdict)
        assert found.events == [], seed


def test_standard_errors_of_a_fit_are_what_they_state() -> None:
    # Nothing depends on temperature: the fitted value is noise and scatter, and its error has to be
    # their size.
    drive = parse_drive(tomllib.loads(DRIVE), "drive.toml")
    trials, outside = 14, 0
    limit = stats.t.isf(0.05, RUNS - 3)
    for seed in range(trials):
        data = campaign(seed=seed, runs=RUNS, rows=ROWS)
        model = fit_model(drive, data, ["thermal_stiffness"])
        place = [i for i, name in enumerate(model.names) if name.startswith("thermal_stiffness.")]
        value, error = model.values[place[0]], model.standard_errors[place[0]]
        outside += abs(value) > limit * error
    assert fewest(trials, 0.1) <= outside <= most(trials, 0.1)
