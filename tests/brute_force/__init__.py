"""Brute-force tooth clearances of strain-wave gears: a reference for the library's tests."""
