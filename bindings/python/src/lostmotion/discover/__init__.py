"""Diagnosis of missing effects by joint refits of baseline and candidates, judged run by run."""

from lostmotion.discover.answer import Diagnosis
from lostmotion.discover.diagnosis import diagnose
from lostmotion.discover.fitted_model import FittedModel, fit_model
from lostmotion.effects.effect import Effect, Value, effect
from lostmotion.effects.formula import formula
from lostmotion.effects.library import library
from lostmotion.effects.loading import load
from lostmotion.shipped import include_folder

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
