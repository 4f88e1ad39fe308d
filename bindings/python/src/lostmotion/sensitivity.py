"""Sensitivity of a design to each dimension, and changes that repair failed checks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from lostmotion.drives import Drive, parse_drive
from lostmotion.errors import InputError, LostMotionError
from lostmotion.model import ADVICE, design_model
from lostmotion.units import ARCMIN, split_unit

DIMENSIONS = {
    "teeth.flexspline_shift": ("", 0.01),
    "teeth.rigid_shift": ("", 0.01),
    "teeth.tooth_height": ("", 0.01),
    "teeth.engagement_depth": ("", 0.01),
    "teeth.face_width_mm": ("mm", 0.05),
    "generator.deflection_mm": ("mm", 0.001),
    "flexspline.rim_thickness_mm": ("mm", 0.005),
    "flexspline.wall_thickness_mm": ("mm", 0.005),
    "flexspline.length_mm": ("mm", 0.05),
}
"""Dimensions of a drawing, each with its unit and the last digit that a drawing states."""

STEP = 1e-3
"""Step of a numerical derivative, in last digits of the drawing: 0.01 um, 1e-5 modules. The
rounding error of the derivative is below 1e-6 of it, and a kink of the figure is rarely so near."""

REACH = 10.0
"""Largest change for which a derivative is compared with the drive, in last digits: 0.1 modules."""

LINEAR = 0.1
"""A derivative holds as far as it predicts the change of the lost motion within 10 %."""

HALVINGS = 12
"""Bisections on a logarithmic scale from `STEP` to `REACH`: 0.2 % of the distance to the kink."""

MENDED_BY = (
    "teeth.flexspline_shift",
    "teeth.rigid_shift",
    "teeth.tooth_height",
    "teeth.engagement_depth",
    "flexspline.rim_thickness_mm",
    "teeth.face_width_mm",
)
"""Dimensions that a designer changes first."""

STEPS_MOST = 60
"""Largest change in a hint, in steps of the dimension: 0.6 modules of a shift, 3 mm of a face."""

OVERSHOOT = 1.1
"""Factor on the change that a linear extrapolation requires, because margins are nonlinear."""

HINTS_MOST = 3
"""Largest number of changes that are listed."""


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of a design's figures by one dimension, per unit of it.

    The lost motion has kinks: where the free play becomes zero, or another section of the face
    begins to touch, its derivative is another.

    Attributes
    ----------
    key, unit : str
        Of the dimension.
    value : float
        In the drive file.
    lost_motion_arcmin, stiffness_Nm_per_rad, stress : float
        Derivatives.
    holds_from, holds_to : float or None
        Values of the dimension between which the derivative predicts the change of the lost
        motion within 10 %; None on a side where it does so as far as it was examined, `REACH` last
        digits of the drawing. Both equal `value` if the drive is at a kink.
    """

    key: str
    unit: str
    value: float
    lost_motion_arcmin: float
    stiffness_Nm_per_rad: float
    stress: float
    holds_from: float | None
    holds_to: float | None


def with_value(drive: Drive, key: str, value: float) -> Drive:
    """Return the drive with one number of its file replaced.

    Parameters
    ----------
    key : str
        Dotted key of [design], or of [drive] with ``drive.`` before it.

    Raises
    ------
    InputError
        When there is no such key, or the value is refused.
    """
    return with_values(drive, {key: value})


def with_values(drive: Drive, values: Mapping[str, float]) -> Drive:
    """Return the drive with several numbers of its file replaced; keys as for `with_value`."""
    document = _copied_tables(drive.document)
    for key, value in values.items():
        _replace(document, key, value, drive.file)
    return parse_drive(document, drive.file)


def _copied_tables(document: Mapping[str, Any]) -> dict[str, Any]:
    """Copy the tables of a file; arrays, in which no number is replaced, are shared."""
    return {
        key: _copied_tables(value) if isinstance(value, dict) else value
        for key, value in document.items()
    }


def _replace(document: dict[str, Any], key: str, value: float, file: str) -> None:
    """Write a number, in place of the same one in another unit."""
    section, _, name = key.rpartition(".")
    table = document if section == "drive" else document.get("design", {})
    for part in section.split(".") if section else ():
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            found = f"'{key}', which is in no table"
            raise InputError(file, key, found, "a key such as teeth.face_width_mm")
    stem = split_unit(name)[0]
    for written in [w for w in table if w != name and split_unit(w)[0] == stem]:
        del table[written]
    whole = not isinstance(table.get(name), float) and value == int(value)
    table[name] = int(value) if whole else value


def stated(drive: Drive, key: str) -> float | None:
    """Return the number in the file for a key; None if it has none."""
    table, name = key.split(".")
    found = drive.document.get("design", {}).get(table, {})
    value = found.get(name) if isinstance(found, Mapping) else None
    return float(value) if isinstance(value, int | float) and value is not True else None


def lost_motion_of(drive: Drive, reversal_Nm: float) -> float:
    """Reversal lost motion in arcmin."""
    return design_model(drive).reversal_lost_motion(reversal_Nm) / ARCMIN


