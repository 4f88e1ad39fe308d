"""Tooth profiles and the quantities of a gear drawing, out of the computer."""
