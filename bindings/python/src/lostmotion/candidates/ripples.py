"""A ripple over an angle of any order; bearings and belts cause non-integer orders.

The spectrum of the residual is examined over all orders that the turning runs resolve. The order
that exceeds its neighbours most competes, and its test is corrected for all orders.
"""

from __future__ import annotations

import numpy as np
from scipy import fft

from lostmotion.arrays import FloatArray
from lostmotion.candidates.candidate import Candidate
from lostmotion.candidates.formulas import wave_over_angle
from lostmotion.candidates.shapes import ANGLE_ORDERS, over_the_output
from lostmotion.effects.conditions import Conditions, side_by_side
from lostmotion.fit.baseline import BaselineModel

TURNS_LEAST = 2.0
"""Turns of an angle within a run above which it counts as turning."""

ORDER_MOST = 40.0
"""Highest order that is examined."""

BINS = 6.0
"""Bins of the angle in a period of the highest order."""

BINS_MOST = 2**18
"""Largest number of bins: recordings of thousands of turns serve to find slow effects."""

PADDING = 4
"""Points of the spectrum for each order that the recorded turns resolve."""

NEIGHBOURS = 50
"""Orders on either side from which the local noise level is estimated."""

LOWEST = 3.0
"""Least number of periods over all turns: slower variations are a drift over time."""


def ripples(base: BaselineModel) -> list[Candidate]:
    """The most prominent order of the first angle that turns."""
    c = base.conditions
    for channel in ("input_angle", "output_angle"):
        angle = c.columns.get(f"{channel}_rad")
        turning = [] if angle is None else turning_runs(c, angle)
        if angle is not None and turning:
            return strongest_order(base, channel, angle / (2 * np.pi), turning)
    return []


def turning_runs(c: Conditions, angle_rad: FloatArray) -> list[slice]:
    """Rows of the runs in which an angle turns."""
    return [at for at in c.slices() if float(np.ptp(angle_rad[at])) > TURNS_LEAST * 2 * np.pi]


def strongest_order(
    base: BaselineModel, channel: str, turns: FloatArray, turning: list[slice]
) -> list[Candidate]:
    """Find the most prominent order of an angle, in turns; none if no order is resolved."""
    c = base.conditions
    residual = base.residual()
    rows = np.concatenate([np.arange(at.start, at.stop) for at in turning])
    # Twice a period, as sampled by the slowest run.
    step = min(float(np.median(np.abs(np.diff(turns[at])))) for at in turning)
    first = float(turns[rows].min())
    span = float(np.ptp(turns[rows]))
    highest = min(ORDER_MOST, 0.5 / max(step, 1e-9), BINS_MOST / (BINS * span))
    place = ((turns[rows] - first) * BINS * highest).astype(np.intp)
    binned = np.bincount(place, weights=residual[rows])
    points = fft.next_fast_len(PADDING * binned.size, real=True)
    power = np.abs(fft.rfft(binned, points)) ** 2
    orders = np.arange(power.size) * BINS * highest / points
    level = local_level(power, 2 * NEIGHBOURS * PADDING)
    looked_at = (orders >= LOWEST / span) & (orders <= highest)
    for order in ANGLE_ORDERS:  # these orders already compete
        looked_at &= np.abs(orders - order) > 1.0 / span
    if not looked_at.any():
        return []
    best = int(np.argmax(np.where(looked_at, power / np.maximum(level, 1e-300), 0.0)))
    order = float(orders[best])
    phase = 2 * np.pi * order * turns
    return [
        Candidate(
            f"order {order:.6g} of {channel}",
            False,
            side_by_side(np.cos(phase), np.sin(phase)),
            channel,
            f"{order:.4g} per revolution",
            trials=max(int(span * highest), 1),
            also=over_the_output(c, order) if channel == "input_angle" else [],
            kind="ripple",
            formula=wave_over_angle(channel, [order]),
        )
    ]


def local_level(power: FloatArray, width: int) -> FloatArray:
    """Local level of a spectrum: medians of pieces, with linear interpolation."""
    pieces = np.array_split(power, max(1, power.size // width))
    middles = np.cumsum([piece.size for piece in pieces]) - 0.5 * np.array([p.size for p in pieces])
    medians = [float(np.median(piece)) for piece in pieces]
    return np.interp(np.arange(power.size), middles, medians)
