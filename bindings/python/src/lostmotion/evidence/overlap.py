"""Overlap of blocks of columns after projection on the baseline model and the scatter."""

from __future__ import annotations

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.evidence.gram import Evidence
from lostmotion.evidence.scatter import reduced_total

RANK = 1e-7
"""Dimensions of a block below this share of its largest projected square are ignored."""


def projected(evidence: Evidence, names: list[str], omega: FloatArray) -> FloatArray:
    """Gram matrix of blocks after projection on baseline model and scatter."""
    index = evidence.index(*names)
    reduced = reduced_total(evidence, index, omega)
    n0 = evidence.fixed.size
    cross = reduced[n0:-1, :n0]
    h0 = reduced[:n0, :n0] + np.diag(evidence.ridge(index)[:n0])
    return np.asarray(reduced[n0:-1, n0:-1] - cross @ np.linalg.solve(h0, cross.T))


def principal_angles(evidence: Evidence, omega: FloatArray, a: str, b: str) -> FloatArray:
    """Principal angles between two blocks after projection, degrees, least first."""
    m = projected(evidence, [a, b], omega)
    na = evidence.blocks[a].size
    halves = []
    for part in (m[:na, :na], m[na:, na:]):
        value, vector = np.linalg.eigh(part)
        keep = value > RANK * max(float(value[-1]), 1e-300)
        halves.append(vector[:, keep] / np.sqrt(value[keep]))
    cosine = np.linalg.svd(halves[0].T @ m[:na, na:] @ halves[1], compute_uv=False)
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0))))
