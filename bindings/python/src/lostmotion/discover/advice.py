"""What to do next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from lostmotion.discover.conclusion import Conclusion
from lostmotion.discover.contest_round import ContestRound
from lostmotion.effects.columns import NO_COLUMN
from lostmotion.effects.effect import Effect
from lostmotion.evidence.sign_flips import runs_least

ASK_WHAT_DIFFERED = (
    "Find out what was different in these runs (temperature, cycles, mounting), record it as a "
    "column, and diagnose again."
)


def count_runs(runs: int) -> str:
    """Describe how many runs there are."""
    return "1 run" if runs == 1 else f"{runs} runs"


def too_few(runs: int) -> str:
    """State that so many runs are too few."""
    return f"At least {runs_least()} runs are needed to identify an effect, found {runs}"


def advise(
    found: Conclusion,
    effects: Mapping[str, Effect],
    last: ContestRound,
    runs: int,
    at_bound: Mapping[str, Sequence[str]],
    harmful: Mapping[str, Sequence[Mapping[str, Any]]],
) -> str:
    """Recommend the next step for recordings that can be repeated.

    Parameters
    ----------
    at_bound : mapping
        Estimated values at a bound, by effect: such an effect is not recommended.
    harmful : mapping
        Result of `ladder.harms`: an effect that makes a prediction worse is not recommended either.
    """
    if runs < runs_least():
        return f"{too_few(runs)}: repeat the plan."
    if found.outliers is not None:
        return ASK_WHAT_DIFFERED
    if found.verdict == "ambiguous":
        doubtful = [name for name, said in found.by_effect.items() if said["rivals"]]
        both = list(dict.fromkeys((*(n for n in doubtful if n in found.names), *found.rivals)))
        first = [effects[name].experiment for name in both if effects[name].experiment]
        pair = " and ".join(both)
        return f"To separate {pair}: " + "; ".join(dict.fromkeys(first)) + "."
    if found.verdict == "unexplained":
        return (
            "Repeat runs that vary only what the residual depends on, "
            "then inspect the test bench: no effect of the library explains it."
        )
    what = "No significant residual."
    doubtful = [name for name in found.names if at_bound.get(name) or harmful.get(name)]
    sound = [name for name in found.names if name not in doubtful]
    if sound:
        add = " ".join(f"--add {name}" for name in sound)
        it = "it" if len(found.names) == 1 else "these" if doubtful else "them"
        what = f"Add {it}: fit {add}. No further significant residual."
    elif doubtful:
        what = "No further significant residual."
    for name in doubtful:
        what += f" {name} is not recommended: {why_not(at_bound.get(name), harmful.get(name))}."
    blind = sorted(name for name, why in last.closed.items() if why.startswith("not identifiable"))
    if blind:
        what += f" Not identifiable with this plan: {', '.join(blind)}."
    lacking = sorted(name for name, why in last.closed.items() if NO_COLUMN in why)
    if lacking:
        what += f" Not testable without their columns: {', '.join(lacking)}."
    return what


def why_not(at_bound: Sequence[str] | None, harmful: Sequence[Mapping[str, Any]] | None) -> str:
    """State why an effect is not recommended."""
    if at_bound:
        return f"{', '.join(at_bound)} at its bound"
    return "it makes the prediction worse at " + "; ".join(
        f"{one['setting']} ({one['rms_heldout_arcsec_before']:.3g} to "
        f"{one['rms_heldout_arcsec']:.3g} arcsec)"
        for one in harmful or ()
    )


def advise_merged(found: Conclusion, runs: int, alone: Sequence[Mapping[str, Any]]) -> str:
    """Recommend the next step for merged evidence; `alone` has the result of each campaign."""
    if runs < runs_least():
        return f"{too_few(runs)}: add evidence."
    if found.outliers is not None:
        return ASK_WHAT_DIFFERED
    said = {name for one in alone for name in one["effects"]}
    new = [name for name in found.shown if name not in said]
    left = found.verdict == "unexplained" and all(one["verdict"] != found.verdict for one in alone)
    if new or left:
        return (
            f"No single campaign shows {', '.join(new) or 'the unexplained residual'}: diagnose "
            "the recordings together, so that the model is refitted."
        )
    return {
        "complete": "No significant residual.",
        "missing-effect": "Diagnose the recordings of one campaign to refit the effect's values.",
        "ambiguous": "Add evidence of runs in which only one of the effects changes.",
        "unexplained": "Inspect the recordings in which only that quantity varies.",
    }[found.verdict]
