"""A loaded mesh by finite elements (scikit-fem): rim, all its teeth and the teeth opposite.

Plane strain. Half of the flexspline's ring is divided into elements, teeth included; the other half
moves equally, rotated by half a turn. Unit forces on the teeth and at the supports give the
compliance of the free ring, which the supports reduce. The rigid gear is a sector that is fixed at
its back. The pairs that carry are found by trial: a pair carries if its gap would be negative
without a force, and no force pulls.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, MeshQuad, asm
from skfem.helpers import ddot, eye, sym_grad, trace

Array = NDArray[np.float64]

ACROSS_TOOTH, ACROSS_SPACE, ACROSS_RIM = 3, 2, 3
"""Elements over the thickness of a tooth, a space and the rim."""

BELOW, ABOVE = 3, 2
"""Elements of a tooth below and above the contact."""

JOIN_MM = 1e-7
"""Corners of elements within this distance are identical."""


@dataclass(frozen=True)
class Gear:
    """Toothed ring: root and tip of its teeth, the other edge of the ring, half a tooth's angle."""

    teeth: int
    root_mm: float
    tip_mm: float
    back_mm: float
    half_angle_rad: Callable[[float], float]
    width_mm: float
    youngs_modulus_MPa: float
    poisson: float


@dataclass(frozen=True)
class Load:
    """Force on a tooth: the tooth's number, the height of the contact and the direction.

    `radial` is the outward force for a tangential force of 1 towards larger angles.
    """

    tooth: int
    radius_mm: float
    radial: float


def _quads(columns: Array, rows: Array, at: Callable[[Array, Array], Array]) -> tuple[Array, Any]:
    """Corners and elements of a block of columns and rows."""
    u, v = np.meshgrid(columns, rows, indexing="ij")
    numbers = np.arange(u.size).reshape(u.shape)
    elements = np.array(
        [numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]]
    ).reshape(4, -1)
    return at(u.ravel(), v.ravel()), elements


def _polar(angle: Array, radius: Array) -> Array:
    return np.array([radius * np.cos(angle), radius * np.sin(angle)])


def _mesh(gear: Gear, first: int, count: int, heights: dict[int, float]) -> MeshQuad:
    """Ring with `count` teeth from number `first` on; a tooth has a row of nodes at its contact."""
    pitch = 2 * math.pi / gear.teeth
    half = gear.half_angle_rad(gear.root_mm)
    tooth = np.linspace(-half, half, ACROSS_TOOTH + 1)
    space = np.linspace(half, pitch - half, ACROSS_SPACE + 1)[1:-1]
    sector = np.concatenate((tooth, space))
    start = (first - 0.5) * pitch
    edges = [start]
    for k in range(first, first + count):
        edges.extend(a + k * pitch for a in sector)
    columns = np.array([*edges, start + count * pitch])
    # The middle of a space is an edge of the ring.
    rows = np.linspace(gear.back_mm, gear.root_mm, ACROSS_RIM + 1)
    columns = np.unique(np.round(np.clip(columns, start, start + count * pitch), 12))
    blocks = [_quads(columns, rows, _polar)]
    for k in range(first, first + count):
        contact = heights.get(k, gear.root_mm + 0.6 * (gear.tip_mm - gear.root_mm))
        up = np.concatenate(
            (
                np.linspace(gear.root_mm, contact, BELOW + 1),
                np.linspace(contact, gear.tip_mm, ABOVE + 1)[1:],
            )
        )

        def place(share: Array, radius: Array, k: int = k) -> Array:
            half = np.array([gear.half_angle_rad(r) for r in radius])
            return _polar(k * pitch + share * half, radius)

        blocks.append(_quads(np.linspace(-1, 1, ACROSS_TOOTH + 1), up, place))
    offsets = np.cumsum([0, *(b[0].shape[1] for b in blocks)])
    points = np.hstack([b[0] for b in blocks])
    elements = np.hstack([b[1] + o for b, o in zip(blocks, offsets, strict=False)])
    _, keep, to = np.unique(
        np.round(points / JOIN_MM).astype(np.int64),
        axis=1,
        return_index=True,
        return_inverse=True,
    )
    elements = to.reshape(-1)[elements]
    corners = points[:, keep][:, elements]
    x, y = corners
    area = sum(x[i] * y[(i + 1) % 4] - x[(i + 1) % 4] * y[i] for i in range(4))
    elements[:, area < 0] = elements[::-1, area < 0]
    return MeshQuad(points[:, keep], elements)


