"""Sudden changes: a step of the lost motion at one moment, a slip or a remount or a lost count."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lostmotion.discover.backbone import Base
from lostmotion.discover.conditions import side_by_side
from lostmotion.discover.noise import Noise
from lostmotion.discover.study import columns_of

FloatArray = npt.NDArray[np.float64]

SCORE_LEAST = 8.0
"""Least score of a step, in standard deviations: Gaussian noise alone reaches 5 in 1e5 samples, and
what is left of an effect whose form is not exactly right a little more ..."""

TAIL_FACTOR = 1.5
"""... and over the largest score that the other runs reach, where the noise has long tails."""

SIZE_LEAST = 0.5
"""Least size of a step over the noise within runs."""

EDGE = 5
"""Samples at either end of a run where a step cannot be told from the offset."""

EVENTS_MAX = 20


@dataclass
class Event:
    """A step of the lost motion."""

    run: int
    row: int
    time_s: float
    size_arcsec: float
    score: float


def scan_run(
    base: Base, noise: Noise, run: int, columns: FloatArray, response: FloatArray
) -> Event:
    """Find the likeliest step of one run, with the run's own base parameters free."""
    c = base.conditions
    at = c.slices()[run]
    white = noise.whiten(columns[at], run)
    y = noise.whiten(response[at], run)
    lags = noise.lags
    phi, sigma = noise.phi[run], noise.sigma[run]
    n = y.size
    if n <= 2 * EDGE:
        return Event(run, int(at.start), float(c.time_s[at.start]), 0.0, 0.0)
    norm = np.sqrt(np.einsum("ij,ij->j", white, white))
    norm[norm == 0] = 1.0
    white = white / norm
    # A step that starts at row k is (1 - phi_1 - ... - phi_j) at row k + j after whitening.
    response_of = np.ones(phi.size + 1)
    response_of[1:] = 1.0 - np.cumsum(phi)
    response_of /= sigma
    tail = response_of[-1]

    def score(columns: FloatArray) -> FloatArray:
        """Products of every step with columns."""
        total = np.zeros((n + 1, columns.shape[1]))
        total[:-1] = np.cumsum(columns[::-1], axis=0)[::-1]
        out = tail * total[:-1]
        for j in range(phi.size):
            shifted = np.zeros_like(columns)
            shifted[: n - j] = columns[j:]
            out += (response_of[j] - tail) * shifted
        return np.asarray(out)

    gram = white.T @ white + 1e-8 * np.eye(norm.size)
    solved = np.linalg.solve(gram, white.T @ y)
    rest = y - white @ solved
    cross = score(white)
    first = score(rest[:, None])[:, 0]
    own = tail**2 * (n - np.arange(n))
    for j in range(phi.size):
        own[: n - j] += response_of[j] ** 2 - tail**2
    own = own - np.einsum("ij,ij->i", cross, np.linalg.solve(gram, cross.T).T)
    # Where the run's own curve leaves next to nothing of a step, one wild sample would make it.
    good = own > max(1e-3 * float(own.max()), EDGE * tail**2, 1e-300)
    good[:EDGE] = good[-EDGE:] = False
    z = np.where(good, first / np.sqrt(np.where(good, own, 1.0)), 0.0)
    k = int(np.argmax(np.abs(z)))
    row = int(at.start) + lags + k
    size = float(first[k] / own[k]) if good[k] else 0.0
    return Event(run, row, float(c.time_s[row]), size, float(abs(z[k])))


def find_events(base: Base, noise: Noise, within_arcsec: float) -> list[Event]:
    """Find steps that stand out of the noise and of what the other runs show."""
    found: list[Event] = []
    fixed, _, scatter, _ = columns_of(base, base.at())
    # Each run has its own stiffness, friction, gap and offset here, and its own curve.
    keep = np.einsum("ij,ij->j", fixed, fixed) > 0
    columns = side_by_side(fixed[:, keep], scatter[:, :3])
    response = base.residual()
    best = [scan_run(base, noise, run, columns, response) for run in range(base.conditions.runs)]
    scores = np.array([event.score for event in best])
    for event in sorted(best, key=lambda e: -e.score):
        others = np.delete(scores, event.run)
        usual = float(np.median(others)) if others.size else 0.0
        if (
            event.score >= max(SCORE_LEAST, TAIL_FACTOR * usual)
            and abs(event.size_arcsec) >= SIZE_LEAST * within_arcsec
        ):
            found.append(event)
    found.sort(key=lambda e: e.row)
    return found[:EVENTS_MAX]


def step_column(base: Base, event: Event) -> FloatArray:
    """A step from the moment of an event to the end of its run: later runs have their own zero."""
    c = base.conditions
    out = np.zeros(c.rows)
    out[event.row : int(c.starts[event.run + 1])] = 1.0
    return out
