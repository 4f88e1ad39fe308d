"""Points of a flank: how far they scatter, what a tolerance smooths, and curves of DXF files."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest

from lostmotion.errors import InputError
from lostmotion.flank_points import FlankPoints, read_points, scatter_mm
from lostmotion.keys import TableEntry

HEIGHTS = np.linspace(24.0, 25.2, 41)

Array = np.ndarray[Any, np.dtype[np.float64]]


def flank(y: Array) -> Array:
    """A convex tip above a concave root, 0.6 mm half thickness."""
    return 0.6 - 0.35 * (y - 24.0) - 0.04 * np.sin(2.6 * (y - 24.6))


def read(pairs: Array, tolerance_mm: float | None = None) -> FlankPoints:
    entries = {}
    if tolerance_mm is not None:
        entries["points_tolerance"] = TableEntry(tolerance_mm, "design.flank.points_tolerance_mm")
    found = read_points("drive.toml", {"points": pairs.tolist()}, "flexspline", entries)
    assert found is not None
    return found


def slope_error(found: FlankPoints) -> float:
    """Root mean square error of the slope of the spline through the points."""
    from scipy.interpolate import CubicSpline

    x, y = np.array(found.points).T
    at = np.linspace(24.05, 25.15, 500)
    made, true = CubicSpline(y, x)(at, 1), np.gradient(flank(at), at)
    return float(np.sqrt(np.mean((made - true) ** 2)))


def test_the_scatter_of_points_is_stated_and_a_tolerance_removes_it() -> None:
    clean = np.column_stack([flank(HEIGHTS), HEIGHTS])
    exact = scatter_mm(tuple(map(tuple, clean.tolist())))
    assert exact is not None
    assert exact < 5e-5
    found = []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        noisy = clean + np.column_stack([rng.normal(0, 0.002, HEIGHTS.size), 0 * HEIGHTS])
        plain, smooth = read(noisy), read(noisy, 0.002)
        stated = re.search(r"scatter by about ([\d.]+) um", plain.remarks[0])
        assert stated is not None
        found.append(float(stated[1]))
        assert "goes through every point" in plain.remarks[1]
        assert slope_error(smooth) < 0.4 * slope_error(plain)
        left = re.search(r"points are ([\d.]+) um", smooth.remarks[1])
        assert left is not None
        assert float(left[1]) <= 2.0
    assert np.mean(found) == pytest.approx(2.0, rel=0.3)


def test_more_points_than_the_library_takes_are_resampled_with_the_stated_error() -> None:
    y = np.linspace(24.0, 25.2, 401)
    found = read(np.column_stack([flank(y), y]))
    assert len(found.points) == 129
    stated = re.search(r"at most ([\de.+-]+) um from the others", found.remarks[1])
    assert stated is not None
    assert float(stated[1]) < 1e-3
    x, heights = np.array(found.points).T
    assert x == pytest.approx(flank(heights), abs=1e-12)


def drawn(path: Path, kind: str, unit: int, scale: float) -> Path:
    document = ezdxf.new()
    document.header["$INSUNITS"] = unit
    space = document.modelspace()
    points = np.column_stack([flank(HEIGHTS), HEIGHTS]) / scale
    if kind == "lines":
        pieces = list(zip(points[:-1].tolist(), points[1:].tolist(), strict=True))
        for i in np.random.default_rng(3).permutation(len(pieces)):
            ends = pieces[i] if i % 2 else pieces[i][::-1]
            space.add_line(*ends)
    elif kind == "spline":
        space.add_spline([(*p, 0.0) for p in points.tolist()])
    elif kind == "arc":
        space.add_lwpolyline(
            [(0.6 / scale, 24 / scale, 0.1), (0.3 / scale, 25 / scale, 0.0)], "xyb"
        )
    else:
        space.add_lwpolyline(points.tolist())
    document.saveas(path)
    return path


@pytest.mark.parametrize(("unit", "scale"), [(4, 1.0), (1, 25.4), (6, 1000.0)])
@pytest.mark.parametrize("kind", ["polyline", "lines", "spline"])
def test_curves_of_a_dxf_have_its_unit(tmp_path: Path, kind: str, unit: int, scale: float) -> None:
    drawn(tmp_path / "tooth.dxf", kind, unit, scale)
    table = {"points_file": "tooth.dxf"}
    found = read_points(str(tmp_path / "drive.toml"), table, "flexspline", {})
    assert found is not None
    x, y = np.array(found.points).T
    assert (y[0], y[-1]) == pytest.approx((24.0, 25.2), abs=1e-6)
    # The spline of ezdxf goes through the same points, between them it is another curve.
    assert x == pytest.approx(flank(y), abs=1e-4 if kind == "spline" else 1e-6)


def test_an_arc_of_a_polyline_is_not_read_as_its_chord(tmp_path: Path) -> None:
    drawn(tmp_path / "tooth.dxf", "arc", 4, 1.0)
    table = {"points_file": "tooth.dxf"}
    found = read_points(str(tmp_path / "drive.toml"), table, "flexspline", {})
    assert found is not None
    x, y = np.array(found.points).T
    chord = np.interp(y, [24.0, 25.0], [0.6, 0.3])
    # A bulge of 0.1 is a sagitta of 0.1 half chords, here across a chord of slope 0.3.
    assert np.max(np.abs(x - chord)) == pytest.approx(0.05 * 1.09, rel=0.01)


def test_of_two_polylines_none_is_chosen(tmp_path: Path) -> None:
    path = tmp_path / "tooth.dxf"
    document = ezdxf.new()
    for across in (0.0, 1.0):
        points = np.column_stack([across + flank(HEIGHTS), HEIGHTS])
        document.modelspace().add_lwpolyline(points.tolist())
    document.saveas(path)
    with pytest.raises(InputError, match="2 pieces that do not join"):
        read_points(str(tmp_path / "d.toml"), {"points_file": path.name}, "flexspline", {})


def test_a_dxf_without_one_curve_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "tooth.dxf"
    document = ezdxf.new()
    document.modelspace().add_line((0.6, 24), (0.5, 24.5))
    document.modelspace().add_line((0.4, 24.6), (0.3, 25))
    document.saveas(path)
    for said, unit in (("2 pieces that do not join", 4), ("INSUNITS: found 19", 19)):
        document.header["$INSUNITS"] = unit
        document.saveas(path)
        with pytest.raises(InputError, match=said):
            read_points(str(tmp_path / "d.toml"), {"points_file": path.name}, "flexspline", {})
