"""Pairs of effects of the rig of which one differs between few runs: no scatter of the runs."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rig.suites import write_suite

from lostmotion.discover import diagnose
from lostmotion.drives import read_drive
from lostmotion.recordings import read_campaign


@pytest.mark.parametrize(
    ("skip", "pair"),
    [
        (17, ["thermal_friction", "torque_offset"]),  # three of 31 runs are at other temperatures
        (6, ["sensor_lag", "stiffness_modulation"]),  # only the fast runs show the lag
    ],
)
def test_both_effects_are_named_though_few_runs_show_one(
    skip: int, pair: list[str], tmp_path: Path
) -> None:
    (truth,) = write_suite(
        "pair", 1, "develop", tmp_path, twins=False, report=lambda _: None, skip=skip
    )
    assert sorted(truth["effects"]) == pair
    drive = read_drive(tmp_path / f"{truth['name']}.toml")
    campaign = read_campaign(tmp_path / f"{truth['name']}.csv.gz", ratio=drive.ratio)
    found = diagnose(drive, campaign)
    assert sorted(found.effects) == pair
    # The rig modulates the stiffness without the gap, the library the whole angle.
    remains = sum(float(shape["rms_arcsec"]) for shape in found.unexplained["depends_on"])
    assert remains < 0.15 * truth["noise_arcsec_rms"]
    assert found.ladder[-1]["rms_arcsec"] < 1.05 * truth["noise_arcsec_rms"]
