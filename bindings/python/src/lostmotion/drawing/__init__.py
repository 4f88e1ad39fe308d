"""Tooth profiles and the data table of a gear drawing."""
