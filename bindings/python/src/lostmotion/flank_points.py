"""A flank given as points: a list in the drive file, or a measured profile in a CSV or DXF file.

A point is half the thickness x of a flexspline's tooth, or half the width of a circular spline's
space, and the distance y from the gear's centre along its axis, in mm, on the undeformed gear. A
cubic spline goes through all of them.
"""

from __future__ import annotations

import csv
import functools
import itertools
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.core import Bits, core
from lostmotion.errors import InputError
from lostmotion.files import TEXT_BYTES_MAX, read_bytes
from lostmotion.keys import as_in_file

Points = tuple[tuple[float, float], ...]

PREFIXES = {"flexspline": "", "rigid": "rigid_"}
"""Beginning of the keys of a gear."""

KEYS = tuple(f"{before}points{end}" for before in PREFIXES.values() for end in ("", "_file"))
"""Keys of [design.flank] in addition to those of the library."""

LEAST = 4
"""Least number of points: a cubic has four coefficients."""


def place_of(gear: str) -> str:
    """Dotted key of the points of a gear."""
    return f"design.flank.{PREFIXES[gear]}points"


def read_points(file: str, table: Mapping[str, Any], gear: str) -> Points | None:
    """Points of a gear in a table [design.flank], in the order of rising y; None if it has none.

    Raises
    ------
    InputError
        Both points and a file, no pairs of numbers, or points that do not form a flank.
    """
    listed, place = f"{PREFIXES[gear]}points", place_of(gear)
    if listed in table and f"{listed}_file" in table:
        raise InputError(file, place, f"{listed} and {listed}_file", "one of them")
    if f"{listed}_file" in table:
        name = table[f"{listed}_file"]
        if not isinstance(name, str):
            raise InputError(file, f"{place}_file", as_in_file(name), "the name of a file")
        path = Path(file).parent / name
        pairs = _from_dxf(path) if path.suffix.lower() == ".dxf" else _from_csv(path)
        return _checked(str(path), "points", pairs)
    if listed not in table:
        return None
    rows = table[listed]
    if not isinstance(rows, list) or not all(isinstance(r, list) and len(r) == 2 for r in rows):
        raise InputError(file, place, as_in_file(rows), "pairs [x, y] in mm")
    if any(isinstance(v, bool) or not isinstance(v, (int, float)) for r in rows for v in r):
        raise InputError(file, place, as_in_file(rows), "pairs [x, y] of numbers in mm")
    return _checked(file, place, [(float(x), float(y)) for x, y in rows])


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


def _from_dxf(path: Path) -> list[tuple[float, float]]:
    """Vertices of the first polyline, group codes 10 and 20, in mm."""
    lines = [line.strip() for line in _text(path, "a DXF file in ASCII").splitlines()]
    pairs: list[tuple[float, float]] = []
    inside, x = False, math.nan
    for code, value in zip(lines[::2], lines[1::2], strict=False):
        if code == "0":
            if pairs and value not in ("VERTEX", "SEQEND"):
                break
            inside = value in ("LWPOLYLINE", "VERTEX")
        elif inside and code in ("10", "20"):
            try:
                number = float(value)
            except ValueError:
                raise InputError(path, f"group {code}", value, "a number") from None
            if code == "10":
                x = number
            else:
                pairs.append((x, number))
    return pairs


def _checked(file: str, place: str, pairs: list[tuple[float, float]]) -> Points:
    most = core().lib.LM_FLANK_POINTS_MAX
    if not LEAST <= len(pairs) <= most:
        raise InputError(file, place, f"{len(pairs)} points", f"{LEAST} to {most}")
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
