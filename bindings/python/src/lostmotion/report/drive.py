"""Report section of a predicted drive: results, figures, tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lostmotion.allocation import cheapest_tolerances, features_of
from lostmotion.catalogue import PARTS
from lostmotion.drives import Drive
from lostmotion.model import ADVICE, Check, DesignModel, design_model, reversal_torque
from lostmotion.predict import LIMITS, predict_as_drawn, show_default
from lostmotion.report.contributions import Contributions, contributions_figure, picture_torques
from lostmotion.report.gaps import collect_gaps, gaps_figure
from lostmotion.report.page import Notes, PageTable, Section
from lostmotion.report.sources import file_fingerprint
from lostmotion.report.stages import collect_stages, stages_figure, stages_table
from lostmotion.report.svg import signs
from lostmotion.report.teeth import teeth_figure
from lostmotion.report.tolerances import Tolerances, tolerances_figure
from lostmotion.report.wording import with_zeros, words, written
from lostmotion.units import ARCMIN

CHECK_NAMES = {
    "form_radius": "mating tip stays on the involute (form radius)",
    "flexspline_tip_thickness": "tip thickness, flexspline",
    "rigid_tip_thickness": "tip thickness, rigid gear",
    "flexspline_root_clearance": "radial clearance at the flexspline's root",
    "rigid_root_clearance": "radial clearance at the rigid gear's root",
    "smallest_gap": "smallest side clearance, all angles, phases, flanks",
    "disengagement": "tips clear each other at 90°",
    "free_assembly": "undeformed flexspline slides in (advice)",
    "bending_stress": "bending stress of the rim",
    "torsion_stress": "shear stress of the cup wall",
    "safety_factor": "fatigue safety of the flexspline",
}


def drive_section(drive: Drive, phase_rad: float = 0.0) -> Section:
    """Describe the predicted behaviour: torsion curve, and for a design the geometry.

    Parameters
    ----------
    drive : Drive
    phase_rad : float
        Tooth phase of the wave generator; not used for catalogue drives.
    """
    bought = drive.catalogue is not None
    section = _catalogue_section(drive) if bought else _design_section(drive, phase_rad)
    section.sources.insert(0, (f"drive file {drive.file}", file_fingerprint(drive.file)))
    return section


def _contributions(drive: Drive, answer: dict[str, Any]) -> Contributions:
    engaged = answer["engaged_teeth_per_lobe"]
    return Contributions(
        drive.name,
        np.array(answer["torque_Nm"]),
        {part: np.array(answer["parts_arcmin"][part]) for part in PARTS},
        drive.rated_torque_Nm,
        reversal_torque(drive),
        None if engaged[0] is None else np.array(engaged),
        drive.catalogue,
    )


def _facts(data: Contributions, answer: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the main results common to catalogue and designed drives."""
    rated = data.rated_torque_Nm
    return [
        (
            f"reversal lost motion at ±{written(data.reversal_torque_Nm)} N·m",
            f"{answer['reversal_lost_motion_arcmin']:.3f} arcmin",
        ),
        (
            f"deflection at rated torque, {rated:g} N·m",
            f"{data.at(data.total_arcmin, rated):.3f} arcmin",
        ),
        (
            "stiffness at rated torque, tangent",
            f"{with_zeros(_at(answer, 'stiffness_Nm_per_rad', rated) / 1e3)}·10³ N·m/rad",
        ),
        (
            f"stiffness from {written(data.reversal_torque_Nm)} N·m to rated torque, secant",
            f"{with_zeros(answer['secant_stiffness_Nm_per_rad'] / 1e3)}·10³ N·m/rad",
        ),
    ]


def _at(answer: dict[str, Any], name: str, torque_Nm: float) -> float:
    """Value of a list of the answer at the torque nearest to one."""
    at = int(np.argmin(np.abs(np.array(answer["torque_Nm"]) - torque_Nm)))
    return float(answer[name][at])


