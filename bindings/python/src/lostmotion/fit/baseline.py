"""The base that effects are added to: an odd backbone with friction inside it, flexible enough.

    U   = T + A sgn(T) (1 - 1 / (1 + t + t^2)),   t = |T| / K
    T_e = T + sum w_i (z_i - U)
    phi = offset_run + (1 + a_run) B(T_e) + g_run sat(T_e) + sum c_i (z_i - U)

`B` is odd and rises in straight stretches; the plays z_i follow the envelope U, with fixed half
widths, times (1 + f_run). Friction in parallel with the elasticity sticks by the angle: until its
contacts slip they hold most of the torque where the drive is soft, about no torque, and there the
envelope rises most. Loops of one size hardly tell; small ones beside large ones do. A
catalogue sheet knows three slopes, which is not enough to reach the noise of a good encoder; it
serves as the start and as a weak prior. Friction outside the elasticity (`c_i`) is off unless the
recordings ask for it.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, partial
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from lostmotion.backbone import Backbone
from lostmotion.drives import (
    KNOT,
    PLAY_ENVELOPE,
    PLAY_KNEE,
    PLAY_OUTSIDE,
    PLAY_RADIUS,
    PLAY_SHARE,
    SLOPE,
)
from lostmotion.effects.conditions import Conditions, side_by_side
from lostmotion.effects.effect import Effect
from lostmotion.fit.hysteresis import envelope, moved_before, operator_columns
from lostmotion.fit.least_squares import Solution, bounded_least_squares
from lostmotion.fit.parameters import Block, Filed, Prior, placed, prior_rows
from lostmotion.fit.point import Point
from lostmotion.units import ARCSEC

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]

KNOTS = 28
"""Ends of stretches of the backbone on each side, spaced geometrically. The curve has 59 points,
zero and both ends included; a controller holds 64. With 17 knots the corners of a staged take-up
are still seen."""

KNOT_RANGE = (1e-3, 0.9)
"""First and last end of a stretch over the largest torque."""

PLAYS = 8
"""Plays; half widths rise geometrically."""

PLAY_RANGE = (1 / 200, 0.6)
"""Least and greatest half width over the largest torque."""

ENVELOPE_KNEE = 0.3
"""Knee K of the plays' envelope over the rated torque: beyond where a drive is soft."""

ENVELOPE_MAX = 5.0
"""Largest A / K."""

USUAL_ENVELOPE = 0.2
"""About what A / K is where the recordings do not tell it."""

FIRST_SHARES, FIRST_ENVELOPES = (0.03, 0.1), (1.0, USUAL_ENVELOPE)
"""Shares of every play, and A / K of their envelope, that a first fit starts from: play and
friction have kinks, and with strong effects missing either start may end in a minimum that is not
the lowest."""

SHARE_MAX = 0.98
"""Friction that sticks holds at most this share of a change of torque, at no torque, where it holds
most: the backbone has to wind up."""

SHARE_FIRM, FIRMNESS = 0.95, 1e4
"""Beyond this share a fit is held back as by so many noises for all of it, so that it does not run
against the bound."""

OUTSIDE_FIRST = 0.02
"""Compliance of a play outside the elasticity that a fit starts from, over the mean one."""

SLOPE_MAX = 50.0
"""Greatest compliance of a stretch over the mean one of the drive."""

GAP_CLOSES = 0.005
"""Torque at which a radial gap has closed, over rated torque (model 9a: 0.1 to 0.5 %)."""

DEVIATIONS = ("stiffness", "friction", "gap")
"""What scatters from run to run beside the offset."""

DEVIATION_MAX = 0.5
"""A run whose friction differs by more than half of it is another drive."""

TOLERANCE = 1e-6
"""Relative fall of the cost below which a fit ends."""

EVENLY = 12.0
"""What may be anywhere in a range has this precision over the range's square."""

RUN_SCATTER = 0.6
"""A value of how an effect hangs on what is constant within a run is told by runs alone: each tells
it as well as what it has of its own allows, over the noise, however many samples it has. A law
through the few worn runs of a campaign is held to what is usual accordingly: samples that count one
by one would put it through their scatter, and far off beyond them."""

