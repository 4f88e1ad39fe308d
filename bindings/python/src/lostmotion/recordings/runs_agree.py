"""Runs of one drive agree: no run has another sign or unit than the others.

A run that was logged with a reversed sign, or in another unit, has a torsion curve that no drive
with the curve of the other runs can have. It would spoil every fit, so it is refused. Only runs
that show a torsion curve are compared: the lost motion follows the torque.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lostmotion.errors import InputError
from lostmotion.recordings.campaign import Campaign, Run
from lostmotion.recordings.wild import PLAUSIBLE

CURVE_SHARE = 0.5
"""Least share of the variance of the lost motion of a run that is linear in the torque: half, as
for the scale of a drive file (`scale.SCALE_SHARE`)."""

SWING_SHARE = 0.25
"""Least swing of the torque of a run relative to the median of the runs: the ripple of a constant
load may correlate with the lost motion in either sense. Chosen."""

UNIT_FACTOR = 30.0
"""Ratio of two compliances at the same load that no wear, preload or temperature causes: as for a
drive file (`gate.UNIT_FACTOR`)."""

LOAD_FACTOR = 60.0
"""Ratio of two loads that no plan has: the lost motion is measured at 3 or 4 % of the rated torque,
which is 33 times smaller. Chosen: twice that."""

LOAD_SAME = 3.0
"""Up to this ratio two loads, or two lost motions, count as alike. Chosen."""


@dataclass(frozen=True)
class Loop:
    """The torsion curve of a run in three numbers.

    Attributes
    ----------
    run : Run
    slope : float
        rad/Nm, by least squares.
    torque, lost : float
        Standard deviations, in Nm and rad.
    """

    run: Run
    slope: float
    torque: float
    lost: float


def loops_of(campaign: Campaign) -> list[Loop]:
    """Runs in which the lost motion follows the torque."""
    found = []
    for run in campaign.runs:
        torque = run.torque_Nm - run.torque_Nm.mean()
        lost = run.lost_motion_rad - run.lost_motion_rad.mean()
        across, up = float(np.std(torque)), float(np.std(lost))
        if not (across > 0 and up > 0):
            continue
        share = float(np.mean((torque / across) * (lost / up)))
        if share**2 >= CURVE_SHARE:
            found.append(Loop(run, share * up / across, across, up))
    swing = float(np.median([loop.torque for loop in found])) if found else 0.0
    return [loop for loop in found if loop.torque >= SWING_SHARE * swing]


def check_runs_agree(campaign: Campaign) -> None:
    """Refuse runs whose sign or unit differs from that of the other runs.

    Raises
    ------
    InputError
        Names the runs and the column.
    """
    check_temperatures(campaign)
    if any(finding.kind in ("stuck", "ratio") for finding in campaign.findings):
        return
    loops = loops_of(campaign)
    if len(loops) < 2:
        return
    falling = [loop for loop in loops if loop.slope < 0]
    rising = [loop for loop in loops if loop.slope > 0]
    if falling and rising:
        few, many, way = (
            (falling, rising, "falls")
            if len(falling) <= len(rising)
            else (rising, falling, "rises")
        )
        refuse_loops(
            few,
            "lost_motion_rad",
            f"a lost motion that {way} with increasing torque in {runs_in_words(few)}, unlike in "
            f"{runs_in_words(many)}",
            "one sign of torque and angles in all runs",
        )
    torque = float(np.median([loop.torque for loop in loops]))
    lost = float(np.median([loop.lost for loop in loops]))
    for column, own, usual, other, other_usual in (
        ("torque_Nm", "torque", torque, "lost", lost),
        ("lost_motion_rad", "lost", lost, "torque", torque),
    ):
        least = LOAD_FACTOR if own == "torque" else UNIT_FACTOR
        for sign in (1, -1):
            odd = [
                loop
                for loop in loops
                if (getattr(loop, own) / usual) ** sign > least
                and 1 / LOAD_SAME < getattr(loop, other) / other_usual < LOAD_SAME
            ]
            if odd:
                times = getattr(odd[0], own) / usual
                what = "torque" if own == "torque" else "lost motion"
                beside = "lost motion" if own == "torque" else "torque"
                refuse_loops(
                    odd,
                    column,
                    f"a {what} {times:.3g} times that of the other runs, at the same {beside}, in "
                    f"{runs_in_words(odd)}",
                    "one unit in all runs",
                )


def check_temperatures(campaign: Campaign) -> None:
    """Refuse runs whose temperature no drive has, as of kelvin read as degrees Celsius."""
    most = PLAUSIBLE["temperature"][1]
    for run in campaign.runs:
        values = run.columns.get("temperature", np.zeros(0))
        values = values[np.isfinite(values)]
        if values.size and float(np.median(values)) > most:
            raise InputError(
                run.file,
                "temperature_C",
                f"{float(np.median(values)):.4g} C in run {run.label}",
                f"at most {most:g} C in a drive: temperature_K if it is in kelvin; or the "
                "recordings without this column",
            )


def runs_in_words(loops: list[Loop]) -> str:
    """Name runs in a message."""
    labels = [str(loop.run.label) for loop in loops]
    if len(labels) == 1:
        return f"run {labels[0]}"
    if len(labels) <= 3:
        return f"runs {', '.join(labels[:-1])} and {labels[-1]}"
    return f"{len(labels)} runs, {labels[0]} to {labels[-1]}"


def refuse_loops(loops: list[Loop], column: str, found: str, expected: str) -> None:
    """Refuse a campaign because of some of its runs."""
    raise InputError(
        loops[0].run.file,
        column,
        found,
        f"{expected}; or the recordings without {runs_in_words(loops)}",
    )