def _catalogue_section(drive: Drive) -> Section:
    sheet = drive.catalogue
    assert sheet is not None
    ends = np.array([sheet.T1_Nm, sheet.T2_Nm])
    answer = predict_as_drawn(drive, picture_torques(drive.rated_torque_Nm, ends))
    data = _contributions(drive, answer)
    facts = _facts(data, answer)
    for name, key in (("hysteresis loss", "hysteresis"), ("lost motion", "lost_motion")):
        value = answer["guaranteed_arcmin"][key]
        if value is not None:
            facts.append((f"{name}, guaranteed by the manufacturer", f"≤ {value:g} arcmin"))
    return Section(
        drive.name,
        "A bought drive: the catalogue's stiffnesses in reduced form, without geometry.",
        facts,
        [
            contributions_figure(data),
            Notes("Assumptions of the catalogue model", list(map(_plain, answer["assumptions"]))),
        ],
    )


def _design_section(drive: Drive, phase_rad: float) -> Section:
    model = design_model(drive)
    answer = predict_as_drawn(drive, picture_torques(drive.rated_torque_Nm), phase_rad)
    data = _contributions(drive, answer)
    gaps = collect_gaps(model, drive.name, phase_rad)
    stages = collect_stages(model, drive.name, phase_rad)
    checks = model.checks()
    gap, angle, flank = gaps.smallest()
    rated = drive.rated_torque_Nm
    deciding = [check for check in checks if check.name not in ADVICE]
    failed = [check for check in deciding if check.margin < 0]
    facts = _facts(data, answer)
    facts += [
        (
            "teeth of a lobe that carry at rated torque and at twice that",
            f"{_at(answer, 'engaged_teeth_per_lobe', rated):.0f} and "
            f"{_at(answer, 'engaged_teeth_per_lobe', 2 * rated):.0f}",
        ),
        (
            signs(f"smallest side clearance ({flank}, at {angle:+.1f}°)"),
            signs(f"{gap:.3f} arcmin"),
        ),
        (
            "checks passed",
            f"{len(deciding) - len(failed)} of {len(deciding)}"
            + (
                f"; failed: {', '.join(c.name.replace('_', ' ') for c in failed)}" if failed else ""
            ),
        ),
    ]
    teeth = drive.design.values["teeth.flexspline_teeth"].value if drive.design else 0
    generator = drive.design.values["generator.type"].value if drive.design else ""
    section = Section(
        drive.name,
        f"A drive given by its drawing: {teeth} teeth on the flexspline, wave generator of type "
        f"“{generator}”, ratio {drive.ratio:g}, rated torque {rated:g} N·m.",
        facts,
        [
            contributions_figure(data),
            gaps_figure(gaps),
            teeth_figure(model, drive.name, stages.loaded(rated), phase_rad),
            stages_figure(stages),
            stages_table(stages),
            checks_table(checks),
        ],
    )
    if max(answer["tolerance_um"].values()) > 0:
        section.blocks.append(tolerances_figure(_tolerances(model, drive, answer)))
        section.blocks.append(tolerance_table(answer))
    else:
        said = (
            "The tolerances leave no radial gap, only interference: both limits are 0."
            if answer["tolerance_budget"]
            else "The drive file states neither tolerances nor a radial gap: both limits are 0."
        )
        section.blocks.append(Notes("Tolerance limits", [said]))
    if answer["tolerance_budget"]:
        section.blocks.append(budget_table(answer["tolerance_budget"]))
        if features_of(drive):
            section.blocks.append(allocation_table(cheapest_tolerances(drive)))
    section.blocks.append(
        Notes("Assumptions of the design model", list(map(_plain, answer["assumptions"])))
    )
    if answer["defaults"]:
        lines = [f"{key} = {show_default(value)}" for key, value in answer["defaults"].items()]
        section.blocks.append(
            Notes(f"Default values: {len(lines)} values that the file does not state", lines, True)
        )
    return section


def _plain(sentence: str) -> str:
    """Write a sentence about the answer without the names of its keys."""
    for name in (*PARTS, "reversal_lost_motion_by_tolerance", "tolerance_lost_motion"):
        sentence = sentence.replace(name, words(name))
    return sentence[:1].upper() + sentence[1:]


