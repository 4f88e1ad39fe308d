"""Answers of ``predict`` and ``clearances``."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.callable_module import make_callable
from lostmotion.catalogue import PARTS
from lostmotion.drives import Drive
from lostmotion.errors import InputError, given_as
from lostmotion.idealisations import idealisations
from lostmotion.model import design_model, fitted_torsion_curve, reversal_torque, secant_stiffness
from lostmotion.results import data_frame, figures
from lostmotion.results.html_table import html_table
from lostmotion.sensitivity import hint_sentence, hints, sensitivities
from lostmotion.structs import without_effect
from lostmotion.units import ARCMIN

LIMITS = ("worst_min", "worst_max", "probable_min", "probable_max")
"""Names of the tolerance limits."""


def numbers(values: npt.ArrayLike) -> list[float | None]:
    """List numbers for JSON: values that are not finite become null, minus zero becomes zero."""
    return [float(v) + 0.0 if np.isfinite(v) else None for v in np.asarray(values).ravel()]


def show_default(value: bool | float | str) -> str:
    """Write a default value as in a drive file."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)


BEYOND = (
    "Angles at torques beyond {:.4g} Nm, the ratcheting torque of this drive, are those of teeth "
    "that do not ratchet: a real drive jumps there."
)
"""Remark on torques that the teeth cannot carry."""


class Prediction(dict[str, Any]):
    """Answer of `predict`, with its curves as a data frame and as a figure."""

    def curves_arcmin(self) -> dict[str, Any]:
        """Angles by name: total, contributions, and fitted curve."""
        curves = {"total": self["total_arcmin"], **self.get("parts_arcmin", {})}
        return {**curves, "fitted": self["fitted_arcmin"]} if "fitted_arcmin" in self else curves

    def to_dataframe(self) -> Any:
        """Return a pandas data frame with one row per torque; angles in arc minutes."""
        curves = {f"{name}_arcmin": angle for name, angle in self.curves_arcmin().items()}
        stiffness = {"stiffness_Nm_per_rad": self["stiffness_Nm_per_rad"]}
        return data_frame({"torque_Nm": self["torque_Nm"], **curves, **stiffness})

    def _repr_html_(self) -> str:
        curves = self.curves_arcmin()
        rows = [
            (f"{torque:g}", *(f"{curve[i]:.3f}" for curve in curves.values()))
            for i, torque in enumerate(self["torque_Nm"])
        ]
        head = ("torque, N m", *(f"{name.replace('_', ' ')}, arcmin" for name in curves))
        lost = self["reversal_lost_motion_arcmin"]
        lead = f"{self['drive']}: reversal lost motion {lost:.3f} arcmin"
        return html_table(head, rows, lead)

    def plot(self) -> Any:
        """Plot the torsion curve and its contributions (Plotly figure)."""
        axes = ("torque, N m", "angle, arcmin")
        return figures.curves(self["torque_Nm"], self.curves_arcmin(), self["drive"], axes)


def predict(drive: Drive, torque_Nm: npt.ArrayLike, phase_rad: float = 0.0) -> Prediction:
    """Return the torsion curve, its contributions and limits, and what changed dimensions give.

    Parameters
    ----------
    drive : Drive
    torque_Nm : array
        Rising.
    phase_rad : float
        Tooth phase of the wave generator; not used for catalogue drives.

    Raises
    ------
    InputError
        If there is no torque, or one that is not finite.
    """
    return _predict(drive, torque_Nm, phase_rad, with_changes=True)


def predict_as_drawn(drive: Drive, torque_Nm: npt.ArrayLike, phase_rad: float = 0.0) -> Prediction:
    """Return a prediction without ``hints`` and ``sensitivity``.

    These two require a hundred drives with changed dimensions.
    """
    return _predict(drive, torque_Nm, phase_rad, with_changes=False)


