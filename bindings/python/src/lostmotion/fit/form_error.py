"""Form error of the baseline model: a function of torque and its history, the same for all runs.

The model discrepancy of Kennedy and O'Hagan (Journal of the Royal Statistical Society B 63, 2001),
of low rank: columns with one variance, shared by all runs. Thus the residual that runs have in
common is model error, and the difference between repeated runs is run-to-run scatter. The columns
are

- Preisach's: odd functions of operators of several half widths (Mayergoyz, Mathematical Models of
  Hysteresis, 1991): rate-independent, with the memory of any bank of operators;
- what shaking takes from Dahl's friction (A Solid Friction Model, Aerospace Corporation, 1968): a
  stiffness that varies with the input angle shakes the contacts, and every small cycle brings such
  friction nearer to zero, whereas operators close it;
- along the torque path, for runs that repeat each other: friction laws that creep under repeated
  loops (Bouc-Wen, Dahl) have no such memory.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy import special

from lostmotion.arrays import BoolArray, FloatArray
from lostmotion.effects.conditions import Conditions
from lostmotion.fit.hysteresis import Hysteresis, operator_columns

RADIUS_RANGE, RADII = (0.01, 0.7), 8
"""Half widths of the operators, relative to the largest torque."""

END_RANGE, ENDS = (0.02, 0.9), 5
"""Knots of the functions of an operator on each side of zero, relative to the largest torque."""

PATH_PIECES = 24
"""Number of sections of a torque path in which the common error of its runs is linear."""

PATH_TOLERANCE = 0.15
"""Largest rms difference of two torque paths, relative to their rms, for runs that repeat each
other: the noise of the torque is a tenth of the smallest loops."""

SEEN = 1e-3
"""A column with an rms below this share of the largest rms is left out, and so is one that deviates
from its mean by less than this share of its rms."""


@dataclass(frozen=True)
class FormError:
    """The form error of a model, as far as the recordings determine it.

    Attributes
    ----------
    columns : ndarray
        Columns of low rank, (rows, n), which all runs share.
    sd_arcsec : float
        Standard deviation of each of their coefficients.
    gain : float
        Increase of the restricted log likelihood due to these columns, nats.
    """

    columns: FloatArray
    sd_arcsec: float
    gain: float

    @property
    def p(self) -> float:
        """Probability of such a gain without a form error: half of chi squared (one-sided)."""
        return 0.5 * float(special.chdtrc(1, 2.0 * self.gain))

    @property
    def precision(self) -> FloatArray:
        """Prior precision of the coefficients."""
        return np.full(self.columns.shape[1], self.sd_arcsec**-2.0)


@dataclass
class FormBasis:
    """All columns that a form error may have, over one campaign.

    Attributes
    ----------
    conditions : Conditions
    sessions : list of slice
        Rows within which the memory of friction continues.
    moving : ndarray
        Torque that moves the contacts, N m, see `Hysteresis.moving`.
    """

    conditions: Conditions
    sessions: list[slice]
    moving: FloatArray

    @classmethod
    def of(cls, hysteresis: Hysteresis) -> FormBasis:
        """Columns over the recordings of a model without effects."""
        c = hysteresis.conditions
        return cls(c, hysteresis.sessions, c.torque)

    @property
    def radius_Nm(self) -> FloatArray:
        """Half widths of the operators, ``RADII`` of them."""
        return float(np.max(np.abs(self.conditions.torque))) * np.geomspace(*RADIUS_RANGE, RADII)

    @cached_property
    def columns(self) -> FloatArray:
        """Columns, (rows, n); a unit coefficient is about an arc second."""
        return np.asfortranarray(np.column_stack((self.preisach(), self.shaken(), *self.paths())))

    @cached_property
    def mean(self) -> FloatArray:
        """Mean of each column."""
        return np.asarray(self.columns.mean(axis=0))

    @cached_property
    def gram(self) -> FloatArray:
        """Gram matrix of the columns about their means."""
        rows = self.columns.shape[0]
        return np.asarray(self.columns.T @ self.columns - rows * np.outer(self.mean, self.mean))

    @cached_property
    def varies(self) -> BoolArray:
        """Whether each column varies: of a constant torque only rounding is left in `gram`."""
        square, rows = np.diag(self.gram), self.columns.shape[0]
        return np.asarray(square > SEEN**2 * (square + rows * self.mean**2))

    def preisach(self) -> FloatArray:
        """Odd functions of operators, each with unit rms."""
        torque = self.conditions.torque
        largest = float(np.max(np.abs(torque)))
        steady, one = np.zeros(RADII), np.ones(torque.size)
        plays = operator_columns(self.radius_Nm, steady, torque, one, self.sessions)
        operators = torque[:, None] + plays
        ends = np.concatenate(([0.0], largest * np.geomspace(*END_RANGE, ENDS), [np.inf]))
        size, sign = np.abs(operators), np.sign(operators)
        stretches = [sign * np.clip(size - low, 0.0, high - low) for low, high in pairwise(ends)]
        columns = np.hstack(stretches)
        rms = np.sqrt(np.mean(columns**2, axis=0))
        seen = rms > SEEN * rms.max(initial=0.0)
        return np.asarray(columns[:, seen] / rms[seen])

    def shaken(self) -> FloatArray:
        """Change of Dahl's friction, of unit rms, by what moves the contacts beside the torque.

        One column for every half width; none if only the torque moves the contacts.
        """
        torque = self.conditions.torque
        if np.array_equal(self.moving, torque):
            return np.zeros((torque.size, 0))
        steady = self.dahl(torque)
        rms = np.sqrt(np.mean(steady**2, axis=0))
        change = self.dahl(self.moving) - steady
        return np.asarray(np.divide(change, rms, out=np.zeros_like(change), where=rms > 0.0))

    def dahl(self, moving: FloatArray) -> FloatArray:
        """Dahl's friction over a torque in N m, from zero in each session, (rows, ``RADII``).

        ``df = (sgn(dT) - f) |dT| / r`` for every half width `r`, so it is between -1 and 1.
        """
        radius = self.radius_Nm
        out = np.zeros((moving.size, radius.size))
        for at in self.sessions:
            step = np.diff(moving[at], prepend=moving[at.start])[:, None]
            kept = np.exp(-np.abs(step) / radius)
            added = np.sign(step) * (1.0 - kept)
            force = np.zeros(radius.size)
            for row, keep, add in zip(out[at], kept, added, strict=True):
                force = keep * force + add
                row[:] = force
        return out

    def paths(self) -> list[FloatArray]:
        """Hat functions along the torque path of every group of runs that repeat each other."""
        c = self.conditions
        slices, out = c.slices(), []
        for group in self.repeats():
            columns = np.zeros((c.rows, PATH_PIECES))
            for run in group:
                at = slices[run]
                along = np.linspace(0.0, PATH_PIECES - 1.0, at.stop - at.start)
                columns[at] = np.maximum(1.0 - np.abs(along[:, None] - np.arange(PATH_PIECES)), 0.0)
            out.append(columns)
        return out

    def repeats(self) -> list[list[int]]:
        """Groups of at least two runs with the same torque path."""
        c = self.conditions
        groups: list[list[int]] = []
        firsts: list[FloatArray] = []
        for run, at in enumerate(c.slices()):
            path = c.torque[at]
            path = np.interp(np.linspace(0, 1, 8 * PATH_PIECES), np.linspace(0, 1, path.size), path)
            for group, first in zip(groups, firsts, strict=True):
                own = float(np.sqrt(np.mean(first**2)))
                if float(np.sqrt(np.mean((path - first) ** 2))) <= PATH_TOLERANCE * own:
                    group.append(run)
                    break
            else:
                groups.append([run])
                firsts.append(path)
        return [group for group in groups if len(group) > 1]
