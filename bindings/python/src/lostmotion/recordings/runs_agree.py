"""Runs of one drive agree: no run has another sign or unit than the others, or no sign at all.

The lost motion of a run is compared with the mean curve of the others. If another unit or sign of
its torque or angles explains it and the recorded one does not, it would spoil every fit, and is
refused. It must also contradict what a drive can do: no wear, preload or temperature changes a
compliance by so large a factor, and no drive returns work.

An error that depends on the output angle, such as an eccentricity, may reverse the slope of a
recording too, but not its hysteresis: friction dissipates work in every drive, and over a way there
and back an error of position does not change that work.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lostmotion import rules, units
from lostmotion.arrays import FloatArray
from lostmotion.errors import InputError
from lostmotion.recordings.campaign import Campaign, Run
from lostmotion.recordings.dissipated import DissipatedWork, dissipated_work, integral_over, sign_of
from lostmotion.recordings.findings import DOUBT_CHANCE, Finding
from lostmotion.recordings.gate import ANGLES, SIZE_FACTOR, TORQUES
from lostmotion.recordings.mean_curve import MeanCurve
from lostmotion.recordings.soundness import STUCK_TURN_RAD
from lostmotion.recordings.wild import PLAUSIBLE

LOST = "lost_motion_rad"

CURVE_SHARE = 0.5
"""Least share of the variance of the lost motion of a run that is linear in the torque: half, as
for the scale of a drive file (`scale.SCALE_SHARE`)."""

SAMPLES_LEAST = 30
"""Least number of samples of a run: with fewer, noise may correlate with the torque by chance; with
30, a share of half has a probability of 1e-5."""

TINY = float(np.finfo(np.float64).tiny)

UNITS = {
    **{
        f"torque in {symbol}": (units.unit(symbol).scale, 1.0)
        for symbol in TORQUES
        if symbol != "Nmm"  # a millinewton metre
    },
    **{f"angles in {symbol}": (1.0, units.unit(symbol).scale) for symbol in ANGLES},
}
"""Factors of torque and angles of a run that was logged in another unit."""


@dataclass(frozen=True)
class Loop:
    """The torsion curve of a run in three numbers.

    Attributes
    ----------
    run : Run
    slope : float
        rad/Nm, by least squares.
    work : DissipatedWork
        What the drive dissipated.
    """

    run: Run
    slope: float
    work: DissipatedWork

    def misfit(self, curve: MeanCurve, torque_by: float = 1.0, angle_by: float = 1.0) -> float:
        """Rms distance from a curve, apart from a constant, with its columns multiplied, rad."""
        expected = curve(torque_by * self.run.torque_Nm)
        return float(np.std(angle_by * self.run.lost_motion_rad - expected))


def loops_of(campaign: Campaign) -> list[Loop]:
    """Runs in which the lost motion follows the torque."""
    found = []
    for run in campaign.runs:
        torque, lost = run.torque_Nm, run.lost_motion_rad
        if len(run) < SAMPLES_LEAST or linear_share(torque, lost) < CURVE_SHARE:
            continue
        torque = torque - torque.mean()
        slope = float(torque @ lost) / float(torque @ torque)
        found.append(Loop(run, slope, dissipated_work(run)))
    return found


def check_runs_agree(campaign: Campaign, ratio: float | None) -> None:
    """Refuse runs whose sign or unit differs from that of the other runs.

    With an infinite ratio, the lost motion of runs that turn is their output angle: it says nothing
    about torque and stiffness.

    Raises
    ------
    InputError
        Names the runs and the column.
    """
    check_temperatures(campaign)
    note_fahrenheit(campaign)
    if ratio == math.inf and any(turns(run) for run in campaign.runs):
        return
    check_magnitudes(campaign)
    if any(finding.kind == "ratio" for finding in campaign.findings):
        return
    loops = loops_of(campaign)
    check_signs(loops)
    check_units(loops)


def turns(run: Run) -> bool:
    """Whether the input turns."""
    return bool(np.ptp(run.columns.get("input_angle", 0.0)) >= STUCK_TURN_RAD)


def check_signs(loops: list[Loop]) -> None:
    """Refuse runs in which torque or angles have the other sign."""
    falling = [loop for loop in loops if loop.slope < 0]
    rising = [loop for loop in loops if loop.slope > 0]
    few, many, way = (
        (falling, rising, "falls") if len(falling) <= len(rising) else (rising, falling, "rises")
    )
    if not few:
        return
    curve, _ = curve_of(many)
    usual = sign_of(loop.work for loop in many)
    reversed_runs = [
        loop
        for loop in few
        if sign_of([loop.work]) * usual < 0
        and loop.misfit(curve, torque_by=-1.0) < loop.misfit(curve)
    ]
    if reversed_runs:
        refuse_loops(
            reversed_runs,
            LOST,
            f"a lost motion that {way} with increasing torque in {runs_in_words(reversed_runs)}, "
            f"unlike in {runs_in_words(many)}",
            "one sign of torque and angles in all runs",
        )


def check_units(loops: list[Loop]) -> None:
    """Refuse runs with another unit than most others."""
    if not loops:
        return
    sizes = np.log([abs(loop.slope) for loop in loops])
    far = np.abs(sizes - np.median(sizes))
    apart = far > np.log(SIZE_FACTOR)
    rest = [loop for loop, out in zip(loops, apart, strict=True) if not out]
    if len(rest) < 2 or len(rest) == len(loops):
        return
    ordinary = sizes[~apart]
    apart &= far_from(ordinary, sizes) * len(loops) < DOUBT_CHANCE
    curve, scatter = curve_of(rest)
    usual = float(np.exp(np.median(sizes)))
    swing_Nm = float(np.median([np.std(loop.run.torque_Nm) for loop in rest]))
    odd: dict[str, list[Loop]] = {}
    for loop, out in zip(loops, apart, strict=True):
        if out and loop.misfit(curve) > scatter:
            fitting = [
                (abs(math.log(by[0] * float(np.std(loop.run.torque_Nm)) / swing_Nm)), name)
                for name, by in UNITS.items()
                if loop.misfit(curve, *by) <= scatter
                and is_among(ordinary, math.log(abs(loop.slope) * by[1] / by[0]))
            ]
            if fitting:
                # The likeliest is that in which the run was loaded as much as the others.
                odd.setdefault(" or ".join(name for _, name in sorted(fitting)), []).append(loop)
    for fits, of_unit in odd.items():
        times = usual / abs(of_unit[0].slope)
        refuse_loops(
            of_unit,
            "torque_Nm" if fits.startswith("torque") else LOST,
            f"a stiffness {times:.3g} times that of the other runs in {runs_in_words(of_unit)}, "
            f"as with {fits}",
            "one unit in all runs",
        )


def is_among(usual: FloatArray, value: float) -> bool:
    """Whether a logarithm of a slope is no outlier among the usual ones."""
    return float(far_from(usual, np.array([value]))[0]) >= DOUBT_CHANCE


def far_from(usual: FloatArray, values: FloatArray) -> FloatArray:
    """Probability by Student's t that one more of the usual values is as far from them as each."""
    from scipy import special  # takes half a second to load

    spread = float(np.std(usual, ddof=1)) * math.sqrt(1 + 1 / usual.size)
    far = np.abs(values - np.mean(usual)) / max(spread, TINY)
    return np.asarray(2 * special.stdtr(usual.size - 1, -far))