def _predict(
    drive: Drive, torque_Nm: npt.ArrayLike, phase_rad: float, *, with_changes: bool
) -> Prediction:
    given_as("predict", "drive", drive, Drive)
    given = np.asarray(torque_Nm, dtype=np.float64).ravel()
    if given.size == 0:
        raise InputError("predict", "torque_Nm", "no torque", "one or more")
    if not np.all(np.isfinite(given)):
        raise InputError("predict", "torque_Nm", f"{given[~np.isfinite(given)][0]}", "numbers")
    answer = Prediction(
        schema="lostmotion.prediction/1",
        drive=drive.name,
        kind="catalogue" if drive.catalogue is not None else "design",
        rated_torque_Nm=drive.rated_torque_Nm,
        torque_Nm=numbers(torque_Nm),
    )
    answer.update(
        _catalogue(drive, torque_Nm)
        if drive.catalogue
        else _design(drive, torque_Nm, phase_rad, with_changes)
    )
    add_fitted(answer, drive, torque_Nm)
    return answer


def add_fitted(answer: dict[str, Any], drive: Drive, torque_Nm: npt.ArrayLike) -> None:
    """Add the results of a fit to those of the data sheet or drawing."""
    fitted = fitted_torsion_curve(drive, float(np.max(np.abs(torque_Nm))))
    if fitted is None:
        return
    answer["fitted_arcmin"] = numbers(fitted(np.asarray(torque_Nm)) / ARCMIN)
    answer["assumptions"] = [
        *answer["assumptions"],
        "fitted is the torsion curve fitted to recordings, without friction and without "
        "effects; all other results follow from the data sheet or the drawing.",
    ]


def _catalogue(drive: Drive, torque_Nm: npt.ArrayLike) -> dict[str, Any]:
    sheet = drive.catalogue
    assert sheet is not None
    parts = sheet.parts(torque_Nm)
    at = reversal_torque(drive)
    bound = sheet.radial_gap_bound(drive.rated_torque_Nm)
    unknown = dict.fromkeys(LIMITS)
    return {
        "total_arcmin": numbers(sheet.angle(torque_Nm) / ARCMIN),
        "parts_arcmin": {part: numbers(parts[part] / ARCMIN) for part in PARTS},
        "stiffness_Nm_per_rad": numbers(sheet.stiffness(torque_Nm)),
        "secant_stiffness_Nm_per_rad": secant_stiffness(drive),
        "reversal_lost_motion_arcmin": sheet.reversal_lost_motion(at) / ARCMIN,
        "reversal_torque_Nm": at,
        "engaged_teeth_per_lobe": [None] * np.size(torque_Nm),
        "tolerance_um": unknown,
        "tolerance_lost_motion_arcmin": dict(unknown),
        "guaranteed_arcmin": {
            "hysteresis": None if sheet.hysteresis_rad is None else sheet.hysteresis_rad / ARCMIN,
            "lost_motion": None
            if sheet.lost_motion_rad is None
            else sheet.lost_motion_rad / ARCMIN,
        },
        "radial_gap_bound_arcmin": None if bound is None else bound / ARCMIN,
        "assumptions": sheet.assumptions(drive.rated_torque_Nm),
        "defaults": {},
    }


