"""Which physical effect is missing: joint refits of base and candidates, judged run by run."""

from lostmotion.discover.effects import Effect, Value, effect, library


__all__ = ["Effect", "Value", "effect", "library"]
