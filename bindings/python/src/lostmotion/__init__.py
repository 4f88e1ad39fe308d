"""Lost motion in strain-wave gears: predict it, compare it with measurements, find what is missing.

The work is done by the C library `lostmotion`, which this package builds and calls in both of its
precisions; here are files, units, answers and the command line. What the commands do, functions do
too::

    from lostmotion.drives import read_drive
    from lostmotion.predict import predict
    from lostmotion.recordings import read_campaign
    from lostmotion.model import make_backbone
    from lostmotion.compare import compare
    from lostmotion.discover import diagnose

    drive = read_drive("joint.toml")
    campaign = read_campaign("recordings/", ratio=drive.ratio)
    found = diagnose(campaign, ratio=drive.ratio, rated_torque_Nm=drive.rated_torque_Nm,
                     backbone=make_backbone(drive, 40.0))
    print(found.verdict, found.effects)

The modules are loaded when they are asked for: ``lostmotion.drives`` needs no import of its own.
"""

from importlib import import_module
from typing import Any

from lostmotion.errors import InputError, LibraryError, LostMotionError

__version__: str

__all__ = ["InputError", "LibraryError", "LostMotionError", "__version__"]


MODULES = (
    "catalogue",
    "compare",
    "core",
    "design",
    "discover",
    "drives",
    "export",
    "model",
    "predict",
    "recordings",
    "replay",
    "report",
    "units",
)
"""What there is to be imported from."""


def __dir__() -> list[str]:
    """List the modules beside what is loaded already."""
    return sorted({*globals(), *MODULES, "__version__"})


def __getattr__(name: str) -> Any:
    """Load a module, or look the version up, when somebody asks for it: both take their time."""
    if name in MODULES:
        return import_module(f"lostmotion.{name}")
    if name != "__version__":
        raise AttributeError(f"module 'lostmotion' has no attribute '{name}'")
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("lostmotion")
    except PackageNotFoundError:  # pragma: no cover - only in a tree that was never installed
        return "0"
