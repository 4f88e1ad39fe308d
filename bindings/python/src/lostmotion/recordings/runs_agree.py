"""Runs of one drive agree: no run has another sign or unit than the others, or no sign at all.

A run that was logged with a reversed sign, or in another unit, has a torsion curve that no drive
with the curve of the other runs can have. It would spoil every fit, so it is refused. Only runs
that show a torsion curve are compared: the lost motion follows the torque.

An error that depends on the output angle, such as an eccentricity, may reverse the slope of a
recording too, but not its hysteresis: friction dissipates work in every drive. So a sign counts as
reversed, or lost, only if the drive would return work.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lostmotion.errors import InputError
from lostmotion.recordings.campaign import Campaign, Run
from lostmotion.recordings.findings import Finding
from lostmotion.recordings.wild import PLAUSIBLE
from lostmotion.units import convert

FloatArray = npt.NDArray[np.float64]

LOST = "lost_motion_rad"

CURVE_SHARE = 0.5
"""Least share of the variance of the lost motion of a run that is linear in the torque: half, as
for the scale of a drive file (`scale.SCALE_SHARE`)."""

NO_CURVE_SHARE = 0.1
"""Largest share of the variance that is linear in the torque where one of the two lost its sign:
then the lost motion is even in the torque. Chosen."""

SAMPLES_LEAST = 30
"""Least number of samples of a run: with fewer, noise may correlate with the torque by chance; with
30, a share of half has a probability of 1e-5."""

ONE_SIDED = 0.02
"""Readings beyond zero, relative to the largest, that are the zero of a sensor. Chosen."""

NEAR_ZERO = 0.1
"""Torques up to this share of the largest give the lost motion at zero. Chosen."""

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
"""Up to this ratio two loads, or two lost motions, count as equal. Chosen."""


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
    width : float
        Mean width of the hysteresis, rad: dissipated work relative to the path of the torque.
    """

    run: Run
    slope: float
    torque: float
    lost: float
    width: float


