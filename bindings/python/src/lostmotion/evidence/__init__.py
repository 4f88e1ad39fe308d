"""Evidence of recordings for linear hypotheses: noise, Gram matrices, run-to-run scatter, tests.

Independent of drives.
"""
