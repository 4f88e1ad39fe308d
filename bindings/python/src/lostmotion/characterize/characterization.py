"""The characterization of a drive: standard figures and a drive file from recordings alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.catalogue import REVERSAL_TORQUE_SHARE, Catalogue
from lostmotion.characterize.backlash import Backlash, find_backlash
from lostmotion.characterize.figures import (
    LOST_MOTION_SHARES,
    LOST_MOTION_WINDOW,
    Estimate,
    curve_figures,
    hysteresis_loss,
    lost_motion,
    none,
)
from lostmotion.characterize.loop_regression import errors_from
from lostmotion.characterize.printed import NAMES, cells, flat
from lostmotion.characterize.stretches import FEW_READINGS, Loops, Samples, collect, find_loops
from lostmotion.characterize.three_slopes import (
    CurveFit,
    developed,
    falls_enough,
    fit_slopes,
    values_carried,
)
from lostmotion.drives import Drive, FreePlay, parse_drive
from lostmotion.errors import InputError, given_as
from lostmotion.recordings import Campaign, Protocol, say_findings
from lostmotion.recordings.gate import check_encoders
from lostmotion.recordings.protocol import FREE
from lostmotion.results import data_frame
from lostmotion.results import figures as charts
from lostmotion.results.html_table import html_table
from lostmotion.threads import one_thread
from lostmotion.units import ARCMIN, ARCSEC

SCHEMA = "lostmotion.characterization/1"

RATIO_UNKNOWN = 100.0
"""Ratio in a drive file if it is unknown. Recordings of the lost motion do not use it."""

AMPLITUDE_SLACK = 0.1
"""Loops whose amplitude differs from the rated torque by more than this share are not loops to the
rated torque.
"""

COARSE_SHARE = 0.1
"""Share of the range of the lost motion above which the steps of an encoder are coarse: rounding
alone is then 3 % of it.
"""

CURVE_POINTS = 241
"""Points of the mean curve that are drawn."""

CURVE = ("T1", "K1", "T2", "K2", "K3")
"""The torsion curve, in the order of a catalogue."""


@dataclass
class StandardFigures:
    """The figures of a catalogue, of measured or of modelled loops.

    Attributes
    ----------
    curve : dict
        ``T1``, ``K1``, ``T2``, ``K2``, ``K3`` in N m and N m/rad.
    lost_motion : dict
        By the share of the rated torque, in rad.
    hysteresis_loss : Estimate
        In rad, after swings to the tips of the loops.
    backlash : Backlash
    fit : CurveFit or None
        The fitted curve; None if the loops have none.
    samples : Samples
    """

    rated_torque_Nm: float
    curve: dict[str, Estimate]
    lost_motion: dict[float, Estimate]
    hysteresis_loss: Estimate
    backlash: Backlash
    fit: CurveFit | None
    samples: Samples

    def answer(self) -> dict[str, Any]:
        """Return the figures ready for JSON: N m, N m/rad and arc minutes."""
        curve = {
            f"{name}_{'Nm' if name.startswith('T') else 'Nm_per_rad'}": self.curve[name].answer()
            for name in CURVE
        }
        lost = {
            f"lost_motion_{share * 100:.0f}_percent_arcmin": {
                "torque_Nm": share * self.rated_torque_Nm,
                **found.answer(ARCMIN),
            }
            for share, found in self.lost_motion.items()
        }
        backlash = self.backlash.figure.answer(ARCMIN)
        if self.backlash.none_above_rad is not None:
            backlash["none_above"] = self.backlash.none_above_rad / ARCMIN
        return {
            "torsion_curve": curve,
            **lost,
            "hysteresis_loss_arcmin": {
                "swing_Nm": [self.samples.low_Nm, self.samples.high_Nm],
                **self.hysteresis_loss.answer(ARCMIN),
            },
            "backlash_arcmin": backlash,
        }


def sheet_figures(sheet: Catalogue, rated_torque_Nm: float) -> dict[str, float | None]:
    """Figures of a data sheet by the keys of an answer; lost motion is that of its curve."""
    lost = {
        f"lost_motion_{share * 100:.0f}_percent_arcmin": sheet.reversal_lost_motion(
            share * rated_torque_Nm
        )
        / ARCMIN
        for share in LOST_MOTION_SHARES
    }
    loss = sheet.hysteresis_rad
    return {
        "T1_Nm": sheet.T1_Nm,
        "K1_Nm_per_rad": sheet.K1_Nm_per_rad,
        "T2_Nm": sheet.T2_Nm,
        "K2_Nm_per_rad": sheet.K2_Nm_per_rad,
        "K3_Nm_per_rad": sheet.K3_Nm_per_rad,
        **lost,
        "hysteresis_loss_arcmin": None if loss is None else loss / ARCMIN,
    }


def standard_figures(
    campaign: Campaign,
    rated_torque_Nm: float,
    angle_rad: FloatArray | None = None,
    loops: Loops | None = None,
) -> StandardFigures:
    """Find the figures of the largest loops of a campaign.

    Parameters
    ----------
    campaign : Campaign
    rated_torque_Nm : float
        Rated torque; lost motion is given at shares of it.
    angle_rad : ndarray, optional
        Angles of all rows to use instead of the lost motion: those of a model at these torques.
    loops : Loops, optional
        Result of `find_loops`.
    """
    with one_thread():  # small matrices
        loops = find_loops(campaign) if loops is None else loops
        return _standard_figures(campaign, rated_torque_Nm, angle_rad, loops)


def _standard_figures(
    campaign: Campaign, rated_torque_Nm: float, angle_rad: FloatArray | None, loops: Loops
) -> StandardFigures:
    samples = collect(campaign, angle_rad, loops=loops)
    torques = {share: share * rated_torque_Nm for share in LOST_MOTION_SHARES}
    fit, curve = fit_torsion_curve(samples)
    if fit is None:
        return StandardFigures(
            rated_torque_Nm,
            curve,
            dict.fromkeys(torques, curve["K1"]),
            curve["K1"],
            Backlash(curve["K1"]),
            None,
            samples,
        )
    steady = developed(samples)
    backlash = find_backlash(steady, fit.slopes_rad_per_Nm.size)
    if backlash.fit is not None:
        fit = backlash.fit
        curve = named_curve(fit, samples)
    return StandardFigures(
        rated_torque_Nm,
        curve,
        {
            share: lost_motion(
                collect(campaign, angle_rad, LOST_MOTION_WINDOW * torque, loops), torque, fit
            )
            for share, torque in torques.items()
        },
        hysteresis_loss(samples, fit),
        backlash,
        fit,
        samples,
    )


def fit_torsion_curve(samples: Samples) -> tuple[CurveFit | None, dict[str, Estimate]]:
    """Fit as many slopes as the loops identify, at most three."""
    most = values_carried(samples) if samples.torque_Nm.size else 0
    if most == 0:
        why = none(f"{samples.readings} readings on loops are too few for a slope and a width")
        return None, dict.fromkeys(CURVE, why)
    steady = developed(samples)
    fit = fit_slopes(steady, 1)
    if samples.readings < FEW_READINGS:
        for slopes in range(2, most + 1):
            found = fit_slopes(steady, slopes)
            if not falls_enough(steady, fit, found):
                break
            fit = found
        return fit, named_curve(fit, samples)
    for slopes in range(most, 1, -1):
        found = fit_slopes(steady, slopes)
        if found.kinks_shown() and np.all(found.slopes_rad_per_Nm > 0):
            fit = found
            break
    return fit, named_curve(fit, samples)


def named_curve(fit: CurveFit, samples: Samples) -> dict[str, Estimate]:
    """Name the slopes and kinks of a curve, and state the reasons why others are missing."""
    found = curve_figures(fit)
    count = fit.slopes_rad_per_Nm.size
    reach = f"up to {samples.amplitude_Nm:.4g} N m"
    why = none(f"the loops show {count} slope{'s' * (count > 1)} {reach}, not three")
    return {name: found.get(name, why) for name in CURVE}


@dataclass
class Characterization:
    """Result of `characterize`; `answer` returns it for JSON, `document` as a drive file."""

    name: str
    ratio: float | None
    ratio_from: str
    rated_torque_Nm: float
    rated_torque_from: str
    figures: StandardFigures
    campaign: Campaign
    drive: Drive | None = None
    mapping: Mapping[str, str] = field(default_factory=dict)
    protocol: Protocol = FREE

    def __repr__(self) -> str:
        """Summarise the result."""
        loops = self.figures.samples.loops
        return f"<Characterization of {self.name!r}: {loops} loop{'s' * (loops != 1)}>"

    def to_dataframe(self) -> Any:
        """Return a pandas data frame with one row per standard figure."""
        known = flat(self.answer())
        keys = ("value", "standard_error", "interval_95", "reason")
        columns = {key: [one.get(key) for one in known.values()] for key in keys}
        return data_frame({"figure": list(known), **columns})

    def _repr_html_(self) -> str:
        rows = [(NAMES[key], *cells(one)[:2]) for key, one in flat(self.answer()).items()]
        return html_table(("figure", "value", "standard error"), rows, repr(self))

    def loop_angles_rad(self) -> FloatArray:
        """Angles of the loops about the zero of the mean curve."""
        samples, fit = self.figures.samples, self.figures.fit
        if fit is None:
            raise InputError("characterize", "", "no mean curve", "loops that pass through zero")
        left = samples.angle_rad - fit.angle(samples.torque_Nm)
        # Both branches count equally in the middle of a loop, however long each is.
        balance = np.zeros(samples.loops)
        for loop in range(samples.loops):
            here = samples.loop == loop
            means = [
                float(left[here & (samples.falling == side)].mean())
                for side in (1.0, -1.0)
                if np.any(here & (samples.falling == side))
            ]
            balance[loop] = float(np.mean(means))
        return np.asarray(samples.angle_rad - balance[samples.loop])

    def plot(self) -> Any:
        """Plot the loops and their mean curve (Plotly figure)."""
        samples, angle = self.figures.samples, self.loop_angles_rad() / ARCMIN
        fit = self.figures.fit
        assert fit is not None
        parts = [samples.stretch == stretch for stretch in np.unique(samples.stretch)]
        torque = np.linspace(samples.low_Nm, samples.high_Nm, CURVE_POINTS)
        branches = [(samples.torque_Nm[at], angle[at]) for at in parts]
        return charts.mean_curve(branches, torque, fit.angle(torque) / ARCMIN)

    def assumptions(self) -> list[str]:
        """List the assumptions of the figures and of the drive file, one sentence each."""
        samples, fit = self.figures.samples, self.figures.fit
        lines = [
            "The torsion curve is the mean of the rising and the falling branch about the middle "
            "of each loop, made antisymmetric.",
            {
                "loops": f"Standard errors are from {samples.loops} loops, leaving out one at a "
                "time: they include the differences between loops.",
                "pieces of loops": f"Standard errors are from pieces of {samples.loops} "
                f"loop{'s' * (samples.loops > 1)}: they do not include the differences between "
                "loops.",
                "readings": "Standard errors assume independent readings and a loop width that "
                "does not depend on the torque.",
            }[errors_from(samples)],
        ]
        if self.rated_torque_from == ASSUMED_RATED:
            lines.append(
                f"The rated torque is not stated: {self.rated_torque_Nm:.4g} N m, the largest "
                "torque of the loops, is used instead."
            )
        if self.ratio is None:
            lines.append(
                f"The ratio is not stated and cannot be found from these recordings: "
                f"{RATIO_UNKNOWN:g} is written to the drive file; recordings of the lost motion do "
                "not use it."
            )
        elif self.ratio_from == ESTIMATED_RATIO:
            lines.append(
                f"The ratio is not stated: {abs(self.ratio):.6g} input turns for one output turn, "
                "by regression over the runs that turn; lost motion proportional to the rotation "
                "is included in it."
            )
        if fit is not None and fit.kinks_Nm.size < 2:
            lines.append(
                f"Beyond {samples.amplitude_Nm:.4g} N m the drive file continues with the last "
                "slope of the loops."
            )
        if fit is not None and self.figures.curve["K1"].value is None:
            stiffness = 1.0 / float(fit.slopes_rad_per_Nm[0])
            lines.append(
                f"K1 in the drive file, {stiffness:.3g} N m/rad, is the slope of the loops, which "
                "is not that of the torsion curve alone."
            )
        step = self.input_step_rad()
        if step is not None:
            lines.append(
                f"The input angle has steps of {step / ARCMIN:.3g} arcmin at the output: they are "
                "a large part of the lost motion and limit the accuracy of the figures."
            )
        if not samples.history_known:
            lines.append("No section starts at a tip of a loop: the load history is unknown.")
        if fit is not None and self._other_amplitude():
            lines.append(
                f"The hysteresis loss is that of loops to {samples.amplitude_Nm:.4g} N m, not to "
                f"the rated torque of {self.rated_torque_Nm:.4g} N m."
            )
        return lines

    def input_step_rad(self) -> float | None:
        """Resolution of the input encoder at the output if it is coarse, else None.

        Coarse means above `COARSE_SHARE` of the range of the lost motion.
        """
        ratio = self.ratio
        if ratio is None or "input_angle" not in self.campaign.quantities():
            return None
        swing = max(float(np.ptp(run.lost_motion_rad)) for run in self.campaign.runs)
        levels = np.unique(self.campaign.column("input_angle"))
        if levels.size < 2:
            return None
        step = float(np.median(np.diff(levels))) / abs(ratio)
        return step if step > COARSE_SHARE * swing else None

    def _other_amplitude(self) -> bool:
        share = self.figures.samples.amplitude_Nm / self.rated_torque_Nm
        return abs(share - 1.0) > AMPLITUDE_SLACK

    def sheet(self) -> dict[str, float | None] | None:
        """Figures of the drive's catalogue, by the keys of the answer; None without one."""
        sheet = None if self.drive is None else self.drive.catalogue
        return None if sheet is None else sheet_figures(sheet, self.rated_torque_Nm)

    def answer(self) -> dict[str, Any]:
        """Return the answer of the command, ready for JSON."""
        samples, fit = self.figures.samples, self.figures.fit
        return {
            "schema": SCHEMA,
            "drive": self.name,
            "ratio": self.ratio,
            "ratio_from": self.ratio_from,
            "rated_torque_Nm": self.rated_torque_Nm,
            "rated_torque_from": self.rated_torque_from,
            **self.figures.answer(),
            "rms_arcsec": None if fit is None else fit.rms_rad / ARCSEC,
            "standard_errors_from": errors_from(samples),
            "degrees_of_freedom": None if fit is None else fit.dof,
            "loading_rate_Nm_per_s": samples.rate_Nm_per_s,
            "torque_range_Nm": [samples.low_Nm, samples.high_Nm],
            "loops": samples.loops,
            "runs": samples.runs,
            "samples": samples.readings,
            "samples_left_out": samples.left_out,
            "sheet": self.sheet(),
            "assumptions": self.assumptions(),
            "findings": say_findings(self.campaign.findings),
            "data_fingerprint": self.campaign.fingerprint(),
        }

    def document(self, file: str = "drive") -> dict[str, Any]:
        """Tables of a drive file with these figures, for all commands.

        Raises
        ------
        InputError
            If the loops have no curve, or an impossible one.
        """
        fit, figures = self.figures.fit, self.figures
        if fit is None:
            raise InputError(
                self.campaign.runs[0].file,
                "",
                figures.curve["K1"].reason,
                "loops, or more readings",
            )
        # With fewer than three slopes the last one continues; added kinks do not change the curve.
        stiffness = [float(1.0 / slope) for slope in fit.slopes_rad_per_Nm]
        kinks = [float(kink) for kink in fit.kinks_Nm]
        reach = figures.samples.amplitude_Nm
        while len(kinks) < 2:
            kinks.append(reach / 2.0 if not kinks else max(reach, 2.0 * kinks[0]))
            stiffness.append(stiffness[-1])
        catalogue = {
            "T1_Nm": kinks[0],
            "T2_Nm": kinks[1],
            **{f"K{i + 1}_Nm_per_rad": value for i, value in enumerate(stiffness)},
        }
        for key, found in (
            ("hysteresis_arcmin", figures.hysteresis_loss),
            ("lost_motion_arcmin", figures.lost_motion[REVERSAL_TORQUE_SHARE]),
        ):
            if found.value is not None and found.value >= 0:
                catalogue[key] = found.value / ARCMIN
        errors = {
            f"{name}_{'Nm' if name.startswith('T') else 'Nm_per_rad'}": found.standard_error
            for name, found in figures.curve.items()
            if found.standard_error is not None
        }
        document: dict[str, Any] = {
            "drive": {
                "name": self.name,
                "ratio": RATIO_UNKNOWN if self.ratio is None else self.ratio,
                "rated_torque_Nm": self.rated_torque_Nm,
            },
            "catalogue": catalogue,
            "characterization": {
                "data_fingerprint": self.campaign.fingerprint(),
                "loops": figures.samples.loops,
                "samples": figures.samples.readings,
                "assumptions": self.assumptions(),
                "standard_errors": errors,
            },
        }
        if self.mapping:
            document["columns"] = dict(self.mapping)
        if self.protocol != FREE:
            document["recordings"] = {
                "locked": self.protocol.locked,
                "torque_constant_Nm_per_A": self.protocol.torque_constant_Nm_per_A,
            }
            document["recordings"] = {
                key: value for key, value in document["recordings"].items() if value is not None
            }
        if fit.takeup_Nm > 0:
            document["effect"] = [FreePlay(fit.step_rad, fit.takeup_Nm).table()]
        parse_drive(document, file)
        return document


