"""A cup, a rim and a tooth by finite elements (scikit-fem), independent of the library's formulas.

Twist of a cup: with u = r psi the only displacement of torsion about an axis, the energy is
pi G times the integral of r^3 |grad psi|^2 over the section. Deflection of a rim: plane stress in a
quarter of an annulus. Deflection of a tooth: plane strain, including the block under it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skfem import (
    Basis,
    BilinearForm,
    ElementQuad2,
    ElementVector,
    FacetBasis,
    LinearForm,
    MeshQuad,
    asm,
    condense,
    solve,
)
from skfem.helpers import ddot, dot, eye, grad, sym_grad, trace


@dataclass(frozen=True)
class Cup:
    """Section of a cup in mm: a wall at a mean radius, and a diaphragm that is fixed at the hub."""

    mean_radius_mm: float
    wall_mm: float
    length_mm: float
    hub_radius_mm: float
    diaphragm_mm: float


def graded(*places: float, pieces: int) -> NDArray[np.float64]:
    """Divide each interval between places into a number of pieces."""
    parts = [np.linspace(a, b, pieces, endpoint=False) for a, b in itertools.pairwise(places)]
    return np.concatenate([*parts, [places[-1]]])


def cup_stiffness_Nm_per_rad(cup: Cup, shear_modulus_MPa: float, pieces: int = 12) -> float:
    """Torque over twist between the hub and the open end of the wall."""
    inner, outer = (cup.mean_radius_mm + side * cup.wall_mm / 2 for side in (-1, 1))
    r = graded(cup.hub_radius_mm, inner, outer, pieces=pieces)
    z = graded(-cup.diaphragm_mm, 0.0, cup.length_mm, pieces=pieces)
    whole = MeshQuad.init_tensor(r, z)
    middle = whole.p[:, whole.t].mean(axis=1)
    mesh = whole.restrict(np.flatnonzero((middle[1] < 0) | (middle[0] > inner)))
    basis = Basis(mesh, ElementQuad2())

    @BilinearForm
    def energy(u, v, w):  # type: ignore[no-untyped-def]
        return w.x[0] ** 3 * dot(grad(u), grad(v))

    stiffness = asm(energy, basis)
    held = basis.get_dofs(lambda x: np.isclose(x[0], cup.hub_radius_mm)).all()
    turned = basis.get_dofs(lambda x: np.isclose(x[1], cup.length_mm)).all()
    psi = np.zeros(basis.N)
    psi[turned] = 1.0
    psi = solve(*condense(stiffness, x=psi, D=np.union1d(held, turned)))
    return float(2 * math.pi * shear_modulus_MPa * (psi @ stiffness @ psi) / 1e3)


def rim_deflection(
    mean_radius_mm: float, thickness_mm: float, half_angle_rad: float, angles: int = 120
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Radial deflection of a rim under radial forces at plus and minus an angle of both lobes.

    Returns the angles from the deformation axis, 0 to 90 deg, and the deflection of the middle line
    over that on the axis. A quarter of the ring; the force is spread over the thickness.
    """
    across = 4
    phi = np.unique(np.append(np.linspace(0, math.pi / 2, angles + 1), half_angle_rad))
    half = thickness_mm / 2
    rho = np.linspace(mean_radius_mm - half, mean_radius_mm + half, across + 1)
    flat = MeshQuad.init_tensor(rho, phi)
    radius, angle = flat.p
    mesh = MeshQuad(np.array([radius * np.cos(angle), radius * np.sin(angle)]), flat.t)
    basis = Basis(mesh, ElementVector(ElementQuad2()))
    poisson = 0.3

    @BilinearForm
    def energy(u, v, w):  # type: ignore[no-untyped-def]
        strain = sym_grad(u)
        stress = (1 - poisson) * strain + poisson * eye(trace(strain), 2)
        return ddot(stress, sym_grad(v))

    stiffness = asm(energy, basis)
    on_x = basis.get_dofs(lambda x: np.isclose(x[1], 0.0)).all(["u^2"])
    on_y = basis.get_dofs(lambda x: np.isclose(x[0], 0.0)).all(["u^1"])
    load = np.zeros(basis.N)
    nodes = np.flatnonzero(np.isclose(angle, half_angle_rad))
    direction = (math.cos(half_angle_rad), math.sin(half_angle_rad))
    for axis in range(2):
        load[basis.nodal_dofs[axis][nodes]] = direction[axis]
    moved = solve(*condense(stiffness, load, D=np.union1d(on_x, on_y)))
    middle = np.flatnonzero(np.isclose(radius, mean_radius_mm))
    middle = middle[np.argsort(angle[middle])]
    u, v = (moved[basis.nodal_dofs[axis][middle]] for axis in range(2))
    deflection = u * np.cos(angle[middle]) + v * np.sin(angle[middle])
    return angle[middle], deflection / deflection[0]


