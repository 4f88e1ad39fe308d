"""Sudden changes: steps of the lost motion from a slip, a remount or lost counts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import special

from lostmotion import rules
from lostmotion.arrays import FloatArray
from lostmotion.candidates.formulas import step
from lostmotion.discover.linearise import columns_of, contest_at, form_part, noise_rms
from lostmotion.discover.measurement_noise import estimate_noise
from lostmotion.effects.conditions import side_by_side
from lostmotion.evidence.noise import Noise
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.terms import Additive
from lostmotion.rms import robust_rms
from lostmotion.threads import in_parallel
from lostmotion.units import ARCSEC, plain_number

WILD_MAX = 12
"""Largest number of repeated searches of a run after outliers are set aside."""

WILD_REACH = 2
"""Samples that are set aside before and after an outlier."""

EDGE = 5
"""Samples at either end of a run where a step is confounded with the offset."""

EVENTS_MAX = 20

EVENT_NAME = "step in run "
"""Prefix of the names of event shapes."""


@dataclass
class Event:
    """A step of the lost motion."""

    run: int
    row: int
    time_s: float
    size_arcsec: float
    score: float

    def told(self, labels: Sequence[int | str]) -> dict[str, Any]:
        """Return the entry for the answer."""
        return {
            "run": labels[self.run],
            "run_number": self.run + 1,
            "time_s": self.time_s,
            "size_arcsec": self.size_arcsec,
            "score": self.score,
        }


def dependence(event: Mapping[str, Any], rows: int) -> dict[str, Any]:
    """Return the entry of an event in the unexplained part of the answer.

    Parameters
    ----------
    event : mapping
        From `Event.told`.
    rows : int
        Number of samples searched.
    """
    return {
        "covariate": "time",
        "shape": f"step of {plain_number(event['size_arcsec'])} arcsec in run {event['run']} "
        f"at {event['time_s']:.6g} s",
        "p": min(1.0, float(2 * special.ndtr(-event["score"]) * rows)),
        **({"formula": step(event)} if "run_number" in event else {}),
    }


def scan_run(
    base: BaselineModel, noise: Noise, run: int, columns: FloatArray, response: FloatArray
) -> Event:
    """Find the most likely step of one run, with the deviations of the run free."""
    c = base.conditions
    at = c.slices()[run]
    white = noise.whiten(columns[at], run)
    y = noise.whiten(response[at], run)
    if y.size <= 2 * EDGE:
        return Event(run, int(at.start), float(c.time_s[at.start]), 0.0, 0.0)
    norm = np.sqrt(np.einsum("ij,ij->j", white, white))
    norm[norm == 0] = 1.0
    white = white / norm
    rows = at.stop - at.start
    aside = np.zeros(0, dtype=int)
    for _ in range(WILD_MAX):
        pulses = np.zeros((rows, aside.size))
        pulses[aside, np.arange(aside.size)] = 1.0
        beside = np.hstack([white, noise.whiten(pulses, run)])
        z, sizes, rest = scores(beside, y, noise, run)
        k = int(np.argmax(np.abs(z)))
        if abs(z[k]) < rules.SUDDEN_LEAST or seen(
            response[at], k + noise.lags, float(sizes[k]), noise.spread(run)
        ):
            break
        near = np.arange(-WILD_REACH, WILD_REACH + 1) + noise.lags
        wild = np.concatenate((k + near, int(np.argmax(np.abs(rest))) + near))
        aside = np.union1d(aside, wild[(wild >= 0) & (wild < rows)])
    else:
        z = np.zeros_like(z)
    row = int(at.start) + noise.lags + k
    return Event(run, row, float(c.time_s[row]), float(sizes[k]), float(abs(z[k])))


def seen(residual: FloatArray, row: int, size: float, spread: float) -> bool:
    """Whether the residual without outliers differs before and after a row.

    Over as many samples as give the mean of such a step the least score.
    """
    needed = (rules.SUDDEN_LEAST * spread / size) ** 2
    reach = int(np.clip(needed, 2 * EDGE, residual.size))
    before, behind = residual[max(row - reach, 0) : row], residual[row : row + reach]
    change = float(np.median(behind) - np.median(before))
    return abs(change - size) < abs(change)  # nearer to this step than to none


def scores(
    white: FloatArray, y: FloatArray, noise: Noise, run: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Score and size of a step at every sample together with whitened columns, and the residual."""
    n = y.size
    each = noise.step_responses(run, n)
    last = each[-1]

    def products(columns: FloatArray) -> FloatArray:
        """Products of every step with columns."""
        out = np.cumsum((last[:, None] * columns)[::-1], axis=0)[::-1]
        for j, response in enumerate(each[:-1]):
            out[: n - j] += ((response - last)[:, None] * columns)[j:]
        return np.asarray(out)

    gram = white.T @ white + 1e-8 * np.eye(white.shape[1])
    rest = y - white @ np.linalg.solve(gram, white.T @ y)
    cross = products(white)
    first = products(rest[:, None])[:, 0]
    own = np.cumsum((last**2)[::-1])[::-1].copy()
    for j, response in enumerate(each[:-1]):
        own[: n - j] += (response**2 - last**2)[j:]
    own = own - np.einsum("ij,ij->i", cross, np.linalg.solve(gram, cross.T).T)
    # If the curve of the run absorbs almost all of a step, a single outlier could cause it.
    good = own > max(1e-3 * float(own.max()), EDGE * float(np.median(last)) ** 2, 1e-300)
    good[:EDGE] = good[-EDGE:] = False
    z = np.where(good, first / np.sqrt(np.where(good, own, 1.0)), 0.0)
    return z, np.where(good, first / np.where(good, own, 1.0), 0.0), rest


