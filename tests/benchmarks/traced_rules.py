"""Thresholds that carry their changed values along, and note where a comparison depends on them.

A diagnosis whose every comparison has the same outcome with a changed threshold takes the same way
and gives the same answer. So one diagnosis shows which of the changes can be left out. A value that
leaves the arithmetic of this module (a conversion to a number, a place in a list) counts as one
that can change the answer.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any

import numpy as np

Change = tuple[str, float]
"""Name of a threshold, and the share by which it is changed."""

NOTED: set[Change] = set()
"""Changes on which a comparison of the present diagnosis depends."""


class Traced:
    """A number that depends on thresholds.

    Attributes
    ----------
    value : float
    others : dict
        The number under each change.
    """

    def __init__(self, value: Any, others: Mapping[Change, Any]) -> None:
        self.value = value
        self.others = dict(others)

    def escape(self) -> Any:
        """Return the number, and note every change that alters it."""
        NOTED.update(key for key, other in self.others.items() if other != self.value)
        return self.value

    def __float__(self) -> float:
        return float(self.escape())

    def __int__(self) -> int:
        return self.converted(int)

    def __index__(self) -> int:
        return operator.index(self.escape())

    def __bool__(self) -> bool:
        return self.converted(bool)

    def __hash__(self) -> int:
        return hash(self.escape())

    def __format__(self, form: str) -> str:
        return format(self.value, form)

    def __repr__(self) -> str:
        return repr(self.value)

    def converted(self, function: Callable[[Any], Any]) -> Any:
        """Convert the number, and note the changes that alter the result."""
        result = function(self.value)
        NOTED.update(key for key, other in self.others.items() if function(other) != result)
        return result

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *given: Any, **options: Any) -> Any:
        return applied(getattr(ufunc, method), given, options)


def applied(
    function: Callable[..., Any], given: tuple[Any, ...], options: Mapping[str, Any] | None = None
) -> Any:
    """Apply a function to numbers, some of them traced, with each change apart."""
    options = options or {}
    traced = [one for one in given if isinstance(one, Traced)]
    result = function(*(plain(one) for one in given), **options)
    others = {
        key: function(*(changed_to(one, key) for one in given), **options)
        for one in traced
        for key in one.others
    }
    if np.ndim(result) == 0 and not isinstance(result, (bool, np.bool_)):
        return Traced(result, others)
    NOTED.update(key for key, other in others.items() if not np.array_equal(other, result))
    return result


def plain(one: Any) -> Any:
    """A number without its changes."""
    return one.value if isinstance(one, Traced) else one


def changed_to(one: Any, key: Change) -> Any:
    """A number under a change."""
    return one.others.get(key, one.value) if isinstance(one, Traced) else one


def _method(function: Callable[..., Any], turned: bool = False) -> Callable[..., Any]:
    """A method that applies a function, to the numbers in turned order if asked."""
    return lambda self, *other: applied(function, (*other, self) if turned else (self, *other))


for _name in ("add", "sub", "mul", "truediv", "floordiv", "mod", "pow"):
    setattr(Traced, f"__{_name}__", _method(getattr(operator, _name)))
    setattr(Traced, f"__r{_name}__", _method(getattr(operator, _name), turned=True))
for _name in ("lt", "le", "gt", "ge", "eq", "ne", "neg", "pos", "abs"):
    setattr(Traced, f"__{_name}__", _method(getattr(operator, _name)))


class TracedRules(ModuleType):
    """A module whose thresholds are traced."""

    def __getattribute__(self, name: str) -> Any:
        """Return a threshold with its changes."""
        value = super().__getattribute__(name)
        if not name.isupper():
            return value
        changes = super().__getattribute__("changes_of")
        return Traced(value, {(name, share): other for share, other in changes(value).items()})
