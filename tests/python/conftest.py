"""Fixtures of the tests of the Python package."""

from __future__ import annotations

import copy
import os
import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

from lostmotion.drives import format_toml

sys.path.insert(0, str(Path(__file__).parents[1] / "fuzz"))
from small_search import SMALL, Write, format_spec, left_by
from sound_files import BOUGHT, DRAWN

DATA = Path(__file__).parents[1] / "data"

# The same examples in every run, so that a failure is due to the change; HYPOTHESIS_PROFILE=default
# looks for new ones. A busy machine is no failure.
settings.register_profile(
    "repeatable", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))

# Programs that the tests start must receive Ctrl-C. A shell starts background jobs with the signal
# ignored, and child processes inherit this.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

FITTED = """
[drive]
name = "a fitted joint that turns backwards"
ratio = -101
rated_torque_Nm = 40
[catalogue]
T1_Nm = 7
T2_Nm = 25
K1_Nm_per_rad = 16e3
K2_Nm_per_rad = 25e3
K3_Nm_per_rad = 29e3
[fit]
noise_floor_arcsec = 2.0
[fit.values]
knot_1_Nm = 10.0
knot_2_Nm = 30.0
slope_1_rad_per_Nm = 6e-5
slope_2_rad_per_Nm = 4e-5
slope_3_rad_per_Nm = 3.5e-5
play_radius_1_Nm = 1.0
play_radius_2_Nm = 4.0
play_share_1 = 0.1
play_share_2 = 0.15
play_envelope_Nm = 3.0
play_envelope_knee_Nm = 10.0
"""
"""Friction in parallel with the spring that follows an envelope, as a fit finds it."""

needs_compiler = pytest.mark.skipif(
    shutil.which("cc") is None, reason="no C compiler: apt install build-essential"
)
NO_SEARCH = (
    "the package was built without NLopt: apt install build-essential libnlopt-dev, then build and "
    "install it again"
)
NO_DASK = "no Dask: pip install distributed"


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


@pytest.fixture
def small_spec() -> dict[str, Any]:
    return copy.deepcopy(SMALL)


@pytest.fixture
def write_spec(tmp_path: Path) -> Write:
    """Write a search spec."""

    def write_file(document: dict[str, Any]) -> Path:
        path = tmp_path / "spec.toml"
        path.write_text(format_spec(document), encoding="utf-8")
        return path

    return write_file


@pytest.fixture(scope="session")
def searched(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, dict[str, bytes]]:
    """The small spec, searched by one thread without interruption."""
    from lostmotion import design

    folder = tmp_path_factory.mktemp("searched")
    spec = folder / "spec.toml"
    spec.write_text(format_spec(SMALL), encoding="utf-8")
    design.search(spec, folder / "run", workers=1)
    return spec, folder / "run", left_by(folder / "run")
