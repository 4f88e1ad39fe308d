"""Candidates for what the baseline model lacks: named effects and unnamed shapes."""
