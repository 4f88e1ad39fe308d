"""Threads: one for linear algebra with small matrices, several for independent work."""

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
    """Limit linear algebra to one thread."""
    with threadpool_limits(1):
        yield


def in_parallel(work: Callable[[Item], Answer], items: Sequence[Item]) -> list[Answer]:
    """Apply a function to each item in parallel; results in the order of the items."""
    workers = min(cores(), len(items), WORKERS_MAX)
    if workers < 2:
        return [work(item) for item in items]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(work, items))


def cores() -> int:
    """Number of cores available to this process."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1
