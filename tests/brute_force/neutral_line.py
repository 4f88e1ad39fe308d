"""The deformed neutral line of a flexspline rim, solved numerically.

The rim is a thin inextensible ring bent by the wave generator. Angles start at the deformation
axis. Four methods, by wave generator:

* cosine cam: the shape is given, ``cos 2 phi``;
* rollers: Fourier series of the ring equation under point loads, interpolated piece by piece;
* discs, ring: Chebyshev collocation of the contact arc and the free arc, joined with continuous
slope and bending moment;
* ellipse: the ellipse of given axis whose perimeter is that of the undeformed line.

Arc length is Gauss-Legendre quadrature; teeth sit at equal arc length along the deformed line.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

QUARTER_TURN = math.pi / 2

COLLOCATION_DEGREE = 24
"""Chebyshev degree per piece. The pieces are entire functions over about one radian: degree 16
reaches rounding.
"""

FOURIER_ORDER_MAX = 20_000
"""Highest order of the point-load series. Its terms fall with order**-4: the omitted ones are below
3e-14 of the sum.
"""

GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(48)
"""Nodes on -1 to 1 and weights of the length of a smooth piece: 24 points reach rounding."""

ANGLE_TOLERANCE_RAD = 1e-14
"""Tolerance of the polar angle found from an arc length; at a radius of 100 mm that is 1e-12 mm."""


@dataclass(frozen=True)
class WaveShape:
    """First-order shape of the ring for unit deflection on the axis, over a quarter turn.

    Attributes
    ----------
    pieces : tuple of numpy.polynomial.Chebyshev
        Radial displacement over deflection [-], one polynomial per smooth piece; the domains [rad]
        join from 0 to pi/2.
    """

    pieces: tuple[Chebyshev, ...]

    @property
    def joints(self) -> tuple[float, ...]:
        """Ends of the smooth pieces [rad], from 0 to pi/2."""
        return (0.0, *(float(piece.domain[1]) for piece in self.pieces))

    @cached_property
    def _known(self) -> dict[int, tuple[Chebyshev, ...]]:
        return {0: self.pieces}

    def _derivatives(self, order: int) -> tuple[Chebyshev, ...]:
        if order not in self._known:
            self._known[order] = tuple(piece.deriv(order) for piece in self.pieces)
        return self._known[order]

    def radial(self, angle_rad: ArrayLike, derivative: int = 0) -> NDArray[np.float64]:
        """Radial displacement over deflection, outward positive, or a derivative by the angle.

        Parameters
        ----------
        angle_rad : array_like, any shape
            Angle from the deformation axis [rad], -pi/2 to pi/2.
        derivative : int
            Order of the derivative, 0 or more.

        Returns
        -------
        ndarray, same shape
            Displacement over deflection [-], per rad**derivative.
        """
        angle = np.asarray(angle_rad, dtype=float)
        size = np.abs(angle)
        value = np.empty_like(size)
        pieces = self._derivatives(derivative)
        for (start, end), piece in zip(pairwise(self.joints), pieces, strict=True):
            inside = (size >= start) & ((size < end) | (end == self.joints[-1]))
            value[inside] = piece(size[inside])
        return np.where(angle < 0, -value, value) if derivative % 2 else value

    def tangential(self, angle_rad: ArrayLike) -> NDArray[np.float64]:
        """Tangential displacement over deflection, increasing angle positive.

        The line keeps its length: the derivative by the angle is minus the radial displacement.

        Parameters
        ----------
        angle_rad : array_like, any shape
            Angle from the deformation axis [rad], -pi/2 to pi/2.

        Returns
        -------
        ndarray, same shape
            Displacement over deflection [-], 0 on the axis.
        """
        angle = np.asarray(angle_rad, dtype=float)
        size = np.abs(angle)
        total = np.zeros_like(size)
        for (start, end), piece in zip(pairwise(self.joints), self.pieces, strict=True):
            total += piece.integ(lbnd=start)(np.clip(size, start, end))
        return -np.copysign(total, angle)

    def rotation(self, angle_rad: ArrayLike) -> NDArray[np.float64]:
        """Rotation of the normal times mean radius over deflection, increasing angle positive.

        Parameters
        ----------
        angle_rad : array_like, any shape
            Angle from the deformation axis [rad], -pi/2 to pi/2.

        Returns
        -------
        ndarray, same shape
            Tangential displacement less the slope of the radial one [-].
        """
        return self.tangential(angle_rad) - self.radial(angle_rad, 1)


@lru_cache(maxsize=256)
def wave_shape(generator_type: str, contact_half_angle_deg: float) -> WaveShape:
    """First-order shape of the ring under a generator.

    Parameters
    ----------
    generator_type : {"cosine", "discs", "rollers", "ring"}
        Wave generator.
    contact_half_angle_deg : float
        Half angle of the contact arc, or of a pair of rollers [deg]; 0 is one roller a lobe; a
        cosine cam ignores it.

    Returns
    -------
    WaveShape
        The shape with unit displacement on the axis.

    Raises
    ------
    ValueError
        Unknown wave generator, or a half angle at which the axis does not move outward.
    """
    half_angle = math.radians(contact_half_angle_deg)
    if generator_type == "cosine":
        return WaveShape((_interpolant(lambda angle: np.cos(2 * angle), 0.0, QUARTER_TURN),))
    if generator_type == "rollers" or (generator_type in ("discs", "ring") and half_angle == 0):
        return _roller_shape(half_angle)
    if generator_type in ("discs", "ring"):
        return _contact_arc_shape(half_angle)
    raise ValueError(
        f"generator_type: found {generator_type!r}, expected cosine, discs, rollers or ring"
    )


Displacement = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def _interpolant(function: Displacement, start: float, end: float) -> Chebyshev:
    return Chebyshev.interpolate(function, COLLOCATION_DEGREE, domain=[start, end])


def _roller_shape(half_angle: float) -> WaveShape:
    """Fourier series of a ring under four equal radial point loads, at +-half_angle and opposite.

    Load and displacement hold even orders only; a ring answers a load of some order with
    1 / (order**2 - 1)**2.
    """
    if not 0 <= half_angle < QUARTER_TURN:
        raise ValueError(f"rollers: found {half_angle} rad, expected 0 to below pi/2")
    order = np.arange(2, FOURIER_ORDER_MAX + 1, 2)
    amplitude = np.cos(order * half_angle) / (order**2 - 1.0) ** 2
    on_axis = amplitude.sum()
    if on_axis <= 0:
        raise ValueError(f"rollers at {half_angle} rad push the axis inward, expected below 0.766")

    def displacement(angle: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.cos(np.multiply.outer(angle, order)) @ amplitude / on_axis

    joints = [0.0, half_angle, QUARTER_TURN] if half_angle > 0 else [0.0, QUARTER_TURN]
    return WaveShape(
        tuple(_interpolant(displacement, start, end) for start, end in pairwise(joints))
    )


def _contact_arc_shape(half_angle: float) -> WaveShape:
    """Collocation of the bending of a ring in contact with a round disc over |angle| <= half_angle.

    ``w'' + w`` is the bending moment, in units of -EI w0 / r**2. It is constant on the disc. A cut
    at 90 deg carries a moment and a normal force, so the moment on the free arc is that at the cut
    plus the force times ``1 - cos(angle from 90 deg)``: a constant and a cosine. Unknown are a
    Chebyshev series on each arc, the moment on the disc, and the constant and cosine of the free
    arc. Displacement, slope and moment join where the disc ends; symmetry clears the slope at both
    ends of the quarter; the ring keeps its length.
    """
    if not 0 < half_angle < QUARTER_TURN:
        raise ValueError(f"contact arc: found {half_angle} rad, expected above 0 to below pi/2")
    size = COLLOCATION_DEGREE + 1
    arc = [Chebyshev.basis(k, domain=[0.0, half_angle]) for k in range(size)]
    free = [Chebyshev.basis(k, domain=[half_angle, QUARTER_TURN]) for k in range(size)]
    nothing = np.zeros(size)

    def values(basis: list[Chebyshev], derivative: int, angle: float) -> NDArray[np.float64]:
        return np.array([(one.deriv(derivative) if derivative else one)(angle) for one in basis])

    def bending(basis: list[Chebyshev], angle: float) -> NDArray[np.float64]:
        return values(basis, 2, angle) + values(basis, 0, angle)

    def area(basis: list[Chebyshev], start: float, end: float) -> NDArray[np.float64]:
        return np.array([one.integ(lbnd=start)(end) for one in basis])

    rows: list[NDArray[np.float64]] = []
    right: list[float] = []

    def equation(
        on_arc: NDArray[np.float64],
        on_free: NDArray[np.float64],
        on_moments: tuple[float, float, float] = (0.0, 0.0, 0.0),
        equals: float = 0.0,
    ) -> None:
        """Add a row: factors of both series, then of disc moment, free constant and free cosine."""
        rows.append(np.concatenate([on_arc, on_free, on_moments]))
        right.append(equals)

    node = np.cos(np.pi * (np.arange(size - 2) + 0.5) / (size - 2))
    for angle in half_angle / 2 * (1 + node):
        equation(bending(arc, angle), nothing, (-1.0, 0.0, 0.0))
    for angle in half_angle + (QUARTER_TURN - half_angle) / 2 * (1 + node):
        equation(nothing, bending(free, angle), (0.0, -1.0, -math.sin(angle)))
    for derivative in (0, 1):
        equation(values(arc, derivative, half_angle), -values(free, derivative, half_angle))
    equation(nothing, nothing, (1.0, -1.0, -math.sin(half_angle)))
    equation(values(arc, 0, 0.0), nothing, equals=1.0)
    equation(values(arc, 1, 0.0), nothing)
    equation(nothing, values(free, 1, QUARTER_TURN))
    equation(area(arc, 0.0, half_angle), area(free, half_angle, QUARTER_TURN))

    solution = np.linalg.solve(np.array(rows), np.array(right))
    return WaveShape(
        (
            Chebyshev(solution[:size], domain=[0.0, half_angle]),
            Chebyshev(solution[size : 2 * size], domain=[half_angle, QUARTER_TURN]),
        )
    )


@dataclass(frozen=True)
class RingLine:
    """Deformed line whose radius is the mean radius plus a ring shape plus a length correction.

    Attributes
    ----------
    shape : WaveShape
        First-order shape.
    mean_radius_mm : float
        Radius of the undeformed line [mm].
    deflection_mm : float
        Radial displacement on the axis [mm]; negative is inward.
    length_correction_mm : float
        Uniform displacement that keeps the length [mm], part of the deflection on the axis.
    """

    shape: WaveShape
    mean_radius_mm: float
    deflection_mm: float
    length_correction_mm: float

    @property
    def joints(self) -> tuple[float, ...]:
        """Ends of the smooth pieces [rad], from 0 to pi/2."""
        return self.shape.joints

    def radius(self, polar_rad: ArrayLike) -> NDArray[np.float64]:
        """Polar radius [mm] at a polar angle [rad], any shape."""
        wave = self.deflection_mm - self.length_correction_mm
        return self.mean_radius_mm + wave * self.shape.radial(polar_rad) + self.length_correction_mm

    def slope(self, polar_rad: ArrayLike) -> NDArray[np.float64]:
        """Derivative of the polar radius [mm/rad] at a polar angle [rad], any shape."""
        return (self.deflection_mm - self.length_correction_mm) * self.shape.radial(polar_rad, 1)


@dataclass(frozen=True)
class EllipseLine:
    """Ellipse about the rotation axis.

    Attributes
    ----------
    axis_mm : float
        Semi-axis along the deformation axis [mm].
    cross_axis_mm : float
        Semi-axis across it [mm].
    """

    axis_mm: float
    cross_axis_mm: float

    @property
    def joints(self) -> tuple[float, ...]:
        """Ends of the smooth pieces [rad]: one quarter turn."""
        return (0.0, QUARTER_TURN)

    def radius(self, polar_rad: ArrayLike) -> NDArray[np.float64]:
        """Polar radius [mm] at a polar angle [rad], any shape."""
        return 1 / np.hypot(
            np.cos(polar_rad) / self.axis_mm, np.sin(polar_rad) / self.cross_axis_mm
        )

    def slope(self, polar_rad: ArrayLike) -> NDArray[np.float64]:
        """Derivative of the polar radius [mm/rad] at a polar angle [rad], any shape."""
        flattening = self.cross_axis_mm**-2 - self.axis_mm**-2
        return -(self.radius(polar_rad) ** 3) * np.sin(polar_rad) * np.cos(polar_rad) * flattening


NeutralLine = RingLine | EllipseLine


def arc_length(line: NeutralLine, polar_rad: float) -> float:
    """Length of the line from the deformation axis to a polar angle.

    Parameters
    ----------
    line : NeutralLine
        The deformed line.
    polar_rad : float
        Polar angle [rad], 0 to pi/2.

    Returns
    -------
    float
        Arc length [mm].
    """
    length = 0.0
    for start, joint in pairwise(line.joints):
        end = min(joint, polar_rad)
        if end > start:
            polar = start + (end - start) / 2 * (1 + GAUSS_NODES)
            speed = np.hypot(line.radius(polar), line.slope(polar))
            length += (end - start) / 2 * float(GAUSS_WEIGHTS @ speed)
    return length


@lru_cache(maxsize=1024)
def neutral_line(
    generator_type: str,
    contact_half_angle_deg: float,
    mean_radius_mm: float,
    deflection_mm: float,
) -> NeutralLine:
    """Deformed neutral line that keeps the undeformed length.

    Parameters
    ----------
    generator_type : {"cosine", "discs", "rollers", "ring", "ellipse"}
        Wave generator.
    contact_half_angle_deg : float
        Half angle of the contact arc or of a pair of rollers [deg]; cosine and ellipse ignore it.
    mean_radius_mm : float
        Radius of the undeformed line [mm].
    deflection_mm : float
        Radial displacement on the deformation axis [mm]; negative is inward.

    Returns
    -------
    NeutralLine
        A line with ``radius(0) = mean_radius + deflection`` and a quarter of its length
        ``pi/2 * mean_radius``.
    """
    quarter = QUARTER_TURN * mean_radius_mm
    reach = 2 * abs(deflection_mm)
    if generator_type == "ellipse":
        axis = mean_radius_mm + deflection_mm

        def ellipse(cross_axis: float) -> EllipseLine:
            return EllipseLine(axis, cross_axis)

        cross_axis = brentq(
            lambda value: arc_length(ellipse(value), QUARTER_TURN) - quarter,
            mean_radius_mm - reach,
            mean_radius_mm + reach,
            xtol=1e-14 * mean_radius_mm,
        )
        return ellipse(cross_axis)

    shape = wave_shape(generator_type, contact_half_angle_deg)

    def ring(correction: float) -> RingLine:
        return RingLine(shape, mean_radius_mm, deflection_mm, correction)

    correction = brentq(
        lambda value: arc_length(ring(value), QUARTER_TURN) - quarter,
        -reach,
        reach,
        xtol=1e-14 * mean_radius_mm,
    )
    return ring(correction)


def place(line: NeutralLine, mean_radius_mm: float, material_rad: float) -> tuple[complex, complex]:
    """Position of a point of the undeformed line after deformation, and its normal.

    Parameters
    ----------
    line : NeutralLine
        The deformed line.
    mean_radius_mm : float
        Radius of the undeformed line [mm].
    material_rad : float
        Angle of the point on the undeformed line [rad], -pi/2 to pi/2.

    Returns
    -------
    origin : complex
        Position [mm]; the real axis is the deformation axis.
    normal : complex
        Outward unit normal of the line.
    """
    if abs(material_rad) > QUARTER_TURN:
        raise ValueError(f"material angle: found {material_rad} rad, expected -pi/2 to pi/2")
    length = mean_radius_mm * abs(material_rad)
    polar = QUARTER_TURN
    if length < arc_length(line, QUARTER_TURN):
        polar = brentq(
            lambda angle: arc_length(line, angle) - length,
            0.0,
            QUARTER_TURN,
            xtol=ANGLE_TOLERANCE_RAD,
        )
    polar = math.copysign(polar, material_rad)
    direction = complex(math.cos(polar), math.sin(polar))
    radius = float(line.radius(polar))
    tangent = complex(float(line.slope(polar)), radius) * direction
    return radius * direction, -1j * tangent / abs(tangent)
