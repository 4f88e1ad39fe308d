"""Progress of a search: recorded while it runs, reported in the thread of the caller."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from lostmotion.design.engine import FATES, STAGES, engine, figure_value
from lostmotion.design.result import Designs
from lostmotion.on_progress import OnProgress

OnSnapshot = Callable[[dict[str, Any]], None]
"""Type of the callback that receives the state of a search."""

TICK_SECONDS = 0.2
"""Time between two calls of `progress`, and largest delay of a response to `stop`."""

STEPS = 1000
"""Number of steps of a search for `progress`."""


def reporter(progress: OnProgress | None, watch: OnSnapshot | None) -> OnSnapshot | None:
    """Combine the two callbacks of a search."""
    if progress is None:
        return watch

    def report(seen: dict[str, Any]) -> None:
        progress(int(STEPS * seen["done_share"]), STEPS, seen["stage"])
        if watch is not None:
            watch(seen)

    return report


FRONT_SHOWN = 500
"""Largest number of designs of the front in a report."""


class ProgressReports:
    """Snapshots of a search, and the callback that receives them.

    Parameters
    ----------
    search : cdata
        Of the optimizer.
    designs : Designs
    lead : int
        First objective, by `lm_figure`.
    tell : callable or None
    """

    def __init__(self, search: Any, designs: Designs, lead: int, tell: OnSnapshot | None) -> None:
        self.ffi, self.lib = engine()
        self.search = search
        self.designs = designs
        self.lead = lead
        self.tell = tell
        self.started = time.monotonic()
        self.seen: dict[str, Any] | None = None  # last snapshot, not yet shown
        self.best_at: tuple[int, bytes] | None = None
        self.best: dict[str, Any] | None = None

    def snapshot(self) -> None:
        """Record the state of the search; nothing else may access the search meanwhile."""
        if self.tell is None:
            return
        ffi, lib = self.ffi, self.lib
        p = ffi.new("lm_progress *")
        lib.lm_read_progress(self.search, p)
        found = ffi.new("lm_solution[]", FRONT_SHOWN)
        count = min(lib.lm_read_front(self.search, found, FRONT_SHOWN), FRONT_SHOWN)
        best = ffi.new("lm_solution *")
        has_best = lib.lm_read_best(self.search, best)
        seconds = time.monotonic() - self.started
        left: float | None = None
        if p.work_done >= p.work_total / 50:
            left = seconds * (p.work_total - p.work_done) / max(p.work_done, 1.0)
        fates = {name: int(p.fate[i]) for i, name in enumerate(FATES)}
        self.seen = {
            "stage": STAGES[p.stage],
            "evaluations": int(p.evaluations),
            "budget": int(p.budget),
            "done_share": float(p.work_done / max(p.work_total, 1.0)),
            "best_value": figure_value(self.lead, p.best_value) if p.has_best else None,
            "best": best if has_best else None,
            "feasible_share": float(p.feasible_share),
            "refused": int(p.refused),
            "tasks": int(p.tasks_done),
            "combinations": {**fates, "total": sum(fates.values())},
            "front": [self.designs.objectives(found[i]) for i in range(count)],
            "seconds": seconds,
            "seconds_left": left,
        }

    def show(self) -> None:
        """Report the last snapshot, in the thread of the caller."""
        seen, self.seen = self.seen, None
        if self.tell is None or seen is None:
            return
        best = seen["best"]
        if best is not None:
            at = (int(best.combination), bytes(self.ffi.buffer(best.unit)))
            if at != self.best_at:
                self.best_at = at
                self.best = self.designs.drive(best.combination, best.unit)
            seen["best"] = self.best
        self.tell(seen)
