"""Progress of a long call: the one signature of `progress=` in all functions of the package."""

from collections.abc import Callable

OnProgress = Callable[[int, int, str], None]
"""``progress(done, of, step)``: number of completed steps, of all steps, and what is done now.

It is called in the thread of the caller, before a step and at the end, when `step` is empty; `done`
never falls. The steps take different times. An exception that it raises ends the call and reaches
the caller.
"""
