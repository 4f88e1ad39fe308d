"""Consistency check of recordings and drive file, for commands, pages and Python."""

from __future__ import annotations

from lostmotion.drives import Drive
from lostmotion.model import make_torsion_curve
from lostmotion.recordings import Campaign, check_scale
from lostmotion.recordings.gate import check_gate
from lostmotion.torsion_curve import TorsionCurve


def hold_against(campaign: Campaign, drive: Drive) -> TorsionCurve:
    """Check recordings against a drive file; return its torsion curve up to their torque.

    Recordings that differ from the file by a large factor get a finding.

    Raises
    ------
    InputError
        If torque or lost motion is constant, or if recordings and drive file contradict each other;
        with the correction.
    """
    campaign.require_variation()
    check_gate(
        campaign,
        lambda largest: make_torsion_curve(drive, largest),
        drive_file=drive.file,
        ratio=drive.ratio,
        rated_torque_Nm=drive.rated_torque_Nm,
        catalogue=drive.document.get("catalogue", {}),
    )
    torsion_curve = make_torsion_curve(drive, campaign.largest_torque_Nm)
    check_scale(campaign, torsion_curve)
    return torsion_curve
