"""Modules that are callable as the function of the same name.

``lostmotion.compare`` is a package and a function: ``lm.compare(drive, campaign)`` compares, and
``from lostmotion.compare import Comparison`` imports. Importing a package binds it to its name, so
that a function of the same name would be replaced.
"""

from __future__ import annotations

import inspect
import sys
from importlib import import_module
from types import ModuleType
from typing import Any

CALLED = {
    "characterize": ("characterize", "characterize"),
    "compare": ("compare", "compare"),
    "design": ("design", "search"),
    "fit": ("discover", "fit_model"),
    "predict": ("predict", "predict"),
}
"""Module and function that a call of ``lostmotion.NAME`` calls."""


class CallableModule(ModuleType):
    """A module that calls its function when it is called."""

    @property
    def called(self) -> Any:
        """The function."""
        module, function = CALLED[self.__name__.partition(".")[2]]
        return getattr(import_module(f"lostmotion.{module}"), function)

    @property
    def __signature__(self) -> inspect.Signature:
        """Signature of the function."""
        return inspect.signature(self.called)

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the function."""
        return self.called(*arguments, **named)


def make_callable(module: str) -> None:
    """Make a module that is being imported callable."""
    sys.modules[module].__class__ = CallableModule
