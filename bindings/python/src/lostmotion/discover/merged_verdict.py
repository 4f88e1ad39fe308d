"""The answer of ``merge``: what evidence says, in the words of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lostmotion import rules
from lostmotion.candidates.slipped_teeth import jumping_effect
from lostmotion.discover.advice import ASK_WHAT_DIFFERED, count_runs, decide
from lostmotion.discover.answer import plausible
from lostmotion.discover.detectable import detectable
from lostmotion.discover.events import dependence
from lostmotion.discover.evidence_selection import (
    Rounds,
    candidates_of,
    centred,
    contest_of,
    estimate,
    estimate_beside,
)
from lostmotion.discover.gates import family_p
from lostmotion.discover.odd_runs import OddRuns, find_odd_runs
from lostmotion.effects.effect import Effect
from lostmotion.evidence.file import Body
from lostmotion.fit.deviations import DEVIATIONS


def judge_body(body: Body, effects: Mapping[str, Effect]) -> dict[str, Any]:
    """Judge evidence as `diagnose` judges recordings.

    Returns
    -------
    dict
        The answer of ``merge``, ready for JSON.
    """
    rounds = contest_of(body, candidates_of(body, effects))
    runs = body.white.runs
    slips = [event for event in body.about["events"] if "teeth" in event]
    jumping = jumping_effect(effects)
    names = [jumping.name] if slips and jumping is not None else []
    names += [one.candidate.name for one in rounds.chosen if one.candidate.named]
    taken = rounds.steps[: len(rounds.chosen)]
    twins = sorted({name for step in taken for name in step.rivals if name not in names})
    events = body.about["events"]
    nameless = len(events) > len(slips) or any(not one.candidate.named for one in rounds.chosen)
    verdict, shown = decide(runs, names, twins, nameless)
    noise, floor = noise_of(body, rounds)
    swing = np.array(body.about["swing_arcsec"])
    contest = rounds.steps[-1].field.contest
    apart = find_odd_runs(contest, swing) if verdict == "complete" else None
    if apart is not None and size_of_odd(body, apart) >= rules.SIZE_LEAST * rounds.within:
        verdict = "unexplained"
    else:
        apart = None
    sizes, unreachable = detectable(rounds.steps[-1].field, rounds.within)
    return {
        "schema": "lostmotion.diagnosis/1",
        "verdict": verdict,
        "noise_floor_arcsec": floor,
        "effects": shown,
        "ladder": rounds.ladder,
        "candidates": list_candidates(body, rounds, shown),
        "events": events,
        "smallest_detectable": sizes,
        "unexplained": unexplained(body, rounds, apart),
        "next_experiment": ASK_WHAT_DIFFERED
        if apart is not None
        else advice(verdict, runs, shown, body.about["alone"]),
        "noise": noise,
        "runs": runs,
        "samples": int(body.rows.sum()),
        "not_testable": dict(sorted(body.about["closed"].items())),
        "not_detectable": unreachable,
        "data_fingerprints": body.about["data_fingerprints"],
        "alone": body.about["alone"],
    }


def noise_of(body: Body, rounds: Rounds) -> tuple[dict[str, Any], float]:
    """Noise within runs, scatter between them, and both as one floor, arc seconds."""
    contest = rounds.steps[-1].field.contest
    places = contest.evidence.scatter
    omega = contest.null_omega / contest.evidence.scale[places] ** 2
    plain = body.plain
    squares = np.einsum("rii->i", centred(plain))[plain.scatter]
    squares = squares * plain.scale[plain.scatter] ** 2 / body.rows.sum()
    known = len(DEVIATIONS)
    floor = float(np.sqrt(rounds.within**2 + squares[:known] @ omega[:known]))
    floor = min(floor, rounds.ladder[-1]["rms_heldout_arcsec"])
    named = zip((*DEVIATIONS, "offset_arcsec"), map(float, np.sqrt(omega)), strict=True)
    return {"within_runs_arcsec": rounds.within, "scatter": dict(named)}, floor


def size_of_odd(body: Body, odd: OddRuns) -> float:
    """Root mean square over all samples, arc seconds, of what odd runs do."""
    at = body.plain.scatter[odd.place]
    squares = centred(body.plain)[odd.runs, at, at] * body.plain.scale[at] ** 2
    return float(np.sqrt(squares @ np.square(odd.deviations) / body.rows.sum()))


def list_candidates(body: Body, rounds: Rounds, shown: list[str]) -> list[dict[str, Any]]:
    """List every effect: those that were found first, then by evidence.

    Sizes are those of one step, with standard errors under noise and scatter; those of effects that
    were found are estimated together.
    """
    found: dict[str, dict[str, Any]] = {}
    chosen = {one.candidate.name: one for one in rounds.chosen}
    for step in rounds.steps:
        for result in step.results:
            candidate = step.field.candidates[result.name]
            effect = candidate.effect
            if not candidate.named or effect is None:
                continue
            one = chosen.get(result.name)
            if one is not None:
                others = [other for other in rounds.chosen if other is not one]
                values, errors = estimate_beside(body, one, others)
            else:
                values, errors = estimate(step.field, result)
            found[result.name] = {
                "name": result.name,
                "heldout_rms_arcsec": rounds.ladder[-1]["rms_heldout_arcsec"],
                "evidence": result.gain,
                "parameters": values,
                "standard_errors": errors,
                "confused_with": sorted(step.rivals) if one is not None else [],
                "plausible": plausible(effect, np.array(list(values.values()))),
                "testable": True,
                "p": family_p(step.field, candidate, result),
                **({} if one is None else {"size_arcsec": one.size}),
            }
    return sorted(found.values(), key=lambda c: (c["name"] not in shown, -c["evidence"], c["name"]))


def unexplained(body: Body, rounds: Rounds, odd: OddRuns | None) -> dict[str, Any]:
    """What no effect explains: shapes with what they depend on, sudden steps, odd runs."""
    shapes = [
        (one, step)
        for one, step in zip(rounds.chosen, rounds.steps, strict=False)
        if not one.candidate.named
    ]
    before = max(rounds.ladder[0]["rms_arcsec"] ** 2, 1e-300)
    depends = [
        {
            "covariate": one.candidate.covariate,
            "shape": one.candidate.shape,
            "p": family_p(step.field, one.candidate, one.result),
            "rms_arcsec": one.size,
        }
        for one, step in shapes
    ]
    events = [event for event in body.about["events"] if "teeth" not in event]
    depends += [dependence(event, body.rows.sum()) for event in events]
    squares = sum(one.size**2 for one, _ in shapes)
    if odd is not None:
        size = size_of_odd(body, odd)
        depends.append(odd.told(body.about["runs"], size))
        squares += size**2
    share = squares / before
    return {"share": float(min(1.0, share)), "depends_on": depends}


def advice(
    verdict: str, runs: int, shown: Sequence[str], alone: Sequence[Mapping[str, Any]]
) -> str:
    """Say what to do next."""
    if runs < rules.RUNS_LEAST:
        least = f"{rules.RUNS_LEAST} runs or more"
        return f"{count_runs(runs)} cannot carry a name: add evidence, {least}."
    said = {name for one in alone for name in one["effects"]}
    new = [name for name in shown if name not in said]
    left = verdict == "unexplained" and all(one["verdict"] != verdict for one in alone)
    if new or left:
        return (
            f"No campaign alone shows {', '.join(new) or 'what is left over'}: diagnose the "
            "recordings together, which refits what is one step here."
        )
    return {
        "complete": "Nothing is left above the noise.",
        "missing-effect": "Diagnose the recordings of one campaign to refit the effect's values.",
        "ambiguous": "Add evidence of runs in which only one of the effects changes.",
        "unexplained": "Look at the recordings in which what it depends on changes alone.",
    }[verdict]
