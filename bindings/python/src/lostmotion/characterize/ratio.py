"""Whether figures from recordings need the ratio of the drive."""

from __future__ import annotations

import numpy as np

from lostmotion.recordings import Campaign, Run

ANGLES = {"input_angle", "output_angle"}


def needs_ratio(campaign: Campaign, ratio: float) -> bool:
    """Whether the lost motion was computed from two angles and the ratio while the input moved."""
    return any(
        run.columns.keys() >= ANGLES and taken_from_angles(run, ratio) and moved(run, "input_angle")
        for run in campaign.runs
    )


def taken_from_angles(run: Run, ratio: float) -> bool:
    """Whether the lost motion is the output angle less the input angle over a ratio."""
    expected = run.columns["output_angle"] - run.columns["input_angle"] / ratio
    return bool(np.array_equal(run.lost_motion_rad, expected))


def moved(run: Run, quantity: str) -> bool:
    """Whether an angle was not constant."""
    return bool(np.ptp(run.columns[quantity]) > 0)
