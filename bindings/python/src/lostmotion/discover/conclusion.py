"""Conclusion from the rounds of a selection: verdict, effects, and the unexplained part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lostmotion.discover.choice import Step
from lostmotion.discover.gates import family_p
from lostmotion.discover.outlier_runs import OutlierRuns
from lostmotion.evidence.sign_flips import runs_least

HYSTERESIS_FORM = "hysteresis form"
"""Shape of a part that depends on the torque and its history in another way than the baseline
model."""

INCONCLUSIVE = "inconclusive"
"""Verdict if there are too few data for any other."""


@dataclass
class Conclusion:
    """The verdict over the rounds of a selection.

    Attributes
    ----------
    verdict : str
    shown : list of str
        Effects that the answer lists.
    names, rivals : list of str
        Missing effects, and effects that explain the data as well as one of them.
    by_effect : dict
        Verdict, confidence and rivals of each effect that is missing, by its name.
    depends_on : list of dict
        Dependences of the unexplained part.
    outliers : OutlierRuns or None
        Outlier runs.
    unnamed : float
        Mean square of the unexplained part, arc seconds squared.
    """

    verdict: str
    shown: list[str]
    names: list[str]
    rivals: list[str]
    by_effect: dict[str, dict[str, Any]] = field(default_factory=dict)
    depends_on: list[dict[str, Any]] = field(default_factory=list)
    outliers: OutlierRuns | None = None
    unnamed: float = 0.0

    def add_outlier_runs(
        self, outliers: OutlierRuns, size: float, least: float, labels: Sequence[int | str]
    ) -> None:
        """Report outlier runs if their deviation is large enough.

        Parameters
        ----------
        outliers : OutlierRuns
        size, least : float
            Their size and the least size that counts, arc seconds.
        labels : sequence
            Of all runs.
        """
        if size >= least:
            self.verdict, self.outliers = "unexplained", outliers
            self.depends_on.append(outliers.told(labels, size))
            self.unnamed += size**2

    def add_form_error(self, size: float, p: float) -> None:
        """Report that the hysteresis has another form, and its effect in arc seconds rms."""
        self.verdict = "unexplained"
        self.depends_on.append(
            {"covariate": "torque", "shape": HYSTERESIS_FORM, "p": p, "rms_arcsec": size}
        )
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
        Number of rounds that changed the model; the result of a further round is the unexplained
        part.
    runs : int
    present, names : sequence of str
        Effects in the model, and those of them that the drive file does not have.
    nameless : bool
        Whether the model has unnamed shapes, or the recordings have sudden events.
    """
    counted = steps[:taken]
    rungs = dict(rung_of(step, present) for step in counted if is_named(step))
    by_effect = {name: said for name, said in rungs.items() if name in names}
    rivals = sorted({rival for said in rungs.values() for rival in said["rivals"]})
    verdict, shown = decide(runs, names, rivals, nameless)
    depends = [what for step in steps for what in describe(step)]
    shapes = [s.selected for s in counted if s.selected and not s.selected.candidate.named]
    unnamed = sum(shape.size**2 for shape in shapes)
    return Conclusion(verdict, shown, names, rivals, by_effect, depends, unnamed=unnamed)


def is_named(step: Step) -> bool:
    """Whether a round has selected a named effect."""
    return step.selected is not None and step.selected.candidate.named


def rung_of(step: Step, present: Sequence[str]) -> tuple[str, dict[str, Any]]:
    """Name and verdict of an effect that was selected."""
    chosen = step.selected
    assert chosen is not None
    rivals = sorted(name for name in step.rivals if name not in present)
    said = {
        "verdict": "ambiguous" if rivals else "missing-effect",
        "confidence": 1.0 - family_p(step.round, chosen.candidate, chosen.tested),
        "rivals": rivals,
    }
    return chosen.name, said


def decide(runs: int, names: list[str], rivals: list[str], nameless: bool) -> tuple[str, list[str]]:
    """Decide the verdict and the effects that it lists.

    Parameters
    ----------
    runs : int
        Runs that were judged.
    names, rivals : list of str
        Effects found, and effects that explain the data as well as one of them.
    nameless : bool
        Whether an unnamed shape or an event was also found.
    """
    if runs < runs_least():
        return ("unexplained" if names or nameless else INCONCLUSIVE), []
    if nameless:
        return "unexplained", names
    if names and rivals:
        return "ambiguous", names + rivals
    return ("missing-effect" if names else "complete"), names


def describe(step: Step) -> list[dict[str, Any]]:
    """Describe the dependence of an unnamed shape; several quantities if these are confounded."""
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
