"""Contours of the deformed rim and of the wave generator, in mm."""

from __future__ import annotations

import math

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.model import DesignModel
from lostmotion.report.mesh import make_mesh

CONTOUR_POINTS = 1440
"""Points of a wave generator: every quarter of a degree."""


def rim_contours(model: DesignModel) -> dict[str, FloatArray]:
    """Closed curves of the deformed rim and of the wave generator in the middle of the face.

    Returns
    -------
    dict of ndarray, shape (n, 2)
        ``neutral_line_deformed``; ``generator_seat``, the face of the rim that the wave generator
        presses; ``cam``, under the balls and races of the bearing (only cam and ellipse, and only
        if the curve has no cusp).
    """
    mesh = make_mesh(model)
    drive, lib = model.drive, model.core.lib
    seat = drive.flexspline.rim_thickness_mm / 2.0
    bearing = drive.support.ball_diameter_mm + 2.0 * drive.support.race_thickness_mm
    places = [mesh.place(a) for a in np.linspace(0.0, 2.0 * np.pi, CONTOUR_POINTS, endpoint=False)]
    outward = 1.0 if mesh.external else -1.0

    def offset(distance: float) -> FloatArray:
        return np.array(
            [
                _at(radius, polar) + outward * distance * _at(1.0, normal)
                for polar, radius, normal in places
            ]
        )

    found = {"neutral_line_deformed": offset(0.0), "generator_seat": offset(seat)}
    if drive.generator.type in (lib.LM_COSINE, lib.LM_ELLIPSE) and bearing > 0:
        found["cam"] = offset(seat + bearing)
    return found


def _at(radius: float, angle: float) -> FloatArray:
    return np.array([radius * math.sin(angle), radius * math.cos(angle)])
