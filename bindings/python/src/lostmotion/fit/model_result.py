"""Common interface of results with a fitted model: parameters, residuals, predictions, figures."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.arrays import FloatArray
from lostmotion.effects.conditions import Conditions
from lostmotion.errors import InputError, given_as
from lostmotion.fit.baseline import FILED, BaselineModel
from lostmotion.fit.drive_file import require
from lostmotion.recordings import Campaign
from lostmotion.results import Parameter, ParameterTable, data_frame, figures
from lostmotion.units import ARCMIN, ARCSEC

ComplexArray = npt.NDArray[np.complex128]

AXES = {
    "torque_Nm": "torque, N m",
    "time_s": "time, s",
    "temperature_C": "temperature, °C",
    "model_arcmin": "fit, arcmin",
}
"""Axis titles of residual figures."""


ORDERS, ORDERS_DRAWN = 8.0, 800
"""Default of the largest order of a spectrum, and number of orders drawn. Chosen: kinematic errors
have orders 2 and 4 of the input.
"""

SUMMED_TOGETHER = 8192
"""Samples of which the powers are held in memory at once, some 7 MB."""


def amplitudes(angle_rad: FloatArray, residual: FloatArray, order: FloatArray) -> FloatArray:
    """Amplitude of a residual at orders of an angle: the periodogram of Lomb and Scargle.

    The orders are the multiples of the first, so that every sine is a power of one number.
    """
    first = np.exp(1j * order[0] * angle_rad)
    wave = power_sums(first, residual - residual.mean(), order.size)
    double = power_sums(first**2, np.ones(residual.size), order.size)
    # In the phase in which sine and cosine are orthogonal over these angles.
    turned = wave * np.exp(-0.5j * np.angle(double))
    size = residual.size
    power = turned.real**2 / (size + np.abs(double))
    rest = np.maximum(size - np.abs(double), np.finfo(float).eps * size)
    return np.asarray(2.0 * np.sqrt((power + turned.imag**2 / rest) / size))


def power_sums(base: ComplexArray, weight: FloatArray, count: int) -> ComplexArray:
    """Sum of `weight` times `base` to the power of 1, 2 ... `count`, over all samples."""
    inner = math.isqrt(count - 1) + 1
    outer = -(-count // inner)
    total = np.zeros((outer, inner), complex)
    for start in range(0, base.size, SUMMED_TOGETHER):
        part = slice(start, start + SUMMED_TOGETHER)
        low = base[part, None] ** np.arange(1, inner + 1)
        high = base[part, None] ** (inner * np.arange(outer)) * weight[part, None]
        total += high.T @ low
    return total.ravel()[:count]


class ModelResult:
    """A result that contains a fitted model.

    A subclass provides the model (`fitted_base`) and, if available, standard errors
    (`errors_by_name`).
    """

    def fitted_base(self) -> BaselineModel:
        """Give the model that was fitted."""
        raise NotImplementedError

    def errors_by_name(self) -> Mapping[str, float]:
        """Standard errors by the names of the parameters, in the units of the drive file."""
        return {}

    @property
    def params(self) -> ParameterTable:
        """Parameters with value, standard error, bounds and unit, named as in a drive file."""
        base = self.fitted_base()
        errors = self.errors_by_name()
        found = [
            Parameter(name, float(value), errors.get(name), float(low), float(high), True)
            for block in base.blocks()
            for name, value, low, high in zip(
                block.file_keys,
                block.value * block.unit,
                block.low * block.unit,
                block.high * block.unit,
                strict=False,
            )
        ]
        named = {one.name for one in found}
        fixed = [
            Parameter(name, float(value))
            for filed in FILED
            for name, value in zip(filed.keys(filed.of(base).size), filed.of(base), strict=True)
            if name not in named
        ]
        effects = [
            Parameter(name, float(value))
            for term in base.terms
            for known, value in zip(term.effect.values, term.values, strict=True)
            if (name := f"{term.effect.name}.{known.name}") not in named
        ]
        return ParameterTable([*found, *effects, *fixed])

    @property
    def residuals(self) -> FloatArray:
        """Measured minus model of every sample, arc seconds, each run with its own offset."""
        return self.fitted_base().residual()

    def predict(self, data: Campaign | None = None) -> FloatArray:
        """Lost motion of the model for recordings, rad, each run with its own offset.

        Parameters
        ----------
        data : Campaign, optional
            Other recordings; by default those of the fit. Friction starts at rest in each of their
            sessions.

        Raises
        ------
        InputError
            If a column that an effect needs is missing.
        """
        base = self.fitted_base()
        if data is not None:
            given_as("predict", "data", data, Campaign)
            if base.additives:
                names = ", ".join(shape.name for shape in base.additives)
                expected = "effects: an unnamed shape can only predict its own recordings"
                raise InputError("predict", "", f"{names} in the model", expected)
            base = base.over(Conditions(data))
            for term in base.terms:
                require(term.effect, base.conditions)
        c, angle = base.conditions, base.at().angle
        return c.centred(angle) * ARCSEC

    def samples(self) -> dict[str, Any]:
        """Columns of every sample: recorded quantities, model and residual."""
        base = self.fitted_base()
        c, residual = base.conditions, base.residual()
        model = self.predict()
        return {
            **c.campaign.table(),
            "measured_arcmin": model / ARCMIN + residual * ARCSEC / ARCMIN,
            "model_arcmin": model / ARCMIN,
            "residual_arcsec": residual,
        }

    def to_dataframe(self) -> Any:
        """Return a pandas data frame with one row per sample."""
        return data_frame(self.samples())

    def by_runs(self, column: FloatArray) -> Sequence[FloatArray]:
        """Split a column into the runs."""
        return [column[at] for at in self.fitted_base().conditions.slices()]

    def plot(self) -> Any:
        """Plot measured and modelled loops, and the residual below (Plotly figure)."""
        columns, labels = self.samples(), self.fitted_base().conditions.labels
        names = ("torque_Nm", "measured_arcmin", "model_arcmin", "residual_arcsec")
        torque, measured, model, residual = (self.by_runs(columns[name]) for name in names)
        return figures.loops(torque, measured, model, labels, residual)

    def plot_predicted(self) -> Any:
        """Plot measured against predicted lost motion, run by run (Plotly figure)."""
        columns, labels = self.samples(), self.fitted_base().conditions.labels
        measured, model = (
            self.by_runs(columns[name]) for name in ("measured_arcmin", "model_arcmin")
        )
        return figures.predicted(model, measured, labels)

    def plot_residuals(self, against: str = "torque_Nm") -> Any:
        """Plot the residual against a recorded column (Plotly figure).

        Parameters
        ----------
        against : str
            A column as `to_dataframe` has it: ``"time_s"``, ``"temperature_C"``,
            ``"model_arcmin"`` (the fit) ...
        """
        columns, labels = self.samples(), self.fitted_base().conditions.labels
        if against not in columns or against == "run":
            expected = "one of " + ", ".join(name for name in columns if name != "run")
            raise InputError("plot_residuals", "against", against, expected)
        return figures.residuals(
            self.by_runs(columns[against]),
            self.by_runs(columns["residual_arcsec"]),
            labels,
            AXES.get(against, against),
        )

    def plot_spectrum(self, turns_of: str = "input", orders: float = ORDERS) -> Any:
        """Plot the amplitude of the residual over orders of an angle (Plotly figure).

        Parameters
        ----------
        turns_of : {"input", "output"}
        orders : float
            Largest order.

        Raises
        ------
        InputError
            When that angle was not recorded.
        """
        c = self.fitted_base().conditions
        angle = c.columns.get(f"{turns_of}_angle_rad")
        if angle is None:
            expected = "the angle of the input or the output, recorded"
            raise InputError("plot_spectrum", f"{turns_of}_angle_rad", "no such column", expected)
        order = np.linspace(orders / ORDERS_DRAWN, orders, ORDERS_DRAWN)
        return figures.spectrum(order, amplitudes(angle, self.residuals, order), turns_of)

    def fit_report(self) -> str:
        """Return the report of the result and its parameters."""
        return f"{self!r}\n{self.params}"

    def _repr_html_(self) -> str:
        return f"<p>{html.escape(repr(self))}</p>{self.params._repr_html_()}"
