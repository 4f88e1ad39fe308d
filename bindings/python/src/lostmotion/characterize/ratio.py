"""The ratio of a drive as its recordings tell it, where a run turns."""

from __future__ import annotations

import numpy as np

from lostmotion.recordings import Campaign, Run
from lostmotion.recordings.soundness import STUCK_TURN_RAD

ANGLES = {"input_angle", "output_angle"}


def needs_ratio(campaign: Campaign, ratio: float) -> bool:
    """Whether the lost motion was taken from two angles with a ratio, and the input moved."""
    return any(
        run.columns.keys() >= ANGLES and taken_from_angles(run, ratio) and moved(run, "input_angle")
        for run in campaign.runs
    )


def taken_from_angles(run: Run, ratio: float) -> bool:
    """Whether the lost motion is the output angle less the input angle over a ratio."""
    expected = run.columns["output_angle"] - run.columns["input_angle"] / ratio
    return bool(np.array_equal(run.lost_motion_rad, expected))


def moved(run: Run, quantity: str) -> bool:
    """Whether an angle was not the same all along."""
    return bool(np.ptp(run.columns[quantity]) > 0)


def ratio_of_turning_runs(campaign: Campaign) -> float | None:
    """Input turns for one output turn, signed, by regression over the runs that turn.

    Every run has an offset of its own. What of the lost motion is in proportion to the turn is in
    the ratio. None where no run turns by more than a drive could wind up.
    """
    products = squares = 0.0
    for run in campaign.runs:
        if not run.columns.keys() >= ANGLES:
            continue
        turned, out = run.columns["input_angle"], run.columns["output_angle"]
        if np.ptp(out) < STUCK_TURN_RAD or np.ptp(turned) < STUCK_TURN_RAD:
            continue
        centred = turned - turned.mean()
        products += float(centred @ (out - out.mean()))
        squares += float(centred @ centred)
    return squares / products if products != 0 and abs(squares / products) > 1 else None
