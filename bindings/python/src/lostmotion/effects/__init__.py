"""The effects that may be missing: those of the C library, and the user's own."""
