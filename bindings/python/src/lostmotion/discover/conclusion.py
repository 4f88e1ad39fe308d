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
    depends_on: list[dict[str, Any]] = field(default_factory=list)
    odd: OddRuns | None = None
    unnamed: float = 0.0

    def add_odd_runs(
        self, odd: OddRuns, size: float, least: float, labels: Sequence[int | str]
    ) -> None:
        """Say that runs stand apart, where what they do is large enough.

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
    """
    counted = steps[:taken]
    rivals = sorted({name for step in counted for name in step.rivals if name not in present})
    verdict, shown = decide(runs, names, rivals, nameless)
    depends = [what for step in steps for what in describe(step)]
    shapes = [s.selected for s in counted if s.selected and not s.selected.candidate.named]
    unnamed = sum(shape.size**2 for shape in shapes)
    return Conclusion(verdict, shown, names, rivals, depends, unnamed=unnamed)


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
    """Say on what a shape without a name depends; on several things, where they look alike."""
    if step.selected is None or step.selected.candidate.named:
        return []
    candidate, result = step.selected.candidate, step.selected.result
    return [
        {
            "covariate": covariate,
            "shape": shape,
            "p": family_p(step.round, candidate, result),
            "rms_arcsec": step.selected.size,
        }
        for covariate, shape in ((candidate.covariate, candidate.shape), *candidate.also)
    ]
