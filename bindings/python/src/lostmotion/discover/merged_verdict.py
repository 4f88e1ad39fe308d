"""The answer of ``merge``: a diagnosis from saved evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lostmotion.candidates.slipped_teeth import jumping_effect
from lostmotion.discover.advice import advise_merged
from lostmotion.discover.answer import entry
from lostmotion.discover.choice import Step
from lostmotion.discover.conclusion import Conclusion, conclude_rounds
from lostmotion.discover.contest_round import ContestRound
from lostmotion.discover.detectable import detectable
from lostmotion.discover.events import dependence
from lostmotion.discover.evidence_model import EvidenceModel
from lostmotion.discover.gates import family_p, level_of_answer
from lostmotion.discover.growing_model import Contender
from lostmotion.discover.noise_floor import floor_of, scatter_of
from lostmotion.discover.outlier_runs import RUN_NEEDS, OutlierRuns, find_outlier_runs
from lostmotion.discover.refits import term_of
from lostmotion.discover.selection import select
from lostmotion.discover.shortlist import least_size
from lostmotion.effects.effect import Effect
from lostmotion.evidence.contest import Result
from lostmotion.evidence.file import Body
from lostmotion.evidence.left_out import centred
from lostmotion.fit.deviations import DEVIATIONS


def judge_body(body: Body, effects: Mapping[str, Effect]) -> dict[str, Any]:
    """Diagnose saved evidence as `diagnose` does with recordings.

    Returns
    -------
    dict
        The answer of ``merge`` for JSON.
    """
    model = EvidenceModel(body, effects)
    steps = select(model)
    events, within = body.about["events"], model.within
    slips = [event for event in events if "teeth" in event]
    jumping = jumping_effect(effects)
    names = [jumping.name] if slips and jumping is not None else []
    names += [one.name for one in model.taken if one.candidate.named]
    given = list(body.about["given_arcsec"])
    nameless = len(events) > len(slips) or any(not one.candidate.named for one in model.taken)
    found = conclude_rounds(
        steps, len(model.trail) - 1, model.runs, [*given, *names], names, nameless
    )
    ladder = [rung(taken, model.errors(taken), found) for taken in model.trail]
    final = model.round_with(model.taken).contest
    if found.verdict == "complete" and not any(
        effects[name].needs & RUN_NEEDS for name in (*given, *names) if name in effects
    ):
        outliers = find_outlier_runs(final, level_of_answer(steps[-1].round))
        if outliers is not None:
            least = least_size(within, max(model.given.values(), default=0.0))
            found.add_outlier_runs(
                outliers,
                size_of_outlier_runs_in_evidence(body, outliers),
                least,
                body.about["runs"],
            )
    sizes, unreachable = detectable(steps[-1].round, within)
    depends = [dependence(event, body.rows.sum()) for event in events if event not in slips]
    scatter = zip((*DEVIATIONS, "offset_arcsec"), map(float, scatter_of(final)), strict=True)
    return {
        "schema": "lostmotion.diagnosis/1",
        "verdict": found.verdict,
        "noise_floor_arcsec": floor_of(final, squares_by_run(body), model.rows, within),
        "effects": found.shown,
        "ladder": ladder,
        "candidates": candidates_of_evidence(model, steps, ladder, found.shown),
        "events": events,
        "smallest_detectable": sizes,
        "unexplained": {
            "share": found.share(ladder[0]["rms_arcsec"]),
            "depends_on": [*found.depends_on, *depends],
        },
        "next_experiment": advise_merged(found, model.runs, body.about["alone"]),
        "noise": {"within_runs_arcsec": within, "scatter": dict(scatter)},
        "runs": model.runs,
        "samples": int(body.rows.sum()),
        "not_testable": dict(sorted(body.about["closed"].items())),
        "not_detectable": unreachable,
        "data_fingerprints": body.about["data_fingerprints"],
        "alone": body.about["alone"],
    }


def rung(
    taken: Sequence[Contender], errors: tuple[float, float], found: Conclusion
) -> dict[str, Any]:
    """Make a rung of the ladder, with the verdict on its new effect."""
    names = [one.name for one in taken]
    said = {"effect": names[-1], **found.by_effect.get(names[-1], {})} if names else {}
    return {"effects": names, "rms_arcsec": errors[0], "rms_heldout_arcsec": errors[1], **said}


def squares_by_run(body: Body) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Squares and products of the scattering columns of each run about its mean, unscaled."""
    known = body.plain.scatter[: len(DEVIATIONS)]
    scale = body.plain.scale[known]
    return np.asarray(centred(body.plain)[:, known[:, None], known] * np.outer(scale, scale))


def size_of_outlier_runs_in_evidence(body: Body, outliers: OutlierRuns) -> float:
    """Root mean square over all samples, arc seconds, of the deviations of outlier runs."""
    squares = squares_by_run(body)[outliers.runs, outliers.place, outliers.place]
    return float(np.sqrt(squares @ np.square(outliers.deviations) / body.rows.sum()))


def candidates_of_evidence(
    model: EvidenceModel,
    steps: Sequence[Step],
    ladder: Sequence[Mapping[str, Any]],
    shown: Sequence[str],
) -> list[dict[str, Any]]:
    """List every effect: those found first, then by evidence.

    Sizes are from one linear step, with standard errors from noise and scatter; effects found are
    estimated together.
    """
    found: dict[str, dict[str, Any]] = {}
    taken = {one.name: one for one in model.taken}
    for step in steps:
        for result in step.results:
            candidate = step.round.candidates[result.name]
            effect = candidate.effect
            if not candidate.named or effect is None:
                continue
            one = taken.get(result.name)
            where, judged = step.round, result
            if one is not None:
                where = model.round_with([other for other in model.taken if other is not one])
                judged = where.contest.test(result.name) or result
            values, standard_errors = estimate(where, judged)
            found[result.name] = {
                **entry(
                    effect,
                    np.array(list(values.values())),
                    ladder[-1]["rms_heldout_arcsec"],
                    result.gain,
                    family_p(step.round, candidate, result),
                    step.rivals if one is not None else [],
                    step.round.size_of(result) if one is None else one.size,
                ),
                "standard_errors": standard_errors,
            }
    return sorted(found.values(), key=lambda c: (c["name"] not in shown, -c["evidence"], c["name"]))


def estimate(current: ContestRound, result: Result) -> tuple[dict[str, float], dict[str, float]]:
    """Values of an effect from one linear step, and the standard errors of the estimated ones."""
    candidate = current.candidates[result.name]
    effect = candidate.effect
    assert effect is not None
    values = term_of(current, result).values
    evidence = current.contest.evidence
    tests = [current.contest.test(f"{result.name}#{n}") for n in sorted(set(candidate.start_of))]
    best = max((t for t in tests if t is not None), key=lambda t: t.wald, default=None)
    errors: dict[str, float] = {}
    if best is not None:
        scale = evidence.scale[evidence.blocks[best.block]]
        found = best.coefficients / scale
        error = np.sqrt(np.diag(best.covariance)) / scale
        for value, x in zip(effect.values, values, strict=True):
            place = np.flatnonzero(np.isclose(found, x, rtol=1e-9, atol=0.0))
            if x != 0 and place.size == 1 and value.role != "given":
                errors[value.name] = float(error[place[0]])
    return {v.name: float(x) for v, x in zip(effect.values, values, strict=True)}, errors
