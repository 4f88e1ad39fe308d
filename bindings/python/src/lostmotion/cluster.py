"""A Dask cluster by the address of its scheduler."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator
from typing import Any

from lostmotion.errors import InputError, one_line

LOG = logging.getLogger(__name__)

PATIENCE = "10s"
"""How long a scheduler may take to answer."""


def no_dask() -> InputError:
    """Say that Dask was asked for and is not there."""
    return InputError("--dask", "", "no Dask here", "pip install distributed pyarrow")


@contextlib.contextmanager
def connect(address: str) -> Iterator[Any]:
    """Connect to a cluster; one without workers is told, and waited for: it may be starting some.

    Yields
    ------
    distributed.Client

    Raises
    ------
    InputError
        Without Dask, or where no scheduler answers.
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
    try:
        if not client.scheduler_info()["workers"]:
            LOG.warning("%s has no workers yet; waiting for one", address)
        yield client
    finally:
        client.close()
