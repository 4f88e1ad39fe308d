"""A Dask cluster by the address of its scheduler."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Iterator
from typing import Any

from lostmotion.errors import InputError, one_line

LOG = logging.getLogger(__name__)

PATIENCE = "10s"
"""Timeout for the answer of a scheduler."""

LOOK_S = 5.0
"""Time between two checks whether a cluster still has workers."""


def no_dask() -> InputError:
    """State that Dask was requested and is not installed."""
    return InputError("--dask", "", "no Dask installation", "pip install distributed")


def _watch(client: Any, address: str, working: bool, ended: threading.Event) -> None:
    """Report when the last worker is lost: submitted tasks would wait silently."""
    while not ended.wait(LOOK_S):
        try:
            workers = client.scheduler_info()["workers"]
        except Exception:  # no scheduler (the work reports it), or the work has ended
            return
        if working and not workers:
            LOG.warning("%s has no workers any more; waiting for one", address)
        working = bool(workers)


@contextlib.contextmanager
def connect(address: str) -> Iterator[Any]:
    """Connect to a cluster; if it has no workers, report this and wait for them.

    The same if the last worker is lost during work.

    Yields
    ------
    distributed.Client

    Raises
    ------
    InputError
        If Dask is not installed or no scheduler answers.
    """
    expected = "the address of a scheduler that answers, as tcp://host:8786"
    if "://" not in address:
        raise InputError("--dask", "", f"'{address}'", expected)
    try:
        from distributed import Client
    except ImportError:
        raise no_dask() from None
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError) as error:
        found = f"'{address}' ({one_line(str(error))})"
        raise InputError("--dask", "", found, expected) from None
    ended = threading.Event()
    try:
        working = bool(client.scheduler_info()["workers"])
        if not working:
            LOG.warning("%s has no workers yet; waiting for one", address)
        threading.Thread(target=_watch, args=(client, address, working, ended), daemon=True).start()
        yield client
    finally:
        ended.set()
        client.close()
