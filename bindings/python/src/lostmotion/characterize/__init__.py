"""Characterization: standard figures of a drive, and a drive file, from recordings alone.

Stretches of the steady loop are cut out of the recordings (`stretches`); their mean curve becomes
three straight lines with standard errors (`three_slopes`), lost motion and hysteresis loss by the
definitions of catalogues (`figures`) and backlash (`backlash`); all together are a
`Characterization`, with a drive file that every command takes.
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
