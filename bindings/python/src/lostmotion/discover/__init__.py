"""Which physical effect is missing: joint refits of base and candidates, judged run by run."""

from lostmotion.discover.diagnosis import Diagnosis, diagnose
from lostmotion.discover.effects import Effect, Value, effect, library
from lostmotion.discover.formula import formula

__all__ = ["Diagnosis", "Effect", "Value", "diagnose", "effect", "formula", "library"]
