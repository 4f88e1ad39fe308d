"""Hysteresis of the baseline model: a bank of play operators on an envelope of the torque.

    U = T + A sgn(T) (1 - 1 / (1 + t + t^2)),   t = |T| / K

The operators z_i follow the envelope U within half widths ``R_i = r_i + eta_i |U|``. Friction in
parallel with the spring sticks in proportion to the angle: until its contacts slip, it carries most
of the torque where the drive is soft, near zero torque, and there the envelope is steepest. Loops
of one size hardly identify it; small and large loops together do. Friction in series with the
spring, and operators whose half width grows with the load, are used only if the recordings require
them (`fit.forms`).

Under a compliance times s, the operators follow the envelope at ``T + (s - 1) U / U'``, with U at
the torque less the friction in parallel one sample before.

The angle of a drive rises with the torque: while every operator sticks, friction in parallel and in
series must leave some compliance of the torsion curve.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.core import core
from lostmotion.drives import (
    PLAY_ENVELOPE,
    PLAY_KNEE,
    PLAY_OUTSIDE,
    PLAY_RADIUS,
    PLAY_SHARE,
    PLAY_WIDENING,
)
from lostmotion.effects.conditions import Conditions
from lostmotion.fit.parameters import Block, Filed, Prior, block_names
from lostmotion.fit.point import Point
from lostmotion.torsion_curve import run_plays
from lostmotion.units import ARCSEC

Started = list[tuple[slice, FloatArray]]
"""Rows of the first run of each session, and the operators' derivatives there by start states."""

PLAYS = 8
"""Number of operators; half widths increase geometrically."""

PLAY_RANGE = (1 / 200, 0.6)
"""Smallest and largest half width relative to the largest torque."""

LOAD_GROWTHS = 4
"""Number of growths of the operators whose half width grows with the load: with two half widths
each they fit Maxwell slip with load-dependent limits (tests/rig/laws.c) to the noise."""

LOAD_RANGE = (0.02, 0.6)
"""Smallest and largest growth of a half width per torque. Friction of gears grows by 0.05 to 0.3 of
the load. Every growth comes with two half widths at zero torque, the smallest and the middle one of
`PLAY_RANGE`: the friction of a loaded contact also has a constant part, and operators without it
predict loops of another size with too much or too little friction.
"""

ENVELOPE_KNEE = 0.3
"""Knee K of the envelope relative to the rated torque: above the range in which a drive is soft."""

ENVELOPE_MAX = 5.0
"""Largest A / K."""

USUAL_ENVELOPE = 0.2
"""Usual A / K if the recordings do not identify it."""

FIRST_SHARES, FIRST_ENVELOPES = (0.03, 0.1), (1.0, USUAL_ENVELOPE)
"""Shares of the operators and A / K of their envelope at the starts of a first fit: operators have
kinks, and if strong effects are missing, a start may converge to a local minimum.
"""

SHARE_MAX = 0.98
"""Largest share of a torque change carried by sticking friction, at zero torque, where it is
largest: the torsion curve must wind up.
"""

STICKING_MAX = 0.5 * (1.0 + SHARE_MAX)
"""The same for friction in parallel and in series together: every segment of the curve keeps at
least half of the compliance that the first limit leaves.
"""

OUTSIDE_MAX = 50.0
"""Largest compliance in series relative to the mean one of the drive."""

RADIUS_STEP = 0.02
"""Relative step of the half widths, and of the envelope over its knee, in differences."""

SHARE_STEP = 1e-3
"""Step of a share in differences, of a sum of at most one: far above rounding, and so small that
the derivatives are those of steps ten times as small (tests/python/test_compliance.py)."""

START = "start"
"""Owner of the blocks of start states: the sessions of the recordings."""

RADII_FILED = Filed("hysteresis.radius_Nm", PLAY_RADIUS, "play_radius_Nm")
WIDENING_FILED = Filed("hysteresis.widening", PLAY_WIDENING, "play_widening")
SHARES_FILED = Filed("hysteresis.shares", PLAY_SHARE, "play_inside_share")
OUTSIDE_FILED = Filed("hysteresis.outside", PLAY_OUTSIDE, "play_outside_rad_per_Nm", ARCSEC)
ENVELOPE_FILED = Filed("hysteresis.envelope_Nm", PLAY_ENVELOPE, "play_envelope_Nm", absent=0.0)
KNEE_FILED = Filed("hysteresis.knee_Nm", PLAY_KNEE, "play_envelope_knee_Nm")
HYSTERESIS_FILED = (
    RADII_FILED,
    WIDENING_FILED,
    SHARES_FILED,
    OUTSIDE_FILED,
    ENVELOPE_FILED,
    KNEE_FILED,
)


