"""Threads: one for linear algebra with small matrices, several for independent work."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache
from typing import Any, TypeVar

Item = TypeVar("Item")
Answer = TypeVar("Answer")

WORKERS_MAX = 8


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Limit linear algebra to one thread: its sums depend on the number of threads.

    SciPy's library is loaded first, because one that is loaded later is not limited.
    """
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        yield


def in_parallel(work: Callable[[Item], Answer], items: Sequence[Item]) -> list[Answer]:
    """Apply a function to each item in parallel; results in the order of the items.

    Work that is done in parallel may do its own parts in parallel: the calling thread takes items
    too and never waits for a thread that has not begun. The result does not depend on the number of
    threads if each item is independent of the others.
    """
    helpers = min(cores(), len(items), WORKERS_MAX) - 1
    if helpers < 1:
        return [work(item) for item in items]
    answers: list[Any] = [None] * len(items)
    places = iter(range(len(items)))  # each place is taken once, whichever thread is next

    def take() -> None:
        for place in places:
            answers[place] = work(items[place])

    begun = [pool().submit(take) for _ in range(helpers)]
    try:
        take()
    finally:
        running = [helper for helper in begun if not helper.cancel()]
        wait(running)
    for helper in running:
        helper.result()
    return answers


def both(one: Callable[[], Answer], other: Callable[[], Item]) -> tuple[Answer, Item]:
    """Results of two independent pieces of work, done in parallel."""
    work: list[Callable[[], Any]] = [one, other]
    first, second = in_parallel(lambda piece: piece(), work)
    return first, second


def begin(work: Callable[[], Answer]) -> Callable[[], Answer]:
    """Start work that is needed later beside the calling thread; returns a function for its result.

    If no thread has begun it when the result is asked for, or there is one core, it is done then.
    """
    if cores() < 2:
        return cache(work)
    begun = pool().submit(work)

    @cache
    def result() -> Answer:
        return work() if begun.cancel() else begun.result()

    return result


@cache
def pool() -> ThreadPoolExecutor:
    """Threads beside the calling one; kept, because their start takes as long as small work."""
    return ThreadPoolExecutor(min(cores(), WORKERS_MAX))


def cores() -> int:
    """Number of cores available to this process."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1
