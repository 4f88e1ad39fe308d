"""Runs that fall into two classes: a part of the base is another from one recording on.

A low polynomial cannot follow what sets in at a threshold, when a few quick runs at the end of a
channel are all that is beyond it. Every way of parting the runs along a channel is looked at; the
best one competes, and its test pays for all that were looked at.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from lostmotion.discover.base import DEVIATIONS, Base
from lostmotion.discover.candidates import Candidate
from lostmotion.discover.contest import Contest, reduce
from lostmotion.discover.shapes import usual_rates

FloatArray = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

SIDE_LEAST = 2
"""Runs on either side: what a single run does no other run can confirm."""


def run_channels(base: Base) -> dict[str, tuple[FloatArray, str]]:
    """Quantities that are one number for each run, and their units."""
    first = base.conditions.starts[:-1]
    return {
        "torque_rate": (usual_rates(base)[first], "Nm/s"),
        "run": (np.arange(base.conditions.runs, dtype=np.float64), ""),
    }


def partings(values: FloatArray) -> list[tuple[float, Mask]]:
    """Every threshold between different values, with the runs beyond it."""
    levels = np.unique(values)
    out = []
    for below, above in pairwise(levels.tolist()):
        beyond = values >= above
        if SIDE_LEAST <= np.count_nonzero(beyond) <= values.size - SIDE_LEAST:
            out.append((float(0.5 * (below + above)), beyond))
    return out


def scan(contest: Contest, part: int, masks: FloatArray) -> FloatArray:
    """Fall of the quadratic form by each parting of one scattering column."""
    e = contest.evidence
    index = np.concatenate((e.fixed, [e.scatter[part]], [e.response])).astype(np.intp)
    matrix = reduce(e, index, contest.null_omega).matrix
    n0 = e.fixed.size
    total = matrix.sum(axis=0)
    h0 = total[:n0, :n0] + np.diag(contest.ridge(e.index())[:n0])
    # Rows: the column of each parting against the base, itself and the residual.
    cross = masks @ matrix[:, n0, :n0]
    own = masks @ matrix[:, n0, n0]
    score = masks @ matrix[:, n0, -1] - cross @ np.linalg.solve(h0, total[:n0, -1])
    left = own - np.einsum("mi,mi->m", cross, np.linalg.solve(h0, cross.T).T)
    seen = left > 1e-9 * np.maximum(own, 1e-300)
    return np.where(seen, score**2 / np.where(seen, left, 1.0), 0.0)


def run_steps(base: Base, contest: Contest) -> list[Candidate]:
    """For each part of the base and each channel the parting of the runs that explains most."""
    c = base.conditions
    tangents = base.run_columns(base.at())
    out: dict[tuple[str, bytes], Candidate] = {}
    for channel, (values, unit) in run_channels(base).items():
        found = partings(values)
        if not found:
            continue
        masks = np.array([beyond for _, beyond in found], dtype=np.float64)
        for place, part in enumerate(DEVIATIONS):
            best = int(np.argmax(scan(contest, place, masks)))
            threshold, beyond = found[best]
            smaller = beyond if 2 * np.count_nonzero(beyond) <= c.runs else ~beyond
            key = (part, smaller.tobytes())
            where = (
                f"from run {c.labels[int(np.argmax(beyond))]} on"
                if channel == "run"
                else f"beyond {threshold:.3g} {unit}"
            )
            shape = f"{part}, a step {where}"
            if key in out:
                # Two channels that part the runs alike cannot be told apart.
                out[key].also.append((channel, shape))
                out[key].trials += len(found)
                continue
            out[key] = Candidate(
                f"step of {part} by {channel}",
                False,
                (tangents[:, place] * smaller[c.run_of])[:, None],
                channel,
                shape,
                trials=len(found),
            )
    return list(out.values())