ASSUMED_RATED = "largest torque of the loops"
ESTIMATED_RATIO = "runs that turn"
STATED = "stated"
DRIVE_FILE = "drive file"
NOT_NEEDED = "not known"
"""Where the ratio and the rated torque come from."""


def characterize(
    drive: Drive | Campaign | None,
    campaign: Campaign | None = None,
    *,
    ratio: float | None = None,
    ratio_from: str = STATED,
    rated_torque_Nm: float | None = None,
    name: str | None = None,
    mapping: Mapping[str, str] | None = None,
    protocol: Protocol = FREE,
) -> Characterization:
    """Find the standard figures of a drive from its recordings alone.

    Parameters
    ----------
    drive : Drive, optional
        Drive for comparison with these figures. It may be left out: ``characterize(campaign)``.
    campaign : Campaign
        With torque loops of one amplitude or several; the largest are used.
    ratio : float, optional
        Signed; only for the drive file.
    ratio_from : str
        Where the ratio comes from.
    rated_torque_Nm : float, optional
        By default that of `drive`, else the largest torque of the loops.
    name : str, optional
        Of the drive.
    mapping, protocol : optional
        Column map and protocol with which the recordings were read, for the drive file.

    Returns
    -------
    Characterization

    Raises
    ------
    InputError
        If torque or lost motion is constant, or the lost motion falls with increasing torque.
    """
    if campaign is None and isinstance(drive, Campaign):
        drive, campaign = None, drive
    if drive is not None:
        given_as("characterize", "drive", drive, Drive)
        assert isinstance(drive, Drive)
    given_as("characterize", "campaign", campaign, Campaign)
    assert campaign is not None
    campaign.require_variation()
    if ratio is None and drive is not None:
        ratio, ratio_from = drive.ratio, DRIVE_FILE
    check_encoders(campaign, ratio)
    rated_from = STATED
    if rated_torque_Nm is None and drive is not None:
        rated_torque_Nm, rated_from = drive.rated_torque_Nm, DRIVE_FILE
    if rated_torque_Nm is None:
        samples = collect(campaign)
        rated_torque_Nm, rated_from = max(samples.high_Nm, -samples.low_Nm), ASSUMED_RATED
    figures = standard_figures(campaign, rated_torque_Nm)
    if figures.fit is not None and np.any(figures.fit.slopes_rad_per_Nm <= 0):
        slope = float(np.min(figures.fit.slopes_rad_per_Nm))
        raise InputError(
            campaign.runs[0].file,
            "lost_motion_rad",
            f"a mean curve that falls with increasing torque ({slope / ARCMIN:.3g} arcmin per N m)",
            "a rising one; reverse the sign of a column with --map COLUMN=-NAME_UNIT, or check the "
            "ratio",
        )
    found_name = name or (drive.name if drive is not None else campaign.runs[0].file)
    return Characterization(
        found_name,
        ratio,
        NOT_NEEDED if ratio is None else ratio_from,
        rated_torque_Nm,
        rated_from,
        figures,
        campaign,
        drive,
        dict(mapping or {}),
        protocol,
    )