def curve_of(loops: list[Loop]) -> tuple[MeanCurve, float]:
    """Mean curve of loops, and the largest distance of one of them from it, rad."""
    curve = MeanCurve(loop.run for loop in loops)
    return curve, max(loop.misfit(curve) for loop in loops)


def check_magnitudes(campaign: Campaign) -> None:
    """Refuse runs in which the torque or the lost motion has lost its sign.

    A magnitude is never negative, comes down to zero where the sign changed, and rises with the
    size of what it belongs to. A lost motion that was not recorded but follows from two angles is
    none. An arm that holds a weight has a torque of one sign, which stays away from zero.
    """
    for run in campaign.runs:
        torque, lost = run.torque_Nm, run.lost_motion_rad
        if len(run) < SAMPLES_LEAST:
            continue
        one_sided = bool(torque.min() >= 0 or torque.max() <= 0)
        if one_sided:
            signed, size = lost - np.median(lost), torque
        elif "input_angle" not in run.columns and (lost.min() >= 0 or lost.max() <= 0):
            signed, size = torque, lost
        else:
            continue
        even = rising_share(np.abs(size), np.abs(signed)) if comes_to_zero(size) else 0.0
        if even >= CURVE_SHARE and even > linear_share(torque, lost) and returns_work(signed, size):
            column, other = ("torque_Nm", "lost motion") if one_sided else (LOST, "torque")
            raise InputError(
                run.file,
                column,
                f"a magnitude without sign in run {run.label}: the {other} passes zero where it "
                "returns",
                "values with their sign; or the recordings without this run",
            )


def comes_to_zero(values: FloatArray) -> bool:
    """Whether values of one sign are as near to zero as their steps from sample to sample."""
    return float(np.min(np.abs(values))) <= float(np.max(np.abs(np.diff(values))))


def rising_share(torque: FloatArray, lost: FloatArray) -> float:
    """`linear_share` where the lost motion rises with the torque, else zero."""
    rises = float((torque - torque.mean()) @ lost) > 0
    return linear_share(torque, lost) if rises else 0.0


def returns_work(along: FloatArray, over: FloatArray) -> bool:
    """Whether the loop turns one way where `along` is positive, the other way where negative."""
    along, over = np.append(along, along[0]), np.append(over, over[0])
    halves = [integral_over(side(along, 0.0), over) for side in (np.fmax, np.fmin)]
    return halves[0] * halves[1] < 0


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

    As stated it is an outlier among them (`rules.P_LIMIT`), and in Fahrenheit it is not. A plan of
    temperatures may look the same, so nothing is changed.
    """
    known = [
        (run, float(np.median(values[np.isfinite(values)])))
        for run in campaign.runs
        if (values := run.columns.get("temperature", np.zeros(0))).size
        and np.isfinite(values).any()
    ]
    if len(known) < 3:
        return
    in_order = np.sort([value for _, value in known])
    lowest, next_lower = float(in_order[0]), float(in_order[-2])
    celsius = units.convert(float(in_order[-1]), "F", "C")
    if lowest <= celsius <= next_lower and far_from(in_order[:-1], in_order[-1:]) < rules.P_LIMIT:
        run, value = max(known, key=lambda one: one[1])
        action = (
            f"{value:.4g} C, and {lowest:.4g} to {next_lower:.4g} C in the other runs: if it is in "
            f"Fahrenheit, it is {celsius:.4g} C"
        )
        finding = Finding("range", run.file, "temperature_C", run.label, len(run), action)
        campaign.findings.append(finding)


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
