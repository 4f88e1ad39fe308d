"""Several drives, or one drive with a varied dimension, side by side: one row each."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.drives import Drive, read_drive
from lostmotion.errors import InputError, LostMotionError
from lostmotion.files import csv_text
from lostmotion.model import ADVICE, design_model, reversal_torque, secant_stiffness
from lostmotion.results import data_frame, figures
from lostmotion.sensitivity import stated, with_values
from lostmotion.units import ARCMIN

Row = dict[str, Any]

FIGURES = (
    "reversal_lost_motion_arcmin",
    "worst_lost_motion_arcmin",
    "angle_at_rated_arcmin",
    "stiffness_at_rated_Nm_per_rad",
    "secant_stiffness_Nm_per_rad",
    "free_play_arcmin",
    "safety_factor",
    "ratcheting_torque_Nm",
    "flank_pressure_MPa",
    "bearing_life_h",
)
"""Numbers of a row; a catalogue drive has the first and the third to fifth.

The stiffness at rated torque is the tangent there."""

HEAD = ("drive", "ratio", "rated_torque_Nm")

DRAWN = FIGURES[0], FIGURES[3], FIGURES[6]
"""Figures that a sweep draws: lost motion, stiffness and safety factor."""


class SideBySide(dict[str, Any]):
    """Answer of `tabulate` and `sweep`: ``swept`` (a key, or None) and ``rows``."""

    def columns(self) -> list[str]:
        """Names of the columns."""
        swept = [self["swept"]] if self["swept"] else []
        return [*swept, *HEAD, *FIGURES, "checks_not_kept", "refused"]

    def to_dataframe(self) -> Any:
        """Return a pandas data frame with one row per drive."""
        return data_frame({n: [row[n] for row in self["rows"]] for n in self.columns()})

    def csv(self) -> str:
        """Return the table as CSV; numbers keep every digit."""
        names = self.columns()
        cells = (["" if row[n] is None else row[n] for n in names] for row in self["rows"])
        return csv_text(names, cells)

    def plot(self) -> Any:
        """Plot lost motion over the varied dimension, or over stiffness (Plotly figure)."""
        across = self["swept"] or DRAWN[1]
        rows = [row for row in self["rows"] if None not in (row[across], row[DRAWN[0]])]
        x, y = ([float(row[name]) for row in rows] for name in (across, DRAWN[0]))
        return figures.points(x, y, "Side by side", (across, DRAWN[0]))


def tabulate(drives: Iterable[Drive | str | Path]) -> SideBySide:
    """Return the figures of several drives, one row each.

    Parameters
    ----------
    drives : iterable of Drive, str or Path
        Drives, or their files.

    Raises
    ------
    InputError
        If all of them are refused; if some are accepted, the rows of the others state the reason.
    """

    def row_of(drive: Drive | str | Path) -> dict[str, Any]:
        return drive_row(drive if isinstance(drive, Drive) else read_drive(drive))

    listed = list(drives)
    names = [one.name if isinstance(one, Drive) else str(one) for one in listed]
    rows = rows_of(names, [functools.partial(row_of, one) for one in listed])
    return SideBySide(schema="lostmotion.table/1", swept=None, rows=rows)


def rows_of(names: Sequence[str], made: Sequence[Callable[[], dict[str, Any]]]) -> list[Row]:
    """Make rows; that of a refused drive states its name and the reason.

    Raises
    ------
    InputError
        If all are refused: the reason of the first.
    """
    rows: list[Row] = []
    errors: list[LostMotionError] = []
    for name, make in zip(names, made, strict=True):
        try:
            rows.append(make())
        except LostMotionError as error:
            errors.append(error)
            empty = dict.fromkeys((*HEAD, *FIGURES, "checks_not_kept"))
            rows.append({**empty, "drive": name, "refused": str(error)})
    if errors and len(errors) == len(rows):
        raise errors[0]
    return rows


def sweep(drive: Drive, key: str, values: Sequence[float]) -> SideBySide:
    """Return the figures of a drive for several values of one key.

    With the teeth of one gear, those of the other gear and the ratio change, because the difference
    of the two gears is the number of lobes.

    Parameters
    ----------
    key : str
        Dotted key of [design], or of [drive] with ``drive.`` before it; the unit as its suffix.
    values : sequence of float

    Raises
    ------
    InputError
        If the library refuses all of them; if it accepts some, the rows of the others state the
        reason.
    """

    def row_of(value: float) -> dict[str, Any]:
        return drive_row(with_values(drive, {key: value, **_following(drive, key, value)}))

    wanted = [float(value) for value in values]
    made = rows_of([drive.name] * len(wanted), [functools.partial(row_of, one) for one in wanted])
    rows = [{key: value, **row} for value, row in zip(wanted, made, strict=True)]
    return SideBySide(schema="lostmotion.table/1", swept=key, rows=rows)


def _following(drive: Drive, key: str, value: float) -> dict[str, float]:
    """Values that follow from the teeth of one gear: those of the other, and the ratio."""
    other = {"flexspline_teeth": "rigid_teeth", "rigid_teeth": "flexspline_teeth"}
    table, _, name = key.rpartition(".")
    before = stated(drive, key) if table == "teeth" and name in other else None
    mate = stated(drive, f"teeth.{other[name]}") if before is not None else None
    if before is None or mate is None or mate == before:
        return {}
    more, lobes = value - before, abs(mate - before)
    ratio = drive.ratio + math.copysign(1.0, drive.ratio) * more / lobes
    return {f"teeth.{other[name]}": mate + more, "drive.ratio": ratio}


def drive_row(drive: Drive) -> dict[str, Any]:
    """Figures of one drive."""
    row: dict[str, Any] = dict.fromkeys((*HEAD, *FIGURES))
    rated = drive.rated_torque_Nm
    row |= {"drive": drive.name, "ratio": drive.ratio, "rated_torque_Nm": rated}
    at = reversal_torque(drive)
    broken = ""
    if drive.catalogue is not None:
        sheet = drive.catalogue
        reversal = sheet.reversal_lost_motion(at)
        turned, stiffness = sheet.angle([rated]), sheet.stiffness([rated])
    else:
        model = design_model(drive)
        found = model.torsion_curve([rated])
        turned, stiffness = found.total_rad, found.stiffness_Nm_per_rad
        reversal = model.reversal_lost_motion(at)
        gap_mm = model.tolerance_limits()["worst_max"]
        checks = {check.name: check for check in model.checks()}
        row |= {
            "worst_lost_motion_arcmin": model.reversal_lost_motion(at, 0.0, gap_mm) / ARCMIN,
            "free_play_arcmin": 2.0 * model.mesh_state()["free_play_rad"] / ARCMIN,
            "safety_factor": checks["safety_factor"].value,
            "ratcheting_torque_Nm": checks["ratcheting_torque"].value,
            "flank_pressure_MPa": checks["flank_pressure"].value,
            "bearing_life_h": checks["bearing_life"].value,
        }
        kept = [name for name, c in checks.items() if c.margin < 0 and name not in ADVICE]
        broken = " ".join(kept)
    row["reversal_lost_motion_arcmin"] = reversal / ARCMIN
    row["angle_at_rated_arcmin"] = float(np.asarray(turned)[0]) / ARCMIN
    row["stiffness_at_rated_Nm_per_rad"] = float(np.asarray(stiffness)[0])
    row["secant_stiffness_Nm_per_rad"] = secant_stiffness(drive)
    numbers = {name: finite(row[name]) for name in FIGURES}
    return {**row, **numbers, "checks_not_kept": broken, "refused": ""}


def finite(value: float | None) -> float | None:
    """Return a number that JSON can hold, None where there is none."""
    return float(value) if value is not None and np.isfinite(value) else None


SWEEP_MOST = 1001
"""Largest number of values of a sweep."""


def read_sweep(text: str) -> tuple[str, list[float]]:
    """Read ``KEY=FROM:TO:N``.

    Raises
    ------
    InputError
        If it is invalid.
    """
    key, equals, numbers = text.partition("=")
    parts = numbers.split(":")
    expected = f"KEY=FROM:TO:N, such as teeth.face_width_mm=8:12:5, N from 2 to {SWEEP_MOST}"
    try:
        if not (key.strip() and equals and len(parts) == 3):
            raise ValueError
        low, high, count = float(parts[0]), float(parts[1]), int(parts[2])
    except ValueError:
        raise InputError("--sweep", "", f"'{text}'", expected) from None
    if not (np.isfinite(low) and np.isfinite(high) and low != high and 2 <= count <= SWEEP_MOST):
        raise InputError("--sweep", "", f"'{text}'", expected)
    return key.strip(), [float(value) for value in np.linspace(low, high, count)]
