"""Whether recordings are sound, and what their plan separates or confounds."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations, pairwise
from typing import Any

import numpy as np

from lostmotion import units
from lostmotion.arrays import FloatArray
from lostmotion.effects.columns import DERIVED, missing_columns
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.effect import Effect
from lostmotion.evidence.sign_flips import runs_least
from lostmotion.recordings import Campaign, say_findings

ELSEWHERE = 0.05
"""Distance between the torque at the start of a run and at the end of the last one, as a share of
the largest torque, above which a load change between them is assumed."""

ALIASED = 0.9
"""Least rank correlation of the means of two columns over the runs at which they count as
confounded."""


def begin_elsewhere(campaign: Campaign) -> list[int | str]:
    """List the runs whose torque does not begin where the previous run ended.

    Friction depends on the load history between runs; the model assumes that the torque ramped
    monotonically.
    """
    least = ELSEWHERE * campaign.largest_torque_Nm
    return [
        run.label
        for before, run in pairwise(campaign.runs)
        if abs(run.torque_Nm[0] - before.torque_Nm[-1]) > least
    ]


def largest_swing_arcmin(campaign: Campaign) -> float:
    """Largest range of the lost motion within a run, which shows angles in a wrong unit."""
    swing = max(float(np.ptp(run.lost_motion_rad)) for run in campaign.runs)
    return units.convert(swing, "rad", "arcmin")


def ranks(values: FloatArray) -> FloatArray:
    """Rank of each value; equal values have equal ranks."""
    _, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(counts) - 0.5 * (counts - 1))[place], dtype=np.float64)


def rank_correlation(a: FloatArray, b: FloatArray) -> float:
    """Spearman's correlation; scipy.stats takes half a second to load."""
    return float(np.corrcoef(ranks(a), ranks(b))[0, 1])


def check(campaign: Campaign, effects: Mapping[str, Effect]) -> dict[str, Any]:
    """Check whether recordings are sound, and what this plan separates or confounds."""
    conditions = Conditions(campaign)
    columns = dict(conditions.columns)
    columns.pop("elapsed_s", None)
    means = {
        name: conditions.run_mean(values) for name, values in columns.items() if np.ptp(values) > 0
    }
    means["order of the runs"] = np.arange(conditions.runs, dtype=np.float64)
    aliased = []
    if conditions.runs >= 3:
        for a, b in combinations(means, 2):
            if {a, b} == {"input_angle_rad", "output_angle_rad"}:
                continue  # coupled by the gear
            if np.ptp(means[a]) == 0 or np.ptp(means[b]) == 0:
                continue
            close = rank_correlation(means[a], means[b])
            if abs(close) > ALIASED:
                aliased.append({"columns": [a, b], "rank_correlation": close})
    constant = [n for n, values in columns.items() if np.ptp(values) == 0]
    blind = {}
    for name, effect in effects.items():
        missing = missing_columns(effect, conditions)
        flat = [need for need in sorted(effect.needs) if need in constant]
        if missing:
            blind[name] = "not testable with these columns: no " + ", ".join(missing)
        elif flat:
            shown = ", ".join(DERIVED.get(need, need) for need in flat)
            blind[name] = f"not identifiable with this plan: constant {shown}"
    return {
        "schema": "lostmotion.check/1",
        "sound": not campaign.findings,
        "findings": say_findings(campaign.findings),
        "runs": conditions.runs,
        "samples": conditions.rows,
        "lost_motion_arcmin": largest_swing_arcmin(campaign),
        "largest_torque_Nm": campaign.largest_torque_Nm,
        "enough_runs": conditions.runs >= runs_least(),
        "constant": constant,
        "begin_elsewhere": begin_elsewhere(campaign),
        "aliased": aliased,
        "not_testable": blind,
        "data_fingerprint": campaign.fingerprint(),
    }
