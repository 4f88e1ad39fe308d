"""Scale: lost motion with the shape but not the size of that of the drive file."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.recordings.campaign import Campaign
from lostmotion.recordings.findings import Finding

SCALE_DOUBT = 10.0
"""Factor between measured and predicted lost motion, either way, that indicates a different drive.
"""

SCALE_SHARE = 0.5
"""Least share of the lost motion that its own curve must explain for a meaningful scale."""

TINY = float(np.finfo(np.float64).tiny)
"""Below it the ratio of two sums has no meaning."""

MISTAKEN = (
    (math.pi / 180, "degrees read as radians"),
    (math.pi / 10_800, "arc minutes read as radians"),
    (math.pi / 648_000, "arc seconds read as radians"),
    (1e-3, "N mm read as N m, or mrad as rad"),
)
"""Units that are often confused: their size in the assumed unit."""


def check_scale(campaign: Campaign, expected: Callable[[FloatArray], FloatArray]) -> None:
    """Report a lost motion with the shape, but by far not the size, of the drive file's.

    Parameters
    ----------
    campaign : Campaign
        Receives a finding.
    expected : callable
        Lost motion in rad of the drive file at torques in N m.
    """
    if any(finding.kind in ("sign", "stuck", "scale", "ratio") for finding in campaign.findings):
        return
    measured, model = [], []
    for run in campaign.runs:
        curve = expected(run.torque_Nm)
        model.append(curve - float(np.mean(curve)))
        measured.append(run.lost_motion_rad - float(np.mean(run.lost_motion_rad)))
    x, y = np.concatenate(model), np.concatenate(measured)
    both, across, up = float(x @ y), float(x @ x), float(y @ y)
    if across == 0 or both <= 0 or both * both < SCALE_SHARE * across * up:
        return
    times = max(both / across, TINY)
    if 1 / SCALE_DOUBT < times < SCALE_DOUBT:
        return
    # A torque in N mm makes the model's curve larger, an angle in degrees the measured one.
    off = abs(math.log(times))
    size, name = min(MISTAKEN, key=lambda one: abs(off + math.log(one[0])))
    hint = f", about the factor of {name}" if abs(off + math.log(size)) < math.log(2) else ""
    campaign.findings.append(
        Finding(
            "scale",
            campaign.runs[0].file,
            "lost_motion_rad",
            None,
            campaign.rows,
            f"measured lost motion is {times:.3g} times the model's{hint}: check the units of the "
            "columns and of the drive file",
        )
    )
