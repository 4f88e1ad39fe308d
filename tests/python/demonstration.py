"""The demonstration, made once for the tests of all workers."""

from __future__ import annotations

import fcntl
import json
import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import pytest


class Demonstration(NamedTuple):
    """What `lostmotion demo` wrote and printed."""

    folder: Path
    answer: dict[str, Any]
    out: str
    processor_s: float


def demonstration(tmp_path_factory: pytest.TempPathFactory) -> Demonstration:
    """Run `lostmotion demo` in a folder of its own, if no other worker has; no test changes it."""
    place = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        place = place.parent
    folder, said = place / "demonstration", place / "demonstration.json"
    with (place / "demonstration.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not said.exists():
            begin = children_s()
            done = subprocess.run(
                [sys.executable, "-m", "lostmotion", "demo", "-o", folder, "--json", place / "a"],
                capture_output=True, text=True, check=True,
            )  # fmt: skip
            answer = json.loads((place / "a").read_text())
            said.write_text(json.dumps([answer, done.stdout, children_s() - begin]))
    return Demonstration(folder, *json.loads(said.read_text()))


def children_s() -> float:
    """Processor time of all children so far."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
