"""A flank given as points: a list in the drive file, or a measured profile in a CSV or DXF file.

A point is half the thickness x of a flexspline's tooth, or half the width of a circular spline's
space, and the distance y from the gear's centre along its axis, in mm, on the undeformed gear. A
cubic spline goes through all of them, unless a tolerance smooths them or there are more than the
library takes; remarks state which, and how far the points scatter.
"""

from __future__ import annotations

import csv
import functools
import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.core import Bits, core
from lostmotion.dxf_curves import read_curve
from lostmotion.errors import InputError
from lostmotion.files import TEXT_BYTES_MAX, read_bytes
from lostmotion.keys import Key, TableEntry, as_in_file
from lostmotion.rms import robust_rms

Points = tuple[tuple[float, float], ...]

PREFIXES = {"flexspline": "", "rigid": "rigid_"}
"""Beginning of the keys of a gear."""

KEYS = tuple(f"{before}points{end}" for before in PREFIXES.values() for end in ("", "_file"))
"""Keys of [design.flank] in addition to those of the library."""

TOLERANCES = tuple(
    Key(f"{before}points_tolerance", unit="mm", above=0.0) for before in PREFIXES.values()
)
"""Keys of the scatter that a smooth curve may leave."""

SCATTER_POINTS = 9
"""Least number of points whose scatter is estimated: five differences of fourth order."""

LEAST = 4
"""Least number of points: a cubic has four coefficients."""


def place_of(gear: str) -> str:
    """Dotted key of the points of a gear."""
    return f"design.flank.{PREFIXES[gear]}points"


@dataclass(frozen=True)
class FlankPoints:
    """Points in the order of rising y, and what was done to those of the file."""

    points: Points
    remarks: tuple[str, ...]


def read_points(
    file: str, table: Mapping[str, Any], gear: str, read: Mapping[str, TableEntry]
) -> FlankPoints | None:
    """Points of a gear in a table [design.flank]; None if it has none.

    Parameters
    ----------
    file : str
        The drive file.
    table : dict
        The table as in the file.
    gear : str
        One of `PREFIXES`.
    read : dict
        Its keys `TOLERANCES`, read.

    Raises
    ------
    InputError
        Both points and a file, no pairs of numbers, or points that do not form a flank.
    """
    listed, place = f"{PREFIXES[gear]}points", place_of(gear)
    stated = read.get(f"{listed}_tolerance")
    tolerance_mm = None if stated is None else float(stated.value)
    if listed in table and f"{listed}_file" in table:
        raise InputError(file, place, f"{listed} and {listed}_file", "one of them")
    if f"{listed}_file" in table:
        name = table[f"{listed}_file"]
        if not isinstance(name, str):
            raise InputError(file, f"{place}_file", as_in_file(name), "the name of a file")
        path = Path(file).parent / name
        if path.suffix.lower() == ".dxf":
            pairs = read_curve(path, _text(path, "a DXF file in ASCII"))
        else:
            pairs = _from_csv(path)
        return _fitted(gear, _checked(str(path), "points", pairs), tolerance_mm)
    if listed not in table:
        if stated is not None:
            raise InputError(file, stated.place, "a tolerance of no points", f"{listed} with it")
        return None
    rows = table[listed]
    if not isinstance(rows, list) or not all(isinstance(r, list) and len(r) == 2 for r in rows):
        raise InputError(file, place, as_in_file(rows), "pairs [x, y] in mm")
    if any(isinstance(v, bool) or not isinstance(v, (int, float)) for r in rows for v in r):
        raise InputError(file, place, as_in_file(rows), "pairs [x, y] of numbers in mm")
    pairs = [(float(x), float(y)) for x, y in rows]
    return _fitted(gear, _checked(file, place, pairs), tolerance_mm)


def _text(path: Path, expected: str) -> str:
    try:
        return read_bytes(path, expected, TEXT_BYTES_MAX).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(path, "", "bytes that are not UTF-8", expected) from None


def _from_csv(path: Path) -> list[tuple[float, float]]:
    """Two columns x and y, with or without a line of names."""
    pairs = []
    for number, row in enumerate(csv.reader(_text(path, "a CSV file").splitlines()), 1):
        if not row:
            continue
        try:
            x, y = (float(cell) for cell in row)
        except ValueError:
            if number == 1:
                continue
            raise InputError(path, f"line {number}", ",".join(row), "x and y in mm") from None
        pairs.append((x, y))
    return pairs


