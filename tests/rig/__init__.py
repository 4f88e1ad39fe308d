"""A test rig of our own: simulated campaigns of strain-wave drives with hidden effects.

Nothing here imports the library or shares a formula with it: the rig judges what the library says
about the files that the rig writes.
"""
