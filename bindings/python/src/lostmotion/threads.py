"""Threads: one for the linear algebra, whose matrices are small; many for pieces of work apart."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from threadpoolctl import threadpool_limits

Item = TypeVar("Item")
Answer = TypeVar("Answer")

WORKERS_MAX = 8


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Hold the linear algebra to one thread."""
    with threadpool_limits(1):
        yield


def in_parallel(work: Callable[[Item], Answer], items: Sequence[Item]) -> list[Answer]:
    """Do the same with each item, several at a time; answers in the order of the items."""
    workers = min(cores(), len(items), WORKERS_MAX)
    if workers < 2:
        return [work(item) for item in items]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(work, items))


def cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1
