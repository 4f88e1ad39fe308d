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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from lostmotion.backbone import Backbone, run_plays
from lostmotion.core import core
from lostmotion.effects.conditions import Conditions, side_by_side
from lostmotion.effects.effect import Effect
from lostmotion.fit.least_squares import Solution, bounded_least_squares
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

LAWS_BETWEEN_RUNS = {("wear", "exponent")}
"""Values of how an effect hangs on what does not change within a run: only runs tell them ..."""

RUN_SCATTER = 0.6
"""... and each tells it as well as what it has of its own allows, over the noise, however many
samples it has. A law through the few worn runs of a campaign is held to what is usual accordingly:
samples that count one by one would put it through their scatter, and far off beyond them."""

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
class Point:
    """Everything the model gives at one set of parameters, in arc seconds and N m."""

    torque: FloatArray
    width: FloatArray
    plays: FloatArray
    wound: FloatArray
    ramps: FloatArray
    slope: FloatArray
    backbone: FloatArray
    elastic: FloatArray
    angle: FloatArray


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

    def envelope(self, torque: FloatArray) -> FloatArray:
        """What the plays follow, N m."""
        t = np.abs(torque) / self.knee_Nm
        more = self.envelope_Nm * (1.0 - 1.0 / (1.0 + t * (1.0 + t)))
        return np.asarray(torque + np.copysign(more, torque))

    def play_columns(self, torque: FloatArray, width: FloatArray) -> FloatArray:
        """Differences ``z_i - U`` through the whole campaign; `width` scales the half widths."""
        c = core(64)
        torque = self.envelope(torque)
        out = c.zeros(torque.size, PLAYS)
        for at in self.sittings:
            c.lib.lm_run_plays(
                c.pointer(c.array(self.radius_Nm)),
                c.pointer(c.zeros(PLAYS)),
                PLAYS,
                c.pointer(c.array(np.full(PLAYS, torque[at.start])), write=True),
                c.pointer(c.array(torque[at])),
                c.pointer(c.array(width[at])),
                at.stop - at.start,
                c.pointer(out[at], write=True),
            )
        return out

    def start_columns(self) -> Iterator[tuple[slice, FloatArray]]:
        """Rows of the first run of each sitting, and the plays' derivatives by where they stood."""
        starts = self.conditions.starts
        for sitting in self.sittings:
            end = starts[np.searchsorted(starts, sitting.start, side="right")]
            at = slice(sitting.start, int(end))
            torque = self.envelope(self.conditions.torque[at])
            out = np.zeros((torque.size, PLAYS))
            for i, radius in enumerate(self.radius_Nm):
                one = np.array([radius])
                high = run_plays(one, torque, 0.5)[:, 0]
                out[:, i] = high - run_plays(one, torque, -0.5)[:, 0]
            yield at, out

    def start_places(self, size: int) -> list[slice]:
        """Places of each sitting's start states among `size` parameters: later ones are last."""
        first, later = self.slopes.size + PLAYS, len(self.sittings) - 1
        ends = [first + PLAYS, *(size - PLAYS * k for k in reversed(range(later)))]
        return [slice(end - PLAYS, end) for end in ends]

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

    def fixed_names(self) -> list[str]:
        """Names of the columns of `fixed_columns`."""
        names = [f"slope_{i}" for i in range(self.slopes.size)]
        names += [f"share_{i}" for i in range(PLAYS)] + [f"start_{i}" for i in range(PLAYS)]
        names.append("envelope")
        for term in self.terms:
            names += [f"{term.effect.name}.{term.effect.values[i].name}" for i in term.free]
        for shape in self.additives:
            names += [f"{shape.name}_{i}" for i in range(shape.columns.shape[1])]
        if self.outside is not None:
            names += [f"outside_{i}" for i in range(PLAYS)]
        later = range(1, len(self.sittings))
        return [*names, *(f"start_{k}_{i}" for k in later for i in range(PLAYS))]

    def fixed_columns(self, point: Point, more: int = 0) -> tuple[FloatArray, list[str]]:
        """Derivatives by slopes, shares, start states and the values of the terms.

        Column by column in memory, with `more` empty rows at the end for whoever adds some.
        """
        c = self.conditions
        names = self.fixed_names()
        whole = np.empty((c.rows + more, len(names)), order="F")
        out = whole[: c.rows]
        n = self.slopes.size
        np.multiply(point.ramps, (1.0 + self.deviations[:, 0])[c.run_of][:, None], out=out[:, :n])
        np.multiply(point.slope[:, None], point.plays, out=out[:, n : n + PLAYS])
        at = self.first_term
        out[:, at - 1] = self.envelope_column(point)
        for term in self.terms:
            for i in term.free:
                out[:, at] = self.value_column(term, i, point)
                at += 1
        for shape in self.additives:
            out[:, at : at + shape.columns.shape[1]] = shape.columns
            at += shape.columns.shape[1]
        if self.outside is not None:
            outside = out[:, at : at + PLAYS]
            outside[:] = point.plays
        for k, (rows, moved) in enumerate(self.start_columns()):
            column = out[:, self.start_places(len(names))[k]]
            column[:] = 0.0
            column[rows] = (point.slope[rows, None] * moved) * self.shares
            if self.outside is not None:
                column[rows] += moved * self.outside
                outside[rows] += moved * self.start[k]
        return whole, names

    @property
    def first_term(self) -> int:
        """Place of the first value of an effect among the parameters; the envelope is before it."""
        return self.slopes.size + 2 * PLAYS + 1

    def envelope_column(self, point: Point) -> FloatArray:
        """Derivative of the angle by how far the plays' envelope goes."""
        kept, step = self.envelope_Nm, RADIUS_STEP * self.knee_Nm
        low = max(kept - step, 0.0)
        try:
            self.envelope_Nm = kept + step
            change = self.play_columns(point.torque, point.width)
            self.envelope_Nm = low
            change -= self.play_columns(point.torque, point.width)
        finally:
            self.envelope_Nm = kept
        change /= kept + step - low
        column = point.slope * (change @ self.shares)
        return np.asarray(column if self.outside is None else column + change @ self.outside)

    def value_column(self, term: Term, index: int, point: Point) -> FloatArray:
        """Derivative of the angle by one value of a term."""
        value = term.effect.values[index]
        size = max(abs(term.values[index]), 0.1 * abs(value.typical), 1e-12)
        # What moves the friction is not smooth on the scale of a sample's noise.
        step = (1e-3 if term.effect.kind == "angle" else RADIUS_STEP) * size
        kept = term.values
        low = kept.copy()
        high = kept.copy()
        low[index] = max(value.low, kept[index] - step)
        high[index] = min(value.high, kept[index] + step)
        if term.effect.kind == "angle":
            c = self.conditions
            elastic = point.elastic * ARCSEC
            up = term.effect.run(high, c, point.torque, elastic, point.wound)
            down = term.effect.run(low, c, point.torque, elastic, point.wound)
            return np.asarray((up - down) / ARCSEC / (high[index] - low[index]))
        try:
            term.values = high
            up = self.angle()
            term.values = low
            down = self.angle()
        finally:
            term.values = kept
        return np.asarray((up - down) / (high[index] - low[index]))

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
        x = [self.slopes, self.shares, self.start[0], np.array([self.envelope_Nm])]
        low = [np.zeros(self.slopes.size), np.zeros(PLAYS), np.full(PLAYS, -1.0), np.zeros(1)]
        high = [
            np.full(self.slopes.size, SLOPE_MAX * self.mean_slope),
            np.full(PLAYS, SHARE_MAX),
            np.ones(PLAYS),
            np.array([ENVELOPE_MAX * self.knee_Nm]),
        ]
        for term in self.terms:
            x.append(term.values[term.free])
            low.append(np.array([term.effect.values[i].low for i in term.free]))
            high.append(np.array([term.effect.values[i].high for i in term.free]))
        for shape in self.additives:
            x.append(shape.coefficients)
            low.append(np.full(shape.coefficients.size, -np.inf))
            high.append(np.full(shape.coefficients.size, np.inf))
        if self.outside is not None:
            x.append(self.outside)
            low.append(np.zeros(PLAYS))
            high.append(np.full(PLAYS, SLOPE_MAX * self.mean_slope))
        x.append(self.start[1:].ravel())
        low.append(np.full(x[-1].size, -1.0))
        high.append(np.ones(x[-1].size))
        return np.concatenate(x), np.concatenate(low), np.concatenate(high)

    def set_vector(self, x: FloatArray) -> None:
        """Take over free parameters."""
        n = self.slopes.size
        self.slopes = x[:n].copy()
        self.shares = x[n : n + PLAYS].copy()
        self.start = np.array([x[places] for places in self.start_places(x.size)])
        at = self.first_term
        self.envelope_Nm = float(x[at - 1])
        held = float(self.shares.sum()) * self.rise
        if held > SHARE_MAX:
            self.shares *= SHARE_MAX / held
        for term in self.terms:
            term.values = term.values.copy()
            term.values[term.free] = x[at : at + len(term.free)]
            at += len(term.free)
        for shape in self.additives:
            shape.coefficients = x[at : at + shape.coefficients.size].copy()
            at += shape.coefficients.size
        if self.outside is not None:
            self.outside = x[at : at + PLAYS].copy()

    def prior_rows(self, x: FloatArray, scale: float) -> tuple[FloatArray, FloatArray]:
        """Weak prior: slopes within their own size of the sheet's, start states within one.

        The plays' envelope is about the usual one. Laws that only runs tell are within their
        bounds, about what is usual.
        """
        n, states, knee = self.slopes.size, self.start.size, self.knee_Nm
        slopes_sd = np.maximum(self.prior_slopes, 0.1 * self.mean_slope)
        sd = np.concatenate((slopes_sd, np.ones(states), [knee]))
        starts = [np.arange(x.size)[places] for places in self.start_places(x.size)]
        laws, usual, laws_sd = self.laws_between_runs()
        where = np.concatenate((np.arange(n), *starts, [self.first_term - 1], laws))
        mean = np.concatenate((self.prior_slopes, np.zeros(states), [USUAL_ENVELOPE * knee], usual))
        weight = np.concatenate((scale / sd, 1.0 / laws_sd))
        rows = np.zeros((where.size + 1, x.size))
        rows[np.arange(where.size), where] = weight
        shares, envelope = x[n : n + PLAYS], x[self.first_term - 1]
        over = float(shares.sum()) * (1.0 + envelope / knee) - SHARE_FIRM
        if over > 0:
            rows[-1, n : n + PLAYS] = FIRMNESS * scale * (1.0 + envelope / knee)
            rows[-1, self.first_term - 1] = FIRMNESS * scale * float(shares.sum()) / knee
        held = FIRMNESS * scale * max(over, 0.0)
        return np.append(weight * (x[where] - mean), held), rows

    def laws_between_runs(self) -> tuple[IntArray, FloatArray, FloatArray]:
        """Values that only runs tell (`LAWS_BETWEEN_RUNS`), and what is usual of them.

        Returns
        -------
        places : ndarray of int
            Among the free parameters.
        usual, sd : ndarray
            The prior of a fit: its weight is that of so much noise in every sample of a run.
        """
        places, usual, widths = [], [], []
        place = self.first_term
        for term in self.terms:
            for i in term.free:
                value = term.effect.values[i]
                if (term.effect.name, value.name) in LAWS_BETWEEN_RUNS:
                    places.append(place)
                    usual.append(value.typical)
                    widths.append(value.high - value.low)
                place += 1
        per_run = self.conditions.rows / self.conditions.runs
        a_run = RUN_SCATTER * self.noise_arcsec * np.sqrt(per_run)
        sd = np.array(widths) / np.sqrt(EVENLY) / a_run
        return np.array(places, dtype=np.intp), np.array(usual), sd

    def precision(self, count: int) -> FloatArray:
        """Prior precision of the columns of `fixed_columns` about where they are.

        A value of an effect may be anywhere between its bounds: few runs tell an exponent badly.
        """
        out = np.zeros(count)
        n = self.slopes.size
        out[:n] = 1.0 / np.maximum(self.prior_slopes, 0.1 * self.mean_slope) ** 2
        out[n : n + PLAYS] = 1.0
        for places in self.start_places(count):
            out[places] = 1.0
        at = self.first_term
        out[at - 1] = 1.0 / self.knee_Nm**2
        for term in self.terms:
            for i in term.free:
                value = term.effect.values[i]
                out[at] = EVENLY / (value.high - value.low) ** 2
                at += 1
        return out

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
                columns, _ = self.fixed_columns(point, more.size)
                centre(columns[: c.rows])
                columns[c.rows :] = more_rows
            else:
                columns = np.concatenate((centre(self.fixed_columns(point)[0]), more_rows))
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
        for share, envelope in others:
            self.slopes[:] = self.mean_slope
            self.shares[:] = share
            self.start[:] = 0.0
            self.envelope_Nm = envelope * self.knee_Nm
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
        other = object.__new__(Base)
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


def start_values(effect: Effect, given: Sequence[tuple[str, float]]) -> FloatArray:
    """Typical values, with what is known of the drive put in."""
    values = effect.typical.copy()
    for i, value in enumerate(effect.values):
        for name, known in given:
            if value.role == "given" and value.name == name:
                values[i] = known
    return values