KNOTS_FILED = Filed("knots_Nm", KNOT, "knot_Nm")
SLOPES_FILED = Filed("slopes", SLOPE, "slope_rad_per_Nm", ARCSEC)
RADII_FILED = Filed("radius_Nm", PLAY_RADIUS, "play_radius_Nm")
SHARES_FILED = Filed("shares", PLAY_SHARE, "play_inside_share")
OUTSIDE_FILED = Filed("outside", PLAY_OUTSIDE, "play_outside_rad_per_Nm", ARCSEC)
ENVELOPE_FILED = Filed("envelope_Nm", PLAY_ENVELOPE, "play_envelope_Nm", absent=0.0)
KNEE_FILED = Filed("knee_Nm", PLAY_KNEE, "play_envelope_knee_Nm")

FILED = (
    KNOTS_FILED,
    SLOPES_FILED,
    RADII_FILED,
    SHARES_FILED,
    OUTSIDE_FILED,
    ENVELOPE_FILED,
    KNEE_FILED,
)
"""All that a fitted drive file keeps of the baseline model, beside its effects."""

START = "start"
"""What the blocks of the start states belong to: the sittings of the recordings."""

RADIUS_STEP = 0.02
"""Relative step of the half widths in differences."""


@dataclass
class Term:
    """An effect at work, with the values it has."""

    effect: Effect
    values: FloatArray
    free: list[int]


@dataclass
class Additive:
    """A frozen shape without a name: columns in arc seconds, and their coefficients."""

    name: str
    columns: FloatArray
    coefficients: FloatArray
    covariate: str = ""
    shape: str = ""


