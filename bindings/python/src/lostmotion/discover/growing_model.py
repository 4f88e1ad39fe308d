"""The model to which a selection adds candidates, round by round.

Saved evidence uses one linear step (`evidence_model.EvidenceModel`), recordings use refits
(`recorded_model.RecordedModel`). The methods that are not abstract are needed only for refits.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

from lostmotion import rules
from lostmotion.arrays import FloatArray
from lostmotion.candidates.candidate import Candidate
from lostmotion.discover.contest_round import ContestRound
from lostmotion.discover.gates import accepted
from lostmotion.discover.linearise import Settled
from lostmotion.evidence.contest import Result


@dataclass
class Lead:
    """A candidate on the shortlist, and the round from which it starts."""

    round: ContestRound
    result: Result
    size: float | None
    """Arc seconds; None if the tangent gives no estimate and a refit is needed."""

    @property
    def name(self) -> str:
        """Name of the candidate."""
        return self.result.name

    @property
    def candidate(self) -> Candidate:
        """The candidate itself."""
        return self.round.candidates[self.result.name]


@dataclass
class Contender:
    """A candidate with the model that it belongs to."""

    result: Result
    candidate: Candidate
    settled: Settled | None
    """None for saved evidence."""
    gain: float
    gain_by_run: FloatArray
    size: float = 0.0
    explains: bool = True
    """Whether it passes all tests but that of its size."""

    passes: bool = True
    formless: Settled | None = None
    """The model that was fitted without form error, if the candidate was found by such a model."""

    in_model: Result | None = None
    """Of the tests of a named effect in the model with it, if they were done."""

    @property
    def tested(self) -> Result:
        """Of the tests that it must pass last."""
        return self.in_model or self.result

    @property
    def name(self) -> str:
        """Name of the candidate."""
        return self.result.name

    def matched_by(self, result: Result) -> bool:
        """Whether a result has enough of the gain to explain the same."""
        return matched(result.gain, self.gain)


def matched(gain: float, other: float) -> bool:
    """Whether a gain is large enough to be that of an explanation with the `other` gain."""
    return gain >= rules.RIVAL_SHARE * other


class GrowingModel(ABC):
    """The model of a selection.

    Attributes
    ----------
    runs : int
    within : float
        Noise within runs, arc seconds.
    given : dict
        Initial effects of the model, with their sizes in arc seconds.
    replaced : set of str
        Effects that were dropped for one that explains better what they did.
    """

    runs: int
    within: float
    given: dict[str, float]
    replaced: set[str]

    @abstractmethod
    def compete(self) -> tuple[ContestRound, list[Result]]:
        """Test every candidate against the present model, strongest first."""

    @abstractmethod
    def with_candidate(self, lead: Lead) -> Contender | None:
        """The model with a candidate; None if the result is not finite."""

    @abstractmethod
    def tested(self, contender: Contender) -> Result | None:
        """Result of the tests of an effect in the model with it; None if they are not finite."""

    @abstractmethod
    def size_within(self, contender: Contender) -> float:
        """Size of a candidate in the model with it, arc seconds."""

    @abstractmethod
    def fall_of_left_out(self, contender: Contender) -> float:
        """Decrease of the leave-one-run-out mean square by a candidate, arc seconds squared.

        Of the models of the answer (`ladder`).
        """

    def confirms(self, contender: Contender) -> bool:
        """Whether the leave-one-run-out error falls at least as by an effect of the least size."""
        return self.counts_as_fall(self.fall_of_left_out(contender))

    def counts_as_fall(self, fall: float) -> bool:
        """Whether a mean square falls at least as by an effect of the least size."""
        return fall >= (rules.SIZE_LEAST * self.within) ** 2

    @abstractmethod
    def beside(self, contender: Contender, other: Contender) -> Result | None:
        """Result of a candidate with another in the model; None if it is not finite."""

    def keeps_beside(self, contender: Contender, other: Contender) -> bool:
        """Whether a candidate keeps enough of its gain with another in the model."""
        beside = self.beside(contender, other)
        return beside is not None and contender.matched_by(beside)

    def to_drop(
        self, name: str, newest: Contender, count: int, before: Result | None, beside: Result | None
    ) -> bool:
        """Whether an effect of the model is dropped for the newest candidate.

        It is if it no longer passes its tests, or if it keeps less than `rules.RIVAL_SHARE` of the
        gain that it had before: then it explained, for the most part, what the newest explains. It
        competes in the next round for what it still explains, as all others do. It is dropped for
        this reason at most once (noted in `replaced`), so that the selection ends, and not for a
        shape, which has no name.

        Parameters
        ----------
        count : int
            Number of tests for which it is corrected.
        before, beside : Result or None
            Of its tests without and with the newest in the model; None if they are not finite.
        """
        if beside is None or not accepted(beside, count):
            return True
        if before is None or matched(beside.gain, before.gain):
            return False
        if name in self.replaced or not newest.candidate.named:
            return False
        self.replaced.add(name)
        return True

    @abstractmethod
    def take(self, contender: Contender, current: ContestRound) -> None:
        """Add a candidate of a round to the model; superfluous effects are dropped."""

    @abstractmethod
    def substitutes(
        self, current: ContestRound, chosen: Contender, rivals: Sequence[Result]
    ) -> list[str]:
        """Names of rivals that could replace the selected candidate."""

    # --- only with refits ------------------------------------------------------------------------

    def not_kept(self, contender: Contender) -> float:
        """What the linearised present model promises and does not keep, beyond a contender's."""
        return 0.0

    def more_starts(self, current: ContestRound, leads: list[Lead]) -> list[Lead]:
        """Add leads from a model without form error."""
        return leads

    def with_unjudged(
        self, current: ContestRound, results: list[Result], leads: list[Lead]
    ) -> list[Lead]:
        """Leads with those that need a refit, whatever their tangents indicate."""
        return leads

    def with_equal_runs(self, current: ContestRound) -> list[Lead]:
        """Leads from a model in which the runs have no deviations."""
        return []

    def in_place_of(
        self, selected: Contender, current: ContestRound, results: Sequence[Result]
    ) -> list[Lead]:
        """Leads of results of a round, from the best start for what a selected effect explains."""
        return [Lead(current, result, None) for result in results]

    def mark_rejected(self, current: ContestRound) -> None:  # noqa: B027
        """Mark in the last round, for the answer, what refits found confounded with the form."""

    def beats_forms(self, contender: Contender) -> bool:
        """Whether an effect predicts better than the forms that may imitate it."""
        return True

    def sharpened(self, current: ContestRound, shape: Contender) -> Contender | None:
        """A shape with a refined frequency."""
        return None
