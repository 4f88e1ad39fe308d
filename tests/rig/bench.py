"""A drive under a test plan, with and without hidden effects, and the residual after a refit.

The residual of an effect is what remains after an ideal refit of the drive without the effect. Such
a refit uses the rig's own mechanics and fits what `mechanics.SCALES` lists (stiffness of mesh,
radial parts and torsion, gaps of teeth, radial gap and its knee, limits and wind-up of the
friction) for the whole campaign, and the zero of each run. It uses the recorded torque.
"""

from __future__ import annotations

import copy
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.signal import lfilter

from .drives import SIZES, build_drive, print_sheet
from .hidden import HIDDEN, Bench, Readings
from .mechanics import ARCSEC, SCALES, Array, Drive, Memory, Samples, turn
from .plans import ROOM_C, Run, make_plan

SIGMA_ARCSEC = 1.5
"""Noise of the angle, the unit of residuals."""
SCATTER = {"stiffness": 0.003, "friction": 0.02, "gap": 0.01}
"""Rms scatter from run to run, as shares."""
COLOURED_SHARE = 0.3
COLOUR = 0.85
"""Share of the angle noise's variance that is first-order autoregressive, and its coefficient."""

TANGENT_STEP = 0.01
SCALE_PRIOR = 0.5
SCALE_GAIN_ARCSEC = 0.05
"""A refit changes a scale by the first only if the gain is more than the second: stiffness can
move between mesh, radial parts and torsion with hardly any change of the lost motion."""
REFIT_STEPS = 16
SEARCH_STEPS = 16
THINNING = 5
SIGNATURE_SHARE = 0.3
LEAST_SCALE, LARGEST_SCALE = 0.05, 5.0
LEAST_GAIN = 0.01
TANGENT_REACH = 0.4
SIZE_TOLERANCE = 0.03
LARGEST_MISS = 0.1
CACHED = ("torque_Nm", "_starts", "plain", "tangents", "scatter_tangents", "_weight", "thinned")


class TooSmallError(ValueError):
    """No plausible magnitude leaves the required residual."""


def stream(seed: int, name: str) -> np.random.Generator:
    """Return a random generator for one purpose: a seed gives every effect the same noise."""
    return np.random.default_rng([seed, zlib.crc32(name.encode())])


@dataclass(frozen=True)
class Residual:
    """Residual of hidden effects after an ideal refit."""

    left_rad: Array
    moves: Array
    """Relative change of each of `SCALES` by the refit."""
    tangents: Array
    tangents_at: Array

    @property
    def scales(self) -> dict[str, float]:
        """Factors of the drive by the refit."""
        return dict(zip(SCALES, (1 + self.moves).tolist(), strict=True))

    @property
    def arcsec(self) -> float:
        """Rms over all rows."""
        return float(np.sqrt(np.mean(self.left_rad**2)) / ARCSEC)


