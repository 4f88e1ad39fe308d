"""What the rounds of a selection come to: the verdict, the names, and what no effect explains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lostmotion import rules
from lostmotion.discover.choice import Step
from lostmotion.discover.gates import family_p
from lostmotion.discover.odd_runs import OddRuns

INCONCLUSIVE = "inconclusive"
"""Verdict where there is too little data for any other."""


@dataclass
class Conclusion:
    """The verdict over the rounds of a selection.

    Attributes
    ----------
    verdict : str
    shown : list of str
        Effects that it shows.
    names, rivals : list of str
        Effects that are missing, and those that do as well as one of them.
    by_effect : dict
        Verdict, confidence and rivals of each effect that is missing, by its name.
    depends_on : list of dict
        On what that depends which no effect explains.
    odd : OddRuns or None
        Runs that stand apart.
    unnamed : float
        Mean square of what no effect explains, arc seconds squared.
    """

    verdict: str
    shown: list[str]
    names: list[str]
    rivals: list[str]
    by_effect: dict[str, dict[str, Any]] = field(default_factory=dict)
    depends_on: list[dict[str, Any]] = field(default_factory=list)
    odd: OddRuns | None = None
    unnamed: float = 0.0

    def add_odd_runs(
        self, odd: OddRuns, size: float, least: float, labels: Sequence[int | str]
    ) -> None:
        """State that runs stand apart, where what they do is large enough.

        Parameters
        ----------
        odd : OddRuns
        size, least : float
            What they do, and what counts, arc seconds.
        labels : sequence
            Of all runs.
        """
        if size >= least:
            self.verdict, self.odd = "unexplained", odd
            self.depends_on.append(odd.told(labels, size))
            self.unnamed += size**2

    def share(self, rms_arcsec: float) -> float:
        """Share of a mean square error that no effect explains."""
        before = rms_arcsec**2
        return float(np.clip(self.unnamed / before, 0.0, 1.0)) if before > 0 else 0.0


def conclude_rounds(
    steps: Sequence[Step],
    taken: int,
    runs: int,
    present: Sequence[str],
    names: list[str],
    nameless: bool,
    within: float,
) -> Conclusion:
    """Draw the conclusion from the rounds of a selection.

    Parameters
    ----------
    steps : sequence of Step
    taken : int
        How many of them have changed the model: only these count; what a last one found beyond is
        left over.
    runs : int
    present, names : sequence of str
        Effects in the model, and those of them that are missing from the drive file.
    nameless : bool
        Whether the model has shapes without a name, or the recordings have sudden events.
    within : float
        Noise within runs, arc seconds.
    """
    counted = steps[:taken]
    rungs = [rung_of(step, present) for step in counted if is_named(step)]
    by_effect = {name: said for name, said, _ in rungs if name in names}
    minor = minor_doubts([rung for rung in rungs if rung[0] in names], within)
    sure = [name for name in names if name not in minor]
    rivals = sorted({r for name, said, _ in rungs if name not in minor for r in said["rivals"]})
    verdict, shown = decide(runs, sure, rivals, nameless)
    depends = [what for step in steps for what in describe(step)]
    shapes = [s.selected for s in counted if s.selected and not s.selected.candidate.named]
    unnamed = sum(shape.size**2 for shape in shapes)
    return Conclusion(verdict, shown, sure, rivals, by_effect, depends, unnamed=unnamed)


def is_named(step: Step) -> bool:
    """Whether a round has selected an effect that has a name."""
    return step.selected is not None and step.selected.candidate.named


def rung_of(step: Step, present: Sequence[str]) -> tuple[str, dict[str, Any], float]:
    """Name, verdict and size in arc seconds of an effect that was selected."""
    chosen = step.selected
    assert chosen is not None
    rivals = sorted(name for name in step.rivals if name not in present)
    said = {
        "verdict": "ambiguous" if rivals else "missing-effect",
        "confidence": 1.0 - family_p(step.round, chosen.candidate, chosen.result),
        "rivals": rivals,
    }
    return chosen.name, said, chosen.size


def minor_doubts(rungs: Sequence[tuple[str, dict[str, Any], float]], within: float) -> list[str]:
    """Effects with rivals that are too small beside a certain one to make the answer doubtful.

    As for a shape beside a named effect (`rules.SHAPE_AFTER_NAMED`): the certain one explains the
    misfit, only not in every detail.
    """
    if not any(said["verdict"] == "missing-effect" for _, said, _ in rungs):
        return []
    least = rules.SHAPE_AFTER_NAMED * within
    return [name for name, said, size in rungs if said["rivals"] and size < least]


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
        return ("unexplained" if names or nameless else INCONCLUSIVE), []
    if nameless:
        return "unexplained", names
    if names and rivals:
        return "ambiguous", names + rivals
    return ("missing-effect" if names else "complete"), names


def describe(step: Step) -> list[dict[str, Any]]:
    """Say on what a shape without a name depends; on several things, where these are confounded."""
    if step.selected is None or step.selected.candidate.named:
        return []
    candidate, result = step.selected.candidate, step.selected.result
    ready = {"formula": candidate.formula} if candidate.formula else {}
    return [
        {
            "covariate": covariate,
            "shape": shape,
            "p": family_p(step.round, candidate, result),
            "rms_arcsec": step.selected.size,
            **(ready if covariate == candidate.covariate else {}),
        }
        for covariate, shape in ((candidate.covariate, candidate.shape), *candidate.also)
    ]
