"""One task of a search as bytes, so that any executor can run it.

The answer depends only on the spec and the task. Worker and client must have the same build of the
package, identified by version and struct sizes.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from lostmotion import __version__
from lostmotion.design.engine import engine
from lostmotion.errors import LostMotionError


@lru_cache(maxsize=4)
def prepared(text: str) -> Any:
    """Return the problem of a spec's text."""
    ffi, lib = engine()
    problem = ffi.new("lm_problem *")
    error = ffi.new("lm_spec_error *")
    if lib.lm_read_spec(text.encode(), problem, error) != 0:
        raise LostMotionError(f"the spec is not one of this build: {ffi.string(error.text)!r}")
    return problem


def build_mark() -> tuple[str, int, int]:
    """Identification of the build, which must be equal on client and worker."""
    ffi, _ = engine()
    return __version__, ffi.sizeof("lm_task"), ffi.sizeof("lm_answer")


def do_task(text: str, task: bytes, mark: tuple[str, int, int]) -> bytes:
    """Run a task.

    Parameters
    ----------
    text : str
        Spec in the format of the optimizer.
    task : bytes
        An `lm_task`.
    mark : tuple
        `build_mark` of the client.

    Returns
    -------
    bytes
        The `lm_answer`, without unused entries of its list.
    """
    if tuple(mark) != build_mark():
        raise LostMotionError(
            f"the worker has lostmotion {build_mark()}, the client {tuple(mark)}: install the same "
            "build on both"
        )
    ffi, lib = engine()
    problem = prepared(text)
    given = ffi.new("lm_task *")
    ffi.buffer(given)[:] = task
    answer = ffi.new("lm_answer *")
    workspace = ffi.gc(lib.lm_create_workspace(), lib.lm_free_workspace)
    if workspace == ffi.NULL:
        raise MemoryError
    status = lib.lm_run_task(problem, given, answer, workspace, ffi.NULL)
    if status != 0:
        raise LostMotionError(ffi.string(lib.lm_status_sentence(status)).decode())
    used = answer.solution_count + answer.member_count
    size = ffi.offsetof("lm_answer", "solution") + used * ffi.sizeof("lm_solution")
    return bytes(ffi.buffer(answer, size))
