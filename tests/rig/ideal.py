"""The ideal analyst of a laboratory: the most that its recordings contain.

    found = IdealAnalyst(lab, truth["effects"]).look()
    found.first(), found.confounded(effect)

It knows what no diagnosis can know: the law of friction, the loads and the history that were not
recorded, the formula of each effect, the scatter from run to run, and the colour and size of the
noise. It does not know the values: parameters of the law, the zero of each run, and whether an
effect is hidden, which one, and its magnitude and phase. It shares nothing with the library. An
effect that it does not find, or that is confounded with another one, is beyond the plan.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import special
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from .bench import TANGENT_STEP
from .campaign import COLOUR, COLOURED_SHARE
from .hidden import HIDDEN
from .laboratory import SCATTER, Laboratory
from .mechanics import ARCSEC, Array

LEVEL = 0.01
"""Probability that a clean campaign shows any effect, as the diagnosis states for its own test."""

CONFOUNDED_NATS = float(np.log(1 / LEVEL))
"""Difference of log likelihoods, nats, below which two effects are confounded: odds of 100."""

CANDIDATES = (
    "kinematic_error",
    "kinematic_sideband",
    "stiffness_modulation",
    "output_eccentricity",
    "asymmetric_stiffness",
    "thermal_gap",
    "thermal_stiffness",
    "thermal_drift",
    "thermal_friction",
    "wear",
    "creep",
    "viscous_friction",
)
"""Effects that change the lost motion of these drives. Those of the torque sensor are left out: the
analyst knows the torque."""

APPROACHES = 3
"""Evaluations of an effect, each at the magnitude that the one before suggests."""

NOISE_ORDER = 30
"""Order of the autoregression that whitens the known noise."""


@dataclass
class Found:
    """What the ideal analyst finds: gain in log likelihood and dimensions of each effect."""

    nats: dict[str, float]
    rank: dict[str, int]

    def first(self, runs: int = 0) -> str:
        """The effect that is named: the most probable of the significant ones; "" if none is.

        With the number of runs, by the F test of an analyst who estimates the scatter from them: it
        leaves a degree of freedom for each run but one, less those of the effect.
        """
        seen = [name for name in self.nats if self.p(name, runs) * len(self.nats) <= LEVEL]
        return max(seen, key=self.nats.__getitem__, default="")

    def p(self, name: str, runs: int) -> float:
        """Probability of such a gain without the effect."""
        rank, square = self.rank[name], 2 * self.nats[name]
        if not runs:
            return float(special.chdtrc(rank, square))
        return float(special.fdtrc(rank, runs - 1 - rank, square / rank))

    def confounded(self, effect: str) -> list[str]:
        """Effects that are confounded with another one in these recordings."""
        least = self.nats.get(effect, np.inf) - CONFOUNDED_NATS
        return sorted(n for n, nats in self.nats.items() if n != effect and nats >= least)


class IdealAnalyst:
    """An analyst of one laboratory with a hidden effect, or none."""

    def __init__(self, lab: Laboratory, effects: Mapping[str, float]) -> None:
        self.lab = lab
        self.even = Laboratory(lab.seed, lab.law, lab.protocol, scatter=0.0)
        columns = lab.measured(lab.read(effects))
        lost = columns["output_angle_rad"] - columns["input_angle_rad"] / lab.drive.ratio
        self.response = (lost - self.even.plain) / ARCSEC

    @cached_property
    def reach(self) -> Array:
        """Whitening filter of the known noise, for unit variance of its innovations."""
        covariance = COLOURED_SHARE * COLOUR ** np.arange(NOISE_ORDER + 1.0)
        covariance[0] = 1.0
        phi = solve_toeplitz(covariance[:-1], covariance[1:])
        spread = float(np.sqrt(covariance[0] - phi @ covariance[1:]))
        return np.concatenate(([1.0], -phi)) / (spread * self.lab.noise_arcsec)

    @cached_property
    def scatter(self) -> Array:
        """One standard deviation of stiffness, friction and gap of all runs, arc seconds."""
        out = []
        for name, rms in SCATTER.items():
            moved = Laboratory(self.lab.seed, self.lab.law, self.lab.protocol, scatter=0.0)
            moved.scattered[name] = moved.scattered[name] + TANGENT_STEP
            out.append((moved.plain - self.even.plain) * rms / TANGENT_STEP / ARCSEC)
        return np.column_stack(out)

    def whitened(self, columns: Array) -> Array:
        """Columns of all runs, white and without the zero and the scatter of each run.

        Times the inverse square root of the covariance of a run.
        """
        out = []
        for rows in self.lab.plan.slices():
            one = np.ones(rows.stop - rows.start)
            block = np.column_stack((columns[rows], self.scatter[rows], one))
            white = lfilter(self.reach, [1.0], block, axis=0)[NOISE_ORDER:]
            zero = white[:, -1] / np.linalg.norm(white[:, -1])
            white = white[:, :-1] - np.outer(zero, zero @ white[:, :-1])
            u, s, _ = np.linalg.svd(white[:, columns.shape[1] :], full_matrices=False)
            own = white[:, : columns.shape[1]]
            # I + S S' has the inverse square root I - u (1 - 1 / sqrt(1 + s^2)) u'.
            out.append(own - u @ ((1 - 1 / np.sqrt(1 + s**2))[:, None] * (u.T @ own)))
        return np.concatenate(out)

    def change(self, name: str, magnitude: float) -> Array:
        """What an effect of a magnitude changes, one column for each of its phases, arc seconds."""
        columns = []
        for turn in range(1 + HIDDEN[name].phases):
            phased = _Phased(self.even, turn * 0.5 * np.pi)
            columns.append(phased.read({name: magnitude}).lost_motion_rad - self.even.plain)
        return np.column_stack(columns[: 2 if HIDDEN[name].phases else 1]) / ARCSEC

    def look(self) -> Found:
        """Test every effect beside the law."""
        law = self.even.tangents / ARCSEC
        known = self.whitened(np.column_stack((law, self.response)))
        basis, _ = np.linalg.qr(known[:, :-1])
        left = known[:, -1] - basis @ (basis.T @ known[:, -1])
        nats, ranks = {}, {}
        for name in CANDIDATES:
            hidden, magnitude = HIDDEN[name], 0.1 * HIDDEN[name].typical
            for _ in range(1 if hidden.phases else APPROACHES):
                change = self.whitened(self.change(name, magnitude))
                beside = change - basis @ (basis.T @ change)
                # A column that the law follows is not an effect that could be found.
                if np.linalg.norm(beside) <= 1e-6 * np.linalg.norm(change):
                    break
                share, _, rank, _ = np.linalg.lstsq(beside, left, rcond=1e-6)
                nats[name] = float(left @ left - np.sum((left - beside @ share) ** 2)) / 2
                ranks[name] = int(rank)
                if not hidden.phases:
                    limit = hidden.limit * hidden.scale(self.lab.drive)  # type: ignore[arg-type]
                    magnitude = float(np.clip(magnitude * share[0], -limit, limit)) or magnitude
        return Found(nats, ranks)


class _Phased(Laboratory):
    """A laboratory whose effects all have one phase."""

    def __init__(self, lab: Laboratory, phase: float) -> None:
        self.__dict__.update(lab.__dict__)
        self.phase = phase

    def phases(self, name: str) -> Array:
        """The phase."""
        return np.full(2, self.phase)
