"""Characterization: standard figures of a drive, and a drive file, from recordings alone.

Sections of the steady loop are selected from the recordings (`stretches`). Their mean curve gives
three straight lines with standard errors (`three_slopes`), lost motion and hysteresis loss by
catalogue definitions (`figures`), and backlash (`backlash`). The result is a `Characterization`
with a drive file for all commands.
"""

from lostmotion.callable_module import make_callable
from lostmotion.characterize.characterization import (
    Characterization,
    StandardFigures,
    characterize,
    standard_figures,
)

__all__ = [
    "Characterization",
    "StandardFigures",
    "characterize",
    "standard_figures",
]

make_callable(__name__)
