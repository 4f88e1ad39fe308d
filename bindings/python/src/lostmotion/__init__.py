"""Lost motion in strain-wave gears: predict it, compare it with measurements, find what is missing.

The work is done by the C library `lostmotion`, which this package builds and calls in both of its
precisions; here are files, units, answers and the command line.
"""

from lostmotion.errors import InputError, LibraryError, LostMotionError

__version__: str

__all__ = ["InputError", "LibraryError", "LostMotionError", "__version__"]


def __getattr__(name: str) -> str:
    """Look the version up when somebody asks for it, which takes longer than all else here."""
    if name != "__version__":
        raise AttributeError(f"module 'lostmotion' has no attribute '{name}'")
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("lostmotion")
    except PackageNotFoundError:  # pragma: no cover - only in a tree that was never installed
        return "0"
