"""The teeth of both gears with root fillets, as placed by the C library, in mm."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.report.gear_profiles import gear_profile
from lostmotion.report.mesh import Mesh
from lostmotion.report.svg import simplify


def flexspline_shape(
    mesh: Mesh, angles: Sequence[float], slack_mm: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Toothed edge of the flexspline over neighbouring teeth, and the free edge of its rim.

    Parameters
    ----------
    angles : sequence of float
        Of the teeth.
    slack_mm : float
        Largest deviation of the drawn outline of a tooth.

    Returns
    -------
    toothed, free : ndarray, shape (n, 2)
        Screen coordinates in mm, at growing angles.
    """
    outline = gear_profile(mesh, "flexspline").pitch() - [0.0, mesh.geometry.neutral_mm]
    outline = simplify(outline, slack_mm)
    toothed, free = [], []
    for angle in angles:
        polar, radius, normal = mesh.place(angle)
        toothed.append(_placed(outline, polar, radius, normal))
        for step in (-0.5, 0.0):
            polar, radius, normal = mesh.place(angle + step * mesh.pitch)
            free.append(_placed(np.array([[0.0, mesh.free_edge_mm]]), polar, radius, normal))
    return np.concatenate(toothed), np.concatenate(free)


def _placed(points: FloatArray, polar: float, radius: float, normal: float) -> FloatArray:
    across, along = points[:, 0], points[:, 1]
    x = radius * math.sin(polar) + along * math.sin(normal) + across * math.cos(normal)
    y = radius * math.cos(polar) + along * math.cos(normal) - across * math.sin(normal)
    return np.column_stack((x, y))


def rigid_shape(
    mesh: Mesh, angles: Sequence[float], slack_mm: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Toothed edge of the rigid gear around the same teeth, and an edge of its body."""
    pitch = 2.0 * math.pi / mesh.geometry.rigid_teeth
    profile = gear_profile(mesh, "rigid")
    outline = simplify(profile.pitch(), slack_mm)
    thick = 20.0 * mesh.geometry.module_mm  # outside every window
    ends = sorted((profile.root_mm, profile.tip_mm))
    body = ends[0] - thick if mesh.external else ends[1] + thick
    toothed, edge = [], []
    for angle in angles:
        at = mesh.rigid_axis(angle)
        toothed.append(_placed(outline, 0.0, 0.0, at))
        far = np.array([[0.0, body]])
        edge.append(_placed(far, 0.0, 0.0, at - pitch / 2))
        edge.append(_placed(far, 0.0, 0.0, at))
    return np.concatenate(toothed), np.concatenate(edge)
