"""Encoders: whole turns that were lost, put back where the recording tells them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from lostmotion.recordings.campaign import Campaign
from lostmotion.recordings.findings import Finding

FloatArray = npt.NDArray[np.float64]

WRAP_SLACK = 0.25
"""How far from a whole turn, in turns, a step may be and still be an encoder that wrapped."""

FOLLOWED_SLACK = WRAP_SLACK / 4
"""How far a step of the input usually is from the output's times the ratio at most, in turns.

13 arcmin of the output at a ratio of 100: another ratio, or another shaft, is further off."""


def unwrap(angle_rad: FloatArray) -> tuple[FloatArray, int]:
    """Put back the whole turns that a wrapping encoder lost.

    A step near whole turns counts as a wrap when the usual step is below a quarter turn. Where the
    recording spans no more than one turn, the usual step is taken after putting the turns back,
    because an encoder that rests at its seam wraps all the time. Faster recordings are left alone:
    there a wrap cannot be told from motion.

    Returns
    -------
    angle_rad : ndarray
        The same array when nothing wrapped.
    wraps : int
        Number of wraps found.
    """
    turn = 2 * np.pi
    step = np.diff(angle_rad)
    turns = np.round(step / turn)
    remainder = np.abs(step - turns * turn)
    wrapped = (turns != 0) & (remainder < WRAP_SLACK * turn)
    count = int(np.count_nonzero(wrapped))
    if count == 0:
        return angle_rad, 0
    within_one_turn = np.ptp(angle_rad) <= turn * (1 + 1e-9)
    usual = np.median(remainder if within_one_turn else np.abs(step))
    if usual > WRAP_SLACK * turn:
        return angle_rad, 0
    lost = np.concatenate(([0.0], np.cumsum(np.where(wrapped, turns, 0.0))))
    return angle_rad - lost * turn, count


def unwrap_known(angle_rad: FloatArray) -> tuple[FloatArray, int]:
    """Unwrap the samples that have a number."""
    known = np.isfinite(angle_rad)
    whole = angle_rad.copy()
    whole[known], wraps = unwrap(angle_rad[known])
    return (whole, wraps) if wraps else (angle_rad, 0)


def follow_output(input_rad: FloatArray, output_rad: FloatArray, ratio: float) -> FloatArray:
    """Put back the turns of the input that only the output tells, where it moves too fast to tell.

    Where the input usually makes more than a quarter turn from sample to sample every step is
    looked at, otherwise those above a quarter turn: a tooth that is jumped is no wrap. The same
    array is returned where there is nothing to do, or the output goes another way than the input
    over the ratio.
    """
    turn = 2 * np.pi
    step, expected = np.diff(input_rad), ratio * np.diff(output_rad)
    if step.size == 0:
        return input_rad
    turns = np.round((step - expected) / turn)
    off = np.abs(step - expected - turns * turn)
    fast = np.median(np.abs(expected)) > WRAP_SLACK * turn
    doubtful = np.ones(step.size, dtype=bool) if fast else np.abs(step) > WRAP_SLACK * turn
    missed = doubtful & (turns != 0) & (off < WRAP_SLACK * turn)
    if not np.any(missed) or np.median(off) > FOLLOWED_SLACK * turn:
        return input_rad
    return input_rad - turn * np.concatenate(([0.0], np.cumsum(np.where(missed, turns, 0.0))))


def open_steps(angle_rad: FloatArray) -> int:
    """Count the steps above a quarter turn where they are usual and the angle is within a turn."""
    turn = 2 * np.pi
    known = angle_rad[np.isfinite(angle_rad)]
    step = np.abs(np.diff(known))
    if step.size == 0 or np.ptp(known) > turn or np.median(step) <= WRAP_SLACK * turn:
        return 0
    return int(np.count_nonzero(step > WRAP_SLACK * turn))


def bring_together(campaign: Campaign, ratio: float | None) -> None:
    """Put back the whole turns of the input by which runs begin apart from the first one.

    An encoder that knows one turn begins every run within it, wherever the output stands. A run
    whose lost motion was recorded, and not taken from the angles, is left alone.
    """
    if ratio is None or any(f.kind in ("stuck", "ratio") for f in campaign.findings):
        return
    turn = 2 * np.pi
    first: float | None = None
    for run in campaign.runs:
        if not {"input_angle", "output_angle"} <= run.columns.keys():
            continue
        angle, out = run.columns["input_angle"], run.columns["output_angle"]
        if open_steps(angle) or not np.array_equal(run.lost_motion_rad, out - angle / ratio):
            continue
        middle = float(np.median(run.lost_motion_rad))
        first = middle if first is None else first
        turns = round((middle - first) * ratio / turn)
        if turns == 0:
            continue
        run.columns["input_angle"] = angle + turns * turn
        run.columns["lost_motion"] = out - run.columns["input_angle"] / ratio
        action = "begins whole turns from the first run, by the output: put back"
        campaign.findings.append(
            Finding("wrap", run.file, "input_angle_rad", run.label, abs(turns), action)
        )
