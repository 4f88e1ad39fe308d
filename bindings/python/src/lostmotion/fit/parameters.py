"""The parameter vector of the baseline model, made of blocks.

A block has its values, bounds, prior, the derivatives of the angle by the values, and their names
in a fitted drive file and in answers. All other code iterates over the blocks: a new parameter of
the model is another block in `BaselineModel.blocks`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from lostmotion import drives
from lostmotion.arrays import FloatArray, IntArray
from lostmotion.fit.point import Point


@dataclass(frozen=True)
class Filed:
    """Values of the baseline model that a fitted drive file stores.

    Attributes
    ----------
    attribute : str
        Of the baseline model, with the part it belongs to (``curve.slopes``); a number, or an array
        where the key counts its entries.
    key : str
        In ``[fit.values]``, with its unit; ``{}`` stands for the number of an entry.
    answer : str
        In answers, with its unit.
    unit : float
        Unit of the attribute in that of the file.
    absent : float or None
        Value if a file has no such key; None: unchanged.
    """

    attribute: str
    key: str
    answer: str
    unit: float = 1.0
    absent: float | None = None

    def keys(self, count: int) -> list[str]:
        """Keys of a number of values."""
        return drives.row_names(self.key, count) if "{}" in self.key else [self.key]

    def of(self, model: Any) -> FloatArray:
        """Values of a model, in the unit of the file; empty if it has none."""
        value = attrgetter(self.attribute)(model)
        return np.zeros(0) if value is None else np.atleast_1d(value) * self.unit

    def restore(self, model: Any, values: Mapping[str, Any]) -> None:
        """Set a model from the ``[fit.values]`` of a drive file."""
        found: FloatArray | float
        if "{}" in self.key:
            found = np.array(drives.numbered(values, self.key)) / self.unit
            if not found.size:
                return
        elif self.key in values or self.absent is not None:
            found = float(values.get(self.key, self.absent)) / self.unit
        else:
            return
        *part, name = self.attribute.split(".")
        setattr(attrgetter(*part)(model) if part else model, name, found)


@dataclass(frozen=True)
class Prior:
    """Prior of some values of a block.

    Attributes
    ----------
    places : ndarray of int
        Of the values, within the block.
    mean, sd : ndarray
    per_run : bool
        Whether the standard deviation is relative to the noise of a whole run, not of a sample.
    """

    places: IntArray
    mean: FloatArray
    sd: FloatArray
    per_run: bool = False

    def weight(self, noise: float) -> FloatArray:
        """Weight of its rows in a fit, arc seconds per unit."""
        return np.asarray((1.0 if self.per_run else noise) / self.sd)


@dataclass(frozen=True)
class Block:
    """Adjacent values of the parameter vector.

    Attributes
    ----------
    names : list of str
    value, low, high : ndarray
    precision : ndarray
        Prior precision at the present values, for one linear step; 0: none.
    put : callable
        Takes over values.
    fill : callable
        ``fill(point, out)``: derivatives of the angle by the values, arc seconds per unit, into
        ``out[row, value]``.
    prior : Prior or None
        In a fit.
    filed : Filed or None
        How a drive file stores them; None: as `keys`.
    keys : list of str
        Keys in ``[fit.values]`` of a drive file; empty if the values belong only to the recordings.
    of : object
        Owner of the block if the model has several of a kind: a term, or the start states.
    """

    names: list[str]
    value: FloatArray
    low: FloatArray
    high: FloatArray
    precision: FloatArray
    put: Callable[[FloatArray], None]
    fill: Callable[[Point, FloatArray], None]
    prior: Prior | None = None
    filed: Filed | None = None
    keys: Sequence[str] = ()
    of: Any = None

    @property
    def size(self) -> int:
        """Number of values."""
        return int(self.value.size)

    @property
    def file_keys(self) -> Sequence[str]:
        """Names of the values in ``[fit.values]``; empty if a file does not store them."""
        return self.keys if self.filed is None else self.filed.keys(self.size)

    @property
    def unit(self) -> float:
        """Unit of the values in that of the file."""
        return 1.0 if self.filed is None else self.filed.unit


def placed(blocks: Sequence[Block]) -> list[tuple[Block, slice]]:
    """Every block with its positions in the vector."""
    out, at = [], 0
    for block in blocks:
        out.append((block, slice(at, at + block.size)))
        at += block.size
    return out


def prior_rows(
    blocks: Sequence[Block], x: FloatArray, noise: float
) -> tuple[FloatArray, FloatArray]:
    """Residuals and derivatives of the priors, arc seconds.

    Parameters
    ----------
    noise : float
        Noise of a sample, arc seconds, the weight of the prior.
    """
    residuals, wheres, weights = [], [], []
    for block, places in placed(blocks):
        prior = block.prior
        if prior is not None:
            where = places.start + prior.places
            weight = prior.weight(noise)
            residuals.append(weight * (x[where] - prior.mean))
            wheres.append(where)
            weights.append(weight)
    where = np.concatenate(wheres)
    rows = np.zeros((where.size, x.size))
    rows[np.arange(where.size), where] = np.concatenate(weights)
    return np.concatenate(residuals), rows


def block_names(name: str, count: int) -> list[str]:
    """Names of the values of a block."""
    return [f"{name}_{i}" for i in range(count)]
