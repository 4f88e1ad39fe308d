"""Names of a package whose modules are loaded on first use."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib import import_module
from typing import Any


def load_name(package: str, name: str, homes: Mapping[str, str]) -> Any:
    """Load a name of a package, for its ``__getattr__``.

    Parameters
    ----------
    package : str
        Its ``__name__``.
    homes : mapping
        Module of each name, within the package.

    Raises
    ------
    AttributeError
        The package has no such name.
    """
    if name not in homes:
        raise AttributeError(f"module '{package}' has no attribute '{name}'")
    found = getattr(import_module(f"{package}.{homes[name]}"), name)
    setattr(sys.modules[package], name, found)
    return found
