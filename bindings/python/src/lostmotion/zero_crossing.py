"""Zero of a function of one variable between two places.

SciPy has one too, and takes longer to load than most drawings and reports take to be made.
"""

from __future__ import annotations

from collections.abc import Callable


def zero_between(
    function: Callable[[float], float], low: float, high: float, accuracy: float
) -> float:
    """Find the zero of a continuous function between two places where its signs differ.

    Regula falsi in the form of Illinois: the value at an end that remains is halved, so that both
    ends move. The last step is at most `accuracy`.
    """
    end, at_end = low, function(low)
    place, value = high, function(high)
    if not at_end * value <= 0.0:
        raise ValueError(f"no change of sign between {low} and {high}")
    step = high - low
    while value != 0.0 and abs(step) > accuracy:
        step = value * (place - end) / (at_end - value)
        before, value_before = place, value
        place += step
        value = function(place)
        if (value < 0.0) != (value_before < 0.0):
            end, at_end = before, value_before
        else:
            at_end *= 0.5
    return place
