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
    free = np.array([[0.0, mesh.free_edge_mm]])
    halves = [angle + step * mesh.pitch for angle in angles for step in (-0.5, 0.0)]
    return (
        _placed(outline, [mesh.place(angle) for angle in angles]),
        _placed(free, [mesh.place(angle) for angle in halves]),
    )


def _placed(points: FloatArray, places: Sequence[tuple[float, float, float]]) -> FloatArray:
    """Place points at several places, one after the other.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Across and along the axis of a tooth.
    places : sequence of (float, float, float)
        Polar angle and radius of the foot of the axis, and its direction.
    """
    across, along = points[:, 0], points[:, 1]
    polar, radius, direction = np.array(places).T[:, :, None]
    c, s = np.cos(direction), np.sin(direction)
    x = radius * np.sin(polar) + along * s + across * c
    y = radius * np.cos(polar) + along * c - across * s
    return np.stack((x, y), axis=-1).reshape(-1, 2)


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
    axes = [mesh.rigid_axis(angle) for angle in angles]
    halves = [axis + step * pitch for axis in axes for step in (-0.5, 0.0)]
    return (
        _placed(outline, [(0.0, 0.0, axis) for axis in axes]),
        _placed(np.array([[0.0, body]]), [(0.0, 0.0, axis) for axis in halves]),
    )
