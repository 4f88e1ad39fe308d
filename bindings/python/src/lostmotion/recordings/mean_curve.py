"""The mean curve of a campaign: lost motion over the torque, by medians."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.recordings.bursts import scatter
from lostmotion.recordings.campaign import Run

BINS = 24
"""Intervals of the torque, equally wide, in which the mean curve is the median."""

PULSES = 0.1
"""If the torque is nearly always within this small part of its range, it is constant with
deliberate pulses.
"""

BIN_SAMPLES = 5
"""Least number of samples of an interval for a robust median."""

PASSES = 3
"""Number of alternating estimates of the curve and the zeros of the runs."""

UNDERFLOW_Nm = float(np.finfo(np.float64).tiny) ** (1 / 3)
"""The slope of a curve multiplies three torque differences: smaller ones would underflow."""


class MeanCurve:
    """Lost motion over the torque, by medians, robust against outliers."""

    def __init__(self, runs: Iterable[Run]) -> None:
        runs = list(runs)
        torque = np.concatenate([run.torque_Nm for run in runs])
        lost = [run.lost_motion_rad for run in runs]
        size = [values.size for values in lost]
        low, high = np.quantile(torque, [0.005, 0.995])
        self.torque_Nm = np.zeros(1)
        self.lost_rad = np.zeros(1)
        self.covers = bool(high - low >= PULSES * np.ptp(torque))
        if torque.size < 2 * BIN_SAMPLES + 2 or not np.ptp(torque) > UNDERFLOW_Nm:
            return
        ends = np.partition(torque, [BIN_SAMPLES, -BIN_SAMPLES - 1])[
            [BIN_SAMPLES, -BIN_SAMPLES - 1]
        ]
        if high - low < PULSES * (ends[1] - ends[0]):
            low, high = ends
        edges = np.linspace(low, high, BINS + 1)
        place = np.clip(np.searchsorted(edges, torque, side="right") - 1, 0, BINS - 1)
        filled = np.flatnonzero(np.bincount(place, minlength=BINS) >= BIN_SAMPLES)
        if filled.size < 2:
            return
        order = np.argsort(place, kind="stable")
        cuts = np.searchsorted(place[order], np.arange(1, BINS))
        self.torque_Nm = (0.5 * (edges[:-1] + edges[1:]))[filled]
        self.lost_rad = np.zeros(filled.size)
        for _ in range(PASSES):
            curve = np.split(self(torque), np.cumsum(size)[:-1])
            zeros = [np.median(y - f) for y, f in zip(lost, curve, strict=True)]
            level = np.concatenate([y - zero for y, zero in zip(lost, zeros, strict=True)])
            parts = np.split(level[order], cuts)
            self.lost_rad = np.array([np.median(parts[k]) for k in filled])

    def __call__(self, torque_Nm: FloatArray) -> FloatArray:
        """Lost motion in rad at torques; linear beyond the measured range."""
        x, y = self.torque_Nm, self.lost_rad
        if x.size == 1:
            return np.zeros(torque_Nm.size)
        slope = (y[-1] - y[0]) / (x[-1] - x[0])
        inside = np.clip(torque_Nm, x[0], x[-1])
        return np.asarray(np.interp(inside, x, y) + slope * (torque_Nm - inside))

    def slope(self, torque_Nm: FloatArray) -> FloatArray:
        """Compliance in rad/Nm at torques, or the larger one between them."""
        x, y = self.torque_Nm, self.lost_rad
        if x.size == 1:
            return np.zeros(torque_Nm.size)
        return np.asarray(np.interp(torque_Nm, x, np.abs(np.gradient(y, x))))

    def noise(self, run: Run) -> FloatArray:
        """Scatter from sample to sample due to torque noise, by the local slope.

        Where the drive is soft, as in its backlash, a small torque causes a large angle.
        """
        slope = self.slope(run.torque_Nm)
        beside = np.maximum(slope[1:], slope[:-1])
        step = np.diff(self.rest(run))
        steep = beside > 0
        return slope * scatter(step[steep] / beside[steep])

    def rest(self, run: Run) -> FloatArray:
        """Lost motion that the torque does not explain."""
        return run.lost_motion_rad - self(run.torque_Nm)
