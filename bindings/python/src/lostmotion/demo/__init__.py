"""The demonstration: one story from a recorded campaign to the controller, and one report."""

from lostmotion.demo.story import Demonstration, demonstrate, show_demonstration

__all__ = ["Demonstration", "demonstrate", "show_demonstration"]
