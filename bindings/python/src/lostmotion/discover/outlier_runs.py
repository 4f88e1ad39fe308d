"""Outlier runs: their stiffness, friction or gap differs by more than run-to-run scatter.

An unrecorded cause (for example heating) acts between runs and appears as a deviation of only a few
runs. For each part, the standardised deviations of all runs are compared by the generalised extreme
Studentised deviate test (Rosner 1983), which finds several outliers that would mask each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

from lostmotion import rules
from lostmotion.arrays import FloatArray
from lostmotion.evidence.contest import Contest
from lostmotion.evidence.scatter import deviations, without_scatter
from lostmotion.fit.deviations import DEVIATIONS

RUN_NEEDS = {"temperature_C", "cycles"}
"""Conditions in which runs differ from each other, as far as they are recorded."""

TOLD_LEAST = 1e-6
"""Share of the variance of a deviation below which only rounding determines it."""


@dataclass
class OutlierRuns:
    """Outlier runs in one part of the baseline model.

    Attributes
    ----------
    part : str
    runs : list of int
    deviations : list of float
        Deviations of these runs: stiffness and friction relative, gap in arc seconds.
    p : float
        Of the test, over all parts.
    """

    part: str
    runs: list[int]
    deviations: list[float]
    p: float

    @property
    def place(self) -> int:
        """Place of the part among those that scatter."""
        return DEVIATIONS.index(self.part)

    def told(self, labels: Sequence[int | str], rms_arcsec: float) -> dict[str, Any]:
        """Return the entry for the answer."""
        names = [str(labels[run]) for run in self.runs]
        one = "run" if len(names) == 1 else "runs"
        some = " and ".join((", ".join(names[:-1]), names[-1])) if len(names) > 1 else names[0]
        return {
            "covariate": "run",
            "shape": f"{self.part}, in {one} {some} alone",
            "p": self.p,
            "rms_arcsec": rms_arcsec,
        }


def find_outlier_runs(contest: Contest, level: float) -> OutlierRuns | None:
    """Find the strongest outlier runs, if there are any.

    Parameters
    ----------
    contest : Contest
    level : float
        Probability that runs with only scatter are reported.
    """
    e = contest.evidence
    index, omega = e.index(), contest.null_omega
    own = deviations(e, index, omega, contest.null_step())
    share = share_told(contest)
    best: OutlierRuns | None = None
    for place, part in enumerate(DEVIATIONS):
        there = np.flatnonzero(share[:, place] > TOLD_LEAST)
        # Predictions from little data shrink towards zero: their spread is below the true one.
        spread = np.sqrt(omega[place] * share[there, place])
        outliers, p = apart(own[there, place] / spread, level / len(DEVIATIONS))
        p = min(1.0, p * len(DEVIATIONS))
        if outliers and (best is None or p < best.p):
            runs = np.sort(there[outliers])
            values = own[runs, place] / e.scale[e.scatter[place]]
            best = OutlierRuns(part, runs.tolist(), values.tolist(), p)
    return best


def share_told(contest: Contest) -> FloatArray:
    """Share of the variance of each deviation that the recordings of its run determine."""
    e = contest.evidence
    gram = e.gram[:, e.scatter[:, None], e.scatter]
    kept, _ = without_scatter(gram, contest.null_omega, np.eye(e.scatter.size))
    return np.asarray(1.0 - np.einsum("rii->ri", kept))


def apart(values: FloatArray, level: float) -> tuple[list[int], float]:
    """Places of the outliers, and the least p of the test.

    Parameters
    ----------
    values : ndarray
        Independent and normal, except for the outliers.
    level : float
        Probability of a false outlier.
    """
    left = np.arange(values.size)
    taken: list[int] = []
    many, least = 0, 1.0
    for _ in range(int(rules.OUTLIER_RUNS_SHARE_MOST * values.size)):
        rest = values[left]
        off = np.abs(rest - rest.mean())
        worst = int(np.argmax(off))
        n = rest.size
        spread = float(rest.std(ddof=1))
        if spread == 0.0:
            break
        ratio = float(off[worst]) / spread
        room = (n - 1) ** 2 - n * ratio**2
        t = ratio * np.sqrt(n * (n - 2) / room) if room > 0 else np.inf
        p = min(1.0, 2.0 * n * float(special.stdtr(n - 2, -t)))
        taken.append(int(left[worst]))
        left = np.delete(left, worst)
        if p <= level:
            many, least = len(taken), min(least, p)
    return taken[:many], least
