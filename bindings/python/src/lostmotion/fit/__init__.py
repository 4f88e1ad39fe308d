"""The baseline model of a drive, fitted to its recordings, effects included."""
