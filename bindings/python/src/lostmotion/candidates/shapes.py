"""Unnamed shapes: a part of the baseline model varies with a recorded quantity.

They compete with the named effects. If one is selected, the verdict is "unexplained", and the shape
states the quantity and the form of the dependence.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.candidates.candidate import Candidate
from lostmotion.candidates.formulas import wave_over_angle, wave_over_torque
from lostmotion.condition_cards import CARDS
from lostmotion.effects.conditions import Conditions, side_by_side
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.point import Point

ORDER_MAX = 3
"""Polynomials of higher order extrapolate poorly when a run is left out."""

TORQUE_WAVES = 48
"""Largest number of periods of a ripple over the range of torque."""

ANGLE_ORDERS = (0.5, 1, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8, 10, 12)
"""Orders per revolution that are examined in addition to the first four."""

SEEN_RAD = 0.5
"""Part of a wave over an angle that must be recorded: a shorter part resembles a polynomial of any
slow quantity.
"""

PARTS = ("lost motion", "stiffness", "friction", "gap")


def rank_scale(values: FloatArray) -> FloatArray:
    """Ranks from -1 to 1; equal values have equal ranks."""
    unique, inverse, count = np.unique(values, return_inverse=True, return_counts=True)
    if unique.size < 2:
        return np.zeros_like(values)
    last = np.cumsum(count)
    middle = last - 0.5 * (count + 1)
    return np.asarray((middle / (values.size - 1) * 2 - 1)[inverse])


def polynomials(values: FloatArray) -> list[FloatArray]:
    """Polynomials of the ranks of a quantity."""
    return legendre(rank_scale(values))


def legendre(q: FloatArray) -> list[FloatArray]:
    """First three Legendre polynomials."""
    return [q, 1.5 * q * q - 0.5, 2.5 * q**3 - 1.5 * q]


def harmonics(angle_rad: FloatArray, orders: Iterable[float]) -> list[FloatArray]:
    """Cosine and sine of some orders of an angle."""
    return [wave(order * angle_rad) for order in orders for wave in (np.cos, np.sin)]


def varying_parts(base: BaselineModel, point: Point) -> dict[str, FloatArray]:
    """Parts of the baseline model that can vary."""
    run = base.run_columns(point)
    return {
        "lost motion": run[:, 3],
        "stiffness": run[:, 0],
        "friction": run[:, 1],
        "gap": run[:, 2],
    }


def channels(base: BaselineModel) -> dict[str, FloatArray]:
    """Quantities with a possible smooth influence on a part."""
    c = base.conditions
    found = {"torque": c.torque}
    for column, card in CARDS.items():
        if card.smooth and column in c.columns and np.ptp(c.columns[column]) > 0:
            found[card.quantity] = c.columns[column]
    if not base.has_effects:
        # The residual of creep or of a lag also depends on rates; this is not a second cause.
        found["torque_rate"] = usual_rates(base)
    found["time"] = c.time_s - c.time_s[c.starts[:-1]][c.run_of]
    found["run"] = c.run_of.astype(np.float64)
    return found


def usual_rates(base: BaselineModel) -> FloatArray:
    """Median loading rate of each run, N m/s."""
    c = base.conditions
    rates = []
    for at in c.slices():
        step = np.diff(c.time_s[at])
        change = np.abs(np.diff(c.torque[at]))[step > 0]
        rates.append(float(np.median(change / step[step > 0])) if change.size else 0.0)
    return np.asarray(rates)[c.run_of]


def smooth_shapes(base: BaselineModel, point: Point) -> list[Candidate]:
    """Low-order polynomials of every part over every channel, and low harmonics over the angles."""
    c = base.conditions
    out = []
    parts = varying_parts(base, point)
    for channel, values in channels(base).items():
        waves = c.once(("polynomials", channel), polynomials, values)
        for part, tangent in parts.items():
            columns = side_by_side(*(tangent * wave for wave in waves))
            out.append(
                Candidate(f"{part} by {channel}", False, columns, channel, f"{part}, smooth")
            )
    for channel in ("input_angle", "output_angle"):
        angle = c.columns.get(f"{channel}_rad")
        if angle is None:
            continue
        for part in PARTS:
            for orders in ((1, 2), (3, 4)):
                if orders[0] * np.ptp(angle) < SEEN_RAD:
                    continue
                waves = c.once(("harmonics", channel, orders), harmonics, angle, orders)
                columns = side_by_side(*(parts[part] * wave for wave in waves))
                shape = f"{orders[0]} and {orders[1]} per revolution"
                if part != "lost motion":
                    shape = f"{part}, {shape}"
                out.append(
                    Candidate(
                        f"{part} by {channel}, {orders[0]}-{orders[1]}",
                        False,
                        columns,
                        channel,
                        shape,
                        formula=wave_over_angle(channel, orders, part),
                    )
                )
    return out


def waves(base: BaselineModel) -> list[Candidate]:
    """Fine scan: ripples over torque, and single orders of the angles."""
    made = base.conditions.once(("waves", base.largest), make_waves, base)
    return [replace(wave) for wave in made]


def make_waves(base: BaselineModel) -> list[Candidate]:
    """Compute `waves`."""
    c = base.conditions
    out = []
    span = 2.0 * base.largest
    torque = c.torque
    for k in range(1, TORQUE_WAVES + 1):
        phase = 2 * np.pi * k / span * torque
        out.append(
            Candidate(
                f"wave {k} over torque",
                False,
                side_by_side(np.cos(phase), np.sin(phase)),
                "torque",
                f"ripple of {span / k:.3g} Nm",
                kind="ripple",
                formula=wave_over_torque(span / k),
            )
        )
    for channel in ("input_angle", "output_angle"):
        angle = c.columns.get(f"{channel}_rad")
        if angle is None:
            continue
        for order in ANGLE_ORDERS:
            if order * np.ptp(angle) < SEEN_RAD:
                continue
            out.append(
                Candidate(
                    f"order {order:g} of {channel}",
                    False,
                    side_by_side(*harmonics(angle, [order])),
                    channel,
                    f"{order:g} per revolution",
                    kind="ripple",
                    formula=wave_over_angle(channel, [order]),
                )
            )
    return out


FINE = 0.1
"""Step of the finer scan about a wave, over the step of the first scan."""


def finer(base: BaselineModel, coarse: Candidate) -> list[Candidate]:
    """Scan near a selected wave; none for other shapes."""
    c = base.conditions
    kind = coarse.name.split()
    span = 2.0 * base.largest
    if kind[0] == "wave":
        middle = float(kind[1])
        scan = middle + FINE * np.arange(-10, 11)
        x = c.torque / span
        words = [f"ripple of {span / k:.3g} Nm" for k in scan if k > 0]
    elif kind[0] == "order" and coarse.covariate in ("input_angle", "output_angle"):
        middle = float(kind[1])
        x = c.columns[f"{coarse.covariate}_rad"] / (2 * np.pi)
        # The resolution of an order is the reciprocal of the recorded turns.
        width = 1.0 / max(float(np.ptp(x)), 1.0)
        scan = middle + width * FINE * np.arange(-10, 11)
        words = [f"{k:.4g} per revolution" for k in scan if k > 0]
    else:
        return []
    out = []
    for k, word in zip(scan[scan > 0], words, strict=True):
        phase = 2 * np.pi * k * x
        columns = side_by_side(np.cos(phase), np.sin(phase))
        name = f"{kind[0]} {k:.6g} {' '.join(kind[2:])}"
        also = over_the_output(c, float(k)) if coarse.also else []
        out.append(
            Candidate(
                name,
                False,
                columns,
                coarse.covariate,
                word,
                also=also,
                kind=coarse.kind,
                formula=wave_over_torque(span / float(k))
                if kind[0] == "wave"
                else wave_over_angle(coarse.covariate, [float(k)]),
            )
        )
    return out


def over_the_output(c: Conditions, order: float) -> list[tuple[str, str]]:
    """A ripple over the input, converted to one over the output through the gear ratio."""
    output = c.columns.get("output_angle_rad")
    if output is None or np.ptp(output) == 0:
        return []
    geared = order * float(np.ptp(c.columns["input_angle_rad"])) / float(np.ptp(output))
    return [("output_angle", f"{geared:.3g} per revolution")]


def with_neighbours(base: BaselineModel, wave: Candidate) -> Candidate:
    """Add the derivatives of a wave by its frequency, so that a frequency error is absorbed."""
    c = base.conditions
    x = c.torque / base.largest
    if wave.covariate != "torque":
        x = c.columns[f"{wave.covariate}_rad"]
        x = (x - x.mean()) / max(float(np.std(x)), 1e-12)
    columns = side_by_side(wave.columns, wave.columns * x[:, None])
    return replace(wave, columns=columns)