class Ring:
    """Stiffness of a toothed ring, and where forces act on it."""

    def __init__(self, gear: Gear, first: int, count: int, loads: Sequence[Load]) -> None:
        self.gear, self.loads = gear, loads
        heights = {load.tooth: load.radius_mm for load in loads}
        self.basis = Basis(_mesh(gear, first, count, heights), ElementVector(ElementQuad2()))
        shear = gear.youngs_modulus_MPa / (2 * (1 + gear.poisson))
        lame = 2 * shear * gear.poisson / (1 - 2 * gear.poisson)

        @BilinearForm
        def energy(u, v, w):  # type: ignore[no-untyped-def]
            strain = sym_grad(u)
            return ddot(2 * shear * strain + lame * eye(trace(strain), 2), sym_grad(v))

        self.stiffness = gear.width_mm * asm(energy, self.basis)
        where = self.basis.doflocs
        self.angle = np.arctan2(where[1], where[0])
        self.radius = np.hypot(*where)
        # Component 0 or 1 of each number.
        self.component = np.zeros(self.basis.N, int)
        for numbers in (
            self.basis.nodal_dofs,
            self.basis.facet_dofs,
            self.basis.interior_dofs,
        ):
            self.component[numbers[1]] = 1

    def force(
        self, chosen: NDArray[np.bool_], weights: Array, radial: float, along: float
    ) -> Array:
        """Nodal forces of a sum of 1: so much outwards, and along larger angles."""
        load = np.zeros(self.basis.N)
        for component in range(2):
            numbers = np.flatnonzero(chosen & (self.component == component))
            numbers = numbers[np.argsort(self.angle[numbers])]
            a = self.angle[numbers]
            out, side = (np.cos(a), -np.sin(a)) if component == 0 else (np.sin(a), np.cos(a))
            load[numbers] += weights * (radial * out + along * side)
        return load

    def tooth_force(self, load: Load) -> Array:
        """Spread a force evenly over the thickness of the tooth at the height of the contact."""
        pitch = 2 * math.pi / self.gear.teeth
        off = np.angle(np.exp(1j * (self.angle - load.tooth * pitch)))
        row = (np.abs(self.radius - load.radius_mm) < 1e-5 * load.radius_mm) & (
            np.abs(off) < self.gear.half_angle_rad(load.radius_mm) * 1.01
        )
        simpson = np.zeros(2 * ACROSS_TOOTH + 1)
        for i in range(ACROSS_TOOTH):
            simpson[2 * i : 2 * i + 3] += np.array([1, 4, 1]) / (6 * ACROSS_TOOTH)
        return self.force(row, simpson, load.radial, 1.0)


