"""One thread for the linear algebra: matrices are small, and waiting costs more than it wins."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

try:
    from threadpoolctl import threadpool_limits
except ImportError:  # it only makes things faster
    threadpool_limits = None


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Hold the linear algebra to one thread, where that can be done."""
    if threadpool_limits is None:
        yield
        return
    with threadpool_limits(1):
        yield