def envelope(torque: FloatArray, more_Nm: float, knee_Nm: float) -> FloatArray:
    """Envelope that the operators follow, N m: ``U = T + A sgn(T) (1 - 1 / (1 + t + t^2))``.

    Parameters
    ----------
    torque : ndarray
        N m.
    more_Nm, knee_Nm : float
        `A` and `K` in ``t = |T| / K``.
    """
    t = np.abs(torque) / knee_Nm
    more = more_Nm * (1.0 - 1.0 / (1.0 + t * (1.0 + t)))
    return np.asarray(torque + np.copysign(more, torque))


def operator_columns(
    radius_Nm: FloatArray,
    widening: FloatArray,
    followed: FloatArray,
    width: FloatArray,
    sessions: Iterable[slice],
) -> FloatArray:
    """Differences ``z_i - U`` of every operator, N m; each session begins at its first torque.

    Parameters
    ----------
    radius_Nm, widening : ndarray
        Half widths at zero torque, and their growth.
    followed : ndarray
        Input of the operators, see `envelope`.
    width : ndarray
        Scale of the half widths at every sample.
    """
    c = core(64)
    count = radius_Nm.size
    out = np.empty((followed.size, count), dtype=c.real)
    for at in sessions:
        c.lib.lm_run_plays(
            c.pointer(c.array(radius_Nm)),
            c.pointer(c.array(widening)),
            count,
            c.pointer(c.array(np.full(count, followed[at.start])), write=True),
            c.pointer(c.array(followed[at])),
            c.pointer(c.array(width[at])),
            at.stop - at.start,
            c.pointer(out[at], write=True),
        )
    return out


def start_columns(radius_Nm: FloatArray, widening: FloatArray, followed: FloatArray) -> FloatArray:
    """Derivatives of the differences by the initial state of each operator.

    They cover the first run of a session; the states are in half widths.
    """
    high, low = (run_plays(radius_Nm, followed, state, widening) for state in (0.5, -0.5))
    return high - low


