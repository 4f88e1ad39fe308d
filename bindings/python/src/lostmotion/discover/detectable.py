"""The smallest detectable size of each effect for recordings or a plan."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy import special
from scipy.optimize import brentq

from lostmotion import rules
from lostmotion.discover.advice import count_runs
from lostmotion.discover.contest_round import ContestRound
from lostmotion.discover.gates import corrected_for
from lostmotion.evidence.overlap import projected
from lostmotion.units import ARCSEC, split_unit

NONCENTRALITY_MIN = 1e-2
"""Least noncentrality that is stated: a tenth of a standard error."""

POWER = 0.8
"""Probability with which the smallest detectable size is detected: the usual power of a planned
test."""

NONCENTRALITY_MAX = 4e8
"""Largest noncentrality searched: 20,000 standard errors. Beyond it the distribution function of
scipy (Boost) fails, and no drive has such an effect.
"""


def detectable(contest_round: ContestRound, within: float) -> tuple[dict[str, Any], dict[str, str]]:
    """Smallest size of each effect that is detected with probability `POWER`.

    Parameters
    ----------
    within : float
        Noise within runs, arc seconds.

    Returns
    -------
    sizes : dict
        Sizes by effect, without effects that the baseline model absorbs.
    unreachable : dict
        Reasons for effects that no size makes detectable, by effect.
    """
    out: dict[str, Any] = {}
    unreachable: dict[str, str] = {}
    contest = contest_round.contest
    for name, candidate in contest_round.candidates.items():
        if not candidate.named or candidate.effect is None:
            continue
        block = f"{name}#0" if f"{name}#0" in contest.evidence.blocks else name
        information = projected(contest.evidence, [block], contest.null_omega)
        scale = contest.evidence.scale[contest.evidence.blocks[block]]
        rank = information.shape[0]
        level = rules.P_LIMIT / corrected_for(contest_round, candidate)
        needed = noncentrality(rank, contest.freedom(rank), level)
        info = float(np.mean(np.diag(information)))
        if not info > 1e-12:
            continue
        if needed is None:
            unreachable[name] = (
                f"no size is detectable: {count_runs(contest.runs)} "
                f"{'leaves' if contest.runs == 1 else 'leave'} its test too few degrees of freedom"
            )
            continue
        amplitude = math.sqrt(needed / info)
        columns = candidate.columns[:, : min(rank, candidate.columns.shape[1])]
        rms = amplitude * float(
            np.mean(np.sqrt(np.mean(columns**2, axis=0)) / scale[: columns.shape[1]])
        )
        least = rules.SIZE_LEAST * within
        if candidate.hangs_on_load_alone:
            least = max(least, contest_round.form_arcsec)
        if rms < least:
            amplitude *= least / max(rms, 1e-300)
            rms = least
        places = candidate.effect.indices("linear") or candidate.effect.inner()
        value = candidate.effect.values[places[0]]
        size = amplitude / float(np.mean(scale))
        parameter, unit = split_unit(value.name)
        if not candidate.effect.free():  # a slip has the size of a tooth
            parameter, unit = "teeth", None
        if size > value.high:
            unreachable[name] = f"no possible size is detectable: {parameter} above {value.high:g}"
            continue
        symbol = unit.symbol if unit is not None else "-"
        if symbol.startswith("rad"):
            size, symbol = size / ARCSEC, "arcsec" + symbol.removeprefix("rad")
        out[name] = {
            "value": size,
            "unit": symbol.replace("_", " "),
            "parameter": parameter,
            "rms_arcsec": rms,
        }
    return out, unreachable


def noncentrality(rank: int, freedom: int, alpha: float) -> float | None:
    """Noncentrality at which the F test at level alpha has the required power.

    None if no size reaches it: without a degree of freedom there is no test, and with only one a
    small alpha requires more than `NONCENTRALITY_MAX`.
    """
    if freedom < 1:
        return None
    limit = float(special.fdtri(rank, freedom, 1.0 - alpha))

    def lacking(log_size: float) -> float:
        power = 1.0 - special.ncfdtr(rank, freedom, math.exp(log_size), limit)
        return float(power) - POWER

    low, high = math.log(NONCENTRALITY_MIN), math.log(10.0 * NONCENTRALITY_MIN)
    if lacking(low) >= 0:
        return NONCENTRALITY_MIN
    while not lacking(high) >= 0:  # also if the distribution function returns NaN
        high += 1.0
        if high > math.log(NONCENTRALITY_MAX):
            return None
    return math.exp(brentq(lacking, low, high, xtol=1e-3))