def loops_of(campaign: Campaign) -> list[Loop]:
    """Runs in which the lost motion follows the torque."""
    found = []
    for run in campaign.runs:
        torque, lost = run.torque_Nm, run.lost_motion_rad
        if len(run) < SAMPLES_LEAST or linear_share(torque, lost) < CURVE_SHARE:
            continue
        torque = torque - torque.mean()
        slope = float(torque @ lost) / float(torque @ torque)
        width = dissipated_work(torque, lost) / float(np.sum(np.abs(np.diff(torque))))
        found.append(Loop(run, slope, float(np.std(torque)), float(np.std(lost)), width))
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
    note_fahrenheit(campaign)
    check_magnitudes(campaign)
    if any(finding.kind in ("stuck", "ratio") for finding in campaign.findings):
        return
    loops = loops_of(campaign)
    if len(loops) < 2:
        return
    falling = [loop for loop in loops if loop.slope < 0]
    rising = [loop for loop in loops if loop.slope > 0]
    few, many, way = (
        (falling, rising, "falls") if len(falling) <= len(rising) else (rising, falling, "rises")
    )
    usual = float(np.median([loop.width * np.sign(loop.slope) for loop in many]))
    reversed_runs = [loop for loop in few if loop.width * np.sign(loop.slope) > usual / LOAD_SAME]
    if usual > 0 and reversed_runs:
        refuse_loops(
            reversed_runs,
            LOST,
            f"a lost motion that {way} with increasing torque in {runs_in_words(reversed_runs)}, "
            f"unlike in {runs_in_words(many)}",
            "one sign of torque and angles in all runs",
        )
    if len(loops) == 2:  # two units: neither is that of the others
        return
    torque = float(np.median([loop.torque for loop in loops]))
    lost = float(np.median([loop.lost for loop in loops]))
    for column, own, usual, other, other_usual in (
        ("torque_Nm", "torque", torque, "lost", lost),
        (LOST, "lost", lost, "torque", torque),
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


def check_magnitudes(campaign: Campaign) -> None:
    """Refuse runs in which the torque or the lost motion has lost its sign."""
    for run in campaign.runs:
        torque, lost = run.torque_Nm, run.lost_motion_rad
        most = float(np.max(np.abs(torque)))
        if len(run) < SAMPLES_LEAST or not most > 0 or linear_share(torque, lost) > NO_CURVE_SHARE:
            continue
        one_sided = min(float(torque.max()), -float(torque.min())) <= ONE_SIDED * most
        zero = lost[np.abs(torque) <= NEAR_ZERO * most]
        if one_sided and zero.size:
            returned = returns_work(lost - np.median(zero), torque)
            lost = np.abs(lost - np.median(zero))
        else:
            returned = returns_work(torque, lost)
        if not one_sided and min(float(torque.max()), -float(torque.min())) < 0.5 * most:
            continue
        if linear_share(np.abs(torque), lost) >= CURVE_SHARE and returned:
            column, other = ("torque_Nm", "lost motion") if one_sided else (LOST, "torque")
            raise InputError(
                run.file,
                column,
                f"a magnitude without sign in run {run.label}: the {other} passes zero where it "
                "returns",
                "values with their sign; or the recordings without this run",
            )


def integral_over(along: FloatArray, over: FloatArray) -> float:
    """Integral of `over` d(`along`)."""
    return float(np.sum(np.diff(along) * (over[1:] + over[:-1]) / 2))


def dissipated_work(torque: FloatArray, lost: FloatArray) -> float:
    """Work that a drive dissipates from the first to the last time at the median torque, Nm rad.

    The integral of -lost motion d(torque) needs no closed loop, only the same torque at both ends.
    """
    above = torque > np.median(torque)
    at = np.flatnonzero(above[1:] != above[:-1])
    part = slice(at[0], at[-1] + 2) if at.size else slice(0)
    return -integral_over(torque[part], lost[part])


def returns_work(along: FloatArray, over: FloatArray) -> bool:
    """Whether the loop turns one way where `along` is positive, the other way where negative."""
    along, over = np.append(along, along[0]), np.append(over, over[0])
    halves = [integral_over(side(along, 0.0), over) for side in (np.fmax, np.fmin)]
    return halves[0] * halves[1] < 0 and min(np.abs(halves)) > max(np.abs(halves)) / LOAD_SAME


def linear_share(torque: FloatArray, lost: FloatArray) -> float:
    """Share of the variance of the lost motion that is linear in the torque."""
    across, up = float(np.std(torque)), float(np.std(lost))
    if not (across > 0 and up > 0):
        return 0.0
    return float(np.mean((torque - torque.mean()) / across * ((lost - lost.mean()) / up))) ** 2


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


def note_fahrenheit(campaign: Campaign) -> None:
    """Report runs whose temperature is far from that of all others, unless it is in Fahrenheit.

    As stated it is farther from the others than they are from each other; in Fahrenheit it would
    be among them. A plan of two temperatures may look the same, so nothing is changed.
    """
    known = {
        run.label: float(np.median(values[np.isfinite(values)]))
        for run in campaign.runs
        if (values := run.columns.get("temperature", np.zeros(0))).size
        and np.isfinite(values).any()
    }
    for run in campaign.runs:
        value = known.get(run.label, np.nan)
        others = [other for other in known.values() if other != value]
        if not others or not value - max(others) > max(others) - min(others):
            continue
        celsius = convert(value, "F", "C")
        if min(others) <= celsius <= max(others):
            action = (
                f"{value:.4g} C, and {min(others):.4g} to {max(others):.4g} C in the other runs: "
                f"if it is in Fahrenheit, it is {celsius:.4g} C"
            )
            campaign.findings.append(
                Finding("range", run.file, "temperature_C", run.label, len(run), action)
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
