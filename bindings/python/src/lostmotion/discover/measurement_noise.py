"""The measurement noise: the residual of the largest linear model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from lostmotion.discover.linearise import (
    columns_of,
)
from lostmotion.evidence.noise import Noise, fit_noise
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.point import Point

FloatArray = npt.NDArray[np.float64]

CALM_RIDGE = 1e-7
"""Relative ridge of the large least squares fit whose residual gives the noise."""


def leftover(
    base: BaselineModel, point: Point, blocks: Sequence[FloatArray]
) -> tuple[FloatArray, int]:
    """Residual of the largest linear model, which separates the noise from any effect."""
    fixed, _, scatter, _ = columns_of(base, point, form=False)
    residual = base.residual(point)
    parts = [fixed, scatter[:, :3], *blocks]
    total = sum(part.shape[1] for part in parts)
    x = np.empty((residual.size, total), order="F")
    at = 0
    for part in parts:
        x[:, at : at + part.shape[1]] = part
        at += part.shape[1]
    base.conditions.centre(x)
    norm = np.sqrt(np.einsum("ij,ij->j", x, x))
    norm[norm == 0] = 1.0
    x /= norm
    normal = x.T @ x
    normal[np.diag_indices(total)] += CALM_RIDGE
    return residual - x @ np.linalg.solve(normal, x.T @ residual), total


def estimate_noise(base: BaselineModel, blocks: Sequence[FloatArray]) -> Noise:
    """Estimate the noise model from the residual of the largest model."""
    rest, columns = leftover(base, base.at(), blocks)
    c = base.conditions
    return fit_noise(rest, c.time_s, c.starts, columns)
