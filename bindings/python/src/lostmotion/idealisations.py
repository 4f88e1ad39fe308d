"""What the verdict on a design rests on, in sentences that stand beside it."""

from __future__ import annotations

from lostmotion.model import DesignModel


def idealisations(model: DesignModel) -> list[str]:
    """List the idealisations of a design's checks and figures."""
    drive = model.drive
    return [
        (
            "Planar only, as the drive file asks: the checks see the middle of the face alone, as "
            "if the flexspline were no cup."
            if drive.planar_only
            else "The checks see both edges of the face and its middle; the deflection grows in "
            "proportion to the distance from the bottom of the cup."
        ),
        (
            "The middle of the face carries the load (axial_sections = 1)."
            if model.sections == 1
            else f"{model.sections} axial sections share the load."
        ),
    ]
