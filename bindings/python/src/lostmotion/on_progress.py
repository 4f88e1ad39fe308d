"""Progress of a long call: the one signature of `progress=` in all functions of the package."""

from collections.abc import Callable

OnProgress = Callable[[int, int], None]
"""``progress(done, of)``: number of completed steps, and of all steps.

It is called in the thread of the caller, after each step; `done` never falls. The steps take
different times. An exception that it raises ends the call and reaches the caller.
"""
