"""The baseline model to which effects are added: torsion curve and hysteresis.

    T_e = T + sum w_i (z_i - U)
    phi = offset_run + s (exp(a_run) B(T_e) + g_run sat(T_e)) + sum c_i (z_i - U)

`B` is the torsion curve (`segmented_curve`); the operators z_i follow the envelope U of a torque
with half widths times exp(f_run) (`hysteresis`); a, f and g are the deviations of each run
(`deviations`). Effects act on the torque, the compliance (the factor s), the half widths or the
angle (`terms`).
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray
from lostmotion.content_key import content_key
from lostmotion.core import Kind, core
from lostmotion.effects.conditions import Conditions, side_by_side
from lostmotion.effects.effect import Effect
from lostmotion.fit.deviations import DEVIATIONS, GAP, gap_closed, stiffness_factor, width_factor
from lostmotion.fit.form_error import FormBasis, FormError
from lostmotion.fit.hysteresis import (
    FIRST_ENVELOPES,
    FIRST_SHARES,
    HYSTERESIS_FILED,
    START,
    Hysteresis,
)
from lostmotion.fit.least_squares import Solution, bounded_least_squares
from lostmotion.fit.parameters import Block, Filed, placed, prior_rows
from lostmotion.fit.point import Driven, Point, before_friction
from lostmotion.fit.segmented_curve import CURVE_FILED, SegmentedCurve
from lostmotion.fit.sticking import Sticking
from lostmotion.fit.terms import RUN_SCATTER, Additive, Term
from lostmotion.torsion_curve import TorsionCurve
from lostmotion.units import ARCSEC

TOLERANCE = 1e-6
"""Relative decrease of the cost below which a fit ends."""

COMPLIANCE_MAX = float(core(64).lib.LM_COMPLIANCE_MAX)
"""Largest factor of effects on the compliance."""

FILED = (*CURVE_FILED, *HYSTERESIS_FILED)
"""Values of the baseline model in a fitted drive file, in addition to effects."""


@dataclass
class BaselineModel:
    """The baseline model of one campaign, and the added terms.

    Attributes
    ----------
    sheet : TorsionCurve or None
        Torsion curve of the data sheet.
    curve : SegmentedCurve
    hysteresis : Hysteresis
    widens : bool
        Whether all half widths may be scaled together; campaigns to be merged share them.
    rises : bool
        Whether a fit is constrained to an angle that rises with the torque while every operator
        sticks, as a controller requires. Recordings may violate this: torque from the motor current
        is not the output torque, and a delayed torque causes apparent negative compliance.
    deviations : ndarray
        Of each run, see `DEVIATIONS`.
    measured : ndarray
        Lost motion that is fitted, arc seconds.
    outlier : ndarray of bool
        Samples set aside.
    noise_arcsec : float
        Noise within runs, rms, if known; used for the prior of laws between runs.
    form_basis : FormBasis
        All columns that the form error may have; shared by copies.
    form_error : FormError or None
        Form error; None: there is none, or it is not estimated yet.
    """

    conditions: Conditions
    rated_torque_Nm: float
    sheet: TorsionCurve | None = None
    terms: list[Term] = field(default_factory=list)
    additives: list[Additive] = field(default_factory=list)
    widens: bool = True
    rises: bool = False

    def __repr__(self) -> str:
        """Summarise the model."""
        names = ", ".join(term.effect.name for term in self.terms)
        return (
            f"<BaselineModel{' with ' + names if names else ''} over {self.conditions.campaign!r}>"
        )

    def __post_init__(self) -> None:
        c = self.conditions
        self.largest = float(np.max(np.abs(c.torque)))
        self.curve = SegmentedCurve.of_recordings(c, self.largest, self.sheet)
        self.hysteresis = Hysteresis.of_recordings(c, self.largest, self.rated_torque_Nm)
        self.deviations = np.zeros((c.runs, len(DEVIATIONS)))
        self.outlier = np.zeros(c.rows, dtype=bool)
        self.measured = c.lost_motion.copy()
        self.noise_arcsec = 1.0
        self.form_basis = FormBasis.of(self.hysteresis)
        self.form_error: FormError | None = None

    def begin_from(self, lost_motion: FloatArray) -> None:
        """Start with the slopes of a lost motion, see `SegmentedCurve.begin_from`."""
        self.curve.begin_from(self.conditions, lost_motion, self.sheet)

    def begin_outside(self) -> None:
        """Start a fit with friction only in series with the spring."""
        self.curve.slopes = np.full(self.curve.slopes.size, self.curve.mean_slope)
        self.hysteresis.take_inside_out()
        self.hysteresis.allow_outside()

    @property
    def has_effects(self) -> bool:
        """Whether there is an effect of possibly inexact form (not slipped teeth)."""
        return any(term.free for term in self.terms)

    # --- prediction ------------------------------------------------------------------------------

    def driven(self) -> Driven:
        """Loads and friction: all that acts before the torsion curve."""
        c, hysteresis = self.conditions, self.hysteresis
        zero = np.zeros(c.rows)
        torque = c.torque
        for term in self.terms_of("torque"):
            torque = torque + term.effect.run(term.values, c, c.torque, zero)
        compliance = np.ones(c.rows)
        for term in self.terms_of("compliance"):
            compliance += term.effect.run(term.values, c, torque, zero)
        np.clip(compliance, 1.0 / COMPLIANCE_MAX, COMPLIANCE_MAX, out=compliance)
        width = width_factor(self.deviations)[c.run_of]
        for term in self.terms_of("width"):
            before = before_friction(torque, compliance, self.curve.angle)
            width = width * term.effect.run(term.values, c, torque, before * ARCSEC)
        followed = hysteresis.followed(torque, compliance, width)
        plays, wound = hysteresis.columns(followed, width), torque.copy()
        hysteresis.add(wound, plays, followed, hysteresis.shares)
        return Driven(torque, compliance, width, followed, plays, wound)

    def terms_of(self, kind: Kind) -> list[Term]:
        """The terms whose effects act on one part of the model."""
        return [term for term in self.terms if term.effect.kind == kind]

    def angles(self, driven: Driven, torsion_curve: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Elastic angle and total angle."""
        c, torque, wound = self.conditions, driven.torque, driven.wound
        elastic = stiffness_factor(self.deviations)[c.run_of] * torsion_curve
        elastic += self.deviations[:, GAP][c.run_of] * gap_closed(wound, self.rated_torque_Nm)
        elastic *= driven.compliance
        if self.hysteresis.outside is not None:
            self.hysteresis.add(elastic, driven.plays, driven.followed, self.hysteresis.outside)
        angle = elastic.copy()
        for term in self.terms_of("angle"):
            angle += term.effect.run(term.values, c, torque, elastic * ARCSEC, wound) / ARCSEC
        for shape in self.additives:
            angle += shape.columns @ shape.coefficients
        return elastic, angle

    def at(self) -> Point:
        """Evaluate the model without the offsets of the runs."""
        driven = self.driven()
        torsion_curve = self.curve.angle(driven.wound)
        stiffness = stiffness_factor(self.deviations)[self.conditions.run_of] * driven.compliance
        curve = self.curve.copy()  # the parameters may have changed when it is called
        elastic, angle = self.angles(driven, torsion_curve)
        return Point(
            **vars(driven),
            stiffness=stiffness,
            slope_at=curve.slope_at,
            curve_at=curve.angle,
            torsion_curve=torsion_curve,
            elastic=elastic,
            angle=angle,
        )

    def angle(self) -> FloatArray:
        """Angle of `at` alone, for differences: several times quicker."""
        driven = self.driven()
        return self.angles(driven, self.curve.angle(driven.wound))[1]

    def residual(self, point: Point | None = None) -> FloatArray:
        """Measured minus model without the offset of each run, arc seconds."""
        angle = self.angle() if point is None else point.angle
        return self.conditions.centred(self.measured - angle)

    # --- derivatives -----------------------------------------------------------------------------

    def fixed_columns(
        self, point: Point, more: int = 0, beside: int = 0, into: FloatArray | None = None
    ) -> FloatArray:
        """Derivatives of the angle by the parameters, arc seconds per unit.

        Contiguous columns, with `more` empty rows at the end, and `beside` empty columns; `into` is
        what an earlier call for the same parameters returned and is overwritten.
        """
        blocks = placed(self.blocks())
        shape = (self.conditions.rows + more, blocks[-1][1].stop + beside)
        whole = np.empty(shape, order="F") if into is None else into
        for block, places in blocks:
            block.fill(point, whole[: self.conditions.rows, places])
        return whole

    def value_column(self, term: Term, index: int, point: Point) -> FloatArray:
        """Derivative of the angle by one value of a term."""
        return self.slope_by(term.effect, *term.around(index), index, point)

    def slope_by(
        self, effect: Effect, low: FloatArray, high: FloatArray, index: int, point: Point
    ) -> FloatArray:
        """Derivative of the angle by one value of an effect, between two of its sizes."""
        step = high[index] - low[index]
        if effect.kind in ("torque", "compliance"):
            up, down = (self.with_values(effect, values).angle() for values in (high, low))
            return np.asarray((up - down) / step)
        up, down = (self.run_effect(effect, values, point) for values in (high, low))
        if effect.kind == "angle":
            return np.asarray((up - down) / ARCSEC / step)
        return self.hysteresis.by_width(point, 2.0 * (up - down) / (up + down) / step)

    def run_effect(self, effect: Effect, values: FloatArray, point: Point) -> FloatArray:
        """Evaluate an effect at a point, in its unit."""
        torque, elastic_rad = point.torque, point.elastic * ARCSEC
        if effect.kind == "width":
            before = before_friction(torque, point.compliance, point.curve_at)
            return effect.run(values, self.conditions, torque, before * ARCSEC)
        return effect.run(values, self.conditions, torque, elastic_rad, point.wound)

    def with_values(self, effect: Effect, values: FloatArray) -> BaselineModel:
        """The model with an effect at some values: to be evaluated, not fitted."""
        other, term = copy.copy(self), Term(effect, values, effect.free())
        names = [known.effect.name for known in self.terms]
        place = names.index(effect.name) if effect.name in names else len(names)
        other.terms = [*self.terms[:place], term, *self.terms[place + 1 :]]
        return other

    def run_columns(self, point: Point) -> FloatArray:
        """Derivatives by the deviations of a run: `DEVIATIONS`, then the offset."""
        return side_by_side(
            point.stiffness * point.torsion_curve,
            self.hysteresis.by_width(point),
            point.compliance * gap_closed(point.wound, self.rated_torque_Nm),
            np.ones(self.conditions.rows),
        )

    # --- parameters ------------------------------------------------------------------------------

    def blocks(self) -> list[Block]:
        """Blocks of the parameter vector in order, with everything about a parameter."""
        c, hysteresis = self.conditions, self.hysteresis
        shares, envelope = hysteresis.inside_blocks()
        first, *later = hysteresis.start_blocks()
        run_noise = RUN_SCATTER * self.noise_arcsec * np.sqrt(c.rows / c.runs)
        return [
            self.curve.block(),
            *shares,
            first,
            *envelope,
            *(term.block(run_noise, self.value_column) for term in self.terms),
            *(shape.block() for shape in self.additives),
            *hysteresis.outside_blocks(self.curve.mean_slope),
            *later,
        ]

    def names(self) -> list[str]:
        """Names of the parameters."""
        return [name for block in self.blocks() for name in block.names]

    def places_of(self, owner: object) -> list[slice]:
        """Places of the parameters of a term, or of the start states."""
        return [places for block, places in placed(self.blocks()) if block.of is owner]

    def start_places(self) -> list[slice]:
        """Places of each session's start states among the parameters."""
        return self.places_of(START)

    def term_places(self, term: Term) -> slice:
        """Places of the free values of a term among the parameters."""
        return self.places_of(term)[0]

    def filed_places(self) -> dict[Filed, slice]:
        """Places of the parameters that a drive file stores."""
        return {block.filed: places for block, places in placed(self.blocks()) if block.filed}

    def vector(
        self, blocks: Sequence[Block] | None = None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Free parameters and their bounds; `blocks` are those of the present values, if known."""
        blocks = self.blocks() if blocks is None else blocks
        x, low, high = (
            np.concatenate([getattr(block, what) for block in blocks])
            for what in ("value", "low", "high")
        )
        return x, low, high

    def set_vector(self, x: FloatArray, blocks: Sequence[Block] | None = None) -> None:
        """Set the free parameters; `blocks` may be those of other values of this model."""
        for block, places in placed(self.blocks() if blocks is None else blocks):
            block.put(x[places].copy())
        self.hysteresis.limit_shares()
        if self.rises:
            self.hysteresis.limit_outside(self.curve.slopes)

    def precision(self) -> FloatArray:
        """Prior precision of the columns of `fixed_columns` at their present values."""
        return np.concatenate([block.precision for block in self.blocks()])

    # --- fit -------------------------------------------------------------------------------------

    def fit(
        self,
        noise: float = 1.0,
        steps: int = 25,
        rows: BoolArray | None = None,
        tolerance: float = TOLERANCE,
    ) -> Solution:
        """Least squares with free offsets of the runs; the deviations are kept.

        It uses variables in which the sticking limits are bounds (`Sticking`). A fit from the same
        start is done once.

        Parameters
        ----------
        noise : float
            Noise in arc seconds, the weight of the prior.
        steps : int
            Largest number of evaluations.
        rows : ndarray of bool, optional
            Samples used in the fit; the state is computed through all of them.
        tolerance : float
            Relative decrease of the cost below which the fit ends.
        """
        c = self.conditions
        used = None if rows is None else content_key(rows)
        key = ("fit", *self.content_key(), noise, steps, used, tolerance)
        solution: Solution = c.once(key, self.fitted, noise, steps, rows, tolerance)
        self.set_vector(self.sticking.vector(solution.x))
        return solution

    @property
    def sticking(self) -> Sticking:
        """Variables of a fit, see `Sticking`."""
        return Sticking(self.filed_places(), self.hysteresis.knee_Nm, self.rises)

    def fitted(
        self, noise: float, steps: int, rows: BoolArray | None, tolerance: float
    ) -> Solution:
        """Result of `fit`, in its variables; the parameters are left at any point of the search."""
        c, sticking = self.conditions, self.sticking
        blocks = self.blocks()  # only values and derivatives change, and these are made at a point
        made: FloatArray | None = None  # pages of new memory take as long as a column

        def evaluate(free: FloatArray) -> tuple[FloatArray, Callable[[], FloatArray]]:
            x = sticking.vector(free)
            self.set_vector(x, blocks)
            point = self.at()
            known, known_rows = prior_rows(blocks, x, noise)
            residual = point.angle - self.measured
            residual = c.centred(residual) if rows is None else c.centred_on(rows, residual)

            def derivatives() -> FloatArray:
                nonlocal made
                made = self.fixed_columns(point, 0 if rows is not None else known.size, into=made)
                if rows is None:
                    columns = made
                    c.centre(columns[: c.rows])
                else:
                    columns = c.centred_on(rows, made, known.size)
                columns[columns.shape[0] - known.size :] = known_rows
                sticking.convert(columns, free)
                return columns

            return np.concatenate((residual, known)), derivatives

        x, low, high = self.vector(blocks)
        return bounded_least_squares(
            evaluate,
            sticking.free(x),
            low,
            high,
            steps=steps,
            tolerance=tolerance,
            limit=sticking.limit,
        )

    def first_fit(self, steps: int = 25, rows: BoolArray | None = None) -> Solution:
        """Fit an unfitted model from several starts; the lowest error counts.

        A model from a fitted drive file starts only from its values.
        """
        unfitted = self.hysteresis.unfitted
        best, best_x = self.fit(steps=steps, rows=rows), self.vector()[0]
        others = zip(FIRST_SHARES[1:], FIRST_ENVELOPES[1:], strict=True) if unfitted else ()
        for share, rise in others:
            self.curve.slopes[:] = self.curve.mean_slope
            self.hysteresis.begin(share, rise)
            found = self.fit(steps=steps, rows=rows)
            if found.cost < best.cost:
                best, best_x = found, self.vector()[0]
        self.set_vector(best_x)
        return best

    def content_key(self) -> tuple[Hashable, ...]:
        """All that a fit depends on beside the recordings, as a key: equal models have equal keys.

        The noise within runs acts through the priors of the blocks; a form error is in no fit.
        """
        apart = {"conditions", "form_basis", "form_error", "noise_arcsec"}
        parts = {name: part for name, part in vars(self).items() if name not in apart}
        return content_key(parts), content_key([block.prior for block in self.blocks()])

    def with_present_form(self) -> BaselineModel:
        """The model with the columns of a form error for its present effects on the compliance."""
        other, c = self.copy(), self.conditions
        moving = self.hysteresis.moving(self.driven().compliance)
        if not np.array_equal(moving, self.form_basis.moving):
            other.form_basis = FormBasis(c, self.hysteresis.sessions, moving)
        return other

    def copy(self) -> BaselineModel:
        """An independent copy of the model."""
        other = copy.copy(self)
        other.curve, other.hysteresis = self.curve.copy(), self.hysteresis.copy()
        other.terms = [term.copy() for term in self.terms]
        other.additives = [shape.copy() for shape in self.additives]
        other.deviations = self.deviations.copy()
        return other

    def over(self, conditions: Conditions) -> BaselineModel:
        """The same model for other recordings, without deviations of runs: to be evaluated.

        Friction starts at rest in each session.
        """
        other = self.copy()
        other.conditions = conditions
        hysteresis = other.hysteresis
        hysteresis.conditions = conditions
        hysteresis.start = np.zeros((len(hysteresis.sessions), hysteresis.count))
        other.measured = conditions.lost_motion.copy()
        other.outlier = np.zeros(conditions.rows, dtype=bool)
        other.deviations = np.zeros((conditions.runs, len(DEVIATIONS)))
        other.form_basis, other.form_error = FormBasis.of(hysteresis), None
        return other

    def with_planned(self, conditions: Conditions) -> BaselineModel:
        """The same model for its recordings followed by planned runs without measurements.

        Parameters
        ----------
        conditions : Conditions
            Of the recordings and the planned runs.
        """
        other = self.copy()
        other.conditions = conditions
        other.hysteresis.over(conditions)
        more = conditions.rows - self.conditions.rows
        other.measured = np.concatenate((self.measured, np.zeros(more)))
        other.outlier = np.concatenate((self.outlier, np.zeros(more, dtype=bool)))
        other.deviations = np.zeros((conditions.runs, len(DEVIATIONS)))
        other.deviations[: self.conditions.runs] = self.deviations
        other.form_basis, other.form_error = FormBasis.of(other.hysteresis), None
        return other
