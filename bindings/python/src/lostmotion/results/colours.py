"""Colours of charts and drawings."""

from __future__ import annotations

INK = "#1b1b1f"
SOFT = "#5f6368"
FAINT = "#9aa0a6"
GRID = "#e4e6e9"
PAPER = "#ffffff"
BLUE = "#0077bb"
ORANGE = "#ee7733"
RED = "#cc3311"
TEAL = "#009988"
"""Paul Tol's vibrant colours: distinct for all types of colour vision, and in print."""

MEASURED, MODEL, WITH_EFFECTS = SOFT, ORANGE, BLUE

BAND = "#e3e5e8"
"""Band of the noise floor."""

SIGNED = [[0.0, BLUE], [0.5, PAPER], [1.0, ORANGE]]
"""Colour scale of a signed quantity: blue below zero, orange above."""