def figures_of(drive: Drive, reversal_Nm: float) -> tuple[float, float, float]:
    """Lost motion in arcmin, stiffness at rated torque, and 1 / fatigue safety."""
    model = design_model(drive)
    stiffness = float(model.torsion_curve([drive.rated_torque_Nm]).stiffness_Nm_per_rad[0])
    safety = next(c.value for c in model.checks() if c.name == "safety_factor")
    return model.reversal_lost_motion(reversal_Nm) / ARCMIN, stiffness, 1.0 / safety


def sensitivities(drive: Drive, reversal_Nm: float) -> list[Sensitivity]:
    """Differentiate by every dimension that the file states, by central differences."""
    found = []
    for key, (unit, digit) in DIMENSIONS.items():
        value = stated(drive, key)
        if value is None:
            continue
        step = STEP * digit
        try:
            high = figures_of(with_value(drive, key, value + step), reversal_Nm)
            low = figures_of(with_value(drive, key, value - step), reversal_Nm)
        except LostMotionError:
            continue  # at the end of its range, or where no drive can be built
        slopes = [(a - b) / (2.0 * step) for a, b in zip(high, low, strict=True)]
        if not all(math.isfinite(slope) for slope in slopes):
            continue
        line = Line(drive, key, value, slopes[0], reversal_Nm)
        ends = [line.end(side * digit) for side in (-1.0, 1.0)]
        found.append(Sensitivity(key, unit, value, *slopes, *ends))
    return found


class Line:
    """The straight line by which a derivative predicts the lost motion of a changed drive."""

    def __init__(
        self, drive: Drive, key: str, value: float, slope: float, reversal_Nm: float
    ) -> None:
        self.drive, self.key, self.value, self.slope = drive, key, value, slope
        self.reversal_Nm = reversal_Nm
        self.here = lost_motion_of(drive, reversal_Nm)

    def holds(self, change: float) -> bool:
        """Whether the line predicts a change within `LINEAR`; also if there is no such drive."""
        try:
            other = with_value(self.drive, self.key, self.value + change)
            moved = lost_motion_of(other, self.reversal_Nm) - self.here
        except LostMotionError:
            return True
        # Rounding of the model: a figure that does not depend on the dimension has no kink.
        least = 1e-9 * abs(self.here)
        return abs(moved - self.slope * change) <= LINEAR * abs(self.slope * change) + least

    def end(self, digit: float) -> float | None:
        """Value of the dimension up to which the line holds, towards the sign of `digit`."""
        if self.holds(REACH * digit):
            return None
        if not self.holds(STEP * digit):
            return self.value
        kept, broken = STEP, REACH
        for _ in range(HALVINGS):
            middle = math.sqrt(kept * broken)
            kept, broken = (middle, broken) if self.holds(middle * digit) else (kept, middle)
        return self.value + kept * digit


@dataclass(frozen=True)
class Hint:
    """A change of one dimension, and the checks that still fail after it."""

    key: str
    unit: str
    value: float
    to: float
    broken: tuple[str, ...]


def hints(drive: Drive) -> list[Hint]:
    """List changes of one dimension that repair failed checks.

    Each change was evaluated. Changes after which all checks pass come first, then those with the
    fewest failed checks, each ordered by the size of the change; changes without improvement are
    not listed.
    """
    now = margins(drive)
    missed = {name: margin for name, margin in (now or {}).items() if margin < 0}
    found: dict[str, tuple[int, float, Hint]] = {}
    for key in MENDED_BY if missed else ():
        value = stated(drive, key)
        unit, step = DIMENSIONS[key]
        near = None if value is None else margins(drive, key, value + step)
        if value is None or near is None:
            continue
        for name, margin in missed.items():
            slope = (near[name] - margin) / step
            move = -OVERSHOOT * margin / slope if slope else math.inf
            if abs(move) > STEPS_MOST * step:
                continue
            to = value + math.copysign(math.ceil(abs(move) / step) * step, move)
            after = margins(drive, key, to)
            if after is None or after[name] < 0:
                continue
            left = tuple(n for n, m in after.items() if m < 0)
            rank = (len(left), abs(move) / step, Hint(key, unit, value, to, left))
            if len(left) < len(missed) and (key not in found or rank[:2] < found[key][:2]):
                found[key] = rank
    return [hint for _, _, hint in sorted(found.values(), key=lambda r: r[:2])[:HINTS_MOST]]


def margins(drive: Drive, key: str | None = None, value: float = 0.0) -> dict[str, float] | None:
    """Margins of all checks but recommendations for a changed dimension; None if refused."""
    try:
        there = drive if key is None else with_value(drive, key, value)
        checks = design_model(there).checks()
    except LostMotionError:
        return None
    return {c.name: c.margin for c in checks if c.name not in ADVICE}


def hint_sentence(hint: Hint) -> str:
    """Write a hint as a sentence."""
    unit = f" {hint.unit}" if hint.unit else ""
    state = f"still failing: {', '.join(hint.broken)}" if hint.broken else "every check passes"
    return f"with {hint.key} = {hint.to:.4g}{unit} (now {hint.value:.4g}{unit}) {state}"
