"""The model that a selection adds to, round by round: what a selection asks of it.

Evidence alone answers by one linear step (`one_step.EvidenceModel`). Recordings answer by refits
(`refits.RecordedModel`); what only refits can do stands here: the methods that are not abstract.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lostmotion.candidates.candidate import Candidate
from lostmotion.discover.contest_round import ContestRound
from lostmotion.discover.linearise import Settled
from lostmotion.evidence.contest import Result

FloatArray = npt.NDArray[np.float64]


@dataclass
class Lead:
    """A candidate on the shortlist, and the round that it starts from."""

    round: ContestRound
    result: Result
    size: float | None
    """Arc seconds; None where the tangent says nothing of it and only the refit tells."""
    absorbed: bool = False
    """Whether it may be larger than it looks (`rules.TAKEN_UP`)."""

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
    """None where there is evidence alone."""
    gain: float
    gain_by_run: FloatArray
    size: float = 0.0
    passes: bool = True

    @property
    def name(self) -> str:
        """Name of the candidate."""
        return self.result.name


class GrowingModel(ABC):
    """The model of a selection.

    Attributes
    ----------
    runs : int
    within : float
        Noise within runs, arc seconds.
    given : dict
        Effects that the model had at the start, with their sizes in arc seconds.
    """

    runs: int
    within: float
    given: dict[str, float]

    @abstractmethod
    def compete(self) -> tuple[ContestRound, list[Result]]:
        """Judge every candidate beside the model as it is, strongest first."""

    @abstractmethod
    def with_candidate(self, lead: Lead) -> Contender | None:
        """The model with a candidate; None where it leads to numbers that say nothing."""

    @abstractmethod
    def passes_gates(self, contender: Contender, count: int) -> bool:
        """Whether an effect passes the gates in the model with it; `count` tests are paid for."""

    @abstractmethod
    def size_within(self, contender: Contender) -> float:
        """Size of a candidate in the model with it, arc seconds."""

    @abstractmethod
    def fall_of_error(self, contender: Contender) -> float:
        """Root mean square, arc seconds, by which it lowers the error of all runs together.

        Where runs differ by what has no exact form in the library, their own stiffness and gap
        absorb most of it, and the effect beside them looks small.
        """

    @abstractmethod
    def fall_of_left_out(self, contender: Contender) -> float:
        """Fall of the leave-one-run-out mean square by a candidate, arc seconds squared."""

    @abstractmethod
    def take(self, contender: Contender, count: int) -> None:
        """Take a candidate into the model; effects that it makes idle are dropped."""

    @abstractmethod
    def substitutes(
        self, current: ContestRound, chosen: Contender, rivals: Sequence[Result]
    ) -> list[str]:
        """Names of the rivals that could are in the model instead of what was chosen."""

    # --- what only refits can do -----------------------------------------------------------------

    def more_starts(self, leads: list[Lead], count: int) -> list[Lead]:
        """Add leads of a model in which all runs are equal; `count` tests are paid for."""
        return leads

    def unjudged(
        self, current: ContestRound, results: list[Result], leads: list[Lead]
    ) -> list[Lead]:
        """Leads that are worth a refit whatever their tangents say."""
        return []

    def sharpened(self, current: ContestRound, shape: Contender) -> Contender | None:
        """A shape with its frequency found more closely."""
        return None