def free_ring(gear: Gear, loads: Sequence[Load], supports_rad: Array) -> Array:
    """Compliance [mm/N] of the flexspline's ring, both halves loaded equally, in its own frame.

    Rows and columns: the loads, then outward forces on the back of the ring at the supports. The
    mean displacement along the back is 0: there the torque is removed evenly, as by a cup.
    """
    half = gear.teeth // 2
    ring = Ring(gear, -(half // 2), half, loads)
    start = -math.pi / gear.teeth - (half // 2) * 2 * math.pi / gear.teeth
    back = np.isclose(ring.radius, gear.back_mm, rtol=2e-4)
    forces = [ring.tooth_force(load) for load in loads]
    for angle in supports_rad:
        near = np.full(ring.basis.N, False)
        for component in range(2):
            numbers = np.flatnonzero(back & (ring.component == component))
            near[numbers[np.argmin(np.abs(ring.angle[numbers] - angle))]] = True
        forces.append(ring.force(near, np.ones(1), 1.0, 0.0))
    even = np.zeros(ring.basis.N)
    for component, turn in ((0, math.pi / 2), (1, 0.0)):
        numbers = np.flatnonzero(back & (ring.component == component))
        even[numbers] = np.cos(ring.angle[numbers] + turn)
    even /= np.abs(even).sum()
    # One end of the half ring moves like the other, rotated by half a turn.
    distance = np.angle(np.exp(1j * (ring.angle - start)))
    low = np.abs(distance) < 1e-7
    high = np.abs(np.abs(distance) - math.pi) < 1e-7
    order = np.arange(ring.basis.N)
    tie = np.ones(ring.basis.N)
    for component in range(2):
        ends = [np.flatnonzero(e & (ring.component == component)) for e in (low, high)]
        ends = [e[np.argsort(ring.radius[e])] for e in ends]
        order[ends[1]] = ends[0]
        tie[ends[1]] = -1.0
    kept, to = np.unique(order, return_inverse=True)
    reduce = sp.csr_matrix((tie, (np.arange(order.size), to)), (order.size, kept.size))
    stiffness = reduce.T @ ring.stiffness @ reduce
    bound = reduce.T @ even
    scale = stiffness.diagonal().mean() / np.abs(bound).max()
    whole = sp.bmat([[stiffness, scale * bound[:, None]], [scale * bound[None, :], None]], "csc")
    sides = np.column_stack([reduce.T @ f for f in forces])
    moved = splu(whole).solve(np.vstack((sides, np.zeros((1, sides.shape[1])))))[:-1]
    return np.asarray(sides.T @ moved)


def held_sector(gear: Gear, loads: Sequence[Load]) -> Array:
    """Compliance [mm/N] of the rigid gear's teeth in a sector that is fixed at its back."""
    numbers = [load.tooth for load in loads]
    first, last = min(numbers) - 3, max(numbers) + 3
    ring = Ring(gear, first, last - first + 1, loads)
    free = np.flatnonzero(~np.isclose(ring.radius, gear.back_mm, rtol=2e-4))
    forces = np.column_stack([ring.tooth_force(load) for load in loads])[free]
    moved = splu(ring.stiffness.tocsc()[free][:, free]).solve(forces)
    return np.asarray(forces.T @ moved)


def on_supports(free: Array, loads: int, supports: Array) -> Array:
    """Compliance at the loads if the ring is on supports with their own compliance."""
    among, across = free[loads:, loads:] + supports, free[:loads, loads:]
    return np.asarray(free[:loads, :loads] - across @ np.linalg.solve(among, across.T))


def forces_at(angle_rad: float, compliance: Array, arm_mm: Array, gap_rad: Array) -> Array:
    """Tangential forces [N] at a rotation: none pulls, and no pair overlaps."""
    # C F >= (angle - gap) r and F >= 0, complementary: the minimum of F' C F / 2 - F' (angle -
    # gap) r over forces that push.
    factor = np.linalg.cholesky(compliance)
    wanted = np.linalg.solve(factor, (angle_rad - gap_rad) * arm_mm)
    return np.asarray(nnls(factor.T, wanted, maxiter=50 * arm_mm.size)[0])


def forces_under(torque_Nm: float, compliance: Array, arm_mm: Array, gap_rad: Array) -> Array:
    """Tangential forces [N] on one lobe of two that carry a torque."""
    low, high = float(gap_rad.min()), float(gap_rad.min()) + 0.1
    for _ in itertools.repeat(None, 60):
        angle = (low + high) / 2
        if 2e-3 * forces_at(angle, compliance, arm_mm, gap_rad) @ arm_mm < torque_Nm:
            low = angle
        else:
            high = angle
    return forces_at(high, compliance, arm_mm, gap_rad)
