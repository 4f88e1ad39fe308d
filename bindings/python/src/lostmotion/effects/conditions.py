"""The conditions of every sample of a campaign, in the form that effects need."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import cached_property
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray, IntArray
from lostmotion.core import NEEDS
from lostmotion.recordings import Campaign
from lostmotion.recordings.quantities import QUANTITIES
from lostmotion.units import ARCSEC

Derived = TypeVar("Derived")

RATE_WINDOW = 7
"""Number of samples of the straight line whose slope is a rate: encoders and clocks have steps."""

QUIET_WINDOW = 3
"""Number of samples for the acceleration of an output without lost motion: its noise is that of the
input encoder divided by the ratio, and starts of motion are short.
"""

SAME_ANGLE = 1e-9
"""Relative difference of two angles that counts as rounding, far below any encoder resolution."""

MEASURED = {q.column: q.name for q in QUANTITIES.values() if q.column in NEEDS}
"""Conditions that are columns of a recording; the others are rates of these, or times."""


def side_by_side(*parts: FloatArray) -> FloatArray:
    """Columns and matrices as one matrix with contiguous columns."""
    return np.concatenate([np.atleast_2d(part.T) for part in parts]).T


def subtract_means(columns: FloatArray, counts: IntArray) -> None:
    """Subtract from every column the means over groups of so many rows, in place."""
    starts = np.cumsum(counts) - counts
    for column in columns.T:
        column -= np.repeat(np.add.reduceat(column, starts) / counts, counts)


class Conditions:
    """Columns of a campaign, joined in file order, with rates derived from them.

    Parameters
    ----------
    campaign : Campaign

    Attributes
    ----------
    columns : dict
        Arrays by the names of `NEEDS`; quantities that were not measured are absent. Output angle
        and acceleration are those without lost motion, see `unwound`.
    lost_motion : ndarray
        Arc seconds.
    starts, run_of : ndarray
        Offsets of the runs, and the run of every sample.
    derived : dict
        What was computed by `once`.
    """

    def __init__(self, campaign: Campaign) -> None:
        self.campaign = campaign
        self.starts = campaign.starts
        self.runs = len(campaign.runs)
        self.rows = campaign.rows
        self.run_of = np.repeat(np.arange(self.runs), np.diff(self.starts))
        self.labels = [run.label for run in campaign.runs]
        self.time_s = campaign.column("time")
        self.lost_motion = campaign.column("lost_motion") / ARCSEC
        self.derived: dict[tuple[object, ...], Any] = {}
        have = campaign.quantities()
        self.columns: dict[str, FloatArray] = {}
        for condition, quantity in MEASURED.items():
            if quantity not in have:
                continue
            values = campaign.column(quantity)
            if not np.all(np.isfinite(values)):
                if np.count_nonzero(~self.between_readings(values)) > 0.5 * values.size:
                    continue
                values = self.fill(values)
            self.columns[condition] = np.ascontiguousarray(values)
        if "input_angle_rad" in self.columns and campaign.timed:
            self.columns["input_velocity_rad_s"] = self.rate(self.columns["input_angle_rad"])
        if "output_angle_rad" in self.columns:
            reading = self.columns["output_angle_rad"]
            place = self.unwound()
            self.columns["output_angle_rad"] = place
            if campaign.timed:
                samples = RATE_WINDOW if place is reading else QUIET_WINDOW
                self.columns["output_acceleration_rad_s2"] = self.rate(self.rate(place), samples)
        if campaign.timed:
            elapsed = np.diff(self.time_s, prepend=self.time_s[0])
            elapsed[self.starts[:-1]] = 0.0
            self.columns["elapsed_s"] = np.maximum(elapsed, 0.0)

    @cached_property
    def wrapped_rad(self) -> FloatArray | None:
        """Input angle within one turn, because many turns lose digits in float32."""
        angle = self.columns.get("input_angle_rad")
        return None if angle is None else np.remainder(angle + np.pi, 2 * np.pi) - np.pi

    def once(
        self, key: tuple[object, ...], compute: Callable[..., Derived], *arguments: Any
    ) -> Derived:
        """Result of a function that depends on these conditions and the key alone, called once."""
        if key not in self.derived:
            self.derived[key] = compute(*arguments)
        found: Derived = self.derived[key]
        return found

    @property
    def torque(self) -> FloatArray:
        """External torque, N m."""
        return self.columns["torque_Nm"]

    def with_torque(self, torque: FloatArray) -> Conditions:
        """The same recordings with other torques."""
        other = copy.copy(self)
        other.columns, other.derived = {**self.columns, "torque_Nm": torque}, {}
        return other

    def mirrored(self) -> Conditions:
        """The same load and motion in the other direction, at the same places and temperatures."""
        other = copy.copy(self)
        turned = ("torque_Nm", "input_velocity_rad_s", "output_acceleration_rad_s2")
        other.columns = {
            name: -column if name in turned else column for name, column in self.columns.items()
        }
        other.derived = {}
        return other

    def unwound(self) -> FloatArray:
        """Output angle without lost motion, if the lost motion was computed from it.

        Otherwise the reading would contain the lost motion and its noise, and an effect of the
        output angle or its acceleration would explain itself. If the input was not recorded, the
        noise shows whether this is the case.
        """
        reading = self.columns["output_angle_rad"]
        turned = self.columns.get("input_angle_rad")
        nominal = reading - self.lost_motion * ARCSEC
        if turned is None:
            return np.asarray(nominal) if self.rough(nominal) < self.rough(reading) else reading
        across = self.centred(turned)
        up = self.centred(nominal)
        share = float(across @ up) / max(float(across @ across), 1e-300)
        rest = float(np.max(np.abs(up - share * across)))
        derived = rest <= SAME_ANGLE * max(1.0, float(np.max(np.abs(nominal))))
        return np.asarray(nominal) if derived else reading

    def rough(self, values: FloatArray) -> float:
        """Mean square of the second differences of a column."""
        bends = [np.diff(values[at], n=2) for at in self.slices()]
        return float(np.mean(np.concatenate(bends) ** 2))

    def slices(self) -> tuple[slice, ...]:
        """Rows of each run."""
        return self.rows_of_runs

    @cached_property
    def rows_of_runs(self) -> tuple[slice, ...]:
        """The same, made once: there may be thousands of runs."""
        return tuple(slice(a, b) for a, b in pairwise(self.starts.tolist()))

    def between_readings(self, values: FloatArray) -> BoolArray:
        """Mark the rows from the first to the last reading of their run, as of a slow channel."""
        marked = np.zeros(values.size, dtype=np.bool_)
        for at in self.slices():
            good = np.flatnonzero(np.isfinite(values[at]))
            if good.size:
                marked[at.start + good[0] : at.start + good[-1] + 1] = True
        return marked

    def fill(self, values: FloatArray) -> FloatArray:
        """Interpolate missing values of a column within its run; empty runs get the median."""
        out = values.copy()
        middle = float(np.nanmedian(values))
        for at in self.slices():
            good = np.isfinite(out[at])
            if not good.any():
                out[at] = middle
            elif not good.all():
                index = np.arange(good.size)
                out[at] = np.interp(index, index[good], out[at][good])
        return out

    def rate(self, values: FloatArray, samples: int = RATE_WINDOW) -> FloatArray:
        """Slope of a column over time, from straight lines through a number of samples."""
        out = np.zeros_like(values)
        half = samples // 2
        for at in self.slices():
            t, x = self.time_s[at], values[at]
            n = t.size
            if n < 3:
                continue
            t, x = t - t[0], x - x[0]
            low = np.maximum(np.arange(n) - half, 0)
            high = np.minimum(np.arange(n) + half + 1, n)

            def window(q: FloatArray, low: IntArray = low, high: IntArray = high) -> FloatArray:
                total = np.concatenate(([0.0], np.cumsum(q)))
                return np.asarray((total[high] - total[low]) / (high - low))

            # Centred on a moving point, so that long recordings keep their digits.
            tt, tx, mt, mx = window(t * t), window(t * x), window(t), window(x)
            spread = tt - mt * mt
            good = spread > 1e-12 * max(float(t[-1]) ** 2, 1e-300)
            out[at] = np.where(good, (tx - mt * mx) / np.where(good, spread, 1.0), 0.0)
        return out

    def run_mean(self, values: FloatArray) -> FloatArray:
        """Mean of each run."""
        return np.asarray(
            np.add.reduceat(values, self.starts[:-1], axis=0)
            / np.diff(self.starts).reshape((-1,) + (1,) * (values.ndim - 1))
        )

    def centre(self, columns: FloatArray) -> None:
        """Subtract the mean of each run from every column, in place."""
        subtract_means(columns, np.diff(self.starts))

    def centred(self, values: FloatArray) -> FloatArray:
        """One column minus the mean of each run."""
        return np.asarray(values - self.run_mean(values)[self.run_of])

    def centred_on(self, rows: BoolArray, values: FloatArray, more: int = 0) -> FloatArray:
        """Values of some rows minus the mean of each run over them; one column or several.

        With `more` empty rows at the end.
        """
        counts = np.add.reduceat(rows.astype(np.intp), self.starts[:-1])
        count = int(counts.sum())
        kept = np.empty((count + more, *values.shape[1:]), order="F")
        # Stretches of rows are copied at once, because whole runs are left out.
        ends = np.flatnonzero(np.diff(rows, prepend=False, append=False))
        place = 0
        for begin, end in zip(ends[::2], ends[1::2], strict=True):
            kept[place : place + end - begin] = values[begin:end]
            place += end - begin
        own = kept[:count]
        subtract_means(own if own.ndim > 1 else own[:, None], counts[counts > 0])
        return kept

    def known(self) -> frozenset[str]:
        """Names of the conditions that are known."""
        return frozenset(self.columns)
