"""The baseline model of a drive, fitted to its recordings, effects included."""

from lostmotion.callable_module import make_callable

make_callable(__name__)
