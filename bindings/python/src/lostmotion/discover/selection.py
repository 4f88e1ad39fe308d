"""Forward and backward selection of effects and shapes, for recordings and for saved evidence."""

from __future__ import annotations

from collections.abc import Callable

from lostmotion import rules
from lostmotion.discover.choice import Step, choose
from lostmotion.discover.growing_model import GrowingModel
from lostmotion.discover.shortlist import least_size
from lostmotion.evidence.contest import Result


def drop_others(step: Step, after: list[Result]) -> None:
    """Drop the rivals of an effect that explain something else than it does.

    They keep their gain with the selected effect in the model: results `after` it was added.
    """
    gain = {result.name: result.gain for result in after}
    least = {result.name: rules.RIVAL_SHARE * result.gain for result in step.results}
    step.rivals = [name for name in step.rivals if gain.get(name, 0.0) < least[name]]


def select(model: GrowingModel, say: Callable[[str], None] = lambda _: None) -> list[Step]:
    """Add the strongest missing candidate to a model, round by round.

    Parameters
    ----------
    model : GrowingModel
        Model to which the selected candidates are added.
    say : callable
        Called with the name of each step before it.

    Returns
    -------
    list of Step
        One step per round. The last selected nothing, or a second unnamed shape that is not added.
    """
    steps: list[Step] = []
    while True:
        say("comparing effects")
        current, results = model.compete()
        if steps:
            drop_others(steps[-1], results)
        taken = [step.selected for step in steps if step.selected is not None]
        sizes = [*(one.size for one in taken), *model.given.values()]
        least = least_size(model.within, max(sizes, default=0.0))
        step = choose(model, current, results, least)
        steps.append(step)
        best = step.selected
        if best is None:
            model.mark_rejected(current)
            return steps
        if not best.candidate.named and any(not one.candidate.named for one in taken):
            return steps
        say(f"refitting with {best.candidate.name}")
        model.take(best, current)
