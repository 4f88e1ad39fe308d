"""The baseline model of a drive, fitted to its recordings, with effects."""

from lostmotion.callable_module import make_callable

make_callable(__name__)
