"""What the tests of the Python package share."""

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
from hypothesis import settings

from lostmotion.drives import format_toml

sys.path.insert(0, str(Path(__file__).parents[1] / "fuzz"))
from small_search import SMALL, Write, format_spec, left_by
from sound_files import BOUGHT, DRAWN

DATA = Path(__file__).parents[1] / "data"

# The same examples in every run, so that a failure is the change's; HYPOTHESIS_PROFILE=default
# looks for new ones.
settings.register_profile("repeatable", derandomize=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))

# Programs that the tests start must hear Ctrl-C, though a shell starts what runs in the background
# with the signal ignored, and this is inherited.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

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
    """The small spec, searched by one thread without a break."""
    from lostmotion import design

    folder = tmp_path_factory.mktemp("searched")
    spec = folder / "spec.toml"
    spec.write_text(format_spec(SMALL), encoding="utf-8")
    design.search(spec, folder / "run", workers=1)
    return spec, folder / "run", left_by(folder / "run")