def find_events(base: BaselineModel, noise: Noise, within_arcsec: float) -> list[Event]:
    """Find steps that are significant against the noise."""
    fixed, _, scatter, _ = columns_of(base, base.at(), form=False)
    # Here each run has its own stiffness, friction, gap, offset and curve.
    keep = np.einsum("ij,ij->j", fixed, fixed) > 0
    columns = side_by_side(fixed[:, keep], scatter[:, :3])
    response = base.residual()
    if base.form_error is not None:
        response -= form_part(base, contest_at(base, noise))
    best = in_parallel(
        lambda run: scan_run(base, noise, run, columns, response), range(base.conditions.runs)
    )
    found = [
        event
        for event in best
        if event.score >= rules.SUDDEN_LEAST
        and abs(event.size_arcsec) >= rules.SIZE_LEAST * within_arcsec
    ]
    found = sorted(found, key=lambda e: -e.score)[:EVENTS_MAX]
    return sorted(found, key=lambda e: e.row)


def early_events(base: BaselineModel) -> list[Event]:
    """Find the steps in the residual of a fitted baseline model before anything is added.

    A richer form of the hysteresis, rows set aside as outliers, and the noise estimate of the run
    would otherwise absorb a step.
    """
    noise = estimate_noise(base, ())
    return find_events(base, noise, noise_rms(noise, base))


def lost_counts(base: BaselineModel, ratio: float) -> list[Event]:
    """Find lost counts: jumps of the input encoder together with the lost motion.

    They are identified from the encoder reading before any fit, because a shape over the angle,
    which jumps too, could produce the same step.
    """
    c = base.conditions
    angle = c.columns.get("input_angle_rad")
    if angle is None:
        return []
    found = []
    for run, at in enumerate(c.slices()):
        if at.stop - at.start <= 2 * EDGE:
            continue
        turned, moved = sudden(angle[at] / (ratio * ARCSEC)), sudden(base.measured[at])
        noise = robust_rms(moved)
        least = rules.SUDDEN_LEAST * (robust_rms(turned) + noise)
        for k in np.flatnonzero(np.abs(turned) > least):
            size = -float(turned[k])
            # The adjacent steps do not reverse it, whereas an outlier leaves and returns.
            stays = all(
                round(-float(turned[near].sum()) / size) == 1
                for near in (slice(k, k + EDGE), slice(max(k + 1 - EDGE, 0), k + 1))
            )
            if stays and round(float(moved[k]) / size) == 1:
                row = int(at.start + k + 1)
                score = abs(size) / max(noise, 1e-300)
                found.append(Event(run, row, float(c.time_s[row]), size, score))
    return found


def sudden(values: FloatArray) -> FloatArray:
    """Change from each sample to the next, minus the local trend."""
    step = np.diff(values)
    about = sliding_window_view(np.pad(step, 2, "edge"), 5)
    return np.asarray(step - np.median(about, axis=1))


def with_steps(base: BaselineModel, events: Sequence[Event]) -> BaselineModel:
    """A baseline model with the steps of events in it."""
    again = base.copy()
    for event in events:
        columns = step_columns(base, event)
        sizes = np.full(columns.shape[1], event.size_arcsec)
        name = f"{EVENT_NAME}{base.conditions.labels[event.run]}"
        again.additives.append(Additive(name, columns, sizes, "time", "step"))
    return again


def step_columns(base: BaselineModel, event: Event) -> FloatArray:
    """A step from the time of an event to the end of its run, and a step of all later runs.

    A slip persists unless the sensor is zeroed again; two separate columns allow for both.

    Returns
    -------
    ndarray
        Zeros and ones, (rows, 2), or (rows, 1) if there is no later run.
    """
    c = base.conditions
    end = int(c.starts[event.run + 1])
    out = np.zeros((c.rows, 1 if end == c.rows else 2))
    out[event.row : end, 0] = 1.0
    out[end:, 1:] = 1.0
    return out
