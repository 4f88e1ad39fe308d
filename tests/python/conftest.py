"""What the tests of the Python package share."""

from __future__ import annotations

import copy
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from lostmotion.drives import format_toml

DATA = Path(__file__).parents[1] / "data"

# The same examples in every run, so that a failure is the change's; HYPOTHESIS_PROFILE=default
# looks for new ones.
settings.register_profile("repeatable", derandomize=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))

needs_compiler = pytest.mark.skipif(
    shutil.which("cc") is None, reason="no C compiler: apt install build-essential"
)
NO_SEARCH = (
    "the package was built without NLopt: apt install build-essential libnlopt-dev, then build and "
    "install it again"
)
NO_DASK = "no Dask: pip install 'lostmotion[dask]'"

# Harmonic Drive size 25, ratio above 50 (catalogue/torsional_stiffness.csv), rated 67 N m.
BOUGHT: dict[str, Any] = {
    "drive": {"name": "joint 2", "ratio": 100, "rated_torque_Nm": 67},
    "catalogue": {
        "T1_Nm": 14,
        "T2_Nm": 48,
        "K1_Nm_per_rad": 31e3,
        "K2_Nm_per_rad": 50e3,
        "K3_Nm_per_rad": 57e3,
        "hysteresis_arcmin": 1,
        "lost_motion_arcmin": 1,
    },
}

# A drive on the drawing board, size 20: every key that a file must have, and a few more.
DRAWN: dict[str, Any] = {
    "drive": {"name": "joint 3", "ratio": 100, "rated_torque_Nm": 40},
    "design": {
        "teeth": {
            "deformation": "internal",
            "module_mm": 0.25,
            "flexspline_teeth": 200,
            "rigid_teeth": 202,
            "pressure_angle_deg": 20,
            "flexspline_shift": 3.0,
            "rigid_shift": 2.957,
            "tooth_height": 1.75,
            "engagement_depth": 1.2,
            "root_clearance": 0.35,
            "face_width_mm": 10,
        },
        "generator": {"type": "discs", "deflection_mm": 0.2375, "contact_half_angle_deg": 30},
        "flexspline": {"rim_thickness_mm": 0.6},
    },
}


@pytest.fixture
def bought() -> dict[str, Any]:
    return copy.deepcopy(BOUGHT)


@pytest.fixture
def drawn() -> dict[str, Any]:
    return copy.deepcopy(DRAWN)


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write a file; a document becomes TOML."""

    def write_file(content: str | dict[str, Any], name: str = "drive.toml") -> Path:
        path = tmp_path / name
        path.write_text(content if isinstance(content, str) else format_toml(content))
        return path

    return write_file
