"""Effects whose values are neither linear nor small: one file each, under its name."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any


@cache
def own_forms() -> dict[str, Any]:
    """The `FORM` of every file here, by the name of the effect."""
    names = [module.name for module in iter_modules(__path__)]
    return {name: import_module(f"{__name__}.{name}").FORM for name in names}
