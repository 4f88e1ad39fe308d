"""Results and cost of the runtime on every installed target, against the stated limits."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

MEASURE = Path(__file__).with_name("measure.py")


@pytest.mark.parametrize("what", ["golden", "cost"])
def test_no_figure_is_worse_than_its_limit_and_no_bit_differs(what: str) -> None:
    """Targets whose compiler or emulator is missing are named in the output and left out."""
    done = subprocess.run(
        [sys.executable, str(MEASURE), what], capture_output=True, text=True, timeout=900
    )
    print(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr
