"""What competes to be what the baseline model lacks: named effects, and shapes without a name."""