@dataclass
class Base:
    """The base over one campaign, and the terms that were added to it.

    Attributes
    ----------
    knots_Nm, radius_Nm : ndarray
    slopes : ndarray
        Compliance of each stretch, arc seconds a N m.
    shares : ndarray
        Share of the torque that each play takes.
    envelope_Nm, knee_Nm : float
        How much further than the torque the plays' envelope goes under load, and where two thirds
        is reached.
    outside : ndarray or None
        Compliance of each play outside the elasticity, arc seconds a N m; None: there is none.
    widens : bool
        Whether all half widths may move together; campaigns that are to be merged share theirs.
    start : ndarray
        Where each play stood before the first sample, in half widths from the torque there; a row
        for each sitting.
    deviations : ndarray
        Of each run: stiffness, friction (relative) and gap (arc seconds).
    noise_arcsec : float
        Root mean square within runs, as far as it is known; laws between runs are held by it.
    """

    conditions: Conditions
    rated_torque_Nm: float
    prior: Backbone | None = None
    terms: list[Term] = field(default_factory=list)
    additives: list[Additive] = field(default_factory=list)
    widens: bool = True

    def __repr__(self) -> str:
        """Say what it stands on; its numbers fill screens."""
        names = ", ".join(term.effect.name for term in self.terms)
        return f"<Base{' with ' + names if names else ''} over {self.conditions.campaign!r}>"

    def __post_init__(self) -> None:
        c = self.conditions
        self.largest = float(np.max(np.abs(c.torque)))
        self.knots_Nm = self.largest * np.geomspace(*KNOT_RANGE, KNOTS)
        self.radius_Nm = self.largest * np.geomspace(*PLAY_RANGE, PLAYS)
        self.begin_from(c.lost_motion)
        self.shares = np.full(PLAYS, FIRST_SHARES[0])
        self.knee_Nm = ENVELOPE_KNEE * self.rated_torque_Nm
        self.envelope_Nm = FIRST_ENVELOPES[0] * self.knee_Nm
        self.outside: FloatArray | None = None
        self.start = np.zeros((len(self.sittings), PLAYS))
        self.deviations = np.zeros((c.runs, len(DEVIATIONS)))
        self.outlier = np.zeros(c.rows, dtype=bool)
        self.measured = c.lost_motion.copy()
        self.noise_arcsec = 1.0

    def begin_from(self, lost_motion: FloatArray) -> None:
        """Begin with the mean slope of a lost motion, arc seconds, and with the sheet's beyond it.

        Parameters
        ----------
        lost_motion : ndarray
            As recorded, less what is known not to be the drive's elasticity.
        """
        c = self.conditions
        t = c.torque - c.run_mean(c.torque)[c.run_of]
        y = lost_motion - c.run_mean(lost_motion)[c.run_of]
        mean = float(t @ y / max(float(t @ t), 1e-300))
        self.mean_slope = abs(mean) if mean else 1.0
        self.slopes = np.full(self.knots_Nm.size + 1, self.mean_slope)
        self.prior_slopes = self.slopes.copy()
        if self.prior is not None:
            last = max(1.2 * self.largest, self.knots_Nm[-1])
            ends = np.concatenate(([0.0], self.knots_Nm, [last]))
            self.prior_slopes = np.diff(self.prior(ends)) / np.diff(ends) / ARCSEC

    @property
    def fresh(self) -> bool:
        """Whether it holds no numbers of a fit yet."""
        return bool(np.all(self.shares == FIRST_SHARES[0]))

    def allow_outside_friction(self) -> None:
        """Let friction outside the elasticity take part in the fit."""
        if self.outside is None:
            self.outside = np.full(PLAYS, OUTSIDE_FIRST * self.mean_slope)

    @property
    def sittings(self) -> list[slice]:
        """Rows within which friction's memory goes on."""
        c = self.conditions
        begins = [int(c.starts[run]) for run in c.campaign.sittings()]
        return [slice(a, b) for a, b in pairwise([*begins, c.rows])]

    @property
    def has_effects(self) -> bool:
        """Whether there is an effect whose form may leave something over: no slipped tooth."""
        return any(term.free for term in self.terms)

    # --- the parts -------------------------------------------------------------------------------

    @property
    def rise(self) -> float:
        """Slope of the plays' envelope at no torque, where it is greatest."""
        return 1.0 + self.envelope_Nm / self.knee_Nm

    def play_columns(
        self, torque: FloatArray, width: FloatArray, envelope_Nm: float | None = None
    ) -> FloatArray:
        """Differences ``z_i - U`` through the whole campaign; `width` scales the half widths."""
        more = self.envelope_Nm if envelope_Nm is None else envelope_Nm
        followed = envelope(torque, more, self.knee_Nm)
        return operator_columns(self.radius_Nm, followed, width, self.sittings)

    def start_columns(self) -> list[tuple[slice, FloatArray]]:
        """Rows of the first run of each sitting, and the plays' derivatives by where they stood."""
        c = self.conditions
        followed = envelope(c.torque, self.envelope_Nm, self.knee_Nm)
        return list(moved_before(followed, self.radius_Nm, self.sittings, c.starts))

    def ramps(self, wound: FloatArray) -> FloatArray:
        """Backbone of unit slope in each stretch, zero in the others."""
        size, sign = np.abs(wound), np.sign(wound)
        low = np.concatenate(([0.0], self.knots_Nm))
        length = np.append(np.diff(low), np.inf)
        out = np.empty((wound.size, low.size), order="F")
        for i in range(low.size):
            taken = np.maximum(size - low[i], 0.0)
            np.multiply(sign, np.minimum(taken, length[i], out=taken), out=out[:, i])
        return out

    def driven(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """What acts: torque, scale of half widths, plays, and the torque that friction leaves."""
        c = self.conditions
        torque = c.torque
        zero = np.zeros(c.rows)
        for term in self.terms:
            if term.effect.kind == "torque":
                torque = torque + term.effect.run(term.values, c, c.torque, zero)
        width = 1.0 + np.clip(self.deviations[:, 1], -DEVIATION_MAX, DEVIATION_MAX)[c.run_of]
        for term in self.terms:
            if term.effect.kind == "width":
                width = width * term.effect.run(term.values, c, torque, zero)
        plays = self.play_columns(torque, width)
        wound = torque + plays @ self.shares
        if np.any(self.start):
            for (at, moved), start in zip(self.start_columns(), self.start, strict=True):
                wound[at] += moved @ (self.shares * start)
        return torque, width, plays, wound

    def angles(
        self, torque: FloatArray, plays: FloatArray, wound: FloatArray, backbone: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Elastic angle, and the whole."""
        c = self.conditions
        stiff = (1.0 + self.deviations[:, 0])[c.run_of]
        elastic = stiff * backbone + self.deviations[:, 2][c.run_of] * self.closed(wound)
        if self.outside is not None:
            elastic += plays @ self.outside
            if np.any(self.start):
                for (at, moved), start in zip(self.start_columns(), self.start, strict=True):
                    elastic[at] += moved @ (self.outside * start)
        angle = elastic.copy()
        for term in self.terms:
            if term.effect.kind == "angle":
                angle += term.effect.run(term.values, c, torque, elastic * ARCSEC, wound) / ARCSEC
        for shape in self.additives:
            angle += shape.columns @ shape.coefficients
        return elastic, angle

    def at(self) -> Point:
        """Evaluate the model; offsets of the runs are left out."""
        torque, width, plays, wound = self.driven()
        ramps = self.ramps(wound)
        backbone = ramps @ self.slopes
        slope = self.slopes[np.searchsorted(self.knots_Nm, np.abs(wound), side="right")]
        stiff = (1.0 + self.deviations[:, 0])[self.conditions.run_of]
        elastic, angle = self.angles(torque, plays, wound, backbone)
        return Point(torque, width, plays, wound, ramps, stiff * slope, backbone, elastic, angle)

    def angle(self) -> FloatArray:
        """Angle of `at` alone, for differences: several times quicker."""
        torque, _, plays, wound = self.driven()
        size = np.abs(wound)
        ends = np.concatenate(([0.0], self.knots_Nm))
        heights = np.concatenate(([0.0], np.cumsum(np.diff(ends) * self.slopes[:-1])))
        backbone = np.interp(size, ends, heights)
        backbone += self.slopes[-1] * np.maximum(size - ends[-1], 0.0)
        return self.angles(torque, plays, wound, np.sign(wound) * backbone)[1]

    def closed(self, wound: FloatArray) -> FloatArray:
        """How far a gap is taken up, -1 to 1."""
        return np.asarray(np.tanh(wound / (GAP_CLOSES * self.rated_torque_Nm)))

    # --- derivatives -----------------------------------------------------------------------------

    def blocks(self) -> list[Block]:
        """Blocks of the parameter vector, in its order: everything that is stated of a parameter.

        Weakly known beforehand: slopes are within their own size of the sheet's, start states
        within one, the plays' envelope about the usual one. Where a value of an effect is moved by
        one linear step, it may be anywhere between its bounds: few runs tell an exponent badly.
        """
        n, knee = self.slopes.size, self.knee_Nm
        slopes_sd = np.maximum(self.prior_slopes, 0.1 * self.mean_slope)
        moved = cache(self.start_columns)

        def fill_slopes(point: Point, out: FloatArray) -> None:
            stiff = (1.0 + self.deviations[:, 0])[self.conditions.run_of]
            np.multiply(point.ramps, stiff[:, None], out=out)

        def fill_shares(point: Point, out: FloatArray) -> None:
            np.multiply(point.slope[:, None], point.plays, out=out)

        def fill_start(session: int, point: Point, out: FloatArray) -> None:
            rows, by_state = moved()[session]
            out[:] = 0.0
            out[rows] = (point.slope[rows, None] * by_state) * self.shares
            if self.outside is not None:
                out[rows] += by_state * self.outside

        def fill_envelope(point: Point, out: FloatArray) -> None:
            out[:, 0] = self.envelope_column(point)

        def fill_outside(point: Point, out: FloatArray) -> None:
            out[:] = point.plays
            for (rows, by_state), start in zip(moved(), self.start, strict=True):
                out[rows] += by_state * start

        def start_block(session: int) -> Block:
            name = "start" if session == 0 else f"start_{session}"
            return Block(
                numbered(name, PLAYS),
                self.start[session],
                np.full(PLAYS, -1.0),
                np.ones(PLAYS),
                np.ones(PLAYS),
                partial(self.put_start, session),
                partial(fill_start, session),
                Prior(np.arange(PLAYS), np.zeros(PLAYS), np.ones(PLAYS)),
                of=START,
            )

        blocks = [
            Block(
                numbered("slope", n),
                self.slopes,
                np.zeros(n),
                np.full(n, SLOPE_MAX * self.mean_slope),
                1.0 / slopes_sd**2,
                partial(setattr, self, "slopes"),
                fill_slopes,
                Prior(np.arange(n), self.prior_slopes, slopes_sd),
                filed=SLOPES_FILED,
            ),
            Block(
                numbered("share", PLAYS),
                self.shares,
                np.zeros(PLAYS),
                np.full(PLAYS, SHARE_MAX),
                np.ones(PLAYS),
                partial(setattr, self, "shares"),
                fill_shares,
                filed=SHARES_FILED,
            ),
            start_block(0),
            Block(
                ["envelope"],
                np.array([self.envelope_Nm]),
                np.zeros(1),
                np.array([ENVELOPE_MAX * knee]),
                np.array([1.0 / knee**2]),
                self.put_envelope,
                fill_envelope,
                Prior(np.arange(1), np.array([USUAL_ENVELOPE * knee]), np.array([knee])),
                filed=ENVELOPE_FILED,
            ),
            *(self.term_block(term) for term in self.terms),
            *(additive_block(shape) for shape in self.additives),
        ]
        if self.outside is not None:
            blocks.append(
                Block(
                    numbered("outside", PLAYS),
                    self.outside,
                    np.zeros(PLAYS),
                    np.full(PLAYS, SLOPE_MAX * self.mean_slope),
                    np.zeros(PLAYS),
                    partial(setattr, self, "outside"),
                    fill_outside,
                    filed=OUTSIDE_FILED,
                )
            )
        return [*blocks, *(start_block(session) for session in range(1, len(self.sittings)))]

    def put_start(self, session: int, state: FloatArray) -> None:
        """Take over where the plays stood before a sitting."""
        self.start = self.start.copy()
        self.start[session] = state

    def put_envelope(self, more_Nm: FloatArray) -> None:
        """Take over how far the plays' envelope goes."""
        self.envelope_Nm = float(more_Nm[0])

    def term_block(self, term: Term) -> Block:
        """Free values of an effect; laws that only runs tell are about what is usual."""
        free = [term.effect.values[i] for i in term.free]
        low, high = (np.array([getattr(value, end) for value in free]) for end in ("low", "high"))
        laws = np.array(
            [k for k, value in enumerate(free) if value.between_runs],
            dtype=np.intp,
        )
        per_run = self.conditions.rows / self.conditions.runs
        a_run = RUN_SCATTER * self.noise_arcsec * np.sqrt(per_run)
        usual = np.array([free[k].typical for k in laws])
        sd = (high - low)[laws] / np.sqrt(EVENLY) / a_run

        def put(values: FloatArray) -> None:
            term.values = term.values.copy()
            term.values[term.free] = values

        def fill(point: Point, out: FloatArray) -> None:
            for k, i in enumerate(term.free):
                out[:, k] = self.value_column(term, i, point)

        return Block(
            [f"{term.effect.name}.{value.name}" for value in free],
            term.values[term.free],
            low,
            high,
            EVENLY / (high - low) ** 2,
            put,
            fill,
            Prior(laws, usual, sd, per_run=True) if laws.size else None,
            keys=[f"{term.effect.name}.{value.name}" for value in free],
            of=term,
        )

    def names(self) -> list[str]:
        """Names of the parameters."""
        return [name for block in self.blocks() for name in block.names]

    def fixed_columns(self, point: Point, more: int = 0) -> FloatArray:
        """Derivatives of the angle by the parameters, arc seconds per unit.

        Column by column in memory, with `more` empty rows at the end for whoever adds some.
        """
        blocks = placed(self.blocks())
        whole = np.empty((self.conditions.rows + more, blocks[-1][1].stop), order="F")
        for block, places in blocks:
            block.fill(point, whole[: self.conditions.rows, places])
        return whole

    def start_places(self) -> list[slice]:
        """Places of each sitting's start states among the parameters."""
        return [places for block, places in placed(self.blocks()) if block.of is START]

    def term_places(self, term: Term) -> slice:
        """Places of the free values of a term among the parameters."""
        return next(places for block, places in placed(self.blocks()) if block.of is term)

    def envelope_column(self, point: Point) -> FloatArray:
        """Derivative of the angle by how far the plays' envelope goes."""
        step = RADIUS_STEP * self.knee_Nm
        low, high = max(self.envelope_Nm - step, 0.0), self.envelope_Nm + step
        change = self.play_columns(point.torque, point.width, high)
        change -= self.play_columns(point.torque, point.width, low)
        change /= high - low
        column = point.slope * (change @ self.shares)
        return np.asarray(column if self.outside is None else column + change @ self.outside)

    def value_column(self, term: Term, index: int, point: Point) -> FloatArray:
        """Derivative of the angle by one value of a term."""
        value = term.effect.values[index]
        size = max(abs(term.values[index]), 0.1 * abs(value.typical), 1e-12)
        # What moves the friction is not smooth on the scale of a sample's noise.
        step = (1e-3 if term.effect.kind == "angle" else RADIUS_STEP) * size
        low, high = term.values.copy(), term.values.copy()
        low[index] = max(value.low, term.values[index] - step)
        high[index] = min(value.high, term.values[index] + step)
        if term.effect.kind == "angle":
            c = self.conditions
            elastic = point.elastic * ARCSEC
            up = term.effect.run(high, c, point.torque, elastic, point.wound)
            down = term.effect.run(low, c, point.torque, elastic, point.wound)
            return np.asarray((up - down) / ARCSEC / (high[index] - low[index]))
        up, down = (self.with_values(term, values).angle() for values in (high, low))
        return np.asarray((up - down) / (high[index] - low[index]))

    def with_values(self, term: Term, values: FloatArray) -> Base:
        """The same model, but for the values of one of its terms: to be evaluated, not fitted."""
        other = copy.copy(self)
        other.terms = [Term(t.effect, values, t.free) if t is term else t for t in self.terms]
        return other

    def run_columns(self, point: Point) -> FloatArray:
        """Derivatives by what a run has of its own: stiffness, friction, gap, offset.

        Those of stiffness and friction are by the logarithm: what all runs have more of one is then
        exactly a change of the base, and a shape that holds a constant learns nothing of the
        deviations at which it is looked at.
        """
        stiff = (1.0 + self.deviations[:, 0])[self.conditions.run_of]
        return side_by_side(
            stiff * point.backbone,
            self.friction_column(point),
            self.closed(point.wound),
            np.ones(self.conditions.rows),
        )

    def friction_column(self, point: Point) -> FloatArray:
        """Derivative of the angle by the logarithm of all half widths."""
        wider = self.play_columns(point.torque, point.width * (1 + RADIUS_STEP))
        closer = self.play_columns(point.torque, point.width * (1 - RADIUS_STEP))
        change = (wider - closer) / (2 * RADIUS_STEP)
        column = point.slope * (change @ self.shares)
        return np.asarray(column if self.outside is None else column + change @ self.outside)

    # --- fit -------------------------------------------------------------------------------------

    def vector(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Free parameters and their bounds."""
        blocks = self.blocks()
        x, low, high = (
            np.concatenate([getattr(block, what) for block in blocks])
            for what in ("value", "low", "high")
        )
        return x, low, high

    def set_vector(self, x: FloatArray) -> None:
        """Take over free parameters."""
        for block, places in placed(self.blocks()):
            block.put(x[places].copy())
        held = float(self.shares.sum()) * self.rise
        if held > SHARE_MAX:
            self.shares *= SHARE_MAX / held

    def prior_rows(self, x: FloatArray, scale: float) -> tuple[FloatArray, FloatArray]:
        """What is known of the parameters beforehand, and that not all torque may stick."""
        known, rows = prior_rows(self.blocks(), x, scale)
        at = {block.filed: places for block, places in placed(self.blocks()) if block.filed}
        shares, envelope = at[SHARES_FILED], at[ENVELOPE_FILED]
        rise, sum_of = 1.0 + x[envelope][0] / self.knee_Nm, float(x[shares].sum())
        over = sum_of * rise - SHARE_FIRM
        firm = np.zeros((1, x.size))
        if over > 0:
            firm[0, shares] = FIRMNESS * scale * rise
            firm[0, envelope] = FIRMNESS * scale * sum_of / self.knee_Nm
        held = FIRMNESS * scale * max(over, 0.0)
        return np.append(known, held), np.concatenate((rows, firm))

    def precision(self) -> FloatArray:
        """Prior precision of the columns of `fixed_columns` about where they are."""
        return np.concatenate([block.precision for block in self.blocks()])

    def fit(
        self,
        noise: float = 1.0,
        steps: int = 25,
        rows: npt.NDArray[np.bool_] | None = None,
        tolerance: float = TOLERANCE,
    ) -> Solution:
        """Least squares with the offsets of the runs free; the deviations stay as they are.

        Parameters
        ----------
        noise : float
            Noise in arc seconds, against which the prior counts.
        steps : int
            Largest number of evaluations.
        rows : ndarray of bool, optional
            Samples that count; memory runs through all of them.
        tolerance : float
            Relative fall of the cost below which the fit ends.
        """
        c = self.conditions

        def centre(values: FloatArray) -> FloatArray:
            if rows is not None:
                kept = values * (rows if values.ndim == 1 else rows[:, None])
                share = np.maximum(c.run_mean(rows.astype(np.float64)), 1e-12)
                mean = c.run_mean(kept) / (share if values.ndim == 1 else share[:, None])
                return np.asarray((values - mean[c.run_of])[rows])
            c.centre(values if values.ndim == 2 else values[:, None])
            return values

        def evaluate(x: FloatArray) -> tuple[FloatArray, FloatArray]:
            self.set_vector(x)
            point = self.at()
            more, more_rows = self.prior_rows(x, noise)
            residual = centre(point.angle - self.measured)
            if rows is None:
                columns = self.fixed_columns(point, more.size)
                centre(columns[: c.rows])
                columns[c.rows :] = more_rows
            else:
                columns = np.concatenate((centre(self.fixed_columns(point)), more_rows))
            return np.concatenate((residual, more)), columns

        x, low, high = self.vector()
        solution = bounded_least_squares(evaluate, x, low, high, steps=steps, tolerance=tolerance)
        self.set_vector(solution.x)
        return solution

    def first_fit(self, steps: int = 25, rows: npt.NDArray[np.bool_] | None = None) -> Solution:
        """Fit a base that has not been fitted, from several starts; the lowest error counts.

        A base that holds numbers of a fitted drive file starts from these alone.
        """
        fresh = self.fresh
        best, best_x = self.fit(steps=steps, rows=rows), self.vector()[0]
        others = zip(FIRST_SHARES[1:], FIRST_ENVELOPES[1:], strict=True) if fresh else ()
        for share, rise in others:
            self.slopes[:] = self.mean_slope
            self.shares[:] = share
            self.start[:] = 0.0
            self.envelope_Nm = rise * self.knee_Nm
            found = self.fit(steps=steps, rows=rows)
            if found.cost < best.cost:
                best, best_x = found, self.vector()[0]
        self.set_vector(best_x)
        return best

    def residual(self, point: Point | None = None) -> FloatArray:
        """Measured minus model with the offset of each run taken off, arc seconds."""
        c = self.conditions
        difference = self.measured - (point or self.at()).angle
        return np.asarray(difference - c.run_mean(difference)[c.run_of])

    def copy(self) -> Base:
        """A base that can be fitted apart from this one."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        other.terms = [Term(t.effect, t.values.copy(), list(t.free)) for t in self.terms]
        other.additives = [
            Additive(a.name, a.columns, a.coefficients.copy(), a.covariate, a.shape)
            for a in self.additives
        ]
        for name in ("slopes", "shares", "start", "deviations"):
            setattr(other, name, getattr(self, name).copy())
        other.outside = None if self.outside is None else self.outside.copy()
        return other


def additive_block(shape: Additive) -> Block:
    """Coefficients of a frozen shape: anything may be."""

    def put(coefficients: FloatArray) -> None:
        shape.coefficients = coefficients

    def fill(_: Point, out: FloatArray) -> None:
        out[:] = shape.columns

    count = shape.coefficients.size
    return Block(
        numbered(shape.name, count),
        shape.coefficients,
        np.full(count, -np.inf),
        np.full(count, np.inf),
        np.zeros(count),
        put,
        fill,
        of=shape,
    )


def numbered(name: str, count: int) -> list[str]:
    """Names of the values of a block."""
    return [f"{name}_{i}" for i in range(count)]


def start_values(effect: Effect, given: Mapping[str, float]) -> FloatArray:
    """Typical values, with what is known of the drive put in."""
    values = effect.typical.copy()
    for i, value in enumerate(effect.values):
        if value.role == "given" and value.scale in given:
            values[i] = given[value.scale]
    return values
