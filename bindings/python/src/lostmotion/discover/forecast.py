"""Before measuring: the effects that a plan would detect, and those it could not separate."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np

from lostmotion import rules
from lostmotion.candidates.named import named_candidates
from lostmotion.discover.contest_round import make_round
from lostmotion.discover.detectable import detectable
from lostmotion.discover.linearise import noise_rms, settle
from lostmotion.drives import Drive
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.effect import Effect
from lostmotion.evidence.noise import Noise
from lostmotion.evidence.overlap import principal_angles
from lostmotion.evidence.sign_flips import runs_least
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.drive_file import require_plan, restore, torsion_curve_of
from lostmotion.recordings import Campaign
from lostmotion.torsion_curve import TorsionCurve

USUAL_NOISE_ARCSEC = 1.5
"""Angle noise assumed before any measurement."""

USUAL_PHI = (0.5,)
"""Its correlation from sample to sample."""

USUAL_SCATTER = (0.003, 0.02, 0.2, 2.0)
"""Scatter from run to run: stiffness, friction (relative), gap and offset (arc seconds)."""


def usual_noise(runs: int) -> Noise:
    """Typical noise of a test bench before any measurement."""
    phi = np.array(USUAL_PHI)
    sigma = USUAL_NOISE_ARCSEC * np.sqrt(1.0 - float(phi @ phi))
    return Noise([phi] * runs, np.full(runs, sigma))


def forecast(
    drive: Drive,
    campaign: Campaign,
    torsion_curve: TorsionCurve | None,
    effects: Mapping[str, Effect],
) -> dict[str, Any]:
    """Forecast which effects a plan would detect, their smallest sizes, and open pairs."""
    require_plan(campaign)
    sheet = torsion_curve_of(drive, torsion_curve)
    base = BaselineModel(Conditions(campaign), drive.rated_torque_Nm, sheet)
    base.curve.mean_slope = float(np.mean(base.curve.prior_slopes))
    base.curve.slopes = base.curve.prior_slopes.copy()
    restore(drive, base, effects)
    noise = usual_noise(base.conditions.runs)
    candidates, closed = named_candidates(effects, base, base.at(), drive.ratio)
    planned = make_round(settle(base, noise, rounds=0), candidates, closed)
    contest = planned.contest
    scale = contest.evidence.scale[contest.evidence.scatter]
    contest.null_omega = (np.array(USUAL_SCATTER) * scale) ** 2
    found, unreachable = detectable(planned, noise_rms(noise, base))
    for candidate in candidates:
        if candidate.name not in found:
            absorbed = "not identifiable with this plan: absorbed by the baseline"
            closed[candidate.name] = unreachable.get(candidate.name, absorbed)
    rows = [
        {"name": name, "testable": name in found, **found.get(name, {"reason": closed.get(name)})}
        for name in effects
    ]
    pairs = []
    for a, b in combinations(found, 2):
        angle = float(principal_angles(contest.evidence, contest.null_omega, a, b)[0])
        if angle < rules.WARN_DEG:
            pairs.append(
                {"effects": [a, b], "angle_deg": angle, "separable": angle >= rules.TWIN_DEG}
            )
    pairs.sort(key=lambda p: (p["angle_deg"], p["effects"]))
    return {
        "schema": "lostmotion.forecast/1",
        "runs": base.conditions.runs,
        "samples": base.conditions.rows,
        "enough_runs": base.conditions.runs >= runs_least(),
        "effects": rows,
        "confusable": pairs,
        "assumed": {
            "noise_arcsec": USUAL_NOISE_ARCSEC,
            "scatter": dict(
                zip(
                    ("stiffness", "friction", "gap_arcsec", "offset_arcsec"),
                    USUAL_SCATTER,
                    strict=True,
                )
            ),
        },
    }
