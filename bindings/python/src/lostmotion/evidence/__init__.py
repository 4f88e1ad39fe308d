"""What recordings say of any linear hypothesis: noise, Gram matrices, run-to-run scatter, tests.

Nothing here knows what a drive is.
"""
