"""Results of reading the generated logs of two encoders."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from lostmotion.errors import InputError
from lostmotion.recordings import Campaign, read_campaign

from .two_encoders import TURN, continuous, is_wrapped, wrapped

COLUMNS = {
    "input_angle": "input_angle_rad",
    "output_angle": "output_angle_rad",
    "torque": "torque_Nm",
    "lost_motion": "lost_motion_rad",
}


def changed(seed: int, folder: Path) -> str:
    """Describe changes of a continuous log by reading; empty if no bit changes."""
    log = continuous(seed)
    try:
        campaign = read_campaign(log.write(folder), ratio=log.ratio)
    except InputError as error:
        return f"{log.about}: refused: {error}"
    if campaign.rows != len(log.run):
        return f"{log.about}: {len(log.run) - campaign.rows} rows fewer; {_said(campaign)}"
    for quantity, column in COLUMNS.items():
        if not np.array_equal(campaign.column(quantity), getattr(log, column)):
            return f"{log.about}: {quantity} is another; {_said(campaign)}"
    return ""


def misread(seed: int, folder: Path) -> str | None:
    """Describe the error of reading a wrapped log; None if it is not wrapped.

    Correct results: the lost motion of the log without wraps, except for one shift per run, with a
    finding; a refusal that names the angles; or both readings, stated for each run that is wrong.
    """
    clean, log = continuous(seed), wrapped(seed)
    if not is_wrapped(log, clean):
        return None
    try:
        campaign = read_campaign(log.write(folder), ratio=log.ratio, mapping=log.mapping)
    except InputError as error:
        return "" if "angle" in str(error) else f"{log.about}: refused: {error}"
    kinds = {finding.kind for finding in campaign.findings}
    open_runs = {
        finding.run
        for finding in campaign.findings
        if finding.kind == "jump" or "neither the ratio" in finding.action
    }
    if campaign.rows != len(log.run):
        short = {
            run.label for run in campaign.runs if len(run) != np.count_nonzero(log.run == run.label)
        }
        if short <= open_runs:
            return ""
        return f"{log.about}: {len(log.run) - campaign.rows} rows fewer; {_said(campaign)}"
    shift = campaign.column("lost_motion") - clean.lost_motion_rad
    count_rad = TURN / log.per_turn if log.per_turn else 0.0
    rounded = 1.001 * max(count_rad / abs(log.ratio), 1e-9 * TURN)
    wrong = {label for label in np.unique(log.run) if np.ptp(shift[log.run == label]) > rounded}
    right = not wrong
    if wrong <= open_runs and (wrong or "wrap" in kinds):
        return ""
    return f"{log.about}: {'nothing said' if right else 'wrong'}; {_said(campaign)}"


def _said(campaign: Campaign) -> str:
    return "; ".join(str(finding).partition(": ")[2] for finding in campaign.findings)[:400]


def two_encoders_table(logs: int) -> int:
    """Print the results of reading a number of logs, unchanged and wrapped; 1 if there are
    errors."""
    wrong = []
    for judge in (changed, misread):
        with tempfile.TemporaryDirectory() as folder:
            said = [judge(seed, Path(folder)) for seed in range(logs)]
        told = [line for line in said if line is not None]
        wrong += [line for line in told if line]
        print(f"{judge.__name__}: {sum(map(bool, told))} of {len(told)}")
    print("\n".join(wrong))
    return 1 if wrong else 0
