"""A test rig of our own: simulated campaigns of strain-wave drives with hidden effects.

Nothing here imports the library or shares a formula with it: the rig evaluates the library's
answers on the files that the rig writes.
"""