class TestBench:
    """One specimen of a drive under one plan, with its scatter from run to run."""

    __test__ = False

    def __init__(
        self,
        seed: int,
        drive: int,
        plan: str = "standard",
        scatter: float = 1.0,
        noise: float = 1.0,
        sheet_error: float = 0.03,
        sheet_bias: float = 0.0,
        spike: bool = False,
        then: Callable[[list[Run], int], list[Run]] | None = None,
    ) -> None:
        self.seed = seed
        size = SIZES[drive % len(SIZES)]
        made = build_drive(size, stream(seed, "drive"))
        self.drive = print_sheet(made, stream(seed, "sheet"), sheet_error, sheet_bias)
        self.plan = make_plan(plan, size.ratio, stream(seed, "plan"), spike, then)
        self.scatter = scatter
        self.noise = noise
        chance, later = stream(seed, "scatter"), stream(seed, "scatter of later runs")
        planned = self.plan.runs - self.plan.followed_by
        self.scattered = {
            name: 1
            + scatter
            * rms
            * np.concatenate(
                [
                    chance.standard_normal(planned),
                    later.standard_normal(self.plan.followed_by),
                ]
            )
            for name, rms in SCATTER.items()
        }

    # --- turning the drive -----------------------------------------------------------------------

    def _bench(self, drive: Drive, torque_Nm: Array, scattered: Mapping[str, Array]) -> Bench:
        plan = self.plan
        samples = Samples(
            torque_Nm=torque_Nm.copy(),
            gap_rad=drive.gap_rad * scattered["gap"][plan.run],
            compliance=1 / scattered["stiffness"][plan.run],
            friction=scattered["friction"][plan.run],
            play_rad=np.zeros(len(plan.run)),
            lobe_rad=np.zeros(len(plan.run)),
            step_s=plan.step_s,
        )
        return Bench(plan, drive, samples, plan.temperature_C - ROOM_C)

    @cached_property
    def torque_Nm(self) -> Array:
        """Torque that the rig applies."""
        return self.plan.torque * self.drive.rated_torque_Nm

    def phases(self, name: str) -> Array:
        """Return the random phases of an effect."""
        return stream(self.seed, f"phase {name}").uniform(0, 2 * np.pi, 2)

    def read(
        self, effects: Mapping[str, float], phases: Mapping[str, Array] | None = None
    ) -> Readings:
        """Turn the drive with effects of the given magnitudes; no noise."""
        bench = self._bench(self.drive, self.torque_Nm, self.scattered)
        dealt = {name: (phases or {}).get(name, self.phases(name)) for name in effects}
        for name, magnitude in effects.items():
            before = HIDDEN[name].before
            if before:
                before(bench, magnitude, dealt[name])
        turned = turn(bench.drive, bench.samples, Memory())
        readings = Readings(turned, turned.angle_rad.copy(), self.torque_Nm.copy())
        for name, magnitude in effects.items():
            after = HIDDEN[name].after
            if after:
                after(bench, readings, magnitude, dealt[name])
        return readings

    def refitted(self, scales: Mapping[str, float], torque_Nm: Array) -> Array:
        """Lost motion of the drive without effects, rescaled, at a recorded torque."""
        drive = self.drive.scaled(dict(scales))
        bench = self._bench(drive, torque_Nm, self.scattered)
        return turn(drive, bench.samples, Memory()).angle_rad

    # --- what a refit absorbs --------------------------------------------------------------------

    @cached_property
    def _starts(self) -> np.ndarray:
        return np.array([rows.start for rows in self.plan.slices()])

    def centred(self, columns: Array) -> Array:
        """Remove the zero of each run."""
        counts = np.bincount(self.plan.run)
        means = np.add.reduceat(columns, self._starts, axis=0)
        means = means / (counts if columns.ndim == 1 else counts[:, None])
        return columns - means[self.plan.run]

    @cached_property
    def plain(self) -> Array:
        """Lost motion without effects."""
        return self.refitted({}, self.torque_Nm)

    @property
    def unscattered(self) -> Array:
        """Lost motion without effects and without scatter from run to run."""
        same = {name: np.ones_like(values) for name, values in self.scattered.items()}
        bench = self._bench(self.drive, self.torque_Nm, same)
        return turn(self.drive, bench.samples, Memory()).angle_rad

    def tangents_at(self, moves: Array) -> Array:
        """Change of the lost motion with each scale; a column each, centred."""
        at = 1 + moves
        here = self.refitted(dict(zip(SCALES, at, strict=True)), self.torque_Nm)
        columns = np.empty((len(here), len(SCALES)))
        for i in range(len(SCALES)):
            there = at.copy()
            there[i] += TANGENT_STEP
            moved = self.refitted(dict(zip(SCALES, there, strict=True)), self.torque_Nm)
            columns[:, i] = (moved - here) / TANGENT_STEP
        return self.centred(columns)

    @cached_property
    def tangents(self) -> Array:
        """The tangents of the drive as it is."""
        return self.tangents_at(np.zeros(len(SCALES)))

    @cached_property
    def scatter_tangents(self) -> Array:
        """Change with the stiffness, the friction and the gap, by which runs differ."""
        columns = []
        for name in SCATTER:
            changed = self.scattered | {name: self.scattered[name] * (1 + TANGENT_STEP)}
            bench = self._bench(self.drive, self.torque_Nm, changed)
            turned = turn(self.drive, bench.samples, Memory())
            columns.append((turned.angle_rad - self.plain) / TANGENT_STEP)
        return np.column_stack(columns)

    @cached_property
    def _weight(self) -> float:
        return len(self.plan.run) * (SCALE_GAIN_ARCSEC * ARCSEC / SCALE_PRIOR) ** 2

    def absorb(
        self,
        effects: Mapping[str, float],
        phases: Mapping[str, Array] | None = None,
        start: Residual | None = None,
    ) -> Residual:
        """Refit the drive without effects to readings with them: Gauss and Newton's steps."""
        readings = self.read(effects, phases)
        same_torque = np.array_equal(readings.torque_Nm, self.torque_Nm)

        def residual(moves: Array) -> tuple[Array, float]:
            if same_torque and not moves.any():
                base = self.plain
            else:
                base = self.refitted(dict(zip(SCALES, 1 + moves, strict=True)), readings.torque_Nm)
            left = self.centred(readings.lost_motion_rad - base)
            return left, float(left @ left + self._weight * moves @ moves)

        nothing = np.zeros(len(SCALES))
        moves, tangents, at = (
            (start.moves, start.tangents, start.tangents_at)
            if start
            else (nothing, self.tangents, nothing)
        )
        left, cost = residual(moves)
        damping = 1.0
        for _ in range(REFIT_STEPS if cost > 0 else 0):
            normal = tangents.T @ tangents
            normal += self._weight * np.eye(len(SCALES)) + (damping - 1) * np.diag(np.diag(normal))
            step = np.linalg.solve(normal, tangents.T @ left - self._weight * moves)
            step = np.clip(moves + step, LEAST_SCALE - 1, LARGEST_SCALE - 1) - moves
            new_left, new_cost = residual(moves + step)
            gain = 1 - new_cost / cost
            if gain > 0:
                left, cost, moves = new_left, new_cost, moves + step
                damping = 1.0
            else:
                damping = 1 + 10 * max(damping - 1, 0.001)
            if 0 <= gain < LEAST_GAIN or damping > 1e3:
                break
            far = np.max(np.abs(np.log((1 + moves) / (1 + at)))) > TANGENT_REACH
            if (gain < 0 or far) and not np.array_equal(at, moves):
                tangents, at, damping = self.tangents_at(moves), moves, 1.0
        return Residual(left, moves, tangents, at)

    @cached_property
    def thinned(self) -> TestBench:
        """The same bench with fewer samples, to find magnitudes quickly."""
        bench = copy.copy(self)
        # What the bench has computed for all rows is not valid for the selected ones.
        for name in CACHED:
            bench.__dict__.pop(name, None)
        bench.plan = self.plan.thinned(THINNING)
        return bench

    def magnitude_for(self, name: str, sigma: float) -> tuple[float, Residual]:
        """Find the magnitude of an effect that leaves `sigma` times the noise after a refit."""
        hidden = HIDDEN[name]
        scale = hidden.scale(self.drive)
        if hidden.spike:
            return hidden.typical, self.absorb({name: hidden.typical})
        guess = hidden.typical * scale * min(sigma, 1.0)
        start = None
        if not hidden.quick:
            guess, near = self.thinned._search(name, sigma, guess, None)
            if np.max(np.abs(near.moves)) > TANGENT_REACH:
                tangents = self.tangents_at(near.moves)
                start = Residual(near.left_rad, near.moves, tangents, near.moves)
        return self._search(name, sigma, guess, start)

    def _search(
        self, name: str, sigma: float, magnitude: float, start: Residual | None
    ) -> tuple[float, Residual]:
        hidden = HIDDEN[name]
        wanted = sigma * SIGMA_ARCSEC
        limit = hidden.limit * hidden.scale(self.drive)
        low, high = 0.0, np.inf
        nearest: tuple[float, float, Residual] | None = None
        for _ in range(SEARCH_STEPS):
            residual = self.absorb({name: magnitude}, start=start)
            found = residual.arcsec
            miss = abs(found / wanted - 1)
            if miss < SIZE_TOLERANCE:
                return magnitude, residual
            if nearest is None or miss < nearest[0]:
                nearest = miss, magnitude, residual
            if found < wanted:
                low = magnitude
                if magnitude >= limit:
                    break
            else:
                high = magnitude
            guess = magnitude * min(max(wanted / max(found, 1e-9), 0.05), 20.0)
            if not low < guess < high:
                guess = (low + min(high, 2 * magnitude)) / 2
            guess = min(guess, limit)
            share = min(guess / magnitude, 2.0)
            start = replace(residual, moves=np.maximum(residual.moves * share, LEAST_SCALE - 1))
            magnitude = guess
        # Friction slips or sticks, so a refit may end in one of two states: residuals can jump.
        if nearest and nearest[0] < LARGEST_MISS:
            return nearest[1:]
        raise TooSmallError(
            f"{name}: {magnitude:.3g} {hidden.unit} leaves {found:.2g} arcsec after a refit, "
            f"wanted {wanted:.2g} arcsec; the plan `{self.plan.name}` cannot show it"
        )

    # --- how well it can be seen at best ---------------------------------------------------------

    def _whitened(self, columns: Array) -> list[Array]:
        """Filter columns run by run so that the angle noise is white with unit variance."""
        sigma = SIGMA_ARCSEC * ARCSEC * self.noise
        white = (1 - COLOURED_SHARE) * sigma**2
        drive = COLOURED_SHARE * sigma**2 * (1 - COLOUR**2)
        # First-order autoregression plus white noise is an ARMA(1, 1): match its autocovariances.
        ratio = -COLOUR * white / (drive + (1 + COLOUR**2) * white)
        moving = (1 - np.sqrt(1 - 4 * ratio**2)) / (2 * ratio)
        scale = np.sqrt(-COLOUR * white / moving)
        return [
            lfilter([1, -COLOUR], [1, moving], columns[rows], axis=0) / scale
            for rows in self.plan.slices()
        ]

    def information(self, signatures: Array) -> Array:
        """Fisher information of the signatures' amplitudes, refit and run scatter removed.

        `signatures` has a column each, in rad. With an amplitude of 1, an ideal test of one
        signature alone finds it `sqrt(information[i, i])` standard deviations from zero.
        """
        bases, scatters, count = len(SCALES), len(SCATTER), signatures.shape[1]
        one = np.ones((len(self.plan.run), 1))
        columns = np.hstack([one, self.scatter_tangents, self.tangents, signatures])
        prior = np.diag([1 / max(self.scatter * rms, 1e-9) ** 2 for rms in SCATTER.values()])
        total = np.zeros((bases + count, bases + count))
        for rows in self._whitened(columns):
            gram = rows.T @ rows
            inner = gram[: 1 + scatters, : 1 + scatters].copy()
            inner[1:, 1:] += prior
            cross = gram[: 1 + scatters, 1 + scatters :]
            total += gram[1 + scatters :, 1 + scatters :] - cross.T @ np.linalg.solve(inner, cross)
        weight = self._weight / (SIGMA_ARCSEC * ARCSEC) ** 2
        base = total[:bases, :bases] + weight * np.eye(bases)
        cross = total[:bases, bases:]
        return total[bases:, bases:] - cross.T @ np.linalg.solve(base, cross)

    def signature(self, name: str, magnitude: float) -> Array:
        """Change of the lost motion by a small amount of an effect, a column for each phase."""
        phases = self.phases(name)
        turns = [phases]
        for i in range(HIDDEN[name].phases):
            turned = phases.copy()
            turned[i] += np.pi / 2
            turns.append(turned)
        columns = []
        for dealt in turns:
            readings = self.read({name: magnitude}, {name: dealt})
            same_torque = np.array_equal(readings.torque_Nm, self.torque_Nm)
            base = self.plain if same_torque else self.refitted({}, readings.torque_Nm)
            columns.append(readings.lost_motion_rad - base)
        return np.column_stack(columns)

    def twins(self, residual: Residual, names: list[str]) -> dict[str, float]:
        """Cosine between a residual and the closest residual that each named effect can have.

        1 means that this plan confounds them, whatever the method. An effect that would
        have to be implausibly large gets 0.
        """
        bench = self.thinned
        rows = np.concatenate(
            [np.arange(run.start, run.stop, THINNING) for run in self.plan.slices()]
        )
        sizes = {
            name: SIGNATURE_SHARE * HIDDEN[name].typical * HIDDEN[name].scale(self.drive)
            for name in names
        }
        signatures = {name: bench.signature(name, size) for name, size in sizes.items()}
        truth = residual.left_rad[rows, None]
        information = bench.information(np.hstack([truth, *signatures.values()]))
        cosines, at = {}, 1
        for name, columns in signatures.items():
            mine = slice(at, at + columns.shape[1])
            at = mine.stop
            cross = information[0, mine]
            factors = np.linalg.pinv(information[mine, mine], rcond=1e-9, hermitian=True) @ cross
            limit = HIDDEN[name].limit * HIDDEN[name].scale(self.drive)
            plausible = np.linalg.norm(factors) * sizes[name] <= limit
            near = np.sqrt(max(cross @ factors / information[0, 0], 0.0))
            cosines[name] = float(near) if plausible else 0.0
        return cosines