def _design(
    drive: Drive, torque_Nm: npt.ArrayLike, phase_rad: float, with_changes: bool
) -> dict[str, Any]:
    model = design_model(drive)
    found = model.torsion_curve(torque_Nm, phase_rad)
    at = reversal_torque(drive)
    limits = model.tolerance_limits()
    state = model.mesh_state(phase_rad)
    checks = model.checks()
    ratchets = next(check.value for check in checks if check.name == "ratcheting_torque")
    beyond = float(np.max(np.abs(torque_Nm))) > ratchets
    return {
        "total_arcmin": numbers(found.total_rad / ARCMIN),
        "parts_arcmin": {part: numbers(found.parts_rad[part] / ARCMIN) for part in PARTS},
        "stiffness_Nm_per_rad": numbers(found.stiffness_Nm_per_rad),
        "secant_stiffness_Nm_per_rad": secant_stiffness(drive),
        "reversal_lost_motion_arcmin": model.reversal_lost_motion(at, phase_rad) / ARCMIN,
        "reversal_torque_Nm": at,
        "engaged_teeth_per_lobe": [int(n) for n in found.engaged_teeth],
        "tolerance_um": {name: limits[name] * 1e3 for name in LIMITS},
        "tolerance_lost_motion_arcmin": {
            name: model.gap_angle(limits[name]) / ARCMIN for name in LIMITS
        },
        "reversal_lost_motion_by_tolerance_arcmin": {
            level: model.reversal_lost_motion(at, phase_rad, limits[f"{level}_max"]) / ARCMIN
            for level in ("worst", "probable")
        },
        "tolerance_budget": model.tolerance_budget(),
        "phase_rad": phase_rad,
        "free_play_arcmin": 2.0 * state["free_play_rad"] / ARCMIN,
        "flank_angle_rad": state["flank_angle_rad"],
        "gap_closing_torque_Nm": state["gap_torque_Nm"],
        "ratcheting_torque_Nm": ratchets,
        "checks": [
            {key: value for key, value in vars(check).items() if key != "meaning"}
            for check in checks
        ],
        "assumptions": [
            *([BEYOND.format(ratchets)] if beyond else []),
            *idealisations(model),
            "All angles except the reversal lost motion and the free play are one-sided: from the "
            "torque-free middle, in one direction.",
            "stiffness_Nm_per_rad is the tangent of the torsion curve at each torque; the "
            "objective stiffness of design is the secant from the torque of the reversal to the "
            "rated torque, here secant_stiffness_Nm_per_rad.",
            "tolerance_lost_motion is equation (9) in one direction, the radial gap alone; the "
            "objective tolerance_lost_motion of design is the whole reversal lost motion with that "
            "gap, here reversal_lost_motion_by_tolerance.",
            *without_effect(model.design, model.drive),
        ],
        **(_changes(drive, at) if with_changes else {}),
        "defaults": model.defaults(),
    }


def _changes(drive: Drive, reversal_Nm: float) -> dict[str, Any]:
    """Return what changed dimensions give."""
    return {
        "hints": [hint_sentence(hint) for hint in hints(drive)],
        "sensitivity": [vars(one) for one in sensitivities(drive, reversal_Nm)],
    }


ANGLE_DIGITS = 12
"""Decimals of an angle of a tooth in deg."""


class ClearanceTable(dict[str, Any]):
    """Answer of `clearances`, also as a data frame."""

    COLUMNS = ("section", "angle_deg", "forward_arcmin", "backward_arcmin", "contact_radius_mm")

    def to_dataframe(self) -> Any:
        """Return a pandas data frame with one row per tooth and axial section."""
        return data_frame({name: self[name] for name in (*self.COLUMNS, "overlap")})

    def _repr_html_(self) -> str:
        head = [name.replace("_", " ") for name in self.COLUMNS]
        rows = (
            ["" if value is None else f"{value:.6g}" for value in row]
            for row in zip(*(self[name] for name in self.COLUMNS), strict=True)
        )
        return html_table(head, rows, f"{self['drive']}: side clearances")


def clearances(
    drive: Drive, phase_rad: float = 0.0, angles_rad: npt.ArrayLike | None = None
) -> ClearanceTable:
    """Return the side clearances of every tooth, or at stated angles.

    Parameters
    ----------
    drive : Drive
        With a design.
    phase_rad : float
        Tooth phase of the wave generator.
    angles_rad : array, optional
        Angles from the deformation axis at which a tooth is to be placed.
    """
    given_as("clearances", "drive", drive, Drive)
    found = design_model(drive).clearances(phase_rad, angles_rad)
    radius = [
        np.where(r > 0, r, np.nan) for r in (found.forward_radius_mm, found.backward_radius_mm)
    ]
    answer = {
        "schema": "lostmotion.clearances/1",
        "drive": drive.name,
        "section": [int(section) for section in found.section],
        # Converted to rad and back, 30 deg is no longer exactly 30 and could not be looked up.
        "angle_deg": numbers(np.round(np.degrees(found.angle_rad), ANGLE_DIGITS)),
        "forward_arcmin": numbers(found.forward_rad / ARCMIN),
        "backward_arcmin": numbers(found.backward_rad / ARCMIN),
        "contact_radius_mm": numbers(radius[0]),
        "backward_contact_radius_mm": numbers(radius[1]),
        "overlap": [bool(overlap) for overlap in found.overlap],
    }
    return ClearanceTable(answer)


make_callable(__name__)
