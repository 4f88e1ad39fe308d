"""Coloured noise within runs: an autoregression for each sampling rate, and whitening by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.linalg import solve_toeplitz

from lostmotion import rules
from lostmotion.arrays import FloatArray, IntArray
from lostmotion.rms import rms_of

ORDER_MAX = 8
"""Highest order that is tried."""

GROUP_ROWS_LEAST = 2000
"""Least number of rows for a noise model; otherwise the pooled one is used."""

NOISE_LEAST_ARCSEC = 1e-6
"""Least noise: 5e-12 rad, below any encoder. Smaller values are rounding of a fit with as many
values as samples, and their inverse square would overflow.
"""


@dataclass
class Noise:
    """Noise of each run.

    Attributes
    ----------
    phi : list of ndarray
        Coefficients of the autoregression.
    sigma : ndarray
        Standard deviation of the innovations, arc seconds.
    relative : list of ndarray, optional
        Standard deviation of the samples of each run, relative to the rms of all samples
        (`torque_error.relative_noise`); by default 1.
    """

    phi: list[FloatArray]
    sigma: FloatArray
    relative: list[FloatArray] | None = None

    @cached_property
    def lags(self) -> int:
        """Rows at the start of each run that whitening consumes."""
        return max(p.size for p in self.phi)

    def with_runs(self, like: int, rows: Sequence[int]) -> Noise:
        """The same with more runs of some rows, each with the noise of run `like`."""
        more = [np.ones(count) for count in rows]
        return Noise(
            [*self.phi, *(self.phi[like] for _ in rows)],
            np.append(self.sigma, [self.sigma[like]] * len(rows)),
            None if self.relative is None else [*self.relative, *more],
        )

    def whiten(self, values: FloatArray, run: int) -> FloatArray:
        """Innovations of one run's columns, in units of their standard deviation.

        All columns, end to end, are correlated with the coefficients in one pass. What mixes the
        end of a column with the start of the next is among the rows that whitening consumes.
        """
        if values.ndim == 1:
            return self.whiten(values[:, None], run)[:, 0]
        n, count = values.shape
        if self.relative is not None:
            values = values / self.relative[run][:, None]
        lags = min(self.lags, n - 1)
        kernel = np.append(-self.phi[run][:lags][::-1], 1.0) / self.sigma[run]
        if not count:
            return np.empty((n - lags, 0))
        whole = np.correlate(values.T.reshape(-1), kernel, "full")[: n * count]
        return whole.reshape(count, n).T[lags:]

    def whiten_runs(self, values: FloatArray, starts: IntArray) -> tuple[FloatArray, IntArray]:
        """Innovations of one column over all runs, and where each run begins among them.

        Like `whiten` of each run, but with one step per lag, regardless of the number of runs.

        Parameters
        ----------
        values : ndarray
            One column, the runs end to end.
        starts : ndarray
            Offsets of the runs.
        """
        rows = np.diff(starts)
        skipped = np.minimum(self.lags, rows - 1)
        phi = np.zeros((rows.size, self.lags))
        for run, own in enumerate(self.phi):
            reach = min(own.size, int(skipped[run]))
            phi[run, :reach] = own[:reach]
        if self.relative is not None:
            values = values / np.concatenate(self.relative)
        out = values.copy()
        for k in range(1, self.lags + 1):
            out[k:] -= np.repeat(phi[:, k - 1], rows)[k:] * values[:-k]
        out /= np.repeat(self.sigma, rows)
        place = np.arange(values.size) - np.repeat(starts[:-1], rows)
        kept = rows - skipped
        return out[place >= np.repeat(skipped, rows)], np.cumsum(kept) - kept

    def step_responses(self, run: int, rows: int) -> list[FloatArray]:
        """Whitened step at each row, by the number of rows since it began; the last for more.

        Parameters
        ----------
        rows : int
            Rows of the run that whitening leaves.
        """
        phi = self.phi[run]
        scale = np.ones(rows + self.lags)
        if self.relative is not None:
            scale = 1.0 / self.relative[run]
        skipped = scale.size - rows
        out = [scale[skipped:] / self.sigma[run]]
        for back, factor in enumerate(phi, start=1):
            before = scale[skipped - back : scale.size - back]
            out.append(out[-1] - factor * before / self.sigma[run])
        return out

    @cached_property
    def ratios(self) -> FloatArray:
        """Standard deviation of the noise over that of its innovations, of each run."""
        models = {id(phi): phi for phi in self.phi}  # runs of one sampling rate share theirs
        ratio = {key: np.sqrt(variance_of(phi)) for key, phi in models.items()}
        return np.array([ratio[id(phi)] for phi in self.phi])

    def spread(self, run: int) -> float:
        """Standard deviation of the noise itself, rms over the samples of a run, arc seconds."""
        relative = 1.0 if self.relative is None else rms_of(self.relative[run])
        return float(self.sigma[run] * self.ratios[run] * relative)


def variance_of(phi: FloatArray) -> float:
    """Variance of an autoregression with innovations of unit variance (Yule-Walker)."""
    reach = np.concatenate(([1.0], -phi))
    order = phi.size
    equations = np.zeros((order + 1, order + 1))
    for lag in range(order + 1):
        for back, factor in enumerate(reach):
            equations[lag, abs(lag - back)] += factor
    return float(np.linalg.solve(equations, np.eye(order + 1)[0])[0])


def rate_groups(time_s: FloatArray, starts: IntArray) -> IntArray:
    """Number the runs by their sampling rate."""
    steps = []
    for a, b in pairwise(starts):
        step = np.diff(time_s[a:b])
        # A clock with coarse ticks repeats stamps, so the mean step is used.
        steps.append(max(float(np.mean(step)), 1e-9) if step.size else 1.0)
    # Rates are equal if samples ORDER_MAX apart are less than half a sample apart in phase.
    return group_within(np.array(steps), 1.0 + 0.5 / ORDER_MAX)


def group_within(values: FloatArray, factor: float) -> IntArray:
    """Group positive values, in rising order, so that those of a group agree within a factor."""
    group = np.zeros(values.size, dtype=np.intp)
    last, number = -np.inf, -1
    for i in np.argsort(values, kind="stable"):
        if np.log(values[i]) - last > np.log(factor):
            number += 1
            last = np.log(values[i])
        group[i] = number
    return group


def autocovariance(
    residual: FloatArray, starts: IntArray, runs: IntArray
) -> tuple[FloatArray, int]:
    """Autocovariances up to `ORDER_MAX` pooled over runs."""
    total = np.zeros(ORDER_MAX + 1)
    rows = 0
    for r in runs:
        x = residual[starts[r] : starts[r + 1]]
        rows += x.size
        for k in range(min(ORDER_MAX, x.size - 1) + 1):
            total[k] += float(x[k:] @ x[: x.size - k])
    return total / max(rows, 1), rows


def autoregression(covariance: FloatArray, rows: int) -> tuple[FloatArray, float]:
    """Order by BIC, coefficients by Yule-Walker; returns them and the innovation variance."""
    best: tuple[float, FloatArray, float] | None = None
    for order in range(ORDER_MAX + 1):
        if covariance[0] <= 0:
            return np.zeros(0), 1.0
        phi = (
            solve_toeplitz(covariance[:order], covariance[1 : order + 1]) if order else np.zeros(0)
        )
        variance = float(covariance[0] - phi @ covariance[1 : order + 1])
        if variance <= 1e-12 * covariance[0]:
            break
        score = rows * np.log(variance) + np.log(max(rows, 2)) * order
        if best is None or score < best[0]:
            best = (score, phi, variance)
    assert best is not None
    _, phi, variance = best
    if phi.sum() > rules.PERSISTENCE_MAX:
        phi = phi * (rules.PERSISTENCE_MAX / phi.sum())
        reach = np.concatenate(([1.0], -phi))
        lags = np.abs(np.subtract.outer(np.arange(reach.size), np.arange(reach.size)))
        variance = float(reach @ covariance[lags] @ reach)
    return phi, variance


def fit_noise(
    residual: FloatArray,
    time_s: FloatArray,
    starts: IntArray,
    columns: int,
    relative: FloatArray | None = None,
) -> Noise:
    """Estimate the noise from the residual of the largest model.

    Parameters
    ----------
    residual : ndarray
    time_s : ndarray
    starts : ndarray
        Offsets of the runs.
    columns : int
        Number of columns of that model, for the degrees of freedom.
    relative : ndarray, optional
        Relative standard deviation of each sample, see `torque_error.relative_noise`.
    """
    if relative is not None:
        residual = residual / relative
    groups = rate_groups(time_s, starts)
    every = np.arange(groups.size)
    inflate = residual.size / max(residual.size - columns, 1)
    pooled, rows = autocovariance(residual, starts, every)
    common_phi, common_variance = autoregression(pooled, rows)
    phi: list[FloatArray] = [common_phi] * groups.size
    sigma = np.full(groups.size, np.sqrt(common_variance * inflate))
    for number in np.unique(groups):
        runs = np.flatnonzero(groups == number)
        covariance, rows = autocovariance(residual, starts, runs)
        if rows < GROUP_ROWS_LEAST:
            continue
        own, variance = autoregression(covariance, rows)
        for r in runs:
            phi[r] = own
            sigma[r] = np.sqrt(variance * inflate)
    apart = None if relative is None else np.split(relative, starts[1:-1])
    return Noise(phi, np.maximum(sigma, NOISE_LEAST_ARCSEC), apart)


def whitened_runs(residual: FloatArray, time_s: FloatArray, starts: IntArray) -> list[FloatArray]:
    """Whiten a residual by its own autoregression, run by run.

    Parameters
    ----------
    residual, time_s : ndarray of shape (n,)
        Arc seconds and seconds of every sample.
    starts : ndarray of shape (runs + 1,)

    Returns
    -------
    list of ndarray
        Innovations divided by their standard deviation: independent and of unit variance if the
        residual is noise. Runs that are too short are left out.
    """
    noise = fit_noise(residual, time_s, starts, 1)
    return [
        noise.whiten(residual[a:b, None], run)[:, 0]
        for run, (a, b) in enumerate(pairwise(starts))
        if b - a > noise.lags + 1
    ]
