"""The other drives of the demonstration: from data sheets, drawings and recordings."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lostmotion.compare import Comparison, compare
from lostmotion.drives import Drive, read_drive
from lostmotion.model import design_model
from lostmotion.predict import Prediction, predict
from lostmotion.recordings import read_campaign
from lostmotion.report import Section, comparison_section, drive_section
from lostmotion.units import ARCMIN

DRIVES = ("size_25.toml", "reference_a.toml", "external_ring.toml")
MEASURED = Path("cycloidal_locked_output")
RECORDING = "base_onyx_runin5.csv"


@dataclass
class OtherDrives:
    """Results of the other drives.

    Attributes
    ----------
    drives : list of (Drive, dict)
        Each with its prediction at the rated torque.
    smallest_gap_arcmin : list of float or None
        One per drive; None for a catalogue drive.
    """

    drives: list[tuple[Drive, Prediction]]
    smallest_gap_arcmin: list[float | None]
    measured: Drive
    comparison: Comparison
    sections: list[Section]


def look_at_drives(folder: Path) -> OtherDrives:
    """Predict the drives and compare the measured one with its recordings."""
    drives, gaps, sections = [], [], []
    for name in DRIVES:
        drive = read_drive(folder / "drives" / name)
        rated = drive.rated_torque_Nm
        drives.append((drive, predict(drive, np.array([-rated, 0.0, rated]))))
        gaps.append(smallest_gap(drive))
        sections.append(drive_section(drive))
    measured = read_drive(folder / MEASURED / "drive.toml")
    recording = folder / MEASURED / RECORDING
    campaign = read_campaign([recording], ratio=measured.ratio, mapping=measured.columns)
    result = compare(measured, campaign)
    sections.append(comparison_section(measured, result, [recording]))
    return OtherDrives(drives, gaps, measured, result, sections)


def smallest_gap(drive: Drive) -> float | None:
    """Smallest side clearance of a design over all angles and phases, in arcmin."""
    if drive.design is None:
        return None
    checks = {check.name: check.value for check in design_model(drive).checks()}
    return checks["smallest_gap"] / ARCMIN
