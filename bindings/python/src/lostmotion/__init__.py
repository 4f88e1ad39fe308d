"""Lost motion in strain-wave gears: predict it, compare it with measurements, find what is missing.

The work is done by the C library `lostmotion`, which this package builds and calls in both of its
precisions; here are files, units, answers and the command line.
"""

from importlib.metadata import PackageNotFoundError, version

from lostmotion.errors import InputError, LibraryError, LostMotionError

try:
    __version__ = version("lostmotion")
except PackageNotFoundError:  # pragma: no cover - only in a tree that was never installed
    __version__ = "0"

__all__ = ["InputError", "LibraryError", "LostMotionError", "__version__"]
