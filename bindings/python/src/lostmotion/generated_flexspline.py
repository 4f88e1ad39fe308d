"""The flank of the flexspline that a circular spline of points generates, theory/flanks.md.

The circular spline moves past a tooth of the flexspline. At each height of the tooth its flank
comes closest to the axis of the tooth at some material angle: half the thickness that remains.
Where the corner of the circular spline's tip comes closest, it cuts the flank.

With a ring wave generator a tooth of the rigid gear moves through a space of the flexspline. At
each height it reaches furthest from the axis of the space at some angle: half the width that it
needs.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.core import Core, core
from lostmotion.flank_points import Points, flank_points

SCAN_RAD = np.radians(np.linspace(-70.0, 70.0, 1401))
"""Material angles of the search for the closest (ring: furthest) position; beyond, a tooth is out
of mesh.
"""

ZOOMS = 9
ZOOM_POINTS = 21
"""Each zoom divides the interval around the closest position by ten: to 1e-9 of 0.1 deg."""

NEWTON_STEPS = 5
"""The flank is nearly radial: the error after three steps is rounding."""

ROUNDING = 1e-12
"""Share of a radius within which a point lies on the corner of the tip."""


class _Motion:
    """A flank of the circular spline in the frame of a tooth on the deformed neutral line."""

    def __init__(self, c: Core, drive: Any, points: Points) -> None:
        from scipy.interpolate import CubicHermiteSpline

        ffi, lib = c.ffi, c.lib
        geometry, line, table = (
            ffi.new(f"lm_{name} *") for name in ("geometry", "neutral_line", "conjugate")
        )
        deflection = drive.generator.deflection_mm
        rim = drive.flexspline.rim_thickness_mm
        teeth, generator = (ffi.addressof(drive, name) for name in ("teeth", "generator"))
        c.call(lib.lm_make_geometry, teeth, deflection, rim, geometry)
        shape = (drive.teeth.deformation, geometry.neutral_mm, deflection)
        c.call(lib.lm_make_neutral_line, generator, *shape, lib.LM_NEUTRAL_LINE_NODES, line)
        flank, shift = flank_points(points, c.bits), drive.teeth.rigid_shift * geometry.module_mm
        c.call(lib.lm_tabulate_rigid_points, flank, geometry, shift, 0.0, table)
        count = table.intervals
        slope = [*list(table.slope_low)[:count], table.slope_high[count - 1]]
        place, half = (list(values)[: count + 1] for values in (table.place, table.half_angle_rad))
        self._half = CubicHermiteSpline(place, half, slope)
        self._low, self._top, self._first = table.low_mm, table.top_mm, place[0]
        self._line, self._lib = line, lib
        self._lead = geometry.lead_per_angle
        self._sense = float(line.sense)  # +1: the closest position; -1: the furthest
        self.geometry = geometry

    def place(self, angle_rad: FloatArray) -> FloatArray:
        """Radius, lead, sine and cosine of the tilt of a tooth's foot, by rows."""
        feet = [self._lib.lm_place_tooth(self._line, angle) for angle in angle_rad]
        leads = [foot.lead_rad + a * self._lead for foot, a in zip(feet, angle_rad, strict=True)]
        return np.array(
            [
                [f.radius_mm, lead, f.tilt_sin, f.tilt_cos]
                for f, lead in zip(feet, leads, strict=True)
            ]
        ).T

    def half_width(self, height_mm: float, placed: FloatArray) -> FloatArray:
        """Distance of the flank from the axis at a height over the neutral line, times the sense.

        Infinite where the circular spline has no flank.
        """
        radius, lead, s, c = placed
        across = np.full_like(radius, self._half(self._first) * self._low)
        for _ in range(NEWTON_STEPS):
            along = radius + height_mm * c - across * s
            aside = height_mm * s + across * c
            rho = np.hypot(along, aside)
            square = np.maximum((self._top - rho) / (self._top - self._low), self._first**2)
            place = np.sqrt(square)
            on_land = square <= self._first**2
            by_place = np.where(on_land, 0.0, self._half(place, 1))
            by_rho = -by_place / (2.0 * place * (self._top - self._low))
            gap = self._half(place) - np.arctan2(aside, along) - lead
            theta_x = (along * c + aside * s) / rho**2
            rho_x = (aside * c - along * s) / rho
            across = across + gap / (theta_x - by_rho * rho_x)
        beyond_tip = self._sense * (rho - self._low) < -self._low * ROUNDING
        return np.where(beyond_tip, math.inf, self._sense * across)

    def closest(self, height_mm: float, scanned: FloatArray) -> float:
        """Least distance (of a space: greatest) over all angles; infinite where no flank is."""
        found = self.half_width(height_mm, scanned)
        best = int(np.argmin(found))
        least, angle = float(found[best]), float(SCAN_RAD[best])
        if not math.isfinite(least):
            return self._sense * least
        step = float(SCAN_RAD[1] - SCAN_RAD[0])
        for _ in range(ZOOMS):
            near = angle + np.linspace(-step, step, ZOOM_POINTS)
            found = self.half_width(height_mm, self.place(near))
            best = int(np.argmin(found))
            if found[best] < least:
                least, angle = float(found[best]), float(near[best])
            step *= 2.0 / (ZOOM_POINTS - 1)
        return self._sense * least


