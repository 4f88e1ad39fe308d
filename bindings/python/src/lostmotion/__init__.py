"""Lost motion in strain-wave gears: predict it, compare it with measurements, find what is missing.

The work is done by the C library `lostmotion`, which this package builds and calls in both of its
precisions; here are files, units, answers and the command line. What the commands do, functions do
too::

    from lostmotion.drives import read_drive
    from lostmotion.predict import predict
    from lostmotion.recordings import read_campaign
    from lostmotion.compare import compare
    from lostmotion.discover import diagnose, fit_model

    drive = read_drive("joint.toml")
    campaign = read_campaign("recordings/", ratio=drive.ratio)
    found = diagnose(campaign, drive)
    print(found.verdict, found.effects)
    fitted = fit_model(drive, campaign, add=found.effects)

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

HOMES = {
    "read_drive": "drives",
    "write_drive": "drives",
    "predict": "predict",
    "clearances": "predict",
    "read_campaign": "recordings",
    "Campaign": "recordings",
    "make_backbone": "model",
    "design_model": "model",
    "compare": "compare",
    "diagnose": "discover",
    "fit_model": "discover",
    "effect": "discover",
    "formula": "discover",
    "Value": "discover",
    "search": "design",
    "write_report": "report",
}
"""What is looked for here, and the module that has it."""


def __dir__() -> list[str]:
    """List the modules beside what is loaded already."""
    return sorted({*globals(), *MODULES, "__version__"})


def __getattr__(name: str) -> Any:
    """Load a module, or look the version up, when somebody asks for it: both take their time."""
    if name in MODULES:
        return import_module(f"lostmotion.{name}")
    if name != "__version__":
        home = HOMES.get(name)
        hint = "" if home is None else f": from lostmotion.{home} import {name}"
        raise AttributeError(f"module 'lostmotion' has no attribute '{name}'{hint}")
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("lostmotion")
    except PackageNotFoundError:  # pragma: no cover - only in a tree that was never installed
        return "0"
