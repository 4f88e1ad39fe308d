"""The verdict in words, and what to do next."""

from __future__ import annotations

from collections.abc import Mapping

from lostmotion import rules
from lostmotion.discover.contest_round import Field
from lostmotion.discover.odd_runs import OddRuns
from lostmotion.effects.columns import NO_COLUMN
from lostmotion.effects.effect import Effect

ASK_WHAT_DIFFERED = (
    "Find out what was different in these runs (temperature, cycles, mounting), record it as a "
    "column, and diagnose again."
)


def decide(runs: int, names: list[str], rivals: list[str], nameless: bool) -> tuple[str, list[str]]:
    """Decide the verdict, and the effects that it shows.

    Parameters
    ----------
    runs : int
        Runs that were judged.
    names, rivals : list of str
        Effects that were found, and those that do as well as one of them.
    nameless : bool
        Whether a shape or an event without a name was found, too.
    """
    if runs < rules.RUNS_LEAST:
        return ("unexplained" if names or nameless else "complete"), []
    if nameless:
        return "unexplained", names
    if names and rivals:
        return "ambiguous", names + rivals
    return ("missing-effect" if names else "complete"), names


def count_runs(runs: int) -> str:
    """Say how many runs there are."""
    return "1 run" if runs == 1 else f"{runs} runs"


def advise(
    verdict: str,
    names: list[str],
    rivals: list[str],
    effects: Mapping[str, Effect],
    stage: Field,
    runs: int,
    odd: OddRuns | None,
) -> str:
    """Say what to do next."""
    if runs < rules.RUNS_LEAST:
        least = f"{rules.RUNS_LEAST} runs or more"
        return f"{count_runs(runs)} cannot carry a name: repeat the plan, {least}."
    if odd is not None:
        return ASK_WHAT_DIFFERED
    if verdict == "ambiguous":
        first = [effects[name].experiment for name in (*names, *rivals) if effects[name].experiment]
        pair = " and ".join((*names[:1], *rivals))
        return f"To tell {pair} apart: " + "; ".join(dict.fromkeys(first)) + "."
    if verdict == "unexplained":
        return (
            "Repeat runs in which what it depends on is changed alone, "
            "and look at the rig: no effect of the library does this."
        )
    what = "Nothing is left above the noise."
    if names:
        add = " ".join(f"--add {name}" for name in names)
        it = "it" if len(names) == 1 else "them"
        what = f"Add {it}: fit {add}. Nothing else is left above the noise."
    blind = sorted(name for name, why in stage.closed.items() if why.startswith("not visible"))
    if blind:
        what += f" This plan could not have shown: {', '.join(blind)}."
    lacking = sorted(name for name, why in stage.closed.items() if NO_COLUMN in why)
    if lacking:
        what += f" Without their columns nothing is known of: {', '.join(lacking)}."
    return what