def generate(drive: Any, rigid_points: Points) -> Points:
    """Points of the flexspline's flank that a circular spline leaves free, root to tip.

    As for all points of a flank, y is that of a tool without shift: the library adds the shift.

    Parameters
    ----------
    drive : cdata
        Completed ``lm_drive *`` in float64; its kind of flanks is not used.
    rigid_points : tuple of pairs
        Half the width of the space (ring: half the thickness of the tooth) and the distance from
        the gear's centre, mm.

    Notes
    -----
    The last 2 % of the height above the deepest position of the circular spline's tip continue
    parallel to the axis, as does the root below: the path of the corner reverses there.
    """
    c = core()
    motion = _Motion(c, drive, rigid_points)
    g = motion.geometry
    scanned = motion.place(SCAN_RAD)
    if g.deformation == c.lib.LM_INTERNAL:
        deepest = g.rigid_tip_mm - g.deflection_mm
        land = deepest + c.lib.LM_CONJUGATE_LAND * (g.flexspline_tip_mm - deepest)
        y = np.linspace(g.flexspline_root_mm, g.flexspline_tip_mm, c.lib.LM_FLANK_POINTS_MAX)
        x = np.array([motion.closest(max(at, land) - g.neutral_mm, scanned) for at in y])
    else:
        deepest = g.rigid_tip_mm + g.deflection_mm
        land = deepest + c.lib.LM_CONJUGATE_LAND * (g.flexspline_tip_mm - deepest)
        pitch_half = math.pi / g.flexspline_teeth
        # From the tip circle beside the axis of the space to the root at the edge of a short cup.
        inner = g.flexspline_tip_mm * math.cos(pitch_half)
        outer = g.flexspline_root_mm + g.deflection_mm / 2.0
        height = np.linspace(inner, outer, c.lib.LM_FLANK_POINTS_MAX)
        half = [motion.closest(min(at, land) - g.neutral_mm, scanned) for at in height]
        # The tooth beside the space, turned by half a pitch.
        tooth = (height - 1j * np.array(half)) * np.exp(1j * pitch_half)
        y, x = tooth.real, tooth.imag
    unshifted = y - drive.teeth.flexspline_shift * g.module_mm
    return tuple(zip(map(float, x), map(float, unshifted), strict=True))


@functools.lru_cache(maxsize=64)
def _cached(key: bytes, rigid_points: Points) -> Points:
    c = core()
    drive = c.ffi.new("lm_drive *")
    c.ffi.memmove(drive, key, len(key))
    return generate(drive, rigid_points)


def generated_points(drive: Any, rigid_points: Points) -> Points:
    """Like `generate`, once for each set of the dimensions that it depends on."""
    ffi = core().ffi
    bare = ffi.new("lm_drive *")
    for name in ("teeth", "generator"):
        setattr(bare, name, getattr(drive, name))
    bare.flexspline.rim_thickness_mm = drive.flexspline.rim_thickness_mm
    return _cached(bytes(ffi.buffer(bare)), rigid_points)
