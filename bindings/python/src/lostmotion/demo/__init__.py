"""The demonstration: from a recorded campaign to the controller, with a report."""

from lostmotion.demo.story import Demonstration, demonstrate, show_demonstration

__all__ = ["Demonstration", "demonstrate", "show_demonstration"]
