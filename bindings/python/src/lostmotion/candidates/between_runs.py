"""Differences between runs: two classes of runs, or a steady drift of a part of the baseline model.

A polynomial of low order cannot represent a change at a threshold if only a few runs at the end of
a channel are beyond it. Therefore every split of the runs along a channel is examined; the best one
competes, and its test is corrected for the number examined. For a drift, most terms of a polynomial
are unused curvature, for which a few runs give too few degrees of freedom.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray
from lostmotion.candidates.candidate import Candidate
from lostmotion.candidates.shapes import usual_rates
from lostmotion.evidence.contest import Contest
from lostmotion.evidence.scatter import reduce
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.deviations import DEVIATIONS


def run_channels(base: BaselineModel) -> dict[str, tuple[FloatArray, str]]:
    """Quantities with one value per run, and their units."""
    rates = usual_rates(base)[base.conditions.starts[:-1]]
    return {
        "torque_rate": (rates, "Nm/s"),
        "run": (np.arange(base.conditions.runs, dtype=np.float64), ""),
    }


def partings(values: FloatArray) -> list[tuple[float, BoolArray]]:
    """All thresholds between different values, each with the runs beyond it."""
    found = np.unique(values)
    out = []
    for below, above in pairwise(found.tolist()):
        out.append((float(0.5 * (below + above)), values >= above))
    return out


def scan(contest: Contest, part: int, masks: FloatArray) -> FloatArray:
    """Decrease of the quadratic form for each split of one scattering column."""
    e = contest.evidence
    index = np.concatenate((e.fixed, [e.scatter[part]], [e.response])).astype(np.intp)
    matrix = reduce(e, index, contest.null_omega).matrix
    n0 = e.fixed.size
    total = matrix.sum(axis=0)
    h0 = total[:n0, :n0] + np.diag(e.ridge(e.index())[:n0])
    # Rows: products of the column of each split with the baseline model, itself and the residual.
    cross = masks @ matrix[:, n0, :n0]
    own = masks @ matrix[:, n0, n0]
    score = masks @ matrix[:, n0, -1] - cross @ np.linalg.solve(h0, total[:n0, -1])
    left = own - np.einsum("mi,mi->m", cross, np.linalg.solve(h0, cross.T).T)
    seen = left > 1e-9 * np.maximum(own, 1e-300)
    return np.where(seen, score**2 / np.where(seen, left, 1.0), 0.0)


def between_runs(base: BaselineModel, contest: Contest) -> list[Candidate]:
    """All candidates for differences between runs."""
    return [*run_steps(base, contest), *run_drifts(base)]


def run_steps(base: BaselineModel, contest: Contest) -> list[Candidate]:
    """The split of the runs that explains most, for each part of the baseline and channel."""
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
                # Two channels that split the runs in the same way are confounded. Either may pass
                # its test, so the number of trials is that of the channel with fewer splits.
                one = out[key]
                out[key] = replace(
                    one,
                    trials=min(one.trials, len(found)),
                    tests=one.tests + 1,
                    also=[*one.also, (channel, shape)],
                )
                continue
            out[key] = Candidate(
                f"step of {part} by {channel}",
                False,
                (tangents[:, place] * smaller[c.run_of])[:, None],
                channel,
                shape,
                trials=len(found),
                kind="run",
            )
    return list(out.values())


def run_drifts(base: BaselineModel) -> list[Candidate]:
    """Each part of the baseline model with an equal change from run to run."""
    c = base.conditions
    tangents = base.run_columns(base.at())
    along = np.linspace(-1.0, 1.0, c.runs)[c.run_of]
    return [
        Candidate(
            f"drift of {part} by run",
            False,
            (tangents[:, place] * along)[:, None],
            "run",
            f"{part}, a steady drift",
            kind="run",
        )
        for place, part in enumerate(DEVIATIONS)
    ]
