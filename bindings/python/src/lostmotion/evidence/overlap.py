"""Overlap of blocks of columns after projection on the baseline model and the scatter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from lostmotion.evidence.gram import Evidence
from lostmotion.evidence.scatter import reduce

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]

RANK = 1e-7
"""Dimensions of a block below this share of its largest projected square are ignored."""


def projected(evidence: Evidence, names: list[str], omega: FloatArray) -> FloatArray:
    """Gram matrix of blocks after projection on baseline model and scatter."""
    index = evidence.index(*names)
    reduced = reduce(evidence, index, omega).matrix.sum(axis=0)
    n0 = evidence.fixed.size
    cross = reduced[n0:-1, :n0]
    h0 = reduced[:n0, :n0] + np.diag(evidence.ridge(index)[:n0])
    return np.asarray(reduced[n0:-1, n0:-1] - cross @ np.linalg.solve(h0, cross.T))


def absorbed_share(
    evidence: Evidence,
    omega: FloatArray,
    block: str,
    coefficients: FloatArray,
    places: IntArray,
) -> float:
    """Share of the mean square of a block that some of the fixed columns can absorb.

    Parameters
    ----------
    evidence : Evidence
    omega : ndarray
        Variances of the scattering columns.
    block : str
    coefficients : ndarray
        Of the block's scaled columns.
    places : ndarray
        The fixed columns, among those of the evidence.
    """
    kept = ~np.isin(evidence.fixed, places)
    freed = replace(
        evidence,
        fixed=evidence.fixed[kept],
        precision=evidence.precision[kept],
        blocks={block: evidence.blocks[block], "freed": places},
    )
    m = projected(freed, [block, "freed"], omega)
    n = evidence.blocks[block].size
    whole = float(coefficients @ m[:n, :n] @ coefficients)
    cross = m[n:, :n] @ coefficients
    taken = float(cross @ np.linalg.pinv(m[n:, n:], rcond=RANK, hermitian=True) @ cross)
    return taken / whole if whole > 0 else 1.0


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
