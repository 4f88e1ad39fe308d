"""Recordings of independent laboratories are sound: reading them finds nothing to say."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import pytest

from lostmotion.drives import read_drive
from lostmotion.hold_against import hold_against
from lostmotion.recordings import read_campaign

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rig.laboratory import HIDEABLE, PROTOCOLS, Laboratory
from rig.laws import LAWS


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_a_sound_campaign_has_no_finding(protocol: str, tmp_path: Path) -> None:
    """With an effect, whatever the law of friction; also without a ratio."""
    for number in range(2):
        seed = 300 + 2 * len(protocol) + number
        law, effects = LAWS[seed % len(LAWS)], HIDEABLE[protocol]
        folder = tmp_path / str(number)
        Laboratory(seed, law, protocol).write(folder, effects[seed % len(effects)], 1.0)
        files, drive = sorted(folder.glob("*.csv.gz")), read_drive(folder / "drive.toml")
        campaign = read_campaign(files, ratio=drive.ratio)
        hold_against(campaign, drive)
        assert not campaign.findings
        read_campaign(files, ratio=math.inf)


def test_runs_that_stick_and_lean_are_in_no_other_unit(tmp_path: Path) -> None:
    """Two runs of an arm are three times as stiff, not nine times as in a pound-force inch."""
    Laboratory(93, "dahl", "arm").write(tmp_path, "output_eccentricity", 2.0)
    drive = read_drive(tmp_path / "drive.toml")
    assert not read_campaign(sorted(tmp_path.glob("*.csv.gz")), ratio=drive.ratio).findings
