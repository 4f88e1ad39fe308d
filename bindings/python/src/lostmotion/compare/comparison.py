"""The comparison: the baseline model is fitted, cross-validated and judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray, IntArray
from lostmotion.characterize import StandardFigures, standard_figures
from lostmotion.characterize.stretches import find_loops
from lostmotion.compare.failures import Failure, where_it_fails
from lostmotion.compare.loops import zero_widths
from lostmotion.compare.repeatability import Repeatability, repeatability_of
from lostmotion.discover.baseline_fit import finish_baseline
from lostmotion.discover.baseline_form import tried
from lostmotion.discover.events import Event, early_events
from lostmotion.discover.whitened_result import WhitenedResult
from lostmotion.drives import Drive
from lostmotion.effects.columns import closed_by_columns
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.effect import Effect
from lostmotion.effects.library import library
from lostmotion.errors import InputError, given_as
from lostmotion.fit.baseline import FILED, BaselineModel
from lostmotion.fit.drive_file import SAMPLES_LEAST, make_base
from lostmotion.fit.few_readings import FewReadings, fit_few_readings
from lostmotion.fit.fitted_range import beyond, fitted_ranges
from lostmotion.friction import Friction
from lostmotion.hold_against import hold_against
from lostmotion.on_progress import OnProgress
from lostmotion.recordings import Campaign, say_findings
from lostmotion.rms import rms_of
from lostmotion.threads import one_thread
from lostmotion.torsion_curve import TorsionCurve
from lostmotion.units import ARCMIN, ARCSEC


@dataclass
class Comparison(WhitenedResult):
    """Result of `compare`. Angles in rad; `answer` returns the JSON answer in arc seconds.

    Attributes
    ----------
    base : BaselineModel
        As it was fitted.
    friction : {"inside", "outside", "inside+load", "both", "both+load"}
        Form of the hysteresis, see `lostmotion.friction`.
    offset_rad : ndarray
        One per run.
    residual_rad, heldout_rad : ndarray
        Measured minus model of every sample, fitted and cross-validated.
    seen : ndarray of bool
        Runs that were fitted.
    frictions : dict
        Fitted and leave-one-run-out error of every form tried.
    few : FewReadings or None
        The values from few readings, instead of a fit to a log.
    rated_torque_Nm : float
        Of the drive, or the largest torque of the recordings if there is no drive.
    events : list of Event
        Steps of the lost motion within a run: slips, lost counts, shifted zeros.
    outliers : int
        Number of single outlying samples that were replaced by their neighbours.
    """

    campaign: Campaign
    base: BaselineModel
    friction: Friction
    offset_rad: FloatArray
    residual_rad: FloatArray
    heldout_rad: FloatArray
    heldout_by: str
    seen: BoolArray
    frictions: dict[str, tuple[float, float]]
    as_it_stands_rms_rad: float
    noise: Repeatability
    explained_share: float
    failures: list[Failure]
    not_testable: dict[str, list[str]]
    rated_torque_Nm: float
    events: list[Event]
    few: FewReadings | None = None
    outliers: int = 0

    def __repr__(self) -> str:
        """Summarise the result without the residuals."""
        return (
            f"<Comparison of {self.campaign!r}: rms {self.rms_rad / ARCSEC:.3g} arcsec, "
            f"cross-validated {self.heldout_rms_rad / ARCSEC:.3g}>"
        )

    def fitted_base(self) -> BaselineModel:
        """Give the model that was fitted."""
        return self.base

    @property
    def starts(self) -> IntArray:
        """Offsets of the runs."""
        return self.base.conditions.starts

    @property
    def run_of(self) -> IntArray:
        """Run of every sample."""
        return self.base.conditions.run_of

    @property
    def torque_Nm(self) -> FloatArray:
        """Torque of every sample."""
        return self.base.conditions.torque

    @property
    def measured_rad(self) -> FloatArray:
        """Lost motion of every sample, each run about its own zero."""
        return self.base.conditions.lost_motion * ARCSEC - self.offset_rad[self.run_of]

    @property
    def rms_rad(self) -> float:
        """Fitted error over the runs that were fitted."""
        return rms_of(self.residual_rad[self.seen[self.run_of]])

    @property
    def heldout_rms_rad(self) -> float:
        """Leave-one-run-out error, or that of the predicted runs."""
        unseen = ~self.seen[self.run_of]
        return rms_of(self.heldout_rad[unseen] if unseen.any() else self.heldout_rad)

    def beyond_fitted_range(self) -> dict[str, float | None]:
        """Extrapolation beyond the fitted runs, see `fit.fitted_range.beyond`."""
        fitted = self.seen[self.run_of]
        if fitted.all():
            return {}
        c = self.base.conditions
        return beyond(fitted_ranges(c, fitted), fitted_ranges(c, ~fitted))

    def least_amplitude_ratio(self) -> float:
        """Least amplitude of a predicted run over the least of the fitted ones."""
        sizes = np.maximum.reduceat(np.abs(self.torque_Nm), self.starts[:-1])
        if self.seen.all():
            return 1.0
        return float(sizes[~self.seen].min() / sizes[self.seen].min())

    @cached_property
    def standard_figures(self) -> dict[str, StandardFigures]:
        """Standard figures of the measured and of the modelled loops, by the same method."""
        model = self.measured_rad - self.residual_rad
        loops = find_loops(self.campaign)
        return {
            name: standard_figures(self.campaign, self.rated_torque_Nm, angle, loops)
            for name, angle in (("measured", self.measured_rad), ("model", model))
        }

    def by_run(self) -> list[dict[str, Any]]:
        """Error of each run, fitted and cross-validated, and its loop width at zero torque."""
        rows = []
        measured = self.measured_rad
        for i, (run, at) in enumerate(
            zip(self.campaign.runs, self.base.conditions.slices(), strict=True)
        ):
            width = zero_widths(
                self.torque_Nm[at], np.column_stack((measured[at], self.residual_rad[at]))
            )
            rows.append(
                {
                    "run": run.label,
                    "rms_arcsec": rms_of(self.residual_rad[at]) / ARCSEC,
                    "heldout_rms_arcsec": rms_of(self.heldout_rad[at]) / ARCSEC,
                    "samples": len(run),
                    "fitted": bool(self.seen[i]),
                    "width_at_zero_arcmin": None if width is None else float(width[0]) / ARCMIN,
                    "model_width_at_zero_arcmin": None
                    if width is None
                    else float(width[0] - width[1]) / ARCMIN,
                }
            )
        return rows

    def parameters(self) -> dict[str, Any]:
        """Fitted values by name, with their units."""
        base = self.base
        out: dict[str, Any] = {}
        for filed in FILED:
            values = (
                filed.of(base) if filed.of(base).size else np.zeros(base.hysteresis.shares.size)
            )
            out[filed.answer] = values.tolist() if "{}" in filed.key else float(values[0])
        return {**out, "start_state": base.hysteresis.start[0].tolist()}

    @property
    def invertible(self) -> bool:
        """Whether the angle never falls with rising torque while every operator sticks."""
        base = self.base
        outside = 0.0 if base.hysteresis.outside is None else float(base.hysteresis.outside.sum())
        stuck = 1.0 - base.hysteresis.rise * float(base.hysteresis.shares.sum())
        return bool(stuck * float(base.curve.slopes.min()) >= base.hysteresis.rise * outside)

    def answer(self) -> dict[str, Any]:
        """Return the answer of the command, ready for JSON."""
        noise = self.noise
        return {
            "schema": "lostmotion.comparison/1",
            "rms_arcsec": self.rms_rad / ARCSEC,
            "heldout_rms_arcsec": self.heldout_rms_rad / ARCSEC,
            "noise_floor_arcsec": noise.floor_rad / ARCSEC,
            "explained_share": self.explained_share,
            "by_run": self.by_run(),
            "where_it_fails": [
                {"covariate": f.covariate, "share": f.share, "p": f.p} for f in self.failures
            ],
            "unfitted_rms_arcsec": self.as_it_stands_rms_rad / ARCSEC,
            "heldout_by": self.heldout_by,
            "beyond_fitted_range": self.beyond_fitted_range(),
            "least_amplitude_ratio": self.least_amplitude_ratio(),
            "friction": self.friction,
            "frictions": {
                name: {"rms_arcsec": rms / ARCSEC, "heldout_rms_arcsec": heldout / ARCSEC}
                for name, (rms, heldout) in self.frictions.items()
            },
            "effects": [term.effect.name for term in self.base.terms],
            "parameters": self.parameters(),
            "invertible": self.invertible,
            "noise": {
                "within_runs_arcsec": noise.within_rad / ARCSEC,
                "between_runs_arcsec": None
                if noise.between_rad is None
                else noise.between_rad / ARCSEC,
                "repeated_runs": noise.repeats,
            },
            "standard_figures": {
                name: found.answer() for name, found in self.standard_figures.items()
            },
            "not_testable": self.not_testable,
            "events": [event.told(self.base.conditions.labels) for event in self.events],
            "findings": say_findings(self.campaign.findings),
            "samples": self.campaign.rows,
            "outliers": self.outliers,
            "values": None if self.few is None else self.few.values,
            "data_fingerprint": self.campaign.fingerprint(),
        }


def compare(
    drive: Drive | TorsionCurve,
    campaign: Campaign,
    *,
    base: BaselineModel | None = None,
    effects: Mapping[str, Effect] | None = None,
    fit_on: Sequence[int | str] | None = None,
    friction: Friction | None = None,
    seed: int = 1,
    progress: OnProgress | None = None,
) -> Comparison:
    """Fit the baseline model to a campaign and find where it fails.

    Parameters
    ----------
    drive : Drive or TorsionCurve
        The drive, with the values and effects of a fit if its file has them; or only its loss-free
        torsion curve.
    campaign : Campaign
        The recordings.
    base : BaselineModel, optional
        An existing baseline model for this campaign.
    effects : mapping, optional
        Effects that may be missing, also used to look up the effects of the drive file; by default
        those of the library.
    fit_on : sequence of run labels, optional
        Fit only these runs and predict the others; by default all are fitted, and each is left out
        once.
    friction : {"inside", "outside", "inside+load", "both", "both+load"}, optional
        Form of the hysteresis; by default selected by the leave-one-run-out errors
        (`discover.baseline_form`).
    seed : int
        Seed of the random signs of the permutation tests.
    progress : callable, optional
        ``progress(done, of, step)``, see `lostmotion.on_progress`.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        If the torque of the recordings does not vary, or a run to be fitted does not exist.
    """
    given_as("compare", "drive", drive, Drive, TorsionCurve)
    given_as("compare", "campaign", campaign, Campaign)
    campaign.require_variation()
    known = library() if effects is None else effects
    with one_thread():
        if isinstance(drive, TorsionCurve):
            torsion_curve = drive
        else:
            torsion_curve = hold_against(campaign, drive)
            base = base or make_base(drive, campaign, torsion_curve, known)
        return _compare(
            torsion_curve,
            campaign,
            base,
            known,
            fit_on,
            friction,
            seed,
            progress or (lambda *_: None),
            None if isinstance(drive, TorsionCurve) else drive,
        )


def _compare(
    torsion_curve: TorsionCurve,
    campaign: Campaign,
    given: BaselineModel | None,
    effects: Mapping[str, Effect],
    fit_on: Sequence[int | str] | None,
    friction: Friction | None,
    seed: int,
    progress: OnProgress,
    drive: Drive | None,
) -> Comparison:
    steps = 4
    rated_Nm = None if drive is None else drive.rated_torque_Nm
    torque = campaign.column("torque")
    inside = given or BaselineModel(
        Conditions(campaign), float(np.max(np.abs(torque))), torsion_curve
    )
    c = inside.conditions
    measured = c.centred(c.lost_motion)
    driven = inside.driven()
    if inside.hysteresis.unfitted:
        sheet = torsion_curve if inside.sheet is None else inside.sheet
        driven = replace(driven, wound=driven.torque)
        curve = sheet(driven.torque) / ARCSEC
    else:
        curve = inside.curve.angle(driven.wound)
    stands = measured - c.centred(inside.angles(driven, curve)[1])
    seen = runs_to_fit(campaign, fit_on)
    rows = None if seen.all() else seen[c.run_of]

    if campaign.rows < SAMPLES_LEAST:
        return _compare_few(inside, stands, seen, effects, rated_Nm)
    ratio = 1.0 if drive is None else drive.ratio
    progress(0, steps, "fitting the baseline model")
    inside.first_fit(rows=rows)
    events = early_events(inside)
    fitted = finish_baseline(inside, effects, ratio, friction, rows=rows)
    chosen = fitted.chosen
    progress(2, steps, "leave-one-run-out fits")
    best = chosen.base
    left_out = c.starts if c.runs > 1 else np.array([0, c.rows // 2, c.rows])
    heldout = tried(best, rows, left_out, refits=True).heldout
    fitted_rows = seen[c.run_of]
    frictions = {
        name: (rms_of(form.base.residual()[fitted_rows]), rms_of(form.heldout[fitted_rows]))
        for name, form in chosen.tried.items()
    }
    progress(3, steps, "testing the residual")
    angle = best.at().angle
    residual = best.residual() * ARCSEC
    variance = float(np.sum(measured**2)) * ARCSEC**2
    result = Comparison(
        campaign,
        best,
        chosen.form,
        c.run_mean(best.measured - angle) * ARCSEC,
        residual,
        heldout * ARCSEC,
        held_out_by(campaign, seen),
        seen,
        {name: (a * ARCSEC, b * ARCSEC) for name, (a, b) in frictions.items()},
        rms_of(stands) * ARCSEC,
        repeatability_of(c, residual),
        1.0 - float(np.sum(residual**2)) / variance if variance > 0 else 0.0,
        where_it_fails(c, residual, seed),
        closed_by_columns(effects, c),
        float(np.max(np.abs(torque))) if rated_Nm is None else rated_Nm,
        events,
        outliers=fitted.outliers,
    )
    progress(steps, steps, "")
    return result


def _compare_few(
    base: BaselineModel,
    stands: FloatArray,
    seen: BoolArray,
    effects: Mapping[str, Effect],
    rated_Nm: float | None,
) -> Comparison:
    """Compare few readings: as many values as they determine, each reading left out once."""
    c = base.conditions
    few = fit_few_readings(base) if seen.all() else None
    residual = base.residual() if few is not None else stands
    heldout = few.heldout() if few is not None else stands
    measured = c.centred(c.lost_motion)
    variance = float(np.sum(measured**2))
    rms = (rms_of(residual) * ARCSEC, rms_of(heldout) * ARCSEC)
    # Only the residual shows the error of a reading, and the estimated values have absorbed a part
    # of it.
    error = few.error_arcsec if few is not None else rms_of(residual)
    return Comparison(
        c.campaign,
        base,
        "both" if few is not None else "inside",
        c.run_mean(c.lost_motion - residual) * ARCSEC
        if few is None
        else c.run_mean(base.measured - base.at().angle) * ARCSEC,
        residual * ARCSEC,
        heldout * ARCSEC,
        "reading",
        seen,
        {"both" if few is not None else "inside": rms},
        rms_of(stands) * ARCSEC,
        Repeatability(error * ARCSEC, None),
        1.0 - float(np.sum(heldout**2)) / variance if variance > 0 else 0.0,
        [],
        closed_by_columns(effects, c),
        c.campaign.largest_torque_Nm if rated_Nm is None else rated_Nm,
        [],
        few,
    )


def runs_to_fit(campaign: Campaign, fit_on: Sequence[int | str] | None) -> BoolArray:
    """Mark the runs that are fitted; labels are compared as text."""
    if fit_on is None:
        return np.ones(len(campaign.runs), dtype=bool)
    labels = [str(run.label) for run in campaign.runs]
    for wanted in fit_on:
        if str(wanted) not in labels:
            raise InputError("--fit-on", str(wanted), "no such run", "one of " + ", ".join(labels))
    if not fit_on:
        raise InputError("--fit-on", "", "no run", "one or more of " + ", ".join(labels))
    wanted_labels = {str(wanted) for wanted in fit_on}
    seen = np.array([label in wanted_labels for label in labels])
    torque = np.concatenate(
        [run.torque_Nm for run, chosen in zip(campaign.runs, seen, strict=True) if chosen]
    )
    if np.ptp(torque) == 0:
        raise InputError("--fit-on", "", "runs of constant torque", "runs whose torque varies")
    return seen


def held_out_by(campaign: Campaign, seen: BoolArray) -> str:
    """Describe what was left out of the fit."""
    if not seen.all():
        return "runs not fitted"
    return "run" if len(campaign.runs) > 1 else "half of the run"
