"""All logs by name: the dresses, then the faults."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from . import (  # noqa: F401 - they enter their dresses into the list
    dresses_of_benches,
    dresses_of_channels,
    dresses_of_controllers,
    dresses_of_packing,
    dresses_of_programs,
    dresses_of_quantities,
    dresses_of_runs,
    dresses_of_text,
)
from .clean import clean
from .dress import DRESSES
from .faults import Fault, all_faults
from .judge import COMMANDS, Verdict, judge


@cache
def _faults() -> dict[str, Fault]:
    return {fault.name: fault for fault in all_faults()}


def dresses() -> list[str]:
    """Names of the dresses."""
    return list(DRESSES)


def faults() -> list[str]:
    """Names of the faults."""
    return list(_faults())


def fault(name: str) -> Fault:
    """A fault by its name."""
    return _faults()[name]


def names() -> list[str]:
    """Names of all logs."""
    return dresses() + faults()


def verdict(name: str, commands: Sequence[str] = COMMANDS, alone: bool = False) -> Verdict:
    """Write a log, run the commands on it, and check their answers."""
    with tempfile.TemporaryDirectory() as folder:
        if name in DRESSES:
            dress = DRESSES[name]
            written = dress.write(Path(folder), clean())
            data = written if isinstance(written, list) else [written]
            line = judge(name, data, dress.maps, dress.expected, dress.says, commands, alone=alone)
        else:
            fault = _faults()[name]
            file = Path(folder) / "log.csv"
            file.write_text(fault.text)
            line = judge(
                name, [file] * (1 + fault.twice), (), fault.expected, (), commands,
                fault.less, fault.finding, alone,
            )  # fmt: skip
        line.wrong = line.wrong.replace(f"{folder}/", "")
        line.said = line.said.replace(f"{folder}/", "")
    return line
