"""Evidence of a campaign without the columns of an error that its runs share.

The columns belong to one campaign: merged evidence would have those of all campaigns. The other
columns are projected off them, with their prior; every hypothesis then has the same likelihood as
with them in the model (Frisch-Waugh).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.evidence.gram import Evidence
from lostmotion.evidence.scatter import reduced_total


def without_shared(evidence: Evidence, shared: IntArray, omega: FloatArray) -> Evidence:
    """Project fixed columns that all runs share out of all other columns, and remove them.

    The shared columns' prediction, estimated from all runs together with their scatter, is
    subtracted from every column. The prior's part of the sums belongs to no run; it is divided
    evenly between the runs.

    Parameters
    ----------
    evidence : Evidence
    shared : ndarray
        Places of the shared columns, some of the fixed ones.
    omega : ndarray
        Variances of the scattering columns.
    """
    inner = np.concatenate((shared, evidence.scatter))
    others = np.setdiff1d(np.arange(evidence.scale.size), inner)
    total = reduced_total(evidence, np.concatenate((shared, others)), omega)
    own = slice(0, shared.size)
    prior = evidence.precision[np.searchsorted(evidence.fixed, shared)]
    predicted = np.linalg.solve(total[own, own] + np.diag(prior), total[own, shared.size :])
    change = np.eye(evidence.scale.size)
    change[np.ix_(shared, others)] = -predicted
    gram = np.einsum("ai,rab,bj->rij", change, evidence.gram, change, optimize=True)
    said = predicted.T @ (prior[:, None] * predicted) / evidence.runs
    gram[:, others[:, None], others] += said
    return without_columns(replace(evidence, gram=gram), shared)


def without_columns(evidence: Evidence, gone: IntArray) -> Evidence:
    """Remove some of the fixed columns."""
    keep = np.delete(np.arange(evidence.scale.size), gone)
    moved = np.full(evidence.scale.size, -1)
    moved[keep] = np.arange(keep.size)
    stays = ~np.isin(evidence.fixed, gone)
    return Evidence(
        evidence.gram[:, keep[:, None], keep],
        evidence.scale[keep],
        moved[evidence.fixed[stays]],
        moved[evidence.scatter],
        {name: moved[block] for name, block in evidence.blocks.items()},
        int(moved[evidence.response]),
        evidence.precision[stays],
    )
