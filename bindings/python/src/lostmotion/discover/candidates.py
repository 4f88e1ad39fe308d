"""Tangents of the named effects at the fitted base: what each would add to the recordings.

Linear values give exact columns. Values that enter otherwise are stepped over a few starts, and all
their columns together stand for the effect in the screening; the joint refit comes afterwards.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
import numpy.typing as npt

from lostmotion.discover.base import Base, Point, Term, start_values
from lostmotion.discover.conditions import Conditions, side_by_side
from lostmotion.discover.effects import Effect
from lostmotion.units import ARCSEC, split_unit

FloatArray = npt.NDArray[np.float64]

STARTS_MAX = 4
"""Starts of the inner values of an effect."""

TAKEUP_SHARES = (0.004, 0.03)
"""Starts of a torque at which something closes, over rated torque."""

DRAG_SHARES = (0.005, 0.02)
"""Starts of the drag of turning, seen at the output, over rated torque."""

RUNOUT_RAD = 2e-5
CLOSING_ANGLE = 2.0
CLOSING_SHARES = (0.1, 1.0)
"""Starts of two lobes that do not run true: run-out; angle in which a lobe's teeth come into
contact, over the run-out; the torque that this takes, over rated torque."""

SMALL = 0.005
"""Largest torque over the rated one that an effect on the torque has where it is differenced."""

VISIBLE = 1e-9
"""A column with less than this of its size left outside the base is not visible."""

LATENT: dict[str, str] = {
    "soft_windup": "the base finds its own characteristic",
    "stiffening": "the base finds its own characteristic",
    "free_play": "the base finds its own characteristic",
    "input_coupling_play": "the base finds its own characteristic",
    "torque_scale": "the base finds its own compliance",
    "input_lock_compliance": "the base finds its own compliance",
}
"""Effects that the base takes up by construction, and why: they are part of what it fits."""

SEEN_BY = {"input_coupling_play": "input_velocity_rad_s"}
"""Columns that tell an effect from the base where they vary: the drag of turning moves the load at
which a coupling falls over."""


@dataclass
class Candidate:
    """A block of columns that competes.

    Attributes
    ----------
    name : str
    named : bool
        An effect of the library (or the user's), against a shape without a name.
    columns : ndarray
        Arc seconds per unit.
    covariate, shape : str
        What a shape hangs on, in words.
    starts : list of ndarray
        Values to start a joint refit from.
    start_of : list of int
        The start that each column belongs to.
    trials : int
        How many columns were looked at to find these; their test pays for all of them.
    also : list of tuple
        Other quantities that would give the same columns, and in what shape.
    """

    name: str
    named: bool
    columns: FloatArray
    covariate: str = ""
    shape: str = ""
    effect: Effect | None = None
    starts: list[FloatArray] = field(default_factory=list)
    start_of: list[int] = field(default_factory=list)
    trials: int = 1
    also: list[tuple[str, str]] = field(default_factory=list)


def given_values(base: Base, ratio: float) -> list[tuple[str, float]]:
    """What is known of the drive, by the names that effects have for it."""
    # Two lobes: the teeth differ by two, the flexspline has 2 |ratio| of them.
    return [
        ("ratio", abs(ratio)),
        ("reference_Nm", base.rated_torque_Nm),
        ("tooth_angle_rad", 2 * np.pi / (2 * abs(ratio) + 2)),
    ]


RECORDED_AS = {
    "input_velocity_rad_s": "input_angle_rad",
    "output_acceleration_rad_s2": "output_angle_rad",
}
"""Columns from which conditions are derived that nobody records."""


DERIVED = {
    "input_velocity_rad_s": "speed of the input",
    "output_acceleration_rad_s2": "acceleration of the output",
}
"""What conditions are called that have no column of their own."""


def missing_columns(effect: Effect, conditions: Conditions) -> list[str]:
    """Columns that the effect needs and the recordings lack, by the name they are recorded by."""
    return sorted({RECORDED_AS.get(need, need) for need in effect.needs - conditions.known()})


def closed_by_columns(
    effects: Mapping[str, Effect], conditions: Conditions
) -> dict[str, list[str]]:
    """Effects that cannot be tested, by the quantity that the recordings lack."""
    closed: dict[str, list[str]] = {}
    for name, effect in effects.items():
        for column in missing_columns(effect, conditions):
            closed.setdefault(split_unit(column)[0], []).append(name)
    return closed


def constant_columns(effect: Effect, conditions: Conditions) -> list[str]:
    """Conditions that the effect needs and that never change, as a reader calls them."""
    flat = []
    for need in sorted(effect.needs - {"elapsed_s"}):
        column = conditions.columns[need]
        if np.ptp(column) <= 1e-12 * max(1.0, float(np.max(np.abs(column)))):
            flat.append(DERIVED.get(need, need))
    return flat


def varies(conditions: Conditions, column: str | None) -> bool:
    """Whether a column was recorded, and moves."""
    return column in conditions.columns and float(np.ptp(conditions.columns[column])) > 0


def grid(effect: Effect, index: int, base: Base) -> list[float]:
    """Starts of one inner value."""
    c = base.conditions
    value = effect.values[index]
    name = value.name
    if name == "takeup_Nm":
        starts = [share * base.rated_torque_Nm for share in TAKEUP_SHARES]
    elif name == "drag_Nm":
        sense = 1.0 if value.high > 0 else -1.0
        starts = [sense * share * base.rated_torque_Nm for share in DRAG_SHARES]
    elif name == "threshold_Nm":
        starts = [share * base.largest for share in (0.7, 0.95)]
    elif name.endswith("_Nm"):
        starts = [share * base.rated_torque_Nm for share in (0.02, 0.1, 0.5)]
    elif name == "onset_s":
        steps = c.columns["elapsed_s"]
        least = 3.0 * float(np.median(steps[steps > 0])) if np.any(steps > 0) else 1.0
        longest = max(float(np.max(np.diff(c.starts))) * float(np.median(steps)), 10 * least)
        starts = list(np.geomspace(least, longest / 10.0, 4))
    elif name == "stribeck_rad_s":
        speed = np.abs(c.columns["input_velocity_rad_s"])
        moving = speed[speed > 0.02 * speed.max()] if speed.max() > 0 else np.ones(1)
        starts = list(np.geomspace(max(0.3 * np.quantile(moving, 0.1), 1e-3), np.max(moving), 3))
    elif name == "blend_rad_s":
        speed = np.abs(c.columns["input_velocity_rad_s"])
        starts = [max(0.02 * float(speed.max()), 1e-4)]
    elif name == "exponent":
        starts = [0.5, 1.0]
    elif name == "widening":
        starts = [0.02, 0.08, 0.3]
    elif name == "gap_rad":
        starts = [value.high]
    else:
        starts = [0.25 * value.typical, value.typical, 4.0 * value.typical]
        if value.typical == 0:
            starts = [0.0]
    return [float(np.clip(start, value.low, value.high)) for start in starts]


RESOLVED = ("stribeck_rad_s", "onset_s")
"""Inner values that a fit holds to what speeds and times of these recordings resolve: beyond them
an effect would follow the noise of a standing drive."""


def resolved(effect: Effect, base: Base, ratio: float) -> Effect:
    """The effect with the bounds of its inner values within what was recorded, and of the drive."""
    values = []
    for i, value in enumerate(effect.values):
        if value.name in RESOLVED:
            starts = grid(effect, i, base)
            if min(starts) < max(starts):  # runs of a few samples resolve one time and no range
                value = replace(value, low=min(starts), high=max(starts))
        elif value.name == "drag_Nm":  # on the output, which turns against the input or with it
            value = replace(value, low=0.0) if ratio > 0 else replace(value, high=0.0)
        values.append(value)
    return replace(effect, values=tuple(values))


def start_points(effect: Effect, base: Base, ratio: float) -> list[FloatArray]:
    """Starts of all inner values, linear ones at zero; at most `STARTS_MAX`."""
    first = start_values(effect, given_values(base, ratio))
    linear = effect.indices("linear")
    shapes = effect.indices("shape")
    if not linear:
        return [first]
    first[linear] = 0.0
    every = list(product(*(grid(effect, i, base) for i in shapes)))
    keep = every if len(every) <= STARTS_MAX else every[:: -(-len(every) // STARTS_MAX)]
    points = []
    for combination in keep:
        values = first.copy()
        values[shapes] = combination
        points.append(values)
    return points


def tangent(effect: Effect, base: Base, point: Point, ratio: float) -> Candidate:
    """Columns of an effect that is not in the model yet."""
    c = base.conditions
    effect = resolved(effect, base, ratio)
    elastic = point.elastic * ARCSEC
    columns: list[FloatArray] = []
    start_of: list[int] = []
    starts = start_points(effect, base, ratio)
    linear = effect.indices("linear")
    if effect.name == "lobe_eccentricity":
        columns, starts = lobe_columns(effect, base, point, starts[0])
        start_of = [0, 0, *range(len(starts))]
    elif linear:
        units: list[tuple[FloatArray, int]] = []
        for number, values in enumerate(starts):
            for i in linear:
                unit = values.copy()
                unit[linear] = 0.0
                unit[i] = unit_size(effect, i)
                columns.append(
                    effect.run(unit, c, point.torque, elastic, point.wound) / ARCSEC / unit[i]
                )
                units.append((unit, i))
                start_of.append(number)
        if effect.kind != "angle":
            # What acts on the torque winds up the drive: through its friction, where it is soft.
            kept = distinct(columns)
            start_of = [start_of[k] for k in kept]
            columns = [wound_up(effect, base, *units[k], columns[k]) for k in kept]
    else:
        values = starts[0]
        for i in effect.indices("shape"):
            if effect.name == "ratcheting":
                starts = []
                for threshold in grid(effect, i, base):
                    slipped = values.copy()
                    slipped[i] = threshold
                    columns.append(
                        effect.run(slipped, c, point.torque, elastic, point.wound) / ARCSEC
                    )
                    start_of.append(len(starts))
                    starts.append(slipped)
                continue
            columns.append(difference(effect, i, base, point, values))
            start_of.append(0)
    kept = distinct(columns)
    matrix = side_by_side(*(columns[i] for i in kept)) if kept else np.zeros((c.rows, 0))
    return Candidate(
        effect.name,
        True,
        matrix,
        effect=effect,
        starts=starts,
        start_of=[start_of[i] for i in kept],
    )


def wound_up(
    effect: Effect, base: Base, unit: FloatArray, index: int, acts: FloatArray
) -> FloatArray:
    """Slope of the angle over a linear value that acts on torque or friction, as `acts` a unit."""
    peak = float(np.max(np.abs(acts))) * ARCSEC
    if not np.isfinite(peak) or peak == 0:
        return np.zeros_like(acts)
    small = unit.copy()
    small[index] *= 0.05
    if effect.kind == "torque":
        small[index] = SMALL * base.rated_torque_Nm / peak
    return slope_of_model(effect, base, small, index)


def unit_size(effect: Effect, index: int) -> float:
    """A size at which a linear value is evaluated."""
    value = effect.values[index]
    return float(value.typical or 1e-3 * value.high)


def difference(
    effect: Effect, index: int, base: Base, point: Point, values: FloatArray
) -> FloatArray:
    """Derivative at nothing by a value that has no linear form."""
    value = effect.values[index]
    step = 0.05 * abs(value.typical or value.high)
    if value.name == "lag_s":
        # A first-order lag far below the time between samples does nothing to them.
        elapsed = base.conditions.columns["elapsed_s"]
        step = float(np.median(elapsed[elapsed > 0])) if np.any(elapsed > 0) else step
    nothing = values.copy()
    nothing[effect.indices("shape")] = 0.0
    high, low = nothing.copy(), nothing.copy()
    high[index], low[index] = step, -step
    if effect.kind == "angle":
        c = base.conditions
        elastic = point.elastic * ARCSEC
        up = effect.run(high, c, point.torque, elastic, point.wound)
        down = effect.run(low, c, point.torque, elastic, point.wound)
        return np.asarray((up - down) / ARCSEC / (2 * step))
    return slope_of_model(effect, base, high, index)


def slope_of_model(effect: Effect, base: Base, high: FloatArray, index: int) -> FloatArray:
    """Slope of the whole model's angle over a value, between the value given and its mirror."""
    model = base.copy()
    term = Term(effect, high, [index])
    model.terms = [*model.terms, term]
    up = model.angle()
    term.values = high.copy()
    term.values[index] = -high[index]
    return np.asarray((up - model.angle()) / (2 * high[index]))


def lobe_columns(
    effect: Effect, base: Base, point: Point, values: FloatArray
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Run-out in four directions beside the plain first order; the run-out is no linear value."""
    c = base.conditions
    elastic = point.elastic * ARCSEC
    columns = []
    for i in effect.indices("linear"):
        unit = values.copy()
        unit[2:4] = 0.0
        unit[i] = unit_size(effect, i) or 1e-5
        columns.append(effect.run(unit, c, point.torque, elastic, point.wound) / ARCSEC / unit[i])
    starts = []
    for share, angle in product(CLOSING_SHARES, np.arange(4) * np.pi / 4):
        start = values.copy()
        start[0] = start[1] = 0.0
        start[2], start[3] = RUNOUT_RAD * np.cos(angle), RUNOUT_RAD * np.sin(angle)
        start[5] = share * base.rated_torque_Nm
        start[4] = CLOSING_ANGLE * RUNOUT_RAD / start[5]
        starts.append(start)
        column = effect.run(start, c, point.torque, elastic, point.wound)
        columns.append(column / ARCSEC / RUNOUT_RAD)
    return columns, starts


def distinct(columns: list[FloatArray]) -> list[int]:
    """Indices of the columns that are not multiples of one before."""
    kept: list[int] = []
    units: list[FloatArray] = []
    for i, column in enumerate(columns):
        norm = float(np.linalg.norm(column))
        if not np.isfinite(norm) or norm == 0:
            continue
        unit = column / norm
        if all(abs(float(unit @ other)) < 1 - 1e-9 for other in units):
            kept.append(i)
            units.append(unit)
    return kept


def named_candidates(
    effects: Mapping[str, Effect], base: Base, point: Point, ratio: float
) -> tuple[list[Candidate], dict[str, str]]:
    """Every effect that these recordings can show, and why the others are not testable."""
    c = base.conditions
    present = {term.effect.name for term in base.terms}
    out: list[Candidate] = []
    closed: dict[str, str] = {}
    for name, effect in effects.items():
        if name in present:
            continue
        missing = missing_columns(effect, c)
        if missing:
            closed[name] = "not testable with these columns: no " + ", ".join(missing)
            continue
        if name in LATENT and not varies(c, SEEN_BY.get(name)):
            closed[name] = "not testable: " + LATENT[name]
            continue
        candidate = tangent(effect, base, point, ratio)
        flat = constant_columns(effect, c)
        if candidate.columns.shape[1] == 0 or flat:
            why = f"constant {', '.join(flat)}" if flat else "it does nothing here"
            closed[name] = f"not visible with this plan: {why}"
            continue
        out.append(candidate)
    return out, closed
