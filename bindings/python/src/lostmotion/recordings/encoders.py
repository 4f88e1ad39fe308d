"""Encoders: restore whole turns and overflows that the other encoder reveals.

The lost motion ``output - input / ratio`` hardly changes from sample to sample, and an encoder that
wraps makes it jump by its modulus: one turn, or as many counts as its counter holds. Thus two
encoders check each other. If the lost motion is continuous, nothing is changed. If it jumps, a
modulus is restored only if this makes the lost motion continuous; of several moduli, the one with
the least change. Undecided jumps are returned.

Lost motion and motion of the input are confounded modulo ``modulus / ratio``. The bounds below
state the tolerance of a jump, and when the reading of the input must confirm it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray, IntArray
from lostmotion.recordings.bursts import BURST
from lostmotion.recordings.campaign import Campaign, Run
from lostmotion.recordings.findings import Finding

TURN = 2 * np.pi

WRAP_SLACK = 0.25
"""Tolerance of a jump relative to a whole modulus: half the distance at which two are equally near.
"""

FOLLOWED_SLACK = WRAP_SLACK / 4
"""The same for the median of many jumps: a wrong ratio, or another shaft, has a larger error."""

ALIKE = 0.01
"""Difference of the travel of the lost motion, relative to the change by one input turn, up to
which two repairs are equal. With a ratio of 50.02, whole input turns and one output turn differ by
0.02; noise is smaller."""

STILL = 1 / 16
"""Step of the input in moduli, beyond that of its neighbours, above which it has really moved."""

SLIP_TURNS = 2
"""A mesh ratchets by a few teeth, and two teeth are about one turn of the input: up to this number
of turns, a jump of the output while the input is at rest may be either."""

STRAY_SHARE = 0.005
"""Largest share of readings of an encoder that wraps that may be outside its range."""

COUNTER_BITS = (8, 16, 24, 32)
"""Usual widths of counter registers in bits."""

LEVELS_LEAST = 8
"""Least number of different readings that identify the resolution of an encoder."""

COUNTS_REACH = (1, 2, 4, 8, 16, 32)
"""Differences, in counts, from which the size of a count is refined, in this order."""

WHOLE = 0.05
"""Largest distance, in counts, of the difference of two readings from a whole number of counts;
above ten counts, a tenth of this for each count."""

PUT_BACK = "whole turns restored"

OPEN_ACTION = (
    "steps above a quarter turn, kept; whole turns may be missing that neither the ratio "
    "nor the other encoder reveals"
)
"""Report text for an encoder that turns too fast for its sampling."""

UNDECIDED_ACTION = (
    "jumps of the lost motion, kept: the input made whole turns between two samples, teeth "
    "slipped, or a zero shifted; if the drive turned, record these moves or give each part "
    "its own label in the column run"
)
"""Report text for ambiguous jumps."""


@dataclass(frozen=True)
class Modulus:
    """Modulus up to which an encoder reading is known.

    Attributes
    ----------
    size_rad : float
        Angle after which the reading wraps.
    action : str
        Report text when it was restored.
    held : bool
        Whether the readings stay within one such range, as for an encoder that wraps.
    """

    size_rad: float
    action: str
    held: bool


@dataclass(frozen=True)
class Counter:
    """Encoder properties from a map: angle of a count, and counts until overflow."""

    count_rad: float
    counts: float | None = None


@dataclass
class PutBack:
    """Two angles with restored turns; the same arrays if nothing was lost."""

    input_rad: FloatArray
    output_rad: FloatArray
    wraps: dict[str, tuple[int, str]] = field(default_factory=dict)
    """Number of jumps and the action, by quantity."""
    undecided: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    """Rows with undecided jumps of the lost motion."""


def count_rad(angle_rad: FloatArray) -> float | None:
    """Find the resolution of an encoder: the angle of which all differences are multiples."""
    levels = np.unique(angle_rad)
    if levels.size < LEVELS_LEAST:
        return None
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-10 * float(np.max(np.abs(levels)))]
    if gaps.size < LEVELS_LEAST - 1:
        return None
    count = float(gaps.min())
    for reach in COUNTS_REACH:
        near = gaps[gaps < (reach + 0.5) * count]
        parts = near / count
        if float(np.max(np.abs(parts - np.rint(parts)))) > WHOLE * max(1.0, 0.1 * reach):
            return None
        count = float(near.sum() / np.rint(parts).sum())
    return count


def held_within(angle_rad: FloatArray, size_rad: float) -> bool:
    """Whether all readings except a few outliers stay within one range of a size."""
    levels = np.sort(angle_rad)
    reach = np.searchsorted(levels, levels + size_rad * (1 + 1e-9), side="right")
    within = int(np.max(reach - np.arange(levels.size)))
    return levels.size - within <= max(STRAY_SHARE * levels.size, 1.0)


def moduli(angle_rad: FloatArray, stated: Counter | None = None) -> list[Modulus]:
    """List possible moduli of an encoder, likely ones first."""
    turn = Modulus(TURN, PUT_BACK, held_within(angle_rad, TURN))
    count = count_rad(angle_rad) if stated is None else stated.count_rad
    ends = {f"2^{bits}": 2.0**bits for bits in COUNTER_BITS} if count is not None else {}
    if stated is not None and stated.counts is not None:
        ends = {f"{stated.counts:g}": stated.counts}
    counters = []
    for name, counts in ends.items():
        size = counts * float(count or 0.0)
        jumped = bool(np.any(np.abs(np.diff(angle_rad)) > 0.5 * size))
        if jumped and held_within(angle_rad, size):
            action = f"overflows of {name} counts ({size / TURN:.6g} turns each) removed"
            counters.append(Modulus(size, action, held=True))
    return [turn, *counters] if turn.held else [*counters, turn]


def put_back(
    input_rad: FloatArray,
    output_rad: FloatArray,
    ratio: float,
    counters: Mapping[str, Counter] | None = None,
) -> PutBack:
    """Restore what the encoders lost if only this makes the lost motion continuous.

    Parameters
    ----------
    input_rad, output_rad : ndarray
        Readings of one run, finite.
    ratio : float
        Input turns for one output turn, signed.
    counters : mapping, optional
        Counters of "input_angle" and "output_angle" from a map.
    """
    stated = counters or {}
    unchanged = PutBack(input_rad, output_rad)
    if input_rad.size < 2:
        return unchanged
    ends_in: list[Modulus | None] = [None, *moduli(input_rad, stated.get("input_angle"))]
    ends_out: list[Modulus | None] = [None, *moduli(output_rad, stated.get("output_angle"))]

    def change_of(found: PutBack) -> float:
        """Travel of the lost motion; each step counts at most one turn of the input."""
        step = np.abs(np.diff(found.output_rad - found.input_rad / ratio))
        return float(np.minimum(step, TURN / abs(ratio)).sum())

    best, change = unchanged, change_of(unchanged)
    for end_in in ends_in:
        for end_out in ends_out:
            if end_in is None and end_out is None:
                continue
            found = follow(input_rad, output_rad, ratio, end_in, end_out)
            left = change_of(found)
            # If two moduli give equal results, they are the same repair, or none: the likelier one
            # is kept, unless the other needs one output turn less, which whole input turns hide.
            less = change - left
            alike = ALIKE * TURN / abs(ratio)
            shorter = way(found.output_rad) < way(best.output_rad) - 0.5 * TURN
            if less > alike or (abs(less) <= alike and shorter and best is not unchanged):
                best, change = found, left
    held = [end.size_rad for end in ends_in if end is not None and end.held]
    if held:
        best.undecided = jumps_left(best, ratio, min(held) / abs(ratio))
    elif held_within(output_rad, TURN):
        best.undecided = jumps_left(best, ratio, TURN)
    return best


def way(angle_rad: FloatArray) -> float:
    """Sum of the steps of an angle."""
    return float(np.abs(np.diff(angle_rad)).sum())


def jumps_left(found: PutBack, ratio: float, unit: float) -> IntArray:
    """Rows at which the lost motion jumps by more than a quarter of a unit, and stays."""
    lost = found.output_rad - found.input_rad / ratio
    bound = range_of_pieces(lost, WRAP_SLACK * unit)
    rows = np.flatnonzero(~stray(lost / unit, bound / unit, whole=0.0))
    jumps = np.abs(np.diff(lost[rows])) > WRAP_SLACK * unit
    return np.asarray(rows[np.flatnonzero(jumps) + 1])


def follow(
    input_rad: FloatArray,
    output_rad: FloatArray,
    ratio: float,
    end_in: Modulus | None,
    end_out: Modulus | None,
) -> PutBack:
    """Restore what is lost if the encoders have these moduli."""
    size_in = 0.0 if end_in is None else end_in.size_rad
    size_out = 0.0 if end_out is None else end_out.size_rad
    unit = size_in / abs(ratio) if end_in is not None else size_out
    lost = output_rad - input_rad / ratio
    bound = range_of_pieces(lost, WRAP_SLACK * unit)
    phase = lost
    if end_in is not None and end_out is not None:
        own = -np.rint(np.diff(output_rad) / size_out)
        phase = lost + size_out * np.concatenate(([0.0], np.cumsum(own)))
    left_out = stray(phase / unit, bound / unit)
    if end_in is not None:
        left_out |= output_alone(input_rad / size_in, output_rad / unit, size_out / unit)
    rows = np.flatnonzero(~left_out)
    put_in, put_out = input_rad[rows], output_rad[rows]
    step_in, step_out, step = np.diff(put_in), np.diff(put_out), np.diff(lost[rows])
    zero = np.zeros(step.size)

    turns_out, turns_in = zero, zero
    if end_in is None:
        turns_out = -np.rint(step / size_out)
    else:
        if end_out is not None:
            turns_out = nearest_out(step, step_out, size_out, unit)
        turns_in = np.rint((step + turns_out * size_out) * ratio / size_in)
    rest = step + turns_out * size_out - turns_in * size_in / ratio
    jumps = (turns_in != 0) | (turns_out != 0)
    if not jumps.any():
        return PutBack(input_rad, output_rad)

    fast = np.abs(step_out) > WRAP_SLACK * unit
    beside = np.zeros(step.size, dtype=bool)
    beside[1:] |= fast[:-1]
    beside[:-1] |= fast[1:]
    moving = fast & beside
    near = np.abs(rest) < WRAP_SLACK * unit
    seen = (turns_out != 0) & (np.abs(step_out) > 0.5 * size_out)
    jerk = apart_from_neighbours(step_in)
    if end_in is not None:
        own = -np.rint(step_in / size_in)
        seen |= (turns_in != 0) & (np.abs(jerk) > 0.5 * size_in)
        # A reading that passed the end of its own range is certain, regardless of the load at that
        # sample.
        near |= (own == turns_in) & end_in.held & (np.abs(rest) < 0.5 * unit)
        moved = np.abs(jerk - size_in * np.rint(jerk / size_in)) > STILL * size_in
        if not end_in.held:  # a counter of turns that lost some: it must have jumped itself
            seen &= (np.abs(jerk) > 0.5 * size_in) & (np.abs(rest) <= bound) | (turns_in == 0)
            moved = moving = np.zeros(step.size, dtype=bool)
    else:
        moved = np.zeros(step.size, dtype=bool)
    if end_out is not None and not end_out.held:
        seen &= (np.abs(step_out) > 0.5 * size_out) & (np.abs(rest) <= bound) | (turns_out == 0)
    if end_in is None:
        far, usual = np.ones(step.size, dtype=bool), bound
    else:
        # An input that never moves is locked: a jump is not a turn of the input.
        far = (np.abs(turns_in) > SLIP_TURNS) & bool(np.ptp(put_in) > STILL * size_in)
        usual = max(8.0 * float(np.median(np.abs(rest))), bound / 8.0)
    held = end_in.held if end_in is not None else bool(end_out and end_out.held)
    accepted = jumps & near & (seen | (held & (moved | moving | (far & (np.abs(rest) <= usual)))))
    if np.median(np.abs(rest)) > FOLLOWED_SLACK * unit:
        return PutBack(input_rad, output_rad)
    turns_in, turns_out = np.where(accepted, turns_in, 0.0), np.where(accepted, turns_out, 0.0)
    found = PutBack(input_rad, output_rad)
    if turns_in.any() and end_in is not None:
        found.input_rad = input_rad + size_in * spread(turns_in, rows, lost.size)
        found.wraps["input_angle"] = (int(np.count_nonzero(turns_in)), end_in.action)
    if turns_out.any() and end_out is not None:
        found.output_rad = output_rad + size_out * spread(turns_out, rows, lost.size)
        found.wraps["output_angle"] = (int(np.count_nonzero(turns_out)), end_out.action)
    return found


def nearest_out(step: FloatArray, step_out: FloatArray, size: float, unit: float) -> FloatArray:
    """Moduli of the output by the shortest path; by another if only that gives integers."""
    best = -np.rint(step_out / size)

    def missed(turns: FloatArray) -> FloatArray:
        rest = (step + turns * size) / unit
        return np.asarray(np.abs(rest - np.rint(rest)))

    for other in (best - 1, best + 1):
        better = (missed(best) > WRAP_SLACK) & (missed(other) < FOLLOWED_SLACK)
        best = np.where(better, other, best)
    return np.asarray(best)


def spread(turns: FloatArray, rows: IntArray, size: int) -> FloatArray:
    """Cumulated moduli at every sample; an outlier has those of the previous sample."""
    at = np.zeros(size)
    at[rows[1:]] = turns
    return np.cumsum(at)


def apart_from_neighbours(step: FloatArray) -> FloatArray:
    """Difference of every step from the mean of the adjacent steps."""
    padded = np.pad(step, 1, "reflect" if step.size > 1 else "edge")
    return np.asarray(step - 0.5 * (padded[:-2] + padded[2:]))


def range_of_pieces(lost: FloatArray, most: float) -> float:
    """Largest range of the lost motion over sections without a jump, at most `most`.

    If most steps are jumps there are no such sections, and `most` is returned.
    """
    edges = np.concatenate(([0], np.flatnonzero(np.abs(np.diff(lost)) > most) + 1))
    if edges.size > lost.size // 2:
        return most
    ranges = np.maximum.reduceat(lost, edges) - np.minimum.reduceat(lost, edges)
    return min(most, max(float(ranges.max()), 1e-12 * most))


def stray(phase: FloatArray, bound: float, whole: float = 1.0) -> BoolArray:
    """Mark bursts of samples that leave the lost motion and return, up to whole units.

    Parameters
    ----------
    phase : ndarray
        Lost motion in units of the change by a modulus.
    bound : float
        Bound of its other motion.
    whole : float
        1 if whole units do not count, else 0.
    """
    marked = np.zeros(phase.size, dtype=bool)
    if bound >= 0.5 * WRAP_SLACK:
        return marked

    def away(a: FloatArray, b: FloatArray) -> FloatArray:
        return np.asarray(np.abs(a - b - whole * np.rint(a - b)))

    for length in range(1, BURST + 1):
        if phase.size < length + 2:
            break
        before, behind = phase[: -length - 1], phase[length + 1 :]
        found = away(before, behind) <= bound
        for k in range(1, length + 1):
            found &= away(phase[k : k - length - 1], before) > 2 * bound
        for k in range(1, length + 1):
            marked[k : k - length - 1 or None] |= found
    return marked


def output_alone(input_moduli: FloatArray, output: FloatArray, size_out: float) -> BoolArray:
    """Mark bursts in which only the output reading deviates and returns.

    Otherwise the input would have made whole turns forth and back, to the same reading, within a
    few samples: an outlier of the output is more likely.

    Parameters
    ----------
    input_moduli : ndarray
        Reading of the input in its moduli.
    output : ndarray
        Reading of the output, in units of its change by an input modulus.
    size_out : float
        Modulus of the output in the same unit, 0 where it has none.
    """
    marked = np.zeros(output.size, dtype=bool)
    if (
        float(np.quantile(np.abs(np.diff(output)), 0.9)) > WRAP_SLACK
    ):  # steps of this size are usual
        return marked
    for length in range(1, BURST + 1):
        if output.size < length + 2:
            break
        found = np.abs(output[length + 1 :] - output[: -length - 1]) < WRAP_SLACK
        found &= np.abs(input_moduli[length + 1 :] - input_moduli[: -length - 1]) < STILL
        for k in range(1, length + 1):
            away = np.abs(output[k : k - length - 1] - output[: -length - 1])
            found &= away > 1 - WRAP_SLACK
            if size_out:
                turns = np.rint(away / size_out)
                found &= (turns == 0) | (np.abs(away - turns * size_out) > WRAP_SLACK)
            found &= np.abs(input_moduli[k : k - length - 1] - input_moduli[: -length - 1]) < STILL
        for k in range(1, length + 1):
            marked[k : k - length - 1 or None] |= found
    return marked


def unwrap(angle_rad: FloatArray) -> tuple[FloatArray, int]:
    """Restore the whole turns of a single encoder whose readings stay within one turn.

    A step near whole turns counts as a wrap if the usual step, after restoring turns, is below a
    quarter turn: an encoder at rest at its seam wraps continually. Faster recordings are not
    changed, because a wrap cannot be distinguished from motion.

    Returns
    -------
    angle_rad : ndarray
        The same array if nothing wrapped.
    wraps : int
        Number of wraps found.
    """
    step = np.diff(angle_rad)
    turns = np.round(step / TURN)
    remainder = np.abs(step - turns * TURN)
    wrapped = (turns != 0) & (remainder < WRAP_SLACK * TURN)
    count = int(np.count_nonzero(wrapped))
    if count == 0 or not held_within(angle_rad, TURN):
        return angle_rad, 0
    if np.median(remainder) > WRAP_SLACK * TURN:
        return angle_rad, 0
    lost = np.concatenate(([0.0], np.cumsum(np.where(wrapped, turns, 0.0))))
    return angle_rad - lost * TURN, count


def unwrap_known(angle_rad: FloatArray) -> tuple[FloatArray, int]:
    """Unwrap the samples that have a number."""
    known = np.isfinite(angle_rad)
    whole = angle_rad.copy()
    whole[known], wraps = unwrap(angle_rad[known])
    return (whole, wraps) if wraps else (angle_rad, 0)


def open_steps(angle_rad: FloatArray) -> int:
    """Count the steps above a quarter turn if they are frequent and the angle is within a turn."""
    known = angle_rad[np.isfinite(angle_rad)]
    step = np.abs(np.diff(known))
    if step.size == 0 or np.ptp(known) > TURN or np.median(step) <= WRAP_SLACK * TURN:
        return 0
    return int(np.count_nonzero(step > WRAP_SLACK * TURN))


def bring_together(campaign: Campaign, ratio: float | None) -> None:
    """Restore the whole turns of the input by which the starts of runs differ from the first.

    A single-turn encoder starts every run within one turn, wherever the output is. A multi-turn
    encoder does not, and each run keeps its zero, as does a run with recorded lost motion, or one
    that does not differ by whole turns.
    """
    if (
        ratio is None
        or math.isinf(ratio)
        or any(f.kind in ("stuck", "ratio") for f in campaign.findings)
    ):
        return
    unit = TURN / abs(ratio)
    runs = [
        run
        for run in campaign.runs
        if {"input_angle", "output_angle"} <= run.columns.keys()
        and run.columns["input_angle"].any()  # a locked side has no encoder
        and not open_steps(run.columns["input_angle"])
        and np.array_equal(
            run.lost_motion_rad, run.columns["output_angle"] - run.columns["input_angle"] / ratio
        )
    ]
    wrapped = {(f.file, f.run) for f in campaign.findings if f.kind == "wrap"}
    counting = any(
        np.ptp(run.columns["input_angle"]) > TURN and (run.file, run.label) not in wrapped
        for run in runs
    )
    if len(runs) < 2 or counting or not held_within(first_readings(runs), TURN):
        return
    middle = np.array([float(np.median(run.lost_motion_rad)) for run in runs])
    swing = max(float(np.ptp(run.lost_motion_rad)) for run in runs)
    turns = np.rint((middle - middle[0]) / unit * np.sign(ratio))
    apart = np.abs(middle - middle[0] - turns * unit * np.sign(ratio))
    turns[apart > min(WRAP_SLACK * unit, max(swing, 1e-3 * unit))] = 0.0
    for run, lost in zip(runs, turns.astype(int), strict=True):
        if lost == 0:
            continue
        run.columns["input_angle"] = run.columns["input_angle"] + lost * TURN
        run.columns["lost_motion"] = (
            run.columns["output_angle"] - run.columns["input_angle"] / ratio
        )
        action = "starts whole turns away from the first run, as the output shows: restored"
        campaign.findings.append(
            Finding("wrap", run.file, "input_angle_rad", run.label, abs(lost), action)
        )


def first_readings(runs: Sequence[Run]) -> FloatArray:
    """First readings of the input in each run."""
    return np.array([float(run.columns["input_angle"][0]) for run in runs])
