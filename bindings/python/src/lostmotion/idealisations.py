"""Idealisations on which the verdict on a design rests, in sentences."""

from __future__ import annotations

from lostmotion.model import DesignModel


def idealisations(model: DesignModel) -> list[str]:
    """List the idealisations of a design's checks and figures."""
    drive = model.drive
    return [
        (
            "Planar only, as the drive file requests: the checks examine only the middle of the "
            "face and neglect the coning of the cup."
            if drive.planar_only
            else "The checks examine the whole face width, the load checks its edges and its "
            "middle; the deflection grows in proportion to the distance from the bottom of the cup."
        ),
        (
            "The middle of the face carries the load (axial_sections = 1)."
            if model.sections == 1
            else f"{model.sections} axial sections share the load."
        ),
        (
            "The rim rests on a foundation that is equal under all teeth, as the drive file states."
            if drive.support.foundation_N_per_mm2 > 0
            else "The rim is a thin ring on the supports of the wave generator, which act in both "
            "directions; one ball is on the deformation axis."
        ),
        *model.design.remarks,
        *interference(model),
        *uneven_load(model),
        (
            "The ratcheting torque is extrapolated from the deflection at rated torque, and "
            "depends on it."
        ),
        *(
            []
            if is_calibrated(model)
            else [
                "Uncalibrated (support.ring_factor = 1): torsion curves of manufacturers, sizes 14 "
                f"to 65, have {CATALOGUE_OVER_MODEL[0]:g} to {CATALOGUE_OVER_MODEL[1]:g} times "
                "these angles."
            ]
        ),
    ]


def uneven_load(model: DesignModel) -> list[str]:
    """State how unevenly the face carries the load of which the checks use the mean.

    A section is wide, so that the stress at its edge is larger still.
    """
    drive = model.drive
    sections = int(model.core.lib.lm_face_sections(drive))
    share = model.section_share()
    return [
        "Stresses of flanks and roots are means over the face. "
        + (
            "It carries the load evenly in the planar model."
            if sections == 1
            else f"Of its {sections} sections one carries {100 * share:.0f} % of the load at rated "
            f"torque: the stresses there are at least {sections * share:.1f} times the means."
        )
    ]


def interference(model: DesignModel) -> list[str]:
    """State that an interference fit counts as no gap, for each zone in which there can be one."""
    least = {"generator": model.drive.gap.generator_mm, "teeth": model.drive.gap.teeth_mm}
    for link in model.tolerance_budget():
        ends = [link["influence"] * link[f"{end}_um"] / 1e3 for end in ("lower", "upper")]
        least[link["zone"]] += min(ends)
    return [
        f"Interference of up to {-1e3 * gap:.3g} um by the tolerances of zone '{zone}' counts as "
        "no gap: the pressure of the fit changes neither stresses nor stiffness here."
        for zone, gap in least.items()
        if round(gap, 9) < 0
    ]


CATALOGUE_OVER_MODEL = (1.15, 1.75)
"""Catalogue angles at T1 and T2 over those of textbook drives with a cam.

Sizes 14, 20, 40 and 65 at ratio 100, size 20 at 50 and 30 (tests/python/test_idealisations.py).
"""


def is_calibrated(model: DesignModel) -> bool:
    """Whether a figure of the supports was fitted to a measurement or a data sheet."""
    return bool(model.drive.support.ring_factor != 1.0)