def _tolerances(model: DesignModel, drive: Drive, answer: dict[str, Any]) -> Tolerances:
    mean = float(model.core.lib.lm_mean_radial_gap(model.drive))
    return Tolerances(
        drive.name, answer["tolerance_um"], 1e3 * mean, model.gap_angle(1e-3) / ARCMIN
    )


def tolerance_table(answer: dict[str, Any]) -> PageTable:
    """List the tolerance limits."""
    gap, lost = answer["tolerance_um"], answer["tolerance_lost_motion_arcmin"]
    names = dict(zip(LIMITS, ("least", "greatest") * 2, strict=True))
    rows = [
        (
            "worst case, eq. (10), (11)" if key.startswith("worst") else "probable, 99.73 %",
            names[key],
            f"{gap[key]:.2f}",
            f"{lost[key]:.3f}",
        )
        for key in LIMITS
    ]
    return PageTable(
        "Tolerance limits",
        ("limit", "", "radial gap, µm", "lost motion in one direction, arcmin"),
        rows,
        (2, 3),
    )


def budget_table(budget: Sequence[dict[str, Any]]) -> PageTable:
    """List the tolerances with their shares in the limits."""
    rows = [
        (
            link["name"],
            link["zone"],
            signs(f"{link['influence']:+.3f}"),
            signs(f"{link['lower_um']:.1f}"),
            signs(f"{link['upper_um']:.1f}"),
            f"{link['worst_percent']:.1f}",
            f"{link['probable_percent']:.1f}",
        )
        for link in budget
    ]
    return PageTable(
        "Tolerance budget",
        ("tolerance", "zone", "influence", "lower, µm", "upper, µm", "worst, %", "probable, %"),
        rows,
        (2, 3, 4, 5, 6),
        "Shares of the width of the chain before a zone is clipped at zero: of the sum for the "
        "worst case, of the sum of squares for the probable limits.",
    )


def allocation_table(found: Mapping[str, Any]) -> PageTable:
    """List the cheapest grades and those of the file."""
    rows = [
        (
            feature["name"],
            feature["now"],
            feature["cheapest"],
            f"{feature['field_now_um']:.1f}",
            f"{feature['field_um']:.1f}",
            f"{feature['cost_now']:.2f}",
            f"{feature['cost']:.2f}",
        )
        for feature in found["features"]
    ]
    return PageTable(
        "Cheapest grades for the same lost motion",
        ("feature", "now", "cheapest", "field now, µm", "field, µm", "cost now", "cost"),
        rows,
        (3, 4, 5, 6),
        f"Reversal lost motion {found['now_arcmin']:.3f} arcmin now, "
        + f"{found['then_arcmin']:.3f} arcmin with these grades, probable limits; cost "
        + f"{found['cost_now']:.2f} now, {found['cost_then']:.2f} then, in units of one feature at "
        + "grade 7: weight times the field at grade 7 over the field (reciprocal cost law). "
        + "lostmotion predict --target finds the grades for another lost motion.",
    )


def checks_table(checks: Sequence[Check]) -> PageTable:
    """List the checks of a design with their margins; pass and fail by word and sign."""
    rows = []
    for check in checks:
        unit, value, limit, margin = check.shown()
        digits = {"arcmin": 4, "MPa": 1}.get(unit, 3)
        passed = check.margin >= 0
        word = "✓ pass" if passed else ("– no (advice)" if check.name in ADVICE else "!✗ FAIL")
        smaller = check.margin != check.value - check.limit
        rows.append(
            (
                CHECK_NAMES.get(check.name, check.name.replace("_", " ")),
                signs(f"{value:.{digits}f}"),
                ("≤ " if smaller else "≥ ") + signs(f"{limit:.{digits}f}"),
                signs(f"{margin:+.{digits}f}"),
                unit,
                word,
            )
        )
    return PageTable(
        "Checks",
        ("check", "value", "limit", "margin", "unit", "result"),
        rows,
        (1, 2, 3),
        "The margin is the distance to the limit; below zero the check fails.",
    )