def _checked(file: str, place: str, pairs: list[tuple[float, float]]) -> Points:
    if len(pairs) < LEAST:
        raise InputError(file, place, f"{len(pairs)} points", f"{LEAST} or more")
    if not all(math.isfinite(value) for pair in pairs for value in pair):
        raise InputError(file, place, "a value that is not finite", "numbers in mm")
    if pairs[0][1] > pairs[-1][1]:
        pairs = pairs[::-1]
    for (_, lower), (_, upper) in itertools.pairwise(pairs):
        if not upper > lower:
            raise InputError(
                file,
                place,
                f"y = {lower:.6g} mm and then {upper:.6g} mm",
                "points of one flank, from root to tip or back: y only rises or only falls",
            )
    low = min(pairs)[0]
    if not low > 0:
        raise InputError(
            file, place, f"x = {low:.6g} mm", "half a thickness or width, more than 0 mm"
        )
    return tuple(pairs)


def _fitted(gear: str, points: Points, tolerance_mm: float | None) -> FlankPoints:
    """Smooth or resample the points as far as necessary, and state it."""
    from scipy.interpolate import CubicSpline, UnivariateSpline  # as below

    most = int(core().lib.LM_FLANK_POINTS_MAX)
    x, y = np.array(points).T
    remarks = []
    scatter = scatter_mm(points)
    if scatter is not None:
        slope = math.degrees(math.atan(math.sqrt(2) * scatter / float(np.median(np.diff(y)))))
        remarks.append(
            f"The {len(points)} points of the {gear}'s flank scatter by about "
            f"{1e3 * scatter:.2g} um (standard deviation) about a smooth curve, the direction of a "
            f"chord by {slope:.2g} deg."
        )
    if tolerance_mm is not None:
        smooth = UnivariateSpline(y, x, k=3, s=len(points) * tolerance_mm**2)
        left = x - smooth(y)
        rms, largest = float(np.sqrt(np.mean(left**2))), float(np.max(np.abs(left)))
        at = np.linspace(y[0], y[-1], most)
        across = smooth(at)
        remarks.append(
            f"The {gear}'s flank is a smooth curve of {len(smooth.get_knots()) - 1} cubics: the "
            f"points are {1e3 * rms:.2g} um (root mean square) and at most {1e3 * largest:.2g} um "
            f"from it, by {PREFIXES[gear]}points_tolerance."
        )
    elif len(points) > most:
        at = y[np.round(np.linspace(0, len(points) - 1, most)).astype(int)]
        across = CubicSpline(y, x)(at)
        largest = float(np.max(np.abs(CubicSpline(at, across)(y) - x)))
        remarks.append(
            f"The spline of the {gear}'s flank goes through {most} of the {len(points)} points, "
            f"and is at most {1e3 * largest:.2g} um from the others."
        )
    else:
        remarks.append(f"The spline of the {gear}'s flank goes through every point.")
        return FlankPoints(points, tuple(remarks))
    kept = tuple((float(a), float(b)) for a, b in zip(across, at, strict=True))
    return FlankPoints(kept, tuple(remarks))


def scatter_mm(points: Points) -> float | None:
    """Estimate the standard deviation of the points about a smooth curve.

    From the fourth divided differences of x over y, each over the norm of its weights: those of a
    smooth curve vanish, those of noise are its standard deviation. Their median does not see the
    few that contain a corner. None for fewer than `SCATTER_POINTS`.
    """
    if len(points) < SCATTER_POINTS:
        return None
    x, y = np.array(points).T
    windows = np.lib.stride_tricks.sliding_window_view
    heights, across = windows(y, 5), windows(x, 5)
    apart = heights[:, :, None] - heights[:, None, :] + np.eye(5)
    weights = 1.0 / np.prod(apart, axis=2)
    return robust_rms(np.sum(weights * across, axis=1) / np.sqrt(np.sum(weights**2, axis=1)))


@functools.cache
def flank_points(points: Points, bits: Bits = 64) -> Any:
    """Make the `lm_flank_points` of a spline through the points.

    It lives as long as the process, because a drive points to it.
    """
    c = core(bits)
    made = c.ffi.new("lm_flank_points *")
    x, y = np.array(points).T
    from scipy.interpolate import CubicSpline  # drives without points need no SciPy

    slope = CubicSpline(y, x)(y, 1)
    made.count = len(points)
    for i in range(len(points)):
        made.along_mm[i], made.across_mm[i], made.slope[i] = y[i], x[i], slope[i]
    return made
