"""Parameters of a model with errors, bounds and units, printed as a fit report."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from lostmotion.results.data_frame import data_frame
from lostmotion.results.html_table import html_table
from lostmotion.units import split_unit

DIGITS = 6
"""Significant digits of a printed value."""

AT_BOUND = "at its bound"


@dataclass(frozen=True)
class Parameter:
    """One parameter of a model.

    Attributes
    ----------
    name : str
        As in ``[fit.values]`` of a fitted drive file, with its unit.
    value : float
    error : float or None
        Standard error; None if the result has none.
    low, high : float
        Bounds, infinite if there are none.
    estimated : bool
        Whether the fit estimated it; otherwise it is fixed.
    """

    name: str
    value: float
    error: float | None = None
    low: float = -math.inf
    high: float = math.inf
    estimated: bool = False

    @property
    def at_bound(self) -> bool:
        """Whether an estimated value is at one of its bounds."""
        return self.estimated and not self.low < self.value < self.high

    @property
    def unit(self) -> str:
        """Unit as in its name; empty for a number without one."""
        quantity, unit = split_unit(self.name)
        return "" if unit is None else self.name[len(quantity) + 1 :]

    @property
    def relative_error(self) -> float | None:
        """Relative standard error; None if there is none."""
        return None if self.error is None or self.value == 0 else abs(self.error / self.value)

    def __str__(self) -> str:
        """Print it as one line."""
        return f"{self.name} = {' '.join(cell for cell in self.cells()[1:] if cell)}"

    def cells(self) -> tuple[str, str, str, str]:
        """Name, value, standard error, and remarks, as text."""
        value = f"{self.value:.{DIGITS}g}"
        said = AT_BOUND if self.at_bound else "" if self.estimated else "(fixed)"
        if self.error is None:
            return self.name, value, "", said
        share = self.relative_error
        error = f"+/- {self.error:.3g}" + ("" if share is None else f" ({100 * share:.2f} %)")
        return self.name, value, error, said


class ParameterTable(Mapping[str, Parameter]):
    """Parameters by name, in the order of the model.

    Parameters
    ----------
    parameters : iterable of Parameter

    Examples
    --------
    >>> table = ParameterTable([Parameter("gap_rad", 2e-3, 1e-5, 0.0, 0.1, True)])
    >>> table["gap_rad"].error
    1e-05
    >>> print(table)
    gap_rad  0.002  +/- 1e-05 (0.50 %)
    """

    def __init__(self, parameters: Iterable[Parameter]) -> None:
        self._by_name = {one.name: one for one in parameters}

    def __getitem__(self, name: str) -> Parameter:
        """Return a parameter by its name."""
        return self._by_name[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._by_name)

    def __len__(self) -> int:
        """Count them."""
        return len(self._by_name)

    def __str__(self) -> str:
        """Print the values like a fit report: value, standard error, relative error."""
        rows = [one.cells() for one in self.values()]
        wide = [max((len(row[i]) for row in rows), default=0) for i in range(4)]
        lines = (
            "  ".join(cell.ljust(width) for cell, width in zip(row, wide, strict=True)).rstrip()
            for row in rows
        )
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Summarise the number of parameters; `print` shows them."""
        estimated = sum(one.estimated for one in self.values())
        return f"<ParameterTable: {estimated} estimated, {len(self) - estimated} fixed>"

    def _repr_html_(self) -> str:
        head = ("parameter", "value", "standard error", "")
        return html_table(head, (one.cells() for one in self.values()))

    def valuesdict(self) -> dict[str, float]:
        """Values by name."""
        return {name: one.value for name, one in self.items()}

    def to_dataframe(self) -> Any:
        """Return a pandas data frame with one row per parameter."""
        ones = list(self.values())
        return data_frame(
            {
                "parameter": [one.name for one in ones],
                "value": [one.value for one in ones],
                "error": [one.error for one in ones],
                "low": [one.low for one in ones],
                "high": [one.high for one in ones],
                "unit": [one.unit for one in ones],
                "at_bound": [one.at_bound for one in ones],
            }
        )
