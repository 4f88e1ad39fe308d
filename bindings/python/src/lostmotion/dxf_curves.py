"""The curve of a DXF file, in mm: one polyline, or lines, arcs and splines that join end to end."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from lostmotion.errors import InputError

Pairs = list[tuple[float, float]]

MM_PER_UNIT = {
    0: 1.0,
    1: 25.4,
    2: 304.8,
    4: 1.0,
    5: 10.0,
    6: 1e3,
    8: 25.4e-6,
    9: 25.4e-3,
    10: 914.4,
    13: 1e-3,
    14: 100.0,
}
"""Lengths of the header variable $INSUNITS, AutoCAD DXF reference; 0, no unit, is taken as mm."""

JOINT_MM = 1e-4
"""Largest distance of two ends that join, the last digit of a drawing."""

CHORD_MM = JOINT_MM / 10
"""Largest distance of a spline or arc from the chords between its points: no digit shows it."""

CURVES = ("LINE", "ARC", "SPLINE", "ELLIPSE", "LWPOLYLINE", "POLYLINE")
"""Entities that can be part of a curve."""


def read_curve(path: Path, text: str) -> Pairs:
    """Points of the curve, in order.

    Parameters
    ----------
    path : Path
    text : str
        Its content: DXF in ASCII.

    Raises
    ------
    InputError
        For an unknown unit, or pieces that do not join. Without ezdxf, for any curve but one
        polyline of straight lines alone in its file.
    """
    lines = [line.strip() for line in text.splitlines()]
    groups = list(zip(lines[::2], lines[1::2], strict=False))
    scale = _scale(path, groups)
    pairs, straight = _polyline(path, groups)
    alone = sum(code == "0" and value in CURVES for code, value in groups) == 1
    if not (pairs and straight and alone):
        pairs = _joined(path, list(_pieces(path, scale)), scale)
    return [(scale * x, scale * y) for x, y in pairs]


def _scale(path: Path, groups: list[tuple[str, str]]) -> float:
    """Return mm per unit of the drawing."""
    at = next((i for i, group in enumerate(groups) if group == ("9", "$INSUNITS")), None)
    if at is None or at + 1 >= len(groups):
        return 1.0
    code = groups[at + 1][1]
    known = {str(unit): length for unit, length in MM_PER_UNIT.items()}
    if code not in known:
        raise InputError(path, "$INSUNITS", code, f"one of {', '.join(known)} (4: mm, 1: inch)")
    return known[code]


def _polyline(path: Path, groups: list[tuple[str, str]]) -> tuple[Pairs, bool]:
    """Vertices of the first polyline, and whether no segment is an arc (group code 42)."""
    pairs: Pairs = []
    inside, straight, x = False, True, math.nan
    for code, value in groups:
        if code == "0":
            if pairs and value not in ("VERTEX", "SEQEND"):
                break
            inside = value in ("LWPOLYLINE", "VERTEX")
        elif inside and code in ("10", "20", "42"):
            try:
                number = float(value)
            except ValueError:
                raise InputError(path, f"group {code}", value, "a number") from None
            if code == "10":
                x = number
            elif code == "20":
                pairs.append((x, number))
            elif number != 0.0:
                straight = False
    return pairs, straight


def _pieces(path: Path, scale: float) -> Iterator[Pairs]:
    """Points of every line, arc, spline and polyline of the model space."""
    try:
        import ezdxf
        from ezdxf.path import make_path
    except ImportError:
        expected = "one polyline; lines, arcs and splines need pip install 'lostmotion[dxf]'"
        raise InputError(path, "", "no polyline of straight lines", expected) from None
    try:
        space = ezdxf.readfile(path).modelspace()  # type: ignore[attr-defined]
    except (OSError, ezdxf.DXFError) as error:  # type: ignore[attr-defined]
        raise InputError(path, "", f"DXF that ezdxf refuses ({error})", "a DXF file") from None
    for entity in space:
        if entity.dxftype() in CURVES:
            vertices = make_path(entity).flattening(CHORD_MM / scale)
            yield [(float(v.x), float(v.y)) for v in vertices]


def _joined(path: Path, pieces: list[Pairs], scale: float) -> Pairs:
    """Join pieces end to end."""
    if not pieces:
        raise InputError(path, "", "no curve", f"a curve of {', '.join(CURVES)}")
    curve, *rest = pieces
    while rest:
        for i, piece in enumerate(rest):
            turned = piece[::-1]
            for one in (piece, turned):
                if math.dist(curve[-1], one[0]) * scale <= JOINT_MM:
                    curve = curve + one[1:]
                    break
                if math.dist(curve[0], one[-1]) * scale <= JOINT_MM:
                    curve = one[:-1] + curve
                    break
            else:
                continue
            del rest[i]
            break
        else:
            found = f"{len(pieces)} pieces that do not join, the nearest ends further apart"
            raise InputError(path, "", found, f"one curve, its ends within {JOINT_MM:g} mm")
    return curve
