"""The ratio of a drive estimated from turning runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.recordings.campaign import Campaign, Run
from lostmotion.recordings.soundness import STUCK_TURN_RAD

TURNING_SHARE = 0.98
"""Share of the input's motion that the output must explain for its ratio to be known."""

JUMP = 10.0
"""Steps of an angle above this multiple of their 90 % quantile are wraps, not motion."""

STEPS_LEAST = 10
"""Least number of samples of a run that turns."""

ALIKE = 0.01
"""Runs whose ratio differs by more than this share from their median lost turns, or are of another
shaft."""


@dataclass(frozen=True)
class Turns:
    """Rotation of the angles of a run in rad, and that of the input for the output's rotation."""

    slope: float
    swing_in: float
    swing_out: float


def measured_ratio(run: Run) -> Turns | None:
    """Measure the ratio of the rotations of a run; None if they do not turn together.

    By regression of the output, which contains the lost motion, over the input.

    Wraps that were not restored because of a wrong ratio are excluded steps. Where a drive stands
    most of the time its moves are also long steps: they are excluded only if the rest of the
    motion agrees better without them.
    """
    if not {"input_angle", "output_angle"} <= run.columns.keys() or len(run) < STEPS_LEAST:
        return None
    step_in, step_out = (np.diff(run.columns[q]) for q in ("input_angle", "output_angle"))
    calm = np.ones(step_in.size, dtype=bool)
    for step in (step_in, step_out):
        calm &= np.abs(step) <= JUMP * float(np.quantile(np.abs(step), 0.9))
    share, turns = max(
        (turning_together(step_in[kept], step_out[kept]) for kept in (calm, slice(None))),
        key=lambda found: found[0],
    )
    return turns if share >= TURNING_SHARE else None


def turning_together(step_in: FloatArray, step_out: FloatArray) -> tuple[float, Turns]:
    """Share of the input's motion that the output explains, and the rotations."""
    x, y = np.cumsum(step_out), np.cumsum(step_in)
    x, y = x - x.mean(), y - y.mean()
    both, across, up = float(x @ y), float(x @ x), float(y @ y)
    if both == 0:
        return 0.0, Turns(0.0, 0.0, 0.0)
    return both**2 / (across * up), Turns(up / both, float(np.ptp(y)), float(np.ptp(x)))


def estimate_ratio(campaign: Campaign) -> float | None:
    """Input turns for one output turn, signed, from turning runs; None if there are none.

    Lost motion proportional to the rotation is included. Longer rotations have more weight. If one
    encoder is dead for a while, only steps in which both move are used.
    """
    measured = [turns for run in campaign.runs if (turns := measured_ratio(run)) is not None]
    turning = [
        turns for turns in measured if min(turns.swing_in, turns.swing_out) >= STUCK_TURN_RAD
    ]
    if turning:
        slopes = np.array([turns.slope for turns in turning])
        usual = float(np.median(slopes))
        alike = np.abs(slopes - usual) <= ALIKE * abs(usual)
        weight = np.where(alike, [turns.swing_in**2 for turns in turning], 0.0)
        ratio = float(np.sum(weight * slopes) / weight.sum()) if weight.any() else usual
    else:
        found = [slope for run in campaign.runs if (slope := slope_of_steps(run)) is not None]
        ratio = float(np.median(found)) if found else 0.0
    return ratio if abs(ratio) >= 1.0 else None


def slope_of_steps(run: Run) -> float | None:
    """Ratio of the usual steps of input and output where both move; None if nothing turns."""
    if not {"input_angle", "output_angle"} <= run.columns.keys():
        return None
    put_in, out = run.columns["input_angle"], run.columns["output_angle"]
    step_in, step_out = np.diff(put_in), np.diff(out)
    moving = (step_in != 0) & (step_out != 0)
    if np.ptp(out) < STUCK_TURN_RAD or not moving.any():
        return None
    return float(np.median(step_in[moving] / step_out[moving]))