@dataclass
class Hysteresis:
    """Play operators for one campaign: friction in parallel, and optionally in series.

    Attributes
    ----------
    conditions : Conditions
        Of the campaign.
    radius_Nm : ndarray
        Half widths at zero torque.
    shares : ndarray
        Share of the torque that each operator carries.
    knee_Nm, envelope_Nm : float
        Excess of the envelope over the torque under load (`envelope_Nm`), and the torque at which
        two thirds of it are reached.
    start : ndarray
        Initial state of each operator, in half widths from the torque; one row per session.
    outside : ndarray or None
        Compliance of each operator in series, arc seconds per N m; None if there is no such
        friction.
    widening : ndarray or None
        Growth of each half width per torque; None if constant.
    parallel : bool
        Whether friction in parallel with the spring is fitted; if not, its shares and the envelope
        are zero.
    """

    conditions: Conditions
    radius_Nm: FloatArray
    shares: FloatArray
    knee_Nm: float
    envelope_Nm: float
    start: FloatArray
    outside: FloatArray | None = None
    widening: FloatArray | None = None
    parallel: bool = True
    last_started: tuple[tuple[object, ...], FloatArray, Started] | None = field(
        default=None, repr=False, compare=False
    )
    """The last result of `started`, with all that it depends on; copies share it."""

    @classmethod
    def of_recordings(
        cls, conditions: Conditions, largest_Nm: float, rated_torque_Nm: float
    ) -> Hysteresis:
        """Half widths spaced over the recorded torques, with start values for a first fit."""
        knee = ENVELOPE_KNEE * rated_torque_Nm
        made = cls(
            conditions,
            largest_Nm * np.geomspace(*PLAY_RANGE, PLAYS),
            np.full(PLAYS, FIRST_SHARES[0]),
            knee,
            FIRST_ENVELOPES[0] * knee,
            np.zeros((0, PLAYS)),
        )
        made.start = np.zeros((len(made.sessions), PLAYS))
        return made

    @property
    def count(self) -> int:
        """Number of operators."""
        return int(self.radius_Nm.size)

    @property
    def sessions(self) -> list[slice]:
        """Rows of each session, within which the friction state continues."""
        c = self.conditions
        begins = [int(c.starts[run]) for run in c.campaign.sessions()]
        return [slice(a, b) for a, b in pairwise([*begins, c.rows])]

    def over(self, conditions: Conditions) -> None:
        """Extend to recordings that begin with these; further sessions start at rest."""
        self.conditions = conditions
        start = np.zeros((len(self.sessions), self.count))
        start[: len(self.start)] = self.start
        self.start = start

    @property
    def unfitted(self) -> bool:
        """Whether it has not been fitted."""
        return bool(np.all(self.shares == FIRST_SHARES[0]))

    @property
    def rise(self) -> float:
        """Slope of the envelope at zero torque, its maximum."""
        return 1.0 + self.envelope_Nm / self.knee_Nm

    def begin(self, share: float, rise: float) -> None:
        """Reset for a new fit.

        Parameters
        ----------
        share : float
            Of every operator.
        rise : float
            A / K of the envelope.
        """
        self.shares[:] = share
        self.start[:] = 0.0
        self.envelope_Nm = rise * self.knee_Nm

    def allow_outside(self) -> None:
        """Include friction in series with the spring in the fit, starting from zero."""
        if self.outside is None:
            self.outside = np.zeros(self.count)

    def take_inside_out(self) -> None:
        """Exclude friction in parallel with the spring from the fit."""
        self.parallel = False
        self.shares = np.zeros(self.count)
        self.envelope_Nm = 0.0

    def allow_load(self) -> None:
        """Include the growth of half widths with the load in the fit, starting from zero."""
        if self.widening is not None:
            return
        growths = np.geomspace(*LOAD_RANGE, LOAD_GROWTHS)
        narrow, middle = self.radius_Nm[0], np.sqrt(self.radius_Nm[0] * self.radius_Nm[-1])
        radii = np.repeat((narrow, middle), LOAD_GROWTHS)
        none = np.zeros(radii.size)
        self.widening = np.concatenate((np.zeros(self.count), growths, growths))
        self.radius_Nm = np.concatenate((self.radius_Nm, radii))
        self.shares = np.concatenate((self.shares, none))
        self.start = np.hstack((self.start, np.zeros((len(self.start), none.size))))
        if self.outside is not None:
            self.outside = np.concatenate((self.outside, none))

    @property
    def growth(self) -> FloatArray:
        """Growth of each half width per torque."""
        return np.zeros(self.count) if self.widening is None else self.widening

    def fill_up(self) -> None:
        """Add start states for added operators."""
        self.parallel = self.outside is None or bool(np.any(self.shares))
        if self.start.shape[1] != self.count:
            self.start = np.zeros((len(self.start), self.count))

    # --- prediction ------------------------------------------------------------------------------

    def follows_compliance(self, compliance: FloatArray) -> bool:
        """Whether the compliance moves operators: those in series follow the torque itself."""
        return bool(np.any(self.shares)) and not np.all(compliance == 1.0)

    def moving(self, compliance: FloatArray) -> FloatArray:
        """Torque that moves the contacts, N m: ``T + (s - 1) U / U'`` under a compliance times s.

        As for `followed`, but without the friction itself, and whatever friction the model has.
        """
        torque = self.conditions.torque
        if np.all(compliance == 1.0):
            return torque
        t, followed = (
            np.abs(torque) / self.knee_Nm,
            envelope(torque, self.envelope_Nm, self.knee_Nm),
        )
        rise = self.envelope_Nm / self.knee_Nm * (1.0 + 2.0 * t) / (1.0 + t * (1.0 + t)) ** 2
        return np.asarray(torque + (compliance - 1.0) * followed / (1.0 + rise))

    def followed(self, torque: FloatArray, compliance: FloatArray, width: FloatArray) -> FloatArray:
        """Envelope that the operators follow, N m: friction in parallel moves with the angle."""
        if not self.follows_compliance(compliance):
            return envelope(torque, self.envelope_Nm, self.knee_Nm)
        c = core(64)
        bank = c.ffi.new("lm_play_bank *")
        bank.envelope_Nm, bank.knee_Nm = self.envelope_Nm, self.knee_Nm
        out = np.empty(torque.size, dtype=c.real)
        for at, start in zip(self.sessions, self.start * self.radius_Nm, strict=True):
            c.lib.lm_find_followed(
                bank,
                c.pointer(c.array(self.radius_Nm)),
                c.pointer(c.array(self.growth)),
                c.pointer(c.array(self.shares)),
                self.count,
                c.pointer(c.array(torque[at])),
                c.pointer(c.array(compliance[at])),
                c.pointer(c.array(width[at])),
                at.stop - at.start,
                c.pointer(c.array(start), write=True),
                c.pointer(out[at], write=True),
            )
        return out

    def columns(self, followed: FloatArray, width: FloatArray) -> FloatArray:
        """Differences ``z_i - U`` through the whole campaign; `width` scales the half widths."""
        return operator_columns(self.radius_Nm, self.growth, followed, width, self.sessions)

    def started(self, followed: FloatArray) -> Started:
        """Rows of the first run of each session, and derivatives there by the start states."""
        c, out = self.conditions, []
        key = (c, self.radius_Nm.tobytes(), self.growth.tobytes())
        if self.last_started is not None:
            same, before, known = self.last_started
            if same == key and (before is followed or np.array_equal(before, followed)):
                return known
        for session in self.sessions:
            end = c.starts[np.searchsorted(c.starts, session.start, side="right")]
            at = slice(session.start, int(end))
            out.append((at, start_columns(self.radius_Nm, self.growth, followed[at])))
        self.last_started = (key, followed, out)
        return out

    def add(
        self, out: FloatArray, plays: FloatArray, followed: FloatArray, weights: FloatArray
    ) -> None:
        """Add the weighted operators to `out`, including start states."""
        out += plays @ weights
        if np.any(self.start):
            for (at, moved), start in zip(self.started(followed), self.start, strict=True):
                out[at] += moved @ (weights * start)

    def angle_by(self, change: FloatArray, point: Point) -> FloatArray:
        """Change of the angle, arc seconds, where the operators change by `change`."""
        column = point.slope * (change @ self.shares)
        return np.asarray(column if self.outside is None else column + change @ self.outside)

    def by_envelope(self, point: Point) -> FloatArray:
        """Derivative of the angle by the envelope excess."""
        step = RADIUS_STEP * self.knee_Nm
        low, high = max(self.envelope_Nm - step, 0.0), self.envelope_Nm + step
        change = self.columns_at(point, envelope_Nm=high)
        change -= self.columns_at(point, envelope_Nm=low)
        change /= high - low
        return self.angle_by(change, point)

    def columns_at(self, point: Point, **values: Any) -> FloatArray:
        """The columns at a point where some values of the operators are others."""
        driven = point.torque, point.compliance, point.width
        return self.columns(replace(self, **values).followed(*driven), point.width)

    def by_width(self, point: Point, change: FloatArray | None = None) -> FloatArray:
        """Derivative of the angle by a value that changes the logarithm of the half widths.

        Parameters
        ----------
        point : Point
        change : ndarray, optional
            Change of the logarithm per unit of the value, of every sample; by default 1. Operators
            have kinks, so every run is differentiated with the same largest step: a change that is
            constant in a run gives a multiple of the derivative by its deviation.
        """
        largest, along = (1.0, 1.0) if change is None else self.largest_in_run(change)
        step = RADIUS_STEP * along
        wider, closer = (
            self.columns(point.followed, point.width * (1.0 + side)) for side in (step, -step)
        )
        return np.asarray(largest * self.angle_by((wider - closer) / (2 * RADIUS_STEP), point))

    def largest_in_run(self, change: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Largest value of every run, with its sign, and all values relative to it."""
        c = self.conditions
        high, low = (f.reduceat(change, c.starts[:-1]) for f in (np.maximum, np.minimum))
        largest = np.where(high >= -low, high, low)[c.run_of]
        along = np.divide(change, largest, out=np.ones_like(change), where=largest != 0.0)
        return largest, along

    # --- parameters ------------------------------------------------------------------------------

    def inside_blocks(self) -> tuple[list[Block], list[Block]]:
        """Shares and envelope, if friction in parallel is fitted."""
        return ([self.shares_block()], [self.envelope_block()]) if self.parallel else ([], [])

    def shares_block(self) -> Block:
        """Shares; `held_back` limits the share of the torque that may stick."""

        def fill(point: Point, out: FloatArray) -> None:
            np.multiply(point.slope[:, None], point.plays, out=out)
            if self.follows_compliance(point.compliance):
                for column, step in zip(out.T, np.eye(self.count) * SHARE_STEP, strict=True):
                    change = self.columns_at(point, shares=self.shares + step)
                    change -= point.plays
                    column += self.angle_by(change, point) / SHARE_STEP

        return Block(
            block_names("share", self.count),
            self.shares,
            np.zeros(self.count),
            np.full(self.count, SHARE_MAX),
            np.ones(self.count),
            partial(setattr, self, "shares"),
            fill,
            filed=SHARES_FILED,
        )

    def envelope_block(self) -> Block:
        """Envelope excess, with a prior at the usual value."""
        knee = self.knee_Nm

        def put(more_Nm: FloatArray) -> None:
            self.envelope_Nm = float(more_Nm[0])

        def fill(point: Point, out: FloatArray) -> None:
            out[:, 0] = self.by_envelope(point)

        return Block(
            ["envelope"],
            np.array([self.envelope_Nm]),
            np.zeros(1),
            np.array([ENVELOPE_MAX * knee]),
            np.array([1.0 / knee**2]),
            put,
            fill,
            Prior(np.arange(1), np.array([USUAL_ENVELOPE * knee]), np.array([knee])),
            filed=ENVELOPE_FILED,
        )

    def start_blocks(self) -> list[Block]:
        """Start states of each session, each within the band of its operator."""

        def put(session: int, state: FloatArray) -> None:
            self.start = self.start.copy()
            self.start[session] = state

        def fill(session: int, point: Point, out: FloatArray) -> None:
            rows, by_state = self.started(point.followed)[session]
            out[:] = 0.0
            out[rows] = (point.slope[rows, None] * by_state) * self.shares
            if self.outside is not None:
                out[rows] += by_state * self.outside

        return [
            Block(
                block_names("start" if session == 0 else f"start_{session}", self.count),
                state,
                np.full(self.count, -1.0),
                np.ones(self.count),
                np.ones(self.count),
                partial(put, session),
                partial(fill, session),
                Prior(np.arange(self.count), np.zeros(self.count), np.ones(self.count)),
                of=START,
            )
            for session, state in enumerate(self.start)
        ]

    def outside_blocks(self, mean_slope: float) -> list[Block]:
        """Compliances of friction in series with the spring, if fitted."""
        if self.outside is None:
            return []

        def fill(point: Point, out: FloatArray) -> None:
            out[:] = point.plays
            for (rows, by_state), start in zip(
                self.started(point.followed), self.start, strict=True
            ):
                out[rows] += by_state * start

        return [
            Block(
                block_names("outside", self.count),
                self.outside,
                np.zeros(self.count),
                np.full(self.count, OUTSIDE_MAX * mean_slope),
                np.zeros(self.count),
                partial(setattr, self, "outside"),
                fill,
                filed=OUTSIDE_FILED,
            )
        ]

    def limit_shares(self) -> None:
        """Scale the shares down to the sticking limit."""
        held = float(self.shares.sum()) * self.rise
        if held > SHARE_MAX:
            self.shares *= SHARE_MAX / held

    def limit_outside(self, slopes: FloatArray) -> None:
        """Scale friction in series down to the limit set by the slopes of the torsion curve."""
        if self.outside is not None:
            room = (STICKING_MAX - self.rise * float(self.shares.sum())) * float(slopes.min())
            taken = self.rise * float(self.outside.sum())
            if taken > room:
                self.outside *= room / taken

    def copy(self) -> Hysteresis:
        """Independent copy of the operators."""
        outside = None if self.outside is None else self.outside.copy()
        return replace(self, shares=self.shares.copy(), start=self.start.copy(), outside=outside)