def tooth_compliance_mm_per_N(
    height_mm: float,
    thickness_mm: float,
    width_mm: float,
    load_angle_rad: float,
    youngs_modulus_MPa: float,
    poisson: float,
    depth: float = 8.0,
    half_mm: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None,
    pieces: int = 12,
) -> float:
    """Deflection of a tooth on a block, along a force on its end; plane strain.

    The tooth is rectangular, or has the half thickness `half_mm` at each height; `thickness_mm` is
    that at its foot. The force is spread over the end of the tooth, where its mean displacement is
    taken. The block is `depth` thicknesses deep and twice as wide, and held at its lower edge.
    """
    half, deep = thickness_mm / 2, depth * thickness_mm
    top_mm = thickness_mm if half_mm is None else 2 * float(half_mm(np.array([height_mm]))[0])
    far = [2.0**k * thickness_mm for k in range(int(math.log2(depth)) + 1)]
    side = np.unique([*graded(0.0, half, pieces=6), *graded(half, *far, pieces=4)])
    x = np.concatenate((-side[:0:-1], side))
    below = -np.unique([*graded(0.0, half, pieces=6), *graded(half, *far, pieces=4), deep])[::-1]
    # A fillet starts along the edge of the block, so the mesh is finer there.
    up = graded(0.0, 1.0, pieces=pieces)[1:] ** (1 if half_mm is None else 2)
    y = np.concatenate((below, height_mm * up))
    whole = MeshQuad.init_tensor(x, y)
    middle = whole.p[:, whole.t].mean(axis=1)
    mesh = whole.restrict(np.flatnonzero((middle[1] < 0) | (np.abs(middle[0]) < half)))
    if half_mm is not None:
        place = mesh.p.copy()
        tooth = place[1] > 0
        place[0, tooth] *= half_mm(place[1, tooth]) / half
        mesh = MeshQuad(place, mesh.t)
    basis = Basis(mesh, ElementVector(ElementQuad2()))
    shear = youngs_modulus_MPa / (2 * (1 + poisson))
    lame = 2 * shear * poisson / (1 - 2 * poisson)

    @BilinearForm
    def energy(u, v, w):  # type: ignore[no-untyped-def]
        strain = sym_grad(u)
        return ddot(2 * shear * strain + lame * eye(trace(strain), 2), sym_grad(v))

    direction = (math.cos(load_angle_rad), -math.sin(load_angle_rad))

    @LinearForm
    def end_force(v, w):  # type: ignore[no-untyped-def]
        return (direction[0] * v[0] + direction[1] * v[1]) / top_mm

    end = mesh.facets_satisfying(lambda x: np.isclose(x[1], height_mm))
    load = asm(end_force, FacetBasis(mesh, basis.elem, facets=end)) / width_mm
    held = basis.get_dofs(lambda x: np.isclose(x[1], y[0])).all()
    moved = solve(*condense(asm(energy, basis), load, D=held))
    return float(load @ moved) * width_mm
