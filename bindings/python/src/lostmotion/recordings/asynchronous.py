"""Asynchronous channels: channels of several clocks that were joined row by row.

A channel that was joined by its last value repeats it until the next value. If one angle is
delayed, the lost motion follows the speed instead of the torque.
"""

from __future__ import annotations

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.recordings.campaign import Campaign, Run
from lostmotion.recordings.encoders import count_rad
from lostmotion.recordings.findings import Finding
from lostmotion.recordings.quantities import QUANTITIES
from lostmotion.recordings.soundness import STUCK_TURN_RAD

MOVES_WITH = {
    "torque": "lost_motion",
    "lost_motion": "torque",
    "input_angle": "output_angle",
    "output_angle": "input_angle",
}
"""Channels that a clock may hold, and what moves with each while the drive moves."""

REGULAR_SHARE = 0.8
"""A clock causes the sections without a new value if at least this share of the new values lies
within one row of equal intervals over the whole run; with coarse counts the intervals follow the
speed, and at a constant speed most steps between two values are one count.
"""

MOVED_WITHIN = 0.5
"""Least movement of the other channel within the sections, over that between them, with which a
channel is held: half of the least that a clock gives, 1 with a new value every second row. At
stations, at which the torque really stands, the other channel moves between the sections only.
"""

STRETCHES_LEAST = 10
"""Least number of sections of a run that identify a clock."""

LAG_SHARE = 0.95
"""A lag is reported if the speed explains at least this share of the lost motion ..."""

LAG_OVER_SIGN = 0.05
"""... which exceeds by this the share that the direction of rotation alone explains, as with
friction, ..."""

LAG_STEPS = 0.5
"""... and the lag is at least this number of samples: viscous friction over stiffness is some 0.1
ms."""


def leave_out_repeated(campaign: Campaign) -> None:
    """Leave out the rows in which a channel with a slower clock repeats its value."""
    for run in campaign.runs:
        recorded = [name for name in MOVES_WITH if name in run.columns]
        if "input_angle" in recorded:
            recorded.remove("lost_motion")  # it follows from the angles
        clocks = {name: clock_of(run.columns[name]) for name in recorded}
        quickest = min((length for length in clocks.values() if length), default=0)
        repeated = np.zeros(len(run), dtype=bool)
        for name, length in clocks.items():
            if length > max(quickest, 1) and moves_on(run, name):
                rows = np.diff(run.columns[name], prepend=np.nan) == 0
                repeated |= rows
                action = (
                    f"a new value every {length} rows, of others every {quickest}: joined by "
                    "holding its last value; rows that repeat it left out"
                )
                column, count = QUANTITIES[name].column, int(np.count_nonzero(rows))
                finding = Finding("repeats", run.file, column, run.label, count, action)
                campaign.findings.append(finding)
        if repeated.any() and not repeated.all():
            run.leave_out(repeated)


def moves_on(run: Run, name: str) -> bool:
    """Whether the drive moves while a channel repeats its value: a clock holds it, not the plan."""
    moved = run.columns.get(MOVES_WITH[name])
    if moved is None:
        return False
    first = np.flatnonzero(np.diff(run.columns[name])) + 1
    within = moved[first[1:] - 1] - moved[first[:-1]]
    between = moved[first] - moved[first - 1]
    return float(np.abs(within).sum()) >= MOVED_WITHIN * float(np.abs(between).sum())


def check_asynchronous(campaign: Campaign) -> None:
    """Report angles that are not simultaneous."""
    lags = [(run, lag) for run in campaign.runs if (lag := lag_of(run)) is not None]
    for run, lag in lags:
        action = (
            f"proportional to the speed, as if the output angle were {1e3 * lag:.3g} ms later than "
            "the input angle: join the two on their own time stamps"
        )
        column = QUANTITIES["lost_motion"].column
        campaign.findings.append(Finding("lag", run.file, column, run.label, len(run), action))


def clock_of(values: FloatArray) -> int:
    """Rows from one new value to the next; 0 if no clock is visible."""
    step = np.diff(values)
    new = np.flatnonzero(step)
    if new.size < STRETCHES_LEAST:
        return 0
    lengths = np.diff(new)
    usual = int(np.median(lengths))
    if usual == 1:
        return 1 if float(np.mean(lengths == 1)) >= REGULAR_SHARE else 0
    ticks = np.append(0, np.cumsum(np.rint(lengths / usual)))
    late = new - np.polyval(np.polyfit(ticks, new, 1), ticks)
    regular = float(np.mean(np.abs(late - np.median(late)) <= 1))
    count = count_rad(values)
    counts = count is not None and round(float(np.median(np.abs(step[new]))) / count) <= 1
    return usual if regular >= REGULAR_SHARE and not counts else 0


def lag_of(run: Run) -> float | None:
    """Delay of the output angle relative to the input angle in s; None if there is none.

    The error of a delayed angle is the delay times the speed.
    """
    if not {"input_angle", "output_angle"} <= run.columns.keys() or len(run) < STRETCHES_LEAST:
        return None
    angle, time_s = run.columns["output_angle"], run.time_s
    if np.ptp(angle) < STUCK_TURN_RAD or np.any(np.diff(time_s) <= 0):
        return None
    speed = np.gradient(angle, time_s)
    lost = run.lost_motion_rad
    share, slope = share_explained(speed, lost)
    if share < LAG_SHARE or share < share_explained(np.sign(speed), lost)[0] + LAG_OVER_SIGN:
        return None
    return -slope if abs(slope) >= LAG_STEPS * float(np.median(np.diff(time_s))) else None


def share_explained(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Share of one column that another explains, and the slope."""
    x, y = x - x.mean(), y - y.mean()
    across, up = float(x @ x), float(y @ y)
    if across == 0 or up == 0:
        return 0.0, 0.0
    return float(x @ y) ** 2 / (across * up), float(x @ y) / across
