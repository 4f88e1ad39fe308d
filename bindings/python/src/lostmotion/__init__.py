"""Predict, measure and diagnose the lost motion of strain-wave gears.

    import lostmotion as lm

    drive = lm.read_drive("joint.toml")
    campaign = lm.read_campaign("recordings/", ratio=drive.ratio)  # files, folders, data frames
    print(lm.compare(drive, campaign))
    found = lm.diagnose(drive, campaign)
    fitted = lm.fit(drive, campaign, add=found.effects)
    print(fitted.fit_report())
    fitted.plot()

Functions take the drive first and the data second. The C library `lostmotion`, which this package
contains in both precisions, does the computations. Modules are loaded on first use; functions that
are not listed here are in the modules (``lostmotion.drives``, ``lostmotion.export`` ...).
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from lostmotion.errors import InputError, LibraryError, LostMotionError
from lostmotion.first_use import load_name

if TYPE_CHECKING:
    from lostmotion.characterize import characterize
    from lostmotion.compare.comparison import Comparison, compare
    from lostmotion.design.result import SearchResult
    from lostmotion.design.running import search as design
    from lostmotion.discover import Diagnosis, FittedModel, diagnose
    from lostmotion.discover import fit_model as fit
    from lostmotion.drives import Drive, read_drive, write_drive
    from lostmotion.effects.effect import Effect, Value, effect
    from lostmotion.effects.formula import formula
    from lostmotion.predict import clearances, predict
    from lostmotion.recordings import Campaign, read_campaign
    from lostmotion.report import write_report

__version__: str

FROM = {
    "Campaign": "recordings",
    "Comparison": "compare",
    "Diagnosis": "discover",
    "Drive": "drives",
    "Effect": "discover",
    "FittedModel": "discover",
    "SearchResult": "design",
    "Value": "discover",
    "characterize": "",
    "clearances": "predict",
    "compare": "",
    "design": "",
    "diagnose": "discover",
    "effect": "discover",
    "fit": "",
    "formula": "discover",
    "predict": "",
    "read_campaign": "recordings",
    "read_drive": "drives",
    "write_drive": "drives",
    "write_report": "report",
}
"""Module of each public name; a module that is named like a function is callable
(`callable_module`)."""

MODULES = (
    "catalogue",
    "characterize",
    "compare",
    "core",
    "design",
    "discover",
    "drives",
    "export",
    "fit",
    "model",
    "predict",
    "recordings",
    "replay",
    "report",
    "units",
)
"""Importable modules."""

__all__ = [
    "Campaign",
    "Comparison",
    "Diagnosis",
    "Drive",
    "Effect",
    "FittedModel",
    "InputError",
    "LibraryError",
    "LostMotionError",
    "SearchResult",
    "Value",
    "__version__",
    "characterize",
    "clearances",
    "compare",
    "design",
    "diagnose",
    "effect",
    "fit",
    "formula",
    "predict",
    "read_campaign",
    "read_drive",
    "write_drive",
    "write_report",
]


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)


def __getattr__(name: str) -> Any:
    """Load modules, names and the version on first use."""
    if name in MODULES:
        return import_module(f"lostmotion.{name}")
    if name != "__version__":
        return load_name(__name__, name, FROM)
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("lostmotion")
    except PackageNotFoundError:  # pragma: no cover - only in a tree that was never installed
        return "0"
