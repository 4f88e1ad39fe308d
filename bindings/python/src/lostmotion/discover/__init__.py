"""Which physical effect is missing: joint refits of base and candidates, judged run by run."""

from lostmotion.discover.diagnosis import Diagnosis, diagnose
from lostmotion.discover.effects import Effect, Value, effect, library, load
from lostmotion.discover.formula import formula
from lostmotion.discover.ladder import FittedModel, fit_model
from lostmotion.discover.template import include_folder

__all__ = [
    "Diagnosis",
    "Effect",
    "FittedModel",
    "Value",
    "diagnose",
    "effect",
    "fit_model",
    "formula",
    "include_folder",
    "library",
    "load",
]
